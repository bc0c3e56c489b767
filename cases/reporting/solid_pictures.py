"""Pictures of the solid: cells cut by a plane, on the deformed mesh, coloured by a cell field."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection

from reporting.xdmf import Grid, pick, read_series

MM, US = 1e3, 1e6
AXES = "xyz"
CUT_OFFSET = 1e-7  # m
# A hex cut into six tets round its diagonal 0-6.
HEX_TETS = np.array([(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6),
                     (0, 5, 1, 6)])
# Cell fields worth a picture: name, unit, factor.
FIELDS = (("pressure", "kPa", 1e-3), ("von_mises", "kPa", 1e-3))
TET_EDGES = np.array([(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)])


def cut_polygons(points: np.ndarray, cells: np.ndarray, normal: int,
                 position: float) -> tuple[list[np.ndarray], np.ndarray]:
    """Polygons [k, 3] in which cells cross the plane x[normal] = position, and the cell of each."""
    side = points[cells][..., normal] - position
    hit = np.flatnonzero((side.min(axis=1) < 0.0) & (side.max(axis=1) > 0.0))
    tets = HEX_TETS if cells.shape[1] == 8 else np.array([(0, 1, 2, 3)])
    polygons, owners = [], []
    for tet in tets:
        corners = points[cells[hit][:, tet]]
        d = corners[..., normal] - position
        d = np.where(d == 0.0, 1e-300, d)
        crossing = np.sign(d[:, TET_EDGES[:, 0]]) != np.sign(d[:, TET_EDGES[:, 1]])
        for row in np.flatnonzero(crossing.sum(axis=1) >= 3):
            a, b = TET_EDGES[crossing[row]].T
            part = d[row, a] / (d[row, a] - d[row, b])
            polygon = corners[row, a] + part[:, None] * (corners[row, b] - corners[row, a])
            if len(polygon) == 4:  # order the quad round its middle
                flat = np.delete(polygon - polygon.mean(axis=0), normal, axis=1)
                polygon = polygon[np.argsort(np.arctan2(flat[:, 1], flat[:, 0]))]
            polygons.append(polygon)
            owners.append(hit[row])
    return polygons, np.array(owners, dtype=int)


def _cells(grid: Grid) -> np.ndarray | None:
    if grid.topology is None or grid.topology_kind not in ("Hexahedron", "Tetrahedron"):
        return None
    width = 8 if grid.topology_kind == "Hexahedron" else 4
    return grid.topology.read().reshape(-1, width)


def solid_pictures(out: Path, axis: str | None, position: float, count: int = 6):
    """(caption, figure) per field of the solid series in `out`, cut across `axis` at `position`."""
    frames = pick(read_series(out / "solid.xmf"), count)
    normal = AXES.index(axis) if axis else 1
    pictures = []
    for name, unit, factor in FIELDS:
        usable = [f for f in frames if any(name in grid.attributes for grid in f.grids)]
        if usable:
            pictures.append(_cut_series(usable, name, unit, factor, normal, position))
    return [picture for picture in pictures if picture]


def _cut_series(frames, name: str, unit: str, factor: float, normal: int, position: float):
    across, up = [a for a in range(3) if a != normal]
    columns = min(3, len(frames))
    rows = -(-len(frames) // columns)
    figure, panels = plt.subplots(rows, columns, squeeze=False, figsize=(4.2 * columns, 4.0 * rows))
    drawn = False
    for panel in panels.flat[len(frames):]:
        panel.set_visible(False)
    for panel, frame in zip(panels.flat, frames):
        for grid in frame.grids:
            cells = _cells(grid)
            if cells is None or name not in grid.attributes or grid.centre(name) != "Cell":
                continue
            # A plane of mesh nodes lies between cells: cut a hair beside it.
            polygons, owners = cut_polygons(grid.geometry[0].read(), cells, normal,
                                            position + CUT_OFFSET)
            if not polygons:
                continue
            values = grid.attribute(name).ravel()[owners] * factor
            flat = [polygon[:, [across, up]] * MM for polygon in polygons]
            drawing = PolyCollection(flat, array=values, cmap="viridis", edgecolors="face",
                                     linewidths=0.2, rasterized=True)
            panel.add_collection(drawing)
            figure.colorbar(drawing, ax=panel, shrink=0.8, label=f"{name.replace('_', ' ')}, {unit}")
            drawn = True
        panel.autoscale_view()
        panel.set_aspect("equal")
        panel.set_title(f"t = {frame.time * US:.4g} us", fontsize=9)
        panel.set_xlabel(f"{AXES[across]}, mm")
        panel.set_ylabel(f"{AXES[up]}, mm")
    figure.tight_layout()
    if not drawn:
        plt.close(figure)
        return None
    text = f"{name.replace('_', ' ')} in the solid, plane {AXES[normal]} = {position * MM:g} mm."
    return text[0].upper() + text[1:], figure
