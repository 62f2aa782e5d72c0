"""Scenes and touch recordings by file name: the suffix says the format, the content is checked."""

import os
from pathlib import Path

from evifuse.errors import RecordingError
from evifuse.recordings.checks import checked_touch
from evifuse.recordings.images import read_image
from evifuse.recordings.mcap_scene import read_mcap
from evifuse.recordings.mcap_writer import write_mcap
from evifuse.recordings.npz import read_npz, write_npz
from evifuse.recordings.recording import Scene, TouchRecording
from evifuse.recordings.tables import read_csv, write_csv

__all__ = ["IMAGE_SUFFIXES", "read_scene", "read_touch", "write_scene", "write_touch"]

IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".gif", ".tif", ".tiff", ".webp", ".pgm", ".ppm", ".pnm")
"""Files that are read as a picture."""

_READERS = {".csv": read_csv, ".npz": read_npz}
_WRITERS = {".csv": write_csv, ".npz": write_npz}


def read_scene(path: str | os.PathLike[str], *, partial: bool = False) -> Scene:
    """Read a scene: an MCAP file, a picture alone, or a touch alone (CSV, NPZ).

    Parameters
    ----------
    path : str or path-like
        The file, or the folder that ``ros2 bag record`` made with one MCAP file in it.
    partial : bool
        Accept what is whole of an MCAP file that was cut off or damaged.

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
    """
    file = _existing(path)
    suffix = file.suffix.lower()
    if suffix in IMAGE_SUFFIXES:
        return Scene(read_image(file), None, None, file.name)
    if suffix in _READERS:
        return Scene(None, None, _READERS[suffix](file), file.name)
    if suffix == ".mcap" or _is_mcap(file):
        return read_mcap(file, partial=partial)
    raise RecordingError(
        f"{file}: unknown format {suffix or 'without suffix'}: use .mcap, .csv, .npz or a picture"
    )


def read_touch(path: str | os.PathLike[str], *, partial: bool = False) -> TouchRecording:
    """Read a touch recording: MCAP, CSV or NPZ.

    Parameters
    ----------
    path : str or path-like
        The file.
    partial : bool
        Accept what is whole of an MCAP file that was cut off or damaged.

    Returns
    -------
    TouchRecording
        The recording, checked, in SI units.

    Raises
    ------
    RecordingError
        If the file is missing, of an unknown format, damaged, holds no touch, or its content is not valid.
    """
    file = _existing(path)
    if file.suffix.lower() in IMAGE_SUFFIXES:
        raise RecordingError(f"{file}: a picture holds no touch: give a .mcap, .csv or .npz recording")
    touch = read_scene(file, partial=partial).touch
    if touch is None:
        raise RecordingError(f"{file}: the recording holds no touch (no topic /finger/taxels): record it too")
    return touch


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
    """Write a touch recording as MCAP, CSV or NPZ; the file appears whole or not at all.

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
        raise RecordingError(f"{path}: unknown format {suffix or 'without suffix'}: use .mcap, .csv or .npz")


def _existing(path: str | os.PathLike[str]) -> Path:
    file = Path(path)
    if file.is_dir():
        inside = sorted(file.glob("*.mcap"))
        if len(inside) == 1 and (file / "metadata.yaml").exists():
            return inside[0]  # as `ros2 bag record` leaves it
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
