"""What a simulated surface is: an analytic nearest point, normal and curvature.

World frame: z up, the touched side faces up, the origin is the apex (or the lowest point) of the surface.
Normals point out of the material. A curvature is positive where the surface is concave up (bowl, trough) and
negative where it is a dome, in 1/m, as everywhere in this project.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

__all__ = ["Points", "Sites", "Surface", "Triple"]

Points = NDArray[np.float64]
Triple = tuple[float, float, float]
Sites = tuple[tuple[float, ...], ...]


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
        What it truly is: ``"quasiplanar"``, ``"curved"``, ``"occluded"``, or ``"edge"``.
    probe_m : float
        Step of the differences that curvature is taken from along a roll, metres.
    """

    name: ClassVar[str]
    category: ClassVar[str]
    probe_m: ClassVar[float] = 2e-5

    @property
    def around(self) -> tuple[Points, float] | None:
        """Centre and radius of a ball around the whole body, metres; None where it is touched from above."""
        return None

    @property
    @abstractmethod
    def sites(self) -> Sites:
        """Where to roll by default: ``(x, y)`` or ``(x, y, z)`` of each site, metres."""

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

    def place(self, site: tuple[float, ...]) -> tuple[Points, Points] | None:
        """Where a site is.

        Parameters
        ----------
        site : (x, y) or (x, y, z)
            A place of the table, which means the surface above it, or a point near the surface, metres.

        Returns
        -------
        point, normal : ndarray of float64, shape (3,)
            The point of the surface, metres, and its unit normal; None where there is nothing to touch.
        """
        point = np.array(site) if len(site) == 3 else self.above(*site)
        if point is None:
            return None
        nearest, normals = self.nearest(point[None])
        return (nearest[0] if len(site) == 3 else point), normals[0]

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
