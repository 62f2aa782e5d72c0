"""The exploratory procedure: at every site the finger is lowered, rolled and lifted, once per direction.

Section 4.1.4 rolls the finger along several meridian planes; the choreography around it is our own.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings import rotation
from evifuse.simulation.fingertip import CAP_RAD
from evifuse.simulation.physics import COVER_M, FingerWorld
from evifuse.simulation.surfaces import Surface

__all__ = ["Motion", "Procedure", "roll_finger"]

Vector = NDArray[np.float64]
Pose = tuple[Vector, Vector, float]
"""Centre, orientation and joint angle of the finger."""


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
class Motion:
    """Where the finger was.

    Parameters
    ----------
    position_m : ndarray of float64, shape (T, 3)
        Centre of the fingertip, world frame, metres.
    orientation_xyzw : ndarray of float64, shape (T, 4)
        Orientation of the fingertip in the world frame.
    joint_angle_rad : ndarray of float64, shape (T,)
        Angle of the distal joint, radians.
    phase : ndarray of int64, shape (T,)
        Number of the roll from 0, or -1 while the finger is not rolling on the surface.
    """

    position_m: Vector
    orientation_xyzw: Vector
    joint_angle_rad: Vector
    phase: NDArray[np.int64]


@dataclass(frozen=True)
class _Start:
    """Where a roll begins."""

    position_m: Vector
    orientation_xyzw: Vector
    normal: Vector
    binormal: Vector
    half_angle_rad: float
    solid: bool


def roll_finger(
    surface: Surface,
    radius_m: float,
    sites: tuple[tuple[float, float], ...],
    procedure: Procedure,
    rate_hz: float,
) -> Motion:
    """Explore a surface.

    Parameters
    ----------
    surface : Surface
        What is touched.
    radius_m : float
        Radius of the fingertip, metres.
    sites : tuple of (x, y)
        Where to roll, metres.
    procedure : Procedure
        Directions and timing.
    rate_hz : float
        Samples per second.

    Returns
    -------
    Motion
        The finger's way, with one roll per site and direction, sites outermost.
    """
    substeps = max(1, round(1000 / rate_hz))
    world = FingerWorld(surface, radius_m, 1 / (rate_hz * substeps))
    pieces: list[Motion] = []
    starts = [
        _start(surface, radius_m, site, angle, procedure)
        for site in sites
        for angle in procedure.directions_rad
    ]
    pose = _above(starts[0], 3 * procedure.clearance_m)
    for number, start in enumerate(starts):
        pieces.extend(_one_roll(world, surface, start, pose, number, procedure, rate_hz, substeps))
        pose = _end(pieces[-1])
    return Motion(
        *(
            np.concatenate([getattr(piece, key) for piece in pieces])
            for key in ("position_m", "orientation_xyzw", "joint_angle_rad", "phase")
        )
    )


def _start(
    surface: Surface, radius_m: float, site: tuple[float, float], angle_rad: float, procedure: Procedure
) -> _Start:
    """Roll back in thought from the site, without slip, to where the roll must begin.

    At the site the pole of the fingertip points into the surface.
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
        return _Start(position, turned, normal, binormal, half, solid=False)
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
    return _Start(position, orientation, normal, binormal, half, solid=True)


def _axis_and_angle(start: Vector, end: Vector) -> tuple[Vector, float]:
    axis = np.cross(start, end)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        return np.array([1.0, 0.0, 0.0]), 0.0
    return axis / sine, float(np.arctan2(sine, start @ end))


def _above(start: _Start, height_m: float) -> Pose:
    return start.position_m + height_m * start.normal, start.orientation_xyzw, -start.half_angle_rad


def _end(piece: Motion) -> Pose:
    return piece.position_m[-1], piece.orientation_xyzw[-1], float(piece.joint_angle_rad[-1])


