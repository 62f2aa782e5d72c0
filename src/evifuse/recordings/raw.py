"""A touch recording as its file has it: units, times and gaps as they are, nothing refused yet."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

__all__ = ["RawTouch", "nothing"]


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
