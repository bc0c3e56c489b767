"""Coupled cases from cases/run to summary.json: three processes, real meshes."""

import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "unit"))

from cases_runner import CaseRun  # noqa: E402


class PistonTest(CaseRun):
    def test_piston_meets_simple_wave_theory(self):
        self.assert_meets_references(self.results("piston"))
        for name in ("summary.json", "report.html", "flow.xmf", "solid.xmf", "interface.xmf",
                     "probes.csv", "globals.csv", "traffic.ocu", "case.toml"):
            self.assertTrue((self.out / name).is_file(), name)


class EyeTest(CaseRun):
    def test_eye_starts_and_sums_up(self):
        # 4 us: the blast has hardly left the charge, the globe still sleeps.
        summary = self.results("eye_pyrodex", "--set", "time.end_s=4e-6", "--set",
                               "flow.output.every_s=4e-6", "--set", "flow.output.interface_every_s=4e-6",
                               "--set", "solid.output.every_s=4e-6")
        # The ball is filled by volume fractions, so that its energy is right to round-off.
        self.assertAlmostEqual(self.quantity(summary, "charge_energy"), 60.0, delta=1e-6)
        # Nothing can have come 68 mm far; what is there is numerical noise, far below 1 kPa.
        self.assertLess(self.quantity(summary, "facing_peak_overpressure"), 100.0)
        # 100 Pa compress 25 mm of tissue of 2.4 GPa by 1e-9 m.
        self.assertLess(self.quantity(summary, "apex_displacement_peak"), 1e-9)
        for name in ("flow.xmf", "solid.xmf", "interface.xmf", "report.html", "probes.csv"):
            self.assertTrue((self.out / name).is_file(), name)


if __name__ == "__main__":
    unittest.main(verbosity=2)
