"""Rolling without slip and without spin of one smooth surface on another: exact kinematics, no forces.

With n the outward normal of the touched surface, S its curvature tensor (concave up positive) and B that of
the finger (convex positive), they keep a common tangent plane only if a turn ``omega`` of the finger moves
the contact by ``v = (B - S)^-1 (omega x n)``: Montana's contact equations (1988) in the world frame. Many
rolls are advanced together, each along the plane in which it was commanded.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings import rotation
from evifuse.simulation.surface import Points, Surface
from evifuse.touch.fingersurface import FingerSurface
from evifuse.touch.quadrics import unit_rows

__all__ = [
    "Contact",
    "Paths",
    "curvature_tensors",
    "put_down",
    "relative_curvature",
    "roll_paths",
    "shortest_turn",
]

Vector = NDArray[np.float64]
STEPS = 50
"""Steps from the site to either end of a roll."""


@dataclass(frozen=True)
class Contact:
    """M fingers that touch, each in one point.

    Parameters
    ----------
    point_m, normal : ndarray of float64, shape (M, 3)
        The touched points, world frame, metres, and the outward normals there.
    finger_m : ndarray of float64, shape (M, 3)
        The same points in the fingertip frame, metres.
    orientation_xyzw : ndarray of float64, shape (M, 4)
        Orientations of the fingertip.
    """

    point_m: Vector
    normal: Vector
    finger_m: Vector
    orientation_xyzw: Vector

    def centre_m(self, depth_m: float) -> Vector:
        """Origin of the fingertip frame when the finger is pressed in by a depth.

        Parameters
        ----------
        depth_m : float
            How deep, metres.

        Returns
        -------
        ndarray of float64, shape (M, 3)
            World frame, metres.
        """
        return self.point_m - rotation.rotate(self.orientation_xyzw, self.finger_m) - depth_m * self.normal


@dataclass(frozen=True)
class Paths:
    """M rolls of K = 2 `STEPS` + 1 stations each; the middle one is at the site.

    Parameters
    ----------
    arc_m : ndarray of float64, shape (M, K)
        Length of the contact's way from the site, negative before it, metres.
    turn_rad : ndarray of float64, shape (M, K)
        Angle by which the finger has rolled since the site, radians.
    contact : tuple of Contact
        K contacts of all M rolls.
    fits : ndarray of bool, shape (M, K)
        Whether the finger is more curved than the surface there in every direction.
    """

    arc_m: Vector
    turn_rad: Vector
    contact: tuple[Contact, ...]
    fits: NDArray[np.bool_]


def curvature_tensors(surface: Surface, points: Points, normals: Points) -> Vector:
    """Curvature tensors of many points at once, from how the normals turn.

    Parameters
    ----------
    surface : Surface
        The surface.
    points, normals : ndarray of float64, shape (M, 3)
        Points of it, metres, and the normals there.

    Returns
    -------
    ndarray of float64, shape (M, 3, 3)
        What `Surface.curvature_tensor` gives for each, by central differences over `Surface.probe_m`.
    """
    axes = _tangents(normals)
    probe = surface.probe_m
    shifted = points + probe * np.concatenate([axes, -axes])
    turned = surface.nearest(shifted.reshape(-1, 3))[1].reshape(2, 2, -1, 3)
    change = (turned[0] - turned[1]) / (2 * probe)
    inside = -np.einsum("ami,bmi->mab", change, axes)
    inside: Vector = (inside + inside.transpose(0, 2, 1)) / 2
    return np.einsum("ami,mab,bmj->mij", axes, inside, axes)


def put_down(finger: FingerSurface, pole_m: Vector, points: Points, normals: Points) -> Contact:
    """Put the finger down with its pole on each of many points, upright for a normal along z.

    Parameters
    ----------
    finger : FingerSurface
        The finger.
    pole_m : ndarray of float64, shape (3,)
        The point of it that touches, fingertip frame, metres.
    points, normals : ndarray of float64, shape (M, 3)
        Where, world frame, metres, and the outward normals there.

    Returns
    -------
    Contact
        M contacts.
    """
    pole, facing = finger.project(pole_m[None])
    straight = shortest_turn(facing, np.array([[0.0, 0.0, -1.0]]))
    tilt = shortest_turn(np.broadcast_to([0.0, 0.0, 1.0], normals.shape), normals)
    turned = rotation.multiply(tilt, np.broadcast_to(straight, tilt.shape))
    return Contact(points, normals, np.repeat(pole, len(points), axis=0), turned)


def roll_paths(
    surface: Surface, finger: FingerSurface, start: Contact, binormals: Vector, reach_m: Vector
) -> Paths:
    """Roll to both sides of the sites.

    Parameters
    ----------
    surface : Surface
        What is touched.
    finger : FingerSurface
        What rolls.
    start : Contact
        M contacts at the sites.
    binormals : ndarray of float64, shape (M, 3)
        Unit normals of the planes in which the fingers are to roll.
    reach_m : ndarray of float64, shape (M,)
        Length of the contact's way to either side, metres.

    Returns
    -------
    Paths
        The rolls, by the midpoint rule in steps of equal length.
    """
    count = len(reach_m)
    both = _stack(start, start)
    axes = np.concatenate([binormals, binormals])
    step = np.concatenate([-reach_m, reach_m]) / STEPS
    states, turns, fits = [both], [np.zeros(2 * count)], []
    rates = _rates(surface, finger, both, axes)
    for _ in range(STEPS):
        middle = _moved(surface, finger, both, rates, step / 2)
        halfway = _rates(surface, finger, middle, axes)
        before = both.orientation_xyzw * [-1.0, -1.0, -1.0, 1.0]
        both = _moved(surface, finger, both, halfway, step)
        half = np.linalg.norm(rotation.multiply(both.orientation_xyzw, before)[:, :3], axis=1)
        turns.append(turns[-1] + np.sign(step) * 2 * np.arcsin(np.minimum(half, 1.0)))
        states.append(both)
        fits.append(rates[2] & halfway[2])
        rates = _rates(surface, finger, both, axes)
    fits.append(rates[2])
    back, ahead = slice(0, count), slice(count, None)
    contacts = [_pick(state, back) for state in states[:0:-1]] + [_pick(state, ahead) for state in states]
    turn = np.array([t[back] for t in turns[:0:-1]] + [t[ahead] for t in turns]).T
    well = np.array([f[back] for f in fits[:0:-1]] + [f[ahead] for f in fits]).T
    return Paths(np.outer(reach_m, np.linspace(-1, 1, 2 * STEPS + 1)), turn, tuple(contacts), well)


def relative_curvature(surface: Surface, finger: FingerSurface, now: Contact, axes: Vector) -> Vector:
    """How much more curved the fingers are than the surface: what the gap beside a contact grows with.

    Parameters
    ----------
    surface : Surface
        What is touched.
    finger : FingerSurface
        What touches.
    now : Contact
        M contacts.
    axes : ndarray of float64, shape (M, 3)
        A unit tangent of each; the other is it crossed with the normal.

    Returns
    -------
    ndarray of float64, shape (M, 2, 2)
        B - S in these axes, 1/m.
    """
    operators, tangents = finger.shape_operators(now.finger_m)
    turned = rotation.to_matrix(now.orientation_xyzw) @ tangents
    bent = turned @ operators @ turned.transpose(0, 2, 1)
    relative = bent - curvature_tensors(surface, now.point_m, now.normal)
    across = np.stack([axes, rotation.cross(axes, now.normal)], axis=1)
    return across @ relative @ across.transpose(0, 2, 1)


def _rates(
    surface: Surface, finger: FingerSurface, now: Contact, axes: Vector
) -> tuple[Vector, Vector, NDArray[np.bool_]]:
    """Per metre of way: how the contact moves and how the finger turns (M, 3); and whether it fits."""
    normal = now.normal
    axis = axes - np.sum(axes * normal, axis=1, keepdims=True) * normal
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    inside = relative_curvature(surface, finger, now, axis)
    across = np.stack([axis, rotation.cross(axis, normal)], axis=1)
    trace = inside[:, 0, 0] + inside[:, 1, 1]
    determinant = inside[:, 0, 0] * inside[:, 1, 1] - inside[:, 0, 1] ** 2
    fits = (trace > 0) & (determinant > 0)
    # (B - S)^-1 of the unit vector across the axis, up to the determinant; straight on where nothing fits
    way = np.stack([-inside[:, 0, 1], inside[:, 0, 0]], axis=1)
    way = np.where(fits[:, None], way, [0.0, 1.0])
    length = np.linalg.norm(way, axis=1, keepdims=True)
    speed = np.where(fits, determinant, 0.0)[:, None] / np.maximum(length, 1e-300)
    return np.einsum("ma,mai->mi", way / length, across), speed * axis, fits


def _moved(
    surface: Surface,
    finger: FingerSurface,
    now: Contact,
    rates: tuple[Vector, Vector, NDArray[np.bool_]],
    step_m: Vector,
) -> Contact:
    """The contacts a step further: back on both surfaces, and facing each other exactly."""
    way, turn = step_m[:, None] * rates[0], step_m[:, None] * rates[1]
    point, normal = surface.nearest(now.point_m + way)
    inverse = now.orientation_xyzw * [-1.0, -1.0, -1.0, 1.0]
    on_finger, facing = finger.project(now.finger_m + rotation.rotate(inverse, way))
    quaternion = rotation.multiply(_small_turn(turn), now.orientation_xyzw)
    aligned = rotation.multiply(shortest_turn(rotation.rotate(quaternion, facing), -normal), quaternion)
    return Contact(point, normal, on_finger, aligned / np.linalg.norm(aligned, axis=1, keepdims=True))


def _small_turn(turn: Vector) -> Vector:
    angle = np.linalg.norm(turn, axis=1, keepdims=True)
    return np.concatenate([turn / 2 * np.sinc(angle / (2 * np.pi)), np.cos(angle / 2)], axis=1)


def shortest_turn(start: Vector, end: Vector) -> Vector:
    """Shortest rotations that take unit vectors to others; opposite ones turn about x or y.

    Parameters
    ----------
    start, end : ndarray of float64, shape (M, 3)
        Unit vectors.

    Returns
    -------
    ndarray of float64, shape (M, 4)
        Unit quaternions, ``xyzw``.
    """
    start, end = np.broadcast_arrays(start, end)
    cosine = np.sum(start * end, axis=1, keepdims=True)
    quaternion = np.concatenate([rotation.cross(start, end), 1 + cosine], axis=1)
    aside = np.where(np.abs(start[:, :1]) < 0.9, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    opposite = np.concatenate([rotation.cross(start, aside), np.zeros_like(cosine)], axis=1)
    return unit_rows(np.where(cosine > -1 + 1e-12, quaternion, opposite))


def _tangents(normals: Points) -> Vector:
    """Two unit tangents (2, M, 3) of each normal."""
    start = np.where(np.abs(normals[:, :1]) < 0.7, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    first = unit_rows(rotation.cross(normals, start))
    return np.stack([first, rotation.cross(normals, first)])


def _stack(a: Contact, b: Contact) -> Contact:
    return Contact(*(np.concatenate([x, vars(b)[key]]) for key, x in vars(a).items()))


def _pick(contact: Contact, rows: slice) -> Contact:
    return Contact(*(value[rows] for value in vars(contact).values()))
