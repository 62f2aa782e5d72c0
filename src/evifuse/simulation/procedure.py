"""How the finger explores, and where each of its rolls must begin.

Section 4.1.4 rolls the finger along several meridian planes; the choreography around it is our own.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings import rotation
from evifuse.simulation.fingertip import CAP_RAD
from evifuse.simulation.physics import COVER_M
from evifuse.simulation.surface import Surface

__all__ = ["Procedure", "Start", "roll_start"]

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Procedure:
    """How the finger explores.

    Parameters
    ----------
    directions_rad : tuple of float
        Directions of the rolls at every site, from the world x axis towards y, radians.
    arc_rad : float
        Length of the contact's way along each roll, over the radius of the fingertip. Where the patch of
        contact is so wide that it would leave the taxels, the way is shorter.
    roll_s, lower_s, settle_s, lift_s, transfer_s : float
        Duration of each phase, seconds.
    clearance_m : float
        Height to which the finger is lifted, metres.
    depth_m : float
        How far below the expected surface the finger goes before it gives up, metres.
    """

    directions_rad: tuple[float, ...] = (0.0, np.pi / 4, np.pi / 2, 3 * np.pi / 4)
    arc_rad: float = 0.9
    roll_s: float = 0.9
    lower_s: float = 0.1
    settle_s: float = 0.05
    lift_s: float = 0.08
    transfer_s: float = 0.12
    clearance_m: float = 0.005
    depth_m: float = 0.008


@dataclass(frozen=True)
class Start:
    """Where a roll begins.

    Parameters
    ----------
    position_m : ndarray of float64, shape (3,)
        Centre of the fingertip, world frame, metres.
    orientation_xyzw : ndarray of float64, shape (4,)
        Its orientation.
    normal : ndarray of float64, shape (3,)
        Surface normal there.
    binormal : ndarray of float64, shape (3,)
        Unit normal of the plane in which the finger is to roll.
    half_angle_rad : float
        Angle of the joint from the start to the site, radians.
    solid : bool
        Whether there is anything to touch.
    """

    position_m: Vector
    orientation_xyzw: Vector
    normal: Vector
    binormal: Vector
    half_angle_rad: float
    solid: bool


def roll_start(
    surface: Surface, radius_m: float, site: tuple[float, float], angle_rad: float, procedure: Procedure
) -> Start:
    """Roll back in thought from the site, without slip, to where the roll must begin.

    At the site the pole of the fingertip points into the surface.

    Parameters
    ----------
    surface : Surface
        What is touched.
    radius_m : float
        Radius of the fingertip, metres.
    site : (x, y)
        The site, metres.
    angle_rad : float
        Direction of the roll, from the world x axis towards y, radians.
    procedure : Procedure
        How far to roll.

    Returns
    -------
    Start
        Pose and plane of the roll.
    """
    place = surface.above(*site)
    point = np.array([*site, 0.0]) if place is None else place
    normal = np.array([0.0, 0.0, 1.0]) if place is None else surface.nearest(point[None])[1][0]
    heading = np.array([np.cos(angle_rad), np.sin(angle_rad), 0.0])
    binormal = np.cross(normal, heading)
    binormal /= np.linalg.norm(binormal)
    along = np.cross(binormal, normal)
    position = point + radius_m * normal
    tilt = rotation.about_axis(*_axis_and_angle(np.array([0.0, 0.0, 1.0]), normal))
    if place is None:
        half = procedure.arc_rad / 2
        turned = rotation.multiply(rotation.about_axis(binormal, -half), tilt)
        return Start(position, turned, normal, binormal, half, solid=False)
    # without slip, a turn of the finger moves the contact by (1/a - S)^-1 times it
    relative = np.eye(3) / radius_m - surface.curvature_tensor(point)
    patch = np.sqrt(2 * COVER_M / np.linalg.eigvalsh(relative)[0])
    reach = min(radius_m * procedure.arc_rad / 2, radius_m * CAP_RAD - patch)
    half = reach / float(np.linalg.norm(np.linalg.solve(relative, along)))
    steps = 100
    orientation = tilt
    for _ in range(steps):
        along = np.cross(binormal, normal)
        axis = np.cross(normal, along)
        axis /= np.linalg.norm(axis)
        position = position - np.cross(axis, normal) * radius_m * half / steps
        orientation = rotation.multiply(rotation.about_axis(axis, -half / steps), orientation)
        nearest, normals = surface.nearest(position[None])
        normal = normals[0]
        position = nearest[0] + radius_m * normal
    return Start(position, orientation, normal, binormal, half, solid=True)


def _axis_and_angle(start: Vector, end: Vector) -> tuple[Vector, float]:
    axis = np.cross(start, end)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        return np.array([1.0, 0.0, 0.0]), 0.0
    return axis / sine, float(np.arctan2(sine, start @ end))
