"""What a real recording suffers from: noise, slip, lost contact, slow poses and gaps."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import UsageError
from evifuse.recordings import rotation
from evifuse.recordings.recording import TouchRecording
from evifuse.simulation.rolling import Motion

__all__ = ["NOISES", "Noise", "disturbed", "gap", "noisy"]

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
        Share of the finger's turn that is lost to slip, in bursts of 50 ms, in [0, 0.4]. The finger travels
        as before but turns less.
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
    motion: Motion, radius_m: float, noise: Noise, rate_hz: float, seed: np.random.SeedSequence
) -> Motion:
    """What slip and lost contact make of a motion.

    Parameters
    ----------
    motion : Motion
        Ideal motion.
    radius_m : float
        Radius of the fingertip, metres.
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
    phase = motion.phase.copy()
    for number in range(int(phase.max(initial=-1)) + 1):
        samples = np.flatnonzero(motion.phase == number)
        if not len(samples):
            continue
        if noise.slip > 0:
            orientation[samples] = _slipped(motion, samples, radius_m, noise.slip, rate_hz, generator)
        jumps = generator.poisson(noise.loss_of_contact * len(samples) / rate_hz)
        length = max(2, round(LIFTED_S * rate_hz))
        for begin in generator.integers(0, max(1, len(samples) - length), jumps):
            lifted = samples[begin : begin + length]
            height = LIFTED_M * np.sin(np.pi * (np.arange(len(lifted)) + 0.5) / length)
            position[lifted] += height[:, None] * motion.normal[lifted]
            phase[lifted] = -1
    return replace(motion, position_m=position, orientation_xyzw=orientation, phase=phase)


def _slipped(
    motion: Motion,
    samples: NDArray[np.int64],
    radius_m: float,
    slip: float,
    rate_hz: float,
    generator: np.random.Generator,
) -> NDArray[np.float64]:
    """Orientations of a roll when the finger turns back on the spot for a share of its way."""
    normal = motion.normal[samples]
    contact = motion.position_m[samples] - radius_m * normal
    step = np.diff(contact, axis=0, prepend=contact[:1])
    bursts = np.arange(len(samples)) / (BURST_S * rate_hz) + generator.uniform(0, 2)
    slipping = np.where(np.floor(bursts) % 2 == 0, 2 * slip, 0.0)
    lost = np.cumsum(slipping[:, None] * np.cross(normal, step) / radius_m, axis=0)
    angle = np.linalg.norm(lost, axis=1)
    axis = lost / np.maximum(angle, 1e-300)[:, None]
    return rotation.multiply(rotation.about_axis(axis, -angle), motion.orientation_xyzw[samples])


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
