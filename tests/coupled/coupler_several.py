"""Several solids in one run: our solvers with two pistons, and the toys' faults."""

import json
import os
import shutil
import subprocess
import tempfile
import unittest

import numpy as np

from coupler_harness import BIN, PATIENCE, CouplerTest, children_of

from ocublast_link import Participant

HERE = os.path.dirname(os.path.abspath(__file__))
MESH = os.path.join(HERE, "..", "..", "cases", "mesh")
# A slab of hot gas between two pistons; or half of it, a mirror and one piston.
COMMON = """
[case]
name = "pistons"
title = "a burst between two pistons"
[time]
end_s = {end}
[ambient]
pressure_Pa = 101325.0
temperature_K = 288.15
[coupling]
theta_warn = 1.0
theta_refuse = 1.0
[flow.gas]
heat_capacity_ratio = 1.4
gas_constant_J_per_kgK = 287.05
viscosity = "none"
[flow.grid.x]
min_m = {left}
max_m = 0.6
spacing_m = 0.01
[flow.boundary]
x_min = "symmetry"
x_max = "symmetry"
[[flow.burst]]
name = "slab"
center_m = [0.0, 0.0, 0.0]
radius_m = 0.1
pressure_Pa = 4e5
temperature_K = 500.0
"""
BODY = """
[[flow.body]]
name = "{name}"
motion = "coupled"
[[mesh]]
recipe = "box_hex"
output = "{name}.h5"
low_m = [{low}, 0.0, 0.0]
high_m = [{high}, 1.0, 1.0]
cells = [4, 1, 1]
tissue = "piston"
"""
SOLID = """
{header}
mesh = "{name}.h5"
[[solid.material]]
name = "piston"
tissues = ["piston"]
law = "linear_elastic"
density_kg_m3 = 100.0
shear_modulus_Pa = 1.5e8
bulk_modulus_Pa = 2.0e8
[[solid.fixed]]
nodes = "all"
directions = ["y", "z"]
[[solid.history]]
name = "piston"
nodes = "all"
[solid.output]
every_s = 1e-3
history_every_s = 1e-5
"""


