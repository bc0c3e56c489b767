"""Instructions per cell and step by pass, counted by callgrind: what a busy machine cannot change."""

import os
import re
import shutil
import subprocess
import tempfile

import reports

# What the functions of a pass are called; the first that is found in a name counts.
PASSES = (
    ("sensors", r"theta_plane|sensor_rows|diffusivity_rows|premark_plane"),
    ("bulk", r"bulk_rows|bulk_ghost_rows"),
    ("filter", r"filter_|finish_plane"),
    ("x sweep", r"sweep_x|forward_nodes<0|backward_nodes<0"),
    ("y sweep", r"sweep_y|backward_y|forward_(columns|nodes)<1"),
    ("z sweep", r"update_|finish_pencil|backward_columns|forward_(columns|nodes)<2"),
    ("ghosts", r"Ghosts|fill_ends_of|outflow_|mem(set|cpy|move)"),
)
CELLS = 32


def count(build, steps):
    """Instructions by function of flow_speed with so many timed steps."""
    with tempfile.TemporaryDirectory() as scratch:
        out = os.path.join(scratch, "callgrind")
        subprocess.run(["valgrind", "-q", "--tool=callgrind", f"--callgrind-out-file={out}",
                        os.path.join(build, "bin", "flow_speed"), str(CELLS), "-t", "1", "-i", "avx2", "-s", str(steps)],
                       check=True, capture_output=True)
        page = subprocess.run(["callgrind_annotate", "--threshold=100", out], check=True, capture_output=True, text=True).stdout
    found = {}
    for line in page.splitlines():
        row = re.match(r"\s*([\d,]+) \([\d. ]+%\)\s+\S*?:(.*)", line)
        if row:
            found[row[2]] = found.get(row[2], 0) + int(row[1].replace(",", ""))
    return found


def section(build, records):
    """Table of the passes, from the difference of a longer and a shorter run; empty without valgrind."""
    if shutil.which("valgrind") is None or shutil.which("callgrind_annotate") is None:
        return "Instructions were not counted: valgrind is not installed."
    short, long_run = 2, 6
    before, after = count(build, short), count(build, long_run)
    per = 1.0 / ((long_run - short) * CELLS ** 3)
    sums = {name: 0.0 for name, _ in PASSES}
    sums["other"] = 0.0
    for function, value in after.items():
        name = next((p for p, pattern in PASSES if re.search(pattern, function)), "other")
        sums[name] += (value - before.get(function, 0)) * per
    total = sum(sums.values())
    records.append(reports.record("flow", f"{CELLS}^3, AVX2", "instructions per cell and step", total, "1"))
    rows = [(name, value, value / total) for name, value in sums.items()] + [("all", total, 1.0)]
    return f"## Instructions per cell and step, {CELLS}^3, AVX2\n\nCounted by callgrind, which knows no AVX-512; its " \
           "vectors hold twice as much.\n\n" + reports.markdown_table(("pass", "instructions", "share"), rows)
