"""The picture of a recording and the camera that took it."""

from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import ImageError, RecordingError
from evifuse.recordings import messages
from evifuse.recordings.checks import finite, unit
from evifuse.recordings.headers import declared_size, is_truncated
from evifuse.recordings.images import MAX_PIXELS, as_image
from evifuse.recordings.intrinsics import intrinsics_of, undistorted
from evifuse.recordings.mcap_reader import Topic
from evifuse.recordings.recording import Camera

__all__ = ["picture"]


def picture(topics: dict[str, Topic], name: str) -> tuple[NDArray[np.uint8] | None, Camera | None]:
    """First picture of a recording, free of lens distortion, and its camera.

    Parameters
    ----------
    topics : dict of str to Topic
        Raw messages by topic.
    name : str
        Name of the file, for messages.

    Returns
    -------
    image : ndarray of uint8, shape (H, W) or (H, W, 3), or None
        Grey or BGR picture; None if there is none.
    camera : Camera or None
        The camera; None if intrinsics or pose are not in the file.

    Raises
    ------
    RecordingError
        If a message is broken, the lens model is unknown, or the camera's size is not the picture's.
    """
    images = _decoded(topics, messages.IMAGE, name)
    infos = _decoded(topics, messages.CAMERA_INFO, name)
    if not images:
        return None, None
    image = _image(images[0], name)
    if not infos:
        return image, None
    info = infos[0]
    height, width = image.shape[:2]
    if (info.width, info.height) != (width, height):
        raise RecordingError(
            f"{name}: {messages.CAMERA_INFO} is for {info.width}x{info.height} px, but the picture has "
            f"{width}x{height} px: record the camera's own calibration"
        )
    known = intrinsics_of(info.k, info.d, info.distortion_model, (width, height), name)
    image = undistorted(image, known, name)
    poses = _decoded(topics, messages.CAMERA_POSE, name)
    if not poses:
        return image, None
    taken = _time(images[0])
    pose = min(poses, key=lambda message: abs(_time(message) - taken)).pose
    p, q = pose.position, pose.orientation
    position = finite([p.x, p.y, p.z], messages.CAMERA_POSE, (3,), name)
    orientation = finite([[q.x, q.y, q.z, q.w]], messages.CAMERA_POSE, (1, 4), name)
    orientation = unit(orientation, "camera orientation", name)[0]
    return image, Camera(width, height, known.matrix, position, orientation)


def _decoded(topics: dict[str, Topic], key: str, name: str) -> list[Any]:
    return topics[key].decoded(name) if key in topics else []


def _time(message: Any) -> int:
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


def _image(message: Any, name: str) -> NDArray[np.uint8]:
    import cv2

    where = f"{name}: the picture on {messages.IMAGE}"
    data = np.ascontiguousarray(message.data, dtype=np.uint8)
    content = data.tobytes()
    width, height = declared_size(content) or (0, 0)
    if width * height > MAX_PIXELS:
        raise RecordingError(
            f"{where} is {width} x {height} px: scale it down to {MAX_PIXELS:,} pixels or less"
        )
    decoded = None
    if content and not is_truncated(content):
        level = cv2.utils.logging.getLogLevel()
        cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
        with suppress(cv2.error):
            decoded = cv2.imdecode(data, cv2.IMREAD_ANYCOLOR | cv2.IMREAD_ANYDEPTH)
        cv2.utils.logging.setLogLevel(level)
    if decoded is None:  # pyright: ignore[reportUnnecessaryComparison]
        raise RecordingError(f"{where} is broken or not PNG or JPEG: record it again")
    try:
        return as_image(decoded, where)
    except ImageError as error:
        raise RecordingError(str(error)) from error
