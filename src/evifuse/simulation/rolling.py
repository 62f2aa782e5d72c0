"""The exploratory procedure: at every site the finger is lowered, rolled and lifted, once per direction."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings import rotation
from evifuse.simulation.physics import FingerWorld
from evifuse.simulation.procedure import Procedure, Start, roll_start
from evifuse.simulation.surface import Surface

__all__ = ["Motion", "roll_finger"]

Vector = NDArray[np.float64]
Pose = tuple[Vector, Vector, float]
"""Centre, orientation and joint angle of the finger."""


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
        roll_start(surface, radius_m, site, angle, procedure)
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


def _above(start: Start, height_m: float) -> Pose:
    return start.position_m + height_m * start.normal, start.orientation_xyzw, -start.half_angle_rad


def _end(piece: Motion) -> Pose:
    return piece.position_m[-1], piece.orientation_xyzw[-1], float(piece.joint_angle_rad[-1])


def _one_roll(
    world: FingerWorld,
    surface: Surface,
    start: Start,
    pose: Pose,
    number: int,
    procedure: Procedure,
    rate_hz: float,
    substeps: int,
) -> Iterator[Motion]:
    """Transfer, lower, settle, roll, lift."""
    high = _above(start, procedure.clearance_m)
    low = _above(start, 0.0 if start.solid else -procedure.depth_m)
    aside = _through_air(pose, high, procedure.transfer_s, rate_hz)
    yield _clear_of(surface, world.radius_m + procedure.clearance_m / 2, aside)
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


def _clear_of(surface: Surface, distance_m: float, motion: Motion) -> Motion:
    """Raise the middle of a way that leads too close to the surface, such as over the top of a ball."""
    short = distance_m - surface.distance(motion.position_m)
    way = np.arange(1, len(short) + 1) / len(short)
    arch = 4 * way * (1 - way)
    inside = (short > 0) & (arch > 0)
    if not inside.any():
        return motion
    # half as much again, because what is above a slope is not as far from it
    height = 1.5 * float(np.max(short[inside] / arch[inside]))
    return replace(motion, position_m=motion.position_m + np.outer(height * arch, [0.0, 0.0, 1.0]))


def _speeds(start: Start, procedure: Procedure, rate_hz: float, substeps: int) -> Vector:
    """Commanded joint speed at every physics step: settle, then speed up, roll and slow down."""
    settle = round(procedure.settle_s * rate_hz) * substeps
    roll = round(procedure.roll_s * rate_hz) * substeps
    ramp = np.minimum(1.0, np.minimum(np.arange(roll) + 0.5, roll - np.arange(roll) - 0.5) / (0.1 * roll))
    speed = ramp * (2 * start.half_angle_rad) / (ramp.sum() / (rate_hz * substeps))
    return np.concatenate([np.zeros(settle), speed])


def _on_surface(
    world: FingerWorld,
    surface: Surface,
    start: Start,
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


def _in_vain(low: Vector, start: Start, procedure: Procedure, rate_hz: float) -> Motion:
    """Where nothing is met the joint turns the finger on the spot."""
    speeds = _speeds(start, procedure, rate_hz, 1)
    angle = np.cumsum(speeds) / rate_hz
    turn = rotation.about_axis(start.binormal, angle)
    orientation = rotation.multiply(turn, start.orientation_xyzw)
    position = np.repeat(low[None], len(angle), axis=0)
    return Motion(position, orientation, angle - start.half_angle_rad, np.full(len(angle), -1))
