"""The participant library as somebody else gets it: installed, found by CMake, used from C."""

import os
import subprocess
import unittest

from coupler_harness import BUILD, CouplerTest

EXAMPLE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "coupler", "link", "example")


class Install(CouplerTest):
    def done(self, *command):
        ended = subprocess.run(command, capture_output=True, text=True, check=False)
        self.assertEqual(ended.returncode, 0, ended.stdout + ended.stderr)

    def test_example_in_c_is_built_from_the_installed_library_and_agrees(self):
        prefix, build = self.path("prefix"), self.path("example")
        self.done("cmake", "--install", BUILD, "--component", "link", "--prefix", prefix)
        self.done("cmake", "-S", EXAMPLE, "-B", build, f"-DCMAKE_PREFIX_PATH={prefix}", "-DCMAKE_BUILD_TYPE=Release")
        self.done("cmake", "--build", build)
        for scheme in ("serial-explicit", "serial-implicit"):
            chosen = ("--set", f"coupling.scheme={scheme}", "--set", "coupling.record=false")
            ours = self.run_coupler(*chosen, out="ours-" + scheme)
            theirs = self.run_coupler(*chosen, "--solid", os.path.join(build, "spring"), out="theirs-" + scheme)
            self.assertEqual((ours.code, theirs.code), (0, 0), ours.text + theirs.text)
            ours, theirs = (float(self.rows(o + scheme)[-1].split(",")[5]) for o in ("ours-", "theirs-"))
            # The same formulas in another order of operations: round-off of a few hundred windows.
            self.assertAlmostEqual(theirs / ours, 1.0, delta=1e-6)


if __name__ == "__main__":
    unittest.main(verbosity=2)