class Several(CouplerTest):
    def write(self, name, left, pistons, end=1.2e-3):
        """A case with its meshes. `pistons`: name, low, high."""
        text = COMMON.format(left=left, end=end)
        for piston, low, high in pistons:
            text += BODY.format(name=piston, low=low, high=high)
        for piston, _, _ in pistons:
            header = f'[[solid]]\nname = "{piston}"' if len(pistons) > 1 else "[solid]"
            text += SOLID.format(header=header, name=piston)
        path = self.path(name + ".toml")
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        subprocess.run(["/usr/bin/python3", MESH, "make", path, "--out", self.path("mesh")], check=True, capture_output=True)
        return path

    def two(self, **keywords):
        return self.write("two", -0.6, [("left", -0.41, -0.4), ("right", 0.4, 0.41)], **keywords)

    def completed(self, case, *arguments, out):
        self.case = case
        ended = self.run_coupler("--mesh-dir", self.path("mesh"), "--flow", os.path.join(BIN, "flow_solver"), "--solid",
                                 os.path.join(BIN, "solid_solver"), "--threads-flow", "1", "--threads-solid", "1",
                                 *arguments, out=out)
        self.assertEqual(ended.code, 0, ended.text)

    def table(self, *names):
        lines = [line.split(",") for line in self.read(*names).splitlines()]
        return [dict(zip(lines[0], map(float, line))) for line in lines[1:]]

    def test_two_pistons_move_as_one_and_a_mirror_do(self):
        one = self.write("one", 0.0, [("right", 0.4, 0.41)])
        for scheme in ("serial-explicit", "parallel-explicit", "serial-implicit"):
            choose = ("--set", f"coupling.scheme={scheme}")
            self.completed(self.two(), *choose, out="two" + scheme)
            self.completed(one, *choose, out="one" + scheme)
            left, right, single = (self.table(out, *sub, "solid_probes.csv") for out, *sub in
                                   (("two" + scheme, "left"), ("two" + scheme, "right"), ("one" + scheme,)))
            self.assertEqual(len(right), len(single))
            for column in ("piston_displacement_x_m", "piston_velocity_x_m_s"):
                size = max(abs(row[column]) for row in single)
                self.assertGreater(size, 0.0)
                # A mirror changes the order of sums in the gas: rounding grows over some 100 steps of 60 cells,
                # and an implicit window stops at 1e-6 of its motion.
                accepted = (1e-4 if scheme == "serial-implicit" else 1e-9) * size
                worst = max(max(abs(r[column] - s[column]), abs(l[column] + r[column]))
                            for l, r, s in zip(left, right, single))
                print(f"{scheme} {column}: {worst / size:.1e} of {size:.3g}")
                self.assertLess(worst, accepted)

    def test_two_solids_on_two_ranks_each_move_as_on_one(self):
        case = self.two()
        self.completed(case, out="one")
        self.completed(case, "--ranks-flow", 2, "--ranks-solid", 2, out="ranks")
        for side in ("left", "right"):
            one, ranks = (self.table(out, side, "solid_probes.csv") for out in ("one", "ranks"))
            self.assertEqual(len(one), len(ranks))
            for column in ("piston_displacement_x_m", "piston_velocity_x_m_s"):
                size = max(abs(row[column]) for row in one)
                worst = max(abs(a[column] - b[column]) for a, b in zip(one, ranks))
                print(f"two ranks each, {side} {column}: {worst / size:.1e} of {size:.3g}")
                self.assertLess(worst, 1e-8 * size)  # tables hold nine digits

    def test_a_flow_in_python_serves_two_solids(self):
        self.case = self.two(end=2e-4)
        process = self.start("--mesh-dir", self.path("mesh"), "--await", "--set", "coupling.window=fixed", "--set",
                             "coupling.window_s=1e-5", out="two")
        connection = self.connection("two")
        solids = []
        for name in ("left", "right"):
            solids.append(subprocess.Popen(
                [os.path.join(BIN, "solid_solver"), self.case, "--mesh-dir", self.path("mesh"), "--set",
                 "coupling.window=fixed", "--set", "coupling.window_s=1e-5", "--name", name, "--quiet", "--out", self.path(name)],
                env={**os.environ, **connection, "OCUBLAST_NAME": name}, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True))
            self.addCleanup(lambda p=solids[-1]: p.poll() is None and p.kill())
        flow = Participant("flow", "two loads 1", int(connection["OCUBLAST_CASE_HASH"], 16),
                           endpoint=connection["OCUBLAST_ENDPOINT"], token=connection["OCUBLAST_TOKEN"])
        meshes = flow.receive_meshes()
        self.assertEqual([name for name, _, _ in meshes], ["left", "right"])
        n = [len(vertices) for _, vertices, _ in meshes]
        flow.ready(1e-5)
        # A uniform pressure on the closed surface of the left one, none on the right one.
        for order in flow.orders():
            load = np.concatenate([np.full(n[0], 1e5), np.zeros(n[1])])
            flow.send(overpressure=load, balance=np.zeros((2, 4)), stable_step=1e-5, steps_taken=1, impedance=400.0)
        flow.goodbye()
        text = process.communicate(timeout=PATIENCE)[0]
        self.assertEqual(process.returncode, 0, text + "".join(s.communicate()[0] for s in solids))
        self.assertEqual([s.wait(timeout=PATIENCE) for s in solids], [0, 0])
        left, right = self.table("two", "coupling_left.csv"), self.table("two", "coupling_right.csv")
        self.assertEqual(len(left), 20)
        self.assertGreater(sum(abs(row["work_solid_J"]) for row in left), 0.0)
        self.assertEqual(sum(abs(row["work_solid_J"]) for row in right), 0.0)

    def test_each_interface_has_its_own_balance(self):
        self.completed(self.two(), out="two")
        total, left, right = (self.table("two", f"coupling{name}.csv") for name in ("", "_left", "_right"))
        for t, l, r in zip(total, left, right):
            for column in ("work_flow_J", "work_solid_J", "impulse_flow_x_N_s", "impulse_solid_x_N_s"):
                self.assertAlmostEqual(t[column], l[column] + r[column], delta=1e-12 * (abs(l[column]) + abs(r[column])))
        self.assertGreater(sum(row["impulse_flow_x_N_s"] for row in right), 0.1)
        self.assertLess(sum(row["impulse_flow_x_N_s"] for row in left), -0.1)
        summary = self.read("two", "coupling_summary.json")
        self.assertIn("left_interface_work_flow", summary)
        areas = {q["name"]: q["value"] for q in json.loads(summary)["quantities"] if "interface_area" in q["name"]}
        # Boxes of 10 mm x 1 m x 1 m; the gas has one direction only, but the meshes are whole.
        for name, count in (("", 2), ("left_", 1), ("right_", 1)):
            for side in ("flow", "solid"):
                self.assertAlmostEqual(areas[f"{name}interface_area_{side}"], count * 2.04, delta=1e-12)

    def test_resumed_run_equals_the_uninterrupted_one_bit_for_bit(self):
        every = ("--set", "coupling.checkpoint_every_windows=9")
        self.completed(self.two(), *every, out="two")
        tables = {name: self.read("two", name) for name in ("coupling_left.csv", "coupling_right.csv")}
        kept = sorted(os.listdir(self.path("two", "checkpoint")))
        shutil.rmtree(self.path("two", "checkpoint", kept[-1]))
        whole = self.rows("two")
        self.completed(self.case, *every, "--resume", self.path("two"), out="two")
        self.assertEqual(self.rows("two"), whole)
        for name, text in tables.items():
            self.assertEqual(self.read("two", name), text)

    def test_recording_replays_against_each(self):
        self.completed(self.two(), out="two")
        for side, live in (("solid", ""), ("flow", "left"), ("flow", "right")):
            more = ("--live", live) if live else ()
            ended = self.tool("replay", self.path("two", "traffic.ocu"), "--as", side, *more, self.case, "--mesh-dir",
                              self.path("mesh"), "--out", self.path("replay"), "--threads-flow", "1", "--threads-solid", "1")
            self.assertEqual(ended.code, 0, ended.text)
            self.assertIn("byte for byte", ended.text)

    def test_a_fault_names_the_solid(self):
        self.case = self.two(end=1.0)
        process = self.start("--mesh-dir", self.path("mesh"), "--flow", os.path.join(BIN, "flow_solver"), "--solid",
                             os.path.join(BIN, "solid_solver"), "--threads-flow", "1", "--threads-solid", "1", out="two")
        self.wait_for("two", "coupling.csv")
        for child in children_of(process.pid):
            with open(f"/proc/{child}/cmdline", encoding="ascii") as file:
                if "right" in file.read().split("\0"):
                    os.kill(child, 9)
        text = process.communicate(timeout=PATIENCE)[0]
        self.assertEqual(process.returncode, 3, text)
        self.assertRegex(text, r"solid 'right' \(solid_solver .*killed by signal 9.*right.log")

    def test_wrong_names_are_faults_of_the_case(self):
        case = self.two()
        for change, said in (("flow.body.0.solid=up", "no solid is called 'up'"),
                             ("solid.1.name=left", "two solids are called 'left'"),
                             ("flow.body.0.solid=right", "moves two bodies"),
                             ("solid.left.name=a/b", "letters, digits")):
            ended = self.tool("check", case, "--mesh-dir", self.path("mesh"), "--set", change)
            self.assertEqual(ended.code, 2, ended.text)
            self.assertIn(said, ended.text)


if __name__ == "__main__":
    unittest.main(verbosity=2)
