#!/usr/bin/python3
"""Prints targets.csv of a normal shock that meets a rigid wall (Rankine-Hugoniot, ideal gas).

Made with: cases/shock_wall/reference/exact.py | grep -v "^#" > cases/shock_wall/reference/targets.csv
"""

GAMMA, R = 1.4, 287.05
P_1, T_1, MACH = 101325.0, 288.15, 1.21
X_0, X_NEAR, X_FAR = 0.3, 0.4, 0.6

c_1 = (GAMMA * R * T_1) ** 0.5
rho_1 = P_1 / (R * T_1)
speed = MACH * c_1
p_2 = P_1 * (1.0 + 2.0 * GAMMA / (GAMMA + 1.0) * (MACH**2 - 1.0))
rho_2 = rho_1 * (GAMMA + 1.0) * MACH**2 / ((GAMMA - 1.0) * MACH**2 + 2.0)
u_2 = speed * (1.0 - rho_1 / rho_2)
z = p_2 / P_1
p_5 = p_2 * ((3.0 * GAMMA - 1.0) * z - (GAMMA - 1.0)) / ((GAMMA - 1.0) * z + GAMMA + 1.0)

if __name__ == "__main__":
    source = "Rankine-Hugoniot relations; ideal gas gamma 1.4"
    print("name,value,unit,tolerance,source")
    # A captured shock overshoots by 1 to 3 % on any grid.
    print(f'near_peak_overpressure,{p_2 - P_1:.4f},Pa,0.04,"{source}"')
    print(f'wall_peak_overpressure,{p_5 - P_1:.4f},Pa,0.04,"{source}"')
    print(f'front_speed,{speed:.5f},m/s,0.01,"{source}"')
    # Not part of the table: what the case file says of the gas behind the shock.
    print(f"# behind the shock: p {p_2:.6f} Pa, T {p_2 / (R * rho_2):.8f} K, u {u_2:.8f} m/s")
