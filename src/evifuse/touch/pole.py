"""The pole of a fingertip: the middle of its array, where the contact axis leaves the surface."""

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import Fingertip
from evifuse.touch.fingersurface import SphereSurface, surface_of
from evifuse.touch.quadrics import unit_rows
from evifuse.touch.remembered import per_fingertip

__all__ = ["FLATTEST_M", "Pole", "facing_down", "pole_of"]

FLATTEST_M = 0.1
"""Largest radius that is given to a flat pad, metres."""
AROUND = 0.7
"""Taxels belong to the cap around the pole when the cosine of their tilt is larger (45 degrees)."""

Array = NDArray[np.float64]
Pole = tuple[Array, Array, float]
"""Point (3,) in metres and outward unit normal (3,), both in the fingertip frame, and radius in metres."""


@per_fingertip
def pole_of(fingertip: Fingertip) -> Pole:
    """Find the pole of a layout.

    The line through the middle of the taxels, along the mean of their normals, leaves the surface there (our
    own choice). The radius is that of the best sphere: one over the curvature there, in the mean over the
    directions and over the taxels that are tilted by less than 45 degrees.

    Parameters
    ----------
    fingertip : Fingertip
        Geometry of the fingertip, N taxels.

    Returns
    -------
    point_m : ndarray of float64, shape (3,)
        The pole, metres.
    normal : ndarray of float64, shape (3,)
        Outward unit normal there.
    radius_m : float
        Radius of the best sphere at the pole, metres, at most `FLATTEST_M`.
    """
    surface = surface_of(fingertip)
    middle = fingertip.positions_m.mean(axis=0)
    mean = fingertip.normals.mean(axis=0)
    size = float(np.linalg.norm(mean))
    axis = mean / size if size > 1e-6 else np.array([0.0, 0.0, -1.0])
    start = fingertip.positions_m - middle
    aside = np.linalg.norm(start - np.outer(start @ axis, axis), axis=1)
    aside[fingertip.normals @ axis < 0] = np.inf
    point, normal = surface.project(fingertip.positions_m[int(np.argmin(aside))][None])
    for _ in range(20):
        along = float((point[0] - middle) @ axis)
        point, normal = surface.project((middle + along * axis)[None])
    if isinstance(surface, SphereSurface):
        return point[0], normal[0], surface.radius_m
    cap = fingertip.positions_m[fingertip.normals @ normal[0] > AROUND]
    operators = surface.shape_operators(np.concatenate([point, cap]))[0]
    curvature = float(np.trace(operators, axis1=1, axis2=2).mean()) / 2
    return point[0], normal[0], 1 / max(curvature, 1 / FLATTEST_M)


def facing_down(fingertip: Fingertip) -> Fingertip:
    """Bring the pole of a layout to -z, and the centre of the best sphere there to the origin.

    The smallest turn that does so is taken.

    Parameters
    ----------
    fingertip : Fingertip
        Geometry of the fingertip in any frame.

    Returns
    -------
    Fingertip
        The same layout in a frame in which a fingertip with unit orientation points down; its radius is that
        of the best sphere at the pole.
    """
    point, normal, radius = pole_of(fingertip)
    down = np.array([0.0, 0.0, -1.0])
    turn = _smallest_turn(normal, down)
    positions = (fingertip.positions_m - point) @ turn.T + radius * down
    return Fingertip(radius, positions, unit_rows(fingertip.normals @ turn.T))


def _smallest_turn(start: Array, end: Array) -> Array:
    """Rotation matrix (3, 3) that turns one unit vector to another; half a turn is about y."""
    if start @ end < -1 + 1e-9:
        return np.diag([-1.0, 1.0, -1.0])
    axis = np.cross(start, end)
    x, y, z = axis.tolist()
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + skew + skew @ skew / (1 + float(start @ end))
