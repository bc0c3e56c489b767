"""Cases of one solver, from cases/run to summary.json, against their exact solutions."""

import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "unit"))

from cases_runner import CaseRun  # noqa: E402


class AloneTest(CaseRun):
    def test_sod_meets_the_exact_riemann_solution(self):
        self.assert_meets_references(self.results("sod"))
        for name in ("report.html", "probes.csv", "flow.xmf", "case.toml"):
            self.assertTrue((self.out / name).is_file(), name)

    def test_shock_wall_meets_rankine_hugoniot(self):
        self.assert_meets_references(self.results("shock_wall"))

    def test_bar_wave_meets_the_exact_wave(self):
        self.assert_meets_references(self.results("bar_wave"))

    def test_the_effective_case_gives_the_same_answer(self):
        first = self.results("bar_wave", "--set", "time.end_s=3e-4", "--no-report")
        second = self.results(self.out / "case.toml", "--no-report", out=self.folder / "again")
        values = lambda s: [(q["name"], q["value"]) for q in s["quantities"]]  # noqa: E731
        self.assertEqual(values(first), values(second))

    def test_an_unknown_key_ends_with_code_2_and_leaves_nothing(self):
        done = self.launch("sod", "--set", "flow.numerics.clf=0.5")
        self.assertEqual(done.returncode, 2)
        self.assertIn("did you mean 'cfl'?", done.stderr)
        self.assertFalse(self.out.exists())


if __name__ == "__main__":
    unittest.main(verbosity=2)
