"""The intrinsics of a camera: from numbers, from a ROS calibration file, or from a recording."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import RecordingError, UsageError
from evifuse.recordings import messages
from evifuse.recordings.checks import finite
from evifuse.recordings.mcap_reader import read_raw

__all__ = ["DISTORTION_MODELS", "Intrinsics", "intrinsics_of", "read_intrinsics", "undistorted"]

DISTORTION_MODELS = ("plumb_bob", "rational_polynomial")
"""Lens models of ``CameraInfo`` whose distortion can be removed from a picture."""


@dataclass(frozen=True, eq=False)
class Intrinsics:
    """What a camera's calibration says about its lens.

    Parameters
    ----------
    matrix : ndarray of float64, shape (3, 3)
        Camera matrix K, px.
    size : tuple of int or None
        Width and height of the pictures it is for, px; None if it is not known.
    distortion : ndarray of float64, shape (M,)
        Lens coefficients, as OpenCV orders them; empty for a lens without distortion.
    """

    matrix: NDArray[np.float64]
    size: tuple[int, int] | None
    distortion: NDArray[np.float64]

    @classmethod
    def of(cls, fx: float, fy: float, cx: float, cy: float) -> "Intrinsics":
        """Intrinsics of a pinhole camera without distortion.

        Parameters
        ----------
        fx, fy : float
            Focal lengths, px.
        cx, cy : float
            Principal point, px; pixel centres are whole numbers.

        Returns
        -------
        Intrinsics
            For pictures of any size.

        Raises
        ------
        UsageError
            If a number is not finite or a focal length is not above 0.

        Examples
        --------
        >>> Intrinsics.of(600, 600, 320, 240).matrix[0]
        array([600.,   0., 320.])
        """
        if not (np.isfinite([fx, fy, cx, cy]).all() and fx > 0 and fy > 0):
            raise UsageError(
                f"intrinsics fx, fy, cx, cy = {fx:g}, {fy:g}, {cx:g}, {cy:g} px are no camera's: all must be "
                "finite, the focal lengths fx and fy above 0"
            )
        matrix = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
        return cls(matrix, None, np.zeros(0))


def read_intrinsics(path: str | Path) -> Intrinsics:
    """Read intrinsics from a ROS calibration file or from the ``CameraInfo`` of an MCAP file.

    Parameters
    ----------
    path : str or Path
        YAML as ``camera_calibration`` writes it (``camera_matrix``, ``distortion_coefficients``) or as
        ``ros2 topic echo`` prints it (``k``, ``d``), or an MCAP file.

    Returns
    -------
    Intrinsics
        With the lens coefficients; those of an MCAP file are left out, because they are removed from its
        picture when it is read.

    Raises
    ------
    RecordingError
        If the file can't be read, has no intrinsics, or they are not those of a calibrated camera.
    """
    file = Path(path)
    if file.suffix.lower() == ".mcap":
        topics = read_raw(file).topics
        found = topics[messages.CAMERA_INFO].decoded(file.name) if messages.CAMERA_INFO in topics else []
        if not found:
            raise RecordingError(f"{file}: no message on {messages.CAMERA_INFO}: give fx,fy,cx,cy instead")
        info = found[0]
        known = intrinsics_of(info.k, (), info.distortion_model, (info.width, info.height), str(file))
        return Intrinsics(known.matrix, known.size, np.zeros(0))
    content = _yaml(file)
    matrix = _numbers(content, "camera_matrix", "k", "K")
    if matrix is None:
        raise RecordingError(f"{file}: neither camera_matrix nor k in it: give a ROS camera calibration")
    width, height = (
        content.get("image_width", content.get("width")),
        content.get("image_height", content.get("height")),
    )
    size = (width, height) if isinstance(width, int) and isinstance(height, int) else None
    coefficients = _numbers(content, "distortion_coefficients", "d", "D")
    model = content.get("distortion_model", DISTORTION_MODELS[0])
    return intrinsics_of(matrix, () if coefficients is None else coefficients, model, size, str(file))


def intrinsics_of(
    matrix: Any, distortion: Any, model: object, size: tuple[int, int] | None, name: str
) -> Intrinsics:
    """Intrinsics from the fields of a calibration, checked.

    Parameters
    ----------
    matrix : array_like, shape (9,)
        Camera matrix row by row, px.
    distortion : array_like, shape (M,)
        Lens coefficients; all zero or empty for none.
    model : str
        Lens model that they belong to.
    size : tuple of int or None
        Width and height, px.
    name : str
        Where they are from, for messages.

    Returns
    -------
    Intrinsics
        The same as arrays.

    Raises
    ------
    RecordingError
        If the matrix is not that of a calibrated camera or the lens model is not known.
    """
    k = finite(matrix, f"matrix k of {messages.CAMERA_INFO}", (9,), name).reshape(3, 3)
    if not (k[0, 0] > 0 and k[1, 1] > 0 and abs(k[2, 2] - 1) < 1e-9):
        raise RecordingError(
            f"{name}: matrix k of {messages.CAMERA_INFO} is not that of a calibrated camera: calibrate it"
        )
    if not np.any(distortion):
        return Intrinsics(k, size, np.zeros(0))
    if model not in DISTORTION_MODELS:
        raise RecordingError(
            f"{name}: lens model {model!r} of {messages.CAMERA_INFO} is not known: "
            f"rectify the picture first, or use one of {', '.join(DISTORTION_MODELS)}"
        )
    d = finite(distortion, f"lens coefficients of {messages.CAMERA_INFO}", (len(distortion),), name)
    return Intrinsics(k, size, d)


def undistorted(image: NDArray[np.uint8], intrinsics: Intrinsics, name: str) -> NDArray[np.uint8]:
    """Remove the distortion of the lens from a picture; its camera matrix stays the same.

    Parameters
    ----------
    image : ndarray of uint8, shape (H, W) or (H, W, 3)
        Grey or BGR.
    intrinsics : Intrinsics
        Of the camera that took it.
    name : str
        Where the calibration is from, for messages.

    Returns
    -------
    ndarray of uint8, shape (H, W) or (H, W, 3)
        The same array if there is no distortion.

    Raises
    ------
    RecordingError
        If the number of lens coefficients is not that of a lens model.
    """
    if not len(intrinsics.distortion):
        return image
    import cv2

    try:
        return cv2.undistort(image, intrinsics.matrix, intrinsics.distortion).astype(np.uint8, copy=False)
    except cv2.error as error:
        raise RecordingError(
            f"{name}: {len(intrinsics.distortion)} lens coefficients of {messages.CAMERA_INFO} do not fit "
            "its lens model: calibrate again"
        ) from error


def _yaml(file: Path) -> Mapping[str, Any]:
    import yaml

    try:
        with file.open(encoding="utf-8") as stream:
            # `ros2 topic echo` ends each message with a line of dashes: the first one is taken
            content = next(yaml.safe_load_all(stream), None)
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "not UTF-8 text"
        raise RecordingError(f"{file}: can't be read: {why}") from None
    except yaml.YAMLError as error:
        raise RecordingError(f"{file}: not valid YAML: {' '.join(str(error).split())}") from None
    if not isinstance(content, Mapping):
        raise RecordingError(f"{file}: not a ROS camera calibration: it must hold camera_matrix or k")
    return content


def _numbers(content: Mapping[str, Any], *names: str) -> Sequence[float] | None:
    """A list of numbers by the first name that is there, plain or under ``data``."""
    for name in names:
        value = content.get(name)
        if isinstance(value, Mapping):
            value = value.get("data")
        if isinstance(value, list):
            return value
    return None
