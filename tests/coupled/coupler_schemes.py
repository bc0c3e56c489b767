"""Every coupling scheme on the piston: order in time, light solids, rewinding, resuming."""

import math
import os
import unittest

from coupler_harness import FLOW, CouplerTest

IMPLICIT = {"serial Aitken": ("serial-implicit", "aitken"), "serial IQN-ILS": ("serial-implicit", "iqn-ils"),
            "parallel IQN-ILS": ("parallel-implicit", "iqn-ils")}


def keys(**values):
    return [x for name, value in values.items() for x in ("--set", f"{name.replace('__', '.')}={value}")]


class Schemes(CouplerTest):
    """Windows shrink with the grid and with the solid's step, so that every error is of the window."""

    def errors_of(self, cells, *arguments):
        out = f"out{cells}"
        ended = self.run_coupler(*keys(flow__cells=cells, solid__stable_step_s=0.16 / cells,
                                       coupling__record="false"), *arguments, out=out)
        self.assertEqual(ended.code, 0, ended.text)
        return self.errors(out)

    def assert_second_order(self, name, *arguments):
        errors = [self.errors_of(n, *arguments) for n in (16, 32, 64)]
        orders = [math.log2(a / b) for a, b in zip(errors[-2], errors[-1])]
        print(f"{name}: errors {['%.1e' % e for e in errors[-1]]}, orders {['%.2f' % o for o in orders]}")
        for order in orders:
            self.assertGreaterEqual(order, 1.9)

    def test_order_1_predictor_keeps_second_order_here(self):
        # Its wall is one order worse, but the error of a window is third order: two windows make second.
        self.assert_second_order("serial-explicit, order 1", *keys(coupling__predictor_order=1))

    def test_leap_frog(self):
        self.assert_second_order("leap-frog", *keys(coupling__scheme="leap-frog"))

    def test_pipelined(self):
        self.assert_second_order("parallel-explicit", *keys(coupling__scheme="parallel-explicit",
                                                            coupling__theta_warn=10, coupling__theta_refuse=10))

    def test_pipelined_grows_long_before_serial_does_and_is_refused_before(self):
        # A mass against an impedance: theta = Z w / M is stable to 0.453 pipelined, to 1.155 serial
        # (coupler/settings.cpp); the gas's first cell takes up to a half off. Windows of four flow steps.
        sound = math.sqrt(1.4)
        width = 4 * 0.4 / 64 / sound

        def run(scheme, theta, *more):
            out = f"{scheme}{theta}"
            ended = self.run_coupler(*keys(coupling__scheme=scheme, coupling__window="fixed", coupling__window_s=width,
                                           coupling__record="false", flow__cells=64, solid__stable_step_s=5e-4,
                                           solid__mass_kg_m2=sound * width / theta, time__end_s=1.6), *more, out=out)
            return ended, max(self.errors(out)) if ended.code == 0 else math.inf

        for scheme, stable, grows in (("parallel-explicit", 0.2, 0.48), ("serial-explicit", 0.55, 1.2)):
            self.assertLess(run(scheme, stable)[1], 0.01, scheme)
            self.assertGreater(run(scheme, grows)[1], 100.0, scheme)
        ended, _ = run("parallel-explicit", 0.02, "--set", "coupling.theta_warn=0.005", "--set", "coupling.theta_refuse=0.01")
        self.assertEqual(ended.code, 4, ended.text)
        self.assertIn("serial-implicit", ended.text)

    def test_implicit_with_a_light_piston(self):
        # Load 1e-6: it is a difference of 1e-8 of pressures of 1 Pa, rounded to 2e-16.
        for name, (scheme, relaxation) in IMPLICIT.items():
            self.assert_second_order(name + ", mass 0.1", *keys(
                coupling__scheme=scheme, coupling__relaxation=relaxation, solid__mass_kg_m2=0.1,
                coupling__convergence_motion=1e-9, coupling__convergence_load=1e-6))

    def test_flow_inside_the_solids_step(self):
        ended = self.run_coupler(*keys(coupling__max_flow_steps=4, solid__stable_step_s=0.05))
        self.assertEqual(ended.code, 0, ended.text)
        steps = {tuple(row.split(",")[2:4]) for row in self.rows()}
        self.assertEqual(steps, {("4", "1")})

    def test_leap_frog_conserves_energy_across_the_interface(self):
        ended = self.run_coupler(*keys(coupling__scheme="leap-frog"))
        self.assertEqual(ended.code, 0, ended.text)
        rows = [row.split(",") for row in self.rows()]
        exchanged = sum(abs(float(row[4])) for row in rows)
        # Both sides move the piston by the same displacement; what is left is the rounding of sums of
        # (p0 + p) V terms, 1e6 times larger than the work of p: 1e6 * 400 windows * 2e-16.
        self.assertLess(abs(float(rows[-1][12])) / exchanged, 1e-7)

    def test_window_too_long_for_explicit_coupling_converges_implicitly(self):
        # theta = rho c w / M = 1.18 * 0.08 / 0.05 = 1.9: every explicit scheme rings or fails there.
        light = keys(solid__mass_kg_m2=0.05, coupling__window="fixed", coupling__window_s=0.08)
        explicit = self.run_coupler(*light, out="explicit")
        bad = explicit.code != 0 or max(self.errors("explicit")) > 1.0 or math.isnan(sum(self.errors("explicit")))
        self.assertTrue(bad, explicit.text)
        for name, (scheme, relaxation) in IMPLICIT.items():
            ended = self.run_coupler(*light, *keys(coupling__scheme=scheme, coupling__relaxation=relaxation), out=relaxation)
            self.assertEqual(ended.code, 0, ended.text)
            position = self.errors(relaxation)[0]
            iterations = [int(row.split(",")[14]) for row in self.rows(relaxation)]
            print(f"{name}: position error {position:.1e}, {sum(iterations) / len(iterations):.1f} iterations")
            # Trapezium in time: (omega w)^2 / 12 per radian, 4.7 rad in all: 3.5e-3; twice for two sides.
            self.assertLess(position, 7e-3)

    def test_no_convergence_is_an_error_with_figures(self):
        ended = self.run_coupler(*keys(solid__mass_kg_m2=0.05, coupling__scheme="serial-implicit",
                                       coupling__relaxation="constant", coupling__relaxation_factor=0.01,
                                       coupling__max_iterations=3))
        self.assertEqual(ended.code, 4, ended.text)
        self.assertRegex(ended.text, r"not converged in 3 iterations: motion \S+ \(accepted 1e-06\)")

    def test_pipelined_and_implicit_runs_resume_bit_for_bit(self):
        for scheme in ("parallel-explicit", "serial-implicit", "parallel-implicit", "leap-frog"):
            with self.subTest(scheme=scheme):
                every = keys(coupling__scheme=scheme, coupling__checkpoint_every_windows=70)
                whole = self.run_coupler(*every, out=scheme)
                self.assertEqual(whole.code, 0, whole.text)
                window = int(sorted(os.listdir(self.path(scheme, "checkpoint")))[-1])
                resumed = self.run_coupler(*every, "--resume", self.path(scheme), out=scheme + "-resumed")
                self.assertEqual(resumed.code, 0, resumed.text)
                self.assertGreater(len(self.rows(scheme + "-resumed")), 20)
                self.assertEqual(self.rows(scheme + "-resumed"), self.rows(scheme)[window:])

    def test_load_ramp(self):
        ended = self.run_coupler(*keys(coupling__load_ramp_s=1e9))
        self.assertEqual(ended.code, 0, ended.text)
        # The load never comes: the piston swings on its spring alone, exact motion of another frequency.
        load = max(abs(float(line.split()[4])) for line in self.read("out", "spring_history.txt").splitlines())
        ended = self.run_coupler(out="full")
        full = max(abs(float(line.split()[4])) for line in self.read("full", "spring_history.txt").splitlines())
        self.assertLess(load, 1e-8 * full)

    def test_frames_and_shared_memory_give_the_same_bits(self):
        for number, share in enumerate(("true", "false")):
            ended = self.run_coupler(*keys(coupling__shared_memory=share, coupling__scheme="parallel-implicit"), out=share)
            self.assertEqual(ended.code, 0, ended.text)
        self.assertEqual(self.rows("true"), self.rows("false"))

    def test_recordings_of_implicit_runs_replay(self):
        for scheme in ("serial-implicit", "parallel-explicit"):
            arguments = keys(coupling__scheme=scheme)
            ended = self.run_coupler(*arguments, out=scheme)
            self.assertEqual(ended.code, 0, ended.text)
            ended = self.tool("replay", self.path(scheme, "traffic.ocu"), "--as", "solid", self.case, "--out",
                              self.path("replay"), "--flow", FLOW, *arguments)
            self.assertEqual(ended.code, 0, ended.text)
            self.assertIn("byte for byte", ended.text)


if __name__ == "__main__":
    unittest.main(verbosity=2)
