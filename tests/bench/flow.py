"""Speed of the flow solver: cells per second, where a step's time goes against what the memory allows,
and what skipping quiet gas saves. A part of tests/bench/run.
"""

import json
import os
import statistics
import subprocess

import flow_instructions
import flow_ranks
import reports

PASSES = ("ghosts", "sensors", "stress", "bulk", "x sweep", "y sweep", "z sweep", "filter", "other")
# Doubles per cell and step that come from memory (with the reads that precede ordinary stores), doubles
# written past the caches, and operations, of an inviscid step on a grid far larger than the caches:
# counted from the kernels. The y sweep finds its plane in the cache.
TRAFFIC = {
    "sensors": (18, 0, 185),   # theta 8, sensors 4, average and coefficients 6
    "bulk": (8, 0, 36),        # w of the neighbouring planes
    "x sweep": (32, 0, 304),   # eight fields in four stages
    "y sweep": (0, 20, 324),
    "z sweep": (73, 5, 525),   # 17, 17, 22 and 17 in the stages
    "filter": (10, 0, 160),
}


def run(build, *options, program="flow_speed"):
    """The JSON lines of one call of flow_speed (or flow_speed_single)."""
    out = subprocess.run([os.path.join(build, "bin", program), "-j", *options], check=True, capture_output=True,
                         text=True).stdout
    return [json.loads(line) for line in out.splitlines() if line.startswith("{")]


def alternating(build, settings, repeats, programs=("flow_speed",)):
    """Each setting's runs, taken in turns; per setting the one with the median of the best steps. With
    several programs, settings x programs in this order."""
    calls = [(program, options) for options in settings for program in programs]
    taken = [[] for _ in calls]
    for _ in range(repeats):
        for column, (program, options) in zip(taken, calls):
            column.append(run(build, *options, program=program)[0])
    middle = []
    for column in taken:
        best = statistics.median_low([r["best"] for r in column])
        middle.append(next(r for r in column if r["best"] == best))
    return middle


def rates(build, quick, records):
    sizes = (32, 64) if quick else (16, 32, 64, 128)
    largest = str(sizes[-1])
    settings = [([str(n), "-t", "1"], f"{n}^3, one thread") for n in sizes]
    settings += [([largest, "-t", "2"], f"{largest}^3, two threads"),
                 ([largest, "-t", "1", "-v"], f"{largest}^3, viscous, one thread"),
                 ([largest, "-t", "1", "-m"], f"{largest}^3, marked pencils, one thread")]
    results = alternating(build, [s for s, _ in settings], 2 if quick else 3)
    targets = {} if quick else {"128^3, one thread": 9.5e6, "128^3, viscous, one thread": 7.0e6}
    for (_, case), r in zip(settings, results):
        records.append(reports.record("flow", case, "cells per second and thread, fastest step", r["best"], "1/s",
                                      targets.get(case), "higher"))
    one = results[len(sizes) - 1]
    two = results[len(sizes)]
    records.append(reports.record("flow", f"{largest}^3", "two threads against one, fastest steps",
                                  2.0 * two["best"] / one["best"], "", None if quick else 1.75, "higher"))


def single(build, quick, records):
    """Single precision against double."""
    n = "64" if quick else "128"
    settings = [([n, "-t", "1"], f"{n}^3, one thread"), ([n, "-t", "2"], f"{n}^3, two threads"),
                ([n, "-t", "1", "-v"], f"{n}^3, viscous, one thread")]
    results = alternating(build, [s for s, _ in settings], 3 if quick else 5, ("flow_speed", "flow_speed_single"))
    for k, (_, case) in enumerate(settings):
        double, once = results[2 * k], results[2 * k + 1]
        records.append(reports.record("flow", f"{case}, single", "cells per second and thread, fastest step",
                                      once["best"], "1/s", None, "higher"))
        records.append(reports.record("flow", f"{case}, single", "against double", once["best"] / double["best"], "",
                                      1.6 if k == 0 and not quick else None, "higher"))


def roofline(build, quick, records):
    """Table of the passes."""
    n = 64 if quick else 128
    read = run(build, "-l")[0]["read"]
    results = [run(build, str(n), "-t", "1", "-p")[0] for _ in range(2 if quick else 3)]
    measured = {name: min(r["passes"][p] for r in results) for p, name in enumerate(PASSES)}
    rows = []
    total_bytes = total_flops = 0
    for name in PASSES:
        if name == "stress":
            continue
        doubles, past, flops = TRAFFIC.get(name, (None, None, None))
        if doubles is None:
            rows.append((name, "", "", "", measured[name]))
            continue
        count = 8 * (doubles + past)
        total_bytes += count
        total_flops += flops
        rows.append((name, count, flops, 1e9 * count / read, measured[name]))
    rows.append(("all", total_bytes, total_flops, 1e9 * total_bytes / read, sum(measured.values())))
    records.append(reports.record("flow", "machine", "one thread reads", read, "B/s", None, "higher"))
    records.append(reports.record("flow", f"{n}^3", "bytes from memory per cell and step, counted", total_bytes, "B"))
    records.append(reports.record("flow", f"{n}^3", "rate that the memory allows", read / total_bytes, "1/s", None,
                                  "higher"))
    return f"## Passes of a step, {n}^3, one thread\n\nBytes and operations per cell and step are counted, the time " \
           "they imply is that of reading so many bytes in streams; the clock's own calls are in the measured " \
           "times.\n\n" + \
        reports.markdown_table(("pass", "bytes", "operations", "implied ns", "measured ns"), rows)


def skipping(build, quick, records):
    n = "48" if quick else "96"
    for r in run(build, n, "-b"):
        case = f"blast in a cube {n}^3, tolerance {r['tolerance']:.0e}"
        tight = r["tolerance"] < 1e-8
        records.append(reports.record("flow", case, "active box against the whole grid", r["speedup"], "",
                                      3.0 if tight and not quick else None, "higher"))
        records.append(reports.record("flow", case, "mean active share", r["share"], ""))
        records.append(reports.record("flow", case, "largest relative difference", r["difference"], "",
                                      1e-10 if tight else 1e-7))
    r = run(build, "64" if quick else "128", "-q")[0]
    records.append(reports.record("flow", f"quiet {r['n']}^3", "part of a whole step", r["part"], "",
                                  None if quick else 0.01))  # the smallest box is 5 % of 64^3


def bodies(build, quick, records):
    """A ball against none, in turns of whole runs of flow_speed."""
    n = "64" if quick else "128"
    runs = [run(build, n, "-B") for _ in range(1 if quick else 3)]
    for rows in zip(*runs):
        r = rows[0]
        moves = f"moving {r['cells_per_step']:g} cells a step" if r["cells_per_step"] > 0 else "at rest"
        records.append(reports.record("flow", f"{n}^3, ball of {r['facets']:,} facets, {moves}", "step against one without",
                                      statistics.median([x["part"] for x in rows]), "",
                                      1.10 if r["cells_per_step"] > 0 and not quick else None))


def main():
    options = reports.arguments(__doc__)
    records = []
    rates(options.build, options.quick, records)
    single(options.build, options.quick, records)
    passes = roofline(options.build, options.quick, records)
    skipping(options.build, options.quick, records)
    bodies(options.build, options.quick, records)
    instructions = flow_instructions.section(options.build, records)
    ranks = flow_ranks.section(options.build, options.quick, records)
    reports.write(options.out, "flow", "Flow: speed", records, [passes, instructions, ranks])


if __name__ == "__main__":
    main()
