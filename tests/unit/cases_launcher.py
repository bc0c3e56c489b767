"""cases/run round stand-ins for the programs: what it checks, launches, passes on and sums up."""

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "cases"))

from launching.case_file import CaseError, read_case  # noqa: E402
from launching.programs import split_tables  # noqa: E402
from launching.summary import compare, read_targets  # noqa: E402

# A program that does what its environment says; with --check and --effective like a real one.
STAND_IN = """#!/usr/bin/python3
import json, os, signal, sys, time
from pathlib import Path
arguments, name = sys.argv[1:], os.path.basename(sys.argv[0])
if "--version" in arguments:
    print(name, "9.9"); sys.exit(0)
if "check" in arguments or "--check" in arguments:
    if os.environ.get("FAULT"):
        print(os.environ["FAULT"], file=sys.stderr); sys.exit(2)
    print("would run", name); sys.exit(0)
if "--effective" in arguments:
    table = {"flow_solver": "flow", "solid_solver": "solid", "coupler": "coupling"}[name]
    print('[ambient]\\npressure_Pa = 1e5\\n\\n[case]\\nname = "x"\\nresolution = "coarse"\\n'
          'title = "t"\\n\\n[%s]\\nkey = 1\\n\\n[[%s.probe]]\\nname = "a"' % (table, table)); sys.exit(0)
out = Path(arguments[arguments.index("--out") + 1])
(out / "arguments").write_text("\\n".join([name, *arguments]))
if os.environ.get("WAIT"):
    signal.signal(signal.SIGINT, lambda *_: sys.exit(int(os.environ["WAIT"])))
    print("waiting", flush=True); time.sleep(60)
(out / "flow_summary.json").write_text(json.dumps({"quantities": [
    {"name": "peak", "value": 110.0, "unit": "Pa"}, {"name": "other", "value": 2.0, "unit": "m"}],
    "performance": {"flow_compute_s": 1.5}}))
sys.exit(int(os.environ.get("CODE", "0")))
"""
CASE = """[case]
name = "small"
title = "A small case"
resolution = "coarse"
[resolution.coarse]
"flow.grid.cells" = 4
"mesh.0.level" = 1
[resolution.fine]
"flow.grid.cells" = 8
[time]
end_s = 1.0
[flow]
grid.cells = 1
[[mesh]]
recipe = "sphere_surface"
output = "ball.h5"
radius_m = 1.0
"""


class CaseFileTest(unittest.TestCase):
    def read(self, *overrides: str) -> dict:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "case.toml"
            file.write_text(CASE)
            return read_case(file, list(overrides))

    def test_preset_applies_and_reaches_into_lists(self):
        case = self.read()
        self.assertEqual(case["flow"]["grid"]["cells"], 4)
        self.assertEqual(case["mesh"][0]["level"], 1)

    def test_override_of_the_resolution_chooses_the_preset(self):
        self.assertEqual(self.read("case.resolution=fine")["flow"]["grid"]["cells"], 8)

    def test_override_wins_over_the_preset_whatever_its_order(self):
        case = self.read("flow.grid.cells=5", "case.resolution=fine")
        self.assertEqual(case["flow"]["grid"]["cells"], 5)

    def test_a_bare_word_is_a_text(self):
        self.assertEqual(self.read("flow.riemann=hllc")["flow"]["riemann"], "hllc")

    def test_faults_of_overrides_are_named(self):
        for text, expected in (("flow.grid.cells", "expected dotted.key=value"),
                               ("mesh.3.level=1", "'3' is no index or name in a list of 1"),
                               ("time.end_s.x=1", "'x' is a value, not a table"),
                               ("case.resolution=huge", "accepted: coarse, fine")):
            with self.assertRaisesRegex(CaseError, expected):
                self.read(text)


class SplitTablesTest(unittest.TestCase):
    def test_sub_tables_stay_with_their_table(self):
        text = '[a]\nx = [\n  [1, 2],\n  [3]\n]\n\n[[a.b]]\ny = 1\n\n[c.d]\nz = "[e]"\n'
        tables = split_tables(text)
        self.assertEqual(list(tables), ["a", "c"])
        self.assertEqual(tomllib.loads(tables["a"])["a"]["b"], [{"y": 1}])
        self.assertEqual(tomllib.loads(tables["c"])["c"]["d"]["z"], "[e]")


