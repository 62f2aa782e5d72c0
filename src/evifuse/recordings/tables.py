"""Touch recordings as CSV files that a spreadsheet opens.

Comment lines at the top describe the fingertip, as ``# key: value`` with JSON values::

    # fingertip_radius_m: 0.01
    # taxel_positions_m: [[0, 0, -0.01], [0.0007, 0, -0.00998]]
    # taxel_normals: [[0, 0, -1], [0.07, 0, -0.998]]
    time_ns,x_m,y_m,z_m,qx,qy,qz,qw,joint_angle_rad,p0_pa,p1_pa
    1700000000000000000,0,0,0.01,0,0,0,1,-0.5,0,0

The pose is that of the fingertip in the world frame. The unit of a pressure is the end of its column's name:
``_pa``, ``_hpa``, ``_kpa``, ``_mpa`` (megapascals), ``_bar``, or ``_n`` together with ``# taxel_area_m2:
...``. A reading at no load goes into ``# pressure_offset: ...``, in the same unit.
"""

import json
import os
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import RecordingError
from evifuse.recordings.atomic import replacing
from evifuse.recordings.checks import checked_touch
from evifuse.recordings.recording import Fingertip, TouchRecording
from evifuse.recordings.units import to_pascal

__all__ = ["POSE_COLUMNS", "read_csv", "write_csv"]

POSE_COLUMNS = ("time_ns", "x_m", "y_m", "z_m", "qx", "qy", "qz", "qw", "joint_angle_rad")
"""Columns before the pressures."""

_UNITS = {"pa": "Pa", "hpa": "hPa", "kpa": "kPa", "mpa": "MPa", "bar": "bar", "n": "N"}
_KEYS = ("fingertip_radius_m", "taxel_positions_m", "taxel_normals")


def read_csv(path: str | os.PathLike[str]) -> TouchRecording:
    """Read a touch recording from a CSV file.

    Parameters
    ----------
    path : str or path-like
        The file.

    Returns
    -------
    TouchRecording
        The recording, checked, in SI units.

    Raises
    ------
    RecordingError
        If the file is not text, a comment, column or row is missing or not valid, or the unit is unknown.
    """
    file = Path(path)
    try:
        lines = file.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise RecordingError(f"{file}: this is not a text file: save it as CSV in UTF-8") from error
    except OSError as error:
        raise RecordingError(f"{file}: can't read the file: {error.strerror or error}") from error
    top = next((i for i, line in enumerate(lines) if line.strip() and not line.startswith("#")), None)
    if top is None:
        raise RecordingError(
            f"{file}: there is no line with the names of the columns: the file is empty or cut off"
        )
    facts = _facts(lines[:top], file)
    names = [name.strip() for name in lines[top].split(",")]
    unit = _unit_of(names, file)
    time_ns, numbers = _numbers(lines[top + 1 :], len(names), top + 2, file)
    try:
        fingertip = Fingertip(
            float(facts["fingertip_radius_m"]),
            np.array(facts["taxel_positions_m"], dtype=np.float64),
            np.array(facts["taxel_normals"], dtype=np.float64),
        )
        area, offset = float(facts.get("taxel_area_m2", 0.0)), float(facts.get("pressure_offset", 0.0))
    except (TypeError, ValueError) as error:
        raise RecordingError(
            f"{file}: a comment line does not hold the numbers it should: {error}"
        ) from error
    pressure = to_pascal(numbers[:, 8:], unit, area, offset, file.name)
    return checked_touch(
        TouchRecording(
            fingertip, time_ns, numbers[:, :3], numbers[:, 3:7], numbers[:, 7], pressure, file.name
        )
    )


def _facts(comments: list[str], file: Path) -> dict[str, Any]:
    facts: dict[str, Any] = {}
    for number, line in enumerate(comments, start=1):
        key, colon, value = line.lstrip("# ").partition(":")
        if not colon or not re.fullmatch(r"\w+", key.strip()):
            continue
        try:
            facts[key.strip()] = json.loads(value)
        except ValueError as error:
            raise RecordingError(f"{file}:{number}: the value of {key.strip()!r} is not JSON") from error
    for key in _KEYS:
        if key not in facts:
            raise RecordingError(f"{file}: a comment line '# {key}: ...' is needed above the columns")
    return facts


