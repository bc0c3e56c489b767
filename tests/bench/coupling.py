"""The coupler's own time, without solver work, and which scheme couples what: tests/bench/run coupling.

Peers: preCICE 3.4.1, measured on a machine of this kind with the same meshes.
"""

import json
import math
import os
import subprocess
import tempfile

import reports

TIMING = """
[case]
name = "coupling_speed"
title = "coupling without solver work"
[time]
end_s = 4.0
[ambient]
pressure_Pa = 1.0
temperature_K = 293.0
[coupling]
window = "fixed"
window_s = {width}
theta_warn = 1e9
theta_refuse = 1e9
[flow]
cells = 4
[solid]
vertices = {edge}
stable_step_s = 1.0
"""
PISTON = """
[case]
name = "piston"
title = "gas column and piston on a spring"
[time]
end_s = 4.0
[ambient]
pressure_Pa = 1.0
temperature_K = 293.0
[coupling]
theta_warn = 1e9
theta_refuse = 1e9
record = false
[flow]
cells = {cells}
cfl = 0.4
[solid]
stable_step_s = {step}
mass_kg_m2 = {mass}
"""
# Vertices along an edge, target us, allowance for the recording us, preCICE 3.4.1.
SIZES = ((32, 120.0, 5.0, "70 to 85 us"), (100, 230.0, 5.0, "0.36 to 0.56 ms"),
         (224, 700.0, 400.0, "2.2 to 2.7 ms"))
IMPLICIT_TARGET = 400.0  # us per iteration at 1,024 vertices
SET_UP_TARGET = 0.3      # s to the first window at 50,000 vertices
SCHEMES = {
    "paper": ["scheme=paper"], "serial-explicit, order 0": ["predictor_order=0"],
    "serial-explicit, order 1": ["predictor_order=1"], "serial-explicit, order 2": [],
    "straight wall path": ["wall_path=straight"], "constant load": ["load=constant"],
    "leap-frog": ["scheme=leap-frog"], "parallel-explicit": ["scheme=parallel-explicit", "theta_warn=1e9", "theta_refuse=1e9"],
    "serial-implicit, constant 0.5": ["scheme=serial-implicit", "relaxation=constant", "relaxation_factor=0.5"],
    "serial-implicit, Aitken": ["scheme=serial-implicit"],
    "serial-implicit, IQN-ILS": ["scheme=serial-implicit", "relaxation=iqn-ils"],
    "parallel-implicit, IQN-ILS": ["scheme=parallel-implicit"],
}
RATIOS = (1000, 10, 1, 0.1)  # mass of piston and gas


class Runner:
    """Runs the coupler with the toy participants of one build."""

    def __init__(self, build):
        self.bin = os.path.join(build, "bin")

    def run(self, case, settings=()):
        """Rows of coupling.csv, the toy's errors, and seconds from start to the first window; None
        where the run failed."""
        program = lambda name: os.path.join(self.bin, name)
        with tempfile.TemporaryDirectory(prefix="ocublast-bench-") as scratch:
            path = os.path.join(scratch, "case.toml")
            with open(path, "w", encoding="utf-8") as file:
                file.write(case)
            command = [program("coupler"), path, "--quiet", "--out", scratch, "--flow", program("coupler_gas_column"),
                       "--solid", program("coupler_spring")]
            for setting in settings:
                command += ["--set", setting]
            if subprocess.run(command, capture_output=True, check=False).returncode != 0:
                return None
            read = lambda name: open(os.path.join(scratch, name), encoding="utf-8").read()
            lines = [line.split(",") for line in read("coupling.csv").splitlines()]
            rows = [dict(zip(lines[0], map(float, line))) for line in lines[1:]]
            set_up = json.loads(read("coupling_summary.json"))["performance"]["wall_s"]["set_up"]
            return rows, [float(x) for x in read("spring_errors.txt").split()], set_up


def quantile(values, share):
    return sorted(values)[int(share * (len(values) - 1))]


