"""Whatever happens to one participant, all others end in time, with a message that names it."""

import os
import signal
import sys
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "coupled"))

from coupler_harness import FLOW, PATIENCE, SOLID, CouplerTest, alive, children_of

import numpy as np
import zmq

import coupling_pb2 as pb
from ocublast_link import LinkError, Participant

# The limits of design: 1 s after a death, the set limit after silence; the machine that runs the
# tests may be busy with other things, so every bound is given this much more.
SLACK = float(os.environ.get("OCU_TEST_SLACK_S", "5"))
SHORT = ("--set", "coupling.silence_limit_s=1.2", "--set", "coupling.start_limit_s=5.0")


class Death(CouplerTest):
    def fault(self, side, kind, window, *arguments):
        ended = self.run_coupler("--set", f"{side}.fault={kind}", "--set", f"{side}.fault_window={window}",
                                 *arguments, out=f"{side}-{kind}-{window}")
        self.assertIn(f"{side} (", ended.text)
        self.assertIn(f"{side}.log", ended.text)
        return ended

    def test_killed_in_any_state(self):
        for side in ("flow", "solid"):
            for window, when in ((0, "during the handshake"), (1, "in window 1 "), (40, "in window 40 ")):
                with self.subTest(side=side, window=window):
                    ended = self.fault(side, "kill", window)
                    self.assertEqual(ended.code, 3, ended.text)
                    self.assertIn("killed by signal 9", ended.text)
                    self.assertIn(when, ended.text)
                    self.assertLess(ended.seconds, 1.0 + SLACK)

    def test_killed_from_outside_while_the_other_computes(self):
        process = self.start("--set", "flow.fault=hang", "--set", "flow.fault_window=10")
        self.wait_for_line("out", "log", "flow.log", text="hangs in window 10")
        solid = [p for p in children_of(process.pid)
                 if "spring" in open(f"/proc/{p}/cmdline", encoding="ascii").read()]
        begin = time.monotonic()
        os.kill(solid[0], signal.SIGKILL)
        text = process.communicate(timeout=PATIENCE)[0]
        self.assertEqual(process.returncode, 3, text)
        self.assertIn("solid (spring 1) failed in window 10", text)
        self.assertLess(time.monotonic() - begin, 2.0 + SLACK)  # 1 s patience with the hanging flow

    def test_coupler_killed_takes_the_solvers_with_it(self):
        process = self.start("--set", "flow.fault=hang", "--set", "flow.fault_window=10")
        self.wait_for_line("out", "log", "flow.log", text="hangs in window 10")
        solvers = children_of(process.pid)
        self.assertEqual(len(solvers), 2)
        process.kill()
        process.wait()
        deadline = time.monotonic() + 1.0 + SLACK
        while any(alive(p) for p in solvers):
            self.assertLess(time.monotonic(), deadline, "a solver outlived its coupler")
            time.sleep(0.02)

    def test_own_exit_code_of_the_failed_side_is_the_run_s(self):
        for side in ("flow", "solid"):
            ended = self.fault(side, "abort", 7)
            self.assertEqual(ended.code, 4, ended.text)
            self.assertIn("negative density in cell 7", ended.text)
            self.assertIn("in window 7 ", ended.text)
        # A plain exit in the handshake, before HELLO: the program is not known yet.
        ended = self.run_coupler("--set", "flow.fault=early")
        self.assertEqual(ended.code, 3, ended.text)
        self.assertIn("flow failed during the handshake", ended.text)

    def test_what_the_solver_printed_last_is_shown(self):
        ended = self.run_coupler("--set", "flow.cells=-3")
        self.assertEqual(ended.code, 2, ended.text)
        self.assertIn("cells is -3", ended.text)

    def test_program_that_does_not_exist(self):
        ended = self.run_coupler("--solid", "/nowhere/solid_solver")
        self.assertEqual(ended.code, 3, ended.text)
        self.assertIn("/nowhere/solid_solver", ended.text)
        self.assertLess(ended.seconds, 2.0 + SLACK)


