"""What only the system can do to a run: a full disk, a network between three hosts, a cut link.

Needs root for a small file system and for network namespaces; skipped where that is not permitted."""

import contextlib
import json
import os
import shutil
import subprocess
import sys
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "coupled"))

from coupler_harness import BIN, FLOW, PATIENCE, SOLID, CouplerTest, Ended
from coupler_solvers import CASE as SOLVERS_CASE, make_mesh

SLACK = float(os.environ.get("OCU_TEST_SLACK_S", "5"))


def command(*words):
    return subprocess.run(words, capture_output=True, text=True, check=False)


class FullDisk(CouplerTest):
    def setUp(self):
        super().setUp()
        os.mkdir(self.path("small"))
        if os.geteuid() != 0 or command("mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", self.path("small")).returncode != 0:
            self.skipTest("no small file system can be mounted here")
        self.addCleanup(command, "umount", "-l", self.path("small"))

    def test_recording_that_does_not_fit_ends_the_run_with_the_reason(self):
        ended = self.run_coupler("--set", "time.end_s=40.0", out="small/out")
        self.assertEqual(ended.code, 3, ended.text)
        self.assertRegex(ended.text, r"traffic\.ocu: the recording cannot be written: No space left on device")
        self.assertIn("coupling.record = false", ended.text)

    def test_checkpoint_that_does_not_fit_leaves_the_last_good_one(self):
        every = ("--set", "coupling.record=false", "--set", "coupling.checkpoint_every_windows=100")
        whole = self.run_coupler(*every, out="whole")
        self.assertEqual(whole.code, 0, whole.text)
        process = self.start(*every, out="small/out", env={"OCU_TOY_FAULT_SOLID": "hold@150", "OCU_TOY_GO": self.path("go")})
        self.wait_for("go.here")  # the checkpoint of window 100 is there, that of window 200 is to come
        self.assertIn("00000100", os.listdir(self.path("small/out", "checkpoint")))
        with contextlib.suppress(OSError), open(self.path("small", "filler"), "wb", buffering=0) as file:
            for _ in range(64):  # now the disk fills up
                file.write(bytes(8192))
        self.let_go()
        ended = Ended(process, self.begin)
        self.assertEqual(ended.code, 3, ended.text)
        self.assertRegex(ended.text, "cannot be written|could not be written")
        os.remove(self.path("small", "filler"))
        resumed = self.run_coupler(*every, "--resume", self.path("small/out"), out="resumed")
        self.assertEqual(resumed.code, 0, resumed.text)
        self.assertEqual(self.rows("resumed"), self.rows("whole")[100:])


