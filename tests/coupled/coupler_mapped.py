"""Flow and solid with interface meshes of their own: the coupler maps between them."""

import os
import unittest

from coupler_harness import BIN, FLOW, CouplerTest
from coupler_schemes import keys
from coupler_solvers import CASE as SOLVERS_CASE, make_mesh

RIGID = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "coupler", "link", "python", "examples", "rigid.py")
# The same piston as a surface of the flow's own, coarser through its thickness.
OWN_SURFACE = """
[[mesh]]
recipe = "box_surface"
output = "own.h5"
low_m = [0.5, 0.0, 0.0]
high_m = [0.51, 1.0, 1.0]
cells = [2, 1, 1]
"""
SCHEMES = ("serial-explicit", "leap-frog", "parallel-explicit", "serial-implicit", "parallel-implicit")
OWN = {"finer flow": dict(flow__own_vertices=9, solid__vertices=4),
       "coarser flow": dict(flow__own_vertices=3, solid__vertices=8),
       "scattered solid": dict(flow__own_vertices=5, solid__vertices=6, solid__scattered="true")}


class Mapped(CouplerTest):
    """A face that moves as a whole under a uniform pressure: the map must not be seen at all."""

    def completed(self, *arguments, out="out"):
        ended = self.run_coupler(*arguments, out=out)
        self.assertEqual(ended.code, 0, ended.text)
        return self.errors(out)

    def test_every_scheme_gives_what_it_gives_on_one_mesh(self):
        for scheme in SCHEMES:
            arguments = keys(coupling__scheme=scheme, time__end_s=1.0)
            plain = self.completed(*arguments, out=scheme)
            for name, own in OWN.items():
                for force in ("true", "false"):
                    mapped = self.completed(*arguments, *keys(**own, solid__takes_force=force), out=scheme + name + force)
                    # Errors are relative to the amplitude of 8e-7 m. The toys take means
                    # of up to 64 positions of 1 m, whose rounding is at most 64 x 1.1e-16 m, 9e-9 of it, in each
                    # of some 200 windows: 2e-6. Implicit schemes stop at 1e-6 of the motion in each window:
                    # by chance sqrt(200) times that.
                    accepted = 1.5e-5 if "implicit" in scheme else 2e-6
                    for a, b in zip(mapped, plain):
                        self.assertAlmostEqual(a, b, delta=accepted, msg=(scheme, name, force))

    def test_resumed_run_equals_the_uninterrupted_one_bit_for_bit(self):
        for scheme in SCHEMES:
            every = keys(coupling__scheme=scheme, coupling__checkpoint_every_windows=70, solid__takes_force="true",
                         **OWN["finer flow"])
            self.completed(*every, out=scheme)
            self.completed(*every, "--resume", self.path(scheme), out=scheme + "-resumed")
            resumed, whole = self.rows(scheme + "-resumed"), self.rows(scheme)
            self.assertGreater(len(resumed), 20)
            self.assertEqual(resumed, whole[-len(resumed):])

    def test_recording_replays_against_either_side(self):
        arguments = keys(solid__takes_force="true", time__end_s=1.0, **OWN["coarser flow"])
        self.completed(*arguments)
        for side in ("flow", "solid"):
            own = ("--flow", FLOW) if side == "solid" else ("--solid", FLOW.replace("gas_column", "spring"))
            ended = self.tool("replay", self.path("out", "traffic.ocu"), "--as", side, self.case, "--out",
                              self.path("replay"), *own, *arguments)
            self.assertEqual(ended.code, 0, ended.text)
            self.assertIn("byte for byte", ended.text)

    def test_meshes_that_do_not_belong_together_are_refused_with_the_place(self):
        # Vertices of the flow lie up to 0.1 m from the nearest of 8 x 8 nodes: far beyond 0.01 spacings.
        ended = self.run_coupler(*keys(flow__own_vertices=4, solid__scattered="true", solid__vertices=8,
                                       coupling__mapping_gap=0.01))
        self.assertEqual(ended.code, 2, ended.text)
        self.assertRegex(ended.text, r"vertex \d+ of the flow's 'piston' at \(.*coupling.mapping_gap 0.01")

    def test_scattered_solid_needs_a_flow_with_a_surface(self):
        ended = self.run_coupler(*keys(solid__scattered="true"))
        self.assertEqual(ended.code, 3, ended.text)
        self.assertIn("flow.body.surface", ended.text)

    def test_radial_bases_and_projection_agree_on_a_rigid_body_in_our_flow(self):
        # Both maps are exact for motions linear in space and keep the total force: a rigid body cannot tell them apart.
        self.case = self.path("own.toml")
        with open(SOLVERS_CASE, encoding="utf-8") as given, open(self.case, "w", encoding="utf-8") as file:
            file.write(given.read() + OWN_SURFACE)
        make_mesh(self.path("mesh"), self.case)
        rows = {}
        for scattered in ("", "yes"):
            ended = self.run_coupler("--mesh-dir", self.path("mesh"), "--flow", os.path.join(BIN, "flow_solver"), "--solid",
                                     f"/usr/bin/python3 {RIGID}", "--threads-flow", "1", "--set", "coupling.window=fixed",
                                     "--set", "coupling.window_s=2e-6", "--set", "flow.body.0.surface=own.h5",
                                     env={"OCU_SCATTERED": scattered}, out="out" + scattered)
            self.assertEqual(ended.code, 0, ended.text)
            self.assertIn("radial" if scattered else "projection", self.read("out" + scattered, "log", "coupler.log"))
            rows[scattered] = [[float(x) for x in row.split(",")] for row in self.rows("out" + scattered)]
        impulse, work = ([sum(row[column] for row in rows[s]) for s in ("", "yes")] for column in (9, 5))
        print(f"impulse {impulse} N s, work {work} J")
        self.assertGreater(impulse[0], 1.0)
        # Rounding of positions of 1 m (a dense solve of 18 bases, condition some 1e3, loses 1e-13) against cells of
        # 10 mm: 1e-11 of the pressure; sums over 30 windows.
        self.assertAlmostEqual(impulse[1] / impulse[0], 1.0, delta=1e-9)
        self.assertAlmostEqual(work[1] / work[0], 1.0, delta=1e-9)


if __name__ == "__main__":
    unittest.main(verbosity=2)
