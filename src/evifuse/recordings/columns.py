"""What CSV and Parquet files of a touch have in common: the columns, and facts about the fingertip.

The pose is that of the fingertip in the world frame. The unit of a pressure is the end of its column's name:
``_pa``, ``_hpa``, ``_kpa``, ``_mpa`` (megapascals), ``_bar``, or ``_n`` together with the fact
``taxel_area_m2``. A reading at no load is the fact ``pressure_offset``, in the same unit.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.raw import RawTouch, nothing

__all__ = ["FACTS", "POSE_COLUMNS", "facts_of", "pressure_columns", "raw_of_columns", "wrong_columns"]

POSE_COLUMNS = ("time_ns", "x_m", "y_m", "z_m", "qx", "qy", "qz", "qw", "joint_angle_rad")
"""Columns before the pressures; the joint angle may be left out."""
FACTS = ("fingertip_radius_m", "taxel_positions_m", "taxel_normals")
"""What must be known about the fingertip."""

_PARTS = {"time": POSE_COLUMNS[:1], "pose": POSE_COLUMNS[1:8]}
_JOINT = POSE_COLUMNS[8]
_UNITS = {"pa": "Pa", "hpa": "hPa", "kpa": "kPa", "mpa": "MPa", "bar": "bar", "n": "N"}


def wrong_columns(names: list[str], file: Path) -> dict[str, str]:
    """Which parts of a touch a table lacks.

    Parameters
    ----------
    names : list of str
        Names of its columns.
    file : Path
        The file, for messages.

    Returns
    -------
    dict of str to str
        For ``time``, ``pose`` and ``pressure``, the line that says what is wrong; empty if all is there.
    """
    wrong: dict[str, str] = {}
    for part, columns in _PARTS.items():
        for column in columns:
            place = POSE_COLUMNS.index(column)
            found = names[place] if place < len(names) else "nothing"
            if found != column:
                wrong[part] = f"{file}: column {place + 1} must be {column!r}, not {found!r}"
                break
    first, given = pressure_columns(names)
    if not given:
        wrong["pressure"] = f"{file}: there are no pressure columns: add p0_pa, p1_pa, ..."
    for i, place in enumerate(given):
        if names[place] != f"p{i}_{first}":
            said = f"column {place + 1} must be 'p{i}_{first}', not {names[place]!r}"
            wrong.setdefault("pressure", f"{file}: {said}")
    return wrong


def pressure_columns(names: list[str]) -> tuple[str, list[int]]:
    """Columns of the pressures.

    Parameters
    ----------
    names : list of str
        Names of all columns.

    Returns
    -------
    suffix : str
        What follows ``p0_``: the unit in small letters.
    places : list of int
        All columns that are not of the pose, in order.
    """
    places = [i for i, name in enumerate(names) if name not in POSE_COLUMNS]
    return (names[places[0]].partition("_")[2] if places else ""), places


def facts_of(facts: dict[str, Any], needed: str, file: Path) -> dict[str, Any]:
    """Fingertip, taxel area and offset of a table.

    Parameters
    ----------
    facts : dict of str to Any
        What the comments or metadata say, parsed from JSON.
    needed : str
        How a fact is written, with ``{}`` for its name, for messages.
    file : Path
        The file, for messages.

    Returns
    -------
    dict of str to Any
        Arguments for `RawTouch`, with a line in ``lacking`` if the fingertip is not known.
    """
    known: dict[str, Any] = {"lacking": {}}
    try:
        known["area_m2"] = float(facts.get("taxel_area_m2", 0.0))
        known["offset"] = float(facts.get("pressure_offset", 0.0))
        missing = [key for key in FACTS if key not in facts]
        if missing:
            known["lacking"]["fingertip"] = f"{file}: {needed.format(missing[0])}"
            return known
        radius, positions, normals = (np.array(facts[key], dtype=np.float64) for key in FACTS)
        known |= {"radius_m": float(radius), "positions_m": positions, "normals": normals}
    except (TypeError, ValueError) as error:
        known["lacking"]["fingertip"] = (
            f"{file}: a comment line or the metadata does not hold the numbers it should: {error}"
        )
    return known


def raw_of_columns(
    file: Path,
    known: dict[str, Any],
    names: list[str],
    time_ns: NDArray[np.int64],
    numbers: NDArray[np.float64],
    **more: Any,
) -> RawTouch:
    """Put a table together.

    Parameters
    ----------
    file : Path
        The file.
    known : dict of str to Any
        What `facts_of` gave.
    names : list of str
        Names of the columns.
    time_ns : ndarray of int64, shape (T,)
        First column.
    numbers : ndarray of float64, shape (T, C)
        All columns, the first of them not used.
    **more : Any
        Further fields.

    Returns
    -------
    RawTouch
        As the file has it.
    """
    wrong = wrong_columns(names, file)
    suffix, places = pressure_columns(names)
    place = {name: i for i, name in enumerate(names)}
    has = {part: part not in wrong for part in _PARTS}
    rows = len(time_ns)
    pose = numbers[:, [place[c] for c in _PARTS["pose"]]] if has["pose"] else nothing(0, 7)
    jointed = _JOINT in place
    joint = numbers[:, place[_JOINT]] if jointed else nothing(0)
    empty = np.zeros(0, np.int64)
    lacking = wrong | known["lacking"]
    if not rows:
        lacking["time"] = f"{file}: the recording has no samples (T = 0): record at least one roll"
    return RawTouch(
        file.name,
        time_ns=time_ns,
        pressure=numbers[:, places],
        unit=_UNITS.get(suffix, suffix),
        pose_time_ns=time_ns if has["pose"] else empty,
        pose=pose,
        joint_time_ns=time_ns if jointed else empty,
        joint_rad=joint,
        called={"time": "time_ns", "pose": "the pose", "joint": "joint_angle_rad"},
        **(known | {"lacking": lacking}),
        **more,
    )
