"""A kinematic oracle: an ideal sphere rolled over analytic surfaces, and what its taxels would feel.

It shares no code with the sensor and needs no physics engine: the sphere's centre obeys c' = omega x (a -
depth) n about a fixed joint axis, the normal n comes from the closest point of the surface.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import Fingertip, TouchRecording
from evifuse.touch.fingertip import spherical_fingertip

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Surface:
    """Signed distance (negative in the solid) and outward normal at points (..., 3)."""

    name: str
    k1: float
    k2: float
    distance: Callable[[Array], Array]
    normal: Callable[[Array], Array]


def plane() -> Surface:
    return Surface(
        "plane", 0.0, 0.0, lambda x: x[..., 2], lambda x: np.broadcast_to([0.0, 0.0, 1.0], x.shape)
    )


def ball(radius: float) -> Surface:
    """Dome for a positive radius, bowl for a negative one; the surface passes through the origin."""
    centre = np.array([0.0, 0.0, -radius])
    sign, size = np.sign(radius), abs(radius)

    def normal(x: Array) -> Array:
        away = x - centre
        return sign * away / np.linalg.norm(away, axis=-1, keepdims=True)

    return Surface(
        "sphere" if radius > 0 else "bowl", -1 / radius, -1 / radius,
        lambda x: sign * (np.linalg.norm(x - centre, axis=-1) - size), normal,
    )  # fmt: skip


def cylinder(radius: float, axis_rad: float = 0.0) -> Surface:
    """Lying along the direction `axis_rad`; a trough for a negative radius."""
    axis = np.array([np.cos(axis_rad), np.sin(axis_rad), 0.0])
    flat = ball(radius)

    def across(x: Array) -> Array:
        return x - (x @ axis)[..., None] * axis

    k1, k2 = (0.0, -1 / radius) if radius > 0 else (-1 / radius, 0.0)
    return Surface(
        "cylinder" if radius > 0 else "trough", k1, k2,
        lambda x: flat.distance(across(x)), lambda x: flat.normal(across(x)),
    )  # fmt: skip


def quadric(k1: float, k2: float) -> Surface:
    """z = (k1 x^2 + k2 y^2) / 2, by Newton's method for the closest point."""
    k = np.array([k1, k2])

    def foot(x: Array) -> Array:
        q = x[..., :2].copy()
        for _ in range(4):
            rise = 0.5 * (k * q * q).sum(-1) - x[..., 2]
            gradient = q - x[..., :2] + rise[..., None] * k * q
            h11 = 1 + rise * k1 + (k1 * q[..., 0]) ** 2
            h22 = 1 + rise * k2 + (k2 * q[..., 1]) ** 2
            h12 = k1 * k2 * q[..., 0] * q[..., 1]
            g1, g2 = gradient[..., 0], gradient[..., 1]
            det = h11 * h22 - h12**2
            q = q - np.stack([h22 * g1 - h12 * g2, h11 * g2 - h12 * g1], axis=-1) / det[..., None]
        return np.concatenate([q, 0.5 * (k * q * q).sum(-1, keepdims=True)], axis=-1)

    def normal(x: Array) -> Array:
        q = foot(x)
        up = np.concatenate([-k * q[..., :2], np.ones_like(q[..., :1])], axis=-1)
        return up / np.linalg.norm(up, axis=-1, keepdims=True)

    def distance(x: Array) -> Array:  # first order is enough for depths of micrometres
        slope = np.linalg.norm(k * x[..., :2], axis=-1)
        return (x[..., 2] - 0.5 * (k * x[..., :2] ** 2).sum(-1)) / np.sqrt(1 + slope**2)

    return Surface("saddle", max(k1, k2), min(k1, k2), distance, normal)


def quaternion(axis: Array, angle: Array) -> Array:
    return np.concatenate([np.sin(angle / 2)[:, None] * axis, np.cos(angle / 2)[:, None]], axis=1)


