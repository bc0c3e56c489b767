"""Participants of several ranks under mpirun: rank 0 speaks, and who dies ends everything."""

import os
import shutil
import subprocess
import sys
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "coupled"))

from coupler_harness import CouplerTest, alive

SLACK = float(os.environ.get("OCU_TEST_SLACK_S", "5"))


def ranks_of(case):
    """Processes of a solver that run a case."""
    found = subprocess.run(["pgrep", "-f", "gas_column " + case], capture_output=True, text=True, check=False).stdout.split()
    return [int(pid) for pid in found]


@unittest.skipIf(shutil.which("mpirun") is None, "no mpirun here")
class Ranks(CouplerTest):
    def running(self, n):
        deadline = time.monotonic() + 20.0
        while len([p for p in ranks_of(self.case) if self.is_rank(p)]) < n:
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.02)
        return [p for p in ranks_of(self.case) if self.is_rank(p)]

    @staticmethod
    def is_rank(pid):
        try:
            with open(f"/proc/{pid}/environ", "rb") as file:
                return b"OMPI_COMM_WORLD_RANK=" in file.read()
        except OSError:
            return False

    def assert_all_gone(self, pids):
        deadline = time.monotonic() + SLACK
        while any(alive(p) for p in pids) and time.monotonic() < deadline:
            time.sleep(0.02)
        self.assertFalse([p for p in pids if alive(p)])

    def test_a_rank_that_dies_ends_everything(self):
        process = self.start("--ranks-flow", "2", "--set", "flow.fault=rank", "--set", "time.end_s=4000.0",
                             "--set", "coupling.record=false")
        pids = self.running(2)
        text = process.communicate(timeout=30)[0]
        self.assertEqual(process.returncode, 3, text)
        self.assertRegex(text, r"flow \(gas_column 1\) failed in window \d+")
        self.assertIn("flow.log", text)
        self.assert_all_gone(pids)

    def test_a_coupler_that_is_killed_takes_all_ranks_with_it(self):
        process = self.start("--ranks-flow", "3", "--set", "time.end_s=4000.0", "--set", "coupling.record=false")
        pids = self.running(3)
        self.wait_for("out", "coupling.csv")
        process.kill()
        process.communicate(timeout=30)
        self.assert_all_gone(pids)


if __name__ == "__main__":
    unittest.main(verbosity=2)
