"""Flat surfaces: the plane, and the plates with a hole and a slot."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from evifuse.simulation.surface import Points, Sites, Surface, Triple

__all__ = ["Hole", "Plane", "Slot"]


@dataclass(frozen=True)
class Plane(Surface):
    """The top of a plate.

    Parameters
    ----------
    length_m, width_m, height_m : float
        Size along x, y and z, metres.
    """

    length_m: float = 0.09
    width_m: float = 0.06
    height_m: float = 0.006
    name: ClassVar[str] = "plane"
    category: ClassVar[str] = "quasiplanar"

    @property
    def sites(self) -> Sites:
        """Left and right of the middle."""
        return ((-self.length_m / 6, 0.0), (self.length_m / 6, 0.0))

    def _nearest(self, points: Points) -> tuple[Points, Points]:
        """Foot of the perpendicular."""
        return points * [1.0, 1.0, 0.0], np.broadcast_to([0.0, 0.0, 1.0], points.shape)

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
        return (x, y, 0.0), (0.0, 0.0, 1.0)

    def _above(self, x: float, y: float) -> Points | None:
        inside = abs(x) <= self.length_m / 2 and abs(y) <= self.width_m / 2
        return np.array([x, y, 0.0]) if inside else None

    def _curvature_tensor(self, point: Points) -> Points:
        """Zero."""
        return np.zeros((3, 3))


@dataclass(frozen=True)
class Hole(Surface):
    """A large plate with a round hole that the fingertip passes through.

    Parameters
    ----------
    radius_m : float
        Radius of the hole, metres; larger than the fingertip's.
    length_m : float
        Side of the square plate, metres.
    height_m : float
        Thickness of the plate, metres.
    """

    radius_m: float = 0.02
    length_m: float = 0.5
    height_m: float = 0.004
    name: ClassVar[str] = "hole"
    category: ClassVar[str] = "occluded"

    @property
    def sites(self) -> Sites:
        """On the plate beside the hole, then over the hole."""
        return ((-self.radius_m - max(0.015, 0.75 * self.radius_m), 0.0), (0.0, 0.0))

    @property
    def _half_m(self) -> float:
        """Half of the length of the opening's middle line: a round one has a point in its middle."""
        return 0.0

    def _axis(self, points: Points) -> Points:
        """Nearest points (x, y) of the opening's middle line, along x."""
        along = np.clip(points[:, 0], -self._half_m, self._half_m)
        return np.stack([along, np.zeros_like(along)], axis=-1)

    def _nearest(self, points: Points) -> tuple[Points, Points]:
        """The plate, or the rim for points over the opening."""
        middle = self._axis(points)
        beside = points[:, :2] - middle
        across = np.hypot(beside[:, 0], beside[:, 1])
        nearest, normals = points * [1.0, 1.0, 0.0], np.zeros_like(points)
        normals[:, 2] = 1.0
        over = np.flatnonzero(across < self.radius_m)
        if len(over):
            # in the very middle the whole rim is as near: take one point of it
            far = across[over, None] > 1e-9
            along = np.where(far, beside[over] / np.maximum(across[over, None], 1e-9), [0.0, 1.0])
            nearest[over, :2] = middle[over] + along * self.radius_m
            away = points[over] - nearest[over]
            normals[over] = away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-12)
        return nearest, normals

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
        middle = min(max(x, -self._half_m), self._half_m)
        across = math.hypot(x - middle, y)
        if across >= self.radius_m:
            return (x, y, 0.0), (0.0, 0.0, 1.0)
        u, v = ((x - middle) / across, y / across) if across > 1e-9 else (0.0, 1.0)
        u, v = middle + u * self.radius_m, v * self.radius_m
        size = max(math.sqrt((x - u) ** 2 + (y - v) ** 2 + z * z), 1e-12)
        return (u, v, 0.0), ((x - u) / size, (y - v) / size, z / size)

    def _above(self, x: float, y: float) -> Points | None:
        beside = np.array([x, y]) - self._axis(np.array([[x, y, 0.0]]))[0]
        solid = np.hypot(*beside) >= self.radius_m and max(abs(x), abs(y)) <= self.length_m / 2
        return np.array([x, y, 0.0]) if solid else None

    def _curvature_tensor(self, point: Points) -> Points:
        """Zero, on the plate."""
        return np.zeros((3, 3))


@dataclass(frozen=True)
class Slot(Hole):
    """A large plate with a slot along x that the fingertip passes through; its ends are round.

    Parameters
    ----------
    radius_m : float
        Half of the slot's width, metres; larger than the fingertip's radius.
    length_m : float
        Side of the square plate, metres.
    height_m : float
        Thickness of the plate, metres.
    opening_m : float
        Length of the slot between the middles of its round ends, metres.
    """

    opening_m: float = 0.06
    name: ClassVar[str] = "slot"
    category: ClassVar[str] = "occluded"

    @property
    def sites(self) -> Sites:
        """On the plate beside the slot, then over it."""
        return ((0.0, -self.radius_m - max(0.015, 0.75 * self.radius_m)), (0.0, 0.0))

    @property
    def _half_m(self) -> float:
        """Half of the length of the slot's middle line."""
        return self.opening_m / 2
