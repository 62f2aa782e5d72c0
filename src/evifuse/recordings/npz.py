"""Touch recordings as NumPy archives: one array per field of the dataclasses.

``radius_m, positions_m, normals`` describe the fingertip; ``time_ns, position_m, orientation_xyzw,
joint_angle_rad`` and ``pressure_pa`` are the samples. Instead of ``pressure_pa`` there may be ``pressure``
with ``pressure_unit`` and, where they are needed, ``taxel_area_m2`` and ``pressure_offset``. Poses or joint
angles at another rate have times of their own, ``pose_time_ns`` and ``joint_time_ns``. The joint angle may be
left out.
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
from evifuse.recordings.npz_cut import salvaged
from evifuse.recordings.raw import RawTouch
from evifuse.recordings.recording import TouchRecording

__all__ = ["raw_npz", "write_npz"]

_SAMPLES = ("time_ns", "position_m", "orientation_xyzw", "joint_angle_rad")
_FINGERTIP = ("radius_m", "positions_m", "normals")
_PARTS = {
    "fingertip": _FINGERTIP,
    "time": _SAMPLES[:1],
    "pose": _SAMPLES[1:3],
    "pressure": ("pressure_pa",),
}


def raw_npz(path: str | os.PathLike[str], *, partial: bool = False) -> RawTouch:
    """Read a touch from a NumPy archive as it is.

    Parameters
    ----------
    path : str or path-like
        The file. Pickled objects in it are refused.
    partial : bool
        Take what is whole of an archive that is cut off: its arrays as far as they go.

    Returns
    -------
    RawTouch
        With a line for each array that is missing.

    Raises
    ------
    RecordingError
        If the file is not such an archive, or an array is not of numbers.
    """
    name = Path(path).name
    arrays, damage = _arrays(path, partial)
    lacking: dict[str, str] = {}
    for part, keys in _PARTS.items():
        for key in keys:
            if key not in arrays:
                needed = ", ".join(sum(_PARTS.values(), ()))
                cut = f" ({damage})" if damage else ""
                lacking[part] = f"{path}: array {key!r} is missing{cut}: the archive needs {needed}"
                break
    if "pressure" in arrays:
        lacking.pop("pressure", None)  # without its unit it is refused later, unless that is given
    time_ns = _times(arrays, "time_ns", "time_ns", name)
    pressure, unit = _pressure(arrays, None if "time" in lacking else len(time_ns), name)
    taxels = len(arrays.get("positions_m", ())) if "pressure" in lacking else pressure.shape[1]
    clocked = "time" not in lacking
    pose_ns, pose = _no_times(), np.zeros((0, 7))
    if clocked and "pose" not in lacking:
        pose_ns = _times(arrays, "pose_time_ns", "time_ns", name)
        position = _floats(arrays, "position_m", (len(pose_ns), 3), name)
        pose = np.hstack([position, _floats(arrays, "orientation_xyzw", (len(pose_ns), 4), name)])
    joint_ns, angle = _no_times(), np.zeros(0)
    if clocked and "joint_angle_rad" in arrays:
        joint_ns = _times(arrays, "joint_time_ns", "time_ns", name)
        angle = _floats(arrays, "joint_angle_rad", (len(joint_ns),), name)
    tip: dict[str, Any] = {}
    if "fingertip" not in lacking:
        tip["radius_m"] = _number(arrays, "radius_m", 0.0, name)
        tip |= {key: _floats(arrays, key, (taxels, 3), name) for key in ("positions_m", "normals")}
    if not len(time_ns) and "time" not in lacking:
        lacking["time"] = f"{name}: the recording has no samples (T = 0): record at least one roll"
    return RawTouch(
        name,
        time_ns=time_ns,
        pressure=pressure,
        unit=unit,
        area_m2=_number(arrays, "taxel_area_m2", 0.0, name),
        offset=_number(arrays, "pressure_offset", 0.0, name),
        pose_time_ns=pose_ns,
        pose=pose,
        joint_time_ns=joint_ns,
        joint_rad=angle,
        called=_called(arrays),
        lacking=lacking,
        damage=damage,
        **tip,
    )


def _no_times() -> NDArray[np.int64]:
    return np.zeros(0, np.int64)


def _called(arrays: dict[str, NDArray[Any]]) -> dict[str, str]:
    return {
        "time": "time_ns",
        "pose": "pose_time_ns" if "pose_time_ns" in arrays else "the pose",
        "joint": "joint_time_ns" if "joint_time_ns" in arrays else "joint_angle_rad",
    }


def _times(arrays: dict[str, NDArray[Any]], key: str, instead: str, name: str) -> NDArray[np.int64]:
    if key not in arrays:
        return _no_times() if key == instead else _times(arrays, instead, instead, name)
    time = arrays[key]
    if time.ndim != 1 or time.dtype.kind not in "iu" or (time.size and int(time.max()) >= 2**63):
        raise RecordingError(
            f"{name}: {key} must be whole nanoseconds of shape (T,), not {time.dtype} {time.shape}: "
            "multiply seconds by 1e9 and round"
        )
    return time.astype(np.int64)


def _floats(
    arrays: dict[str, NDArray[Any]], key: str, shape: tuple[int, ...], name: str
) -> NDArray[np.float64]:
    values = arrays[key]
    if values.dtype.kind not in "iuf":
        raise RecordingError(f"{name}: {key} must be real numbers, not {values.dtype}")
    if values.shape != shape:
        raise RecordingError(f"{name}: {key} must have shape {shape}, not {values.shape}")
    return values.astype(np.float64)


def _arrays(path: str | os.PathLike[str], partial: bool) -> tuple[dict[str, NDArray[Any]], str]:
    """Arrays of an archive, and what is wrong with it."""
    if Path(path).stat().st_size == 0:
        raise RecordingError(f"{path}: the file is empty: record or copy it again")
    try:
        with Path(path).open("rb") as stream:
            archive = np.load(stream, allow_pickle=False)
            return {key: archive[key] for key in archive.files}, ""
    except (OSError, ValueError, EOFError, AttributeError, zipfile.BadZipFile, zlib.error) as error:
        arrays, cut = salvaged(Path(path).read_bytes()) if partial else ({}, "")
        if not arrays:
            raise RecordingError(
                f"{path}: this is not a whole .npz archive of plain arrays: write it again"
            ) from error
        return _evened(arrays, cut), f"the archive is cut off or damaged{f' in {cut!r}' if cut else ''}"


def _evened(arrays: dict[str, NDArray[Any]], cut: str) -> dict[str, NDArray[Any]]:
    """Arrays of samples as long as the one in which the archive was cut off."""
    pose = (*_SAMPLES[1:3], "pose_time_ns")
    joint = (*_SAMPLES[3:], "joint_time_ns")
    clocks: list[tuple[str, ...]] = [("time_ns", "pressure_pa", "pressure")]
    for keys in (pose, joint):
        if keys[-1] in arrays:
            clocks.append(keys)
        else:
            clocks[0] += keys
    for keys in clocks:
        if cut in keys and cut in arrays:
            rows = len(arrays[cut])
            arrays |= {key: arrays[key][:rows] for key in keys if key in arrays and arrays[key].ndim}
    return arrays


def _number(arrays: dict[str, NDArray[Any]], key: str, default: float, name: str) -> float:
    if key not in arrays:
        return default
    try:
        return float(arrays[key])
    except (TypeError, ValueError) as error:
        raise RecordingError(f"{name}: {key} must be one number, not {arrays[key]!r}") from error


def _pressure(
    arrays: dict[str, NDArray[Any]], samples: int | None, name: str
) -> tuple[NDArray[np.float64], str]:
    """Readings (T, N) and their unit."""
    key = "pressure_pa" if "pressure_pa" in arrays else "pressure"
    if key not in arrays:
        return np.zeros((samples or 0, 0)), ""
    rows, taxels = arrays[key].shape if arrays[key].ndim == 2 else (0, 0)
    values = _floats(arrays, key, (rows if samples is None else samples, taxels), name)
    return values, "Pa" if key == "pressure_pa" else str(arrays.get("pressure_unit", ""))


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
    samples = _SAMPLES if touch.has_joint else _SAMPLES[:3]
    arrays: dict[str, Any] = {key: np.asarray(getattr(touch.fingertip, key)) for key in _FINGERTIP}
    arrays |= {key: getattr(touch, key) for key in (*samples, "pressure_pa")}  # the largest last: see npz_cut
    with replacing(path) as beside, beside.open("wb") as stream:
        np.savez_compressed(stream, **arrays)
