"""What the header of a picture file says, read without decoding the picture."""

import re
import struct

__all__ = ["declared_size", "is_truncated"]

_PNG = b"\x89PNG\r\n\x1a\n"
_JPEG = b"\xff\xd8"
_PNM = re.compile(rb"P[1-6](?:\s|#[^\n]*\n)+(\d{1,9})(?:\s|#[^\n]*\n)+(\d{1,9})\s")


def declared_size(data: bytes) -> tuple[int, int] | None:
    """Width and height that a picture file declares.

    Parameters
    ----------
    data : bytes
        Content of the file.

    Returns
    -------
    tuple of int or None
        Width and height, px; None for a format that is not known here or a header that is cut short.
    """
    try:
        if data.startswith(_PNG):
            return struct.unpack_from(">II", data, 16)
        if data.startswith(_JPEG):
            return _jpeg_scan(data)[0]
        if data[:6] in (b"GIF87a", b"GIF89a"):
            return struct.unpack_from("<HH", data, 6)
        if data.startswith(b"BM"):
            old = struct.unpack_from("<I", data, 14)[0] == 12
            width, height = struct.unpack_from("<HH" if old else "<ii", data, 18)
            return abs(width), abs(height)
        if data[:4] == b"RIFF" and data[8:12] == b"WEBP":
            return _webp_size(data)
        if data[:4] in (b"II*\0", b"MM\0*"):
            return _tiff_size(data)
        plain = _PNM.match(data[:4096])
        if plain:
            return int(plain[1]), int(plain[2])
    except (struct.error, IndexError):
        pass
    return None


def is_truncated(data: bytes) -> bool:
    """Whether a PNG or JPEG file ends before its picture does.

    Decoders fill the missing part of such a file with grey and go on; a sensor must not.

    Parameters
    ----------
    data : bytes
        Content of the file.

    Returns
    -------
    bool
        True if the end mark of the format is missing; False for other formats.
    """
    if data.startswith(_PNG):
        position = 8
        while position + 12 <= len(data):
            length, kind = struct.unpack_from(">I4s", data, position)
            position += 12 + length
            if kind == b"IEND":
                return position > len(data)
        return True
    if data.startswith(_JPEG):
        scan = _jpeg_scan(data)[1]
        return scan is None or data.find(b"\xff\xd9", scan) < 0
    return False


def _jpeg_scan(data: bytes) -> tuple[tuple[int, int] | None, int | None]:
    """Declared size and the offset of the first scan; None for what the header does not reach."""
    size: tuple[int, int] | None = None
    position = 2
    while position + 4 <= len(data):
        if data[position] != 0xFF:
            return size, None
        marker = data[position + 1]
        if marker == 0xFF:
            position += 1
            continue
        if marker == 0x01 or 0xD0 <= marker <= 0xD7:
            position += 2
            continue
        if marker == 0xDA:
            return size, position
        is_frame = 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC)
        if is_frame and size is None and position + 9 <= len(data):
            height, width = struct.unpack_from(">HH", data, position + 5)
            size = (width, height)
        position += 2 + struct.unpack_from(">H", data, position + 2)[0]
    return size, None


def _webp_size(data: bytes) -> tuple[int, int] | None:
    kind = data[12:16]
    if kind == b"VP8X":
        return 1 + int.from_bytes(data[24:27], "little"), 1 + int.from_bytes(data[27:30], "little")
    if kind == b"VP8L":
        bits = struct.unpack_from("<I", data, 21)[0]
        return 1 + (bits & 0x3FFF), 1 + (bits >> 14 & 0x3FFF)
    if kind == b"VP8 ":
        width, height = struct.unpack_from("<HH", data, 26)
        return width & 0x3FFF, height & 0x3FFF
    return None


def _tiff_size(data: bytes) -> tuple[int, int] | None:
    order = "<" if data[:2] == b"II" else ">"
    start = struct.unpack_from(order + "I", data, 4)[0]
    count = struct.unpack_from(order + "H", data, start)[0]
    found: dict[int, int] = {}
    for entry in range(count):
        tag, kind = struct.unpack_from(order + "HH", data, start + 2 + 12 * entry)
        if tag in (256, 257):
            found[tag] = struct.unpack_from(
                order + ("H" if kind == 3 else "I"), data, start + 10 + 12 * entry
            )[0]
    return (found[256], found[257]) if len(found) == 2 else None