def _one_roll(
    world: FingerWorld,
    surface: Surface,
    start: _Start,
    pose: Pose,
    number: int,
    procedure: Procedure,
    rate_hz: float,
    substeps: int,
) -> Iterator[Motion]:
    """Transfer, lower, settle, roll, lift."""
    high = _above(start, procedure.clearance_m)
    low = _above(start, 0.0 if start.solid else -procedure.depth_m)
    yield _through_air(pose, high, procedure.transfer_s, rate_hz)
    yield _through_air(high, low, procedure.lower_s, rate_hz)
    if start.solid:
        world.place(low[0], low[1])
        rolled = _on_surface(world, surface, start, number, procedure, rate_hz, substeps)
    else:
        rolled = _in_vain(low[0], start, procedure, rate_hz)
    yield rolled
    end = _end(rolled)
    up = surface.nearest(end[0][None])[1][0] if start.solid else start.normal
    rise = procedure.clearance_m + (0.0 if start.solid else procedure.depth_m)
    yield _through_air(end, (end[0] + rise * up, *end[1:]), procedure.lift_s, rate_hz)


def _through_air(start: Pose, end: Pose, seconds: float, rate_hz: float) -> Motion:
    """A smooth straight way from one pose to another, without the first sample."""
    count = max(1, round(seconds * rate_hz))
    time = np.arange(1, count + 1) / count
    way = time * time * (3 - 2 * time)
    position = start[0] + way[:, None] * (end[0] - start[0])
    orientation = rotation.interpolate(np.array([0.0, 1.0]), np.stack([start[1], end[1]]), way)
    angle = start[2] + way * (end[2] - start[2])
    return Motion(position, orientation, angle, np.full(count, -1))


def _speeds(start: _Start, procedure: Procedure, rate_hz: float, substeps: int) -> Vector:
    """Commanded joint speed at every physics step: settle, then speed up, roll and slow down."""
    settle = round(procedure.settle_s * rate_hz) * substeps
    roll = round(procedure.roll_s * rate_hz) * substeps
    ramp = np.minimum(1.0, np.minimum(np.arange(roll) + 0.5, roll - np.arange(roll) - 0.5) / (0.1 * roll))
    speed = ramp * (2 * start.half_angle_rad) / (ramp.sum() / (rate_hz * substeps))
    return np.concatenate([np.zeros(settle), speed])


def _on_surface(
    world: FingerWorld,
    surface: Surface,
    start: _Start,
    number: int,
    procedure: Procedure,
    rate_hz: float,
    substeps: int,
) -> Motion:
    speeds = _speeds(start, procedure, rate_hz, substeps).reshape(-1, substeps)
    position, orientation = np.empty((len(speeds), 3)), np.empty((len(speeds), 4))
    x, y, z = start.binormal.tolist()
    binormal = (x, y, z)
    for i, sample in enumerate(speeds.tolist()):
        for speed in sample:
            world.step(binormal, speed)
        position[i], orientation[i] = world.position_m, world.orientation_xyzw
    angle = _joint_angle(surface, position, orientation) - start.half_angle_rad
    return Motion(position, orientation, angle, np.full(len(speeds), number))


def _joint_angle(surface: Surface, position_m: Vector, orientation_xyzw: Vector) -> Vector:
    """Angle rolled about the axis perpendicular to travel: the sum of d(rotation) . (normal x tangent)."""
    contact, normal = surface.nearest(position_m)
    step = np.gradient(contact, axis=0)
    length = np.linalg.norm(step, axis=1)
    moving = np.flatnonzero(length > 0.05 * length.max())
    closest = moving[np.clip(np.searchsorted(moving, np.arange(len(step))), 0, len(moving) - 1)]
    tangent = step[closest] / length[closest, None]
    axis = np.cross(normal, tangent)
    before, after = orientation_xyzw[:-1], orientation_xyzw[1:]
    turn = 2 * rotation.multiply(after, before * [-1.0, -1.0, -1.0, 1.0])
    turn = turn[:, :3] * np.sign(turn[:, 3:])
    middle = (axis[:-1] + axis[1:]) / 2
    return np.concatenate([[0.0], np.cumsum(np.einsum("ij,ij->i", turn, middle))])


def _in_vain(low: Vector, start: _Start, procedure: Procedure, rate_hz: float) -> Motion:
    """Where nothing is met the joint turns the finger on the spot."""
    speeds = _speeds(start, procedure, rate_hz, 1)
    angle = np.cumsum(speeds) / rate_hz
    turn = rotation.about_axis(start.binormal, angle)
    orientation = rotation.multiply(turn, start.orientation_xyzw)
    position = np.repeat(low[None], len(angle), axis=0)
    return Motion(position, orientation, angle - start.half_angle_rad, np.full(len(angle), -1))
