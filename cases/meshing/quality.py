"""Figures that say whether a mesh is fit to compute on. Nodes [n, 3] in m, cells [m, 8 | 4 | 3]."""

from __future__ import annotations

import numpy as np

# Outward faces of a VTK hex and tet.
HEX_FACES = np.array(
    [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
)
TET_FACES = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)])
WEDGE_TRIANGLES = np.array([(0, 2, 1), (3, 4, 5)])
WEDGE_QUADS = np.array([(0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)])
WEDGE_TETS = np.array([(0, 1, 2, 5), (0, 1, 5, 4), (0, 4, 5, 3)])  # each of a sixth of its volume or so
QUAD_EDGES = np.array([(0, 1), (1, 2), (2, 3), (3, 0)])
# At each hex corner its three neighbours, so ordered that a cube gives +1.
HEX_CORNERS = np.array(
    [(0, 1, 3, 4), (1, 2, 0, 5), (2, 3, 1, 6), (3, 0, 2, 7),
     (4, 7, 5, 0), (5, 4, 6, 1), (6, 5, 7, 2), (7, 6, 4, 3)]
)
GAUSS = 1.0 / np.sqrt(3.0)
SIGNS = np.array(
    [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1),
     (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)], dtype=float
)


def hex_scaled_jacobians(nodes: np.ndarray, hexes: np.ndarray) -> np.ndarray:
    """Smallest over the corners of det of the unit edge vectors; 1 for a cube, [m]."""
    worst = np.full(len(hexes), np.inf)
    for corner, a, b, c in HEX_CORNERS:
        at = nodes[hexes[:, corner]]
        edges = [nodes[hexes[:, k]] - at for k in (a, b, c)]
        product = np.einsum("ij,ij->i", np.cross(edges[0], edges[1]), edges[2])
        lengths = np.prod([np.linalg.norm(edge, axis=1) for edge in edges], axis=0)
        worst = np.minimum(worst, product / np.maximum(lengths, np.finfo(float).tiny))
    return worst


def hex_gauss_jacobians(nodes: np.ndarray, hexes: np.ndarray) -> np.ndarray:
    """Jacobian determinants at the 2 x 2 x 2 Gauss points [m, 8], m^3 (their sum is the volume)."""
    corners = nodes[hexes]
    result = np.empty((len(hexes), 8))
    for q, point in enumerate(SIGNS * GAUSS):
        factors = 1.0 + SIGNS * point
        gradient = np.stack(
            [
                SIGNS[:, 0] * factors[:, 1] * factors[:, 2],
                SIGNS[:, 1] * factors[:, 0] * factors[:, 2],
                SIGNS[:, 2] * factors[:, 0] * factors[:, 1],
            ]
        ) / 8.0
        result[:, q] = np.linalg.det(np.einsum("da,mai->mdi", gradient, corners))
    return result


def hex_volumes(nodes: np.ndarray, hexes: np.ndarray) -> np.ndarray:
    """Volumes [m], m^3; exact for trilinear hexes."""
    return hex_gauss_jacobians(nodes, hexes).sum(axis=1)


def tet_volumes(nodes: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """Signed volumes [m], m^3."""
    p = nodes[tets]
    return np.linalg.det(p[:, 1:] - p[:, :1]) / 6.0


def hex_lengths(nodes: np.ndarray, hexes: np.ndarray) -> np.ndarray:
    """V / A_max [m], m: the length that the 0.7 rule of the stable step uses."""
    largest = np.zeros(len(hexes))
    for face in HEX_FACES:
        p = nodes[hexes[:, face]]
        area = 0.5 * np.linalg.norm(np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1]), axis=1)
        largest = np.maximum(largest, area)
    return hex_volumes(nodes, hexes) / largest


def tet_lengths(nodes: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """Smallest altitude [m], m."""
    largest = np.zeros(len(tets))
    for face in TET_FACES:
        p = nodes[tets[:, face]]
        area = 0.5 * np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
        largest = np.maximum(largest, area)
    return 3.0 * tet_volumes(nodes, tets) / largest


def wedge_tets(cells: np.ndarray) -> np.ndarray:
    """The three tets [3 m, 4] that make each wedge, wedge after wedge."""
    return cells[:, WEDGE_TETS].reshape(-1, 4)


def quad_corner_areas(nodes: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Area [m, 4] that the sides at each corner of plane quads span (m^2), negative when clockwise; the
    area of a quad is half their mean."""
    p = nodes[cells][:, :, :2]
    after, before = np.roll(p, -1, axis=1) - p, np.roll(p, 1, axis=1) - p
    return after[..., 0] * before[..., 1] - after[..., 1] * before[..., 0]


def boundary_faces(cells: dict[str, np.ndarray]) -> np.ndarray:
    """Faces that belong to one cell only, outward [k, 4]; triangles carry -1 as fourth node, edges of
    plane quads as third and fourth."""
    faces = []

    def add(corners: np.ndarray, which: np.ndarray) -> None:
        found = corners[:, which].reshape(-1, which.shape[1])
        faces.append(np.pad(found, ((0, 0), (0, 4 - which.shape[1])), constant_values=-1))

    for kind, which in (("hex8", HEX_FACES), ("tet4", TET_FACES), ("tet10", TET_FACES),
                        ("wedge6", WEDGE_TRIANGLES), ("wedge6", WEDGE_QUADS), ("quad4", QUAD_EDGES)):
        if kind in cells:
            add(cells[kind], which)
    if not faces:
        return np.empty((0, 4), dtype=np.int32)
    faces = np.concatenate(faces)
    _, index, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True,
                                return_counts=True)
    return faces[np.sort(index[count == 1])].astype(np.int32)


def split_faces(faces: np.ndarray) -> np.ndarray:
    """Triangles [k, 3] of outward faces [m, 4], quads cut along their first diagonal."""
    quads = faces[faces[:, 3] >= 0]
    triangles = faces[faces[:, 3] < 0][:, :3]
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]], triangles])


class SurfaceFigures:
    """Closedness, orientation, Euler number, area and enclosed volume of a set of outward faces."""

    def __init__(self, nodes: np.ndarray, faces: np.ndarray) -> None:
        directed = []
        for row in (faces[faces[:, 3] >= 0], faces[faces[:, 3] < 0][:, :3]):
            for k in range(row.shape[1]):
                directed.append(np.column_stack([row[:, k], row[:, (k + 1) % row.shape[1]]]))
        edges = np.concatenate(directed) if directed else np.empty((0, 2), dtype=int)
        undirected, uses = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
        used = np.unique(faces[faces >= 0])
        self.open_edges = int(np.count_nonzero(uses == 1))
        self.branching_edges = int(np.count_nonzero(uses > 2))
        self.repeated_directions = len(edges) - len(np.unique(edges, axis=0))
        self.euler = len(used) - len(undirected) + len(faces)
        triangles = split_faces(faces)
        p = nodes[triangles] - nodes[used].mean(axis=0) if len(used) else np.empty((0, 3, 3))
        normal = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
        self.area = float(0.5 * np.linalg.norm(normal, axis=1).sum())
        self.volume = float(np.einsum("ij,ij->", p[:, 0], normal) / 6.0)

    @property
    def closed(self) -> bool:
        return self.open_edges == 0 and self.branching_edges == 0

    @property
    def outward(self) -> bool:
        return self.repeated_directions == 0 and self.volume > 0.0


def duplicate_nodes(nodes: np.ndarray, tolerance: float = 1e-9) -> int:
    """How many nodes lie on another one, within about `tolerance` (m)."""
    return len(nodes) - len(np.unique(np.round(nodes / tolerance), axis=0))
