"""What every part of the benchmarks writes: PART.json and PART.md in the output folder."""

import argparse
import json
import os
import statistics


def arguments(description):
    """The options with which tests/bench/run calls a part: build, out, quick."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--build", default="build/release")
    parser.add_argument("--out", default="build/bench")
    parser.add_argument("--quick", action="store_true")
    return parser.parse_args()


def record(bench, case, quantity, value, unit, target=None, better="lower"):
    """One figure; target None where there is none."""
    return {"bench": bench, "case": case, "quantity": quantity, "value": value, "unit": unit, "target": target,
            "better": better}


def median_of_alternating(runs, repeats):
    """Median wall time [s] of each of `runs` (functions that return one), called in turns so that a
    slow spell of the machine hits all of them."""
    times = [[run() for run in runs] for _ in range(repeats)]
    return [statistics.median(column) for column in zip(*times)]


def number(value):
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def markdown_table(header, rows):
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return "\n".join(lines + ["| " + " | ".join(number(cell) for cell in row) + " |" for row in rows])


def record_table(records):
    """All figures with their targets."""
    def met(r):
        if r["target"] is None:
            return ""
        good = r["value"] <= r["target"] if r["better"] == "lower" else r["value"] >= r["target"]
        return "yes" if good else "no"
    return markdown_table(("case", "quantity", "value", "unit", "target", "met"),
                          [(r["case"], r["quantity"], float(r["value"]), r["unit"],
                            "" if r["target"] is None else float(r["target"]), met(r)) for r in records])


def write(out, part, title, records, sections=()):
    """Writes PART.json and PART.md: title, the given markdown sections, then all figures. Prints it."""
    os.makedirs(out, exist_ok=True)
    with open(os.path.join(out, part + ".json"), "w", encoding="utf-8") as file:
        json.dump(records, file, indent=1)
    page = "\n\n".join([f"# {title}", *sections, record_table(records)]) + "\n"
    with open(os.path.join(out, part + ".md"), "w", encoding="utf-8") as file:
        file.write(page)
    print(page)
