"""Reads a case file with its resolution preset and --set overrides.

The same rules as coupler/base/case_reader.cpp: an override of case.resolution counts first, then the
preset [resolution.NAME] of "dotted.key" = value lines is applied, then the other overrides. A number
in a dotted key is an index of a list ("mesh.0.preset"), a word the entry of that name ("solid.left.mesh").
"""

from __future__ import annotations

import copy
import difflib
import tomllib
from pathlib import Path


class CaseError(Exception):
    """The user's input: exit code 2."""


def parse_value(text: str):
    """A TOML value, or the text itself where it is none."""
    try:
        return tomllib.loads("value = " + text)["value"]
    except tomllib.TOMLDecodeError:
        return text


def apply_override(root: dict, key: str, value) -> None:
    """Sets `root` at a dotted key; tables that are missing are made."""
    at = root
    parts = key.split(".")
    for depth, part in enumerate(parts):
        last = depth == len(parts) - 1
        if isinstance(at, dict):
            if last:
                at[part] = value
                return
            at = at.setdefault(part, {})
        elif isinstance(at, list):
            names = [entry.get("name") if isinstance(entry, dict) else None for entry in at]
            index = int(part) if part.isdigit() else names.index(part) if part in names else len(at)
            if index >= len(at):
                raise CaseError(
                    f"--set {key}: '{part}' is no index or name in a list of {len(at)} entries"
                )
            if last:
                at[index] = value
                return
            at = at[index]
        else:
            raise CaseError(f"--set {key}: '{part}' is a value, not a table")


def split_override(text: str) -> tuple[str, object]:
    key, equals, value = text.partition("=")
    if not equals or not key:
        raise CaseError(f"--set {text}: expected dotted.key=value")
    return key, parse_value(value)


def read_case(file: Path, overrides: list[str]) -> dict:
    """The case as nested dicts and lists, preset and overrides applied."""
    if not file.is_file():
        raise CaseError(f"{file}: no such case file; try cases/run --list")
    try:
        root = tomllib.loads(file.read_text())
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise CaseError(f"{file}: {error}") from error
    changes = [split_override(text) for text in overrides]
    for key, value in changes:
        if key == "case.resolution":
            apply_override(root, key, value)
    case = root.get("case", {})
    name = case.get("resolution") if isinstance(case, dict) else None
    if isinstance(name, str):
        presets = root.get("resolution", {})
        if name not in presets:
            accepted = ", ".join(presets) or "none (no [resolution.NAME] table)"
            raise CaseError(
                f"{file}: case.resolution: '{name}' is not defined, accepted: {accepted}"
            )
        for key, value in copy.deepcopy(presets[name]).items():
            apply_override(root, key, value)
    for key, value in changes:
        apply_override(root, key, value)
    return root


def did_you_mean(word: str, known) -> str:
    """A hint with the nearest known word, or the list of all."""
    near = difflib.get_close_matches(word, list(known), n=1, cutoff=0.5)
    return f"did you mean '{near[0]}'?" if near else f"accepted: {', '.join(known)}"
