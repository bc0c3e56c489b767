"""A rigid body on a spring, in place of our solid: cases/run piston --solid 'python3 .../rigid.py'.

It moves along the free directions of the case only: mass from the mesh's volume and the density of
the first material; OCU_SPRING_N_M: stiffness to ground."""

import os
import sys

from solid_program import arguments, forces, read_case, serve

import h5py
import numpy as np


class RigidBody:
    def __init__(self, case, options):
        with h5py.File(options.mesh_dir / case["solid"]["mesh"]) as mesh:
            nodes, faces = mesh["nodes"][:], mesh["face_sets/wet"][:]
        used = np.unique(faces[faces >= 0])
        number = np.full(len(nodes), -1)
        number[used] = np.arange(len(used))
        quads = faces[:, 3] >= 0
        self.vertices = nodes[used]
        self.triangles = number[np.concatenate([faces[:, [0, 1, 2]], faces[quads][:, [0, 2, 3]]])]
        corner = self.vertices[self.triangles]
        volume = np.einsum("ij,ij->i", corner[:, 0], np.cross(corner[:, 1], corner[:, 2])).sum() / 6.0
        self.mass = case["solid"]["material"][0]["density_kg_m3"] * volume
        held = {d for fixed in case["solid"].get("fixed", []) for d in fixed["directions"]}
        self.free = np.array([axis not in held for axis in "xyz"], dtype=float)
        self.spring = float(os.environ.get("OCU_SPRING_N_M", "0"))
        self.area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1).sum() / 2
        # Verlet on a spring is stable below 2 / omega; a free body takes any step.
        self.stable_step = 0.2 * np.sqrt(self.mass / self.spring) if self.spring > 0.0 else 1.0
        self.d, self.v = np.zeros(3), np.zeros(3)

    def state(self):
        return {"d": self.d, "v": self.v}

    def set_state(self, kept):
        self.d, self.v = kept["d"], kept["v"]

    def force(self, load):
        by_vertex = load if load.ndim == 2 else forces(self.vertices, self.triangles, load)
        return self.free * by_vertex.sum(axis=0)

    def advance(self, before, after, width, steps):
        """Velocity Verlet under a force linear in the window."""
        f0, f1, dt = self.force(before), self.force(after), width / max(steps, 1)
        work, impulse = 0.0, 0.5 * width * (f0 + f1)
        for k in range(max(steps, 1)):
            fa, fb = f0 + (f1 - f0) * k * dt / width, f0 + (f1 - f0) * (k + 1) * dt / width
            half = self.v + 0.5 * dt * (fa - self.spring * self.d) / self.mass
            step = dt * half
            self.d, self.v = self.d + step, half + 0.5 * dt * (fb - self.spring * (self.d + step)) / self.mass
            work += float(0.5 * (fa + fb) @ step)
        return self.vertices + self.d, np.tile(self.v, (len(self.vertices), 1)), work, impulse


def main():
    options = arguments()
    case = read_case(options)
    if options.check:
        return 0
    body = RigidBody(case, options)
    serve("rigid.py 1", body, options, body.mass / body.area, takes_force=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
