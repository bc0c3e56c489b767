"""Coupled cases whose flow runs on two ranks, against the same on one."""

import csv
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "unit"))

from cases_runner import CaseRun, unittest  # noqa: E402


def columns(path: Path) -> dict:
    """Columns of numbers of a table."""
    with path.open() as file:
        rows = list(csv.reader(file))
    table = {}
    for c, name in enumerate(rows[0]):
        try:
            table[name] = [float(row[c]) for row in rows[1:]]
        except ValueError:
            continue
    return table


class CoupledOnRanks(CaseRun):
    # Tables hold nine digits: one unit of the last place, which rounding may tip, is up to 1e-8 of a value's
    # leading digit, hence of the column's largest value. The two runs themselves differ by some 1e-12.
    bound = 1e-8

    def assert_same(self, table: str, names: list[str]) -> None:
        one, two = columns(self.folder / "1" / table), columns(self.folder / "2" / table)
        for name in names:
            self.assertEqual(len(one[name]), len(two[name]), name)
            largest = max(abs(x) for x in one[name])
            worst = max(abs(a - b) for a, b in zip(one[name], two[name]))
            print(f"{table} {name}: largest {largest:.4g}, difference {worst / largest:.1e} of it")
            self.assertGreater(largest, 0.0, name)
            self.assertLessEqual(worst, self.bound * largest, name)

    def run_both(self, *arguments: str) -> None:
        for ranks in (1, 2):
            self.results(*arguments, "--ranks-flow", ranks, out=self.folder / str(ranks))

    def test_shock_on_the_panel(self):
        # The shock starts 2 mm ahead of the panel, which bends.
        self.run_both("panel", "--set", "flow.initial.position_m=0.048", "--set", "time.end_s=2e-5")
        self.assert_same("globals.csv", ["mass_kg", "energy_J", "panel_force_x_N", "panel_power_W"])
        self.assert_same("coupling.csv", ["work_flow_J", "impulse_flow_x_N_s"])

    def test_blast_on_the_eye(self):
        # The charge stands 7 mm in front of the cornea instead of 55: the blast arrives within 30 steps.
        self.run_both("eye_pyrodex", "--set", "flow.burst.0.center_m=[0.0,0.0,0.035]", "--set", "time.end_s=8e-6")
        self.assert_same("globals.csv", ["mass_kg", "energy_J", "globe_force_z_N", "orbit_force_z_N", "globe_power_W"])
        self.assert_same("coupling.csv", ["work_flow_J", "impulse_flow_z_N_s"])


if __name__ == "__main__":
    unittest.main(verbosity=2)
