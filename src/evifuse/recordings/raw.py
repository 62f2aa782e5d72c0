"""A touch recording as its file has it: units, times and gaps as they are, nothing refused yet."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import Fingertip

__all__ = ["NOTHING_GIVEN", "Given", "RawTouch", "completed", "nothing"]


@dataclass(frozen=True)
class Given:
    """What a recording leaves open, as its owner knows it; it goes before what the file says.

    Parameters
    ----------
    fingertip : Fingertip or None
        Geometry of the fingertip.
    topics : mapping of str to str
        Topics of ``pose``, ``pressures`` and ``joint`` in an MCAP file or bag.
    unit : str or None
        Unit of the readings.
    """

    fingertip: Fingertip | None = None
    topics: Mapping[str, str] = field(default_factory=dict[str, str])
    unit: str | None = None


NOTHING_GIVEN = Given()


def nothing(*shape: int) -> NDArray[np.float64]:
    """An array for what a file lacks.

    Parameters
    ----------
    *shape : int
        With a 0 in it.

    Returns
    -------
    ndarray of float64
        Without elements.
    """
    return np.zeros(shape)


@dataclass(frozen=True)
class RawTouch:
    """What a file says about a touch, before anything is checked, converted or left out.

    Parameters
    ----------
    name : str
        Name of the file.
    time_ns : ndarray of int64, shape (T,)
        Times of the pressures, in the order of the file.
    pressure : ndarray of float64, shape (T, N)
        Readings, in ``unit``.
    unit : str
        Unit of the readings.
    area_m2 : float
        Area of a taxel, square metres; 0 if not said.
    offset : float
        Reading of an unloaded taxel.
    pose_time_ns : ndarray of int64, shape (P,)
        Times of the poses.
    pose : ndarray of float64, shape (P, 7)
        Position in metres and quaternion ``xyzw``.
    joint_time_ns : ndarray of int64, shape (J,)
        Times of the joint angles.
    joint_rad : ndarray of float64, shape (J,)
        Joint angles, radians.
    radius_m : float
        Radius of the fingertip, metres; NaN if not said.
    positions_m : ndarray of float64, shape (N, 3)
        Taxel centres, fingertip frame, metres.
    normals : ndarray of float64, shape (N, 3)
        Outward normals, fingertip frame.
    called : dict of str to str
        What the file calls ``time``, ``pose`` and ``joint``, for messages.
    lacking : dict of str to str
        Parts that are missing or can't be read (``time``, ``pose``, ``joint``, ``pressure``, ``fingertip``),
        and for each the line that says so.
    damage : str
        Why the rest of the file can't be read; empty if it is whole.
    notes : tuple of str
        What was left out already, one line each.
    """

    name: str
    time_ns: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    pressure: NDArray[np.float64] = field(default_factory=lambda: nothing(0, 0))
    unit: str = ""
    area_m2: float = 0.0
    offset: float = 0.0
    pose_time_ns: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    pose: NDArray[np.float64] = field(default_factory=lambda: nothing(0, 7))
    joint_time_ns: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))
    joint_rad: NDArray[np.float64] = field(default_factory=lambda: nothing(0))
    radius_m: float = float("nan")
    positions_m: NDArray[np.float64] = field(default_factory=lambda: nothing(0, 3))
    normals: NDArray[np.float64] = field(default_factory=lambda: nothing(0, 3))
    called: dict[str, str] = field(default_factory=dict[str, str])
    lacking: dict[str, str] = field(default_factory=dict[str, str])
    damage: str = ""
    notes: tuple[str, ...] = ()


def completed(raw: RawTouch, given: Given) -> RawTouch:
    """A touch with what its owner knows about it.

    Parameters
    ----------
    raw : RawTouch
        As its file has it.
    given : Given
        What is to take the place of what the file says.

    Returns
    -------
    RawTouch
        With the given unit; with a given fingertip it lacks none any more.
    """
    if given.unit is not None:
        raw = replace(raw, unit=given.unit)
    tip = given.fingertip
    if tip is None:
        return raw
    lacking = {part: line for part, line in raw.lacking.items() if part != "fingertip"}
    return replace(
        raw, radius_m=tip.radius_m, positions_m=tip.positions_m, normals=tip.normals, lacking=lacking
    )