class Silence(CouplerTest):
    def test_stopped_process_is_noticed_by_its_missing_heartbeat(self):
        for side in ("flow", "solid"):
            for window in (0, 30):
                with self.subTest(side=side, window=window):
                    ended = self.run_coupler("--set", f"{side}.fault=stop", "--set",
                                             f"{side}.fault_window={window}", *SHORT, out=f"{side}{window}")
                    self.assertEqual(ended.code, 3, ended.text)
                    self.assertIn(f"{side} (", ended.text)
                    self.assertIn("no heartbeat in time", ended.text)
                    self.assertLess(ended.seconds, 1.5 + 1.5 + SLACK)

    def test_endless_window_ends_at_the_step_limit(self):
        ended = self.run_coupler("--set", "solid.fault=hang", "--set", "solid.fault_window=5", "--set",
                                 "coupling.step_limit_s=1.5")  # longer than a busy machine takes for a healthy window
        self.assertEqual(ended.code, 3, ended.text)
        self.assertIn("solid (spring 1) failed in window 5", ended.text)
        self.assertRegex(ended.text, r"RESULT was awaited in vain for (1\.[5-9]|[2-9])")

    def test_long_window_is_no_fault(self):
        # The flow waits for a solid that computes longer than the silence limit: WAIT keeps it.
        process = self.start("--set", "solid.fault=hang", "--set", "solid.fault_window=5", *SHORT)
        self.wait_for_line("out", "log", "solid.log", text="hangs in window 5")
        time.sleep(3.0)  # more than twice the silence limit
        self.assertIsNone(process.poll())
        process.kill()
        process.communicate()

    def test_solver_that_never_speaks(self):
        ended = self.run_coupler("--set", "flow.fault=absent", *SHORT)
        self.assertEqual(ended.code, 3, ended.text)
        self.assertIn("flow failed during the handshake", ended.text)
        self.assertIn("HELLO was awaited in vain", ended.text)
        self.assertLess(ended.seconds, 5.0 + 2.0 + SLACK)

    def test_solvers_that_nobody_starts(self):
        ended = self.run_coupler("--await", *SHORT)
        self.assertEqual(ended.code, 3, ended.text)
        self.assertIn("HELLO was awaited in vain", ended.text)

    def test_solver_without_a_coupler(self):
        for endpoint in ("ipc:///tmp/nobody-listens-here", "tcp://127.0.0.1:9"):
            process = self.start_participant(FLOW, {"OCUBLAST_ENDPOINT": endpoint, "OCUBLAST_TOKEN": "x",
                                                    "OCUBLAST_KEYS": "/nowhere" if "tcp" in endpoint else "",
                                                    "OCUBLAST_SILENCE_LIMIT_S": "0.5"})
            text = process.communicate(timeout=PATIENCE)[0]
            self.assertEqual(process.returncode, 3, text)
            self.assertIn(f"cannot reach the coupler at {endpoint}", text)


