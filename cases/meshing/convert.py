"""Meshes of other programs, read by meshio: Gmsh 4.1, Abaqus .inp, Exodus, VTU, STL, OBJ.

Volume cells are 8-node hexes, tets of 4 and 10 nodes and 6-node wedges. Quads alone that lie in the
plane z = 0 make a plane mesh, whose faces are its edges; other triangles and quads a surface. Tissues come from
named groups (Gmsh physical volumes, Abaqus and Exodus element sets) or else from an integer cell
field called `tissue`. Named groups of faces become face sets, turned outward; point sets become node
sets. Without a face set `wet` the whole boundary of the volume cells becomes it.
"""

from __future__ import annotations

import re
from pathlib import Path

import meshio
import numpy as np

from meshing import quality
from meshing.mesh_file import Mesh, MeshError
from meshing.surfaces import merge_points

LENGTH_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254}
VOLUME_KINDS = {"hexahedron": "hex8", "tetra": "tet4", "tetra10": "tet10", "wedge": "wedge6"}
FACE_KINDS = {"quad": 4, "triangle": 3, "triangle6": 3}  # corners
PLANE_KINDS = {"quad": "quad4"}
EDGE_KINDS = {"line": 2}
IGNORED_KINDS = ("vertex", "line")


def convert(file: Path, length_unit: str = "m") -> Mesh:
    """The mesh in `file`, lengths given in `length_unit`. MeshError says what is not understood."""
    if not file.is_file():
        raise MeshError(f"{file}: no such file")
    try:
        source = meshio.read(file)
    except (Exception, SystemExit) as error:  # meshio ends the program on some faults
        raise MeshError(f"{file}: meshio cannot read it: {error}") from error
    for block in source.cells:
        if block.type not in (*VOLUME_KINDS, *FACE_KINDS, *IGNORED_KINDS):
            raise MeshError(
                f"{file}: cells of type {block.type}; accepted are 8-node hexes, tets of 4 and 10 nodes, "
                "6-node wedges and surfaces of triangles and quads: make a first-order mesh"
            )
    points = np.asarray(source.points, dtype=float)
    if points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points))])
    points = points * LENGTH_UNITS[length_unit]
    types = {block.type for block in source.cells} - set(IGNORED_KINDS)
    if types & set(VOLUME_KINDS):
        mesh = _volume_mesh(source, points, file, VOLUME_KINDS, FACE_KINDS)
    elif types == {"quad"} and not points[:, 2].any():
        mesh = _volume_mesh(source, points, file, PLANE_KINDS, EDGE_KINDS)
    else:
        mesh = _surface_mesh(source, points, file)
    return _without_loose_nodes(mesh)


