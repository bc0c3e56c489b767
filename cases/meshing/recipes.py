"""The [[mesh]] entries of a case: which recipes there are, their keys, and how a mesh is made."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Callable

import numpy as np

from launching.case_file import CaseError, did_you_mean
from meshing.blocks import make_box_hex
from meshing.convert import LENGTH_UNITS, convert
from meshing.globe import make_globe
from meshing.globe_curves import PRESETS
from meshing.globe_profile import GlobeShape
from meshing.mesh_file import Mesh, MeshError, write_mesh
from meshing.surfaces import (FLOOR_Z, HALF_WIDTH, make_box_surface, make_orbit_block,
                              make_sphere_surface)

REQUIRED = object()


@dataclass(frozen=True)
class Key:
    """One key of a recipe: kind is length (m), lengths (3 of them), count, counts (3), text, word."""

    kind: str
    default: object
    help: str
    words: tuple[str, ...] = ()


ORIGIN = Key("lengths", (0.0, 0.0, 0.0), "moves the mesh by this")
# GlobeShape in mm under the names of case keys.
GLOBE_LENGTHS = {
    "equator_radius_m": "equator_radius", "pole_radius_m": "pole_radius",
    "cornea_radius_m": "cornea_radius", "cornea_thickness_m": "cornea_thickness",
    "chamber_depth_m": "chamber_depth", "lens_thickness_m": "lens_thickness",
    "retina_thickness_m": "retina_thickness", "wall_thickness_min_m": "wall_thickness_min",
}


def _words(name: str) -> str:
    return name.replace("_", " ")


def _globe(p: dict, _: Path) -> Mesh:
    shape = GlobeShape(**{field: p[key] * 1e3 for key, field in GLOBE_LENGTHS.items()})
    return make_globe(p["preset"], shape, np.array(p["translation_m"]))


def _moved(mesh: Mesh, p: dict) -> Mesh:
    mesh.nodes = mesh.nodes + np.array(p["translation_m"])
    return mesh


RECIPES: dict[str, tuple[str, dict[str, Key], Callable[[dict, Path], Mesh]]] = {
    "globe": (
        "the eye's globe, all hexes, nine tissues, in the globe frame (z forward)",
        {
            "preset": Key("word", REQUIRED, "cells", tuple(PRESETS)),
            "translation_m": ORIGIN,
            **{key: Key("length", round(getattr(GlobeShape, field) * 1e-3, 9), _words(field))
               for key, field in GLOBE_LENGTHS.items()},
        },
        _globe,
    ),
    "orbit_block": (
        "rigid block with an orbit for the globe, closed surface",
        {
            "floor_z_m": Key("length", FLOOR_Z, "floor of the orbit; 0 or in front of it"),
            "half_width_m": Key("length", HALF_WIDTH, "half the width of the front"),
            "translation_m": ORIGIN,
        },
        lambda p, _: _moved(make_orbit_block(p["floor_z_m"], p["half_width_m"]), p),
    ),
    "box_hex": (
        "block of equal hexes; sets x_min ... z_max, wet",
        {
            "low_m": Key("lengths", REQUIRED, "lower corner"),
            "high_m": Key("lengths", REQUIRED, "upper corner"),
            "cells": Key("counts", REQUIRED, "cells along x, y, z"),
            "tissue": Key("text", REQUIRED, "name of its material block"),
        },
        lambda p, _: make_box_hex(p["low_m"], p["high_m"], p["cells"], p["tissue"]),
    ),
    "box_surface": (
        "closed box of triangles",
        {
            "low_m": Key("lengths", REQUIRED, "lower corner"),
            "high_m": Key("lengths", REQUIRED, "upper corner"),
            "cells": Key("counts", (1, 1, 1), "facets along x, y, z"),
        },
        lambda p, _: make_box_surface(p["low_m"], p["high_m"], p["cells"]),
    ),
    "sphere_surface": (
        "closed sphere of 20 * 4^level triangles",
        {
            "centre_m": Key("lengths", (0.0, 0.0, 0.0), "centre"),
            "radius_m": Key("length", REQUIRED, "radius"),
            "level": Key("count", 3, "times an icosahedron's triangles are cut in four"),
        },
        lambda p, _: make_sphere_surface(p["centre_m"], p["radius_m"], p["level"]),
    ),
    "file": (
        "a mesh file of another program, beside the case (Gmsh, Abaqus, Exodus, VTU, STL, OBJ)",
        {
            "input": Key("text", REQUIRED, "file, relative to the case"),
            "length_unit": Key("word", "m", "unit of its lengths", tuple(LENGTH_UNITS)),
            "translation_m": ORIGIN,
        },
        lambda p, folder: _moved(convert(folder / p["input"], p["length_unit"]), p),
    ),
}


def _is_number(value) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _is_count(value, least: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= least


def _fault(key: Key, value) -> str | None:
    """What is wrong with a value, or None."""
    if key.kind == "length" and not (_is_number(value) and np.isfinite(value)):
        return "expected a length in m"
    if key.kind == "lengths" and not (
        isinstance(value, (list, tuple)) and len(value) == 3 and all(map(_is_number, value))
    ):
        return "expected three lengths in m, [x, y, z]"
    if key.kind == "count" and not _is_count(value, 0):
        return "expected a whole number, 0 or more"
    if key.kind == "counts" and not (
        isinstance(value, (list, tuple)) and len(value) == 3 and all(_is_count(v, 1) for v in value)
    ):
        return "expected three whole numbers, 1 or more"
    if key.kind in ("text", "word") and not isinstance(value, str):
        return "expected a text"
    if key.words and value not in key.words:
        return f"accepted: {', '.join(key.words)}"
    return None


def _read_entry(entry: dict, where: str, faults: list[str]) -> dict | None:
    """Recipe, output and parameters of one [[mesh]] entry; faults are gathered."""
    recipe = entry.get("recipe")
    if recipe not in RECIPES:
        faults.append(f"{where}.recipe: '{recipe}' is no recipe; {did_you_mean(str(recipe), RECIPES)}")
        return None
    output = entry.get("output")
    if not isinstance(output, str) or not output.endswith(".h5") or Path(output).name != output:
        faults.append(f"{where}.output: '{output}', expected a plain file name ending in .h5")
    keys = RECIPES[recipe][1]
    parameters = {}
    for name in entry:
        if name not in keys and name not in ("recipe", "output"):
            faults.append(f"{where}.{name}: no such key of recipe {recipe}; {did_you_mean(name, keys)}")
    for name, key in keys.items():
        value = entry.get(name, key.default)
        if value is REQUIRED:
            faults.append(f"{where}.{name}: missing ({key.help})")
            continue
        fault = _fault(key, value)
        if fault:
            faults.append(f"{where}.{name}: is {value!r}, {fault}")
        parameters[name] = value
    return {"recipe": recipe, "output": output, "parameters": parameters}


def read_mesh_entries(case: dict, case_file: Path) -> list[dict]:
    """All [[mesh]] entries, checked. CaseError with every fault."""
    entries = case.get("mesh", [])
    if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
        raise CaseError(f"{case_file}: mesh: expected tables [[mesh]]")
    faults: list[str] = []
    read = [_read_entry(e, f"{case_file}: mesh.{i}", faults) for i, e in enumerate(entries)]
    outputs = [entry["output"] for entry in read if entry]
    for name in sorted({name for name in outputs if outputs.count(name) > 1}, key=str):
        faults.append(f"{case_file}: mesh: two entries write {name}")
    if faults:
        raise CaseError("\n".join(faults))
    return read


def make_meshes(case: dict, case_file: Path, out: Path) -> list[Path]:
    """Builds every mesh of a case into `out`. Nothing is written unless all of them can be made."""
    made = []
    for entry in read_mesh_entries(case, case_file):
        try:
            mesh = RECIPES[entry["recipe"]][2](entry["parameters"], case_file.parent)
        except (MeshError, ValueError) as error:
            raise CaseError(f"{case_file}: mesh {entry['output']}: {error}") from error
        made.append((out / entry["output"], mesh))
    out.mkdir(parents=True, exist_ok=True)
    for file, mesh in made:
        write_mesh(mesh, file)
    return [file for file, _ in made]


def effective_entries(case: dict, case_file: Path) -> str:
    """The [[mesh]] tables as TOML, defaults filled in."""
    text = ""
    for entry in read_mesh_entries(case, case_file):
        text += f'[[mesh]]\nrecipe = "{entry["recipe"]}"\noutput = "{entry["output"]}"\n'
        for name, value in entry["parameters"].items():
            text += f"{name} = {toml_value(value)}\n"
        text += "\n"
    return text


def toml_value(value) -> str:
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(toml_value(v) for v in value) + "]"
    return repr(value)


def key_list() -> str:
    """Every recipe with its keys."""
    lines = []
    for name, (about, keys, _) in RECIPES.items():
        lines.append(f'[[mesh]] recipe = "{name}"  {about}')
        lines.append("  output  text  required  file name ending in .h5")
        for key_name, key in keys.items():
            default = "required" if key.default is REQUIRED else f"default {toml_value(key.default)}"
            words = f"  one of {', '.join(key.words)}" if key.words else ""
            lines.append(f"  {key_name}  {key.kind}{words}  {default}  {key.help}")
    return "\n".join(lines)
