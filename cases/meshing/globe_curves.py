"""Layer curves of the globe: eight meridians P_j(s) = (r, z) between which the hexes lie.

The column parameter s runs from the front axis to the back axis: 0 axis, 1 pupil edge, 2 lens edge,
3 chamber angle (limbus), 4 front corner of the core, 5 back corner, 6, 7, 8 mirror 3, 2, 1, 9 axis.
Between the curves stand the wall, two groups behind it, iris, posterior chamber, lens and vitreous,
so that every anatomical surface lies on cell faces. Lengths in mm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from meshing.globe_profile import GlobeShape, OuterProfile, sag


@dataclass(frozen=True)
class Resolution:
    """Cell counts. Disc: square n x n, rings n1..n4 of 4n cells; ns along the core's axis.
    Layers: wall nw, behind it m1 and m2, iris ni, posterior chamber npc, lens nl, vitreous nv.
    square: half diagonal of the disc's square in units of the pupil ring."""

    n: int
    rings: tuple[int, int, int, int]
    ns: int
    nw: int
    m1: int
    m2: int
    ni: int
    npc: int
    nl: int
    nv: int
    square: float

    @property
    def layers(self) -> tuple[int, ...]:
        return (self.nw, self.m1, self.m2, self.ni, self.npc, self.nl, self.nv)


# The even last ring count puts a mesh line at s = 3.5, the inner border of the ciliary body.
PRESETS = {
    "coarse": Resolution(8, (1, 2, 1, 2), 7, 2, 1, 2, 1, 1, 3, 1, 0.78),
    "medium": Resolution(14, (2, 4, 2, 4), 13, 3, 2, 3, 2, 1, 6, 4, 0.85),
    "fine": Resolution(24, (2, 8, 4, 6), 28, 4, 3, 6, 3, 2, 12, 8, 0.85),
}
LENS_GROUP = 5
CORE_FRONT = np.array([(0.0, 3.55), (2.05, 3.50), (3.75, 3.40), (4.55, 3.30), (5.35, 3.05)])
CORE_BACK = np.array([(0.0, -4.90), (2.35, -4.80), (4.10, -4.60), (4.90, -4.45), (5.75, -4.15)])
CORE_SIDE_R = 6.35
# Distances from the inner side of the wall at s = 4 to the curves A, B, L1, L2.
CORNER_DEPTHS = (1.20, 1.62, 2.17, 3.72)
KNOTS = (0.0, 1.0, 2.0, 3.0, 3.5, 4.0)


def smoothstep(x: np.ndarray) -> np.ndarray:
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