def windows(runner, quick, records):
    """Table of time per window; median over alternating runs, so that a slow spell hits all."""
    repeats, count = (2, 200) if quick else (5, 400)
    overheads = {}
    for _ in range(repeats):
        for edge, *_ in SIZES:
            for recorded in (False, True):
                rows, _, set_up = runner.run(TIMING.format(width=4.0 / count, edge=edge),
                                             [f"coupling.record={str(recorded).lower()}"])
                found = overheads.setdefault((edge, recorded), ([], []))
                found[0].extend(row["overhead_us"] for row in rows)
                found[1].append(set_up)
    table = []
    for edge, target, allowance, peer in SIZES:
        for recorded in (False, True):
            values, _ = overheads[edge, recorded]
            limit = target + (allowance if recorded else 0.0)
            middle, low = quantile(values, 0.5), quantile(values, 0.05)
            name = f"{edge * edge} vertices{', recorded' if recorded else ''}"
            table.append((name, middle, low, limit, peer))
            records.append(reports.record("coupling", name, "window_median", middle, "us", limit))
            records.append(reports.record("coupling", name, "window_p05", low, "us"))
    set_up = quantile(overheads[SIZES[-1][0], False][1], 0.5)
    records.append(reports.record("coupling", f"{SIZES[-1][0] ** 2} vertices", "set_up", set_up, "s", SET_UP_TARGET))
    head = ("per window through the daemon", "median us", "p05 us", "target us", "preCICE 3.4.1")
    return "## Motion and load, no solver work\n\n" + reports.markdown_table(head, table)


def iterations(runner, quick, records):
    """Time of an implicit iteration beyond the solvers' work, and of what the relaxation adds to it."""
    count = 50 if quick else 200
    rows, _, _ = runner.run(TIMING.format(width=4.0 / count, edge=32),
                            ["coupling.record=false", "coupling.scheme=serial-implicit", "coupling.relaxation=iqn-ils",
                             "coupling.convergence_motion=1e-13"])
    per_iteration = quantile([row["overhead_us"] / row["iterations"] for row in rows], 0.5)
    mean = sum(row["iterations"] for row in rows) / len(rows)
    records.append(reports.record("coupling", "1024 vertices, IQN-ILS", "iteration_median", per_iteration, "us",
                                  IMPLICIT_TARGET))
    return (f"## Implicit coupling\n\nIQN-ILS at 1,024 vertices: {per_iteration:.0f} us per iteration beyond solver work "
            f"({mean:.1f} iterations per window; preCICE 3.4.1 0.9 to 1.5 ms).")


def energy_error(rows):
    exchanged = sum(max(abs(row["work_flow_J"]), abs(row["work_solid_J"])) for row in rows)
    return abs(rows[-1]["energy_error_J"]) / exchanged


def measure_scheme(runner, mass, settings, cells, window=None):
    """(position error, pressure error, energy error, iterations) or None where it fails or grows."""
    settings = [f"coupling.{s}" for s in settings]
    if window is not None:
        settings += ["coupling.window=fixed", f"coupling.window_s={window}"]
    ended = runner.run(PISTON.format(cells=cells, step=0.16 / cells, mass=mass), settings)
    if ended is None:
        return None
    rows, errors, _ = ended
    if not max(errors) < 1.0e1:
        return None
    return errors[0], errors[2], energy_error(rows), sum(r["iterations"] for r in rows) / len(rows)


def added_mass(runner, quick, records):
    """Schemes on the piston at falling mass: order in time where windows shrink with the grid, and
    what happens in windows of eight flow steps."""
    coarse = 32 if not quick else 16
    table = []
    for name, settings in SCHEMES.items():
        for mass in RATIOS:
            results = [measure_scheme(runner, mass, settings, cells) for cells in (coarse, 2 * coarse)]
            wide = None if name == "leap-frog" else measure_scheme(runner, mass, settings, coarse, 8 * 0.338 / coarse)
            if None in results:
                table.append((name, mass, "fails", "", "", "", "", ""))
                continue
            (x0, p0, _, _), (x1, p1, energy, count) = results
            order = math.log2(x0 / x1)
            table.append((name, mass, x1, order, p1, math.log2(p0 / p1), f"{energy:.1e}", count,
                          "-" if name == "leap-frog" else f"{wide[0]:.1e}, {wide[3]:.1f} it." if wide else "fails"))
            case = f"{name}, mass ratio {mass:g}"
            second = name.startswith(("serial-explicit, order 1", "serial-explicit, order 2", "leap", "parallel", "serial-implicit"))
            records.append(reports.record("coupling", case, "order_position", order, "1", 1.9 if second else None, "higher"))
            records.append(reports.record("coupling", case, "energy_error", energy, "1"))
    head = ("scheme", "piston : gas", "position error", "order", "pressure error", "order", "energy error", "iterations",
            "windows of 8 flow steps")
    return "## Piston on a spring against its exact motion\n\n" + reports.markdown_table(
        head, [row if len(row) == 9 else (*row, "") for row in table])


def main():
    options = reports.arguments(__doc__)
    runner = Runner(options.build)
    records = []
    sections = [part(runner, options.quick, records) for part in (windows, iterations, added_mass)]
    reports.write(options.out, "coupling", "Coupling", records, sections)


if __name__ == "__main__":
    main()
