"""Scenes and touch recordings by file name: the suffix says the format, the content is checked."""

import os
from collections.abc import Callable, Mapping
from pathlib import Path

from evifuse.errors import RecordingError
from evifuse.recordings.bags import is_bag, read_bag, read_sqlite
from evifuse.recordings.checks import checked_touch
from evifuse.recordings.images import read_image
from evifuse.recordings.mcap_reader import read_raw
from evifuse.recordings.mcap_scene import RawScene, raw_scene, scene_of
from evifuse.recordings.mcap_writer import write_mcap
from evifuse.recordings.npz import raw_npz, write_npz
from evifuse.recordings.parquet import raw_parquet, write_parquet
from evifuse.recordings.raw import NOTHING_GIVEN, Given, RawTouch, completed
from evifuse.recordings.recording import Fingertip, Scene, TouchRecording
from evifuse.recordings.tables import raw_csv, write_csv

__all__ = [
    "IMAGE_SUFFIXES",
    "TOUCH_SUFFIXES",
    "read_raw_scene",
    "read_scene",
    "read_touch",
    "write_scene",
    "write_touch",
]

IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".gif", ".tif", ".tiff", ".webp", ".pgm", ".ppm", ".pnm")
"""Files that are read as a picture."""
TOUCH_SUFFIXES = (".mcap", ".csv", ".npz", ".parquet", ".db3")
"""Files that are read as a recording of touch."""

_WRITERS = {".csv": write_csv, ".npz": write_npz, ".parquet": write_parquet}


def read_scene(path: str | os.PathLike[str], *, partial: bool = False, given: Given = NOTHING_GIVEN) -> Scene:
    """Read a scene: an MCAP file or ROS 2 bag, a picture alone, or a touch alone (CSV, NPZ, Parquet).

    Parameters
    ----------
    path : str or path-like
        The file, or the folder that ``ros2 bag record`` made.
    partial : bool
        Accept what is whole of a file that was cut off or damaged: up to the last whole chunk of an MCAP
        file, the last whole row of a CSV file, the last whole array of an NPZ file. Its notes or those of its
        touch say so.
    given : Given
        What the file leaves open about its touch.

    Returns
    -------
    Scene
        Image, camera and touch; None for what the file does not hold.

    Raises
    ------
    RecordingError
        If the file is missing, of an unknown format, damaged, or its content is not valid.
    ImageError
        If a picture can't be read.
    MissingExtraError
        If it is a Parquet file and pyarrow is not installed.
    """
    file = _existing(path)
    if file.suffix.lower() in IMAGE_SUFFIXES:
        return Scene(read_image(file), None, None, file.name)
    return scene_of(read_raw_scene(file, partial=partial, given=given), str(file), partial=partial)


def read_touch(
    path: str | os.PathLike[str],
    *,
    partial: bool = False,
    fingertip: Fingertip | None = None,
    topics: Mapping[str, str] | None = None,
    unit: str | None = None,
) -> TouchRecording:
    """Read a touch recording: MCAP, ROS 2 bag, CSV, NPZ or Parquet.

    Parameters
    ----------
    path : str or path-like
        The file, or the folder that ``ros2 bag record`` made.
    partial : bool
        Accept what is whole of a file that was cut off or damaged, as `read_scene` does.
    fingertip : Fingertip, optional
        Geometry of the fingertip, instead of the file's own.
    topics : mapping of str to str, optional
        Topics of ``pose``, ``pressures`` and ``joint`` in an MCAP file or bag that does not have the
        documented ones, such as ``{"pose": "/arm/pose"}``.
    unit : str, optional
        Unit of the readings, instead of the file's own.

    Returns
    -------
    TouchRecording
        The recording, checked, in SI units; its notes say what was left out or interpolated.

    Raises
    ------
    RecordingError
        If the file is missing, of an unknown format, damaged, holds no touch, or its content is not valid.
    MissingExtraError
        If it is a Parquet file and pyarrow is not installed.
    """
    file = _existing(path)
    given = Given(fingertip, dict(topics or {}), unit)
    raw = read_raw_scene(file, partial=partial, pictures=False, given=given)
    if raw.touch is None and (partial or not raw.damage):
        cut = f" ({raw.damage})" if raw.damage else ""
        raise RecordingError(
            f"{file}: the recording holds no touch (no topic /finger/taxels){cut}: record it too, or name "
            f"its topics with --topics; {raw.held}"
        )
    touch = scene_of(raw, str(file), partial=partial).touch
    assert touch is not None
    return touch


