"""Random faults in many runs: none hangs, no file is damaged, every resumed run equals the whole one.

OCU_SOAK_RUNS sets the number of runs (default 12; the long test takes 200, 10,000 windows in all)."""

import os
import random
import shutil
import signal
import sys
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "coupled"))

from coupler_harness import PATIENCE, CouplerTest, alive, children_of

RUNS = int(os.environ.get("OCU_SOAK_RUNS", "12"))
SLACK = float(os.environ.get("OCU_TEST_SLACK_S", "5"))
WINDOWS = 50
SILENCE = 2.0  # s: longer than a busy machine keeps a healthy process waiting
SCHEMES = ("serial-explicit", "leap-frog", "parallel-explicit", "serial-implicit", "parallel-implicit")
# Of a participant: in a window, while checkpoints are written, during the farewell.
IN_WINDOW = ("kill", "stop", "exit", "abort", "not_finite", "size", "late")
IN_STATE = ("kill-checkpoint", "stop-checkpoint", "exit-checkpoint", "kill-farewell", "exit-farewell")
OF_COUPLER = ("coupler-kill", "coupler-stop", "coupler-interrupt")


class Soak(CouplerTest):
    def settings(self, scheme):
        keys = {"coupling.scheme": scheme, "coupling.checkpoint_every_windows": 10, "coupling.window_s": 0.01,
                "coupling.silence_limit_s": SILENCE, "coupling.start_limit_s": 20.0, "time.end_s": 0.01 * WINDOWS}
        if scheme == "leap-frog":  # lock step: as many windows of its own width
            del keys["coupling.window_s"]
            keys["time.end_s"] = 0.005 * WINDOWS
        else:
            keys["coupling.window"] = "fixed"
        return [x for key, value in keys.items() for x in ("--set", f"{key}={value}")]

    def run_with_fault(self, chance, arguments, out):
        """Runs until the fault has ended it; what was done, in words."""
        side, window = chance.choice(("FLOW", "SOLID")), chance.randint(0, WINDOWS)
        kind = chance.choice(IN_WINDOW * 2 + IN_STATE + OF_COUPLER)
        env = {} if kind in OF_COUPLER else {f"OCU_TOY_FAULT_{side}": f"{kind}@{window}"}
        if kind in OF_COUPLER:  # slow enough to be hit somewhere
            env = {"OCU_TOY_FAULT_SOLID": f"late@{window}"}
        process = self.start(*arguments, out=out, env=env)
        solvers = []
        if kind in OF_COUPLER:
            time.sleep(chance.uniform(0.0, 0.3))
            solvers = children_of(process.pid)
            number = {"coupler-kill": signal.SIGKILL, "coupler-stop": signal.SIGSTOP, "coupler-interrupt": signal.SIGINT}
            process.send_signal(number[kind])
            if kind == "coupler-stop":  # its solvers end by themselves; then it must still end in order
                time.sleep(SILENCE + 0.5)
                process.send_signal(signal.SIGCONT)
        text = process.communicate(timeout=PATIENCE)[0]
        deadline = time.monotonic() + 2.0 + SLACK
        while any(alive(p) for p in solvers):
            self.assertLess(time.monotonic(), deadline, f"{kind}: a solver outlived its coupler")
            time.sleep(0.02)
        return f"{kind} of {side} in window {window}", process.returncode, text

    def check_files(self, out, what):
        """Everything that looks finished is whole; the recording can be read up to where it ends."""
        if not os.path.isdir(self.path(out)):  # killed before it had made its folder
            return
        for name in os.listdir(self.path(out)):
            if name.startswith("traffic") and os.path.getsize(self.path(out, name)) > 0:
                ended = self.tool("dump", self.path(out, name))
                readable = ended.code == 0 or "cut" in ended.text or "not a record" in ended.text
                self.assertTrue(readable, what + ended.text[-500:])
        checkpoints = self.path(out, "checkpoint")
        for name in os.listdir(checkpoints) if os.path.isdir(checkpoints) else []:
            if not name.endswith(".part"):
                self.assertEqual(sorted(os.listdir(os.path.join(checkpoints, name))),
                                 ["coupler.state", "flow.state", "solid.state"], what)

    def test_every_run_ends_and_every_resumed_run_equals_the_whole_one(self):
        chance = random.Random(2026)
        whole = {}
        for scheme in SCHEMES:
            ended = self.run_coupler(*self.settings(scheme), out=f"whole-{scheme}")
            self.assertEqual(ended.code, 0, ended.text)
            whole[scheme] = self.rows(f"whole-{scheme}")
            self.assertGreaterEqual(len(whole[scheme]), WINDOWS)
        counts, slowest = {}, 0.0
        for number in range(RUNS):
            scheme = SCHEMES[number % len(SCHEMES)]
            arguments = self.settings(scheme)
            out = f"run-{number}"
            begin = time.monotonic()
            what, code, text = self.run_with_fault(chance, arguments, out)
            slowest = max(slowest, time.monotonic() - begin)
            what = f"run {number}, {scheme}, {what}: "
            self.assertIn(code, (0, 1, 3, 4, -9, -2), what + text)  # -2: hit before it watched for signals
            counts[code] = counts.get(code, 0) + 1
            self.check_files(out, what)
            kept = self.path(out, "checkpoint")
            resumable = os.path.isdir(kept) and any(not n.endswith(".part") for n in os.listdir(kept))
            again = arguments + (["--resume", self.path(out)] if resumable else [])
            if code != 0:
                ended = self.run_coupler(*again, out=out)
                self.assertEqual(ended.code, 0, what + ended.text)
            self.assertEqual(self.rows(out), whole[scheme], what)
            self.check_files(out, what)
            shutil.rmtree(self.path(out))
        print(f"{RUNS} runs, {RUNS * WINDOWS} windows; ends by exit code: {counts}; slowest {slowest:.1f} s")


if __name__ == "__main__":
    unittest.main(verbosity=2)
