"""summary.json: what the programs report, beside reference values, with the run's performance."""

from __future__ import annotations

import csv
import json
import math
import os
import platform
from pathlib import Path

from launching.case_file import CaseError
from launching.programs import solid_names
from launching.tissue_stress import tissue_quantities

PARTS = ("flow_summary.json", "solid_summary.json", "coupling_summary.json")


def read_targets(case_folder: Path) -> dict[str, dict]:
    """Reference values by name from reference/targets.csv: value, unit, tolerance (relative), source."""
    file = case_folder / "reference" / "targets.csv"
    if not file.is_file():
        return {}
    targets = {}
    with file.open(newline="") as stream:
        for line, row in enumerate(csv.DictReader(stream), start=2):
            try:
                targets[row["name"]] = {
                    "value": float(row["value"]),
                    "unit": row["unit"],
                    "tolerance": float(row["tolerance"]) if row["tolerance"] else None,
                    "source": row["source"],
                }
            except (KeyError, TypeError, ValueError) as error:
                raise CaseError(
                    f"{file}:{line}: expected name,value,unit,tolerance,source ({error!r})"
                ) from error
    return targets


def read_parts(out: Path, solids: list[str] = ()) -> tuple[list[dict], dict]:
    """Quantities and performance of all programs; a program that did not run has no file. What each
    of several solids says bears its name."""
    quantities: list[dict] = []
    performance: dict = {}
    files = [(out / name, "") for name in PARTS]
    files[1:1] = [(out / name / "solid_summary.json", name + "_") for name in solids]
    for file, prefix in files:
        if not file.is_file():
            continue
        part = json.loads(file.read_text())
        quantities += [{**q, "name": prefix + q["name"]} for q in part.get("quantities", [])]
        performance.update({prefix + k: v for k, v in part.get("performance", {}).items()})
    return quantities, performance


def add_tissue_stress(quantities: list[dict], out: Path, solids: list[str] = ()) -> list[dict]:
    """The same with the stress that a share of a tissue exceeds after the largest one of single elements."""
    robust = {}
    for folder, prefix in [(out, "")] + [(out / name, name + "_") for name in solids]:
        for found in tissue_quantities(folder):
            tissue = found["name"].removesuffix("_von_mises_of_1_percent_peak")
            robust[f"{prefix}{tissue}_von_mises_peak"] = {**found, "name": prefix + found["name"]}
    rows = []
    for quantity in quantities:
        rows.append(quantity)
        if quantity["name"] in robust:
            rows.append(robust[quantity["name"]])
    return rows


def compare(quantity: dict, target: dict | None) -> dict:
    """A quantity with its reference, relative error and whether that is within the tolerance."""
    row = {"name": quantity["name"], "value": quantity["value"], "unit": quantity["unit"],
           "reference": None, "source": None, "relative_error": None, "tolerance": None,
           "within_tolerance": None}
    if target is None:
        return row
    row.update(reference=target["value"], source=target["source"], tolerance=target["tolerance"])
    if target["unit"] != quantity["unit"]:
        row["source"] += f" (unit differs: {target['unit']})"
        return row
    value, reference = quantity["value"], target["value"]
    if not isinstance(value, (int, float)) or not math.isfinite(value):
        row["within_tolerance"] = False
        return row
    # Against a zero reference there is no relative error: the value itself counts.
    row["relative_error"] = (value - reference) / abs(reference) if reference else value
    if target["tolerance"] is not None:
        row["within_tolerance"] = abs(row["relative_error"]) <= target["tolerance"]
    return row


def make_summary(case: dict, case_file: Path, out: Path, about: dict, wall: dict) -> dict:
    """The whole summary. `about`: version, command, times; `wall`: wall times measured outside, s."""
    quantities, performance = read_parts(out, solid_names(case))
    quantities = add_tissue_stress(quantities, out, solid_names(case))
    targets = read_targets(case_file.parent)
    rows = [compare(quantity, targets.get(quantity["name"])) for quantity in quantities]
    reported = {row["name"] for row in rows}
    split = dict(wall)
    split.update(performance)
    return {
        "case": case["case"]["name"],
        "title": case["case"].get("title", ""),
        "resolution": case["case"].get("resolution"),
        "end_time_s": case.get("time", {}).get("end_s"),
        **about,
        "machine": {"cpu": cpu_name(), "cores": os.cpu_count(), "system": platform.platform()},
        "quantities": rows,
        "references_without_value": sorted(set(targets) - reported),
        "performance": split,
    }


def cpu_name() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.machine()


def number(value) -> str:
    return f"{value:.6g}" if isinstance(value, (int, float)) else str(value)


def table(summary: dict) -> str:
    """The quantities as a text table."""
    rows = [("quantity", "value", "unit", "reference", "error", "source")]
    for row in summary["quantities"]:
        error = row["relative_error"]
        verdict = {True: "", False: " !", None: ""}[row["within_tolerance"]]
        rows.append((
            row["name"], number(row["value"]), row["unit"],
            "" if row["reference"] is None else number(row["reference"]),
            "" if error is None else f"{100.0 * error:+.2f} %{verdict}",
            row["source"] or "",
        ))
    widths = [max(len(row[i]) for row in rows) for i in range(5)]
    lines = []
    for row in rows:
        cells = [f"{row[0]:{widths[0]}}", f"{row[1]:>{widths[1]}}", f"{row[2]:{widths[2]}}",
                 f"{row[3]:>{widths[3]}}", f"{row[4]:>{widths[4]}}", row[5]]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)


def write_json(file: Path, content: dict) -> None:
    aside = file.with_name(file.name + ".part")
    aside.write_text(json.dumps(content, indent=1, allow_nan=True) + "\n")
    os.replace(aside, file)


def read_json(file: Path) -> dict:
    return json.loads(file.read_text())
