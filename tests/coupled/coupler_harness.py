"""Runs the coupler with the toy participants, for the tests in Python. OCU_BUILD names the build."""

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

BUILD = os.environ.get("OCU_BUILD", "build/release")
BIN = os.path.join(BUILD, "bin")
sys.path.insert(0, os.path.join(BUILD, "python"))

CASE = """
[case]
name = "piston"
title = "gas column and piston on a spring"
[time]
end_s = {end}
[ambient]
pressure_Pa = 1.0
temperature_K = 293.0
[coupling]
theta_warn = 10.0  # the exact solution tells whether it is stable
theta_refuse = 10.0
[flow]
cells = 32
cfl = 0.4
[solid]
stable_step_s = 0.005
"""

# Longest wait for something that will come, s. Not a limit that a test holds the coupler to: a busy machine takes its time.
PATIENCE = 120.0

FLOW = os.path.join(BIN, "coupler_gas_column")
SOLID = os.path.join(BIN, "coupler_spring")


class Ended:
    """How a coupler ended: exit code, what it printed, seconds it took."""

    def __init__(self, process, begin):
        self.text = process.communicate(timeout=PATIENCE)[0]
        self.code = process.returncode
        self.seconds = time.monotonic() - begin


class CouplerTest(unittest.TestCase):
    """A scratch directory with the piston case, and ways to run it."""

    def setUp(self):
        self.dir = tempfile.mkdtemp(prefix="ocublast-test-")
        self.addCleanup(shutil.rmtree, self.dir, ignore_errors=True)
        self.case = self.write_case()

    def write_case(self, end=4.0):
        path = os.path.join(self.dir, "case.toml")
        with open(path, "w", encoding="utf-8") as file:
            file.write(CASE.format(end=end))
        return path

    def path(self, *names):
        return os.path.join(self.dir, *names)

    def start(self, *arguments, out="out", env=None):
        command = [os.path.join(BIN, "coupler"), self.case, "--out", self.path(out), "--quiet"]
        command += [str(a) for a in arguments]
        if "--await" not in command:
            for option, program in (("--flow", FLOW), ("--solid", SOLID)):
                if option not in command:
                    command += [option, program]
        self.begin = time.monotonic()
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                   env={**os.environ, **(env or {})})
        self.addCleanup(lambda: process.poll() is None and process.kill())
        return process

    def run_coupler(self, *arguments, **keywords):
        return Ended(self.start(*arguments, **keywords), self.begin)

    def tool(self, *arguments):
        begin = time.monotonic()
        process = subprocess.Popen([os.path.join(BIN, "coupler"), *map(str, arguments)], text=True,
                                   stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        return Ended(process, begin)

    def read(self, *names):
        with open(self.path(*names), encoding="utf-8") as file:
            return file.read()

    def errors(self, out="out"):
        """Largest relative errors of position, velocity, pressure."""
        return [float(x) for x in self.read(out, "spring_errors.txt").split()]

    def rows(self, out="out"):
        """coupling.csv without the column measured with a clock."""
        return [line.rsplit(",", 1)[0] for line in self.read(out, "coupling.csv").splitlines()[1:]]

    def wait_for(self, *names):
        """Waits until a file is there."""
        deadline = time.monotonic() + PATIENCE
        while not os.path.exists(self.path(*names)):
            self.assertLess(time.monotonic(), deadline, f"{names} did not appear")
            time.sleep(0.01)
        return self.path(*names)

    def wait_for_line(self, *names, text=""):
        """Waits until a file holds a whole line with this text; the line."""
        deadline = time.monotonic() + PATIENCE
        while True:
            found = [line for line in self.read(*names).split("\n")[:-1] if text in line] if os.path.exists(self.path(*names)) else []
            if found:
                return found[0]
            self.assertLess(time.monotonic(), deadline, f"{names}: no '{text}'")
            time.sleep(0.01)

    def let_go(self, name="go"):
        """Lets a toy go on that waits for this file (OCU_TOY_GO)."""
        open(self.path(name), "w", encoding="ascii").close()

    def connection(self, out="out"):
        """Environment that a waiting coupler wants its solvers to have."""
        self.wait_for(out, "connection.env")  # comes whole
        lines = self.read(out, "connection.env").splitlines()
        return dict(line.removeprefix("export ").split("=", 1) for line in lines if "=" in line)

    def start_participant(self, program, connection):
        process = subprocess.Popen([program, self.case], env={**os.environ, **connection}, text=True,
                                   stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self.addCleanup(lambda: process.poll() is None and process.kill())
        return process


def children_of(pid):
    """Processes started by pid; none where it is gone."""
    try:
        with open(f"/proc/{pid}/task/{pid}/children", encoding="ascii") as file:
            return [int(x) for x in file.read().split()]
    except OSError:
        return []


def alive(pid):
    """Whether a process still runs (a zombie does not)."""
    try:
        with open(f"/proc/{pid}/stat", encoding="ascii") as file:
            return file.read().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def interrupt(process):
    process.send_signal(signal.SIGINT)
