"""Outer meridian of the globe by arc length: aspheric cornea, smooth limbus, scleral spheroid.

Lengths in mm, globe frame: z forward from the spheroid's centre. Sources of the dimensions:
cases/eye_pyrodex/README.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator


@dataclass(frozen=True)
class GlobeShape:
    """Dimensions of the globe in mm. Control lengths of the inside do not scale with the globe:
    equator or pole radii more than 0.5 mm away from these give poor cells (check the mesh)."""

    equator_radius: float = 12.0
    pole_radius: float = 11.9
    cornea_radius: float = 7.8
    cornea_asphericity: float = -0.2
    limbus_r: float = 5.8  # where the cornea's and the spheroid's curves would meet
    blend_r: tuple[float, float] = (5.2, 6.4)
    cornea_thickness: float = 0.54
    chamber_depth: float = 3.05  # endothelium to lens
    lens_thickness: float = 4.0
    lens_front_radius: float = 10.2
    lens_front_asphericity: float = -3.13
    lens_back_radius: float = 6.0
    lens_back_asphericity: float = -1.0
    lens_edge_r: float = 4.45
    lens_edge_bulge: float = 0.15
    retina_thickness: float = 0.45  # choroid and retina, one group of layers
    ora_from_limbus: float = 7.0  # ora serrata, along the wall
    wall_thickness_min: float = 0.0  # thickens the thin sclera: a longer stable step for quick runs


def sag(r: np.ndarray, radius: float, asphericity: float) -> np.ndarray:
    """Depth of a conic surface at distance r from its axis."""
    root = np.sqrt(1.0 - (1.0 + asphericity) * np.square(r) / radius**2)
    return np.square(r) / (radius * (1.0 + root))


class OuterProfile:
    """The outer meridian (r, z) and its outward normal as functions of arc length from the apex."""

    def __init__(self, shape: GlobeShape) -> None:
        self.shape = shape
        a, b = shape.equator_radius, shape.pole_radius
        junction = b * np.sqrt(1.0 - (shape.limbus_r / a) ** 2)
        self.apex_z = float(junction + self._cornea_sag(shape.limbus_r))
        begin, end = shape.blend_r
        z_end = b * np.sqrt(1.0 - (end / a) ** 2)
        slope = [self._cornea_slope(begin), -(b**2) * end / (a**2 * z_end)]
        values = [self.apex_z - self._cornea_sag(begin), z_end]
        self._blend = CubicHermiteSpline([begin, end], values, slope)
        self._blend_slope = self._blend.derivative()
        self._theta_end = float(np.arcsin(end / a))
        # The parameter q is r up to the end of the blend, then r_end + theta - theta_end. Its relation
        # to arc length is tabulated; linear interpolation errs by (spacing)^2, below 1e-7 mm here.
        self._q = np.concatenate(
            [np.linspace(0.0, end, 8001), end + np.linspace(0.0, np.pi - self._theta_end, 24001)[1:]]
        )
        r, z = self._point(self._q)
        steps = np.hypot(np.diff(r), np.diff(z))
        self._length = np.concatenate([[0.0], np.cumsum(steps)])
        self.pole = float(self._length[-1])
        self.limbus = self.length_at_r(shape.limbus_r)
        self.equator = self.length_at_angle(0.5 * np.pi)
        self._thickness = self._make_thickness()

    def _cornea_sag(self, r):
        return sag(r, self.shape.cornea_radius, self.shape.cornea_asphericity)

    def _cornea_slope(self, r):
        """dz/dr of the conic: -r / (R sqrt(1 - (1 + Q) r^2/R^2))."""
        radius, q = self.shape.cornea_radius, self.shape.cornea_asphericity
        return -r / (radius * np.sqrt(1.0 - (1.0 + q) * np.square(r) / radius**2))

    def _theta(self, q):
        return q - self.shape.blend_r[1] + self._theta_end

    def _point(self, q):
        begin, end = self.shape.blend_r
        theta = self._theta(q)
        r = np.where(q <= end, q, self.shape.equator_radius * np.sin(theta))
        front = np.clip(q, 0.0, begin)
        z = np.where(
            q <= begin,
            self.apex_z - self._cornea_sag(front),
            np.where(
                q <= end,
                self._blend(np.clip(q, begin, end)),
                self.shape.pole_radius * np.cos(theta),
            ),
        )
        return r, z

    def length_at_r(self, r: float) -> float:
        """Arc length of the front point at distance r from the axis (r up to the blend's end)."""
        return float(np.interp(r, self._q, self._length))

    def length_at_angle(self, polar: float) -> float:
        """Arc length of the spheroid point seen from the centre at `polar` from the front axis."""
        a, b = self.shape.equator_radius, self.shape.pole_radius
        theta = np.arctan2(b * np.sin(polar), a * np.cos(polar))
        q = self.shape.blend_r[1] + theta - self._theta_end
        return float(np.interp(q, self._q, self._length))

    def point(self, length: np.ndarray) -> np.ndarray:
        """Points [..., 2] as (r, z) at the given arc lengths."""
        r, z = self._point(np.interp(length, self._length, self._q))
        return np.stack([r, z], axis=-1)

    def normal(self, length: np.ndarray) -> np.ndarray:
        """Outward unit normals [..., 2] as (r, z)."""
        q = np.interp(length, self._length, self._q)
        begin, end = self.shape.blend_r
        theta = self._theta(q)
        slope = np.where(
            q <= begin,
            self._cornea_slope(np.clip(q, 0.0, begin)),
            self._blend_slope(np.clip(q, begin, end)),
        )
        front = q <= end
        n_r = np.where(front, -slope, np.sin(theta) / self.shape.equator_radius)
        n_z = np.where(front, 1.0, np.cos(theta) / self.shape.pole_radius)
        return np.stack([n_r, n_z], axis=-1) / np.hypot(n_r, n_z)[..., None]

    def _make_thickness(self) -> PchipInterpolator:
        """Thickness of the wall over arc length, mirrored at both poles to stay smooth there."""
        back = 0.5 * (self.equator + self.pole)
        knots = [
            (0.0, self.shape.cornea_thickness),
            (self.length_at_r(3.0), 0.59),
            (self.length_at_r(5.0), 0.67),
            (self.limbus, 0.62),
            (self.limbus + 2.5, 0.52),
            (self.limbus + self.shape.ora_from_limbus, 0.43),
            (self.equator, 0.42),
            (back, 0.65),
            (self.pole, 0.94),
        ]
        mirrored = [(-x, t) for x, t in reversed(knots[1:3])]
        mirrored += [*knots, (2.0 * self.pole - back, 0.65)]
        return PchipInterpolator(*np.array(mirrored).T)

    def thickness(self, length: np.ndarray) -> np.ndarray:
        """Thickness of cornea and sclera, measured along the normal."""
        return np.maximum(self._thickness(length), self.shape.wall_thickness_min)
