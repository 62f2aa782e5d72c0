"""What a real recording suffers from: noise, slip, lost contact, slow poses and gaps."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import UsageError
from evifuse.recordings import rotation
from evifuse.recordings.recording import TouchRecording
from evifuse.simulation.kinematics import shortest_turn
from evifuse.simulation.rolling import Motion
from evifuse.touch.fingersurface import FingerSurface

__all__ = ["NOISES", "Noise", "disturbed", "gap", "noisy"]

Vector = NDArray[np.float64]
BURST_S = 0.05
"""Length of a burst of slip, seconds: every second one slips twice as much, the others not at all."""
LIFTED_S, LIFTED_M = 0.03, 1e-3
"""How long and how high the finger jumps when it loses contact."""


@dataclass(frozen=True)
class Noise:
    """How much of what a recording suffers from; every field is nothing by default but the camera's noise.

    Parameters
    ----------
    pressure_pa : float
        Standard deviation on every taxel, pascals.
    position_m : float
        Standard deviation on the finger's position, metres per axis.
    angle_rad : float
        Standard deviation on the finger's orientation (per axis) and on the joint angle, radians.
    grey : float
        Standard deviation on every pixel, grey levels of 255.
    pressure_share : float
        Standard deviation on every taxel, as a share of its own reading.
    slip : float
        Share of the way over the finger that is lost to slip, in bursts of 50 ms, in [0, 0.4]. The contact
        travels over the surface as before, but the finger turns less.
    loss_of_contact : float
        How often the finger jumps off the surface for 30 ms, times per second of rolling.
    pose_rate_hz : float or None
        Rate of the poses and joint angles, when it is lower than that of the pressures; between them they
        are interpolated, as the readers do.
    gap_s : float
        Length of one gap somewhere in the recording, seconds.
    """

    pressure_pa: float = 0.0
    position_m: float = 0.0
    angle_rad: float = 0.0
    grey: float = 1.5
    pressure_share: float = 0.0
    slip: float = 0.0
    loss_of_contact: float = 0.0
    pose_rate_hz: float | None = None
    gap_s: float = 0.0

    def checked(self) -> "Noise":
        """This, if every field is possible.

        Returns
        -------
        Noise
            Itself.

        Raises
        ------
        UsageError
            If a field is negative, or the slip above 0.4.
        """
        for key, value in vars(self).items():
            if value is not None and not (np.isfinite(value) and value >= 0):
                raise UsageError(f"{key} of the noise must be 0 or more, not {value:g}")
        if self.slip > 0.4:
            raise UsageError(f"slip of the noise is a share of the turn of at most 0.4, not {self.slip:g}")
        if self.pose_rate_hz is not None and self.pose_rate_hz < 10:
            raise UsageError(f"pose_rate_hz of the noise must be at least 10, not {self.pose_rate_hz:g}")
        return self


NOISES = {
    "none": Noise(),
    "modest": Noise(pressure_pa=200.0, position_m=2e-5, angle_rad=2e-3),
    "strong": Noise(pressure_pa=1000.0, position_m=1e-4, angle_rad=1e-2),
}
"""Named levels of noise."""


def disturbed(
    motion: Motion, finger: FingerSurface, noise: Noise, rate_hz: float, seed: np.random.SeedSequence
) -> Motion:
    """What slip and lost contact make of a motion.

    Parameters
    ----------
    motion : Motion
        Ideal motion.
    finger : FingerSurface
        What rolls.
    noise : Noise
        How much.
    rate_hz : float
        Samples per second.
    seed : numpy.random.SeedSequence
        Where the chance comes from.

    Returns
    -------
    Motion
        The motion with them.
    """
    generator = np.random.default_rng(seed)
    position, orientation = motion.position_m.copy(), motion.orientation_xyzw.copy()
    phase, touched = motion.phase.copy(), motion.finger_m.copy()
    rolls = [np.flatnonzero(motion.phase == number) for number in range(int(phase.max(initial=-1)) + 1)]
    rolls = [samples for samples in rolls if len(samples)]
    ends = [int(samples[0]) for samples in rolls[1:]] + [len(phase)]
    for samples, end in zip(rolls, ends, strict=True):
        if noise.slip > 0:
            share = _slipping(len(samples), noise.slip, rate_hz, generator)
            touched[samples], position[samples], orientation[samples] = _slipped(
                motion, samples, finger, share
            )
            after = np.arange(samples[-1] + 1, end)
            position[after], orientation[after] = _fading(motion, position, orientation, after)
        jumps = generator.poisson(noise.loss_of_contact * len(samples) / rate_hz)
        length = max(2, round(LIFTED_S * rate_hz))
        for begin in generator.integers(0, max(1, len(samples) - length), jumps):
            lifted = samples[begin : begin + length]
            height = LIFTED_M * np.sin(np.pi * (np.arange(len(lifted)) + 0.5) / length)
            position[lifted] += height[:, None] * motion.normal[lifted]
            phase[lifted] = -1
    return replace(motion, position_m=position, orientation_xyzw=orientation, phase=phase, finger_m=touched)


def _slipping(count: int, slip: float, rate_hz: float, generator: np.random.Generator) -> Vector:
    """Share of every step that is lost: in every second burst twice as much."""
    bursts = np.arange(count) / (BURST_S * rate_hz) + generator.uniform(0, 2)
    return np.where(np.floor(bursts) % 2 == 0, 2 * slip, 0.0)


def _slipped(
    motion: Motion, samples: NDArray[np.int64], finger: FingerSurface, share: Vector
) -> tuple[Vector, Vector, Vector]:
    """Contacts on the finger, positions and orientations of a roll that slips for a share of every step.

    The contact goes the same way over the surface, but not as far over the finger, which is turned by the
    shortest way until it faces the surface there.
    """
    touched, normal = motion.finger_m[samples], motion.normal[samples]
    step = np.linalg.norm(np.diff(touched, axis=0, prepend=touched[:1]), axis=1)
    arc, gone = np.cumsum(step), np.cumsum((1 - share) * step)
    behind = np.stack([np.interp(gone, arc, column) for column in touched.T], axis=1)
    behind, facing = finger.project(behind)
    before = motion.orientation_xyzw[samples]
    after = rotation.multiply(shortest_turn(rotation.rotate(before, facing), -normal), before)
    moved = rotation.rotate(before, touched) - rotation.rotate(after, behind)
    return behind, motion.position_m[samples] + moved, after


def _fading(
    motion: Motion, position: Vector, orientation: Vector, after: NDArray[np.int64]
) -> tuple[Vector, Vector]:
    """Poses on the way to the next roll, which starts as if nothing had slipped."""
    if not len(after):
        return position[after], orientation[after]
    last = int(after[0]) - 1
    left = 1 - np.arange(1, len(after) + 1) / len(after)
    left = left * left * (3 - 2 * left)
    off = rotation.multiply(orientation[last], motion.orientation_xyzw[last] * [-1.0, -1.0, -1.0, 1.0])
    turn = rotation.interpolate(np.array([0.0, 1.0]), np.stack([[0.0, 0.0, 0.0, 1.0], off]), left)
    aside = left[:, None] * (position[last] - motion.position_m[last])
    return position[after] + aside, rotation.multiply(turn, orientation[after])


def noisy(
    touch: TouchRecording, noise: Noise, rate_hz: float, generator: np.random.Generator
) -> TouchRecording:
    """What the sensors make of what is true.

    Parameters
    ----------
    touch : TouchRecording
        True values.
    noise : Noise
        How much noise, and how often a pose comes.
    rate_hz : float
        Samples per second.
    generator : numpy.random.Generator
        Where the noise comes from.

    Returns
    -------
    TouchRecording
        Values with noise.
    """
    if noise.pressure_pa > 0:
        values = touch.pressure_pa + generator.normal(0, noise.pressure_pa, touch.pressure_pa.shape)
        touch = replace(touch, pressure_pa=values)
    if noise.pressure_share > 0:
        factor = 1 + noise.pressure_share * generator.standard_normal(touch.pressure_pa.shape)
        touch = replace(touch, pressure_pa=touch.pressure_pa * factor)
    if noise.position_m > 0:
        values = touch.position_m + generator.normal(0, noise.position_m, touch.position_m.shape)
        touch = replace(touch, position_m=values)
    if noise.angle_rad > 0:
        half = generator.normal(0, noise.angle_rad / 2, touch.position_m.shape)
        small = np.concatenate([half, np.ones((len(half), 1))], axis=1)
        turned = rotation.multiply(small, touch.orientation_xyzw)
        turned = turned / np.linalg.norm(turned, axis=1, keepdims=True)
        angle = touch.joint_angle_rad + generator.normal(0, noise.angle_rad, touch.joint_angle_rad.shape)
        touch = replace(touch, orientation_xyzw=turned, joint_angle_rad=angle)
    if noise.pose_rate_hz is not None and noise.pose_rate_hz < rate_hz:
        touch = _slow_poses(touch, noise.pose_rate_hz, rate_hz)
    return touch


def _slow_poses(touch: TouchRecording, pose_rate_hz: float, rate_hz: float) -> TouchRecording:
    """Poses known now and then, and interpolated between."""
    count = len(touch.time_ns)
    known = np.unique(
        np.append(np.round(np.arange(0, count, rate_hz / pose_rate_hz)), count - 1).astype(np.int64)
    )
    known = known[known < count]
    at, times = np.arange(count, dtype=np.float64), known.astype(np.float64)
    position = np.stack([np.interp(at, times, column[known]) for column in touch.position_m.T], axis=1)
    orientation = rotation.interpolate(times, touch.orientation_xyzw[known], at)
    angle = np.interp(at, times, touch.joint_angle_rad[known])
    return replace(touch, position_m=position, orientation_xyzw=orientation, joint_angle_rad=angle)


def gap(touch: TouchRecording, seconds: float, generator: np.random.Generator) -> NDArray[np.bool_]:
    """Samples that are left when some are missing in a row.

    Parameters
    ----------
    touch : TouchRecording
        T samples.
    seconds : float
        Length of the gap; at most half of the recording goes.
    generator : numpy.random.Generator
        Says where it is.

    Returns
    -------
    ndarray of bool, shape (T,)
        Whether a sample is left.
    """
    time = (touch.time_ns - touch.time_ns[0]) / 1e9
    seconds = min(seconds, 0.5 * float(time[-1]))
    begin = generator.uniform(0.1, 0.9) * (float(time[-1]) - seconds)
    return (time < begin) | (time >= begin + seconds) if seconds > 0 else np.ones(len(time), dtype=np.bool_)
