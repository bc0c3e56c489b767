"""The flow in single precision in whole runs: chosen by the case, held to the same references, against double."""

import os
import subprocess
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "unit"))

from cases_runner import ROOT, CaseRun  # noqa: E402

SINGLE = ("--set", "flow.numerics.precision=single")

# First-order fluxes cannot save 1e13 Pa beside 1e5 Pa at this Courant number: ends with a checkpoint.
HOPELESS = """
[case]
name = "hopeless"
title = "a start that fails"
[time]
end_s = 1e-3
[ambient]
pressure_Pa = 101325.0
temperature_K = 288.15
[flow.gas]
heat_capacity_ratio = 1.4
gas_constant_J_per_kgK = 287.05
viscosity = "none"
[flow.grid.x]
min_m = 0.0
max_m = 1.0
spacing_m = 0.01
[flow.boundary]
x_min = "outflow"
x_max = "outflow"
[flow.initial]
kind = "riemann"
axis = "x"
position_m = 0.5
[flow.initial.left]
pressure_Pa = 1.0e13
[flow.initial.right]
[flow.numerics]
cfl_direction = 1.2
filter = false
artificial_diffusivity = false
"""


class SinglePrecision(CaseRun):
    def flow(self, case, out, *arguments):
        program = Path(os.environ.get("OCUBLAST_BIN", ROOT / "build/release/bin")) / "flow_solver"
        return subprocess.run([program, case, "--quiet", "--out", out, *arguments], capture_output=True, text=True,
                              env=os.environ)

    def test_coupled_piston_meets_its_references_and_double(self):
        once = self.results("piston", *SINGLE, "--no-report", out=self.folder / "single")
        self.assertIn("single precision", (self.folder / "single/log/flow_solver.log").read_text())
        self.assert_meets_references(once)
        twice = self.results("piston", "--no-report", out=self.folder / "double")
        values = lambda s: {q["name"]: q["value"] for q in s["quantities"] if q["reference"] is not None}  # noqa: E731
        a, b = values(once), values(twice)
        worst = max(abs(a[name] / b[name] - 1.0) for name in b)
        print(f"piston, single against double: largest difference of {len(b)} quantities {worst:.1e}")
        # 400 steps, each of which rounds pressures once: a random walk of 20 roundings of 6e-8 in what drives
        # the piston; loads enter as differences against ambient pressure, twice smaller. Ten times that.
        self.assertLess(worst, 10 * 2 * 20 * 6e-8)

    def test_checkpoint_of_the_other_precision_is_refused(self):
        case = self.folder / "case.toml"
        case.write_text(HOPELESS)
        failed = self.flow(case, self.out, *SINGLE)
        self.assertEqual(failed.returncode, 4, failed.stderr)
        again = self.flow(case, self.folder / "again", *SINGLE, "--resume", self.out)
        self.assertEqual(again.returncode, 4, again.stderr)
        other = self.flow(case, self.folder / "other", "--resume", self.out)
        self.assertEqual(other.returncode, 2, other.stderr)
        self.assertIn("written in single precision, this run is in double", other.stderr)

    def test_an_unknown_precision_is_refused(self):
        case = self.folder / "case.toml"
        case.write_text(HOPELESS)
        done = self.flow(case, self.out, "--set", "flow.numerics.precision=half", "--check")
        self.assertEqual(done.returncode, 2)
        self.assertIn("precision", done.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
