"""Where pictures come from: files, folders and patterns, one picture after another."""

import os
import re
import sys
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from glob import glob, has_magic
from pathlib import Path

from evifuse.app.videos import VIDEO_SUFFIXES, Picture, video_pictures
from evifuse.errors import UsageError
from evifuse.recordings.animation import frame_count
from evifuse.recordings.files import IMAGE_SUFFIXES, read_scene

__all__ = ["Sources", "find_sources", "pictures_of"]


@dataclass(frozen=True)
class Sources:
    """Files to look at.

    Parameters
    ----------
    paths : tuple of str
        Files, each once, in the order they were named; those of a folder or pattern by name, ``2`` before
        ``10``.
    many : bool
        Whether there may be more than one picture: several names, a folder, a pattern or a video.
    """

    paths: tuple[str, ...]
    many: bool


PICTURES = (*IMAGE_SUFFIXES, *VIDEO_SUFFIXES, ".mcap")
"""Files that may hold pictures."""


def _recorded(path: Path) -> bool:
    """Whether a folder is one that ``ros2 bag record`` made."""
    return (path / "metadata.yaml").exists()


def find_sources(
    given: Sequence[str],
    known: tuple[str, ...] = PICTURES,
    what: str = "picture, video or MCAP file",
    is_one: Callable[[Path], bool] = _recorded,
) -> Sources:
    """Find the files that names, folders and patterns stand for.

    Parameters
    ----------
    given : sequence of str
        Files, folders and patterns with ``*``, ``?``, ``[...]`` and ``**``. Of a folder (not of folders in
        it) and of a pattern the pictures, videos and MCAP files are taken; a folder that ``ros2 bag record``
        made is one recording.
    known : tuple of str
        How the names of usable files end.
    what : str
        What they are, for messages.
    is_one : callable
        Whether a folder is one recording.

    Returns
    -------
    Sources
        A name that does not exist is kept, so that the others can still be done.

    Raises
    ------
    UsageError
        If a folder or pattern holds nothing to look at.
    """
    paths: dict[str, None] = {}
    many = len(given) > 1
    for name in given:
        path = Path(name)
        if path.is_dir() and not is_one(path):
            many = True
            inside = [str(p) for p in path.iterdir()]
            paths.update(
                dict.fromkeys(_usable(inside, known, f"{name}: this folder holds no {what}", is_one))
            )
        elif has_magic(name) and not path.exists():
            many = True
            found = glob(name, recursive=True)
            paths.update(
                dict.fromkeys(_usable(found, known, f"{name}: this pattern holds no {what}", is_one))
            )
        else:
            paths[name] = None
            many = many or path.suffix.lower() in VIDEO_SUFFIXES
    return Sources(tuple(paths), many)


def _usable(
    names: list[str], known: tuple[str, ...], missing: str, is_one: Callable[[Path], bool]
) -> list[str]:
    """What can be read among names, in the order a person would count them."""
    usable = [
        n
        for n in names
        if not Path(n).name.startswith(".")
        and (
            (n.lower().endswith(known) and Path(n).is_file()) or (is_one is not _recorded and is_one(Path(n)))
        )
    ]
    if not usable:
        raise UsageError(f"{missing}: check its name")
    return sorted(usable, key=_counting)


def _counting(name: str) -> tuple[list[tuple[int, str]], str]:
    """Sorts ``frame2`` before ``frame10``."""
    parts = re.findall(r"\d+|\D+", name)
    return [(int(p), "") if p.isdecimal() else (-1, p) for p in parts], name


def pictures_of(path: str, every: int = 1, limit: int | None = None) -> Iterator[Picture]:
    """Pictures of a file, read one at a time.

    Parameters
    ----------
    path : str
        Picture, video, or MCAP file with a picture.
    every : int
        Take every so many frames of a video.
    limit : int or None
        Take at most so many frames of a video.

    Yields
    ------
    Picture
        One for a picture or recording, one for each frame that is taken of a video.

    Raises
    ------
    InputError
        If the file can't be read; of a video that is cut off, after the frames that are whole.
    """
    if path.lower().endswith(VIDEO_SUFFIXES):
        yield from video_pictures(path, every, limit)
        return
    with _quiet():
        image = read_scene(path).image
    if image is None:
        raise UsageError(f"{path}: holds no picture: give a recording with one")
    frames = frame_count(path)
    note = f"{path}: an animation: the first of its {frames} frames is taken" if frames > 1 else ""
    yield Picture(path, image, note=note)


@contextmanager
def _quiet() -> Generator[None]:
    """Without what libpng, libjpeg and libtiff write to standard error by themselves, past Python."""
    sys.stderr.flush()
    try:
        saved = os.dup(2)
    except OSError:  # there is no standard error
        yield
        return
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        yield
    finally:
        os.dup2(saved, 2)
        os.close(saved)
        os.close(nowhere)
