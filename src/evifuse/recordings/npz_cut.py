"""What is whole of a NumPy archive that was cut off: its arrays from front to back, the last one in part.

An archive's directory is at its end, so `numpy.load` reads nothing of one that is cut. Every array has a
header of its own before it, though; its layout is that of the ZIP application note, sections 4.3.7 and 4.5.3.
"""

import ast
import struct
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["salvaged"]

_MEMBER = struct.Struct("<4sHHHHHIIIHH")
_STORED, _DEFLATED = 0, 8
_ZIP64 = 1
_UNKNOWN = 0xFFFFFFFF


def salvaged(data: bytes) -> tuple[dict[str, NDArray[Any]], str]:
    """Arrays of an archive that is cut off.

    Parameters
    ----------
    data : bytes
        What there is of it.

    Returns
    -------
    arrays : dict of str to ndarray
        Whole arrays, and the whole rows of the one in which the archive ends.
    cut : str
        Name of that array; empty if the archive ends between two.
    """
    arrays: dict[str, NDArray[Any]] = {}
    at = 0
    while at + _MEMBER.size <= len(data):
        mark, _, _, method, _, _, checksum, size, _, length, more = _MEMBER.unpack_from(data, at)
        begin = at + _MEMBER.size + length + more
        if mark != b"PK\x03\x04" or begin > len(data) or method not in (_STORED, _DEFLATED):
            return arrays, ""
        name = data[at + _MEMBER.size :][:length].decode("utf-8", "replace").removesuffix(".npy")
        extra = data[begin - more : begin]
        size = _long_size(extra) if size == _UNKNOWN else size
        content, at = _content(data, begin, size, method)
        whole = at > 0 and zlib.crc32(content) == checksum
        array = _array(content, whole)
        if array is None:
            return arrays, name
        arrays[name] = array
        if not whole:
            return arrays, name
    return arrays, ""


def _long_size(extra: bytes) -> int:
    """Size in the archive, from the field for large files; 0 if the writer never got to write it."""
    at = 0
    while at + 4 <= len(extra):
        kind, length = struct.unpack_from("<HH", extra, at)
        if kind == _ZIP64 and length >= 16 and at + 20 <= len(extra):
            return struct.unpack_from("<QQ", extra, at + 4)[1]
        at += 4 + length
    return 0


def _content(data: bytes, begin: int, size: int, method: int) -> tuple[bytes, int]:
    """Bytes of a member, and where the next begins; 0 if this one is not whole."""
    if method == _STORED:
        end = begin + size
        return data[begin:end] if size else data[begin:], end if size and end <= len(data) else 0
    unpack = zlib.decompressobj(-15)
    content = bytearray()
    try:
        for start in range(begin, len(data), 1 << 16):  # what comes before damage is kept
            content += unpack.decompress(data[start : start + (1 << 16)])
            if unpack.eof:
                return bytes(content), min(start + (1 << 16), len(data)) - len(unpack.unused_data)
    except zlib.error:
        pass
    return bytes(content), 0


def _array(content: bytes, whole: bool) -> NDArray[Any] | None:
    """Array in the NPY format; of one that is cut, the whole rows."""
    if content[:6] != b"\x93NUMPY" or len(content) < 12:
        return None
    wide = content[6] > 1
    length = struct.unpack_from("<I" if wide else "<H", content, 8)[0]
    start = (12 if wide else 10) + length
    if start > len(content):
        return None
    try:
        about = ast.literal_eval(content[start - length : start].decode("latin1"))
        kind, shape = np.dtype(about["descr"]), tuple(about["shape"])
        if kind.hasobject or (about["fortran_order"] and not whole):
            return None
        row = int(np.prod(shape[1:], dtype=np.int64)) * kind.itemsize
        rows = min(shape[0], (len(content) - start) // max(row, 1)) if shape else 1
        wanted = (rows, *shape[1:]) if shape else ()
        count = int(np.prod(wanted, dtype=np.int64))
        values = np.frombuffer(content, kind, count, start)
        return values.reshape(wanted, order="F" if about["fortran_order"] else "C")
    except (ValueError, TypeError, KeyError, SyntaxError):
        return None
