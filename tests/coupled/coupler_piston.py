"""The whole coupler against the exact solution of the piston, replayed, interrupted and resumed."""

import math
import os
import shutil
import unittest

from coupler_harness import FLOW, PATIENCE, SOLID, CouplerTest


def order(errors):
    return math.log2(errors[-2] / errors[-1])


class Piston(CouplerTest):
    # Windows shrink with the grid and with the solid's step, so that every error is of the window.
    # Courant number 0.4: near 0.8 the toy shows no clean order (not explained; its own wall?).
    def errors_of(self, cells, *arguments):
        out = f"out{cells}"
        ended = self.run_coupler("--set", f"flow.cells={cells}", "--set",
                                 f"solid.stable_step_s={0.16 / cells}", "--set", "coupling.record=false",
                                 *arguments, out=out)
        self.assertEqual(ended.code, 0, ended.text)
        return self.errors(out)

    def orders(self, name, *arguments):
        errors = [self.errors_of(n, *arguments) for n in (16, 32, 64)]
        position, velocity, pressure = zip(*errors)
        print(f"{name}: position {position[-1]:.2e} order {order(position):.2f}, velocity "
              f"{velocity[-1]:.2e} order {order(velocity):.2f}, pressure {pressure[-1]:.2e} order "
              f"{order(pressure):.2f}")
        return position, velocity, pressure

    def test_default_scheme_is_of_second_order(self):
        for errors in self.orders("serial-explicit, subcycle"):
            self.assertGreaterEqual(order(errors), 1.9)

    def test_lockstep_is_of_second_order(self):
        for errors in self.orders("serial-explicit, lockstep", "--set", "coupling.window=lockstep"):
            self.assertGreaterEqual(order(errors), 1.9)

    def test_scheme_of_the_paper_is_of_first_order(self):
        position, velocity, _ = self.orders("paper", "--set", "coupling.scheme=paper")
        # Frozen structure: the wall is one window late, so the error is linear in the window.
        self.assertAlmostEqual(order(position), 1.0, delta=0.1)
        self.assertAlmostEqual(order(velocity), 1.0, delta=0.1)

    def test_straight_path_spoils_the_pressure(self):
        cubic = self.errors_of(32)
        straight = self.errors_of(32, "--set", "coupling.wall_path=straight")
        print(f"pressure error: cubic {cubic[2]:.2e}, straight {straight[2]:.2e}")
        self.assertGreater(straight[2], 3.0 * cubic[2])

    def test_both_sides_report_the_same_work(self):
        ended = self.run_coupler()
        self.assertEqual(ended.code, 0, ended.text)
        last = self.rows()[-1].split(",")
        exchanged = sum(abs(float(row.split(",")[4])) for row in self.rows())
        relative = abs(float(last[12])) / exchanged
        print(f"interface energy error {relative:.1e} of the energy exchanged")
        # Second order in the window: (omega w)^2 = (1.18 * 0.0105)^2 = 1.5e-4.
        self.assertLess(relative, 1.5e-4)

    def test_last_window_ends_exactly_at_the_end(self):
        self.write_case(end=0.3)
        ended = self.run_coupler()
        self.assertEqual(ended.code, 0, ended.text)
        self.assertEqual(float(self.rows()[-1].split(",")[0]), 0.3)

    def test_too_light_a_solid_is_refused_with_numbers(self):
        ended = self.run_coupler("--set", "solid.mass_kg_m2=0.2", "--set", "coupling.theta_warn=0.02",
                                 "--set", "coupling.theta_refuse=0.04")
        self.assertEqual(ended.code, 4, ended.text)
        self.assertIn("theta = 0.06", ended.text)
        self.assertIn("above 0.04", ended.text)


class Replay(CouplerTest):
    def record(self, *arguments):
        ended = self.run_coupler(*arguments, out="recorded")
        self.assertEqual(ended.code, 0, ended.text)
        return self.path("recorded", "traffic.ocu")

    def replay(self, traffic, side, *arguments):
        live = ("--solid", SOLID) if side == "flow" else ("--flow", FLOW)
        return self.tool("replay", traffic, "--as", side, self.case, "--out", self.path("replay"), *live,
                         *arguments)

    def test_each_side_reproduces_the_recording_byte_for_byte(self):
        traffic = self.record()
        for side in ("flow", "solid"):
            ended = self.replay(traffic, side)
            self.assertEqual(ended.code, 0, ended.text)
            self.assertIn("byte for byte", ended.text)

    def test_first_difference_is_named_with_both_values(self):
        traffic = self.record()
        # The live piston misreports one velocity in window 20, but only where the environment says so.
        keys = ("--set", "solid.fault=nudge", "--set", "solid.fault_window=20")
        self.assertEqual(self.replay(traffic, "flow", *keys).code, 2)  # another case: said so
        traffic = self.record(*keys)
        ended = self.replay(traffic, "flow", *keys)
        self.assertEqual(ended.code, 0, ended.text)
        os.environ["OCU_TOY_NUDGE"] = "1"
        self.addCleanup(os.environ.pop, "OCU_TOY_NUDGE", None)
        ended = self.replay(traffic, "flow", *keys)
        self.assertEqual(ended.code, 3, ended.text)
        self.assertRegex(ended.text, r"window 20 .*velocity\.x of vertex 2: recorded \S+, found \S+")
        ended = self.replay(traffic, "flow", "--tolerance", "1e-3", *keys)
        self.assertEqual(ended.code, 0, ended.text)

    def test_diff_and_dump_read_recordings(self):
        self.record()
        shutil.move(self.path("recorded"), self.path("first"))
        second = self.record()
        ended = self.tool("diff", self.path("first", "traffic.ocu"), second)
        self.assertEqual(ended.code, 0, ended.text)
        self.assertIn("messages agree", ended.text)
        other = self.run_coupler("--set", "coupling.wall_path=straight", out="other")
        self.assertEqual(other.code, 0, other.text)
        ended = self.tool("diff", second, self.path("other", "traffic.ocu"))
        self.assertEqual(ended.code, 1, ended.text)
        self.assertIn("overpressure of vertex 0", ended.text)
        ended = self.tool("dump", second)
        self.assertEqual(ended.code, 0, ended.text)
        self.assertIn("RESULT", ended.text)


