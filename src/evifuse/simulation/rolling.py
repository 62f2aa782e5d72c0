"""The exploratory procedure: at every site the finger is lowered, rolled and lifted, once per direction."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings import rotation
from evifuse.simulation.kinematics import Contact
from evifuse.simulation.physics import FingerWorld
from evifuse.simulation.procedure import Finger, Procedure, Roll, plan_rolls
from evifuse.simulation.surface import Surface

__all__ = ["Control", "Motion", "roll_finger"]

Control = Literal["force", "pose"]
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
    normal : ndarray of float64, shape (T, 3)
        While the finger is rolling on the surface, its normal in the contact; else zeros.
    finger_m : ndarray of float64, shape (T, 3)
        While the finger is rolling on the surface, where it touches, fingertip frame, metres; else zeros.
    """

    position_m: Vector
    orientation_xyzw: Vector
    joint_angle_rad: Vector
    phase: NDArray[np.int64]
    normal: Vector
    finger_m: Vector


def roll_finger(
    surface: Surface,
    finger: Finger,
    sites: tuple[tuple[float, ...], ...],
    procedure: Procedure,
    rate_hz: float,
    control: Control,
) -> Motion:
    """Explore a surface.

    Parameters
    ----------
    surface : Surface
        What is touched.
    finger : Finger
        What touches.
    sites : tuple of (x, y) or (x, y, z)
        Where to roll, metres.
    procedure : Procedure
        Directions and timing.
    rate_hz : float
        Samples per second.
    control : {"force", "pose"}
        Pressed with a force and driven by friction in MuJoCo, or led along the ideal roll.

    Returns
    -------
    Motion
        The finger's way, with one roll per site and direction, sites outermost.
    """
    rolls = plan_rolls(surface, finger, sites, procedure)
    world = None
    if control == "force":
        substeps = max(1, round(1000 / rate_hz))
        timestep = 1 / (rate_hz * substeps)
        world = FingerWorld(surface, finger.tip.radius_m, timestep, procedure.press_n)
    pieces: list[Motion] = []
    pose = _above(finger, rolls[0], 3 * procedure.clearance_m)
    for number, roll in enumerate(rolls):
        pieces.extend(_one_roll(world, surface, finger, roll, pose, number, procedure, rate_hz))
        pose = _end(pieces[-1])
    return Motion(*(np.concatenate([vars(piece)[key] for piece in pieces]) for key in vars(pieces[0])))


def _above(finger: Finger, roll: Roll, height_m: float) -> Pose:
    first = Contact(*(values[:1] for values in vars(roll.contact).values()))
    centre = first.centre_m(0.0)[0] + height_m * first.normal[0]
    return centre, first.orientation_xyzw[0], float(roll.turn_rad[0])


def _end(piece: Motion) -> Pose:
    return piece.position_m[-1], piece.orientation_xyzw[-1], float(piece.joint_angle_rad[-1])


def _one_roll(
    world: FingerWorld | None,
    surface: Surface,
    finger: Finger,
    roll: Roll,
    pose: Pose,
    number: int,
    procedure: Procedure,
    rate_hz: float,
) -> Iterator[Motion]:
    """Transfer, lower, settle, roll, lift."""
    high = _above(finger, roll, procedure.clearance_m)
    low = _above(finger, roll, 0.0 if roll.solid else -procedure.depth_m)
    aside = _through_air(pose, high, procedure.transfer_s, rate_hz)
    up = np.array([0.0, 0.0, 1.0]) if surface.around is None else roll.contact.normal[0]
    yield _clear_of(surface, finger.extent_m + procedure.clearance_m / 2, aside, up)
    yield _through_air(high, low, procedure.lower_s, rate_hz)
    if not roll.solid:
        rolled = _in_vain(low[0], roll, procedure, rate_hz)
    elif world is None:
        rolled = _led(roll, number, procedure, rate_hz)
    else:
        world.place(low[0], low[1], roll.depth_m)
        rolled = _on_surface(world, surface, roll, number, procedure, rate_hz)
    yield rolled
    end = _end(rolled)
    up = rolled.normal[-1] if roll.solid else roll.contact.normal[0]
    rise = procedure.clearance_m + (0.0 if roll.solid else procedure.depth_m)
    yield _through_air(end, (end[0] + rise * up, *end[1:]), procedure.lift_s, rate_hz)


def _through_air(start: Pose, end: Pose, seconds: float, rate_hz: float) -> Motion:
    """A smooth straight way from one pose to another, without the first sample."""
    count = max(1, round(seconds * rate_hz))
    time = np.arange(1, count + 1) / count
    way = time * time * (3 - 2 * time)
    position = start[0] + way[:, None] * (end[0] - start[0])
    orientation = rotation.interpolate(np.array([0.0, 1.0]), np.stack([start[1], end[1]]), way)
    angle = start[2] + way * (end[2] - start[2])
    none = np.zeros_like(position)
    return Motion(position, orientation, angle, np.full(count, -1), none, none)


