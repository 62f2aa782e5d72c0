"""Touch recordings as CSV files that a spreadsheet opens.

Comment lines at the top describe the fingertip, as ``# key: value`` with JSON values::

    # fingertip_radius_m: 0.01
    # taxel_positions_m: [[0, 0, -0.01], [0.0007, 0, -0.00998]]
    # taxel_normals: [[0, 0, -1], [0.07, 0, -0.998]]
    time_ns,x_m,y_m,z_m,qx,qy,qz,qw,joint_angle_rad,p0_pa,p1_pa
    1700000000000000000,0,0,0.01,0,0,0,1,-0.5,0,0

A cell may be empty or ``nan`` where nothing was measured. What the columns mean is in
`evifuse.recordings.columns`.
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
from evifuse.recordings.columns import FACTS, POSE_COLUMNS, facts_of, raw_of_columns, wrong_columns
from evifuse.recordings.raw import RawTouch
from evifuse.recordings.recording import TouchRecording

__all__ = ["raw_csv", "write_csv"]

_NEEDED = "a comment line '# {}: ...' is needed above the columns"


def raw_csv(path: str | os.PathLike[str], *, partial: bool = False) -> RawTouch:
    """Read a touch from a CSV file as it is.

    Parameters
    ----------
    path : str or path-like
        The file.
    partial : bool
        Leave out a last row that is cut off.

    Returns
    -------
    RawTouch
        With a line for each part that is missing.

    Raises
    ------
    RecordingError
        If the file is not text, or a row is not valid.
    """
    file = Path(path)
    try:
        lines = file.read_bytes().decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise RecordingError(f"{file}: this is not a text file: save it as CSV in UTF-8") from error
    except OSError as error:
        raise RecordingError(f"{file}: can't read the file: {error.strerror or error}") from error
    top = next((i for i, line in enumerate(lines) if line.strip() and not line.startswith("#")), None)
    if top is None:
        raise RecordingError(
            f"{file}: there is no line with the names of the columns: the file is empty or cut off"
        )
    known = facts_of(_facts(lines[:top], file), _NEEDED, file)
    names = [name.strip() for name in lines[top].split(",")]
    rows = [(number, row) for number, row in enumerate(lines[top + 1 :], start=top + 2) if row.strip()]
    damage = ""
    if partial and rows and not _is_whole(rows[-1][1], len(names)):
        damage = f"line {rows[-1][0]} is cut off"
        rows = rows[:-1]
    try:
        time_ns, numbers = _numbers(rows, names, file)
    except RecordingError as error:
        for line in wrong_columns(names, file).values():
            raise RecordingError(line) from error
        raise
    return raw_of_columns(file, known, names, time_ns, numbers, damage=damage)


def _facts(comments: list[str], file: Path) -> dict[str, Any]:
    facts: dict[str, Any] = {}
    for number, line in enumerate(comments, start=1):
        key, colon, value = line.lstrip("# ").partition(":")
        if not colon or not re.fullmatch(r"\w+", key.strip()):
            continue
        try:
            facts[key.strip()] = json.loads(value)
        except (ValueError, RecursionError) as error:
            raise RecordingError(f"{file}:{number}: the value of {key.strip()!r} is not JSON") from error
    return facts


def _is_whole(row: str, columns: int) -> bool:
    cells = row.split(",")
    try:
        return len(cells) == columns and len([float(cell or "nan") for cell in cells]) == columns
    except ValueError:
        return False


def _numbers(
    rows: list[tuple[int, str]], names: list[str], file: Path
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Times (T,) and all columns (T, C); an empty cell is NaN."""
    columns = len(names)
    for line, row in rows:
        if row.count(",") != columns - 1:
            count = row.count(",") + 1
            raise RecordingError(f"{file}:{line}: {count} values for {columns} columns: is the file cut off?")
    if not rows:
        return np.zeros(0, np.int64), np.zeros((0, columns))
    try:
        first = names.index("time_ns") if "time_ns" in names else -1
        times = [0 if first < 0 else int(row.split(",", first + 1)[first]) for _, row in rows]
        filled = [_EMPTY.sub("nan", row) for _, row in rows]
        numbers = np.loadtxt(filled, delimiter=",", comments=None, ndmin=2)
        return np.array(times, dtype=np.int64), numbers
    except (ValueError, OverflowError) as error:
        raise RecordingError(f"{file}:{_first_bad_line(rows)}: not a number: repair that line") from error


_EMPTY = re.compile(r"(?<=,)\s*(?=,|$)")
"""An empty cell; the first of a row is the time and can't be."""


def _first_bad_line(rows: list[tuple[int, str]]) -> int:
    for line, row in rows:
        head, _, tail = row.partition(",")
        try:
            np.int64(int(head))
            [float(cell.strip() or "nan") for cell in tail.split(",")]
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
            FACTS,
            (
                touch.fingertip.radius_m,
                touch.fingertip.positions_m.tolist(),
                touch.fingertip.normals.tolist(),
            ),
            strict=True,
        )
    )
    kept = len(POSE_COLUMNS) - (0 if touch.has_joint else 1)
    known = np.column_stack([touch.position_m, touch.orientation_xyzw, touch.joint_angle_rad])
    poses = known[:, : kept - 1].tolist()
    form = ",".join(["%.9g"] * taxels)
    with replacing(path) as beside, beside.open("w", encoding="utf-8", newline="\n") as stream:
        for key, value in facts.items():
            stream.write(f"# {key}: {json.dumps(value)}\n")
        names = [*POSE_COLUMNS[:kept], *(f"p{i}_pa" for i in range(taxels))]
        stream.write(",".join(names) + "\n")
        for time_ns, pose, pressure in zip(touch.time_ns.tolist(), poses, touch.pressure_pa, strict=True):
            stream.write(f"{time_ns},{','.join(map(repr, pose))},{form % tuple(pressure)}\n")
