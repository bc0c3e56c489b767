"""`cases/mesh check`: what a mesh is worth, in words and figures, and the faults that stop a run."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from meshing import quality
from meshing.mesh_file import Mesh, read_mesh

STEP_FACTOR = 0.7  # of V / (A_max c) for hexes; of altitude / c for tets 0.8
TET_STEP_FACTOR = 0.8
TEN_NODE_STEP_FACTOR = 0.4  # its nodes in the middle of edges halve the distance


def check(file: Path, sound_speed: float) -> tuple[list[str], list[str]]:
    """Lines to print, and faults. sound_speed in m/s is for the suggested step."""
    mesh = read_mesh(file)
    low, high = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
    counts = ", ".join(f"{len(cells)} {kind}" for kind, cells in mesh.cells.items())
    lines = [
        f"{file}: {len(mesh.nodes)} nodes, {counts}",
        "extent x {:.6g} to {:.6g}, y {:.6g} to {:.6g}, z {:.6g} to {:.6g} m".format(
            *np.column_stack([low, high]).ravel()
        ),
    ]
    faults: list[str] = []
    if not np.isfinite(mesh.nodes).all():
        faults.append("a node is not finite")
    for kind, cells in mesh.cells.items():
        if cells.min() < 0 or cells.max() >= len(mesh.nodes):
            faults.append(f"{kind}: a cell names a node that does not exist")
            return lines, faults
    duplicates = quality.duplicate_nodes(mesh.nodes)
    lines.append(f"duplicate nodes: {duplicates}")
    for kind in mesh.tissue:
        if kind in mesh.cells:
            _check_volume(mesh, kind, sound_speed, lines, faults)
    for name, faces in mesh.face_sets.items():
        _check_faces(mesh, name, faces, lines, faults)
    for name, nodes in mesh.node_sets.items():
        lines.append(f"node set {name}: {len(nodes)} nodes")
    return lines, faults


def _check_volume(mesh: Mesh, kind: str, c: float, lines: list[str], faults: list[str]) -> None:
    cells = mesh.cells[kind]
    if kind == "hex8":
        jacobians = quality.hex_gauss_jacobians(mesh.nodes, cells)
        volumes, inverted = jacobians.sum(axis=1), np.flatnonzero(jacobians.min(axis=1) <= 0.0)
        scaled = quality.hex_scaled_jacobians(mesh.nodes, cells)
        one, five = np.percentile(scaled, [1, 5])
        lines.append(f"hex8 scaled Jacobian: min {scaled.min():.3f}, 1 % {one:.3f}, "
                     f"5 % {five:.3f}, mean {scaled.mean():.3f}")
        lengths, factor = quality.hex_lengths(mesh.nodes, cells), STEP_FACTOR
    elif kind == "quad4":  # per metre of thickness
        corners = quality.quad_corner_areas(mesh.nodes, cells)
        volumes, inverted = corners.mean(axis=1), np.flatnonzero(corners.min(axis=1) <= 0.0)
        sides = np.roll(mesh.nodes[cells], -1, axis=1) - mesh.nodes[cells]
        lengths = volumes / np.linalg.norm(sides, axis=2).max(axis=1)
        factor = STEP_FACTOR
    else:
        tets = quality.wedge_tets(cells) if kind == "wedge6" else cells[:, :4]
        parts = quality.tet_volumes(mesh.nodes, tets).reshape(len(cells), -1)
        volumes, inverted = parts.sum(axis=1), np.flatnonzero(parts.min(axis=1) <= 0.0)
        lengths = quality.tet_lengths(mesh.nodes, tets).reshape(len(cells), -1).min(axis=1)
        factor = TEN_NODE_STEP_FACTOR if kind == "tet10" else TET_STEP_FACTOR
    if len(inverted):
        faults.append(f"{kind}: {len(inverted)} inverted cells, the first is {inverted[0]} near "
                      f"{mesh.nodes[cells[inverted[0]]].mean(axis=0)} m")
    lines.append(f"{kind} volume: {volumes.sum():.6g} m^3; smallest length {lengths.min():.4g} m; "
                 f"step about {factor * lengths.min() / c:.3g} s at {c:g} m/s")
    for index, name in enumerate(mesh.tissues):
        chosen = mesh.tissue[kind] == index
        if chosen.any():
            lines.append(f"  {name}: {np.count_nonzero(chosen)} cells, {volumes[chosen].sum():.6g} "
                         f"m^3, smallest length {lengths[chosen].min():.4g} m")


def _check_faces(mesh: Mesh, name: str, faces: np.ndarray, lines: list[str],
                 faults: list[str]) -> None:
    figures = quality.SurfaceFigures(mesh.nodes, faces)
    if figures.closed:
        shape = f"closed, Euler number {figures.euler}, encloses {figures.volume:.6g} m^3"
    else:
        shape = f"open ({figures.open_edges} border edges)"
    lines.append(f"face set {name}: {len(faces)} faces, {figures.area:.6g} m^2, {shape}")
    if name != "wet":
        return
    if not figures.closed:
        faults.append(f"wet: not closed: {figures.open_edges} open and "
                      f"{figures.branching_edges} branching edges")
    elif not figures.outward:
        faults.append(f"wet: not oriented outward: {figures.repeated_directions} edges run twice "
                      f"the same way, enclosed volume {figures.volume:.4g} m^3")
