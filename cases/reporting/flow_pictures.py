"""Pictures of the gas: a slice of overpressure per time, or curves along x for a 1-D case."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from reporting.xdmf import Frame, pick, read_series

AXES = "xyz"
MM, KPA, US = 1e3, 1e-3, 1e6  # from m, Pa, s


def flow_pictures(out: Path, axis: str | None, position: float, count: int = 6):
    """(caption, figure) of the flow series in `out`: cut across `axis` at `position` (m)."""
    frames = pick(read_series(out / "flow.xmf"), count)
    if not frames:
        return []
    grid = frames[0].grids[0]
    faces = [item.read() for item in grid.geometry]
    present = [len(f) > 2 for f in faces]
    if sum(present) == 1:
        return [_curves(frames, faces[0])]
    normal = AXES.index(axis) if axis else (present.index(False) if False in present else 1)
    return [_slices(out, frames, faces, normal, position)]


def _curves(frames: list[Frame], faces: np.ndarray):
    middle = 0.5 * (faces[1:] + faces[:-1])
    figure, panels = plt.subplots(3, 1, figsize=(8, 8), sharex=True)
    for frame in frames:
        grid = frame.grids[0]
        label = f"{frame.time:.4g} s"
        for panel, name in zip(panels, ("overpressure", "density", "velocity")):
            values = grid.attribute(name)
            values = values[..., 0] if name == "velocity" else values
            panel.plot(middle, values.ravel(), label=label, linewidth=1)
    for panel, text in zip(panels, ("overpressure, Pa", "density, kg/m$^3$", "velocity x, m/s")):
        panel.set_ylabel(text)
        panel.grid(alpha=0.3)
    panels[0].legend(fontsize=8)
    panels[-1].set_xlabel("x, m")
    figure.tight_layout()
    return "The gas along x.", figure


def _slices(out: Path, frames: list[Frame], faces: list[np.ndarray], normal: int, position: float):
    across, up = [a for a in range(3) if a != normal]
    cell = int(np.clip(np.searchsorted(faces[normal], position) - 1, 0, len(faces[normal]) - 2))
    columns = min(3, len(frames))
    rows = -(-len(frames) // columns)
    aspect = np.ptp(faces[up]) / np.ptp(faces[across])
    figure, panels = plt.subplots(rows, columns, squeeze=False, sharex=True, sharey=True,
                                  figsize=(4.2 * columns, 0.8 + 4.2 * rows * min(aspect, 2.0)))
    outlines = {round(f.time, 12): f for f in read_series(out / "interface.xmf")}
    for panel in panels.flat[len(frames):]:
        panel.set_visible(False)
    for panel, frame in zip(panels.flat, frames):
        grid = frame.grids[0]
        values = np.take(grid.attribute("overpressure"), cell, axis=2 - normal) * KPA
        if "tag" in grid.attributes:  # inside bodies there is no gas to show
            values = np.ma.masked_where(
                np.take(grid.attribute("tag"), cell, axis=2 - normal) != 0, values)
        # After the cut the array is [up, across], since the last index runs along x.
        low, high = values.min(), values.max()
        limit = max(abs(low), abs(high), 1e-9)
        mesh = panel.pcolormesh(faces[across] * MM, faces[up] * MM, values, cmap="RdBu_r",
                                vmin=-limit, vmax=limit, rasterized=True)
        figure.colorbar(mesh, ax=panel, shrink=0.8, label="overpressure, kPa")
        near = min(outlines, key=lambda t: abs(t - frame.time), default=None)
        if near is not None:
            _outline(panel, outlines[near], normal, position, across, up)
        panel.set_title(f"t = {frame.time * US:.4g} us", fontsize=9)
        panel.set_aspect("equal")
    for panel in panels[-1]:
        panel.set_xlabel(f"{AXES[across]}, mm")
    for panel in panels[:, 0]:
        panel.set_ylabel(f"{AXES[up]}, mm")
    figure.tight_layout()
    return f"Overpressure in the plane {AXES[normal]} = {position * MM:g} mm.", figure


def _outline(panel, frame: Frame, normal: int, position: float, across: int, up: int) -> None:
    """Where the bodies' triangles cross the plane."""
    for grid in frame.grids:
        if grid.topology is None or not grid.geometry:
            continue
        points, triangles = grid.geometry[0].read(), grid.topology.read()
        for segment in plane_segments(points, triangles, normal, position):
            panel.plot(segment[:, across] * MM, segment[:, up] * MM, color="black", linewidth=0.8)


def plane_segments(points: np.ndarray, triangles: np.ndarray, normal: int,
                   position: float) -> np.ndarray:
    """Segments [k, 2, 3] in which triangles cross the plane x[normal] = position."""
    corners = points[triangles]
    # A vertex exactly in the plane counts as above, so that every triangle is cut twice or not.
    above = corners[..., normal] >= position
    crossing = corners[(above.sum(axis=1) % 3) != 0]
    above = crossing[..., normal] >= position
    lone = np.where(above.sum(axis=1) == 1, above.argmax(axis=1), (~above).argmax(axis=1))
    rows = np.arange(len(crossing))
    apex = crossing[rows, lone]
    ends = []
    for step in (1, 2):
        other = crossing[rows, (lone + step) % 3]
        part = (position - apex[:, normal]) / (other[:, normal] - apex[:, normal])
        ends.append(apex + part[:, None] * (other - apex))
    return np.stack(ends, axis=1) if len(crossing) else np.empty((0, 2, 3))
