"""Participants of several ranks under mpirun: rank 0 speaks, and who dies ends everything."""

import os
import shutil
import signal
import subprocess
import sys
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "coupled"))

from coupler_harness import BIN, CouplerTest, alive
from coupler_solvers import CASE as SOLVERS_CASE, make_mesh

SLACK = float(os.environ.get("OCU_TEST_SLACK_S", "5"))


def ranks_of(program, case):
    """Processes of a solver that run a case."""
    found = subprocess.run(["pgrep", "-f", program + " " + case], capture_output=True, text=True, check=False).stdout.split()
    return [int(pid) for pid in found]


def variable_of(pid, name):
    """From a process's environment; None where it has none, or is gone."""
    try:
        with open(f"/proc/{pid}/environ", "rb") as file:
            found = [v for v in file.read().split(b"\0") if v.startswith(name.encode() + b"=")]
    except OSError:
        return None
    return found[0].split(b"=", 1)[1].decode() if found else None


@unittest.skipIf(shutil.which("mpirun") is None, "no mpirun here")
class Ranks(CouplerTest):
    def running(self, n):
        deadline = time.monotonic() + 20.0
        while len(found := self.ranks()) < n:
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.02)
        return found

    program = "gas_column"

    def ranks(self):
        return [p for p in ranks_of(self.program, self.case) if variable_of(p, "OMPI_COMM_WORLD_RANK") is not None]

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

    def test_a_killed_rank_of_our_solid_ends_all_with_one_sentence(self):
        make_mesh(self.path("mesh"), SOLVERS_CASE)
        self.case = shutil.copy(SOLVERS_CASE, self.path("ours.toml"))
        self.program = "solid_solver"
        for rank in ("0", "1"):
            out = "rank" + rank
            process = self.start("--mesh-dir", self.path("mesh"), "--flow", os.path.join(BIN, "flow_solver"), "--solid",
                                 os.path.join(BIN, "solid_solver"), "--threads-flow", "1", "--threads-solid", "1",
                                 "--ranks-solid", "2", "--set", "time.end_s=1.0", "--set", "coupling.record=false", out=out)
            pids = self.running(2)
            self.wait_for(out, "coupling.csv", seconds=30.0)
            time.sleep(0.5)
            begin = time.monotonic()
            for pid in pids:
                if variable_of(pid, "OMPI_COMM_WORLD_RANK") == rank:
                    os.kill(pid, signal.SIGKILL)
            text = process.communicate(timeout=30)[0]
            self.assertEqual(process.returncode, 3, text)
            self.assertRegex(text, r"solid \(solid_solver .*\) failed in window \d+ .*solid\.log")
            self.assertLess(time.monotonic() - begin, 2.0 + SLACK)  # mpirun ends its ranks within 1 s
            self.assert_all_gone(pids)
            self.assertEqual(ranks_of("flow_solver", self.case), [])


if __name__ == "__main__":
    unittest.main(verbosity=2)
