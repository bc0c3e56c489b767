"""Curves over time from the CSV files, and the bar of the run time's split."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

FILES = ("probes.csv", "globals.csv", "solid_probes.csv", "solid_globals.csv")
US = 1e6
# Columns end in their unit: the longest suffix that fits is the unit.
UNITS = ("J_m3", "kg_m3", "kg_m_s", "N_m_s", "N_s", "Pa_s", "m_s2", "m_s", "m2", "m3", "Pa", "K", "m", "J", "N", "kg",
         "s", "1")

# Longest first: "pressure" ends "overpressure" and "pressure_mean" does not end in it.
QUANTITIES = (*(f"{cell}_{statistic}" for cell in
                ("principal_stress", "principal_strain", "deviatoric_norm", "volume_ratio", "energy_density")
                for statistic in ("max", "mean", "min")),
              "principal_stress", "principal_strain", "deviatoric_norm", "volume_ratio", "energy_density",
              "von_mises_mean", "von_mises_max", "von_mises_min", "von_mises", "pressure_mean", "pressure_min",
              "pressure_max", "overpressure", "pressure", "density", "displacement_x",
              "displacement_y", "displacement_z", "displacement", "velocity_x", "velocity_y",
              "velocity_z", "acceleration_x", "acceleration_y", "acceleration_z", "u", "v", "w")
MOST_PANELS = 20


def split_unit(column: str) -> tuple[str, str]:
    for unit in UNITS:
        if column.endswith("_" + unit):
            return column[: -len(unit) - 1], unit
    return column, ""


def quantity_of(column: str) -> tuple[str, str]:
    """What a column shows, apart from its place, and its unit. Columns that agree in both share one
    panel; a column of no known quantity shares it with those of its unit."""
    name, unit = split_unit(column)
    for quantity in QUANTITIES:
        if name == quantity or name.endswith("_" + quantity):
            return quantity, unit
    return "", unit


def read_csv(file: Path) -> tuple[list[str], np.ndarray]:
    with file.open() as stream:
        columns = stream.readline().strip().split(",")
        values = np.array([[float(v) for v in line.split(",")] for line in stream if line.strip()])
    return columns, values.reshape(-1, len(columns))


def curve_figures(out: Path):
    """(caption, figure) per CSV file: one panel per kind of quantity."""
    pictures = []
    for name in FILES:
        file = out / name
        if not file.is_file():
            continue
        columns, values = read_csv(file)
        if len(values) < 2 or len(columns) < 2 or columns[0] != "time_s":
            continue
        panels: dict[tuple[str, str], list[int]] = {}
        for index, column in enumerate(columns[1:], start=1):
            panels.setdefault(quantity_of(column), []).append(index)
        pictures.append((f"{name}.", _panels(columns, values, panels)))
    return pictures


def _panels(columns: list[str], values: np.ndarray, panels: dict) -> plt.Figure:
    chosen = list(panels.items())[:MOST_PANELS]
    rows = -(-len(chosen) // 2)
    figure, axes = plt.subplots(rows, min(2, len(chosen)), squeeze=False, figsize=(11, 2.6 * rows))
    for axis in axes.flat[len(chosen):]:
        axis.set_visible(False)
    for axis, ((quantity, unit), indices) in zip(axes.flat, chosen):
        for index in indices:
            name = split_unit(columns[index])[0]
            axis.plot(values[:, 0] * US, values[:, index], linewidth=0.9,
                      label=name.removesuffix(quantity).rstrip("_") or name)
        axis.set_ylabel(", ".join(filter(None, (quantity.replace("_", " "), unit))), fontsize=8)
        axis.set_xlabel("time, us", fontsize=8)
        axis.tick_params(labelsize=7)
        axis.grid(alpha=0.3)
        if len(indices) <= 10:
            axis.legend(fontsize=6)
    figure.tight_layout()
    return figure


def split_figure(performance: dict):
    """Bars of all wall times in the summary; None without any."""
    seconds = {k: v for k, v in performance.items()
               if k.endswith("_s") and not k.endswith(("_per_s", "_stable_step_s")) and isinstance(v, (int, float))}
    if not seconds:
        return None
    figure, axis = plt.subplots(figsize=(8, 0.4 + 0.3 * len(seconds)))
    names = list(seconds)[::-1]
    axis.barh(names, [seconds[name] for name in names], color="#4878a8")
    for row, name in enumerate(names):
        axis.text(seconds[name], row, f" {seconds[name]:.3g} s", va="center", fontsize=8)
    axis.set_xlabel("wall time, s")
    axis.margins(x=0.15)
    figure.tight_layout()
    return "Wall times (the programs run at the same time: they need not add up).", figure
