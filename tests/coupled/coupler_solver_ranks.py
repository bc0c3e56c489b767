"""Our own solvers on several ranks against the same on one: coupled, implicit, with a free body, in single precision, resumed."""

import csv
import os
import shutil
import tempfile
import unittest

from coupler_harness import BIN, CouplerTest
from coupler_solvers import SUNK, make_mesh

# A light brick in the gas beside the soft block, carried by the blast.
BRICK = """
[[mesh]]
recipe = "box_surface"
output = "brick.h5"
low_m = [0.15, 0.4, 0.55]
high_m = [0.35, 0.6, 0.7]
cells = [2, 2, 2]
[[flow.body]]
name = "brick"
motion = "free"
surface = "brick.h5"
[flow.body.free]
density_kg_m3 = 20.0
"""
WINDOWS = ("--set", "coupling.window=fixed", "--set", "coupling.window_s=2e-5", "--set", "time.end_s=4e-4")


def tables_of(folder):
    """Columns of numbers by table and name."""
    found = {}
    for table in ("globals.csv", "coupling.csv"):
        with open(os.path.join(folder, table), encoding="utf-8") as file:
            head, *rows = csv.reader(file)
        for c, name in enumerate(head):
            found[table, name] = [float(row[c]) for row in rows]
    return found


class SolverRanks(CouplerTest):
    @classmethod
    def setUpClass(cls):
        cls.mesh = tempfile.mkdtemp(prefix="ocublast-mesh-")
        cls.addClassCleanup(shutil.rmtree, cls.mesh)
        cls.cases = {"sunk": SUNK, "free": SUNK.replace("[solid]", BRICK + "[solid]")}
        for name, text in cls.cases.items():
            path = os.path.join(cls.mesh, name + ".toml")
            with open(path, "w", encoding="utf-8") as file:
                file.write(text)
            make_mesh(cls.mesh, path)

    def completed(self, case, ranks_flow, ranks_solid, *arguments):
        out = f"{case}-{ranks_flow}-{ranks_solid}-{len(os.listdir(self.dir))}"
        self.case = os.path.join(self.mesh, case + ".toml")
        sides = ("--flow", os.path.join(BIN, "flow_solver"), "--solid", os.path.join(BIN, "solid_solver"))
        ended = self.run_coupler("--mesh-dir", self.mesh, *sides, "--threads-flow", "1", "--threads-solid", "1",
                                 "--ranks-flow", ranks_flow, "--ranks-solid", ranks_solid, *WINDOWS, *arguments, out=out)
        self.assertEqual(ended.code, 0, ended.text)
        return self.path(out)

    def assert_same(self, folder, expected, bound, only=()):
        """Every column, or those named, within `bound` of the largest value of its kind: the three components of a force vanish together."""
        one, other = tables_of(expected), tables_of(folder)
        scale = {}
        kind = lambda key: (key[0], "".join(part for part in key[1].split("_") if part not in ("x", "y", "z")))  # noqa: E731
        for key, column in one.items():
            scale[kind(key)] = max([scale.get(kind(key), 0.0), *map(abs, column)])
        worst = (0.0, "")
        for key, column in one.items():
            if any(word in key[1] for word in ("overhead", "energy_error", "residual")):
                continue  # a clock's; what round-off leaves of larger numbers
            if only and key[1] not in only:
                continue
            self.assertEqual(len(column), len(other[key]), key)
            if scale[kind(key)] > 0.0:
                worst = max(worst, (max(abs(a - b) for a, b in zip(column, other[key])) / scale[kind(key)], key[1]))
        print(f"{os.path.basename(folder)}: differs by {worst[0]:.1e} at most, in {worst[1]}")
        self.assertLess(worst[0], bound)

    # Tables hold nine digits: a tipped last place is up to 1e-8 of a value. Ranks themselves differ by some 1e-12.
    def test_an_implicit_run_rewinds_on_all_ranks(self):
        implicit = ("--set", "coupling.scheme=serial-implicit")
        self.assert_same(self.completed("sunk", 2, 2, *implicit), self.completed("sunk", 1, 1, *implicit), 1e-8)

    def test_a_free_body_crosses_the_borders_of_ranks_and_resumes_on_another_number(self):
        every = ("--set", "coupling.checkpoint_every_windows=8")
        one, four = self.completed("free", 1, 1, *every), self.completed("free", 4, 1, *every)
        moved = tables_of(one)["globals.csv", "brick_w_m_s"]
        self.assertGreater(max(map(abs, moved)), 0.1)
        self.assert_same(four, one, 1e-8)
        kept = sorted(os.listdir(os.path.join(four, "checkpoint")))
        for later in kept[1:]:
            shutil.rmtree(os.path.join(four, "checkpoint", later))
        resumed = self.completed("free", 2, 1, *every, "--resume", four)
        one_rows, rest = tables_of(one), tables_of(resumed)
        for key in (("globals.csv", "brick_w_m_s"), ("globals.csv", "mass_kg"), ("coupling.csv", "work_solid_J")):
            column, whole = rest[key], one_rows[key]
            self.assertGreater(len(column), 4)
            error = max(abs(a - b) for a, b in zip(column, whole[-len(column):])) / max(map(abs, whole))
            print(f"resumed on two ranks: {key[1]} differs by {error:.1e}")
            self.assertLess(error, 1e-8)

    def test_single_precision_differs_between_ranks_by_its_roundings(self):
        single = ("--set", "flow.numerics.precision=single")
        # Each of some 100 stages rounds pressures by 6e-8 of the ambient one, at random: 6e-7 of it, on loads of a tenth
        # of it and more.
        loads = ("soft_force_z_N", "work_flow_J", "work_solid_J", "mass_kg")
        self.assert_same(self.completed("sunk", 2, 1, *single), self.completed("sunk", 1, 1, *single), 1e-5, loads)


if __name__ == "__main__":
    unittest.main(verbosity=2)
