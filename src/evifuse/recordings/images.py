"""Pictures from files and arrays, as one kind of value: contiguous 8-bit grey or BGR."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evifuse.errors import ImageError
from evifuse.recordings.headers import declared_size, is_truncated
from evifuse.recordings.orientation import stored_orientation, upright

__all__ = ["MAX_BYTES", "MAX_PIXELS", "MIN_SIDE_PX", "as_image", "bytes_of", "decoded", "read_image"]

MIN_SIDE_PX = 8
"""No outline can be told from noise in a picture that is narrower than this."""

MAX_PIXELS = 100_000_000
"""Pictures with more pixels are refused before they are decoded."""

MAX_BYTES = 1 << 30
"""Files with more bytes are refused before they are read to the end."""

_BLOCK = 1 << 20
"""Pixels that are converted together, so that a conversion needs little memory beside the picture."""


def read_image(path: str | Path) -> NDArray[np.uint8]:
    """Read a picture file.

    Transparency is laid over white; the first frame of an animation is taken (`frame_count` says how many
    there are); the orientation that a camera wrote into a JPEG, TIFF, PNG or WebP file is applied. See
    `as_image` for 16-bit and float pictures.

    Parameters
    ----------
    path : str or Path
        File in a format that OpenCV reads: PNG, JPEG, GIF, BMP, TIFF, WebP, PNM.

    Returns
    -------
    ndarray of uint8, shape (H, W) or (H, W, 3)
        Grey or BGR, C-contiguous; pixel (0, 0) is the upper left.

    Raises
    ------
    ImageError
        If the file is missing, empty, truncated, not a picture, larger than 1 GiB, or the picture is smaller
        than 8 px on a side or larger than 100 million pixels. Sizes are judged by the header, before anything
        is decoded.
    """
    file = Path(path)
    data = bytes_of(file)
    size = declared_size(data)
    if size is not None:
        _check_size(f"image {file}", *size)
    if is_truncated(data):
        raise ImageError(f"image {file} is truncated: its data ends before the picture does; copy it again")
    array = None if size is None else decoded(data)
    if array is None:
        raise ImageError(f"{file} is not an image that can be read: use PNG, JPEG, GIF, BMP, TIFF or WebP")
    return as_image(array, f"image {file}")


def as_image(array: ArrayLike, name: str = "image") -> NDArray[np.uint8]:
    """Turn an array into a picture of the kind that the sensors take.

    Parameters
    ----------
    array : array_like, shape (H, W), (H, W, 1), (H, W, 2), (H, W, 3) or (H, W, 4)
        Grey, grey + alpha, BGR or BGRA. Floats are 0 to 1 or, if any is above 1, 0 to 255. Integers of more
        than 8 bits are scaled from the smallest even number of bits that holds them (10, 12, 14, 16): a
        picture of a 12-bit camera is not dark then. Transparency is laid over white.
    name : str, optional
        What to call the picture in messages.

    Returns
    -------
    ndarray of uint8, shape (H, W) or (H, W, 3)
        Grey or BGR, C-contiguous.

    Raises
    ------
    ImageError
        If the shape, the type or a value is not that of a picture.

    Examples
    --------
    >>> as_image([[0.0, 1.0] * 4] * 8)[0, :3]
    array([  0, 255,   0], dtype=uint8)
    """
    values = np.asarray(array)
    if values.ndim not in (2, 3) or (values.ndim == 3 and not 1 <= values.shape[2] <= 4):
        raise ImageError(
            f"{name} has shape {values.shape}: expected (height, width), or that with 1 to 4 channels"
        )
    _check_size(name, values.shape[1], values.shape[0])
    pixels = _to_8_bit(values, name)
    if pixels.ndim == 3 and pixels.shape[2] in (2, 4):
        pixels = _over_white(pixels)
    if pixels.ndim == 3 and pixels.shape[2] == 1:
        pixels = pixels[..., 0]
    return np.ascontiguousarray(pixels)


def bytes_of(file: Path) -> bytes:
    """Content of a picture file.

    Parameters
    ----------
    file : Path
        The file.

    Returns
    -------
    bytes
        All of it.

    Raises
    ------
    ImageError
        If it can't be read, is empty, or is larger than 1 GiB.
    """
    if file.is_dir():
        raise ImageError(f"image {file} is a directory: name one file in it")
    try:
        with file.open("rb") as stream:
            data = _read(stream)
    except FileNotFoundError:
        raise ImageError(f"image {file} does not exist: check the path") from None
    except OSError as error:
        raise ImageError(f"image {file} can't be read: {error.strerror or error}") from None
    if not data:
        raise ImageError(f"image {file} is empty (0 bytes): copy it again")
    if len(data) > MAX_BYTES:
        raise ImageError(f"image {file} has more than {MAX_BYTES:,} bytes: scale it down or compress it")
    return data


def _read(stream: BinaryIO) -> bytes:
    """What a file holds, at most a byte more than is allowed; memory is taken for what is there."""
    expected = os.fstat(stream.fileno()).st_size  # 0 for a pipe
    parts = [stream.read(min(expected, MAX_BYTES) + 1)]
    total = len(parts[0])
    while parts[-1] and total <= MAX_BYTES:
        parts.append(stream.read(_BLOCK))
        total += len(parts[-1])
    return b"".join(parts) if any(parts[1:]) else parts[0]


def decoded(data: bytes) -> NDArray[np.generic] | None:
    """Decode a picture with every channel and bit, upright.

    Parameters
    ----------
    data : bytes
        Content of the file.

    Returns
    -------
    ndarray or None
        None if OpenCV can't decode it.
    """
    import cv2

    is_jpeg = data.startswith(b"\xff\xd8")
    flags = cv2.IMREAD_ANYCOLOR | cv2.IMREAD_ANYDEPTH if is_jpeg else cv2.IMREAD_UNCHANGED
    level = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        array = cv2.imdecode(np.frombuffer(data, np.uint8), flags)
    except cv2.error:
        return None
    finally:
        cv2.utils.logging.setLogLevel(level)
    if array is None or array.size == 0:  # pyright: ignore[reportUnnecessaryComparison]
        return None
    return upright(array, stored_orientation(data))


def _check_size(name: str, width: int, height: int) -> None:
    if min(width, height) < MIN_SIDE_PX:
        raise ImageError(
            f"{name} is {width} x {height} px: at least {MIN_SIDE_PX} x {MIN_SIDE_PX} px are needed"
        )
    if width * height > MAX_PIXELS:
        raise ImageError(f"{name} is {width} x {height} px: scale it down to {MAX_PIXELS:,} pixels or less")


def _to_8_bit(values: NDArray[np.generic], name: str) -> NDArray[np.uint8]:
    if values.dtype == np.uint8:
        return values.astype(np.uint8, copy=False)
    if values.dtype == np.bool_:
        return values.astype(np.uint8) * np.uint8(255)
    if values.dtype.kind not in "iuf":
        raise ImageError(f"{name} holds {values.dtype}: expected integers or floats")
    lowest, highest = float(values.min()), float(values.max())
    if not np.isfinite([lowest, highest]).all():
        raise ImageError(f"{name} holds NaN or infinite values: replace them before")
    if lowest < 0:
        raise ImageError(f"{name} holds negative values (lowest {lowest:g}): shift or clip them before")
    if values.dtype.kind == "f":
        if highest > 255:
            raise ImageError(f"{name} holds floats up to {highest:g}: expected 0 to 1, or 0 to 255")
        factor = 255.0 if highest <= 1 else 1.0
    else:
        if highest > 65535:
            raise ImageError(f"{name} holds integers up to {highest:g}: expected at most 16 bits")
        bits = max(8, int(highest).bit_length())
        factor = 255.0 / (2.0 ** (bits + bits % 2) - 1)
    pixels = np.empty(values.shape, np.uint8)
    for rows in _row_blocks(values):
        pixels[rows] = np.round(values[rows].astype(np.float64) * factor)
    return pixels


def _over_white(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Lay the colour channels over a white ground by the last channel, alpha."""
    flat = np.empty((*pixels.shape[:2], pixels.shape[2] - 1), np.uint8)
    for rows in _row_blocks(pixels):
        colour = pixels[rows, :, :-1].astype(np.float64)
        alpha = pixels[rows, :, -1:].astype(np.float64) / 255.0
        flat[rows] = np.round(colour * alpha + 255.0 * (1 - alpha))
    return flat


def _row_blocks(array: NDArray[np.generic]) -> Iterator[slice]:
    """Rows in blocks of about a million pixels."""
    step = max(1, _BLOCK // array.shape[1])
    return (slice(i, i + step) for i in range(0, array.shape[0], step))