def _unit_of(names: list[str], file: Path) -> str:
    """Unit of the pressure columns, after checking that the columns are the documented ones."""
    if tuple(names[: len(POSE_COLUMNS)]) != POSE_COLUMNS:
        wrong = next(
            (i for i, (a, b) in enumerate(zip(names, POSE_COLUMNS, strict=False)) if a != b), len(names)
        )
        found = names[wrong] if wrong < len(names) else "nothing"
        raise RecordingError(f"{file}: column {wrong + 1} must be {POSE_COLUMNS[wrong]!r}, not {found!r}")
    columns = names[len(POSE_COLUMNS) :]
    if not columns:
        raise RecordingError(f"{file}: there are no pressure columns: add p0_pa, p1_pa, ...")
    first = columns[0].partition("_")[2]
    for i, name in enumerate(columns):
        if name != f"p{i}_{first}":
            raise RecordingError(
                f"{file}: column {len(POSE_COLUMNS) + i + 1} must be 'p{i}_{first}', not {name!r}"
            )
    return _UNITS.get(first, first)


def _numbers(
    rows: list[str], columns: int, first_line: int, file: Path
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    filled = [(number, row) for number, row in enumerate(rows, start=first_line) if row.strip()]
    if not filled:
        raise RecordingError(f"{file}: the recording has no samples (T = 0): record at least one roll")
    for line, row in filled:
        if row.count(",") != columns - 1:
            count = row.count(",") + 1
            raise RecordingError(f"{file}:{line}: {count} values for {columns} columns: is the file cut off?")
    try:
        time_ns = np.array([int(row.partition(",")[0]) for _, row in filled], dtype=np.int64)
        numbers = np.loadtxt(
            [row for _, row in filled], delimiter=",", usecols=range(1, columns), comments=None, ndmin=2
        )
    except (ValueError, OverflowError) as error:
        raise RecordingError(f"{file}:{_first_bad_line(filled)}: not a number: repair that line") from error
    return time_ns, numbers


def _first_bad_line(rows: list[tuple[int, str]]) -> int:
    for line, row in rows:
        head, _, tail = row.partition(",")
        try:
            np.int64(int(head))
            list(map(float, tail.split(",")))
        except (ValueError, OverflowError):
            return line
    return rows[0][0]


def write_csv(path: str | os.PathLike[str], touch: TouchRecording) -> None:
    """Write a touch recording as a CSV file, pressures in pascals with nine significant digits.

    Parameters
    ----------
    path : str or path-like
        The file to be created or replaced.
    touch : TouchRecording
        What to store, valid.

    Raises
    ------
    RecordingError
        If the file can't be written.
    """
    taxels = len(touch.fingertip.positions_m)
    facts = dict(
        zip(
            _KEYS,
            (
                touch.fingertip.radius_m,
                touch.fingertip.positions_m.tolist(),
                touch.fingertip.normals.tolist(),
            ),
            strict=True,
        )
    )
    poses = np.column_stack([touch.position_m, touch.orientation_xyzw, touch.joint_angle_rad]).tolist()
    form = ",".join(["%.9g"] * taxels)
    with replacing(path) as beside, beside.open("w", encoding="utf-8", newline="\n") as stream:
        for key, value in facts.items():
            stream.write(f"# {key}: {json.dumps(value)}\n")
        names = [*POSE_COLUMNS, *(f"p{i}_pa" for i in range(taxels))]
        stream.write(",".join(names) + "\n")
        for time_ns, pose, pressure in zip(touch.time_ns.tolist(), poses, touch.pressure_pa, strict=True):
            stream.write(f"{time_ns},{','.join(map(repr, pose))},{form % tuple(pressure)}\n")