class Network(CouplerTest):
    """Coupler, flow and solid in a network namespace each; the coupler's has a link to both others."""

    ADDRESS = "10.77.1.1"

    def setUp(self):
        super().setUp()
        tag = f"ocu{os.getpid() % 10000}"
        self.ns = {side: f"{tag}{side}" for side in "cfs"}
        if os.geteuid() != 0 or command("ip", "netns", "add", self.ns["c"]).returncode != 0:
            self.skipTest("no network namespaces here")
        self.addCleanup(command, "ip", "netns", "del", self.ns["c"])
        for number, side in ((1, "f"), (2, "s")):
            name = self.ns[side]
            self.assertEqual(command("ip", "netns", "add", name).returncode, 0)
            self.addCleanup(command, "ip", "netns", "del", name)
            made = command("ip", "link", "add", f"{tag}{side}0", "netns", self.ns["c"], "type", "veth", "peer", "name",
                           f"{tag}{side}1", "netns", name)
            if made.returncode != 0:
                self.skipTest("no virtual links here")
            self.link = f"{tag}s0"
            for where, device, host in ((self.ns["c"], f"{tag}{side}0", 1), (name, f"{tag}{side}1", 2)):
                self.assertEqual(command("ip", "-n", where, "addr", "add", f"10.77.{number}.{host}/24", "dev", device).returncode, 0)
                self.assertEqual(command("ip", "-n", where, "link", "set", device, "up").returncode, 0)
            command("ip", "-n", name, "route", "add", "default", "via", f"10.77.{number}.1")
            command("ip", "-n", name, "link", "set", "lo", "up")
        command("ip", "-n", self.ns["c"], "link", "set", "lo", "up")

    def launch(self, side, words, env=None):
        process = subprocess.Popen(["ip", "netns", "exec", self.ns[side], *map(str, words)], text=True,
                                   stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env={**os.environ, **(env or {})})
        self.addCleanup(lambda: process.poll() is None and process.kill())
        return process

    def start_all(self, *arguments, env=None, programs=(SOLID, FLOW), own=()):
        """Three hosts; each has only its own key. `own`: arguments of the solvers alone."""
        made = self.tool("keygen", self.path("keys"))
        self.assertEqual(made.code, 0, made.text)
        self.begin = time.monotonic()
        coupler = self.launch("c", [os.path.join(BIN, "coupler"), self.case, "--out", self.path("out"), "--quiet", "--await",
                                    "--endpoint", f"tcp://{self.ADDRESS}:46801", "--keys", self.path("keys"), *arguments])
        self.wait_for("out", "connection.env")
        sides = []
        for side, program in zip("sf", programs):
            keys = self.path(f"keys-{side}")
            os.mkdir(keys)
            name = "solid.key" if side == "s" else "flow.key"
            shutil.copy2(self.path("keys", name), keys)
            here = {"OCUBLAST_ENDPOINT": f"tcp://{self.ADDRESS}:46801", "OCUBLAST_KEYS": keys, **(env or {})}
            out = ("--out", self.path(f"out-{side}")) if own else ()
            sides.append(self.launch(side, [program, self.case, *arguments, *own, *out], here))
        return coupler, sides

    def hold_at(self, window):
        """Environment in which the toy solid waits in a window until the test lets it go."""
        return {"OCU_TOY_FAULT_SOLID": f"hold@{window}", "OCU_TOY_GO": self.path("go")}

    def cut(self, down):
        self.assertEqual(command("ip", "-n", self.ns["c"], "link", "set", self.link, "down" if down else "up").returncode, 0)

    def test_three_hosts_give_the_same_results_as_one(self):
        one = self.run_coupler(out="one")
        self.assertEqual(one.code, 0, one.text)
        coupler, sides = self.start_all()
        text = coupler.communicate(timeout=PATIENCE)[0]
        self.assertEqual(coupler.returncode, 0, text)
        self.assertEqual([s.wait(timeout=PATIENCE) for s in sides], [0, 0])
        self.assertEqual(self.rows("out"), self.rows("one"))

    def test_our_solvers_on_three_hosts_give_the_same_results_as_on_one(self):
        self.case = SOLVERS_CASE
        make_mesh(self.path("mesh"))
        shared = ("--mesh-dir", self.path("mesh"))
        programs = [os.path.join(BIN, name) for name in ("solid_solver", "flow_solver")]
        one = self.run_coupler(*shared, "--solid", programs[0], "--flow", programs[1], "--threads-flow", "1",
                               "--threads-solid", "1", out="one")
        self.assertEqual(one.code, 0, one.text)
        coupler, sides = self.start_all(*shared, programs=programs, own=("--threads", "1", "--quiet"))
        text = coupler.communicate(timeout=PATIENCE)[0]
        self.assertEqual(coupler.returncode, 0, text)
        self.assertEqual([s.wait(timeout=PATIENCE) for s in sides], [0, 0])
        self.assertGreater(len(self.rows("one")), 5)
        self.assertEqual(self.rows("out"), self.rows("one"))

    def test_our_solvers_end_when_the_link_of_one_stays_cut(self):
        self.case = SOLVERS_CASE
        make_mesh(self.path("mesh"))
        longer = ("--mesh-dir", self.path("mesh"), "--set", "time.end_s=1.0", "--set", "coupling.silence_limit_s=1.0")
        coupler, sides = self.start_all(*longer, own=("--threads", "1", "--quiet"),
                                        programs=[os.path.join(BIN, name) for name in ("solid_solver", "flow_solver")])
        self.wait_for("out", "coupling.csv")
        begin = time.monotonic()
        self.cut(True)
        text = coupler.communicate(timeout=PATIENCE)[0]
        self.assertEqual(coupler.returncode, 3, text)
        self.assertRegex(text, r"solid \(solid_solver .*\) failed in window \d+ .*no heartbeat in time")
        self.assertEqual([s.wait(timeout=PATIENCE) for s in sides], [3, 3])
        self.assertLess(time.monotonic() - begin, 1.0 + 2.0 + SLACK)

    def test_hosts_of_the_case_say_who_is_started_elsewhere_and_from_where(self):
        one = self.run_coupler("--set", "coupling.hosts.solid=", out="one")
        self.assertEqual(one.code, 0, one.text)
        self.assertEqual(self.tool("keygen", self.path("keys")).code, 0)
        endpoint = f"tcp://{self.ADDRESS}:46803"
        for address, code in (("10.77.2.2", 0), ("10.77.2.9", 3)):
            out = "out" + str(code)
            # A solid that is refused has to be there before the run ends, one that is not in time at all.
            more = ("--set", f"coupling.hosts.solid={address}", "--set", f"coupling.start_limit_s={6.0 if code else PATIENCE}")
            coupler = self.launch("c", [os.path.join(BIN, "coupler"), self.case, "--out", self.path(out), "--quiet", "--endpoint",
                                        endpoint, "--keys", self.path("keys"), "--flow", FLOW, *more])
            self.wait_for(out, "connection.env")
            solid = self.launch("s", [SOLID, self.case, *more], {"OCUBLAST_ENDPOINT": endpoint, "OCUBLAST_KEYS": self.path("keys")})
            text = coupler.communicate(timeout=PATIENCE)[0]
            self.assertEqual(coupler.returncode, code, text)
            said = solid.communicate(timeout=PATIENCE)[0]
            self.assertEqual(solid.returncode, code, said)
            if code == 0:
                self.assertEqual(self.rows(out), self.rows("one"))
            else:
                self.assertIn("connects from 10.77.2.2, the case has it at 10.77.2.9", said)

    def test_cut_link_that_comes_back_is_no_fault(self):
        slow = ("--set", "coupling.silence_limit_s=20.0", "--set", "time.end_s=40.0")
        one = self.run_coupler(*slow, out="one")
        self.assertEqual(one.code, 0, one.text)
        coupler, sides = self.start_all(*slow, env=self.hold_at(100))
        self.wait_for("go.here")
        self.cut(True)
        self.let_go()  # the answer of this window goes out on a link that is down
        time.sleep(0.4)
        self.assertIsNone(coupler.poll())
        self.cut(False)
        text = coupler.communicate(timeout=PATIENCE)[0]
        self.assertEqual(coupler.returncode, 0, text + "".join(s.communicate()[0] for s in sides))
        self.assertEqual([s.wait(timeout=PATIENCE) for s in sides], [0, 0])
        self.assertEqual(self.rows("out"), self.rows("one"))

    def test_cut_link_that_stays_cut_ends_all_within_the_limit(self):
        coupler, sides = self.start_all("--set", "coupling.silence_limit_s=1.0", env=self.hold_at(100))
        self.wait_for("go.here")
        begin = time.monotonic()
        self.cut(True)
        self.let_go()
        text = coupler.communicate(timeout=PATIENCE)[0]
        self.assertEqual(coupler.returncode, 3, text)
        self.assertRegex(text, r"solid \(spring 1\) failed in window 100 .*no heartbeat in time")
        self.assertEqual([s.wait(timeout=PATIENCE) for s in sides], [3, 3])
        self.assertLess(time.monotonic() - begin, 1.0 + 2.0 + SLACK)

    def test_key_of_another_run_is_refused(self):
        old = self.path("old")
        for folder in (old, self.path("keys")):
            self.assertEqual(self.tool("keygen", folder).code, 0)
        self.assertEqual(self.tool("keygen", old).code, 3)  # never written over
        coupler = self.launch("c", [os.path.join(BIN, "coupler"), self.case, "--out", self.path("out"), "--quiet", "--await",
                                    "--endpoint", f"tcp://{self.ADDRESS}:46802", "--keys", self.path("keys"), "--set",
                                    "coupling.start_limit_s=3.0"])
        self.wait_for("out", "connection.env")
        late = self.launch("s", [SOLID, self.case], {"OCUBLAST_ENDPOINT": f"tcp://{self.ADDRESS}:46802",
                                                     "OCUBLAST_KEYS": old, "OCUBLAST_SILENCE_LIMIT_S": "2"})
        text = late.communicate(timeout=PATIENCE)[0]
        self.assertEqual(late.returncode, 3, text)
        self.assertEqual(coupler.wait(timeout=PATIENCE), 3)


