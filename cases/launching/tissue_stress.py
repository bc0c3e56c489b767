"""Stress of tissues beyond the largest of single elements: what 1 % of a tissue's volume exceeds.

The largest value of any element belongs to the mesh as much as to the tissue: beside a clamp, an edge of
the load or a sharp corner it grows with every refinement. What a share of the volume exceeds does not."""

from __future__ import annotations

from pathlib import Path

import numpy as np

SHARE = 0.01
# Cells by their number of nodes, each cut into tets: hexes, wedges, tets with and without middle nodes.
TETS = {8: ((0, 1, 3, 4), (1, 2, 3, 6), (1, 3, 4, 6), (1, 4, 5, 6), (3, 4, 6, 7)),
        6: ((0, 1, 2, 3), (1, 2, 3, 4), (2, 3, 4, 5)), 4: ((0, 1, 2, 3),), 10: ((0, 1, 2, 3),)}


def volumes(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Volume [m^3] of each cell [n, 4|6|8|10] of points [k, 3]; hexes by five tets, exact for plane faces."""
    total = np.zeros(len(cells))
    for tet in TETS[cells.shape[1]]:
        a, b, c, d = (points[cells[:, i]] for i in tet)
        total += np.abs(np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a)) / 6.0
    return total


def exceeded(values: np.ndarray, weights: np.ndarray, share: float = SHARE) -> float:
    """The value that this share of all weight lies at or above."""
    order = np.argsort(values)[::-1]
    reached = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(reached, share * reached[-1])])


def tissue_quantities(folder: Path) -> list[dict]:
    """For each tissue of the solid whose fields lie in FOLDER/solid the von Mises stress that 1 % of its volume
    exceeds, the largest of all output times (its peak between them is missed); nothing where that is not written."""
    mesh_file = folder / "solid" / "mesh.h5"
    if not mesh_file.is_file():
        return []
    import h5py  # slow to load: only here

    found: dict[str, float] = {}
    with h5py.File(mesh_file) as mesh:
        names = [n.decode() for n in mesh["tissues"][:]]
        blocks = [b for b in mesh if isinstance(mesh[b], h5py.Group) and "cells" in mesh[b] and "tissue" in mesh[b]]
        for file in sorted((folder / "solid").glob("[0-9]*.h5")):
            with h5py.File(file) as frame:
                if any(f"{b}/von_mises" not in frame for b in blocks):
                    return []
                cells = {b: mesh[b]["cells"][:] for b in blocks}
                if any(c.shape[1] not in TETS for c in cells.values()):
                    return []
                points = frame["position"][:]
                stress = np.concatenate([frame[f"{b}/von_mises"][:] for b in blocks])
                volume = np.concatenate([volumes(points, cells[b]) for b in blocks])
                tissue = np.concatenate([mesh[b]["tissue"][:] for b in blocks])
            for k, name in enumerate(names):
                if (mine := tissue == k).any():
                    found[name] = max(found.get(name, 0.0), exceeded(stress[mine], volume[mine]))
    return [{"name": f"{name}_von_mises_of_1_percent_peak", "value": value, "unit": "Pa"} for name, value in found.items()]
