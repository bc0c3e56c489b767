"""Participants of several ranks under mpirun: rank 0 speaks, and who dies ends everything."""

import os
import shutil
import signal
import subprocess
import sys
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "coupled"))

from coupler_harness import BIN, PATIENCE, CouplerTest, alive
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
        deadline = time.monotonic() + PATIENCE
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
        # Rank 1 dies when it is told to: both ranks have been seen, and windows are under way.
        process = self.start("--ranks-flow", "2", "--set", "flow.fault=rank", "--set", "time.end_s=4000.0",
                             "--set", "coupling.record=false", env={"OCU_TOY_GO": self.path("die")})
        pids = self.running(2)
        self.wait_for("out", "coupling.csv")
        self.let_go("die")
        text = process.communicate(timeout=PATIENCE)[0]
        self.assertEqual(process.returncode, 3, text)
        self.assertRegex(text, r"flow \(gas_column 1\) failed in window \d+")
        self.assertIn("flow.log", text)
        self.assert_all_gone(pids)

    def test_a_coupler_that_is_killed_takes_all_ranks_with_it(self):
        process = self.start("--ranks-flow", "3", "--set", "time.end_s=4000.0", "--set", "coupling.record=false")
        pids = self.running(3)
        self.wait_for("out", "coupling.csv")
        process.kill()
        process.communicate(timeout=PATIENCE)
        self.assert_all_gone(pids)

    def launcher_of(self, pids):
        """The mpirun whose ranks these are."""
        with open(f"/proc/{pids[0]}/stat", encoding="ascii") as file:
            return int(file.read().rsplit(")", 1)[1].split()[1])

    def test_ranks_do_not_outlive_the_coupler_when_mpirun_hangs(self):
        # Only rank 0 sees the coupler die. A frozen mpirun stands for one that hangs: nobody but the guard is left.
        process = self.start("--ranks-flow", "3", "--set", "time.end_s=4000.0", "--set", "coupling.record=false")
        pids = self.running(3)
        self.wait_for("out", "coupling.csv")
        pids.append(self.launcher_of(pids))
        os.kill(pids[-1], signal.SIGSTOP)
        process.kill()
        process.communicate(timeout=PATIENCE)
        self.assert_all_gone(pids)

    def test_ranks_do_not_outlive_a_run_that_fails_when_mpirun_hangs(self):
        process = self.start("--ranks-flow", "3", "--set", "time.end_s=4000.0", "--set", "coupling.record=false",
                             env={"OCU_TOY_FAULT_SOLID": "hold@50", "OCU_TOY_GO": self.path("go")})
        pids = self.running(3)
        pids.append(self.launcher_of(pids))
        self.wait_for("go.here")
        os.kill(pids[-1], signal.SIGSTOP)
        os.kill(ranks_of("coupler_spring", self.case)[0], signal.SIGKILL)
        text = process.communicate(timeout=PATIENCE)[0]
        self.assertEqual(process.returncode, 3, text)
        self.assertIn("solid (spring 1) failed in window 50", text)
        self.assert_all_gone(pids)

    def test_what_a_launcher_leaves_behind_ends_with_the_run(self):
        # A launcher that ends at once, like a daemon: its program works on in a session of its own, deaf to SIGTERM.
        launcher = self.path("mpirun")
        with open(launcher, "w", encoding="utf-8") as file:
            file.write(f"#!/bin/sh\ntrap '' TERM\nsetsid sh -c 'trap \"\" TERM; echo $$ > {self.path('left')}; sleep 4000' &\n"
                       "\"$@\" & wait $!\n")
        os.chmod(launcher, 0o755)
        for end in ("4000.0", "1.0"):
            with self.subTest(end=end):
                process = self.start("--flow", f"{launcher} {os.path.join(BIN, 'coupler_gas_column')}", "--set", f"time.end_s={end}",
                                     "--set", "coupling.record=false", out="out" + end)
                self.wait_for("out" + end, "coupling.csv")
                left = int(self.wait_for_line("left"))
                if end == "4000.0":
                    process.kill()
                text = process.communicate(timeout=PATIENCE)[0]
                self.assertEqual(process.returncode, -9 if end == "4000.0" else 0, text)
                self.assert_all_gone([left])
                os.remove(self.path("left"))

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
            self.wait_for(out, "coupling.csv")
            begin = time.monotonic()
            for pid in pids:
                if variable_of(pid, "OMPI_COMM_WORLD_RANK") == rank:
                    os.kill(pid, signal.SIGKILL)
            text = process.communicate(timeout=PATIENCE)[0]
            self.assertEqual(process.returncode, 3, text)
            self.assertRegex(text, r"solid \(solid_solver .*\) failed in window \d+ .*solid\.log")
            self.assertLess(time.monotonic() - begin, 2.0 + SLACK)  # mpirun ends its ranks within 1 s
            self.assert_all_gone(pids)
            self.assertEqual(ranks_of("flow_solver", self.case), [])


if __name__ == "__main__":
    unittest.main(verbosity=2)
