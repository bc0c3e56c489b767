#!/usr/bin/python3
"""Prints targets.csv of a pressure wave in a column that cannot widen (d'Alembert, exact).

A pressure p(t) on the end of a half-infinite column moves that end at v = p / (rho c), with
c = sqrt((K + 4 G / 3) / rho); at a fixed end the stress doubles.

Made with: cases/bar_wave/reference/exact.py > cases/bar_wave/reference/targets.csv
"""

DENSITY, K, G, LENGTH, AREA = 1000.0, 2.0e8, 1.5e8, 1.0, 1.0e-4
PRESSURE, RAMP, END = 1.0e5, 1.58113883e-4, 2.37170825e-3

M = K + 4.0 * G / 3.0  # modulus of confined compression, Pa
c = (M / DENSITY) ** 0.5
velocity = PRESSURE / (DENSITY * c)
# The end is at rest at first, then accelerates evenly over the ramp; nothing has returned before 2 L / c.
assert END < 2.0 * LENGTH / c
displacement = velocity * (END - RAMP / 2.0)
work = PRESSURE * velocity * AREA * (END - RAMP + RAMP / 3.0)
mean_pressure = PRESSURE * K / M  # minus a third of the trace of the stress

source = "exact one-dimensional wave, c = sqrt((K + 4 G / 3) / rho)"
print("name,value,unit,tolerance,source")
print(f'loaded_end_displacement_x_extreme,{displacement:.9e},m,0.005,"{source}"')
print(f'solid_external_work,{work:.9e},J,0.005,"{source}"')
# The ramp is 20 coarse cells long: what is left of dispersion rings by 1 or 2 %.
print(f'middle_pressure_peak,{mean_pressure:.6f},Pa,0.03,"{source}"')
print(f'fixed_end_pressure_peak,{2.0 * mean_pressure:.6f},Pa,0.03,"{source}"')
