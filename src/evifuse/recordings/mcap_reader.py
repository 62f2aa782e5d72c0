"""Raw messages of an MCAP file, by topic."""

import os
import struct
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from evifuse.errors import RecordingError
from evifuse.recordings.messages import typestore

__all__ = ["RawRecording", "Topic", "read_raw"]


@dataclass
class Topic:
    """The messages of one topic, as they are in the file.

    Parameters
    ----------
    name : str
        The topic.
    kind : str
        Message type, ``package/msg/Name``.
    encoding : str
        Encoding of the messages; only ``cdr`` can be read.
    log_time_ns : list of int
        When each message was recorded, UTC nanoseconds since 1970.
    data : list of bytes
        The messages.
    """

    name: str
    kind: str
    encoding: str
    log_time_ns: list[int] = field(default_factory=list[int])
    data: list[bytes] = field(default_factory=list[bytes])

    def decoded(self, where: str) -> list[Any]:
        """Messages as objects.

        Parameters
        ----------
        where : str
            Name of the file, for messages.

        Returns
        -------
        list
            One object per message, with the fields of the message type.

        Raises
        ------
        RecordingError
            If the type is unknown or a message does not fit its type.
        """
        from rosbags.serde import SerdeError

        if self.encoding != "cdr":
            raise RecordingError(
                f"{where}: topic {self.name} is encoded as {self.encoding!r}: record it with ROS 2 (cdr)"
            )
        read = typestore().deserialize_cdr
        try:
            return [read(data, self.kind) for data in self.data]
        except (
            SerdeError,
            struct.error,
            ValueError,
            IndexError,
            AssertionError,
            OverflowError,
            MemoryError,
        ) as error:
            raise RecordingError(f"{where}: a message on {self.name} is not a valid {self.kind}") from error


@dataclass(frozen=True)
class RawRecording:
    """What an MCAP file holds.

    Parameters
    ----------
    topics : dict of str to Topic
        Messages by topic; a topic without messages is there too.
    damage : str
        Why the rest of the file can't be read; empty if the file is whole.
    """

    topics: dict[str, Topic]
    damage: str


def read_raw(path: str | os.PathLike[str]) -> RawRecording:
    """Read every message of an MCAP file, checking its checksums; stop at the first damage.

    The file is read from front to back, so a file that was cut off gives the messages of its whole chunks.

    Parameters
    ----------
    path : str or path-like
        An MCAP file that exists.

    Returns
    -------
    RawRecording
        The messages by topic, and what is wrong with the file if anything is.

    Raises
    ------
    RecordingError
        If the file can't be opened, is empty or is not an MCAP file.
    """
    path = Path(path)
    topics: dict[str, Topic] = {}
    damage = ""
    try:
        size = path.stat().st_size
        if size == 0:
            raise RecordingError(f"{path}: the file is empty: record or copy it again")
        data = path.read_bytes()
        if not data.startswith(_MAGIC):
            raise RecordingError(
                f"{path}: this is not an MCAP file (wrong first bytes): check the file's name"
            )
        try:
            _Found(topics).file(data)
        except _damages():
            damage = "the file is cut off or damaged"
    except OSError as error:
        raise RecordingError(f"{path}: can't read the file: {error.strerror or error}") from error
    return RawRecording(topics, damage)


def _damages() -> tuple[type[Exception], ...]:
    """What the readers raise on bytes that are not what they should be."""
    import zstandard

    values = (ValueError, KeyError, OverflowError)  # ValueError: wrong checksums and broken text too
    return (zstandard.ZstdError, struct.error, RuntimeError, MemoryError, *values)


_MAGIC = b"\x89MCAP0\r\n"
_FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _DATA_END = 2, 3, 4, 5, 6, 15
_RECORD, _MESSAGE_HEADER = struct.Struct("<BQ"), struct.Struct("<HIQQ")


@dataclass
class _Found:
    """Schemas and channels seen so far, and the messages by topic. Layouts as MCAP's specification has them.

    What is read of a record is checked to lie within it, and content against its checksum where it has one.
    """

    topics: dict[str, Topic]
    kinds: dict[int, str] = field(default_factory=dict[int, str])
    channels: dict[int, Topic] = field(default_factory=dict[int, Topic])

    def file(self, data: bytes) -> None:
        """All records; ValueError or struct.error at the first damage."""
        at, ended = len(_MAGIC), False
        while True:
            start = at
            kind, length = _RECORD.unpack_from(data, at)
            at, end = at + _RECORD.size, at + _RECORD.size + length
            if end > len(data):
                raise ValueError("a record goes on beyond the file")
            if kind == _CHUNK and not ended:
                self.records(_unpacked(data[at:end]))
            elif kind == _DATA_END:
                ended = True
                _check(struct.unpack_from("<I", data, at)[0], memoryview(data)[:start])
            elif kind == _FOOTER:
                summary, _, checksum = struct.unpack_from("<QQI", data, at)
                _check(checksum, memoryview(data)[summary : end - 4])
                if not ended or data[end:] != _MAGIC:
                    raise ValueError("the end of the file is not that of an MCAP file")
                return
            elif not ended:
                self.record(data, kind, at, end)
            at = end

    def records(self, data: bytes) -> None:
        """Records of a chunk."""
        at = 0
        while at < len(data):
            kind, length = _RECORD.unpack_from(data, at)
            at += _RECORD.size
            end = at + length
            if end > len(data):
                raise ValueError("a record goes on beyond its chunk")
            self.record(data, kind, at, end)
            at = end

    def record(self, data: bytes, kind: int, at: int, end: int) -> None:
        """One schema, channel or message; other records say nothing that is needed."""
        if kind == _MESSAGE:
            number, _, log_time, _ = _MESSAGE_HEADER.unpack_from(data, at)
            topic = self.channels[number]
            topic.log_time_ns.append(log_time)
            topic.data.append(data[at + _MESSAGE_HEADER.size : end])
        elif kind == _SCHEMA:
            number = struct.unpack_from("<H", data, at)[0]
            self.kinds[number] = _text(data, at + 2)[0]
        elif kind == _CHANNEL:
            number, schema = struct.unpack_from("<HH", data, at)
            name, after = _text(data, at + 4)
            self.channel(number, schema, name, _text(data, after)[0])

    def channel(self, number: int, schema: int, name: str, encoding: str) -> None:
        topic = Topic(name, self.kinds.get(schema, ""), encoding)
        self.channels[number] = self.topics.setdefault(name, topic)


def _check(expected: int, data: "bytes | memoryview") -> None:
    """Compare a checksum; 0 means that the writer made none."""
    if expected and zlib.crc32(data) != expected:
        raise ValueError("wrong checksum")


def _unpacked(chunk: bytes) -> bytes:
    """Records of a chunk."""
    _, _, size, checksum = struct.unpack_from("<QQQI", chunk)
    compression, at = _text(chunk, 28)
    length = struct.unpack_from("<Q", chunk, at)[0]
    data = chunk[at + 8 : at + 8 + length]
    if compression == "zstd":
        import zstandard

        data = zstandard.decompress(data, max_output_size=size)
    elif compression == "lz4":
        from lz4 import frame

        data = bytes(frame.decompress(data))
    elif compression:
        raise ValueError(f"unknown compression {compression!r}")
    if len(data) != size:
        raise ValueError("a chunk is not as long as it says")
    _check(checksum, data)
    return data


def _text(data: bytes, at: int) -> tuple[str, int]:
    """A string with its length before it, and where it ends."""
    length = struct.unpack_from("<I", data, at)[0]
    return data[at + 4 : at + 4 + length].decode(), at + 4 + length
