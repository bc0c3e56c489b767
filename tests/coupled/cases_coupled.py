"""Coupled cases from cases/run to summary.json: three processes, real meshes."""

import json
import os
import signal
import subprocess
import sys
import time
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "unit"))

from cases_runner import ROOT, CaseRun  # noqa: E402


class PistonTest(CaseRun):
    def test_piston_meets_simple_wave_theory(self):
        self.assert_meets_references(self.results("piston"))
        for name in ("summary.json", "report.html", "flow.xmf", "solid.xmf", "interface.xmf",
                     "probes.csv", "globals.csv", "traffic.ocu", "case.toml"):
            self.assertTrue((self.out / name).is_file(), name)

    def test_an_interrupt_leaves_a_checkpoint_that_resume_continues_exactly(self):
        whole = self.results("piston", "--no-report", out=self.folder / "whole")
        process = subprocess.Popen([ROOT / "cases/run", "piston", "--no-report", "--out", self.out],
                                   stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        while process.poll() is None and not (self.out / "probes.csv").exists():
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        text, _ = process.communicate(timeout=60)
        self.assertNotEqual(process.returncode, 0, text)
        self.assertIn("cases/run --resume", text)
        done = subprocess.run([ROOT / "cases/run", "--resume", self.out, "--no-report", "--quiet"],
                              capture_output=True, text=True, env=os.environ)
        self.assertEqual(done.returncode, 0, done.stderr)
        resumed = json.loads((self.out / "summary.json").read_text())
        values = lambda s: {q["name"]: q["value"] for q in s["quantities"]}  # noqa: E731
        self.assertEqual(values(resumed), values(whole))


class EyeTest(CaseRun):
    def test_eye_starts_and_sums_up(self):
        # 20 us: the blast has left the charge, the globe still sleeps.
        summary = self.results("eye_pyrodex", "--set", "time.end_s=2e-5", "--set",
                               "flow.output.every_s=2e-5")
        # 60 J in the ball, to the volume error of a ball of about seven cells across.
        self.assertAlmostEqual(self.quantity(summary, "charge_energy"), 60.0, delta=3.0)
        self.assertEqual(self.quantity(summary, "facing_peak_overpressure"), 0.0)


if __name__ == "__main__":
    unittest.main(verbosity=2)