class Strangers(CouplerTest):
    def test_other_case_is_refused_with_both_hashes(self):
        ended = self.run_coupler("--set", "solid.fault=case_hash")
        self.assertEqual(ended.code, 3, ended.text)
        self.assertRegex(ended.text, r"solid.* case hash [0-9a-f]{16} of spring 1 differs from [0-9a-f]{16}")
        self.assertLess(ended.seconds, 1.0 + SLACK)

    def test_wrong_token_is_refused_with_an_answer(self):
        ended = self.run_coupler("--set", "solid.fault=token", *SHORT)
        self.assertEqual(ended.code, 3, ended.text)
        self.assertIn("solid failed during the handshake", ended.text)
        self.assertIn("the token is not that of this run", ended.text)

    def throw_garbage(self, endpoint):
        context = zmq.Context()
        header = pb.Header()
        header.kind, header.run_id, header.seq, header.window = pb.KIND_RESULT, 1, 1, 5
        header.fields, header.payload_bytes, header.payload_checksum = 0, 0, 0
        hello = pb.Header()
        hello.kind = pb.KIND_HELLO
        messages = [[b""], [b"garbage"], [os.urandom(50), os.urandom(50)], [b"\x00" * 70_000, b""],
                    [b"a"] * 9, [header.SerializeToString(), b""], [hello.SerializeToString(), b""],
                    [b"\xff" * 40, b""], [b"", b"x" * 1_000_000], [b"", b"x" * 3_000_000]]
        for message in messages:
            socket = context.socket(zmq.DEALER)
            socket.linger = 200
            socket.connect(endpoint)
            socket.send_multipart(message)
            if socket.poll(30):
                socket.recv_multipart()
            socket.close()
        context.term()

    def test_garbage_from_strangers_does_not_disturb_the_run(self):
        process = self.start("--await", "--set", "coupling.max_message_MB=2.0")
        connection = self.connection()
        hash_of = ["--set", "coupling.max_message_MB=2.0"]
        self.throw_garbage(connection["OCUBLAST_ENDPOINT"])
        sides = []
        for program in (SOLID, FLOW):
            sides.append(self.start_with(program, connection, hash_of))
            self.throw_garbage(connection["OCUBLAST_ENDPOINT"])
        text = process.communicate(timeout=PATIENCE)[0]
        self.assertEqual(process.returncode, 0, text)
        self.assertEqual([s.wait(timeout=PATIENCE) for s in sides], [0, 0])

    def start_with(self, program, connection, arguments):
        import subprocess
        process = subprocess.Popen([program, self.case, *arguments], env={**os.environ, **connection},
                                   stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.addCleanup(lambda: process.poll() is None and process.kill())
        return process

    def test_second_instance_of_a_role_is_refused_with_an_answer(self):
        process = self.start("--await")
        connection = self.connection()
        first = self.start_participant(SOLID, connection)
        self.wait_for_line("out", "log", "coupler.log", text="solid is spring 1")
        second = self.start_participant(SOLID, connection)
        text = second.communicate(timeout=PATIENCE)[0]
        self.assertEqual(second.returncode, 3, text)
        self.assertIn("a solid participant is here already (spring 1)", text)
        flow = self.start_participant(FLOW, connection)
        text = process.communicate(timeout=PATIENCE)[0]
        self.assertEqual(process.returncode, 0, text)
        self.assertEqual([first.wait(timeout=PATIENCE), flow.wait(timeout=PATIENCE)], [0, 0])

    def test_key_that_is_not_on_the_list(self):
        process = self.start("--await", "--endpoint", "tcp://127.0.0.1:0", *SHORT)
        endpoint = self.connection()["OCUBLAST_ENDPOINT"]
        context = zmq.Context()
        socket = context.socket(zmq.DEALER)
        socket.linger = 0
        with open(self.path("out", "keys", "flow.key"), encoding="ascii") as file:
            server = file.read().split()[0]
        socket.curve_publickey, socket.curve_secretkey = zmq.curve_keypair()
        socket.curve_serverkey = server.encode()
        monitor = socket.get_monitor_socket(zmq.EVENT_HANDSHAKE_FAILED_AUTH | zmq.EVENT_HANDSHAKE_SUCCEEDED)
        socket.connect(endpoint)
        self.assertTrue(monitor.poll(1000 * PATIENCE))
        event = int.from_bytes(monitor.recv_multipart()[0][:2], "little")
        self.assertEqual(event, zmq.EVENT_HANDSHAKE_FAILED_AUTH)
        socket.disable_monitor()
        monitor.close(0)
        socket.close()
        context.term()
        process.kill()
        process.communicate()

    def test_second_coupler_in_the_same_directory_is_refused(self):
        first = self.start("--await")
        self.connection()
        ended = self.run_coupler()
        self.assertEqual(ended.code, 3, ended.text)
        self.assertIn("another coupler is running in this directory", ended.text)
        first.kill()
        first.communicate()


class BadMessages(CouplerTest):
    """A participant that passed the handshake and then misbehaves."""

    def test_values_that_are_not_finite(self):
        for side, what in (("flow", r"overpressure of vertex 2 is nan"), ("solid", r"velocity of vertex 1 is inf")):
            ended = self.run_coupler("--set", f"{side}.fault=not_finite", "--set", f"{side}.fault_window=9",
                                     out=side)
            self.assertEqual(ended.code, 3, ended.text)
            self.assertRegex(ended.text, rf"{side} \(.*\) failed in window 9 .*{what}")

    def test_too_short_an_array_is_refused_before_it_is_sent(self):
        ended = self.run_coupler("--set", "flow.fault=size", "--set", "flow.fault_window=9")
        self.assertEqual(ended.code, 3, ended.text)
        self.assertIn("overpressure has 1 values, the interface mesh needs 4", ended.text)

    def play_flow(self, misbehave):
        """A flow side in Python that computes nothing and misbehaves in window 3."""
        process = self.start("--await", "--set", "coupling.silence_limit_s=3.0")
        connection = self.connection()
        os.environ.update(connection)
        self.addCleanup(lambda: [os.environ.pop(k, None) for k in connection])
        solid = self.start_solid(connection)
        flow = Participant("flow", "liar 1", int(connection["OCUBLAST_CASE_HASH"], 16))
        flow.receive_mesh()
        flow.ready(0.02)
        try:
            for order in flow.orders():
                if order.window == 3:
                    misbehave(flow)
                else:
                    flow.send(overpressure=np.zeros(flow.n_vertices), stable_step=0.02, steps_taken=order.steps)
        except LinkError as error:
            refused = str(error)
        else:
            refused = ""
        flow.close()
        text = process.communicate(timeout=PATIENCE)[0]
        self.assertEqual(process.returncode, 3, text)
        self.assertIn("flow (liar 1) failed", text)
        self.assertEqual(solid.wait(timeout=3.0 + SLACK), 3)
        return text, refused

    def start_solid(self, connection):
        import subprocess
        process = subprocess.Popen([SOLID, self.case, "--set", "coupling.silence_limit_s=3.0"], text=True,
                                   env={**os.environ, **connection}, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self.addCleanup(lambda: process.poll() is None and process.kill())
        return process

    def answer(self, flow, n=None, change=None):
        h = flow.result(stable_step=0.02, steps_taken=1)
        h.fields = 8
        h.n_vertices = flow.n_vertices if n is None else n
        payload = np.zeros(h.n_vertices).tobytes()
        if change is not None:
            payload = change(h, payload) or payload
        flow.send_raw(h, payload)

    def test_wrong_number_of_vertices(self):
        text, refused = self.play_flow(lambda flow: self.answer(flow, n=5))
        self.assertIn("has 5 vertices, the interface mesh 4", text)
        self.assertIn("the coupler ended the run", refused)

    def test_payload_shorter_than_announced(self):
        def send(flow):
            h = flow.result(stable_step=0.02, steps_taken=1)
            h.fields, h.n_vertices, h.payload_bytes, h.payload_checksum = 8, 4, 32, 1
            flow.socket.send_multipart([h.SerializeToString(), b"short"])
        self.assertIn("5 payload bytes came, 32 were announced", self.play_flow(send)[0])

    def test_wrong_checksum(self):
        def send(flow):
            h = flow.result(stable_step=0.02, steps_taken=1)
            h.fields, h.n_vertices, h.payload_bytes, h.payload_checksum = 8, 4, 32, 1
            flow.socket.send_multipart([h.SerializeToString(), bytes(32)])
        self.assertIn("payload checksum", self.play_flow(send)[0])

    def test_message_out_of_order(self):
        def send(flow):
            flow.sent += 1
            self.answer(flow)
        self.assertIn("has number", self.play_flow(send)[0])

    def test_message_out_of_state(self):
        self.assertIn("sent DONE while RESULT", self.play_flow(lambda flow: flow.checkpoint_written())[0])

    def test_answer_for_another_window(self):
        def change(h, payload):
            h.window = 7
            return payload
        self.assertIn("answered window 7", self.play_flow(lambda flow: self.answer(flow, change=change))[0])

    def test_garbage_after_the_handshake(self):
        self.assertIn("message refused", self.play_flow(lambda f: f.socket.send_multipart([b"\xff" * 9, b""]))[0])

    def test_oversized_message(self):
        text, _ = self.play_flow(lambda flow: flow.socket.send_multipart([b"", bytes(300_000_000)]))
        self.assertIn("closed its connection", text)


if __name__ == "__main__":
    unittest.main(verbosity=2)
