"""The cases there are, and how a name or path on the command line becomes a case file."""

from __future__ import annotations

import tomllib
from pathlib import Path

from launching.case_file import CaseError, did_you_mean

CASES = Path(__file__).resolve().parents[1]


def case_names() -> list[str]:
    return sorted(file.parent.name for file in CASES.glob("*/case.toml"))


def find_case(name: str) -> Path:
    """The case file of a name out of `cases/`, a case file, or a folder with a case.toml."""
    inside = CASES / name / "case.toml"
    if "/" not in name and inside.is_file():
        return inside
    path = Path(name)
    if path.is_dir() and (path / "case.toml").is_file():
        return (path / "case.toml").resolve()
    if path.suffix == ".toml" or "/" in name:
        if path.is_file():
            return path.resolve()
        raise CaseError(f"{name}: no such case file")
    names = case_names()
    raise CaseError(f"no case is called '{name}'; {did_you_mean(name, names)} (cases/run --list)")


def list_text() -> str:
    """One line per case: name, run time, title."""
    rows = []
    for name in case_names():
        try:
            about = tomllib.loads((CASES / name / "case.toml").read_text()).get("case", {})
        except tomllib.TOMLDecodeError as error:
            about = {"title": f"cannot be read: {error}"}
        rows.append((name, str(about.get("run_time", "")), str(about.get("title", ""))))
    widths = [max(len(row[i]) for row in rows) for i in (0, 1)] if rows else [0, 0]
    return "\n".join(f"{a:{widths[0]}}  {b:{widths[1]}}  {c}".rstrip() for a, b, c in rows)
