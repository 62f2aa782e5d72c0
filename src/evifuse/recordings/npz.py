"""Touch recordings as NumPy archives: one array per field of the dataclasses.

``radius_m, positions_m, normals`` describe the fingertip; ``time_ns, position_m, orientation_xyzw,
joint_angle_rad`` and ``pressure_pa`` are the samples. Instead of ``pressure_pa`` there may be ``pressure``
with ``pressure_unit`` and, where they are needed, ``taxel_area_m2`` and ``pressure_offset``.
"""

import os
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import RecordingError
from evifuse.recordings.atomic import replacing
from evifuse.recordings.checks import checked_touch, finite
from evifuse.recordings.recording import Fingertip, TouchRecording
from evifuse.recordings.units import to_pascal

__all__ = ["read_npz", "write_npz"]

_SAMPLES = ("time_ns", "position_m", "orientation_xyzw", "joint_angle_rad")
_FINGERTIP = ("radius_m", "positions_m", "normals")


def read_npz(path: str | os.PathLike[str]) -> TouchRecording:
    """Read a touch recording from a NumPy archive.

    Parameters
    ----------
    path : str or path-like
        The file. Pickled objects in it are refused.

    Returns
    -------
    TouchRecording
        The recording, checked.

    Raises
    ------
    RecordingError
        If the file is not such an archive, an array is missing or not valid.
    """
    name = Path(path).name
    arrays = _arrays(path)
    needed = _FINGERTIP + _SAMPLES
    missing = [key for key in needed if key not in arrays]
    if "pressure_pa" not in arrays and not {"pressure", "pressure_unit"} <= arrays.keys():
        missing.append("pressure_pa")
    if missing:
        raise RecordingError(
            f"{path}: array {missing[0]!r} is missing: the archive needs {', '.join(needed)}"
        )
    fingertip = Fingertip(_number(arrays, "radius_m", 0.0, name), arrays["positions_m"], arrays["normals"])
    time_ns, position, orientation, angle = (arrays[key] for key in _SAMPLES)
    pressure = _pressure(arrays, name)
    return checked_touch(TouchRecording(fingertip, time_ns, position, orientation, angle, pressure, name))


def _arrays(path: str | os.PathLike[str]) -> dict[str, NDArray[Any]]:
    if Path(path).stat().st_size == 0:
        raise RecordingError(f"{path}: the file is empty: record or copy it again")
    try:
        with Path(path).open("rb") as stream:
            archive = np.load(stream, allow_pickle=False)
            return {key: archive[key] for key in archive.files}
    except (OSError, ValueError, EOFError, AttributeError, zipfile.BadZipFile, zlib.error) as error:
        raise RecordingError(
            f"{path}: this is not a whole .npz archive of plain arrays: write it again"
        ) from error


def _number(arrays: dict[str, NDArray[Any]], key: str, default: float, name: str) -> float:
    if key not in arrays:
        return default
    try:
        return float(arrays[key])
    except (TypeError, ValueError) as error:
        raise RecordingError(f"{name}: {key} must be one number, not {arrays[key]!r}") from error


def _pressure(arrays: dict[str, NDArray[Any]], name: str) -> NDArray[np.float64]:
    if "pressure_pa" in arrays:
        return arrays["pressure_pa"]
    area = _number(arrays, "taxel_area_m2", 0.0, name)
    offset = _number(arrays, "pressure_offset", 0.0, name)
    values = finite(arrays["pressure"], "pressure", arrays["pressure"].shape, name)
    return to_pascal(values, str(arrays["pressure_unit"]), area, offset, name)


def write_npz(path: str | os.PathLike[str], touch: TouchRecording) -> None:
    """Write a touch recording as a compressed NumPy archive.

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
    arrays = {key: getattr(touch, key) for key in (*_SAMPLES, "pressure_pa")}
    arrays |= {key: np.asarray(getattr(touch.fingertip, key)) for key in _FINGERTIP}
    with replacing(path) as beside, beside.open("wb") as stream:
        np.savez_compressed(stream, **arrays)
