"""Round surfaces: sphere, bowl, cylinder and trough, which differ in side and axis only."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from evifuse.simulation.surface import Points, Sites, Surface, Triple

__all__ = ["Bowl", "Cylinder", "Sphere", "Trough"]


@dataclass(frozen=True)
class _Round(Surface):
    """Part of a sphere, or of a cylinder along x, seen from outside (``side = 1``) or from inside (-1)."""

    radius_m: float = 0.03
    axes: ClassVar[Points]
    side: ClassVar[int]
    reach: ClassVar[float] = 1.0  # how far from the axis the surface goes, over the radius

    def _from_centre(self, points: Points) -> tuple[Points, NDArray[np.float64]]:
        """Directions away from the centre or the axis, and the distances from it.

        A hollow has a lower half only: what is above it sees the rim, and on the axis the bottom.
        """
        offset = (points + np.array([0.0, 0.0, self.side * self.radius_m])) * self.axes
        if self.side < 0:
            offset[:, 2] = np.minimum(offset[:, 2], 0.0)
            offset[np.hypot(offset[:, 1], offset[:, 2]) + np.abs(offset[:, 0]) == 0.0, 2] = -1e-9
        distance = np.sqrt(np.einsum("ij,ij->i", offset, offset))[:, None]
        return offset / distance, distance

    def _nearest(self, points: Points) -> tuple[Points, Points]:
        """Along the radius."""
        outward, distance = self._from_centre(points)
        return points + (self.radius_m - distance) * outward, self.side * outward

    def nearest_one(self, x: float, y: float, z: float) -> tuple[Triple, Triple]:
        """Nearest point of one point, in plain floats."""
        u = x if self.axes[0] else 0.0
        w = z + self.side * self.radius_m
        if self.side < 0 and w > 0.0:
            w = 0.0 if u or y else -1e-9
        distance = math.sqrt(u * u + y * y + w * w)
        u, v, w = u / distance, y / distance, w / distance
        to_go = self.radius_m - distance
        normal = (self.side * u, self.side * v, self.side * w)
        return (x + to_go * u, y + to_go * v, z + to_go * w), normal

    def _above(self, x: float, y: float) -> Points | None:
        across = np.hypot(*(np.array([x, y]) * self.axes[:2]))
        if across >= self.reach * self.radius_m or abs(x) > getattr(self, "length_m", np.inf) / 2:
            return None
        return np.array([x, y, self.side * (np.sqrt(self.radius_m**2 - across**2) - self.radius_m)])

    def _curvature_tensor(self, point: Points) -> Points:
        """Minus or plus 1/R across the axis."""
        outward = self._from_centre(point[None])[0][0]
        return -self.side / self.radius_m * (np.diag(self.axes) - np.outer(outward, outward))


@dataclass(frozen=True)
class Sphere(_Round):
    """A ball on the table.

    Parameters
    ----------
    radius_m : float
        Radius, metres.
    """

    name: ClassVar[str] = "sphere"
    category: ClassVar[str] = "curved"
    axes: ClassVar[Points] = np.array([1.0, 1.0, 1.0])
    side: ClassVar[int] = 1

    @property
    def sites(self) -> Sites:
        """Left and right of the apex, a quarter of the radius but at most 15 mm away."""
        aside = min(self.radius_m / 4, 0.015)
        return ((-aside, 0.0), (aside, 0.0))


@dataclass(frozen=True)
class Bowl(_Round):
    """The inside of a round bowl.

    Parameters
    ----------
    radius_m : float
        Radius of the inner sphere, metres; larger than the fingertip's.
    """

    radius_m: float = 0.04
    name: ClassVar[str] = "bowl"
    category: ClassVar[str] = "curved"
    axes: ClassVar[Points] = np.array([1.0, 1.0, 1.0])
    side: ClassVar[int] = -1
    reach: ClassVar[float] = 0.9

    @property
    def sites(self) -> Sites:
        """Left and right of the lowest point, a quarter of the radius but at most 15 mm away."""
        aside = min(self.radius_m / 4, 0.015)
        return ((-aside, 0.0), (aside, 0.0))


@dataclass(frozen=True)
class Cylinder(_Round):
    """A cylinder that lies along x.

    Parameters
    ----------
    radius_m, length_m : float
        Radius and length, metres.
    """

    length_m: float = 0.09
    name: ClassVar[str] = "cylinder"
    category: ClassVar[str] = "curved"
    axes: ClassVar[Points] = np.array([0.0, 1.0, 1.0])
    side: ClassVar[int] = 1

    @property
    def sites(self) -> Sites:
        """Left and right of the middle of the top line."""
        return ((-self.length_m / 6, 0.0), (self.length_m / 6, 0.0))


@dataclass(frozen=True)
class Trough(_Round):
    """A round groove along x in a block.

    Parameters
    ----------
    radius_m, length_m : float
        Radius and length of the groove, metres; the radius is larger than the fingertip's.
    """

    radius_m: float = 0.04
    length_m: float = 0.09
    name: ClassVar[str] = "trough"
    category: ClassVar[str] = "curved"
    axes: ClassVar[Points] = np.array([0.0, 1.0, 1.0])
    side: ClassVar[int] = -1
    reach: ClassVar[float] = 0.75

    @property
    def sites(self) -> Sites:
        """Left and right of the middle of the bottom line."""
        return ((-self.length_m / 6, 0.0), (self.length_m / 6, 0.0))
