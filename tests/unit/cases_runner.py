"""Runs a case by cases/run in a folder of its own and reads what it left. Used by the case tests."""

import json
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


class CaseRun(unittest.TestCase):
    """Each test gets an empty results folder."""

    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.addCleanup(self.temporary.cleanup)
        self.folder = Path(self.temporary.name)
        self.out = self.folder / "out"

    def launch(self, *arguments, out: Path | None = None) -> subprocess.CompletedProcess:
        command = [ROOT / "cases/run", *map(str, arguments), "--quiet", "--out", out or self.out]
        return subprocess.run(command, capture_output=True, text=True, env=os.environ)

    def results(self, *arguments, out: Path | None = None) -> dict:
        """summary.json of a run that must end well."""
        done = self.launch(*arguments, out=out)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return json.loads(((out or self.out) / "summary.json").read_text())

    def assert_meets_references(self, summary: dict) -> None:
        """Every reference of the case has a value, and it lies within the stated tolerance."""
        self.assertEqual(summary["references_without_value"], [])
        compared = [q for q in summary["quantities"] if q["tolerance"] is not None]
        self.assertTrue(compared)
        for q in compared:
            print(f"{summary['case']}: {q['name']} {q['value']:.6g} {q['unit']}, reference "
                  f"{q['reference']:.6g}, error {100 * q['relative_error']:+.3f} % "
                  f"(accepted {100 * q['tolerance']:g} %)")
        outside = [q["name"] for q in compared if not q["within_tolerance"]]
        self.assertEqual(outside, [])

    def quantity(self, summary: dict, name: str) -> float:
        found = [q["value"] for q in summary["quantities"] if q["name"] == name]
        self.assertEqual(len(found), 1, f"{name}: {[q['name'] for q in summary['quantities']]}")
        return found[0]
