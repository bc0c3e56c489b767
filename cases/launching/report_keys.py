"""The [report] table of a case: how the pictures of report.html are cut."""

from __future__ import annotations

from launching.case_file import CaseError, did_you_mean

KEYS = {"slice_axis": "axis across which pictures are cut: x, y or z",
        "slice_position_m": "place of the cut on it"}


def read_report_keys(case: dict, where: str) -> tuple[str | None, float]:
    """[report]: slice axis and position, checked."""
    keys = case.get("report", {})
    for name in keys:
        if name not in KEYS:
            raise CaseError(f"{where}: report.{name}: no such key; {did_you_mean(name, KEYS)}")
    axis, position = keys.get("slice_axis"), keys.get("slice_position_m", 0.0)
    if axis not in (None, "x", "y", "z"):
        raise CaseError(f"{where}: report.slice_axis: is {axis!r}, accepted: x, y, z")
    if isinstance(position, bool) or not isinstance(position, (int, float)):
        raise CaseError(f"{where}: report.slice_position_m: is {position!r}, expected a length in m")
    return axis, float(position)


def report_table(case: dict) -> str:
    """The table as TOML, defaults filled in."""
    axis, position = read_report_keys(case, "report")
    line = f'slice_axis = "{axis}"\n' if axis else ""
    return f"[report]\n{line}slice_position_m = {position!r}\n"
