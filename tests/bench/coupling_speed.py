"""Time per coupling window through the daemon without solver work, with and without recording.

Usage: coupling_speed.py [--build BUILD] [--windows N] [--out DIR]; prints a table and, with --out,
writes bench.json: {bench, case, quantity, value, unit, target, better}.
"""

import argparse
import json
import os
import subprocess
import tempfile

CASE = """
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
record = {record}
[flow]
cells = 4
[solid]
vertices = {edge}
stable_step_s = 1.0
"""
SIZES = ((32, 120.0, 5.0), (100, 230.0, 5.0), (224, 700.0, 400.0))  # edge, target us, for recording us


def measure(build, edge, record, windows):
    """Median and 5th percentile of the coupling's own time per window, us."""
    program = lambda name: os.path.join(build, "bin", name)
    with tempfile.TemporaryDirectory(prefix="ocublast-bench-") as scratch:
        case = os.path.join(scratch, "case.toml")
        with open(case, "w", encoding="utf-8") as file:
            file.write(CASE.format(width=4.0 / windows, record=str(record).lower(), edge=edge))
        subprocess.run([program("coupler"), case, "--quiet", "--out", scratch, "--flow",
                        program("coupler_gas_column"), "--solid", program("coupler_spring")], check=True)
        with open(os.path.join(scratch, "coupling.csv"), encoding="utf-8") as file:
            times = sorted(float(line.rsplit(",", 1)[1]) for line in file.read().splitlines()[1:])
    return times[len(times) // 2], times[len(times) // 20]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", default="build/release")
    parser.add_argument("--windows", type=int, default=400)
    parser.add_argument("--out")
    options = parser.parse_args()
    records = []
    print(f"{'vertices':>8} {'record':>7} {'median us':>10} {'p05 us':>10} {'target us':>10}")
    for edge, target, for_recording in SIZES:
        for record in (False, True):
            median, p05 = measure(options.build, edge, record, options.windows)
            limit = target + (for_recording if record else 0.0)
            print(f"{edge * edge:8} {str(record):>7} {median:10.1f} {p05:10.1f} {limit:10.1f}")
            case = f"{edge * edge} vertices{', recorded' if record else ''}"
            for quantity, value, aim in (("window_median", median, limit), ("window_p05", p05, None)):
                records.append({"bench": "coupling_speed", "case": case, "quantity": quantity, "value": value,
                                "unit": "us", "target": aim, "better": "lower"})
    if options.out:
        os.makedirs(options.out, exist_ok=True)
        with open(os.path.join(options.out, "bench.json"), "w", encoding="utf-8") as file:
            json.dump(records, file, indent=1)


if __name__ == "__main__":
    main()