def rolled(
    surface: Surface,
    directions_rad: tuple[float, ...] = (0.0, np.pi / 4, np.pi / 2, 3 * np.pi / 4),
    *,
    tip: Fingertip | None = None,
    turn_rad: float = 0.35,
    slip: float = 0.0,
    depth_m: float = 6e-5,
    samples: int = 400,
    lift_m: float = 0.004,
    smear_m: float = 0.0,
    pressure_noise_pa: float = 0.0,
    position_noise_m: float = 0.0,
    angle_noise_rad: float = 0.0,
    offset_m: tuple[float, float, float] = (0.0, 0.0, 0.0),
    seed: int = 0,
) -> TouchRecording:
    """Roll through the origin in each direction, lifted in between; psi runs from -turn to +turn."""
    tip = tip or spherical_fingertip()
    parts = _all_rolls(surface, tip.radius_m - depth_m, np.array(directions_rad), turn_rad, slip, samples)
    lifted = max(samples // 8, 2)
    centre, spin, psi = [], [], []
    for c, axis, angle in parts:
        up = lift_m * np.sin(np.pi * (np.arange(lifted) + 1) / (lifted + 1))[:, None] * [0.0, 0.0, 1.0]
        q = quaternion(axis, angle)
        centre += [c[:1] + up, c, c[-1:] + up]
        spin += [np.repeat(q[:1], lifted, 0), q, np.repeat(q[-1:], lifted, 0)]
        psi += [np.repeat(angle[:1], lifted), angle, np.repeat(angle[-1:], lifted)]
    position, orientation, joint = np.concatenate(centre), np.concatenate(spin), np.concatenate(psi)
    pressure = felt(surface, tip, position, orientation, smear_m)
    rng = np.random.default_rng(seed)
    pressure = np.maximum(pressure + pressure_noise_pa * rng.standard_normal(pressure.shape), 0.0)
    position = position + position_noise_m * rng.standard_normal(position.shape) + np.array(offset_m)
    wobble = angle_noise_rad * rng.standard_normal((len(joint), 3))
    orientation = _multiply(np.concatenate([wobble / 2, np.ones((len(joint), 1))], axis=1), orientation)
    orientation /= np.linalg.norm(orientation, axis=1, keepdims=True)
    time = np.arange(len(joint), dtype=np.int64) * 1_000_000 + 1_700_000_000_000_000_000
    return TouchRecording(tip, time, position, orientation, joint, pressure, surface.name)


def felt(surface: Surface, tip: Fingertip, position: Array, orientation: Array, smear_m: float) -> Array:
    """Pressure of each taxel: 1e8 Pa per metre of depth, spread over its neighbours."""
    x, y, z, w = orientation.T
    matrix = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    ).transpose(2, 0, 1)
    taxels = position[:, None, :] + np.einsum("tij,nj->tni", matrix, tip.positions_m)
    pressure = 1e8 * np.maximum(-surface.distance(taxels), 0.0)
    if smear_m:
        gap = np.linalg.norm(tip.positions_m[:, None] - tip.positions_m[None], axis=-1)
        kernel = np.exp(-0.5 * (gap / smear_m) ** 2)
        pressure = pressure @ (kernel / kernel.sum(axis=0))
    return pressure


def joined(*recordings: TouchRecording) -> TouchRecording:
    """One recording after the other, with the clock going on."""
    pressure = np.concatenate([r.pressure_pa for r in recordings])
    time = np.arange(len(pressure), dtype=np.int64) * 1_000_000 + recordings[0].time_ns[0]
    return TouchRecording(
        recordings[0].fingertip, time, np.concatenate([r.position_m for r in recordings]),
        np.concatenate([r.orientation_xyzw for r in recordings]),
        np.concatenate([r.joint_angle_rad for r in recordings]), pressure, recordings[0].name,
    )  # fmt: skip


def _all_rolls(
    surface: Surface, reach: float, directions: Array, turn: float, slip: float, samples: int
) -> list[tuple[Array, Array, Array]]:
    """Centre path, joint axis and joint angle of each roll; the middle of all is over the origin."""
    axes = np.stack([-np.sin(directions), np.cos(directions), np.zeros(len(directions))], axis=1)
    both = np.concatenate([-axes, axes])  # backwards from the middle, then forwards
    steps = 150
    h = turn / steps * (1 - slip)
    path = [np.broadcast_to([0.0, 0.0, reach], both.shape)]
    for _ in range(steps):
        c = path[-1]
        half = c + 0.5 * h * np.cross(both, reach * surface.normal(c))
        c = c + h * np.cross(both, reach * surface.normal(half))
        normal = surface.normal(c)
        path.append(c - surface.distance(c - reach * normal)[:, None] * normal)
    ways = np.array(path)
    angle = np.linspace(-turn, turn, samples)
    grid = np.linspace(-turn, turn, 2 * steps + 1)
    parts = []
    for i, axis in enumerate(axes):
        whole = np.concatenate([ways[:0:-1, i], ways[:, i + len(axes)]])
        parts.append((np.stack([np.interp(angle, grid, x) for x in whole.T], axis=1), axis, angle))
    return parts


def _multiply(p: Array, q: Array) -> Array:
    """Quaternion product, xyzw."""
    pv, pw, qv, qw = p[:, :3], p[:, 3:], q[:, :3], q[:, 3:]
    return np.concatenate(
        [pw * qv + qw * pv + np.cross(pv, qv), pw * qw - (pv * qv).sum(1, keepdims=True)], axis=1
    )
