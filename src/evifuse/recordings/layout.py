"""Messages of one type decoded together: those of the same layout become one array.

ROS 2 serialises messages as CDR: plain numbers, aligned to their size, with the length before each text and
list. Messages whose lengths agree have every field at the same place, so a field of ten thousand of them is
one slice. The layout follows the OMG's CDR encoding (version 1, both byte orders).
"""

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Group", "Layout", "grouped"]

_START = 4
"""Bytes before the content, which say how it is encoded."""


class Layout:
    """Where the fields of a message are; reads on from field to field.

    Parameters
    ----------
    data : bytes
        One message.

    Raises
    ------
    ValueError
        If it is not encoded as plain CDR.
    """

    def __init__(self, data: bytes) -> None:
        if len(data) < _START or data[0] != 0 or data[1] > 1:
            raise ValueError("not plain CDR")
        self.data = data
        self.order = "<" if data[1] else ">"
        self.at = _START
        self.fixed: list[tuple[int, int]] = []
        """Bytes that say where the rest is: the same in all messages of this layout."""

    def align(self, size: int) -> None:
        """Go on to the next place where a number of this size may be.

        Parameters
        ----------
        size : int
            Bytes.
        """
        self.at += -(self.at - _START) % size

    def numbers(self, kind: str, count: int = 1) -> tuple[int, int, str]:
        """Place of numbers.

        Parameters
        ----------
        kind : str
            NumPy's name of the type, such as ``f8``.
        count : int
            How many.

        Returns
        -------
        tuple of (int, int, str)
            First byte, count and type, for `Group.values`.

        Raises
        ------
        ValueError
            If the message ends before.
        """
        size = int(kind[1:])
        if count:
            self.align(size)
        start = self.at
        self.at += size * count
        if self.at > len(self.data):
            raise ValueError("the message ends too early")
        return start, count, self.order + kind

    def length(self) -> int:
        """Number of elements of a list, or bytes of a text.

        Returns
        -------
        int
            As the message says.
        """
        start, _, _ = self.numbers("u4")
        self.fixed.append((start, start + 4))
        return struct.unpack_from(self.order + "I", self.data, start)[0]

    def text(self, same: bool = False) -> str:
        """A text.

        Parameters
        ----------
        same : bool
            Whether messages with another text have another layout.

        Returns
        -------
        str
            Without the zero that ends it.
        """
        start, count, _ = self.numbers("u1", self.length())
        if same:
            self.fixed.append((start, start + count))
        return self.data[start : start + count].rstrip(b"\0").decode() if same else ""

    def list_of(self, kind: str, each: int = 1) -> tuple[int, int, str]:
        """Place of a list of numbers.

        Parameters
        ----------
        kind : str
            NumPy's name of the type.
        each : int
            Numbers in each element.

        Returns
        -------
        tuple of (int, int, str)
            First byte, count of numbers and type.
        """
        return self.numbers(kind, self.length() * each)

    def stamp(self) -> tuple[tuple[int, int, str], tuple[int, int, str]]:
        """A ``std_msgs/Header``.

        Returns
        -------
        seconds, nanoseconds : tuple of (int, int, str)
            Places of the two parts of the time.
        """
        places = self.numbers("i4"), self.numbers("u4")
        self.text()
        return places


@dataclass(frozen=True)
class Group:
    """Messages of the same layout.

    Parameters
    ----------
    index : ndarray of int64, shape (M,)
        Which messages of the topic they are.
    rows : ndarray of uint8, shape (M, B)
        Their bytes.
    fields : dict of str to Any
        What the reader of the layout noted: places and texts.
    """

    index: NDArray[np.int64]
    rows: NDArray[np.uint8]
    fields: dict[str, Any] = field(default_factory=dict[str, Any])

    def values(self, name: str) -> NDArray[Any]:
        """Numbers of a field.

        Parameters
        ----------
        name : str
            The field.

        Returns
        -------
        ndarray, shape (M, K)
            K numbers of each message.
        """
        start, count, kind = self.fields[name]
        size = np.dtype(kind).itemsize
        taken = np.ascontiguousarray(self.rows[:, start : start + count * size])
        return taken.view(kind).reshape(len(self.index), count)


def grouped(messages: Sequence[bytes], read: Callable[[Layout], dict[str, Any]]) -> list[Group]:
    """Sort messages by layout.

    Parameters
    ----------
    messages : sequence of bytes
        Messages of one type.
    read : callable
        Reads the fields of one message: `Layout` in, places and texts by name out.

    Returns
    -------
    list of Group
        Every message is in one of them.

    Raises
    ------
    ValueError
        If a message does not fit its type.
    """
    by_length: dict[int, list[int]] = {}
    for number, data in enumerate(messages):
        by_length.setdefault(len(data), []).append(number)
    groups: list[Group] = []
    for length, numbers in by_length.items():
        index = np.array(numbers, dtype=np.int64)
        rows = np.frombuffer(b"".join([messages[i] for i in numbers]), np.uint8).reshape(-1, length)
        while len(index):
            layout = Layout(messages[index[0]])
            fields = read(layout)
            fixed = np.zeros(length, dtype=np.bool_)
            fixed[:2] = True
            for start, stop in layout.fixed:
                fixed[start:stop] = True
            same = (rows[:, fixed] == rows[0, fixed]).all(axis=1)
            groups.append(Group(index[same], rows[same], fields))
            index, rows = index[~same], rows[~same]
    return groups
