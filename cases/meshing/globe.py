"""All-hex mesh of the eye's globe: a disc O-grid carried along the optical axis, seven groups of
layers round a core cylinder in the vitreous.

Front cap, side ring and back cap of layers are one set of columns; each column is cut by the layer
curves of `globe_curves`. Cornea, limbus, iris, pupil, both lens surfaces, lens edge, ciliary body,
retina and sclera therefore lie on cell faces at every resolution. No smoothing, closed formulas only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshing.globe_curves import LENS_GROUP, PRESETS, LayerCurves, Resolution
from meshing.globe_profile import GlobeShape
from meshing.mesh_file import Mesh

TISSUES = ["cornea", "sclera", "aqueous", "iris", "ciliary_body", "lens", "zonule", "vitreous",
           "retina"]
MM = 1e-3
# The disc's square lies between a plain square (0) and a circle (1): at its corners a circle would
# give flat cells, a square flat ones in the ring round it.
ROUNDNESS = 0.45
# Optic nerve head of a left eye: a line along z, mm.
NERVE_X, NERVE_Y, NERVE_RADIUS = -3.2, 0.8, 0.9
# The rear part of the wall, mm: behind the equator's muscle insertions, where orbital fat holds it.
POSTERIOR_Z = -6.0
# Insertions of the straight muscles: direction, distance from the limbus, width; mm.
RECTI = {
    "rectus_medial": ((-1.0, 0.0), 5.5, 10.3),
    "rectus_lateral": ((1.0, 0.0), 6.9, 9.2),
    "rectus_superior": ((0.0, 1.0), 7.7, 10.6),
    "rectus_inferior": ((0.0, -1.0), 6.5, 9.8),
}


@dataclass
class Disc:
    """Nodes of the disc in (s, phi), its quads (counter-clockwise), and their middle s."""

    s: np.ndarray
    phi: np.ndarray
    quads: np.ndarray
    quad_s: np.ndarray
    rim: np.ndarray  # nodes on s = 4 in order of phi


def make_disc(resolution: Resolution) -> Disc:
    n, around = resolution.n, 4 * resolution.n
    u = np.linspace(-1.0, 1.0, n + 1)
    p = 0.5 * np.tan(0.25 * np.pi * u) + 0.5 * u
    px, py = np.meshgrid(p, p)
    scale = resolution.square
    flat = np.stack([px, py], axis=-1) / np.sqrt(2.0)
    round_ = np.stack(
        [px * np.sqrt(1.0 - 0.5 * py**2), py * np.sqrt(1.0 - 0.5 * px**2)], axis=-1
    )
    square = (scale * ((1.0 - ROUNDNESS) * flat + ROUNDNESS * round_)).reshape(-1, 2)
    # Border of the square from its corner at -135 degrees, counter-clockwise.
    k = np.arange(n)
    border = np.concatenate(
        [k, k * (n + 1) + n, n * (n + 1) + n - k, (n - k) * (n + 1)]
    )
    angle = np.radians(-135.0) + 2.0 * np.pi * np.arange(around) / around
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    points = [square]
    rings = [border]
    ring_s = []  # middle s of the cells outside each ring
    first = len(square)
    for zone, count in enumerate(resolution.rings):
        for step in range(1, count + 1):
            t = step / count
            points.append((1 - t) * square[border] + t * circle if zone == 0 else (zone + t) * circle)
            rings.append(first + np.arange(around))
            ring_s.append(0.5 if zone == 0 else zone + (step - 0.5) / count)
            first += around
    xy = np.concatenate(points)
    i, j = np.meshgrid(np.arange(n), np.arange(n))
    corner = (j * (n + 1) + i).ravel()
    quads = [np.column_stack([corner, corner + 1, corner + n + 2, corner + n + 1])]
    for inner, outer in zip(rings, rings[1:]):
        quads.append(np.column_stack([inner, outer, np.roll(outer, -1), np.roll(inner, -1)]))
    quad_s = np.concatenate([np.full(n * n, 0.5), np.repeat(ring_s, around)])
    radius = np.linalg.norm(xy, axis=1)
    # Rounding must not carry a column across a border of the curves' pieces.
    radius = np.where(np.abs(radius - np.round(2 * radius) / 2) < 1e-12, np.round(2 * radius) / 2, radius)
    return Disc(radius, np.arctan2(xy[:, 1], xy[:, 0]), np.concatenate(quads), quad_s, rings[-1])


def _turn(points: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """Meridian points [..., m, 2] turned to the angles phi [m]: [..., m, 3]."""
    r, z = points[..., 0], points[..., 1]
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1)


class GlobeBuilder:
    """Columns through the layers, the core inside them, tissues and sets."""

    def __init__(self, shape: GlobeShape, resolution: Resolution) -> None:
        self.resolution = resolution
        self.curves = LayerCurves(shape, resolution)
        self.shape = shape
        self.disc = make_disc(resolution)
        self._make_columns()

    def _make_columns(self) -> None:
        """Column parameters s and phi; their quads seen from outside; middle s of each quad."""
        disc, ns = self.disc, self.resolution.ns
        count, around = len(disc.s), len(disc.rim)
        side_s = np.repeat(4.0 + np.arange(1, ns) / ns, around)
        self.s = np.concatenate([disc.s, side_s, 9.0 - disc.s])
        self.phi = np.concatenate([disc.phi, np.tile(disc.phi[disc.rim], ns - 1), disc.phi])
        self.back = count + (ns - 1) * around
        self.side_rings = [disc.rim]
        self.side_rings += [count + (e - 1) * around + np.arange(around) for e in range(1, ns)]
        self.side_rings.append(self.back + disc.rim)
        quads = [disc.quads]
        for upper, lower in zip(self.side_rings, self.side_rings[1:]):
            quads.append(np.column_stack([lower, np.roll(lower, -1), np.roll(upper, -1), upper]))
        quads.append(self.back + disc.quads[:, ::-1])
        self.quads = np.concatenate(quads)
        middle = np.repeat(4.0 + (np.arange(ns) + 0.5) / ns, around)
        self.quad_s = np.concatenate([disc.quad_s, middle, 9.0 - disc.quad_s])

    def _core_nodes(self) -> tuple[np.ndarray, np.ndarray]:
        """Points inside the core [k, 3] and the node of each disc point at each level."""
        disc, ns = self.disc, self.resolution.ns
        columns = len(self.s)
        base = (sum(self.resolution.layers)) * columns  # nodes of the innermost level begin here
        inside = np.ones(len(disc.s), dtype=bool)
        inside[disc.rim] = False
        node = np.empty((ns + 1, len(disc.s)), dtype=np.int64)
        node[0] = base + np.arange(len(disc.s))
        node[ns] = base + self.back + np.arange(len(disc.s))
        s, phi = disc.s[inside], disc.phi[inside]
        front, back = self.curves.core_front(s), self.curves.core_back(s)
        points = []
        first = base + columns
        for level in range(1, ns):
            e = level / ns
            side, straight = self.curves.core_side(np.array(e))
            meridian = (1 - e) * front + e * back + np.square(s / 4.0)[:, None] * (side - straight)
            points.append(_turn(meridian, phi))
            node[level, inside] = first + np.arange(len(s))
            node[level, disc.rim] = base + self.side_rings[level]
            first += len(s)
        return np.concatenate(points), node

    def build(self) -> Mesh:
        """The mesh in mm."""
        layers = _turn(self.curves.layer_points(self.s), self.phi)
        core_points, core_node = self._core_nodes()
        nodes = np.concatenate([layers.reshape(-1, 3), core_points])
        columns = len(self.s)
        hexes = []
        for level in range(sum(self.resolution.layers)):
            outer = self.quads + level * columns
            hexes.append(np.column_stack([outer + columns, outer]))
        for level in range(self.resolution.ns):
            upper = core_node[level][self.disc.quads]
            lower = core_node[level + 1][self.disc.quads]
            hexes.append(np.column_stack([lower, upper]))
        mesh = Mesh(nodes=nodes, cells={"hex8": np.concatenate(hexes).astype(np.int32)})
        mesh.tissues = list(TISSUES)
        mesh.tissue["hex8"] = self._tissues()
        self._add_sets(mesh)
        return mesh

    def _tissues(self) -> np.ndarray:
        """Tissue of every hex by its group of layers and the middle s of its column."""
        s = self.quad_s
        index = {name: k for k, name in enumerate(TISSUES)}
        ora = self.curves.profile.limbus + self.shape.ora_from_limbus
        before_ora = self.curves.length(s) < ora
        ciliary_ring = (s > 3.0) & (s < 3.5)

        def choose(*rules):
            names = [index[name] for _, name in rules[:-1]]
            return np.select([where for where, _ in rules[:-1]], names, index[rules[-1]])

        groups = [
            choose((s < 3.0, "cornea"), "sclera"),
            choose((s < 3.0, "aqueous"), (before_ora, "ciliary_body"), "retina"),
            choose((s < 3.0, "aqueous"), (ciliary_ring, "ciliary_body"), "vitreous"),
            choose((s < 1.0, "aqueous"), (s < 3.0, "iris"), (ciliary_ring, "ciliary_body"),
                   "vitreous"),
            choose((s < 3.0, "aqueous"), (ciliary_ring, "ciliary_body"), "vitreous"),
            choose((s < 2.0, "lens"), (s < 3.5, "zonule"), "vitreous"),
            np.full(len(s), index["vitreous"]),
        ]
        assert groups[LENS_GROUP][0] == index["lens"]
        tissue = [np.tile(groups[g], count) for g, count in enumerate(self.resolution.layers)]
        tissue.append(np.full(self.resolution.ns * len(self.disc.quads), index["vitreous"]))
        return np.concatenate(tissue).astype(np.int32)

    def _add_sets(self, mesh: Mesh) -> None:
        outer = mesh.nodes[: len(self.s)]
        mesh.face_sets["wet"] = self.quads.astype(np.int32)
        middle = outer[self.quads].mean(axis=1)
        near_nerve = np.hypot(middle[:, 0] - NERVE_X, middle[:, 1] - NERVE_Y) < NERVE_RADIUS
        nerve = self.quads[near_nerve & (middle[:, 2] < 0.0)]
        mesh.face_sets["nerve"] = nerve.astype(np.int32)
        posterior = outer[:, 2] < POSTERIOR_Z
        mesh.face_sets["posterior"] = self.quads[posterior[self.quads].all(axis=1)].astype(np.int32)
        sets = {
            "posterior": np.flatnonzero(posterior),
            "nerve": np.unique(nerve),
            "apex": np.array([int(np.argmin(self.s))]),
            "equator": self._equator(outer),
        }
        from_limbus = self.curves.length(self.quad_s) - self.curves.profile.limbus
        for name, (direction, distance, width) in RECTI.items():
            along = middle[:, 0] * direction[0] + middle[:, 1] * direction[1]
            across = middle[:, 0] * direction[1] - middle[:, 1] * direction[0]
            chosen = (from_limbus >= distance - 0.3) & (from_limbus <= distance + 2.2)
            chosen &= (along > 0.0) & (np.abs(across) < 0.5 * width)
            mesh.face_sets[name] = self.quads[chosen].astype(np.int32)
            sets[name] = np.unique(self.quads[chosen])
        mesh.node_sets = {name: nodes.astype(np.int32) for name, nodes in sets.items()}

    def _equator(self, outer: np.ndarray) -> np.ndarray:
        """Outer nodes of the ring nearest to z = 0."""
        heights = [abs(outer[ring, 2].mean()) for ring in self.side_rings]
        return np.sort(self.side_rings[int(np.argmin(heights))])


def make_globe(preset: str, shape: GlobeShape, translation_m: np.ndarray) -> Mesh:
    """The globe in m, its centre at `translation_m`."""
    mesh = GlobeBuilder(shape, PRESETS[preset]).build()
    mesh.nodes = mesh.nodes * MM + np.asarray(translation_m)
    return mesh
