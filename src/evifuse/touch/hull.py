"""A smooth convex body around the taxels of a finger that is flat or hollow in places: what it rolls on.

A pad with a flat middle or a dent does not roll on one point: it stands on a few taxels that share the load.
The body here is given by its support function, the soft maximum ``s log(sum exp(p_i . u / s))`` over the
taxels p_i in every direction u: it is smooth and convex whatever the layout, and touches in the middle of
the taxels that are within about s of the plane. Our own.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import Fingertip
from evifuse.touch.fingersurface import FingerSurface, SphereSurface, surface_of
from evifuse.touch.quadrics import tangent_axes, unit_rows
from evifuse.touch.remembered import per_fingertip

__all__ = ["HullSurface", "flattest_per_m", "rolling_surface"]

Array = NDArray[np.float64]
SHARPEST_M = 1e-4
"""No radius of curvature is smaller: beyond its outermost taxels the body would have corners."""
SHARE_M = 1.7e-4
"""How deep a light press of a few newtons goes into a firm skin: taxels so far back still bear a share."""


@dataclass(frozen=True)
class HullSurface:
    """A smooth convex body around taxels: a `evifuse.touch.fingersurface.FingerSurface`.

    Parameters
    ----------
    positions_m : ndarray of float64, shape (N, 3)
        The taxels, fingertip frame, metres.
    normals : ndarray of float64, shape (N, 3)
        Where they face.
    share_m : float
        How much higher a taxel may be and still bear a third of what the lowest one does, metres.
    """

    positions_m: Array
    normals: Array
    share_m: float

    def support(self, directions: Array) -> tuple[Array, Array, Array]:
        """Where planes touch the body.

        Parameters
        ----------
        directions : ndarray of float64, shape (M, 3)
            Outward unit normals of the planes.

        Returns
        -------
        points_m : ndarray of float64, shape (M, 3)
            The points of contact, metres.
        radii_m : ndarray of float64, shape (M, 2, 2)
            How they move when the plane turns: the inverse of the shape operator, metres.
        axes : ndarray of float64, shape (M, 3, 2)
            Unit tangents, in columns, that the radii refer to.
        """
        along = directions @ self.positions_m.T
        top = along.max(axis=1, keepdims=True)
        weight = np.exp((along - top) / self.share_m)
        total = weight.sum(axis=1, keepdims=True)
        height = (top + self.share_m * np.log(total))[:, 0]
        weight /= total
        middle = weight @ self.positions_m
        over = height - np.sum(middle * directions, axis=1)
        axes = tangent_axes(directions)
        # the covariance of the load over the taxels, in the tangent plane
        products = (self.positions_m[:, :, None] * self.positions_m[:, None]).reshape(-1, 9)
        loads = (weight @ products).reshape(-1, 3, 3) - middle[:, :, None] * middle[:, None]
        spread = axes.transpose(0, 2, 1) @ loads @ axes / self.share_m
        radii: Array = spread + (over + SHARPEST_M)[:, None, None] * np.eye(2)
        points: Array = middle + over[:, None] * directions
        return points, radii, axes

    def project(self, points_m: Array) -> tuple[Array, Array]:
        """Nearest points of the body, by Newton's method on the normal: see `FingerSurface`.

        Parameters
        ----------
        points_m : ndarray of float64, shape (M, 3)
            Points near it, metres.

        Returns
        -------
        nearest_m, normals : ndarray of float64, shape (M, 3)
            Points of the body, metres, and outward unit normals.
        """
        apart = np.square(points_m[:, None] - self.positions_m[None]).sum(axis=2)
        normals = self.normals[np.argmin(apart, axis=1)]
        moving = np.arange(len(normals))
        for _ in range(60):
            feet, radii, axes = self.support(normals[moving])
            off = points_m[moving] - feet
            aside = np.einsum("mja,mj->ma", axes, off)
            away = np.sum(off * normals[moving], axis=1)
            turning = radii + np.maximum(away, -0.5 * SHARPEST_M)[:, None, None] * np.eye(2)
            turn = np.linalg.solve(turning, aside[..., None])[..., 0]
            length = np.linalg.norm(turn, axis=1, keepdims=True)
            turn *= np.minimum(1.0, 0.1 / np.maximum(length, 1e-300))
            normals[moving] = unit_rows(normals[moving] + np.einsum("mja,ma->mj", axes, turn))
            moving = moving[length[:, 0] > 1e-10]
            if not len(moving):
                break
        return self.support(normals)[0], normals

    def distance(self, points_m: Array) -> Array:
        """Signed distance to the body, positive outside: see `FingerSurface`.

        Parameters
        ----------
        points_m : ndarray of float64, shape (M, 3)
            Points, metres.

        Returns
        -------
        ndarray of float64, shape (M,)
            Distances, metres.
        """
        feet, normals = self.project(points_m)
        away: Array = np.sum((points_m - feet) * normals, axis=1)
        return away

    def contact(self, weights: Array) -> tuple[Array, Array]:
        """Middle of a patch of active taxels: see `FingerSurface`.

        Parameters
        ----------
        weights : ndarray of float64, shape (T, N)
            How much each taxel counts.

        Returns
        -------
        points_m, normals : ndarray of float64, shape (T, 3)
            Points of the body, metres, and outward unit normals.
        """
        return self.project(weights @ self.positions_m / weights.sum(axis=1, keepdims=True))

    def shape_operators(self, points_m: Array) -> tuple[Array, Array]:
        """How the body is curved at points of it: see `FingerSurface`.

        Parameters
        ----------
        points_m : ndarray of float64, shape (M, 3)
            Points of the body, metres.

        Returns
        -------
        operators_per_m : ndarray of float64, shape (M, 2, 2)
            Curvatures, 1/m, convex positive.
        axes : ndarray of float64, shape (M, 3, 2)
            Unit tangents.
        """
        _, radii, axes = self.support(self.project(points_m)[1])
        return np.asarray(np.linalg.inv(radii), dtype=np.float64), axes


def flattest_per_m(fingertip: Fingertip, surface: FingerSurface, pole_m: Array) -> float:
    """Smallest curvature of a finger around its pole.

    Parameters
    ----------
    fingertip : Fingertip
        Its taxels.
    surface : FingerSurface
        The surface through them.
    pole_m : ndarray of float64, shape (3,)
        The pole, fingertip frame, metres.

    Returns
    -------
    float
        1/m, negative where the finger is hollow.
    """
    apart = np.linalg.norm(fingertip.positions_m - pole_m, axis=1)
    reach = max(0.5 * min(fingertip.radius_m, float(apart.max())), float(apart.min()))
    near = fingertip.positions_m[apart <= reach]
    places = surface.project(np.concatenate([pole_m[None], near]))[0]
    return float(np.linalg.eigvalsh(surface.shape_operators(places)[0])[:, 0].min())


@per_fingertip
def rolling_surface(fingertip: Fingertip) -> FingerSurface:
    """What a fingertip rolls on: its surface, or where that is flat or hollow the body around its taxels.

    Parameters
    ----------
    fingertip : Fingertip
        Its taxels.

    Returns
    -------
    FingerSurface
        Convex around the pole.
    """
    surface = surface_of(fingertip)
    if isinstance(surface, SphereSurface):
        return surface
    facing = fingertip.normals.mean(axis=0)
    facing /= np.linalg.norm(facing)
    middle = fingertip.positions_m - fingertip.positions_m.mean(axis=0)
    aside = np.linalg.norm(middle - np.outer(middle @ facing, facing), axis=1)
    pole = surface.project(fingertip.positions_m[[int(np.argmin(aside))]])[0][0]
    if flattest_per_m(fingertip, surface, pole) > 0:
        return surface
    return HullSurface(fingertip.positions_m, fingertip.normals, SHARE_M)
