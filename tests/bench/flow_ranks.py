"""Speed of the flow on several ranks, and a model of a step's time for many of them.

A step of a rank takes

    t = w cells + e lines + bytes / bandwidth + messages latency + reductions log2(ranks) r

w: one rank's time per cell; lines: lines that go on in another rank's block, counted at both their ends;
e: what such an end costs (its part of the border sums, copies); bandwidth, latency and r (a reduction
between two ranks) are measured by an exchange between two ranks, bytes and messages counted by the
program, e is fitted to the step of two ranks. Nothing is taken off for what overlaps.
"""

import json
import math
import os
import statistics
import subprocess

import reports

# Reductions of a step: convection, two pressures, diffusion, marks, one per stage and one after the filter.
REDUCTIONS = 10
# A cluster's network, for comparison: 100 Gbit/s and two microseconds.
NETWORK = (12.5e9, 2e-6)


def run(build, ranks, *options):
    """The JSON lines of flow_speed on some ranks of one thread."""
    environment = dict(os.environ, OMP_NUM_THREADS="1", OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1",
                       OMPI_MCA_rmaps_base_oversubscribe="1", OMPI_MCA_hwloc_base_binding_policy="none",
                       OMPI_MCA_btl="self,vader")
    if ranks > (os.cpu_count() or 1):
        environment["OMPI_MCA_mpi_yield_when_idle"] = "1"
    start = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    if ranks == 1:
        options = (*options, "-t", "1")
    out = subprocess.run([*start, os.path.join(build, "bin", "flow_speed"), "-j", *options], check=True,
                         capture_output=True, text=True, env=environment).stdout
    return [json.loads(line) for line in out.splitlines() if line.startswith("{")]


def measure(build, n, repeats, steps):
    """Seconds that a rank computes in a step on 1, 2 and 4 ranks: medians of the fastest steps."""
    taken = {1: [], 2: [], 4: []}
    last = {}
    for _ in range(repeats):
        for ranks, column in taken.items():
            r = run(build, ranks, str(n), "-s", str(steps))[0]
            column.append(n ** 3 / r["best"] if ranks == 1 else r["cpu"])
            last[ranks] = r
    return {ranks: statistics.median(column) for ranks, column in taken.items()}, last


def model(t_cell, t_end, cells, ends, traffic, ranks, limits):
    """Seconds of a step by the parts of the model."""
    bandwidth, latency, reduction = limits
    levels = max(math.log2(ranks), 0.0)
    return (t_cell * cells, t_end * ends, traffic[1] / bandwidth, traffic[0] * latency, REDUCTIONS * levels * reduction)


def measured_limits(build):
    small, large = run(build, 2, "-l")
    return large["bytes"] / (large["seconds"] - small["seconds"]), small["seconds"], small["reduction"]


def section(build, quick, records):
    """Records, and the section of the page."""
    n = 64 if quick else 128
    seconds, last = measure(build, n, 1 if quick else 3, 4 if quick else 8)
    limits = measured_limits(build)
    cells = n ** 3
    t_cell = seconds[1] / cells
    two = {"ends": n * n, "traffic": (last[2]["messages"], last[2]["bytes"])}
    # Two ranks wait for nothing but messages; what they compute beyond their cells is the ends' share.
    t_end = max(0.0, (seconds[2] - t_cell * cells / 2) / two["ends"])
    for ranks, target in ((2, 1.7), (4, None)):
        records.append(reports.record("flow", f"{n}^3", f"{ranks} ranks against one, fastest steps, processor time without waiting",
                                      seconds[1] / seconds[ranks], "", None if quick else target, "higher"))
    records.append(reports.record("flow", f"{n}^3 on 2 ranks", "bytes that a rank sends in a step", last[2]["bytes"], "B"))
    rows = []
    for ranks in (1, 2, 4):
        ends, traffic = (0.0, (0, 0)) if ranks == 1 else (n * n * (1 if ranks == 2 else 2), (last[ranks]["messages"],
                                                                                           last[ranks]["bytes"]))
        if ranks == 4:  # root's block touches two others in a cut by 1 x 2 x 2, half a plane each
            ends = n * n
        parts = model(t_cell, t_end, cells / ranks, ends, traffic, ranks, limits)
        rows.append((f"{ranks}", f"{n}^3 in all", 1e3 * seconds[ranks], 1e3 * sum(parts), *(1e3 * p for p in parts),
                     100.0 * seconds[1] / ranks / seconds[ranks]))
    # Weak scaling: blocks of n^3 with six neighbours; along each border what two ranks send each other.
    for ranks in (8, 64, 1000):
        faces = 3 if ranks == 8 else 6
        traffic = (faces * two["traffic"][0], faces * two["traffic"][1])
        for name, of in (("this machine's memory", limits), ("a network", (*NETWORK, NETWORK[1]))):
            parts = model(t_cell, t_end, cells, faces * n * n, traffic, ranks, of)
            rows.append((f"{ranks}", f"{n}^3 each, {name}", "", 1e3 * sum(parts), *(1e3 * p for p in parts),
                         100.0 * parts[0] / sum(parts)))
            if ranks == 1000:
                records.append(reports.record("flow", f"1000 ranks of {n}^3, {name}", "efficiency by the model",
                                              parts[0] / sum(parts), "", None, "higher"))
    table = reports.markdown_table(("ranks", "cells", "measured ms", "model ms", "cells ms", "border ends ms", "bytes ms",
                                    "messages ms", "reductions ms", "efficiency %"), rows)
    return (f"## Ranks\n\nTime of a step = cells x {1e9 * t_cell:.1f} ns + ends of lines at borders x {1e9 * t_end:.0f} ns "
            f"+ bytes / {1e-9 * limits[0]:.1f} GB/s + messages x {1e6 * limits[1]:.2f} us + {REDUCTIONS} log2(ranks) x "
            f"{1e6 * limits[2]:.2f} us. The first figure is that of one rank, the second is fitted to two ranks, the "
            f"others are measured by an exchange. Measured: processor time of the busiest rank in the fastest step without "
            "its waiting for messages (which the other programs of a busy machine lengthen); the model's columns for "
            f"cells and ends are to be compared with it. Four ranks share {os.cpu_count()} processors. The network: {1e-9 * NETWORK[0]:.1f} GB/s, {1e6 * NETWORK[1]:.0f} us.\n\n" + table)