def _clear_of(surface: Surface, distance_m: float, motion: Motion, up: Vector) -> Motion:
    """Raise the middle of a way that leads too close to the surface, such as over the top of a ball.

    Where that doesn't help, as on the way to the other side of a body, the way goes around the body.
    """
    short = distance_m - surface.distance(motion.position_m)
    way = np.arange(1, len(short) + 1) / len(short)
    arch = 4 * way * (1 - way)
    inside = (short > 0) & (arch > 0)
    if not inside.any():
        return motion
    # half as much again, because what is above a slope is not as far from it
    height = 1.5 * float(np.max(short[inside] / arch[inside]))
    raised = replace(motion, position_m=motion.position_m + np.outer(height * arch, up))
    around = surface.around
    if around is None or (surface.distance(raised.position_m) > 0.8 * distance_m)[inside].all():
        return raised
    centre, radius = around
    radius += 1.5 * distance_m
    first, last = motion.position_m[0] - centre, motion.position_m[-1] - centre
    ends = [v / max(float(np.linalg.norm(v)), 1e-9) for v in (first, last)]
    share = np.clip((way - 0.25) / 0.5, 0.0, 1.0)
    angle = float(np.arccos(np.clip(ends[0] @ ends[1], -1.0, 1.0)))
    if angle > np.pi - 1e-3:  # straight through the middle: any side will do
        ends[1] = ends[1] + 1e-2 * np.roll(ends[1], 1)
    sine = max(float(np.sin(angle)), 1e-9)
    turned = np.outer(np.sin((1 - share) * angle) / sine, ends[0]) + np.outer(
        np.sin(share * angle) / sine, ends[1]
    )
    turned /= np.maximum(np.linalg.norm(turned, axis=1, keepdims=True), 1e-9)
    out = np.clip(np.minimum(way, 1 - way) / 0.25, 0.0, 1.0)
    near = np.where(way < 0.5, np.linalg.norm(first), np.linalg.norm(last))
    outer = turned * np.maximum(near, near + out * (radius - near))[:, None]
    return replace(motion, position_m=centre + outer)


def _profile(procedure: Procedure, count: int, settle: int) -> Vector:
    """Share of the way that is done, sample by sample: settle, then speed up, roll and slow down."""
    steps = np.arange(count)
    ramp = np.minimum(1.0, np.minimum(steps + 0.5, count - steps - 0.5) / (0.1 * count))
    return np.concatenate([np.zeros(settle), np.cumsum(ramp) / ramp.sum()])


def _counts(procedure: Procedure, rate_hz: float) -> tuple[int, int]:
    """Samples of the roll, and of settling before it."""
    return round(procedure.roll_s * rate_hz), round(procedure.settle_s * rate_hz)


def _led(roll: Roll, number: int, procedure: Procedure, rate_hz: float) -> Motion:
    """Along the ideal roll: pressed in while it settles, then at the commanded speed."""
    count, settle = _counts(procedure, rate_hz)
    share = _profile(procedure, count, settle)
    arc = roll.arc_m[0] + share * (roll.arc_m[-1] - roll.arc_m[0])
    ways = roll.contact
    point, finger_m, normal = (
        np.stack([np.interp(arc, roll.arc_m, column) for column in values.T], axis=1)
        for values in (ways.point_m, ways.finger_m, ways.normal)
    )
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    orientation = rotation.interpolate(roll.arc_m, ways.orientation_xyzw, arc)
    contact = Contact(point, normal, finger_m, orientation)
    pressed = np.minimum(1.0, np.arange(1, len(arc) + 1) / max(settle, 1))
    depth = np.interp(arc, roll.arc_m, roll.gap_m) + roll.depth_m * pressed
    position = contact.centre_m(0.0) - depth[:, None] * normal
    angle = np.interp(arc, roll.arc_m, roll.turn_rad)
    return Motion(position, orientation, angle, np.full(len(arc), number), normal, finger_m)


def _on_surface(
    world: FingerWorld, surface: Surface, roll: Roll, number: int, procedure: Procedure, rate_hz: float
) -> Motion:
    substeps = max(1, round(1000 / rate_hz))
    count, settle = (substeps * size for size in _counts(procedure, rate_hz))
    whole = float(roll.turn_rad[-1] - roll.turn_rad[0])
    share = np.diff(_profile(procedure, count, settle), prepend=0.0)
    speeds = (whole * rate_hz * substeps * share).reshape(-1, substeps)
    poses, pose = np.empty((len(speeds), 7)), world.pose
    x, y, z = roll.binormal.tolist()
    binormal = (x, y, z)
    for i, sample in enumerate(speeds.tolist()):
        for speed in sample:
            world.step(binormal, speed)
        poses[i] = pose
    position, orientation = poses[:, :3], poses[:, [4, 5, 6, 3]]
    contact, normal = surface.nearest(position)
    angle = _joint_angle(contact, normal, orientation) + roll.turn_rad[0]
    finger_m = -world.radius_m * rotation.rotate(orientation * [-1.0, -1.0, -1.0, 1.0], normal)
    return Motion(position, orientation, angle, np.full(len(speeds), number), normal, finger_m)


def _joint_angle(contact: Vector, normal: Vector, orientation_xyzw: Vector) -> Vector:
    """Angle rolled about the axis perpendicular to travel: the sum of d(rotation) . (normal x tangent)."""
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


def _in_vain(low: Vector, roll: Roll, procedure: Procedure, rate_hz: float) -> Motion:
    """Where nothing is met the joint turns the finger on the spot."""
    share = _profile(procedure, *_counts(procedure, rate_hz))
    angle = roll.turn_rad[0] + share * (roll.turn_rad[-1] - roll.turn_rad[0])
    orientation = rotation.interpolate(roll.turn_rad, roll.contact.orientation_xyzw, angle)
    position = np.repeat(low[None], len(angle), axis=0)
    none = np.zeros_like(position)
    return Motion(position, orientation, angle, np.full(len(angle), -1), none, none)
