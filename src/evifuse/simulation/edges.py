"""Surfaces with edges: two planes that meet, a step, and the corner of a block.

An edge is never quite sharp: it is rounded by ``radius_m``, and where that is smaller than a fingertip's
radius no fingertip can tell the rounding from a sharp edge.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from evifuse.simulation.surface import Points, Sites, Surface, Triple

__all__ = ["Corner", "Edge", "Step"]

_TILT = np.arctan2(np.sqrt(2.0), 1.0)
_ROUND = np.deg2rad([90.0, 210.0, 330.0])
_FACES = np.stack([np.sin(_TILT) * np.cos(_ROUND), np.sin(_TILT) * np.sin(_ROUND), np.full(3, np.cos(_TILT))])
"""Columns: outward normals of the three faces that meet in the corner of a block that stands on its tip."""
_FACE_ROWS: list[list[float]] = _FACES.T.tolist()


@dataclass(frozen=True)
class Edge(Surface):
    """A rounded edge along x, up, where two planes meet.

    Parameters
    ----------
    radius_m : float
        Radius of the rounding, metres.
    opening_rad : float
        Angle of the material between the two planes, radians, below pi.
    length_m, width_m : float
        Size along x and y, metres.
    """

    radius_m: float = 0.5e-3
    opening_rad: float = np.pi / 2
    length_m: float = 0.09
    width_m: float = 0.06
    name: ClassVar[str] = "edge"
    category: ClassVar[str] = "edge"

    @property
    def sites(self) -> Sites:
        """Left and right of the middle of the edge."""
        return ((-self.length_m / 6, 0.0), (self.length_m / 6, 0.0))

    @property
    def _slope(self) -> float:
        """Angle between either plane and the horizontal, radians."""
        return (np.pi - self.opening_rad) / 2

    def _nearest(self, points: Points) -> tuple[Points, Points]:
        """Along the radius of the rounding, or straight up from the nearer plane."""
        y, z = points[:, 1], points[:, 2] + self.radius_m
        angle = np.clip(np.arctan2(y, z), -self._slope, self._slope)
        inside = z < 0  # the nearer plane, not the angle, decides below the axis of the rounding
        angle = np.where(inside, np.where(y < 0, -self._slope, self._slope), angle)
        normals = np.stack([np.zeros_like(y), np.sin(angle), np.cos(angle)], axis=-1)
        distance = y * normals[:, 1] + z * normals[:, 2] - self.radius_m
        return points - distance[:, None] * normals, normals

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
        r, slope = self.radius_m, self._slope
        up = z + r
        inside = -slope if y < 0.0 else slope
        angle = inside if up < 0.0 else min(max(math.atan2(y, up), -slope), slope)
        sine, cosine = math.sin(angle), math.cos(angle)
        away = y * sine + up * cosine - r
        return (x, y - away * sine, z - away * cosine), (0.0, sine, cosine)

    def _above(self, x: float, y: float) -> Points | None:
        if abs(x) > self.length_m / 2 or abs(y) > self.width_m / 2:
            return None
        end = self.radius_m * np.sin(self._slope)
        aside = min(abs(y), end)
        z = np.sqrt(self.radius_m**2 - aside**2) - self.radius_m - (abs(y) - aside) * np.tan(self._slope)
        return np.array([x, y, z])

    def _curvature_tensor(self, point: Points) -> Points:
        """Minus 1/R across the rounding, zero on the planes."""
        on_planes = abs(point[1]) >= self.radius_m * np.sin(self._slope)
        if on_planes:
            return np.zeros((3, 3))
        normal = self._nearest(point[None])[1][0]
        return -(np.diag([0.0, 1.0, 1.0]) - np.outer(normal, normal)) / self.radius_m


@dataclass(frozen=True)
class Step(Surface):
    """A plate whose right half is lower: a plane, a rounded edge along x, a wall, and a lower plane.

    Parameters
    ----------
    radius_m : float
        Radius of the rounding of the edge, metres.
    height_m : float
        Height of the wall with the rounding, metres; larger than the radius.
    length_m, width_m : float
        Size along x and y, metres.
    """

    radius_m: float = 0.5e-3
    height_m: float = 0.02
    length_m: float = 0.09
    width_m: float = 0.06
    name: ClassVar[str] = "step"
    category: ClassVar[str] = "edge"

    @property
    def sites(self) -> Sites:
        """On the upper plane, and half-way round the edge."""
        return ((-self.length_m / 6, -0.012), (self.length_m / 6, self.radius_m * np.sqrt(0.5)))

    def _nearest(self, points: Points) -> tuple[Points, Points]:
        """The nearer of the upper block, whose edge is rounded, and of the lower plane."""
        r = self.radius_m
        y, z = points[:, 1], points[:, 2] + r
        turn = np.clip(np.arctan2(y, z), 0.0, np.pi / 2)
        inside = (y < 0) & (z < 0)
        turn = np.where(inside, np.where(y > z, np.pi / 2, 0.0), turn)
        normals = np.stack([np.zeros_like(y), np.sin(turn), np.cos(turn)], axis=-1)
        distance = y * normals[:, 1] + z * normals[:, 2] - r
        low = points[:, 2] + self.height_m
        # the material is the union of both: outside, the smaller distance counts; the block ends at its foot
        lower = (low < distance) & (y > r)
        normals = np.where(lower[:, None], [0.0, 0.0, 1.0], normals)
        distance = np.where(lower, low, distance)
        return points - distance[:, None] * normals, normals

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
        r = self.radius_m
        up = z + r
        if y < 0.0 and up < 0.0:
            turn = math.pi / 2 if y > up else 0.0
        else:
            turn = min(max(math.atan2(y, up), 0.0), math.pi / 2)
        sine, cosine = math.sin(turn), math.cos(turn)
        away, low = y * sine + up * cosine - r, z + self.height_m
        if low < away and y > r:
            return (x, y, -self.height_m), (0.0, 0.0, 1.0)
        return (x, y - away * sine, z - away * cosine), (0.0, sine, cosine)

    def _above(self, x: float, y: float) -> Points | None:
        if abs(x) > self.length_m / 2 or abs(y) > self.width_m / 2:
            return None
        if y > self.radius_m:
            return np.array([x, y, -self.height_m])
        return np.array([x, y, np.sqrt(self.radius_m**2 - max(y, 0.0) ** 2) - self.radius_m])

    def _curvature_tensor(self, point: Points) -> Points:
        """Minus 1/R across the rounding, zero elsewhere."""
        y, z = point[1], point[2] + self.radius_m
        if y <= 0 or z <= 0:
            return np.zeros((3, 3))
        normal = self._nearest(point[None])[1][0]
        return -(np.diag([0.0, 1.0, 1.0]) - np.outer(normal, normal)) / self.radius_m


@dataclass(frozen=True)
class Corner(Surface):
    """The corner of a block that stands on its tip: three planes, three edges, all rounded alike.

    Parameters
    ----------
    radius_m : float
        Radius of the rounding, metres.
    width_m : float
        Distance from the corner's axis to which the faces go, metres.
    """

    radius_m: float = 0.5e-3
    width_m: float = 0.04
    name: ClassVar[str] = "corner"
    category: ClassVar[str] = "edge"

    @property
    def sites(self) -> Sites:
        """On the tip, and on an edge 10 mm beside it."""
        return ((0.0, 0.0), (0.0, -0.01))

    def _faced(self, points: Points) -> NDArray[np.float64]:
        """Coordinates along the three faces' normals, from the middle of the rounding of the tip."""
        return (points + np.array([0.0, 0.0, self.radius_m])) @ _FACES

    def _nearest(self, points: Points) -> tuple[Points, Points]:
        """Away from the octant that the faces' normals span: the rounding is an offset of it."""
        along = self._faced(points)
        outside = np.maximum(along, 0.0)
        away = np.linalg.norm(outside, axis=1, keepdims=True)
        within = away[:, 0] == 0
        nearer = np.eye(3)[np.argmax(along, axis=1)]
        normals = np.where(within[:, None], nearer, outside / np.maximum(away, 1e-300)) @ _FACES.T
        distance = np.where(within, along.max(axis=1), away[:, 0]) - self.radius_m
        return points - distance[:, None] * normals, normals

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
        up = z + self.radius_m
        along = [x * a + y * b + up * c for a, b, c in _FACE_ROWS]
        over = [max(value, 0.0) for value in along]
        away = math.sqrt(sum(value * value for value in over))
        if away == 0.0:
            nearer = along.index(max(along))
            u, v, w = _FACE_ROWS[nearer]
            away = along[nearer]
        else:
            (a, b, c), (d, e, f), (g, h, i) = _FACE_ROWS
            p, q, r = (value / away for value in over)
            u, v, w = p * a + q * d + r * g, p * b + q * e + r * h, p * c + q * f + r * i
        away -= self.radius_m
        return (x - away * u, y - away * v, z - away * w), (u, v, w)

    def _above(self, x: float, y: float) -> Points | None:
        if np.hypot(x, y) > self.width_m:
            return None
        point = np.array([x, y, 0.0])
        for _ in range(100):  # the distance is convex in z: Newton's method from above never overshoots
            foot, normal = self._nearest(point[None])
            step = float((point - foot[0]) @ normal[0] / normal[0, 2])
            point[2] -= step
            if abs(step) < 1e-13:
                break
        return point

    def _curvature_tensor(self, point: Points) -> Points:
        """Minus 1/R in the plane of the faces that the rounding joins."""
        normal = self._nearest(point[None])[1][0]
        joined = _FACES[:, self._faced(point[None])[0] > 0]
        return -(joined @ joined.T - np.outer(normal, normal)) / self.radius_m