class Tools(CouplerTest):
    def test_status_and_event_log_tell_how_a_run_ended(self):
        ended = self.run_coupler("--set", "flow.fault=kill", "--set", "flow.fault_window=9", out="bad")
        self.assertEqual(ended.code, 3, ended.text)
        told = self.tool("status", self.path("bad"))
        self.assertEqual(told.code, 0, told.text)
        self.assertIn("piston: failed", told.text)
        self.assertIn("killed by signal 9", told.text)
        events = [json.loads(line) for line in self.read("bad", "log", "events.jsonl").splitlines()]
        self.assertEqual([e["event"] for e in events], ["started", "ready", "failed"])
        self.assertEqual(events[-1]["window"], 8)
        self.assertIn("flow (gas_column 1) failed in window 9", events[-1]["reason"])
        good = self.run_coupler(out="good")
        self.assertEqual(good.code, 0, good.text)
        self.assertIn("piston: ended", self.tool("status", self.path("good")).text)
        self.assertEqual(self.tool("status", self.dir).code, 2)

    def test_status_of_a_killed_coupler(self):
        process = self.start("--set", "flow.fault=hang", "--set", "flow.fault_window=10")
        # All are started: none of them holds the coupler's lock any more, as before its exec.
        self.wait_for_line("out", "log", "flow.log", text="hangs in window 10")
        self.assertNotIn("gone", self.tool("status", self.path("out")).text)
        process.kill()
        process.communicate()
        self.assertIn("but its coupler is gone", self.tool("status", self.path("out")).text)


if __name__ == "__main__":
    unittest.main(verbosity=2)
