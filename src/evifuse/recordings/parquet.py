"""Touch recordings as Parquet files: the columns of the CSV form, the fingertip in the file's metadata.

The metadata's keys are those of the CSV comments (``fingertip_radius_m``, ``taxel_positions_m``,
``taxel_normals`` and, where they are needed, ``taxel_area_m2`` and ``pressure_offset``), their values JSON.
"""

import json
import os
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import MissingExtraError, RecordingError
from evifuse.recordings.atomic import replacing
from evifuse.recordings.columns import FACTS, POSE_COLUMNS, facts_of, raw_of_columns
from evifuse.recordings.raw import RawTouch
from evifuse.recordings.recording import TouchRecording

__all__ = ["raw_parquet", "write_parquet"]

_NEEDED = "the file's metadata must hold {}, as JSON"


def raw_parquet(path: str | os.PathLike[str]) -> RawTouch:
    """Read a touch from a Parquet file as it is.

    Parameters
    ----------
    path : str or path-like
        The file.

    Returns
    -------
    RawTouch
        With a line for each part that is missing; an empty cell is NaN.

    Raises
    ------
    RecordingError
        If the file is damaged, or a column is not of numbers.
    MissingExtraError
        If pyarrow is not installed.
    """
    pa = _pyarrow()
    file = Path(path)
    if file.stat().st_size == 0:
        raise RecordingError(f"{file}: the file is empty: record or copy it again")
    try:
        with pa.OSFile(str(file)) as stream:
            table = pa.parquet.ParquetFile(stream).read()
        if len(set(table.column_names)) < len(table.column_names):
            raise RecordingError(f"{file}: two columns have the same name: give each its own")
        columns = [_numbers(table, name, file) for name in table.column_names]
        times = _times(table, file)
    except (pa.ArrowException, OSError) as error:
        line = (str(error).strip().splitlines() or ["damaged"])[0]
        raise RecordingError(
            f"{file}: this is not a whole Parquet file (nothing of one that is cut off can be read, as its "
            f"directory is at its end), write it again: {line}"
        ) from error
    known = facts_of(_facts(table.schema.metadata or {}, file), _NEEDED, file)
    numbers = np.stack(columns, axis=1) if columns else np.zeros((len(times), 0))
    return raw_of_columns(file, known, list(table.column_names), times, numbers)


def _numbers(table: Any, name: str, file: Path) -> NDArray[np.float64]:
    kind = str(table.schema.field(name).type)
    if not kind.startswith(("int", "uint", "float", "double", "halffloat", "timestamp")):
        raise RecordingError(f"{file}: column {name!r} must be real numbers, not {kind}")
    if kind.startswith("timestamp"):
        return np.zeros(len(table))
    return table.column(name).to_numpy().astype(np.float64)


def _times(table: Any, file: Path) -> NDArray[np.int64]:
    if "time_ns" not in table.column_names:
        return np.zeros(len(table), np.int64)
    column = table.column("time_ns")
    kind = str(column.type)
    if not kind.startswith(("int", "uint", "timestamp[ns")):
        raise RecordingError(f"{file}: time_ns must be whole nanoseconds, not {kind}")
    if column.null_count:
        raise RecordingError(
            f"{file}: time_ns is empty in {column.null_count} rows: every sample needs a time"
        )
    return column.to_numpy().astype(np.int64)


def _facts(metadata: dict[bytes, bytes], file: Path) -> dict[str, Any]:
    facts: dict[str, Any] = {}
    for key in (*FACTS, "taxel_area_m2", "pressure_offset"):
        if key.encode() in metadata:
            try:
                facts[key] = json.loads(metadata[key.encode()])
            except (ValueError, RecursionError) as error:
                raise RecordingError(f"{file}: {key} in the metadata is not JSON") from error
    return facts


def write_parquet(path: str | os.PathLike[str], touch: TouchRecording) -> None:
    """Write a touch recording as a Parquet file, pressures in pascals and single precision.

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
    MissingExtraError
        If pyarrow is not installed.
    """
    pa = _pyarrow()
    tip = touch.fingertip
    values = (float(tip.radius_m), tip.positions_m.tolist(), tip.normals.tolist())
    metadata = {key: json.dumps(value) for key, value in zip(FACTS, values, strict=True)}
    kept = len(POSE_COLUMNS) - (0 if touch.has_joint else 1)
    pose = np.column_stack([touch.position_m, touch.orientation_xyzw, touch.joint_angle_rad])[:, : kept - 1]
    arrays = [touch.time_ns, *pose.T, *touch.pressure_pa.T.astype(np.float32)]
    names = [*POSE_COLUMNS[:kept], *(f"p{i}_pa" for i in range(len(tip.positions_m)))]
    table = pa.table([pa.array(np.ascontiguousarray(a)) for a in arrays], names=names)
    with replacing(path) as beside:
        pa.parquet.write_table(table.replace_schema_metadata(metadata), str(beside), compression="zstd")


def _pyarrow() -> Any:
    try:
        import_module("pyarrow.parquet")
    except ImportError as error:
        raise MissingExtraError("Parquet files need pyarrow: pip install 'evifuse[parquet]'") from error
    return import_module("pyarrow")
