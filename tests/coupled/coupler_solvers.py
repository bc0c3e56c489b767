"""Our own solvers under the coupler: recorded, replayed, interrupted, resumed, rewound.

`coupler_solvers.py --record` renews the recording that lies in recordings/."""

import os
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

from coupler_harness import BIN, PATIENCE, CouplerTest, interrupt

HERE = os.path.dirname(os.path.abspath(__file__))
CASE = os.path.join(HERE, "recordings", "piston_short.toml")
RECORDING = os.path.join(HERE, "recordings", "piston_short.ocu")
MESH = os.path.join(HERE, "..", "..", "cases", "mesh")
LOCKSTEP = ("--set", "coupling.window=lockstep")
SHORT = ("--set", "coupling.window=fixed", "--set", "coupling.window_s=2e-6")
ONE_THREAD = ("--threads-flow", "1", "--threads-solid", "1")
# A burst over a soft block, half sunk into a hard one whose top cuts the facets of its sides.
SUNK = """
[case]
name = "sunk"
title = "a soft block sunk into a hard one"
[time]
end_s = 1.5e-3
[ambient]
pressure_Pa = 101325.0
temperature_K = 288.15
[[mesh]]
recipe = "box_hex"
output = "soft.h5"
low_m = [0.32, 0.32, 0.2]
high_m = [0.68, 0.68, 0.5]
cells = [4, 4, 3]
tissue = "soft"
[[mesh]]
recipe = "box_surface"
output = "hard.h5"
low_m = [0.1, 0.1, 0.1]
high_m = [0.9, 0.9, 0.36]
cells = [4, 4, 2]
[coupling]
theta_warn = 1.0
theta_refuse = 1.0
[flow.gas]
heat_capacity_ratio = 1.4
gas_constant_J_per_kgK = 287.05
viscosity = "none"
[flow.grid.x]
min_m = 0.0
max_m = 1.0
spacing_m = 0.05
[flow.grid.y]
min_m = 0.0
max_m = 1.0
spacing_m = 0.05
[flow.grid.z]
min_m = 0.0
max_m = 1.0
spacing_m = 0.05
[flow.boundary]
x_min = "outflow"
x_max = "outflow"
y_min = "outflow"
y_max = "outflow"
z_min = "outflow"
z_max = "outflow"
[[flow.burst]]
name = "charge"
center_m = [0.5, 0.5, 0.85]
radius_m = 0.12
pressure_Pa = 2e6
temperature_K = 600.0
[[flow.body]]
name = "soft"
motion = "coupled"
[[flow.body]]
name = "hard"
motion = "fixed"
surface = "hard.h5"
[solid]
mesh = "soft.h5"
[[solid.material]]
name = "soft"
tissues = ["soft"]
law = "neo_hookean"
density_kg_m3 = 100.0
shear_modulus_Pa = 2e5
bulk_modulus_Pa = 1e6
"""


def make_mesh(folder, case=CASE):
    subprocess.run(["/usr/bin/python3", MESH, "make", case, "--out", folder], check=True, capture_output=True)


