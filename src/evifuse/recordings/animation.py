"""How many pictures a picture file holds: animations and files of several pages."""

import struct
from pathlib import Path

__all__ = ["frame_count"]

_LONGEST_CHAIN = 100_000
"""Pages of a TIFF file are counted so far; a chain that runs in a circle ends there."""


def frame_count(path: str | Path) -> int:
    """Pictures in a GIF, PNG, WebP or TIFF file.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    int
        Frames or pages that the file declares; 1 for other formats and for a file that can't be followed.
    """
    data = Path(path).read_bytes()
    try:
        if data[:6] in (b"GIF87a", b"GIF89a"):
            found = _gif_frames(data)
        elif data.startswith(b"\x89PNG\r\n\x1a\n"):
            found = _png_frames(data)
        elif data[:4] == b"RIFF" and data[8:12] == b"WEBP":
            found = _webp_frames(data)
        elif data[:4] in (b"II*\0", b"MM\0*"):
            found = _tiff_pages(data)
        else:
            found = 1
    except (struct.error, IndexError):
        found = 1
    return max(found, 1)


def _gif_frames(data: bytes) -> int:
    """Count image descriptors, from block to block."""
    colours = data[10]
    position = 13 + (3 << (colours & 7) + 1 if colours & 0x80 else 0)
    frames = 0
    while data[position] != 0x3B:
        if data[position] == 0x2C:
            frames += 1
            colours = data[position + 9]
            position += 11 + (3 << (colours & 7) + 1 if colours & 0x80 else 0)
        else:
            position += 2
        while data[position]:
            position += 1 + data[position]
        position += 1
    return frames


def _png_frames(data: bytes) -> int:
    """What the chunk acTL says, which comes before the picture."""
    position = 8
    while position + 12 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, position)
        if kind == b"acTL":
            return struct.unpack_from(">I", data, position + 8)[0]
        if kind == b"IDAT":
            break
        position += 12 + length
    return 1


def _webp_frames(data: bytes) -> int:
    """Count the chunks ANMF."""
    position, frames = 12, 0
    while position + 8 <= len(data):
        kind, length = struct.unpack_from("<4sI", data, position)
        frames += kind == b"ANMF"
        position += 8 + length + length % 2
    return frames


def _tiff_pages(data: bytes) -> int:
    """Follow the chain of directories."""
    order = "<" if data[:2] == b"II" else ">"
    start, pages = struct.unpack_from(order + "I", data, 4)[0], 0
    while start and pages < _LONGEST_CHAIN:
        entries = struct.unpack_from(order + "H", data, start)[0]
        pages += 1
        start = struct.unpack_from(order + "I", data, start + 2 + 12 * entries)[0]
    return pages
