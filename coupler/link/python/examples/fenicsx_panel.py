"""An elastic panel by FEniCSx (Debian: python3-dolfinx), in place of our solid in cases/panel:

    cases/run panel --solid 'python3 coupler/link/python/examples/fenicsx_panel.py'

Plane strain, small strain, nine-node quadrilaterals, trapezium rule in time (Newmark beta 1/4), unconditionally
stable. Geometry and material from the case: the box of [[mesh]] along y, clamped at y_min. The interface is its own
mesh: both long sides with the nodes of its elements, the caps between them."""

import os
import sys

os.environ.setdefault("OMP_NUM_THREADS", "1")

from solid_program import arguments, forces, read_case, serve

import numpy as np
import scipy.sparse as sparse
import scipy.sparse.linalg
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI

CELLS_PER_LENGTH = 50  # along the panel; one across


def matrices(low, high, material):
    """Mass and stiffness [2 n, 2 n] per depth, coordinates [n, 2] of the nodes."""
    domain = mesh.create_rectangle(MPI.COMM_SELF, [low, high], [1, CELLS_PER_LENGTH], mesh.CellType.quadrilateral)
    space = fem.VectorFunctionSpace(domain, ("Lagrange", 2))
    u, v = ufl.TrialFunction(space), ufl.TestFunction(space)
    shear, bulk = material["shear_modulus_Pa"], material["bulk_modulus_Pa"]

    def strain(w):
        return ufl.sym(ufl.grad(w))

    stress = 2.0 * shear * strain(u) + (bulk - 2.0 * shear / 3.0) * ufl.tr(strain(u)) * ufl.Identity(2)
    forms = (material["density_kg_m3"] * ufl.inner(u, v) * ufl.dx, ufl.inner(stress, strain(v)) * ufl.dx)
    found = []
    for form in forms:
        matrix = fem.petsc.assemble_matrix(fem.form(form))
        matrix.assemble()
        rows, columns, values = matrix.getValuesCSR()
        found.append(sparse.csr_matrix((values, columns, rows)))
    return (*found, space.tabulate_dof_coordinates()[:, :2])


class Panel:
    def __init__(self, case):
        box = case["mesh"][0]
        low, high = np.array(box["low_m"]), np.array(box["high_m"])
        self.depth = high[2] - low[2]
        material = case["solid"]["material"][0]
        self.M, self.K, at = matrices(low[:2], high[:2], material)
        near = lambda a, b: np.abs(a - b) < 1e-9 * (high[1] - low[1])
        sides = [np.flatnonzero(near(at[:, 0], x)) for x in (low[0], high[0])]
        self.left, self.right = (side[np.argsort(at[side, 1])] for side in sides)
        self.held = np.flatnonzero(np.repeat(near(at[:, 1], low[1]), 2))
        self.make_surface(at, low, high)
        self.mass_per_area = 0.5 * material["density_kg_m3"] * (high[0] - low[0])
        self.stable_step = 1.0  # any
        n = self.M.shape[0]
        self.u, self.v, self.a = np.zeros(n), np.zeros(n), np.zeros(n)
        self.width, self.solve = None, None

    def make_surface(self, at, low, high):
        """Vertices: left at z_low, right at z_low, the same at z_high; triangles outward."""
        m = len(self.left)
        column = np.concatenate([self.left, self.right])
        self.nodes = np.concatenate([column, column])
        z = np.repeat([low[2], high[2]], 2 * m)
        # The mesh maker rounds: 0 may come as -1e-19, outside a channel whose floor is 0.
        self.vertices = np.column_stack([np.clip(at[self.nodes], low[:2], high[:2]), z])
        triangles = []

        def quad(a, b, c, d):
            triangles.extend([(a, b, c), (a, c, d)])

        L, R, top = 0, m, 2 * m  # first vertices of left and right; add top for z_high
        for j in range(m - 1):
            quad(R + j, R + j + 1, R + j + 1 + top, R + j + top)              # +x
            quad(L + j + 1, L + j, L + j + top, L + j + 1 + top)              # -x
            quad(L + j, L + j + 1, R + j + 1, R + j)                          # -z
            quad(L + j + top, R + j + top, R + j + 1 + top, L + j + 1 + top)  # +z
        quad(L, R, R + top, L + top)                                          # -y
        quad(R + m - 1, L + m - 1, L + m - 1 + top, R + m - 1 + top)          # +y
        self.triangles = np.array(triangles)

    def state(self):
        return {"u": self.u, "v": self.v, "a": self.a}

    def set_state(self, kept):
        self.u, self.v, self.a = kept["u"], kept["v"], kept["a"]

    def surface(self, field):
        return np.column_stack([field.reshape(-1, 2)[self.nodes], np.zeros(len(self.nodes))])

    def load(self, x, pressure):
        """Nodal forces [2 n] per depth; and by vertex [n, 3]."""
        by_vertex = forces(x, self.triangles, pressure)
        total = np.zeros((len(self.u) // 2, 2))
        np.add.at(total, self.nodes, by_vertex[:, :2] / self.depth)
        return total.ravel(), by_vertex

    def factorise(self, dt):
        if self.width == dt:
            return
        A = (self.M + 0.25 * dt**2 * self.K).tolil()
        A[self.held, :] = 0.0
        A[self.held, self.held] = 1.0
        self.solve, self.width = scipy.sparse.linalg.splu(A.tocsc()).solve, dt

    def advance(self, before, after, width, _):
        self.factorise(width)
        x0 = self.vertices + self.surface(self.u)
        predicted = self.u + width * self.v + 0.25 * width**2 * self.a
        f, _ = self.load(self.vertices + self.surface(self.u + width * self.v), after)
        right = f - self.K @ predicted
        right[self.held] = 0.0
        a = self.solve(right)
        self.u = predicted + 0.25 * width**2 * a
        self.v = self.v + 0.5 * width * (self.a + a)
        self.a = a
        x = self.vertices + self.surface(self.u)
        mean = self.load(0.5 * (x0 + x), 0.5 * (before + after))[1]
        return x, self.surface(self.v), float((mean * (x - x0)).sum()), width * mean.sum(axis=0)


def main():
    options = arguments()
    case = read_case(options)
    if options.check:
        return 0
    panel = Panel(case)
    record = []

    # The tip's history, as solid_solver writes it for the node set y_max.
    plain = panel.advance

    def advance(before, after, width, steps):
        answer = plain(before, after, width, steps)
        tips = [panel.left[-1], panel.right[-1]]
        record.append(panel.u.reshape(-1, 2)[tips].mean(axis=0))
        return answer

    panel.advance = advance
    serve("fenicsx_panel.py 1", panel, options, panel.mass_per_area)
    if options.out and record:
        largest = max(record, key=lambda d: abs(d[0]))
        import json
        (options.out / "solid_summary.json").write_text(json.dumps({"quantities": [
            {"name": "tip_displacement_x_extreme", "value": float(largest[0]), "unit": "m"}], "performance": {}}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
