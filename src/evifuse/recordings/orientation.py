"""How a camera was held, as EXIF says it in PNG and WebP files, and pictures turned upright.

OpenCV turns JPEG and TIFF files by itself, but not PNG and WebP files that are read with all their channels.
"""

import struct

import numpy as np
from numpy.typing import NDArray

__all__ = ["stored_orientation", "upright"]

_PNG = b"\x89PNG\r\n\x1a\n"
_ORIENTATION = 0x0112


def stored_orientation(data: bytes) -> int:
    """EXIF orientation that a PNG or WebP file stores.

    Parameters
    ----------
    data : bytes
        Content of the file.

    Returns
    -------
    int
        1 to 8 as in the EXIF standard; 1, upright, if there is none, it is not valid, or for other formats.
    """
    try:
        if data.startswith(_PNG):
            return _of_exif(_png_chunk(data, b"eXIf"))
        if data[:4] == b"RIFF" and data[8:12] == b"WEBP":
            return _of_exif(_webp_chunk(data, b"EXIF"))
    except struct.error:
        pass
    return 1


def upright(image: NDArray[np.generic], orientation: int) -> NDArray[np.generic]:
    """Turn and mirror a picture by its EXIF orientation.

    Parameters
    ----------
    image : ndarray, shape (H, W) or (H, W, K)
        As it is stored.
    orientation : int
        1 to 8.

    Returns
    -------
    ndarray
        As it should be seen; a view.

    Examples
    --------
    >>> upright(np.array([[1, 2], [3, 4]]), 6)
    array([[3, 1],
           [4, 2]])
    """
    turned = image.swapaxes(0, 1) if orientation >= 5 else image
    if orientation in (3, 4, 7, 8):
        turned = turned[::-1]
    return turned[:, ::-1] if orientation in (2, 3, 6, 7) else turned


def _png_chunk(data: bytes, wanted: bytes) -> bytes:
    """Content of the first chunk of a kind; empty if there is none."""
    position = 8
    while position + 8 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, position)
        if kind == wanted:
            return data[position + 8 : position + 8 + length]
        position += 12 + length
    return b""


def _webp_chunk(data: bytes, wanted: bytes) -> bytes:
    """Content of the first chunk of a kind; empty if there is none."""
    position = 12
    while position + 8 <= len(data):
        kind, length = struct.unpack_from("<4sI", data, position)
        if kind == wanted:
            return data[position + 8 : position + 8 + length]
        position += 8 + length + length % 2
    return b""


def _of_exif(exif: bytes) -> int:
    exif = exif.removeprefix(b"Exif\0\0")
    if exif[:4] not in (b"II*\0", b"MM\0*"):
        return 1
    order = "<" if exif[:2] == b"II" else ">"
    start = struct.unpack_from(order + "I", exif, 4)[0]
    for entry in range(struct.unpack_from(order + "H", exif, start)[0]):
        tag, kind, _, value = struct.unpack_from(order + "HHIH", exif, start + 2 + 12 * entry)
        if tag == _ORIENTATION:
            return value if kind == 3 and 1 <= value <= 8 else 1
    return 1
