"""The piston on its spring as a solid solver in Python, to show the twin of the link library."""

import math
import os
import sys

BUILD = os.environ.get("OCU_BUILD", "build/release")
sys.path.insert(0, os.path.join(BUILD, "python"))

import numpy as np

from ocublast_link import Participant

AMPLITUDE, PHASE, MASS, STABLE_STEP = 1e-6, 1.0, 5.0, 0.005
OMEGA = PHASE * math.sqrt(1.4)
SPRING = MASS * OMEGA**2 - math.sqrt(1.4) * OMEGA / math.tan(PHASE)

vertices = np.array([[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 1.0], [1.0, 1.0, 1.0]])
triangles = np.array([[0, 2, 1], [1, 2, 3]])  # out of the piston: -x


def advance(d, v, p_begin, p_end, window, steps):
    """Velocity Verlet under a load that is linear in the window; position, velocity, work."""
    dt, work = window / steps, 0.0
    for k in range(steps):
        p_a = p_begin + (p_end - p_begin) * k / steps
        p_b = p_begin + (p_end - p_begin) * (k + 1) / steps
        v_half = v + 0.5 * dt * (p_a - SPRING * d) / MASS
        d, before = d + dt * v_half, d
        v = v_half + 0.5 * dt * (p_b - SPRING * d) / MASS
        work += 0.5 * (p_a + p_b) * (d - before)
    return d, v, work


def main():
    d, v, p = 0.0, AMPLITUDE * math.sin(PHASE) * OMEGA, 0.0
    coupler = Participant("solid", "spring.py 1", int(os.environ["OCUBLAST_CASE_HASH"], 16))
    coupler.send_mesh("piston", vertices, triangles)
    unit_x = np.tile([1.0, 0.0, 0.0], (len(vertices), 1))
    coupler.ready(STABLE_STEP, velocity=v * unit_x)
    for order in coupler.orders():
        p_end = float(order.overpressure.mean())
        width = order.t_end - order.t_begin
        d, v, work = advance(d, v, p, p_end, width, order.steps)
        impulse, p = 0.5 * (p + p_end) * width, p_end
        coupler.send(position=vertices + d * unit_x, velocity=v * unit_x, stable_step=STABLE_STEP,
                     steps_taken=order.steps, work=work, impulse=(impulse, 0.0, 0.0), mass_per_area=MASS)
    coupler.goodbye()


if __name__ == "__main__":
    main()
