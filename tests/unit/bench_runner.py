"""The benchmark runner: dispatch, gathering, and what it refuses."""

import json
import os
import subprocess
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
RUN = os.path.join(ROOT, "tests", "bench", "run")
PART = """
import sys
sys.path.insert(0, {bench!r})
import reports
options = reports.arguments("a part")
value = 1.0 if options.quick else 2.0
reports.write(options.out, {part!r}, "A part", [reports.record({part!r}, "c", "q", value, "s", {target})])
"""


class Runner(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = scratch.name

    def add_part(self, part, target=None):
        with open(os.path.join(self.folder, part + ".py"), "w", encoding="utf-8") as file:
            file.write(PART.format(bench=os.path.join(ROOT, "tests", "bench"), part=part, target=target))

    def run_it(self, *arguments):
        out = os.path.join(self.folder, "out")
        done = subprocess.run([RUN, *arguments, "--out", out, "--folder", self.folder], check=False,
                              capture_output=True, text=True)
        combined = os.path.join(out, "bench.json")
        if not os.path.exists(combined):
            return done, []
        with open(combined, encoding="utf-8") as file:
            return done, json.load(file)

    def test_gathers_the_figures_of_all_parts_and_keeps_those_of_parts_not_asked_for(self):
        self.add_part("flow")
        self.add_part("solid")
        done, records = self.run_it()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual([(r["bench"], r["value"]) for r in records], [("flow", 2.0), ("solid", 2.0)])
        done, records = self.run_it("flow", "--quick")
        self.assertEqual([(r["bench"], r["value"]) for r in records], [("flow", 1.0), ("solid", 2.0)])

    def test_says_whether_a_target_is_met(self):
        self.add_part("flow", target=3.0)
        self.assertIn("| c | q | 2 | s | 3 | yes |", self.run_it()[0].stdout)

    def test_refuses_a_part_that_does_not_exist(self):
        self.add_part("flow")
        done, _ = self.run_it("floww")
        self.assertEqual(done.returncode, 2)
        self.assertIn("no part 'floww'; there are: flow", done.stderr)

    def test_fails_with_a_part_that_fails_and_drops_its_old_figures(self):
        self.add_part("flow")
        self.run_it()
        with open(os.path.join(self.folder, "flow.py"), "w", encoding="utf-8") as file:
            file.write("raise SystemExit(3)\n")
        done, records = self.run_it()
        self.assertEqual(done.returncode, 1)
        self.assertEqual(records, [])


if __name__ == "__main__":
    unittest.main()
