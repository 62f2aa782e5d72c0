"""Samples of touch as JSON lines.

A line holds ``time_ns``, ``position_m`` [3], ``orientation_xyzw`` [4], ``joint_angle_rad`` (may be missing)
and the pressures [N], null where a taxel gave none, with their unit in the name: ``pressure_pa``,
``pressure_kpa``, ``pressure_hpa``, ``pressure_mpa`` or ``pressure_bar``; or ``pressure`` and
``pressure_unit`` (and ``taxel_area_m2`` for newtons). Instead of the option ``--fingertip``, the first line
may be ``{"fingertip": {"radius_m": ..., "positions_m": ..., "normals": ...}}``.
"""

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import RecordingError
from evifuse.recordings.checks import checked_touch
from evifuse.recordings.recording import Fingertip, TouchRecording
from evifuse.recordings.units import to_pascal

__all__ = ["Sample", "UnknownFingertipError", "parse_fingertip", "parse_line", "parse_sample"]

_KEYS = {
    "pressure_pa": "Pa",
    "pressure_hpa": "hPa",
    "pressure_kpa": "kPa",
    "pressure_mpa": "MPa",
    "pressure_bar": "bar",
}


class UnknownFingertipError(RecordingError):
    """Nothing can be felt at all."""


@dataclass(frozen=True)
class Sample:
    """One sample of a fingertip.

    Parameters
    ----------
    time_ns : int
        UTC nanoseconds since 1970.
    pose : ndarray of float64, shape (7,)
        Position in metres and unit quaternion ``xyzw`` in the world frame.
    joint_rad : float
        Joint angle, radians; NaN if it was not given.
    pressure_pa : ndarray of float64, shape (N,)
        Pressures, pascals; NaN where a taxel gave none.
    """

    time_ns: int
    pose: NDArray[np.float64]
    joint_rad: float
    pressure_pa: NDArray[np.float64]


def parse_sample(said: Any, taxels: int, unit: str | None = None) -> Sample:
    """A sample from its JSON object.

    Parameters
    ----------
    said : Any
        The parsed line.
    taxels : int
        Number N of taxels.
    unit : str, optional
        Unit of ``pressure`` in a line that does not say it.

    Returns
    -------
    Sample
        In SI units.

    Raises
    ------
    RecordingError
        If a key is missing, or a value is not what it should be.
    """
    if not isinstance(said, dict):
        raise RecordingError("it is not a JSON object with time_ns, position_m, ...")
    for key in ("time_ns", "position_m", "orientation_xyzw"):
        if key not in said:
            raise RecordingError(f"{key!r} is missing")
    if type(said["time_ns"]) is not int or not 0 <= said["time_ns"] < 2**63:
        raise RecordingError("time_ns must be whole nanoseconds since 1970")
    pose = np.concatenate([_numbers(said, "position_m", 3), _numbers(said, "orientation_xyzw", 4)])
    length = float(np.linalg.norm(pose[3:]))
    if abs(length - 1) > 0.01:
        raise RecordingError(f"orientation_xyzw must have length 1, not {length:.3g}")
    pose[3:] /= length
    joint = float("nan")
    if said.get("joint_angle_rad") is not None:
        joint = float(_numbers({"joint_angle_rad": [said["joint_angle_rad"]]}, "joint_angle_rad", 1)[0])
    return Sample(said["time_ns"], pose, joint, _pressure(said, taxels, unit))


def _numbers(said: dict[str, Any], key: str, count: int, some: bool = False) -> NDArray[np.float64]:
    """Numbers of a line; with ``some`` not all of them need to be there."""
    try:
        values = np.array(said[key], dtype=np.float64)
    except (TypeError, ValueError):
        values = np.zeros(0)
    if values.shape != (count,):
        raise RecordingError(f"{key} must be {count} numbers")
    if np.isinf(values).any() or (np.isnan(values).all() if some else np.isnan(values).any()):
        raise RecordingError(f"{key} is NaN or infinite")
    return values


def _pressure(said: dict[str, Any], taxels: int, unit: str | None) -> NDArray[np.float64]:
    for key, own in _KEYS.items():
        if key in said:
            return to_pascal(_numbers(said, key, taxels, some=True), unit or own, name=key)
    if "pressure" not in said:
        raise RecordingError("'pressure_pa' is missing: the name of the pressures ends with their unit")
    if unit is None and "pressure_unit" not in said:
        raise RecordingError(
            "'pressure' has no unit: add 'pressure_unit', name it 'pressure_pa', or give --unit"
        )
    area = _numbers({"taxel_area_m2": [said.get("taxel_area_m2", 0.0)]}, "taxel_area_m2", 1)[0]
    offset = _numbers({"pressure_offset": [said.get("pressure_offset", 0.0)]}, "pressure_offset", 1)[0]
    values = _numbers(said, "pressure", taxels, some=True)
    unit = unit or str(said["pressure_unit"])
    return to_pascal(values, unit, float(area), float(offset), "pressure")


def parse_line(line: str) -> Any:
    """A line as JSON.

    Parameters
    ----------
    line : str
        The line.

    Returns
    -------
    Any
        What it holds.

    Raises
    ------
    RecordingError
        If it is not JSON.
    """
    try:
        return json.loads(line)
    except (ValueError, RecursionError) as error:
        raise RecordingError("it is not JSON") from error


def parse_fingertip(said: Any) -> Fingertip:
    """A fingertip from its JSON object.

    Parameters
    ----------
    said : Any
        With ``radius_m``, ``positions_m`` and ``normals``.

    Returns
    -------
    Fingertip
        Checked.

    Raises
    ------
    UnknownFingertipError
        If a key is missing or does not hold numbers.
    RecordingError
        If the numbers are not those of a fingertip.
    """
    try:
        tip = Fingertip(
            float(said["radius_m"]),
            np.array(said["positions_m"], dtype=np.float64),
            np.array(said["normals"], dtype=np.float64),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise UnknownFingertipError(
            "the fingertip needs the numbers radius_m, positions_m and normals"
        ) from error
    count = len(tip.positions_m)
    still = TouchRecording(
        tip,
        np.zeros(1, np.int64),
        np.zeros((1, 3)),
        np.array([[0.0, 0, 0, 1]]),
        np.zeros(1),
        np.zeros((1, count)),
        "live",
    )
    return checked_touch(still).fingertip
