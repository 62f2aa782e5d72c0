"""The smooth surface of a fingertip through its taxels: a sphere, or any layout.

What the estimators and the simulation need of a finger is its surface: where a patch of pressure sits on it,
which way it faces there, and how it is curved. A sphere is exact; for other layouts see `blended_surface`.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import Fingertip
from evifuse.touch.blended import blended_surface
from evifuse.touch.quadrics import tangent_axes, unit_rows
from evifuse.touch.remembered import per_fingertip

__all__ = ["FingerSurface", "SphereSurface", "surface_of"]

Array = NDArray[np.float64]

AS_SPHERE = 0.01
"""A layout that leaves a sphere by no more than this share of its radius is that sphere."""


class FingerSurface(Protocol):
    """The surface of a finger, in the fingertip frame."""

    def contact(self, weights: Array) -> tuple[Array, Array]:
        """Middle of a patch of active taxels, on the surface.

        Parameters
        ----------
        weights : ndarray of float64, shape (T, N)
            How much each taxel counts, not negative; no row is all zeros.

        Returns
        -------
        points_m : ndarray of float64, shape (T, 3)
            Points of the surface, metres.
        normals : ndarray of float64, shape (T, 3)
            Outward unit normals there.
        """
        ...

    def project(self, points_m: Array) -> tuple[Array, Array]:
        """Nearest points of the surface.

        Parameters
        ----------
        points_m : ndarray of float64, shape (M, 3)
            Points within about half a radius of the surface, metres.

        Returns
        -------
        nearest_m : ndarray of float64, shape (M, 3)
            Points of the surface, metres.
        normals : ndarray of float64, shape (M, 3)
            Outward unit normals there.
        """
        ...

    def distance(self, points_m: Array) -> Array:
        """Signed distance to the surface, positive outside.

        Parameters
        ----------
        points_m : ndarray of float64, shape (M, 3)
            Points, metres.

        Returns
        -------
        ndarray of float64, shape (M,)
            Distances, metres.
        """
        ...

    def shape_operators(self, points_m: Array) -> tuple[Array, Array]:
        """How the surface is curved at points of it.

        Parameters
        ----------
        points_m : ndarray of float64, shape (M, 3)
            Points of the surface, metres.

        Returns
        -------
        operators_per_m : ndarray of float64, shape (M, 2, 2)
            Symmetric; a step du on the surface turns the outward normal by S du: convex is positive, 1/m.
        axes : ndarray of float64, shape (M, 3, 2)
            Unit tangents, in columns, that the operators refer to; first x second = normal.
        """
        ...


@dataclass(frozen=True)
class SphereSurface:
    """A sphere.

    Parameters
    ----------
    radius_m : float
        Radius, metres.
    centre_m : ndarray of float64, shape (3,)
        Centre in the fingertip frame, metres.
    taxel_normals : ndarray of float64, shape (N, 3)
        Outward unit normals of the taxels.
    """

    radius_m: float
    centre_m: Array
    taxel_normals: Array

    def contact(self, weights: Array) -> tuple[Array, Array]:
        """Middle of a patch of active taxels: see `FingerSurface`.

        Parameters
        ----------
        weights : ndarray of float64, shape (T, N)
            How much each taxel counts.

        Returns
        -------
        points_m, normals : ndarray of float64, shape (T, 3)
            Points of the sphere, metres, and outward unit normals.
        """
        normals = unit_rows(weights @ self.taxel_normals)
        return self.centre_m + self.radius_m * normals, normals

    def project(self, points_m: Array) -> tuple[Array, Array]:
        """Nearest points of the sphere: see `FingerSurface`.

        Parameters
        ----------
        points_m : ndarray of float64, shape (M, 3)
            Points, metres.

        Returns
        -------
        nearest_m, normals : ndarray of float64, shape (M, 3)
            Points of the sphere, metres, and outward unit normals.
        """
        normals = unit_rows(points_m - self.centre_m)
        return self.centre_m + self.radius_m * normals, normals

    def distance(self, points_m: Array) -> Array:
        """Signed distance to the sphere, positive outside.

        Parameters
        ----------
        points_m : ndarray of float64, shape (M, 3)
            Points, metres.

        Returns
        -------
        ndarray of float64, shape (M,)
            Distances, metres.
        """
        return np.linalg.norm(points_m - self.centre_m, axis=1) - self.radius_m

    def shape_operators(self, points_m: Array) -> tuple[Array, Array]:
        """One over the radius in every direction: see `FingerSurface`.

        Parameters
        ----------
        points_m : ndarray of float64, shape (M, 3)
            Points of the sphere, metres.

        Returns
        -------
        operators_per_m : ndarray of float64, shape (M, 2, 2)
            Curvatures, 1/m.
        axes : ndarray of float64, shape (M, 3, 2)
            Unit tangents.
        """
        axes = tangent_axes(unit_rows(points_m - self.centre_m))
        return np.broadcast_to(np.eye(2) / self.radius_m, (len(points_m), 2, 2)).copy(), axes


@per_fingertip
def surface_of(fingertip: Fingertip) -> FingerSurface:
    """Surface through the taxels of a fingertip.

    Parameters
    ----------
    fingertip : Fingertip
        Geometry of the fingertip, N taxels.

    Returns
    -------
    FingerSurface
        A sphere when the taxels lie on one within 1 % of its radius and face along it, else blended quadrics.

    Examples
    --------
    >>> from evifuse.touch.fingertip import spherical_fingertip
    >>> surface = surface_of(spherical_fingertip(radius_m=0.010, pitch_m=0.001))
    >>> surface.distance(np.array([[0.0, 0.0, -0.012]])).round(6)
    array([0.002])
    """
    positions, normals = fingertip.positions_m, fingertip.normals
    for centre, radius in _spheres(fingertip):
        off = np.linalg.norm(positions - centre - radius * normals, axis=1)
        extent = float(np.linalg.norm(np.ptp(positions, axis=0)))
        # a nearly flat pad lies on a huge sphere: what counts then is the pad's own size
        if off.max() <= AS_SPHERE * min(radius, max(extent, 0.1 * radius)):
            return SphereSurface(radius, centre, normals)
    return blended_surface(positions, normals)


def _spheres(fingertip: Fingertip) -> list[tuple[Array, float]]:
    """The sphere that the fingertip says it is, and the one that fits places and normals best."""
    positions, normals = fingertip.positions_m, fingertip.normals
    said = (np.zeros(3), fingertip.radius_m)
    away, turned = positions - positions.mean(axis=0), normals - normals.mean(axis=0)
    bend = float(np.sum(away * turned)) / max(float(np.sum(turned**2)), 1e-300)
    if not 0 < bend < 1:
        return [said]
    return [said, ((positions - bend * normals).mean(axis=0), bend)]
