"""Closed triangulated surfaces: the orbit block, boxes, spheres. Lengths in m, outward triangles."""

from __future__ import annotations

import numpy as np

from meshing.mesh_file import Mesh

# Orbit block in the globe frame, m: an elliptic cone from the rim down to a floor that passes through
# the globe, so that no gap between them gets thin. Sources: cases/eye_pyrodex/README.md.
N_AROUND = 96
FLOOR_Z, RIM_Z, BACK_Z, SIDE_Z = 3e-3, 9e-3, -25e-3, -8e-3
FLOOR_AXES, RIM_AXES = (16e-3, 14.5e-3), (20e-3, 17.5e-3)
FLOOR_INNER_R, FLOOR_RING = 6e-3, 0.75
HALF_WIDTH = 40e-3


def surface(nodes: np.ndarray, triangles: np.ndarray) -> Mesh:
    triangles = np.asarray(triangles, dtype=np.int32)
    wet = np.column_stack([triangles, np.full(len(triangles), -1, dtype=np.int32)])
    return Mesh(nodes=nodes, cells={"tri3": triangles}, face_sets={"wet": wet})


def make_orbit_block(floor_z: float = FLOOR_Z, half_width: float = HALF_WIDTH) -> Mesh:
    """Rigid block with an orbit: rings of N_AROUND points from the floor's centre over rim, front,
    sides and back to the back's centre, joined by quads cut in two."""
    # With a multiple of 8 the square's corners fall on angles of the rings.
    angle = 2.0 * np.pi * np.arange(N_AROUND) / N_AROUND
    direction = np.column_stack([np.cos(angle), np.sin(angle)])
    square = half_width * direction / np.abs(direction).max(axis=1, keepdims=True)
    floor, rim = direction * FLOOR_AXES, direction * RIM_AXES
    rings = [
        (FLOOR_INNER_R * direction, floor_z),
        (FLOOR_RING * floor, floor_z),
        (floor, floor_z),
        (rim, RIM_Z),
        (0.5 * (rim + square), RIM_Z),
        (square, RIM_Z),
        (square, SIDE_Z),
        (square, BACK_Z),
        (square * (2.0 / 3.0), BACK_Z),
        (square / 3.0, BACK_Z),
    ]
    points = [[(0.0, 0.0, floor_z)]]
    points += [np.column_stack([xy, np.full(N_AROUND, z)]) for xy, z in rings]
    points.append([(0.0, 0.0, BACK_Z)])
    nodes = np.concatenate(points)
    k = np.arange(N_AROUND)
    following = np.roll(k, -1)
    triangles = [np.column_stack([np.zeros_like(k), 1 + k, 1 + following])]
    for ring in range(len(rings) - 1):
        inner, outer = 1 + ring * N_AROUND, 1 + (ring + 1) * N_AROUND
        triangles.append(np.column_stack([inner + k, outer + k, outer + following]))
        triangles.append(np.column_stack([inner + k, outer + following, inner + following]))
    last, centre = 1 + (len(rings) - 1) * N_AROUND, len(nodes) - 1
    triangles.append(np.column_stack([last + k, np.full_like(k, centre), last + following]))
    return surface(nodes, np.concatenate(triangles))


def make_box_surface(low: np.ndarray, high: np.ndarray, cells: tuple[int, int, int]) -> Mesh:
    """Closed box with cells[d] facets along each direction."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    points, triangles, first = [], [], 0
    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        u, v = np.linspace(0, 1, cells[b] + 1), np.linspace(0, 1, cells[c] + 1)
        U, V = np.meshgrid(u, v)
        i, j = np.meshgrid(np.arange(cells[b]), np.arange(cells[c]))
        at = (j * (cells[b] + 1) + i).ravel()
        quad = np.column_stack([at, at + 1, at + cells[b] + 2, at + cells[b] + 1])
        for side in (0.0, 1.0):
            unit = np.zeros((U.size, 3))
            unit[:, axis], unit[:, b], unit[:, c] = side, U.ravel(), V.ravel()
            points.append(low + unit * (high - low))
            outward = quad if side == 1.0 else quad[:, ::-1]
            triangles += [first + outward[:, [0, 1, 2]], first + outward[:, [0, 2, 3]]]
            first += U.size
    return surface(*merge_points(np.concatenate(points), np.concatenate(triangles)))


def merge_points(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points that agree to 1e-9 of the extent become one node."""
    extent = float(np.ptp(points, axis=0).max())
    _, index, inverse = np.unique(
        np.round(points / (1e-9 * extent)), axis=0, return_index=True, return_inverse=True
    )
    return points[index], inverse[cells]


def make_sphere_surface(centre: np.ndarray, radius: float, level: int) -> Mesh:
    """Icosahedron cut `level` times in four: 20 * 4^level triangles with vertices on the sphere."""
    g = 0.5 * (1.0 + np.sqrt(5.0))
    nodes = np.array(
        [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g),
         (0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    )
    triangles = np.array(
        [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4),
         (11, 10, 2), (10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9),
         (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    )
    for _ in range(level):
        pairs = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        unique, inverse = np.unique(pairs, axis=0, return_inverse=True)
        middle = (len(nodes) + inverse).reshape(-1, 3)
        nodes = np.concatenate([nodes, nodes[unique].mean(axis=1)])
        a, b, c = triangles.T
        ab, bc, ca = middle.T
        triangles = np.concatenate(
            [np.column_stack(t) for t in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))]
        )
    nodes = nodes / np.linalg.norm(nodes, axis=1, keepdims=True)
    return surface(np.asarray(centre) + radius * nodes, triangles)
