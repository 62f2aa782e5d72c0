"""Pressure units, converted once at the door."""

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import RecordingError

__all__ = ["PRESSURE_UNITS", "to_pascal"]

PRESSURE_UNITS = {"Pa": 1.0, "hPa": 1e2, "kPa": 1e3, "MPa": 1e6, "bar": 1e5, "N/m^2": 1.0}
"""Pascals in one of each accepted unit; newtons are accepted too where the taxel's area is given."""


def to_pascal(
    values: NDArray[np.float64], unit: str, area_m2: float = 0.0, offset: float = 0.0, name: str = "recording"
) -> NDArray[np.float64]:
    """Turn taxel readings into pressures.

    Parameters
    ----------
    values : ndarray of float64, shape (..., N)
        Readings, in ``unit``.
    unit : str
        ``"Pa"``, ``"hPa"``, ``"kPa"``, ``"MPa"``, ``"bar"``, ``"N/m^2"``, or ``"N"`` with ``area_m2``; upper
        and lower case matter only between ``MPa`` and smaller prefixes, so they are kept.
    area_m2 : float
        Area of one taxel, square metres; needed for newtons only.
    offset : float
        Reading of an unloaded taxel, in ``unit``; subtracted.
    name : str
        Where the values come from, for messages.

    Returns
    -------
    ndarray of float64, shape (..., N)
        Pressures, Pa; the same array if it holds them already.

    Raises
    ------
    RecordingError
        If the unit is not one of these, or it is newtons and no positive area is given.

    Examples
    --------
    >>> to_pascal(np.array([1.5, 2.0]), "kPa", offset=0.5)
    array([1000., 1500.])
    """
    if not np.isfinite(offset):
        raise RecordingError(f"{name}: the taxels' reading at no load is {offset}: give a finite number")
    if unit == "N":
        if not (np.isfinite(area_m2) and area_m2 > 0):
            raise RecordingError(
                f"{name}: taxel values in N need the area of a taxel in m^2: give it, or use Pa"
            )
        return _scaled(values - offset, 1 / area_m2)
    if not unit:
        raise RecordingError(
            f"{name}: the taxel values have no unit: give it with --unit ({', '.join(PRESSURE_UNITS)})"
        )
    if unit not in PRESSURE_UNITS:
        accepted = ", ".join([*PRESSURE_UNITS, "N with the taxel's area"])
        raise RecordingError(
            f"{name}: unknown unit {unit!r} of the taxel values: use one of {accepted}, or say it with --unit"
        )
    if PRESSURE_UNITS[unit] == 1 and offset == 0:
        return values
    return _scaled(values - offset, PRESSURE_UNITS[unit])


def _scaled(values: NDArray[np.float64], factor: float) -> NDArray[np.float64]:
    with np.errstate(over="ignore"):  # infinity is refused with the rest of the checks
        return values * factor