def _clean(name: str) -> str:
    """A name usable in case files and as HDF5 path."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", name.strip()) or "unnamed"


def _groups(source: meshio.Mesh, kinds: dict, faces: dict) -> dict[str, list[np.ndarray]]:
    """Named groups of cells: for each cell block the indices that belong to it."""
    groups: dict[str, list[np.ndarray]] = {}
    empty = np.empty(0, dtype=int)
    tags = source.cell_data.get("gmsh:physical")
    if tags is not None:
        top = 2 if kinds is PLANE_KINDS else 3
        for name, (tag, dimension) in source.field_data.items():
            wanted = {top: kinds, top - 1: faces}.get(int(dimension), {})
            groups[_clean(name)] = [
                np.flatnonzero(tags[b] == tag) if block.type in wanted else empty
                for b, block in enumerate(source.cells)
            ]
    for name, chosen in (source.cell_sets or {}).items():
        if name.startswith("gmsh:"):
            continue
        groups[_clean(name)] = [
            empty if indices is None else np.asarray(indices, dtype=int) for indices in chosen
        ]
    return groups


def _volume_mesh(source: meshio.Mesh, points: np.ndarray, file: Path, kinds: dict, faces: dict) -> Mesh:
    """`kinds` of cells make the body, `faces` bound it."""
    mesh = Mesh(nodes=points)
    groups = _groups(source, kinds, faces)
    blocks: dict[str, list[int]] = {kind: [] for kind in kinds.values()}
    for b, block in enumerate(source.cells):
        if block.type in kinds:
            blocks[kinds[block.type]].append(b)
    names, tissue_of_block = _tissues(source, groups, kinds)
    mesh.tissues = names
    for kind, members in blocks.items():
        if members:
            mesh.cells[kind] = np.concatenate([source.cells[b].data for b in members]).astype(np.int32)
            mesh.tissue[kind] = np.concatenate([tissue_of_block[b] for b in members]).astype(np.int32)
    if "quad4" in mesh.cells:  # counter-clockwise
        quads = mesh.cells["quad4"]
        clockwise = quality.quad_corner_areas(points, quads).sum(axis=1) < 0.0
        quads[clockwise] = quads[clockwise][:, ::-1]
    mesh.node_sets = {
        _clean(name): np.unique(np.asarray(nodes, dtype=np.int32))
        for name, nodes in (source.point_sets or {}).items()
    }
    boundary = quality.boundary_faces(mesh.cells)
    mesh.face_sets = _face_sets(source, groups, boundary, file, faces)
    mesh.face_sets.setdefault("wet", boundary)
    return mesh


def _tissues(source, groups, kinds) -> tuple[list[str], dict[int, np.ndarray]]:
    """Names, and per cell block the tissue of each cell; cells in no group are `unnamed`."""
    tissue = {b: np.full(len(block.data), -1) for b, block in enumerate(source.cells)}
    names: list[str] = []
    for name, chosen in groups.items():
        hits = [b for b, block in enumerate(source.cells)
                if block.type in kinds and len(chosen[b])]
        fresh = [b for b in hits if np.any(tissue[b][chosen[b]] < 0)]
        if not fresh:  # no volume cells, or a second name for cells that have one
            continue
        names.append(name)
        for b in fresh:
            free = chosen[b][tissue[b][chosen[b]] < 0]
            tissue[b][free] = len(names) - 1
    if not names and "tissue" in source.cell_data:
        values = source.cell_data["tissue"]
        volume = [b for b, block in enumerate(source.cells) if block.type in kinds]
        found = np.unique(np.concatenate([np.asarray(values[b], dtype=int) for b in volume]))
        names = [f"tissue_{value}" for value in found]
        for b in volume:
            tissue[b] = np.searchsorted(found, np.asarray(values[b], dtype=int))
    left = [b for b, block in enumerate(source.cells)
            if block.type in kinds and np.any(tissue[b] < 0)]
    if left:
        names.append("unnamed")
        for b in left:
            tissue[b][tissue[b] < 0] = len(names) - 1
    return names, tissue


def _face_sets(source, groups, boundary: np.ndarray, file: Path, kinds: dict) -> dict[str, np.ndarray]:
    """Groups of faces as sets, each face in the outward order of the boundary."""
    outward = {tuple(sorted(face)): face for face in boundary.tolist()}
    sets: dict[str, np.ndarray] = {}
    for name, chosen in groups.items():
        faces = []
        for b, block in enumerate(source.cells):
            if block.type not in kinds or not len(chosen[b]):
                continue
            corners = kinds[block.type]
            for nodes in block.data[chosen[b]][:, :corners].tolist():
                key = tuple(sorted([*nodes, *[-1] * (4 - corners)]))
                if key not in outward:
                    raise MeshError(
                        f"{file}: face set {name} holds a face that is not on the outside of the "
                        f"volume cells (nodes {nodes})"
                    )
                faces.append(outward[key])
        if faces:
            sets[name] = np.array(faces, dtype=np.int32)
    return sets


def _surface_mesh(source: meshio.Mesh, points: np.ndarray, file: Path) -> Mesh:
    triangles = []
    for block in source.cells:
        if block.type == "triangle":
            triangles.append(block.data)
        elif block.type == "quad":
            triangles += [block.data[:, [0, 1, 2]], block.data[:, [0, 2, 3]]]
    if not triangles:
        raise MeshError(f"{file}: neither volume cells nor triangles in it")
    # STL repeats every vertex for each triangle.
    nodes, cells = merge_points(points, np.concatenate(triangles))
    p = nodes[cells] - nodes.mean(axis=0)
    if np.einsum("ij,ij->", p[:, 0], np.cross(p[:, 1], p[:, 2])) < 0.0:
        cells = cells[:, ::-1]
    cells = cells.astype(np.int32)
    wet = np.column_stack([cells, np.full(len(cells), -1, dtype=np.int32)])
    return Mesh(nodes=nodes, cells={"tri3": cells}, face_sets={"wet": wet})


def _without_loose_nodes(mesh: Mesh) -> Mesh:
    """Drops nodes that no cell uses: they would have no mass."""
    used = np.zeros(len(mesh.nodes), dtype=bool)
    for cells in mesh.cells.values():
        used[cells] = True
    if used.all():
        return mesh
    number = np.where(used, np.cumsum(used) - 1, -1).astype(np.int32)
    mesh.nodes = mesh.nodes[used]
    mesh.cells = {kind: number[cells] for kind, cells in mesh.cells.items()}
    mesh.node_sets = {name: number[nodes][number[nodes] >= 0]
                      for name, nodes in mesh.node_sets.items()}
    mesh.face_sets = {name: np.where(faces >= 0, number[faces], -1).astype(np.int32)
                      for name, faces in mesh.face_sets.items()}
    return mesh
