"""Rows of a SQLite file that was cut off: those of its whole pages.

SQLite refuses a file that is shorter than its header says. Rows are in the leaves of trees, though, and each
leaf is a page that can be read by itself. Layout as in SQLite's "Database File Format", sections 1.3 to 2.1.
"""

from collections.abc import Iterator

__all__ = ["is_cut", "rows_of"]

_LEAF = 13
_FLOAT, _BLOB = 7, 12
_SIZES = (0, 1, 2, 3, 4, 6, 8, 8, 0, 0)
"""Bytes of a value by its type, for types below 10."""


def _page_size(data: bytes) -> int:
    size = int.from_bytes(data[16:18], "big")
    return 65536 if size == 1 else size


def is_cut(start: bytes, size: int) -> bool:
    """Whether a file is shorter than its header says.

    Parameters
    ----------
    start : bytes
        The first hundred bytes.
    size : int
        Bytes of the file.

    Returns
    -------
    bool
        False for a file that is shorter than its own header too: nothing is in it.
    """
    return len(start) >= 100 and size < _page_size(start) * int.from_bytes(start[28:32], "big")


def rows_of(data: bytes) -> Iterator[tuple[int, list[int | str | bytes | None]]]:
    """Rows of all tables, as far as they are whole.

    Parameters
    ----------
    data : bytes
        What there is of the file.

    Yields
    ------
    number : int
        Row number in its table; a column that is this number is None in the row.
    values : list
        The columns; floating point numbers are left out as None.
    """
    size = _page_size(data)
    if size < 512:
        return
    usable = size - data[20]
    for page in range(len(data) // size):
        start = page * size
        head = start + (100 if page == 0 else 0)
        if data[head] != _LEAF:
            continue
        for i in range(int.from_bytes(data[head + 3 : head + 5], "big")):
            place = int.from_bytes(data[head + 8 + 2 * i : head + 10 + 2 * i], "big")
            try:
                length, at = _number(data, start + place)
                number, at = _number(data, at)
                yield number, _values(_payload(data, at, length, start + size, usable, size))
            except (IndexError, ValueError):
                continue


def _number(data: bytes, at: int) -> tuple[int, int]:
    """A number of variable length, and where the next thing begins."""
    value = 0
    for i in range(8):
        byte = data[at + i]
        value = value << 7 | byte & 0x7F
        if byte < 0x80:
            return value, at + i + 1
    return value << 8 | data[at + 8], at + 9


def _payload(data: bytes, at: int, length: int, end: int, usable: int, size: int) -> bytes:
    """Content of a row, the part of it on other pages too."""
    most, least = usable - 35, (usable - 12) * 32 // 255 - 23
    if length <= most:
        local = length
    else:
        local = least + (length - least) % (usable - 4)
        local = least if local > most else local
    if length < 0 or at + local > end:
        raise ValueError("not a row")
    content = bytearray(data[at : at + local])
    following = int.from_bytes(data[at + local : at + local + 4], "big") if local < length else 0
    while len(content) < length:
        start = (following - 1) * size
        if following < 1 or start + size > len(data):
            raise ValueError("the rest of the row was cut off")
        following = int.from_bytes(data[start : start + 4], "big")
        content += data[start + 4 : start + 4 + min(usable - 4, length - len(content))]
    return bytes(content)


def _values(content: bytes) -> list[int | str | bytes | None]:
    """Columns of a row."""
    at_value, at = _number(content, 0)
    end = at_value
    values: list[int | str | bytes | None] = []
    while at < end:
        kind, at = _number(content, at)
        length = (kind - _BLOB) // 2 if kind >= _BLOB else _SIZES[kind]
        piece = content[at_value : at_value + length]
        if len(piece) < length:
            raise ValueError("not a row")
        at_value += length
        if kind >= _BLOB:
            values.append(piece.decode() if kind % 2 else piece)
        elif kind in (8, 9):
            values.append(kind - 8)
        else:
            values.append(None if kind in (0, _FLOAT) else int.from_bytes(piece, "big", signed=True))
    return values