class LayerCurves:
    """Points of the layers at any column parameter."""

    def __init__(self, shape: GlobeShape, resolution: Resolution) -> None:
        self.shape, self.resolution = shape, resolution
        self.profile = OuterProfile(shape)
        self._length = self._make_length()
        self._core_front = PchipInterpolator(range(5), CORE_FRONT)
        self._core_back = PchipInterpolator(range(5), CORE_BACK)
        self._inner = [PchipInterpolator(KNOTS, points) for points in self._front_points()]
        self._corner_fractions, self._back_fractions = self._make_fractions()

    def _make_length(self) -> PchipInterpolator:
        outer = self.profile
        behind = outer.length_at_angle(np.radians(128.0))
        h = outer.pole - behind
        return PchipInterpolator(
            range(10),
            [
                0.0,
                outer.length_at_r(2.35),
                outer.length_at_r(4.85),
                outer.limbus + 0.05,
                outer.length_at_angle(np.radians(49.0)),
                behind,
                *(outer.pole - f * h for f in (0.80, 0.66, 0.36, 0.0)),
            ],
        )

    def length(self, s: np.ndarray) -> np.ndarray:
        """Arc length on the outer surface of the column s."""
        return self._length(s)

    def _wall(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        length = self.length(s)
        outside = self.profile.point(length)
        inward = self.profile.thickness(length)[..., None] * self.profile.normal(length)
        return outside, outside - inward

    @property
    def lens_front_z(self) -> float:
        return self.profile.apex_z - self.shape.cornea_thickness - self.shape.chamber_depth

    def lens_front(self, r):
        shape = self.shape
        return self.lens_front_z - sag(r, shape.lens_front_radius, shape.lens_front_asphericity)

    def lens_back(self, r):
        shape = self.shape
        rise = sag(r, shape.lens_back_radius, shape.lens_back_asphericity)
        return self.lens_front_z - shape.lens_thickness + rise

    def _front_points(self) -> list[np.ndarray]:
        """Knots of iris front A, iris back B, lens front L1, lens back L2 for s <= 4."""
        edge = self.shape.lens_edge_r
        z, e1, e2 = self.lens_front_z, float(self.lens_front(edge)), float(self.lens_back(edge))
        _, wall = self._wall(np.array(4.0))
        corner = self._core_front(4.0)
        towards = (corner - wall) / np.linalg.norm(corner - wall)
        at_corner = [tuple(wall + depth * towards) for depth in CORNER_DEPTHS]
        first = float(self.lens_front(2.0))
        tables = [
            [(0, z + 0.70), (2.10, first + 0.70), (edge + 0.05, e1 + 0.97), (5.28, e1 + 0.72),
             (6.45, e1 - 0.25)],
            [(0, z + 0.30), (2.05, first + 0.30), (edge + 0.03, e1 + 0.55), (5.36, e1 + 0.30),
             (6.33, e1 - 0.62)],
            [(0, z), (2.0, first), (edge, e1), (5.48, e1 - 0.25), (6.20, e1 - 1.13)],
            [(0, z - self.shape.lens_thickness), (2.0, float(self.lens_back(2.0))), (edge, e2),
             (5.38, e2 - 0.42), (5.85, e2 - 1.22)],
        ]
        return [np.array([*table, at_corner[j]]) for j, table in enumerate(tables)]

    def _make_fractions(self) -> tuple[np.ndarray, np.ndarray]:
        """Where W2, A, B, L1, L2 lie on the way from the wall to the core: at s = 4, and behind."""
        _, wall = self._wall(np.array([4.0, 9.0]))
        at_corner = np.array([self.shape.retina_thickness, *CORNER_DEPTHS])
        at_corner = at_corner / np.linalg.norm(wall[0] - self._core_front(4.0))
        retina = self.shape.retina_thickness / np.linalg.norm(wall[1] - self._core_back(0.0))
        counts = np.array(self.resolution.layers[2:], dtype=float)
        shares = np.concatenate([[0.0], np.cumsum(counts)[:-1]]) / counts.sum()
        return at_corner, retina + (1.0 - retina) * shares

    def core_front(self, s):
        return self._core_front(s)

    def core_back(self, t):
        """The core's back face at t = 9 - s."""
        return self._core_back(t)

    def core_side(self, e):
        """The core's side at e = s - 4, and the straight line between its corners."""
        e = np.asarray(e)[..., None]
        straight = (1.0 - e) * CORE_FRONT[-1] + e * CORE_BACK[-1]
        bulge = 4.0 * e * (1.0 - e) * (CORE_SIDE_R - 0.5 * (CORE_FRONT[-1, 0] + CORE_BACK[-1, 0]))
        return straight + bulge * np.array([1.0, 0.0]), straight

    def _core(self, s: np.ndarray) -> np.ndarray:
        front = self._core_front(np.clip(s, 0.0, 4.0))
        side, _ = self.core_side(np.clip(s - 4.0, 0.0, 1.0))
        back = self._core_back(np.clip(9.0 - s, 0.0, 4.0))
        s = s[..., None]
        return np.where(s <= 4.0, front, np.where(s >= 5.0, back, side))

    def _front_curves(self, s: np.ndarray, wall: np.ndarray) -> list[np.ndarray]:
        """W2, A, B, L1, L2 for s <= 4."""
        inner = [curve(s) for curve in self._inner]
        on_lens = s <= 2.0
        inner[2][on_lens, 1] = self.lens_front(inner[2][on_lens, 0])
        inner[3][on_lens, 1] = self.lens_back(inner[3][on_lens, 0])
        gap = inner[0] - wall
        k = smoothstep(s - 3.0)
        m1, m2 = self.resolution.m1, self.resolution.m2
        share = (1.0 - k) * m1 / (m1 + m2)
        share += k * self.shape.retina_thickness / np.linalg.norm(gap, axis=-1)
        return [wall + share[:, None] * gap, *inner]

    def curves(self, s: np.ndarray) -> np.ndarray:
        """The eight curves at the column parameters s [m]: [8, m, 2], from outside in."""
        s = np.asarray(s, dtype=float)
        outside, wall = self._wall(s)
        core = self._core(s)
        k = smoothstep(s - 4.0)[:, None]
        result = np.empty((8, len(s), 2))
        result[0], result[1], result[7] = outside, wall, core
        behind = s > 4.0
        for j in range(5):
            share = (1.0 - k) * self._corner_fractions[j] + k * self._back_fractions[j]
            result[2 + j] = wall + share * (core - wall)
        if not behind.all():
            front = ~behind
            for j, points in enumerate(self._front_curves(s[front], wall[front])):
                result[2 + j][front] = points
        return result

    def layer_points(self, s: np.ndarray) -> np.ndarray:
        """Points [levels, m, 2] of all layers, level 0 outside, the last one on the core."""
        s = np.asarray(s, dtype=float)
        curves = self.curves(s)
        levels = [curves[0]]
        # The bulge of the lens's edge fades on both sides of s = 2.
        bulge = 4.0 * self.shape.lens_edge_bulge
        bulge = bulge * np.exp(-np.square((s - 2.0) / 0.6)) * np.minimum(s, 1.0)
        for group, count in enumerate(self.resolution.layers):
            for step in range(1, count + 1):
                u = step / count
                points = (1.0 - u) * curves[group] + u * curves[group + 1]
                if group == LENS_GROUP:
                    points[:, 0] += bulge * u * (1.0 - u)
                levels.append(points)
        return np.stack(levels)
