#!/usr/bin/python3
"""Prints targets.csv: the exact point blast of the charge's energy at the places of the probes.

A point is another source than a ball of 14.7 mm, so no tolerance is claimed: the table shows how far the
two agree. Made with: cases/eye_pyrodex/reference/point_source.py > cases/eye_pyrodex/reference/targets.csv
"""

import csv
from pathlib import Path

import numpy as np

ENERGY, P_0, T_0, GAMMA, R = 60.0, 101325.0, 293.15, 1.4, 287.05
c_0 = (GAMMA * R * T_0) ** 0.5
LENGTH = (ENERGY / P_0) ** (1.0 / 3.0)

with (Path(__file__).parent / "point_blast_gamma14.csv").open() as stream:
    rows = list(csv.reader(stream))[1:]
table = np.array([[float(value) for value in row[:7]] for row in rows])


def at(distance: float, column: int) -> float:
    """Column of the table at a distance from the source; power laws between its points."""
    x = np.log(distance / LENGTH)
    return float(np.exp(np.interp(x, np.log(table[:, 0]), np.log(np.maximum(table[:, column], 1e-30)))))


def arrival(distance: float) -> float:
    return at(distance, 3) * LENGTH / c_0


source = f"exact point blast of {ENERGY:g} J, gamma 1.4 (point_blast_gamma14.csv)"
print("name,value,unit,tolerance,source")
for name, distance in (("axis_35mm", 0.035), ("axis_50mm", 0.05), ("axis_60mm", 0.06),
                       ("facing", 0.068)):
    print(f'{name}_arrival,{arrival(distance):.6e},s,,"{source}"')
print(f'charge_side_arrival,{arrival(0.05):.6e},s,,"{source}"')
print(f'charge_side_peak_overpressure,{at(0.05, 1) * P_0:.6g},Pa,,"{source}"')
print(f'charge_side_impulse,{at(0.05, 5) * P_0 * LENGTH / c_0:.6g},Pa s,,"{source}"')
for a, b in ((35, 50), (50, 60)):
    speed = (b - a) * 1e-3 / (arrival(b * 1e-3) - arrival(a * 1e-3))
    print(f'front_speed_{a}_to_{b}mm,{speed:.6g},m/s,,"{source}"')
reflected = f"{source}; normal reflection of the front at 7 cm"
print(f'globe_peak_wall_overpressure,{at(0.07, 6) * P_0:.6g},Pa,,"{reflected}"')