def read_raw_scene(
    path: str | os.PathLike[str],
    *,
    partial: bool = True,
    pictures: bool = True,
    given: Given = NOTHING_GIVEN,
) -> RawScene:
    """Read what a recording holds without refusing anything of it.

    Parameters
    ----------
    path : str or path-like
        The file, or the folder that ``ros2 bag record`` made.
    partial : bool
        Take what is whole of a CSV file or archive that is cut off.
    pictures : bool
        Whether to look at the picture at all.
    given : Given
        What the file leaves open about its touch.

    Returns
    -------
    RawScene
        With a line for everything that is missing.

    Raises
    ------
    RecordingError
        If the file is missing, of an unknown format, or can't be read at all.
    MissingExtraError
        If it is a Parquet file and pyarrow is not installed.
    """
    file = _existing(path)
    suffix = file.suffix.lower()
    if file.is_dir():
        return raw_scene(read_bag(file), file.name, pictures=pictures, given=given)
    if suffix in IMAGE_SUFFIXES:
        formats = ", ".join(TOUCH_SUFFIXES)
        raise RecordingError(f"{file}: a picture holds no touch: give a recording ({formats} or a bag)")
    tables: dict[str, Callable[[], RawTouch]] = {
        ".csv": lambda: raw_csv(file, partial=partial),
        ".npz": lambda: raw_npz(file, partial=partial),
        ".parquet": lambda: raw_parquet(file),
    }
    if suffix in tables:
        touch = completed(tables[suffix](), given)
        return RawScene(file.name, touch, damage=touch.damage)
    if suffix == ".db3":
        return raw_scene(read_sqlite(file), file.name, pictures=pictures, given=given)
    if suffix == ".mcap" or _is_mcap(file):
        return raw_scene(read_raw(file), file.name, pictures=pictures, given=given)
    raise RecordingError(
        f"{file}: unknown format {suffix or 'without suffix'}: use {', '.join(TOUCH_SUFFIXES)} or a picture"
    )


def write_scene(path: str | os.PathLike[str], scene: Scene) -> None:
    """Write a scene as an MCAP file; the file appears whole or not at all.

    Parameters
    ----------
    path : str or path-like
        The file to be created or replaced, ``.mcap``.
    scene : Scene
        What to store.

    Raises
    ------
    RecordingError
        If the scene is empty or not valid, the suffix is another one, or the file can't be written.
    """
    if Path(path).suffix.lower() != ".mcap":
        raise RecordingError(f"{path}: scenes are stored as .mcap: end the file's name with it")
    if scene.touch is not None:
        checked_touch(scene.touch)
    write_mcap(path, scene)


def write_touch(path: str | os.PathLike[str], touch: TouchRecording) -> None:
    """Write a touch recording as MCAP, CSV, NPZ or Parquet; the file appears whole or not at all.

    Parameters
    ----------
    path : str or path-like
        The file to be created or replaced; its suffix says the format.
    touch : TouchRecording
        What to store.

    Raises
    ------
    RecordingError
        If the recording is not valid, the suffix is unknown, or the file can't be written.
    """
    suffix = Path(path).suffix.lower()
    if suffix == ".mcap":
        write_scene(path, Scene(None, None, touch))
    elif suffix in _WRITERS:
        _WRITERS[suffix](path, checked_touch(touch))
    else:
        raise RecordingError(
            f"{path}: unknown format {suffix or 'without suffix'}: use .mcap, .csv, .npz or .parquet"
        )


def _existing(path: str | os.PathLike[str]) -> Path:
    file = Path(path)
    if file.is_dir() and not is_bag(file):
        raise RecordingError(f"{file}: this is a folder: name the recording's file in it")
    if not file.exists():
        raise RecordingError(f"{file}: there is no such file: check its name")
    return file


def _is_mcap(file: Path) -> bool:
    try:
        with file.open("rb") as stream:
            return stream.read(8) == b"\x89MCAP0\r\n"
    except OSError:
        return False
