"""Flat surfaces: the plane, and the plates with a hole and a slot."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from evifuse.simulation.surface import Points, Sites, Surface

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
        return ((-self.radius_m - 0.015, 0.0), (0.0, 0.0))

    def _axis(self, points: Points) -> Points:
        """Nearest points (x, y) of the middle of the opening."""
        return np.zeros_like(points[:, :2])

    def _nearest(self, points: Points) -> tuple[Points, Points]:
        """The plate, or the rim for points over the opening."""
        middle = self._axis(points)
        beside = points[:, :2] - middle
        across = np.hypot(beside[:, 0], beside[:, 1])[:, None]
        along = beside / np.maximum(across, 1e-12)
        rim = np.hstack([middle + along * self.radius_m, np.zeros_like(across)])
        away = points - rim
        away = away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-12)
        over = across < self.radius_m
        return np.where(over, rim, points * [1.0, 1.0, 0.0]), np.where(over, away, [0.0, 0.0, 1.0])

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
        return ((0.0, -self.radius_m - 0.015), (0.0, 0.0))

    def _axis(self, points: Points) -> Points:
        """Nearest points (x, y) of the slot's middle line."""
        return np.stack(
            [np.clip(points[:, 0], -self.opening_m / 2, self.opening_m / 2), np.zeros(len(points))], axis=-1
        )
