"""The saddle, whose nearest points take Newton's method."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from evifuse.simulation.surface import Points, Sites, Surface, Triple

__all__ = ["Saddle"]


@dataclass(frozen=True)
class Saddle(Surface):
    """A saddle ``z = (x^2 / R - y^2 / R) / 2``.

    Parameters
    ----------
    radius_m : float
        Radius of curvature at the middle, up along x and down along y, metres.
    length_m : float
        Side of the square patch, metres.
    """

    radius_m: float = 0.03
    length_m: float = 0.05
    name: ClassVar[str] = "saddle"
    category: ClassVar[str] = "curved"

    @property
    def sites(self) -> Sites:
        """The middle, and a place a tenth of the radius beside it."""
        return ((0.0, 0.0), (self.radius_m / 10, self.radius_m / 10))

    @property
    def _k(self) -> NDArray[np.float64]:
        return np.array([1.0, -1.0]) / self.radius_m

    def _nearest(self, points: Points) -> tuple[Points, Points]:
        """Newton's method on the two coordinates of the foot point."""
        k = self._k
        foot = points[:, :2].copy()
        for _ in range(8):  # quadratic: below 1e-7 m one more step leaves rounding only
            gap = points[:, 2:] - 0.5 * np.sum(k * foot**2, axis=1, keepdims=True)
            slope = k * foot
            residual = points[:, :2] - foot + gap * slope
            diagonal = 1.0 - gap * k + slope**2
            cross = slope[:, 0] * slope[:, 1]
            determinant = diagonal[:, 0] * diagonal[:, 1] - cross**2
            foot += (diagonal[:, ::-1] * residual - cross[:, None] * residual[:, ::-1]) / determinant[:, None]
            if np.abs(residual).max() < 1e-7:
                break
        height = 0.5 * np.sum(k * foot**2, axis=1, keepdims=True)
        normals = np.hstack([-k * foot, np.ones_like(height)])
        return np.hstack([foot, height]), normals / np.linalg.norm(normals, axis=1, keepdims=True)

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
        k = 1.0 / self.radius_m
        u, v = x, y
        for _ in range(8):
            gap = z - 0.5 * k * (u * u - v * v)
            p, q = k * u, -k * v
            r, s = x - u + gap * p, y - v + gap * q
            a, b, c = 1.0 - gap * k + p * p, p * q, 1.0 + gap * k + q * q
            determinant = a * c - b * b
            u, v = u + (c * r - b * s) / determinant, v + (a * s - b * r) / determinant
            if abs(r) + abs(s) < 1e-7:
                break
        p, q = -k * u, k * v
        length = math.sqrt(p * p + q * q + 1.0)
        return (u, v, 0.5 * k * (u * u - v * v)), (p / length, q / length, 1.0 / length)

    def _above(self, x: float, y: float) -> Points | None:
        inside = max(abs(x), abs(y)) <= self.length_m / 2
        return np.array([x, y, 0.5 * (x * x - y * y) / self.radius_m]) if inside else None

    def _curvature_tensor(self, point: Points) -> Points:
        """Hessian of the height over the slope factor, projected."""
        gradient = np.append(-self._k * point[:2], 1.0)
        length = np.linalg.norm(gradient)
        project = np.eye(3) - np.outer(gradient, gradient) / length**2
        return project @ np.diag([*self._k, 0.0]) @ project / length
