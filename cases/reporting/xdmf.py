"""Reads the XDMF series that the solvers write: times, and the HDF5 datasets behind every grid."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, field
from pathlib import Path

import h5py
import numpy as np


@dataclass
class Item:
    """One dataset: file and path inside it."""

    file: Path
    dataset: str

    def read(self) -> np.ndarray:
        with h5py.File(self.file, "r") as h5:
            return h5[self.dataset][...]


@dataclass
class Grid:
    """One uniform grid at one time."""

    name: str
    topology_kind: str
    topology: Item | None
    geometry: list[Item]
    attributes: dict[str, tuple[str, list[Item]]] = field(default_factory=dict)

    def attribute(self, name: str) -> np.ndarray:
        """Values of an attribute; components that lie in several datasets become the last axis."""
        items = self.attributes[name][1]
        arrays = [item.read() for item in items]
        return arrays[0] if len(arrays) == 1 else np.stack(arrays, axis=-1)

    def centre(self, name: str) -> str:
        return self.attributes[name][0]


@dataclass
class Frame:
    time: float  # s
    grids: list[Grid]


def read_series(file: Path) -> list[Frame]:
    """Frames in order of time; empty where the file is missing."""
    if not file.is_file():
        return []
    root = ElementTree.parse(file).getroot()
    domain = root.find("Domain")
    frames: list[Frame] = []
    if domain is None:
        return frames
    for outer in domain.findall("Grid"):
        members = outer.findall("Grid") if outer.get("CollectionType") == "Temporal" else [outer]
        for member in members:
            time = member.find("Time")
            inner = member.findall("Grid") if member.get("GridType") == "Collection" else [member]
            if inner and time is None:
                time = inner[0].find("Time")
            grids = [_grid(node, root, file.parent) for node in inner]
            frames.append(Frame(float(time.get("Value")) if time is not None else 0.0, grids))
    return sorted(frames, key=lambda frame: frame.time)


def _grid(node, root, folder: Path) -> Grid:
    topology = _resolve(node.find("Topology"), root)
    geometry = _resolve(node.find("Geometry"), root)
    kind = topology.get("TopologyType", "") if topology is not None else ""
    items = _items(topology, root, folder) if topology is not None else []
    grid = Grid(node.get("Name", ""), kind, items[0] if items else None,
                _items(geometry, root, folder) if geometry is not None else [])
    for attribute in node.findall("Attribute"):
        grid.attributes[attribute.get("Name", "")] = (
            attribute.get("Center", "Node"), _items(attribute, root, folder)
        )
    return grid


def _resolve(node, root):
    """A node that refers to another one by an XPath stands for that one."""
    while node is not None and node.get("Reference") and (node.text or "").strip():
        node = root.find("./" + node.text.strip().removeprefix("/Xdmf/"))
    return node


def _items(node, root, folder: Path) -> list[Item]:
    """All HDF datasets under a node, in order."""
    found = []
    for item in node.iter("DataItem"):
        item = _resolve(item, root)
        if item is None or item.get("Format") != "HDF":
            continue
        file, _, dataset = (item.text or "").strip().partition(":")
        found.append(Item(folder / file, dataset))
    return found


def pick(frames: list, count: int) -> list:
    """At most `count` frames, evenly spread, first and last among them."""
    if len(frames) <= count:
        return frames
    return [frames[i] for i in np.unique(np.linspace(0, len(frames) - 1, count).round().astype(int))]
