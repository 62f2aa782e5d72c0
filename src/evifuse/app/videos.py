"""Frames of videos and cameras, one picture after another."""

import os
import time
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import ImageError, UsageError
from evifuse.recordings.images import MAX_PIXELS, as_image
from evifuse.recordings.intrinsics import Intrinsics

__all__ = ["VIDEO_SUFFIXES", "Picture", "camera_pictures", "video_pictures"]

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


def video_pictures(path: str, every: int = 1, limit: int | None = None) -> Iterator[Picture]:
    """Frames of a video.

    Parameters
    ----------
    path : str
        The file.
    every : int
        Take every so many frames.
    limit : int or None
        Take at most so many frames.

    Yields
    ------
    Picture
        With seconds since the first frame.

    Raises
    ------
    ImageError
        If the file can't be read, or its frames are too large; if it is cut off, after its whole frames.
    """
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