class Resume(CouplerTest):
    every = ("--set", "coupling.checkpoint_every_windows=70")

    def test_resumed_run_equals_the_uninterrupted_one_bit_for_bit(self):
        whole = self.run_coupler(*self.every, out="whole")
        self.assertEqual(whole.code, 0, whole.text)
        kept = sorted(os.listdir(self.path("whole", "checkpoint")))
        self.assertEqual(len(kept), 2, kept)
        window = int(kept[-1])
        resumed = self.run_coupler(*self.every, "--resume", self.path("whole"), out="resumed")
        self.assertEqual(resumed.code, 0, resumed.text)
        self.assertGreater(len(self.rows("resumed")), 20)
        self.assertEqual(self.rows("resumed"), self.rows("whole")[window:])
        whole_history = self.read("whole", "spring_history.txt").splitlines()
        self.assertEqual(self.read("resumed", "spring_history.txt").splitlines(), whole_history[window:])

    def test_ctrl_c_ends_cleanly_and_the_rest_can_be_resumed(self):
        long_case = ("--set", "time.end_s=40.0")
        whole = self.run_coupler(*long_case, out="whole")
        self.assertEqual(whole.code, 0, whole.text)
        stopped = self.run_coupler(*long_case, out="stopped", env={"OCU_TOY_FAULT_SOLID": "interrupt@100"})
        text = stopped.text
        self.assertEqual(stopped.code, 1, text)
        self.assertRegex(text, r"stopped at window \d+, t = .* --resume")
        done = len(self.rows("stopped"))
        self.assertLess(done, len(self.rows("whole")))
        resumed = self.run_coupler(*long_case, "--resume", self.path("stopped"), out="stopped")
        self.assertEqual(resumed.code, 0, resumed.text)
        self.assertEqual(self.rows("stopped"), self.rows("whole"))

    def test_checkpoint_of_another_case_is_refused(self):
        self.run_coupler(*self.every, out="whole")
        other = self.run_coupler("--set", "flow.cells=16", "--resume", self.path("whole"), out="other")
        self.assertEqual(other.code, 2, other.text)
        self.assertIn("the checkpoint is of case", other.text)


class Ways(CouplerTest):
    def test_encrypted_tcp_gives_the_same_results_as_ipc(self):
        ipc = self.run_coupler(out="ipc")
        tcp = self.run_coupler("--endpoint", "tcp://127.0.0.1:0", out="tcp")
        self.assertEqual((ipc.code, tcp.code), (0, 0), ipc.text + tcp.text)
        self.assertEqual(self.rows("ipc"), self.rows("tcp"))
        for name in ("flow.key", "solid.key"):
            self.assertEqual(os.stat(self.path("tcp", "keys", name)).st_mode & 0o777, 0o600)

    def test_solvers_started_by_somebody_else_in_any_order(self):
        for first, second in ((FLOW, SOLID), (SOLID, FLOW)):
            shutil.rmtree(self.path("out"), ignore_errors=True)
            process = self.start("--await")
            connection = self.connection()
            sides = [self.start_participant(first, connection)]
            self.wait_for_line("out", "log", "coupler.log", text=" is ")
            sides.append(self.start_participant(second, connection))
            text = process.communicate(timeout=PATIENCE)[0]
            self.assertEqual(process.returncode, 0, text)
            self.assertEqual([s.wait(timeout=PATIENCE) for s in sides], [0, 0])

    def test_check_shows_all_faults_together(self):
        ended = self.tool("check", self.case, "--flow", FLOW, "--solid", SOLID)
        self.assertEqual(ended.code, 0, ended.text)
        self.assertIn("the case can run", ended.text)
        ended = self.tool("check", self.case, "--flow", FLOW, "--solid", SOLID, "--set", "coupling.windw=1",
                          "--set", "flow.cells=1", "--set", "solid.mass_kg_m2=-2.0", "--set", "time.end_s=-1.0")
        self.assertEqual(ended.code, 2, ended.text)
        for part in ("coupling.windw", "did you mean 'window'", "flow.cells", "solid.mass_kg_m2", "time.end_s"):
            self.assertIn(part, ended.text)
        self.assertEqual(ended.text.count("time.end_s: end_s is -1"), 1, ended.text)

    def test_python_twin_plays_the_solid(self):
        twin = os.path.join(os.path.dirname(os.path.abspath(__file__)), "coupler_spring.py")
        cpp = self.run_coupler(out="cpp")
        python = self.run_coupler("--solid", f"/usr/bin/python3 {twin}", out="python")
        self.assertEqual((cpp.code, python.code), (0, 0), cpp.text + python.text)
        ours, theirs = (float(self.rows(o)[-1].split(",")[5]) for o in ("cpp", "python"))
        # The same formulas in another order of operations: round-off of a few hundred windows.
        self.assertAlmostEqual(theirs / ours, 1.0, delta=1e-6)


if __name__ == "__main__":
    unittest.main(verbosity=2)