class Solvers(CouplerTest):
    """The piston case of the flow and the solid solver, a hundred cells and four hexes."""

    @classmethod
    def setUpClass(cls):
        cls.mesh = tempfile.mkdtemp(prefix="ocublast-mesh-")
        cls.addClassCleanup(shutil.rmtree, cls.mesh)
        make_mesh(cls.mesh)

    def setUp(self):
        super().setUp()
        self.case = CASE

    def start(self, *arguments, out="out", env=None):
        sides = ("--flow", os.path.join(BIN, "flow_solver"), "--solid", os.path.join(BIN, "solid_solver"))
        return super().start("--mesh-dir", self.mesh, *sides, *ONE_THREAD, *arguments, out=out, env=env)

    def completed(self, *arguments, out="out"):
        ended = self.run_coupler(*arguments, out=out)
        self.assertEqual(ended.code, 0, ended.text)
        return self.rows(out)

    def replayed(self, traffic, side, *arguments):
        ended = self.tool("replay", traffic, "--as", side, self.case, "--mesh-dir", self.mesh, "--out",
                          self.path("replay"), *ONE_THREAD, *arguments)
        self.assertEqual(ended.code, 0, ended.text)
        return ended.text

    def test_both_solvers_reproduce_a_recording_byte_for_byte(self):
        for scheme in ("serial-explicit", "serial-implicit", "leap-frog"):
            arguments = (*LOCKSTEP, "--set", f"coupling.scheme={scheme}")
            self.completed(*arguments, out=scheme)
            for side in ("flow", "solid"):
                text = self.replayed(self.path(scheme, "traffic.ocu"), side, *arguments)
                self.assertIn("byte for byte", text)

    def test_both_solvers_reproduce_the_kept_recording(self):
        # Kept numbers of this program: another processor's kernels or another compiler only round
        # otherwise (1e-16, over some 60 steps and sums of at most 1e4 terms: 1e-10 at worst). Who
        # changes the numerics renews the recording (--record) and says in the commit what changed.
        for side in ("flow", "solid"):
            self.replayed(RECORDING, side, *LOCKSTEP, "--tolerance", "1e-9")

    def test_resumed_run_equals_the_uninterrupted_one_bit_for_bit(self):
        for scheme in ("serial-explicit", "parallel-explicit", "serial-implicit"):
            with self.subTest(scheme=scheme):
                every = ("--set", "coupling.checkpoint_every_windows=7", *SHORT, "--set", f"coupling.scheme={scheme}",
                         "--set", "coupling.theta_refuse=1.0", "--set", "coupling.theta_warn=1.0")
                whole = self.completed(*every, out=scheme)
                kept = sorted(os.listdir(self.path(scheme, "checkpoint")))
                window = int(kept[0])
                shutil.rmtree(self.path(scheme, "checkpoint", kept[-1]))
                resumed = self.completed(*every, "--resume", self.path(scheme), out=scheme + "-resumed")
                self.assertGreater(len(resumed), 6)
                self.assertEqual(resumed, whole[window:])

    def test_interrupted_and_resumed_run_equals_the_uninterrupted_one(self):
        longer = (*SHORT, "--set", "time.end_s=1e-3")
        begin = time.monotonic()
        whole = self.completed(*longer, out="whole")
        # Somewhere in its 500 windows; a run that was over before it was hit is begun again and hit earlier.
        pause = 0.3 * (time.monotonic() - begin)
        for _ in range(20):
            process = self.start(*longer, out="stopped")
            self.wait_for("stopped", "traffic.ocu")
            time.sleep(pause)
            interrupt(process)
            text = process.communicate(timeout=PATIENCE)[0]
            if process.returncode != 0:
                break
            shutil.rmtree(self.path("stopped"))
            pause /= 2.0
        self.assertEqual(process.returncode, 1, text)
        done = len(self.rows("stopped"))
        self.assertLess(done, len(whole))
        self.assertEqual(self.completed(*longer, "--resume", self.path("stopped"), out="stopped"), whole)
        for name in ("probes.csv", "globals.csv"):
            self.assertEqual(self.read("stopped", name), self.read("whole", name), name)

    def test_all_schemes_give_the_same_motion(self):
        def impulse_on_solid(scheme, window, out):
            rows = self.completed("--set", f"coupling.scheme={scheme}", *window, "--set", "coupling.theta_refuse=1.0",
                                  "--set", "coupling.theta_warn=1.0", out=out)
            return sum(float(row.split(",")[9]) for row in rows)

        final = {scheme: impulse_on_solid(scheme, LOCKSTEP if scheme == "leap-frog" else SHORT, scheme)
                 for scheme in ("serial-explicit", "leap-frog", "parallel-explicit", "serial-implicit", "parallel-implicit")}
        half = impulse_on_solid("serial-implicit", (*SHORT[:2], "--set", "coupling.window_s=1e-6"), "half")
        print({scheme: f"{value:.6g} N s" for scheme, value in final.items()}, f"half windows {half:.6g} N s")
        # Both implicit schemes solve the same equations, each to 1e-6.
        self.assertAlmostEqual(final["parallel-implicit"] / final["serial-implicit"], 1.0, delta=1e-5)
        # Explicit schemes may differ from that by no more than windows of this length are worth: what halving them
        # changes (0.8 %). Pipelined, velocities are extrapolated two windows ahead, with an error of (2 w)(3 w) v'' / 2
        # instead of w (2 w) v'' / 2: three times that.
        worth = abs(half / final["serial-implicit"] - 1.0)
        self.assertLess(worth, 0.02)
        for scheme, times in (("serial-explicit", 1), ("leap-frog", 1), ("parallel-explicit", 3)):
            self.assertAlmostEqual(final[scheme] / final["serial-implicit"], 1.0, delta=times * worth, msg=scheme)

    def test_short_windows_are_as_quiet_pipelined_as_serial(self):
        # A tenth to a fortieth of the flow's step, about the solid's own: the gas in the first cell (10 mm) weighs a tenth
        # of the solid's outer nodes. Where the wall did not keep to its path, the pipelined impulse rose from window
        # to window: 2.7 times too large, and rough by 0.77 and 0.41.
        def answers(scheme, width):
            out = f"{scheme}{width}"
            rows = self.completed("--set", f"coupling.scheme={scheme}", *SHORT[:2], "--set", f"coupling.window_s={width}",
                                  "--set", "coupling.theta_refuse=1.0", "--set", "coupling.theta_warn=1.0",
                                  "--set", "coupling.record=false", out=out)
            given = [float(row.split(",")[9]) for row in rows]
            bends = sum(abs(a - 2 * b + c) for a, b, c in zip(given, given[1:], given[2:]))
            return sum(given), bends / sum(map(abs, given))

        for width in (1e-6, 5e-7):
            (serial, quiet), (pipelined, rough) = (answers(s, width) for s in ("serial-explicit", "parallel-explicit"))
            print(f"windows of {width} s: impulse {serial:.6g} / {pipelined:.6g} N s, roughness {quiet:.1e} / {rough:.1e}")
            # Pipelined, the wall is predicted over twice the time: its errors, of second order, are four times those of
            # the serial scheme, which halving the window changes by 1.2 %, a third of it the window's own.
            self.assertAlmostEqual(pipelined / serial, 1.0, delta=0.01)
            self.assertLess(rough, 2.0 * quiet)

    def test_forces_on_partly_covered_facets_work_alike_on_both_sides(self):
        self.case = self.path("sunk.toml")
        with open(self.case, "w", encoding="utf-8") as file:
            file.write(SUNK)
        make_mesh(self.mesh, self.case)
        for scheme in ("serial-explicit", "parallel-explicit", "serial-implicit"):
            chosen = ("--set", f"coupling.scheme={scheme}", "--set", "coupling.checkpoint_every_windows=20", "--set",
                      "coupling.window=fixed", "--set", "coupling.window_s=2e-5")
            self.completed(*chosen, out=scheme)
            head, *rows = (line.split(",") for line in self.read(scheme, "coupling.csv").splitlines())
            flow, solid = ([float(row[head.index(f"work_{side}_J")]) for row in rows] for side in ("flow", "solid"))
            error = (sum(solid) - sum(flow)) / sum(max(abs(f), abs(s)) for f, s in zip(flow, solid))
            print(f"{scheme}: work {sum(flow):.5g} J of the flow, {sum(solid):.5g} J on the solid, error {error:.2e}")
            # Left is what time integration differs by: 3.5e-4 here, 3.2e-3 in windows twice as long, which the flow
            # could take. Overpressure at the vertices instead of forces gives 2e-2. A pipelined flow works on a wall
            # predicted a window ahead.
            if scheme != "parallel-explicit":
                self.assertLess(abs(error), 1e-3)
            if scheme == "serial-explicit":
                for side in ("flow", "solid"):
                    self.assertIn("byte for byte", self.replayed(self.path(scheme, "traffic.ocu"), side, *chosen))
                continue
            self.completed(*chosen, "--resume", self.path(scheme), out=scheme + "-resumed")
            resumed = self.rows(scheme + "-resumed")
            self.assertGreater(len(resumed), 3)
            self.assertEqual(resumed, self.rows(scheme)[-len(resumed):])


def renew():
    """Makes recordings/piston_short.ocu anew."""
    with tempfile.TemporaryDirectory() as scratch:
        make_mesh(scratch)
        subprocess.run([os.path.join(BIN, "coupler"), CASE, "--mesh-dir", scratch, "--out", scratch + "/out",
                        *LOCKSTEP, *ONE_THREAD, "--quiet"], check=True)
        shutil.copy(scratch + "/out/traffic.ocu", RECORDING)


if __name__ == "__main__":
    if "--record" in sys.argv:
        renew()
    else:
        unittest.main(verbosity=2)
