"""The mesh format: HDF5 with an XDMF index beside it, which ParaView opens as it is.

    nodes                float64 [n, 3]   m
    cells/hex8           int32   [m, 8]   VTK order (also tet4 [m, 4], tet10 [m, 10], wedge6 [m, 6];
                                          quad4 [m, 4] of a plane mesh; tri3 [m, 3] of a surface)
    tissue/hex8          int32   [m]      index into `tissues` (also of the others but tri3)
    tissues              text    [k]      fixed-length
    node_sets/NAME       int32   [j]
    face_sets/NAME       int32   [j, 4]   seen from outside counter-clockwise; 4th -1: a triangle (of
                                          the corners of a tet10); 3rd as well: an edge of a quad4
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path

import h5py
import numpy as np

FORMAT = "ocublast-mesh"
VERSION = 1
NODES_PER_CELL = {"hex8": 8, "tet4": 4, "tet10": 10, "wedge6": 6, "quad4": 4, "tri3": 3}
XDMF_TOPOLOGY = {"hex8": "Hexahedron", "tet4": "Tetrahedron", "tet10": "Tetrahedron_10", "wedge6": "Wedge",
                 "quad4": "Quadrilateral", "tri3": "Triangle"}


@dataclass
class Mesh:
    """Nodes [n, 3] in m, cells per type, tissue of each volume cell, named sets."""

    nodes: np.ndarray
    cells: dict[str, np.ndarray] = field(default_factory=dict)
    tissue: dict[str, np.ndarray] = field(default_factory=dict)
    tissues: list[str] = field(default_factory=list)
    node_sets: dict[str, np.ndarray] = field(default_factory=dict)
    face_sets: dict[str, np.ndarray] = field(default_factory=dict)

    def cells_of(self, name: str, kind: str = "hex8") -> np.ndarray:
        """Cells of one tissue [m, nodes per cell]."""
        return self.cells[kind][self.tissue[kind] == self.tissues.index(name)]


class MeshError(Exception):
    """A file that is no mesh, or a recipe that makes none."""


def write_mesh(mesh: Mesh, file: Path) -> None:
    """Writes `file` and its .xmf, each aside and then renamed, so that nobody reads half of one."""
    aside = file.with_name(file.name + ".part")
    with h5py.File(aside, "w") as h5:
        h5.attrs["format"] = FORMAT
        h5.attrs["version"] = np.int64(VERSION)
        h5["nodes"] = np.ascontiguousarray(mesh.nodes, dtype=np.float64)
        h5["nodes"].attrs["units"] = "m"
        for kind, cells in mesh.cells.items():
            _write(h5, f"cells/{kind}", cells)
        for kind, tissue in mesh.tissue.items():
            _write(h5, f"tissue/{kind}", tissue)
        if mesh.tissues:
            h5["tissues"] = np.array([name.encode() for name in mesh.tissues])
        for name, nodes in mesh.node_sets.items():
            _write(h5, f"node_sets/{name}", nodes)
        for name, faces in mesh.face_sets.items():
            _write(h5, f"face_sets/{name}", faces)
    os.replace(aside, file)
    index = file.with_suffix(".xmf")
    aside = index.with_name(index.name + ".part")
    aside.write_text(_xdmf(mesh, file.name))
    os.replace(aside, index)


def _write(h5: h5py.File, name: str, values: np.ndarray) -> None:
    h5[name] = np.ascontiguousarray(values, dtype=np.int32)
    h5[name].attrs["units"] = "1"


def read_mesh(file: Path) -> Mesh:
    """The mesh in `file`; MeshError when it is not one."""
    try:
        h5 = h5py.File(file, "r")
    except OSError as error:
        raise MeshError(f"{file}: cannot be read as HDF5 ({error})") from error
    with h5:
        found = h5.attrs.get("format", "")
        found = found.decode() if isinstance(found, bytes) else str(found)
        if found != FORMAT:
            raise MeshError(f"{file}: attribute format is '{found}', expected '{FORMAT}'")
        if int(h5.attrs["version"]) > VERSION:
            raise MeshError(f"{file}: version {h5.attrs['version']} is newer than {VERSION}")
        return Mesh(
            nodes=h5["nodes"][...],
            cells={kind: h5["cells"][kind][...] for kind in h5.get("cells", {})},
            tissue={kind: h5["tissue"][kind][...] for kind in h5.get("tissue", {})},
            tissues=[name.decode() for name in h5["tissues"][...]] if "tissues" in h5 else [],
            node_sets={name: h5["node_sets"][name][...] for name in h5.get("node_sets", {})},
            face_sets={name: h5["face_sets"][name][...] for name in h5.get("face_sets", {})},
        )


def _xdmf(mesh: Mesh, h5_name: str) -> str:
    """XDMF3 index: one uniform grid per cell type over the shared nodes, tissue as cell data."""
    names = ", ".join(f"{i} {name}" for i, name in enumerate(mesh.tissues))
    lines = ['<?xml version="1.0" ?>', '<Xdmf Version="3.0">', "<Domain>"]
    if names:
        lines.append(f"<!-- tissue: {names} -->")
    lines.append('<Grid Name="mesh" GridType="Collection" CollectionType="Spatial">')
    for kind, cells in mesh.cells.items():
        count = len(cells)
        lines += [
            f'<Grid Name="{kind}" GridType="Uniform">',
            f'<Topology TopologyType="{XDMF_TOPOLOGY[kind]}" NumberOfElements="{count}">',
            _item(f"{h5_name}:/cells/{kind}", (count, NODES_PER_CELL[kind]), "Int", 4),
            "</Topology>",
            '<Geometry GeometryType="XYZ">',
            _item(f"{h5_name}:/nodes", mesh.nodes.shape, "Float", 8),
            "</Geometry>",
        ]
        if kind in mesh.tissue:
            lines += [
                '<Attribute Name="tissue" AttributeType="Scalar" Center="Cell">',
                _item(f"{h5_name}:/tissue/{kind}", (count,), "Int", 4),
                "</Attribute>",
            ]
        lines.append("</Grid>")
    lines += ["</Grid>", "</Domain>", "</Xdmf>", ""]
    return "\n".join(lines)


def _item(place: str, shape: tuple[int, ...], number: str, precision: int) -> str:
    size = " ".join(str(n) for n in shape)
    return (
        f'<DataItem Dimensions="{size}" NumberType="{number}" Precision="{precision}" '
        f'Format="HDF">{place}</DataItem>'
    )
