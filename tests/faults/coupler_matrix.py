"""Each fault of a participant in each state of the protocol: who, when and why in one line, all others gone in time."""

import os
import re
import signal
import sys
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "coupled"))

from coupler_harness import PATIENCE, CouplerTest, alive, children_of

SLACK = float(os.environ.get("OCU_TEST_SLACK_S", "5"))
SILENCE, START = 1.0, 3.0  # s: limits of these runs; longer than a busy machine keeps a healthy process waiting
# State: what the report calls it, and what the run needs to get there.
STATES = {
    "start": ("during the handshake", ()),                                  # before HELLO
    "hello": ("during the handshake", ()),                                  # admitted, before MESH and READY
    "ready": ("during the handshake", ()),                                  # mesh is there, before READY
    "window": (r"in window 20 \(t = ", ()),
    "iteration": (r"in window \d+ \(t = ", ("--set", "coupling.scheme=serial-implicit")),
    "checkpoint": (r"(at|in|after|during|while) ", ("--set", "coupling.checkpoint_every_windows=10")),
    "farewell": (r"(at|in|after|during|while) ", ()),
}
# Fault: exit code of the run, what the line says of it, longest time until all have ended, s.
FAULTS = {
    "kill": (3, "killed by signal 9", 1.0),
    "exit": (4, "code 4", 1.0),
    "stop": (3, "no heartbeat in time|awaited in vain", SILENCE + 1.0),
}


class Matrix(CouplerTest):
    def settings(self, *more):
        keys = {"coupling.silence_limit_s": SILENCE, "coupling.start_limit_s": START, "coupling.window": "fixed",
                "coupling.window_s": 0.02, "time.end_s": 1.0}
        return [x for key, value in keys.items() for x in ("--set", f"{key}={value}")] + list(more)

    def test_every_fault_of_a_participant_in_every_state(self):
        slowest = {}
        for state, (when, more) in STATES.items():
            for fault, (code, why, limit) in FAULTS.items():
                for side in ("flow", "solid"):
                    kind = f"{fault}@20" if state == "window" else f"{fault}-{state}@0"
                    out = f"{state}-{fault}-{side}"
                    with self.subTest(state=state, fault=fault, side=side):
                        process = self.start(*self.settings(*more), out=out, env={f"OCU_TOY_FAULT_{side.upper()}": kind})
                        started = set()
                        while process.poll() is None:
                            started.update(children_of(process.pid) if alive(process.pid) else [])
                            time.sleep(0.02)
                        seconds = time.monotonic() - self.begin
                        text = process.communicate(timeout=PATIENCE)[0]
                        self.assertEqual(process.returncode, code, text)
                        lines = [line for line in text.splitlines() if " failed " in line]
                        self.assertTrue(lines, text)
                        self.assertRegex(lines[0], rf"{side}( \(.*\))? failed {when}")
                        self.assertRegex(lines[0], why)
                        self.assertIn(f"{side}.log", lines[0])
                        self.assertFalse([p for p in started if alive(p)])
                        # Sets up, runs to the state (0.5 s here), notices.
                        longest = limit + 1.0 + (START if state in ("start", "hello", "ready") else 0.0)
                        self.assertLess(seconds, longest + SLACK)
                        slowest[fault] = max(slowest.get(fault, 0.0), seconds)
                        self.assert_nothing_half_written(out)
        print({fault: f"{seconds:.2f} s from start to end at most" for fault, seconds in slowest.items()})

    def assert_nothing_half_written(self, out):
        kept = self.path(out, "checkpoint")
        for name in os.listdir(kept) if os.path.isdir(kept) else []:
            if not name.endswith(".part"):
                self.assertEqual(sorted(os.listdir(os.path.join(kept, name))), ["coupler.state", "flow.state", "solid.state"])
        traffic = self.path(out, "traffic.ocu")
        if os.path.exists(traffic):
            ended = self.tool("dump", traffic)
            self.assertEqual(ended.code, 0, ended.text[-500:])

    def test_the_coupler_killed_or_frozen_in_every_state(self):
        for state, (_, more) in STATES.items():
            for number in (signal.SIGKILL, signal.SIGSTOP):
                with self.subTest(state=state, signal=number):
                    out = f"{state}-{number}"
                    # The flow hangs in the state, so that the coupler is hit there.
                    kind = "hang@20" if state == "window" else f"hang-{state}@0"
                    process = self.start(*self.settings(*more), out=out, env={"OCU_TOY_FAULT_FLOW": kind})
                    self.wait_for_line(out, "log", "flow.log", text="hangs in")
                    solvers = children_of(process.pid)
                    self.assertTrue(solvers, self.read(out, "log", "coupler.log"))
                    process.send_signal(number)
                    begin = time.monotonic()
                    limit = 1.0 if number == signal.SIGKILL else START + SILENCE + 1.0
                    # A frozen coupler cannot end a hanging flow: the solid ends by itself.
                    watched = solvers if number == signal.SIGKILL else self.of(solvers, "spring")
                    while any(alive(p) for p in watched):
                        self.assertLess(time.monotonic() - begin, limit + SLACK, f"{state}: a solver outlived its coupler")
                        time.sleep(0.02)
                    process.kill()
                    process.communicate(timeout=PATIENCE)

    @staticmethod
    def of(pids, program):
        found = []
        for pid in pids:
            try:
                with open(f"/proc/{pid}/cmdline", encoding="ascii") as file:
                    if re.search(program, file.read()):
                        found.append(pid)
            except OSError:
                continue
        return found


if __name__ == "__main__":
    unittest.main(verbosity=2)
