"""Where pictures come from: files, folders, patterns, videos and cameras, one picture after another."""

import os
import re
import time
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from glob import glob, has_magic
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import ImageError, UsageError
from evifuse.recordings.animation import frame_count
from evifuse.recordings.files import IMAGE_SUFFIXES, read_scene
from evifuse.recordings.images import MAX_PIXELS, as_image
from evifuse.recordings.intrinsics import Intrinsics

__all__ = ["VIDEO_SUFFIXES", "Picture", "Sources", "camera_pictures", "find_sources", "pictures_of"]

VIDEO_SUFFIXES = (".mp4", ".m4v", ".mov", ".avi", ".mkv", ".webm", ".mpg", ".mpeg", ".ogv", ".wmv")
"""Files that are read as a video."""

SHORTFALL = 0.05
"""A video that ends this share of its declared frames too early counts as cut off (our own)."""


@dataclass(frozen=True, eq=False)
class Picture:
    """A picture and where it is from.

    Parameters
    ----------
    path : str
        File, or ``camera N``.
    image : ndarray of uint8, shape (H, W) or (H, W, 3)
        Grey or BGR.
    frame : int or None
        Number of the frame in a video or from a camera, from 0; None for a still picture.
    time_s : float or None
        When the frame was, seconds from the first one.
    note : str
        What a person should know about how it was read; empty for nothing.
    camera : Intrinsics or None
        Of the camera that took it; None as long as nobody asked.
    """

    path: str
    image: NDArray[np.uint8]
    frame: int | None = None
    time_s: float | None = None
    note: str = ""
    camera: Intrinsics | None = None


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


def find_sources(given: Sequence[str]) -> Sources:
    """Find the files that names, folders and patterns stand for.

    Parameters
    ----------
    given : sequence of str
        Files, folders and patterns with ``*``, ``?``, ``[...]`` and ``**``. Of a folder (not of folders in
        it) and of a pattern the pictures, videos and MCAP files are taken; a folder that ``ros2 bag record``
        made is one recording.

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
        if path.is_dir() and not (path / "metadata.yaml").exists():
            many = True
            paths.update(dict.fromkeys(_usable([str(p) for p in path.iterdir()], f"{name}: this folder")))
        elif has_magic(name) and not path.exists():
            many = True
            paths.update(dict.fromkeys(_usable(glob(name, recursive=True), f"{name}: this pattern")))
        else:
            paths[name] = None
            many = many or path.suffix.lower() in VIDEO_SUFFIXES
    return Sources(tuple(paths), many)


def _usable(names: list[str], what: str) -> list[str]:
    """Pictures, videos and recordings among names, in the order a person would count them."""
    known = (*IMAGE_SUFFIXES, *VIDEO_SUFFIXES, ".mcap")
    usable = [
        n
        for n in names
        if n.lower().endswith(known) and not Path(n).name.startswith(".") and Path(n).is_file()
    ]
    if not usable:
        raise UsageError(f"{what} holds no picture, video or MCAP file: check its name")
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
        yield from _video(path, every, limit)
        return
    image = read_scene(path).image
    if image is None:
        raise UsageError(f"{path}: holds no picture: give a recording with one")
    frames = frame_count(path)
    note = f"{path}: an animation: the first of its {frames} frames is taken" if frames > 1 else ""
    yield Picture(path, image, note=note)


def camera_pictures(number: int, every: int = 1, limit: int | None = None) -> Iterator[Picture]:
    """Pictures of a camera, until it ends or the limit is reached.

    Parameters
    ----------
    number : int
        Number of the camera, from 0.
    every : int
        Take every so many frames.
    limit : int or None
        Take at most so many frames; without it, go on.

    Yields
    ------
    Picture
        With seconds since the first frame.

    Raises
    ------
    UsageError
        If there is no such camera.
    ImageError
        If it stops.
    """
    with _opened(number) as capture:
        if not capture.isOpened():
            raise UsageError(f"--camera {number}: there is no such camera, or another program uses it")
        taken, frame, start = 0, 0, 0.0
        while limit is None or taken < limit:
            if not capture.grab():
                raise ImageError(f"camera {number} gives no more pictures after {frame}: check its cable")
            now = time.monotonic()
            start = start if frame else now
            if frame % every == 0:
                image = _retrieved(capture, f"camera {number}, frame {frame}")
                yield Picture(f"camera {number}", image, frame, now - start)
                taken += 1
            frame += 1


def _video(path: str, every: int, limit: int | None) -> Iterator[Picture]:
    import cv2

    _check_file(path)
    with _opened(path) as capture:
        if not capture.isOpened():
            raise ImageError(f"{path}: not a video that can be read: check it, or convert it to MP4")
        width, height = (round(capture.get(k)) for k in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT))
        if width * height > MAX_PIXELS:
            raise ImageError(
                f"{path} is {width} x {height} px: scale it down to {MAX_PIXELS:,} pixels or less"
            )
        declared = capture.get(cv2.CAP_PROP_FRAME_COUNT)
        taken, frame, start = 0, 0, 0.0
        while limit is None or taken < limit:
            if not capture.grab():
                break
            now = capture.get(cv2.CAP_PROP_POS_MSEC) / 1000
            start = start if frame else now
            if frame % every == 0:
                yield Picture(path, _retrieved(capture, f"{path}, frame {frame}"), frame, now - start)
                taken += 1
            frame += 1
        else:
            return
        if frame == 0:
            raise ImageError(f"{path}: no frame of this video can be read: copy it again")
        if frame < declared * (1 - SHORTFALL) - 1:
            raise ImageError(
                f"{path} is cut off: it ends after {frame} of its {declared:.0f} frames: copy it again"
            )


def _check_file(path: str) -> None:
    file = Path(path)
    if not file.exists():
        raise ImageError(f"{path}: there is no such file: check its name")
    if not file.is_file():
        raise ImageError(f"{path}: not a file: name a video")
    try:
        with file.open("rb") as stream:
            empty = not stream.read(1)
    except OSError as error:
        raise ImageError(f"{path} can't be read: {error.strerror or error}") from None
    if empty:
        raise ImageError(f"{path} is empty (0 bytes): copy it again")


@contextmanager
def _opened(source: str | int) -> Generator[Any]:
    """A capture without OpenCV's own messages."""
    import cv2

    level = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    capture = None
    try:
        capture = _capture(source)
        yield capture
    finally:
        if capture is not None:
            capture.release()
        cv2.utils.logging.setLogLevel(level)


def _capture(source: str | int) -> Any:
    import cv2

    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")  # FFmpeg's messages, which OpenCV passes through
    return cv2.VideoCapture(source)


def _retrieved(capture: Any, name: str) -> NDArray[np.uint8]:
    whole, image = capture.retrieve()
    if not whole or image is None:
        raise ImageError(f"{name} is broken: copy or record it again")
    return as_image(image, name)
