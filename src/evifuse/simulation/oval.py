"""Surfaces whose two curvatures differ and change from place to place: ellipsoid and torus."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from evifuse.simulation.surface import Points, Sites, Surface, Triple

__all__ = ["Ellipsoid", "Torus"]


@dataclass(frozen=True)
class Ellipsoid(Surface):
    """An ellipsoid on the table.

    Parameters
    ----------
    length_m, width_m, height_m : float
        Semi-axes along x, y and z, metres.
    """

    length_m: float = 0.045
    width_m: float = 0.03
    height_m: float = 0.03
    name: ClassVar[str] = "ellipsoid"
    category: ClassVar[str] = "curved"

    @property
    def sites(self) -> Sites:
        """Left and right of the apex, a quarter of the semi-axis but at most 15 mm away."""
        aside = min(self.length_m / 4, 0.015)
        return ((-aside, 0.0), (aside, 0.0))

    @property
    def _axes(self) -> NDArray[np.float64]:
        return np.array([self.length_m, self.width_m, self.height_m])

    def _nearest(self, points: Points) -> tuple[Points, Points]:
        """Newton's method on the one unknown t of ``foot = e^2 x / (t + e^2)``.

        The sum of squares that has to be 1 falls and is convex in t, so Newton's method from below never
        overshoots.
        """
        axes = self._axes
        offset = points + np.array([0.0, 0.0, self.height_m])
        t = np.max(axes * np.abs(offset) - axes**2, axis=1)
        t = np.maximum(t, -(np.min(axes) ** 2) * (1 - 1e-9))
        for _ in range(60):
            scaled = np.square(axes * offset / (t[:, None] + axes**2))
            step = (scaled.sum(axis=1) - 1) / (2 * (scaled / (t[:, None] + axes**2)).sum(axis=1))
            t += step
            if np.abs(step).max() < 1e-15:
                break
        foot = axes**2 * offset / (t[:, None] + axes**2)
        normals = foot / axes**2
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        return foot - [0.0, 0.0, self.height_m], normals

    def nearest_one(self, x: float, y: float, z: float) -> tuple[Triple, Triple]:
        """Nearest point of one point, in plain floats.

        Parameters
        ----------
        x, y, z : float
            A point near the surface, world frame, metres.

        Returns
        -------
        nearest : tuple of float
            The nearest point, metres.
        normal : tuple of float
            The unit normal there.
        """
        a, b, c = self.length_m, self.width_m, self.height_m
        z += c
        aa, bb, cc = a * a, b * b, c * c
        t = max(a * abs(x) - aa, b * abs(y) - bb, c * abs(z) - cc, -min(aa, bb, cc) * (1 - 1e-9))
        for _ in range(60):
            p, q, r = (a * x / (t + aa)) ** 2, (b * y / (t + bb)) ** 2, (c * z / (t + cc)) ** 2
            step = (p + q + r - 1) / (2 * (p / (t + aa) + q / (t + bb) + r / (t + cc)))
            t += step
            if abs(step) < 1e-15:
                break
        u, v, w = x / (t + aa), y / (t + bb), z / (t + cc)
        length = math.sqrt(u * u + v * v + w * w)
        return (aa * u, bb * v, cc * w - c), (u / length, v / length, w / length)

    def _above(self, x: float, y: float) -> Points | None:
        rest = 1 - (x / self.length_m) ** 2 - (y / self.width_m) ** 2
        return np.array([x, y, self.height_m * (np.sqrt(rest) - 1)]) if rest > 0 else None

    def _curvature_tensor(self, point: Points) -> Points:
        """Hessian of the quadratic form over the length of its gradient, projected."""
        gradient = (point + np.array([0.0, 0.0, self.height_m])) / self._axes**2
        length = np.linalg.norm(gradient)
        project = np.eye(3) - np.outer(gradient, gradient) / length**2
        return -project @ np.diag(1 / self._axes**2) @ project / length


@dataclass(frozen=True)
class Torus(Surface):
    """A ring that lies on the table: a dome outside of its top circle, a saddle inside.

    Parameters
    ----------
    radius_m : float
        Radius of the circle in the middle of the tube, metres.
    tube_m : float
        Radius of the tube, metres.
    """

    radius_m: float = 0.04
    tube_m: float = 0.02
    name: ClassVar[str] = "torus"
    category: ClassVar[str] = "curved"

    @property
    def sites(self) -> Sites:
        """Outside of the top circle, and inside on the other side, each half a tube radius from it."""
        return ((-self.radius_m - self.tube_m / 2, 0.0), (self.radius_m - self.tube_m / 2, 0.0))

    def _from_ring(self, points: Points) -> tuple[Points, Points]:
        """Offsets from the nearest points of the middle circle, and directions away from the axis."""
        across = np.maximum(np.hypot(points[:, 0], points[:, 1]), 1e-12)[:, None]
        outward = points * [1.0, 1.0, 0.0] / across
        return points + np.array([0.0, 0.0, self.tube_m]) - self.radius_m * outward, outward

    def _nearest(self, points: Points) -> tuple[Points, Points]:
        """Along the radius of the tube."""
        offset, _ = self._from_ring(points)
        length = np.linalg.norm(offset, axis=1, keepdims=True)
        normals = offset / length
        return points + (self.tube_m - length) * normals, normals

    def nearest_one(self, x: float, y: float, z: float) -> tuple[Triple, Triple]:
        """Nearest point of one point, in plain floats.

        Parameters
        ----------
        x, y, z : float
            A point near the surface, world frame, metres.

        Returns
        -------
        nearest : tuple of float
            The nearest point, metres.
        normal : tuple of float
            The unit normal there.
        """
        across = max(math.hypot(x, y), 1e-12)
        share = 1.0 - self.radius_m / across
        u, v, w = x * share, y * share, z + self.tube_m
        length = math.sqrt(u * u + v * v + w * w)
        u, v, w = u / length, v / length, w / length
        to_go = self.tube_m - length
        return (x + to_go * u, y + to_go * v, z + to_go * w), (u, v, w)

    def _above(self, x: float, y: float) -> Points | None:
        beside = np.hypot(x, y) - self.radius_m
        if abs(beside) >= self.tube_m:
            return None
        return np.array([x, y, np.sqrt(self.tube_m**2 - beside**2) - self.tube_m])

    def _curvature_tensor(self, point: Points) -> Points:
        """Minus 1/tube across the tube; along it, what the axis sees of the normal over the distance."""
        offset, outward = self._from_ring(point[None])
        normal, out = offset[0] / np.linalg.norm(offset[0]), outward[0]
        along = np.cross([0.0, 0.0, 1.0], out)
        across = np.cross(along, normal)
        bend = float(normal @ out) / np.hypot(point[0], point[1])
        return -np.outer(across, across) / self.tube_m - bend * np.outer(along, along)
