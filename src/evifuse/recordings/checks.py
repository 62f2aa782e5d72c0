"""What every touch recording must satisfy, checked once at the door."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import RecordingError
from evifuse.recordings.recording import Fingertip, TouchRecording

__all__ = ["LARGEST_TIP_M", "checked_touch", "finite", "unit"]


LARGEST_TIP_M = 0.3
"""No fingertip is larger."""


def checked_touch(recording: TouchRecording) -> TouchRecording:
    """Check a touch recording and make its arrays contiguous, of the right type and its directions unit.

    Parameters
    ----------
    recording : TouchRecording
        What a reader put together, metres, radians, pascals.

    Returns
    -------
    TouchRecording
        The same recording, with normals and orientations of length 1.

    Raises
    ------
    RecordingError
        If there is no sample or no taxel, shapes disagree, a number is NaN or infinite (but a joint angle
        that is NaN throughout: it was not recorded), times do not increase, the radius is not positive, or a
        normal or orientation is far from unit length.
    """
    name = recording.name
    fingertip = _checked_fingertip(recording.fingertip, name)
    taxels = len(fingertip.positions_m)
    time = np.ascontiguousarray(recording.time_ns)
    if time.ndim != 1 or not np.issubdtype(time.dtype, np.integer):
        raise RecordingError(
            f"{name}: time_ns must be whole nanoseconds of shape (T,), not {time.dtype} {time.shape}"
        )
    samples = len(time)
    if samples == 0:
        raise RecordingError(f"{name}: the recording has no samples (T = 0): record at least one roll")
    time = time.astype(np.int64)
    late = np.flatnonzero(np.diff(time) <= 0)
    if len(late):
        raise RecordingError(
            f"{name}: time_ns does not increase at sample {late[0] + 1} "
            f"({time[late[0] + 1]} after {time[late[0]]}): sort the samples and remove repeats"
        )
    return replace(
        recording,
        fingertip=fingertip,
        time_ns=time,
        position_m=finite(recording.position_m, "position_m", (samples, 3), name),
        orientation_xyzw=unit(
            finite(recording.orientation_xyzw, "orientation_xyzw", (samples, 4), name),
            "orientation_xyzw",
            name,
        ),
        joint_angle_rad=_joint(recording.joint_angle_rad, samples, name),
        pressure_pa=finite(recording.pressure_pa, "pressure_pa", (samples, taxels), name),
    )


def _joint(angle: NDArray[np.float64], samples: int, name: str) -> NDArray[np.float64]:
    """Joint angles (T,), or NaN throughout."""
    angle = np.asarray(angle)
    if angle.shape == (samples,) and angle.dtype.kind == "f" and np.isnan(angle).all():
        return np.full(samples, np.nan)
    return finite(angle, "joint_angle_rad", (samples,), name)


def _checked_fingertip(fingertip: Fingertip, name: str) -> Fingertip:
    radius = float(fingertip.radius_m)
    if not (np.isfinite(radius) and 0 < radius < 1):
        raise RecordingError(
            f"{name}: the fingertip radius must be in (0, 1) m, not {radius:g}: give it in metres"
        )
    shape = np.shape(fingertip.positions_m)
    if len(shape) != 2 or shape[1] != 3 or shape[0] == 0:
        raise RecordingError(f"{name}: taxel positions must have shape (N, 3) with N >= 1, not {shape}")
    positions = finite(fingertip.positions_m, "taxel positions", shape, name)
    extent = float(np.ptp(positions, axis=0).max())
    if extent > LARGEST_TIP_M:
        raise RecordingError(f"{name}: the taxels lie {extent:.3g} m apart: give their positions in metres")
    normals = finite(fingertip.normals, "taxel normals", shape, name)
    return Fingertip(radius, positions, unit(normals, "taxel normals", name))


def finite(values: object, what: str, shape: tuple[int, ...], name: str) -> NDArray[np.float64]:
    """Check that numbers are finite and in the expected shape.

    Parameters
    ----------
    values : array_like of float
        The numbers.
    what : str
        What they are, for messages.
    shape : tuple of int
        The shape they must have.
    name : str
        Where they come from, for messages.

    Returns
    -------
    ndarray of float64
        The numbers, contiguous.

    Raises
    ------
    RecordingError
        If the shape is another one or a number is NaN or infinite.
    """
    raw = np.asarray(values)
    if raw.dtype.kind not in "iuf":
        raise RecordingError(f"{name}: {what} must be real numbers, not {raw.dtype}")
    array = np.ascontiguousarray(raw, dtype=np.float64)
    if array.shape != shape:
        raise RecordingError(f"{name}: {what} must have shape {shape}, not {array.shape}")
    if not np.isfinite(array).all():
        row = int(np.argwhere(~np.isfinite(array))[0][0])
        raise RecordingError(f"{name}: {what} is NaN or infinite at row {row}: remove or repair that sample")
    return array


def unit(vectors: NDArray[np.float64], what: str, name: str) -> NDArray[np.float64]:
    """Check that vectors or quaternions have length 1 within 1 %, and make it exact.

    Parameters
    ----------
    vectors : ndarray of float64, shape (M, D)
        The vectors.
    what : str
        What they are, for messages.
    name : str
        Where they come from, for messages.

    Returns
    -------
    ndarray of float64, shape (M, D)
        The vectors, of length 1.

    Raises
    ------
    RecordingError
        If one is longer or shorter.
    """
    with np.errstate(over="ignore"):
        length = np.linalg.norm(vectors, axis=-1)
    wrong = np.flatnonzero(np.abs(length - 1) > 0.01)
    if len(wrong):
        raise RecordingError(
            f"{name}: {what} must have length 1, but row {wrong[0]} has length {length[wrong[0]]:.3g}"
        )
    return vectors / length[..., None]
