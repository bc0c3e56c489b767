#!/usr/bin/python3
"""Prints targets.csv of a free piston that a shock drives along a tube.

Simple-wave theory (Landau & Lifshitz, Fluid Mechanics, section 101): the gas at a moving piston face
has p = p0 (1 -+ (gamma - 1)/2 v / c0)^(2 gamma / (gamma - 1)), exact as long as no wave returns.
At the driven face the uniform gas is that behind the reflected shock, at the other the gas ahead.

Made with: cases/piston/reference/exact.py > cases/piston/reference/targets.csv
"""

from pathlib import Path
import sys

from scipy.integrate import solve_ivp

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "shock_wall" / "reference"))
from exact import GAMMA, P_1, R, T_1, c_1, p_2, p_5, rho_2, speed  # noqa: E402

AREA_MASS = 1.0  # kg/m^2: 100 kg/m^3 times 10 mm
X_SHOCK, X_FACE = 0.2, 0.5
END = 1.4e-3

# Density behind the reflected shock: the shock jump from state 2 at pressure ratio p5/p2.
z = p_5 / p_2
g = (GAMMA + 1.0) / (GAMMA - 1.0)
rho_5 = rho_2 * (1.0 + g * z) / (g + z)
c_5 = (GAMMA * p_5 / rho_5) ** 0.5
arrival = (X_FACE - X_SHOCK) / speed
EXPONENT = 2.0 * GAMMA / (GAMMA - 1.0)


def driven(v: float) -> float:
    return p_5 * (1.0 - 0.5 * (GAMMA - 1.0) * v / c_5) ** EXPONENT


def rear(v: float) -> float:
    return P_1 * (1.0 + 0.5 * (GAMMA - 1.0) * v / c_1) ** EXPONENT


def motion(_, y):
    return [y[1], (driven(y[1]) - rear(y[1])) / AREA_MASS]


end = solve_ivp(motion, [arrival, END], [0.0, 0.0], rtol=1e-10, atol=1e-14).y[:, -1]

if __name__ == "__main__":
    source = "simple waves at a moving piston; shock reflection by Rankine-Hugoniot"
    print("name,value,unit,tolerance,source")
    # A captured shock overshoots by 1 to 3 %. The full reflected pressure holds for an instant only,
    # shorter than the captured front takes to arrive: the peak on the face falls short of it.
    print(f'piston_peak_wall_overpressure,{p_5 - P_1:.4f},Pa,0.06,"{source}"')
    print(f'incident_peak_overpressure,{p_2 - P_1:.4f},Pa,0.04,"{source}"')
    print(f'piston_displacement_x_extreme,{end[0]:.9e},m,0.02,"{source}"')
    # The sound in the piston adds p / (rho c) = 0.7 m/s to its nodes.
    print(f'solid_speed_largest,{end[1]:.9e},m/s,0.04,"{source}"')
    # On the 1 m^2 that absent directions stand for.
    energy = 0.5 * AREA_MASS * end[1] ** 2
    print(f'solid_kinetic_energy_peak,{energy:.9e},J,0.04,"{source}"')
