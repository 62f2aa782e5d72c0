"""Surfaces with an analytic nearest point, normal and curvature.

World frame: z up, the touched side faces up, the origin is the apex (or the lowest point) of the surface.
Normals point out of the material. A curvature is positive where the surface is concave up (bowl, trough) and
negative where it is a dome, in 1/m, as everywhere in this project.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import UsageError

__all__ = [
    "SURFACES",
    "Bowl",
    "Cylinder",
    "Hole",
    "Plane",
    "Saddle",
    "Sphere",
    "Surface",
    "Trough",
    "surface",
]

Points = NDArray[np.float64]
Triple = tuple[float, float, float]
Sites = tuple[tuple[float, float], ...]


def _triple(vector: Points) -> Triple:
    x, y, z = vector.tolist()
    return x, y, z


@dataclass(frozen=True)
class Surface(ABC):
    """A smooth surface that a fingertip can roll on.

    Attributes
    ----------
    name : str
        Its name in the catalogue.
    category : str
        What it truly is: ``"quasiplanar"``, ``"curved"`` or ``"occluded"``.
    """

    name: ClassVar[str]
    category: ClassVar[str]

    @property
    @abstractmethod
    def sites(self) -> Sites:
        """Where to roll by default: ``(x, y)`` of each site, metres."""

    @abstractmethod
    def _nearest(self, points: Points) -> tuple[Points, Points]: ...

    def nearest(self, points: Points) -> tuple[Points, Points]:
        """Nearest points of the surface.

        Parameters
        ----------
        points : ndarray of float64, shape (M, 3)
            Points near the surface, world frame, metres.

        Returns
        -------
        nearest : ndarray of float64, shape (M, 3)
            The nearest points, metres.
        normals : ndarray of float64, shape (M, 3)
            Unit normals there, out of the material.
        """
        return self._nearest(points)

    def nearest_one(self, x: float, y: float, z: float) -> tuple[Triple, Triple]:
        """Nearest point of one point, in plain floats: ten times as fast where there is only one.

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
        nearest, normals = self._nearest(np.array([[x, y, z]]))
        return _triple(nearest[0]), _triple(normals[0])

    @abstractmethod
    def _above(self, x: float, y: float) -> Points | None: ...

    def above(self, x: float, y: float) -> Points | None:
        """Point of the surface over or under a place of the table.

        Parameters
        ----------
        x, y : float
            The place, metres.

        Returns
        -------
        ndarray of float64, shape (3,), or None
            The point; None where there is no surface to touch.
        """
        return self._above(x, y)

    @abstractmethod
    def _curvature_tensor(self, point: Points) -> Points: ...

    def curvature_tensor(self, point: Points) -> Points:
        """Curvature as a symmetric tensor of the tangent plane.

        Parameters
        ----------
        point : ndarray of float64, shape (3,)
            A point of the surface, metres.

        Returns
        -------
        ndarray of float64, shape (3, 3)
            S with ``t @ S @ t`` the normal curvature along the unit tangent t, 1/m, and ``S @ normal = 0``.
        """
        return self._curvature_tensor(point)

    def distance(self, points: Points) -> NDArray[np.float64]:
        """Signed distance from the surface, negative inside the material.

        Parameters
        ----------
        points : ndarray of float64, shape (M, 3)
            Points near the surface, metres.

        Returns
        -------
        ndarray of float64, shape (M,)
            Distances, metres.
        """
        nearest, normals = self.nearest(points)
        return np.einsum("ij,ij->i", points - nearest, normals)

    def principal_curvatures(self, point: Points) -> tuple[float, float]:
        """Largest and smallest normal curvature.

        Parameters
        ----------
        point : ndarray of float64, shape (3,)
            A point of the surface, metres.

        Returns
        -------
        tuple of float
            ``k1 >= k2``, 1/m, concave up positive.
        """
        normal = self.nearest(point[None])[1][0]
        tangents = np.linalg.svd(normal[None])[2][1:]
        k2, k1 = np.linalg.eigvalsh(tangents @ self.curvature_tensor(point) @ tangents.T)
        return float(k1), float(k2)


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
class _Round(Surface):
    """Part of a sphere, or of a cylinder along x, seen from outside (``side = 1``) or from inside (-1)."""

    radius_m: float = 0.03
    axes: ClassVar[Points]
    side: ClassVar[int]
    reach: ClassVar[float] = 1.0  # how far from the axis the surface goes, over the radius

    def _from_centre(self, points: Points) -> tuple[Points, NDArray[np.float64]]:
        """Directions away from the centre or the axis, and the distances from it."""
        offset = (points + np.array([0.0, 0.0, self.side * self.radius_m])) * self.axes
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
        """Left and right of the apex, a quarter of the radius away."""
        return ((-self.radius_m / 4, 0.0), (self.radius_m / 4, 0.0))


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
        """Left and right of the lowest point, a quarter of the radius away."""
        return ((-self.radius_m / 4, 0.0), (self.radius_m / 4, 0.0))


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

    def _nearest(self, points: Points) -> tuple[Points, Points]:
        """The plate, or the rim for points over the hole."""
        across = np.hypot(points[:, 0], points[:, 1])[:, None]
        along = points[:, :2] / np.maximum(across, 1e-12)
        rim = np.hstack([along * self.radius_m, np.zeros_like(across)])
        away = points - rim
        away = away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-12)
        over = across < self.radius_m
        return np.where(over, rim, points * [1.0, 1.0, 0.0]), np.where(over, away, [0.0, 0.0, 1.0])

    def _above(self, x: float, y: float) -> Points | None:
        solid = np.hypot(x, y) >= self.radius_m and max(abs(x), abs(y)) <= self.length_m / 2
        return np.array([x, y, 0.0]) if solid else None

    def _curvature_tensor(self, point: Points) -> Points:
        """Zero, on the plate."""
        return np.zeros((3, 3))


SURFACES: dict[str, type[Surface]] = {
    kind.name: kind for kind in (Plane, Cylinder, Sphere, Bowl, Trough, Saddle, Hole)
}
"""The catalogue, by name."""


def surface(name: str, **dimensions: float) -> Surface:
    """A surface of the catalogue.

    Parameters
    ----------
    name : str
        One of `SURFACES`.
    **dimensions : float
        Its dimensions, metres; the rest keep their defaults.

    Returns
    -------
    Surface
        The surface.

    Raises
    ------
    UsageError
        If the name or a dimension is unknown, or a dimension is not positive.

    Examples
    --------
    >>> surface("cylinder", radius_m=0.02).principal_curvatures(np.zeros(3))
    (0.0, -50.0)
    """
    if name not in SURFACES:
        raise UsageError(f"unknown surface {name!r}: use one of {', '.join(SURFACES)}")
    kind = SURFACES[name]
    known = tuple(kind.__dataclass_fields__)
    for key, value in dimensions.items():
        if key not in known:
            raise UsageError(f"surface {name!r} has no dimension {key!r}: it has {', '.join(known)}")
        if not (np.isfinite(value) and value > 0):
            raise UsageError(f"{key} of surface {name!r} must be positive, not {value:g}: give metres")
    return kind(**dimensions)
