"""Structured blocks of hexes. Lengths in m."""

from __future__ import annotations

import numpy as np

from meshing.mesh_file import Mesh


def make_box_hex(low: np.ndarray, high: np.ndarray, cells: tuple[int, int, int],
                 tissue: str) -> Mesh:
    """Block [low, high] of cells[d] equal hexes along each direction.

    Node and face sets x_min, x_max, y_min, y_max, z_min, z_max; node set all; face set wet: the
    whole outside."""
    nx, ny, nz = cells
    axes = [np.linspace(low[d], high[d], cells[d] + 1) for d in range(3)]
    Z, Y, X = np.meshgrid(axes[2], axes[1], axes[0], indexing="ij")
    nodes = np.column_stack([X.ravel(), Y.ravel(), Z.ravel()])
    number = np.arange(len(nodes)).reshape(nz + 1, ny + 1, nx + 1)
    corner = number[:-1, :-1, :-1].ravel()
    along_x, along_y, along_z = 1, nx + 1, (nx + 1) * (ny + 1)
    bottom = np.column_stack(
        [corner, corner + along_x, corner + along_x + along_y, corner + along_y]
    )
    hexes = np.column_stack([bottom, bottom + along_z])
    mesh = Mesh(nodes=nodes, cells={"hex8": hexes.astype(np.int32)})
    mesh.tissues = [tissue]
    mesh.tissue["hex8"] = np.zeros(len(hexes), dtype=np.int32)
    for axis, name in enumerate("xyz"):
        for side, suffix in ((0, "min"), (-1, "max")):
            grid = np.take(number, side, axis=2 - axis)
            quads = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], axis=-1)
            quads = quads.reshape(-1, 4)
            # Index order is (slow, fast): x has (z, y), y has (z, x), z has (y, x).
            outward_as_is = (axis != 1) == (side == -1)
            faces = quads if outward_as_is else quads[:, ::-1]
            mesh.face_sets[f"{name}_{suffix}"] = faces.astype(np.int32)
            mesh.node_sets[f"{name}_{suffix}"] = np.unique(grid).astype(np.int32)
    mesh.node_sets["all"] = np.arange(len(nodes), dtype=np.int32)
    mesh.face_sets["wet"] = np.concatenate(list(mesh.face_sets.values()))
    return mesh