class CompareTest(unittest.TestCase):
    def test_error_is_relative_to_the_reference(self):
        row = compare({"name": "p", "value": 110.0, "unit": "Pa"},
                      {"value": 100.0, "unit": "Pa", "tolerance": 0.05, "source": "s"})
        self.assertAlmostEqual(row["relative_error"], 0.1)
        self.assertFalse(row["within_tolerance"])

    def test_a_value_that_is_not_finite_is_outside(self):
        row = compare({"name": "p", "value": float("nan"), "unit": "Pa"},
                      {"value": 100.0, "unit": "Pa", "tolerance": 0.05, "source": "s"})
        self.assertIs(row["within_tolerance"], False)

    def test_units_that_differ_are_not_compared(self):
        row = compare({"name": "p", "value": 100.0, "unit": "Pa"},
                      {"value": 100.0, "unit": "kPa", "tolerance": 0.05, "source": "s"})
        self.assertIsNone(row["relative_error"])
        self.assertIn("unit differs", row["source"])

    def test_every_targets_file_can_be_read(self):
        for file in (ROOT / "cases").glob("*/reference/targets.csv"):
            self.assertTrue(read_targets(file.parents[1]), file)


class LaunchTest(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.addCleanup(self.temporary.cleanup)
        self.folder = Path(self.temporary.name)
        for name in ("flow_solver", "solid_solver", "coupler"):
            file = self.folder / "bin" / name
            file.parent.mkdir(exist_ok=True)
            file.write_text(STAND_IN)
            file.chmod(0o755)
        self.case = self.folder / "case.toml"
        self.case.write_text(CASE)
        (self.folder / "reference").mkdir()
        (self.folder / "reference" / "targets.csv").write_text(
            "name,value,unit,tolerance,source\npeak,100,Pa,0.2,exact\n")
        self.out = self.folder / "out"

    def environment(self, **more: str) -> dict:
        return {**os.environ, "OCUBLAST_BIN": str(self.folder / "bin"), **more}

    def launch(self, *arguments, **environment) -> subprocess.CompletedProcess:
        return subprocess.run([ROOT / "cases/run", *map(str, arguments)], capture_output=True,
                              text=True, timeout=60, env=self.environment(**environment))

    def test_a_run_ends_with_table_summary_effective_case_and_report(self):
        done = self.launch(self.case, "--out", self.out)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stdout, r"peak +110 +Pa +100 +\+10\.00 %")
        summary = json.loads((self.out / "summary.json").read_text())
        self.assertEqual([q["name"] for q in summary["quantities"]], ["peak", "other"])
        self.assertTrue(summary["quantities"][0]["within_tolerance"])
        self.assertEqual(summary["performance"]["flow_compute_s"], 1.5)
        self.assertGreater(summary["performance"]["wall_time_s"], 0.0)
        self.assertEqual(summary["version"], "9.9")
        effective = tomllib.loads((self.out / "case.toml").read_text())
        self.assertNotIn("resolution", effective["case"])
        self.assertEqual(effective["flow"]["probe"], [{"name": "a"}])
        self.assertEqual(effective["mesh"][0]["level"], 1)
        self.assertTrue((self.out / "mesh" / "ball.h5").is_file())
        self.assertIn("</html>", (self.out / "report.html").read_text())

    def test_overrides_and_threads_reach_the_program(self):
        done = self.launch(self.case, "--out", self.out, "--resolution", "fine", "--set",
                           "time.end_s=2", "--threads-flow", "3", "--no-report")
        self.assertEqual(done.returncode, 0, done.stderr)
        seen = (self.out / "arguments").read_text().splitlines()
        self.assertEqual(seen[0], "flow_solver")
        for pair in (["--threads", "3"], ["--set", "case.resolution=fine"], ["--set", "time.end_s=2"],
                     ["--mesh-dir", str(self.out / "mesh")]):
            at = [i for i in range(len(seen) - 1) if seen[i:i + 2] == pair]
            self.assertTrue(at, pair)

    def test_a_coupled_case_starts_the_coupler_and_tells_it_of_the_solvers(self):
        self.case.write_text(CASE + "[solid]\nx = 1\n[coupling]\nx = 1\n")
        done = self.launch(self.case, "--out", self.out, "--solid", "my solver", "--ranks-solid", "3",
                           "--threads-flow", "2", "--no-report")
        self.assertEqual(done.returncode, 0, done.stderr)
        seen = (self.out / "arguments").read_text().splitlines()
        self.assertEqual(seen[0], "coupler")
        self.assertEqual(seen[seen.index("--solid") + 1], "my solver")
        self.assertEqual(seen[seen.index("--threads-flow") + 1], "2")
        self.assertEqual(seen[seen.index("--ranks-solid") + 1], "3")

    def test_a_case_with_a_fault_writes_nothing_and_says_it_once(self):
        self.case.write_text(CASE + "[solid]\nx = 1\n[coupling]\nx = 1\n")
        done = self.launch(self.case, "--out", self.out, FAULT="case.toml:3: time.endd: no such key")
        self.assertEqual(done.returncode, 2)
        self.assertEqual(done.stderr.count("time.endd"), 1)
        self.assertFalse(self.out.exists())

    def test_an_unknown_case_names_the_nearest(self):
        done = self.launch("eye_pyrodexx")
        self.assertEqual(done.returncode, 2)
        self.assertIn("cases/run --list", done.stderr)

    def test_a_missing_file_is_named(self):
        done = self.launch(self.folder / "nothing.toml")
        self.assertEqual(done.returncode, 2)
        self.assertIn("nothing.toml", done.stderr)

    def test_no_rank_at_all_is_refused(self):
        done = self.launch(self.case, "--out", self.out, "--ranks-flow", "0")
        self.assertEqual(done.returncode, 2)
        self.assertIn("accepted 1 or more", done.stderr)

    def test_a_folder_in_use_is_refused(self):
        self.out.mkdir()
        (self.out / "kept").write_text("x")
        done = self.launch(self.case, "--out", self.out)
        self.assertEqual(done.returncode, 2)
        self.assertIn("is not empty", done.stderr)

    def test_resume_needs_a_checkpoint(self):
        self.out.mkdir()
        done = self.launch(self.case, "--resume", self.out)
        self.assertEqual(done.returncode, 2)
        self.assertIn("run.json", done.stderr)

    def test_resume_goes_on_in_the_folder_with_its_settings(self):
        self.launch(self.case, "--out", self.out, "--set", "time.end_s=2", "--no-report")
        (self.out / "checkpoint").mkdir()
        done = self.launch("--resume", self.out, "--no-report")
        self.assertEqual(done.returncode, 0, done.stderr)
        seen = (self.out / "arguments").read_text().splitlines()
        self.assertEqual(seen[seen.index("--resume") + 1], str(self.out))
        self.assertIn("time.end_s=2", seen)

    def test_exit_codes_pass_through(self):
        for code in ("1", "3", "4"):
            out = self.folder / ("out" + code)
            done = self.launch(self.case, "--out", out, CODE=code)
            self.assertEqual(done.returncode, int(code))
            self.assertIn(str(out / "log"), done.stderr)
            self.assertFalse((out / "summary.json").exists())

    def interrupt(self, answer: str) -> int:
        """Exit code of cases/run when the program answers an interrupt with exit code `answer`."""
        process = subprocess.Popen([ROOT / "cases/run", self.case, "--out", self.out, "--quiet"],
                                   stdout=subprocess.PIPE, text=True,
                                   env=self.environment(WAIT=answer))
        for line in process.stdout:
            if line.startswith("waiting"):
                break
        started = time.monotonic()
        process.send_signal(signal.SIGINT)
        code = process.wait(timeout=30)
        process.stdout.close()
        self.assertLess(time.monotonic() - started, 20.0)  # the program would wait for 60 s
        return code

    def test_an_interrupt_reaches_the_program(self):
        self.assertEqual(self.interrupt("3"), 3)

    def test_a_run_stopped_in_good_order_is_not_summed_up(self):
        self.assertEqual(self.interrupt("0"), 1)
        self.assertFalse((self.out / "summary.json").exists())

    def test_list_shows_every_case_with_its_run_time(self):
        done = self.launch("--list")
        self.assertEqual(done.returncode, 0)
        names = [file.parent.name for file in (ROOT / "cases").glob("*/case.toml")]
        listed = [line.split()[0] for line in done.stdout.splitlines()]
        self.assertEqual(listed, sorted(names))
        self.assertIn("sod", names)


if __name__ == "__main__":
    unittest.main(verbosity=2)
