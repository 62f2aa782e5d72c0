"""Raw messages of an MCAP file, by topic."""

import os
import struct
from collections.abc import Iterator
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
        with path.open("rb") as stream:
            if stream.read(8) != b"\x89MCAP0\r\n":
                raise RecordingError(
                    f"{path}: this is not an MCAP file (wrong first bytes): check the file's name"
                )
            stream.seek(0)
            try:
                _collect(_records(stream, size), topics)
            except _damages():
                damage = "the file is cut off or damaged"
    except OSError as error:
        raise RecordingError(f"{path}: can't read the file: {error.strerror or error}") from error
    return RawRecording(topics, damage)


def _damages() -> tuple[type[Exception], ...]:
    """What the readers raise on bytes that are not what they should be."""
    import zstandard
    from mcap.exceptions import McapError

    values = (ValueError, KeyError, OverflowError)  # ValueError: wrong checksums and broken text too
    return (McapError, zstandard.ZstdError, struct.error, RuntimeError, MemoryError, *values)


def _records(stream: Any, size: int) -> Iterator[Any]:
    from mcap.records import Chunk
    from mcap.stream_reader import StreamReader, breakup_chunk

    reader = StreamReader(stream, emit_chunks=True, validate_crcs=True, record_size_limit=size)
    for record in reader.records:
        if isinstance(record, Chunk):
            yield from breakup_chunk(record, validate_crc=True)
        else:
            yield record


def _collect(records: Iterator[Any], topics: dict[str, Topic]) -> None:
    from mcap.records import Channel, Message, Schema

    kinds: dict[int, str] = {}
    channels: dict[int, Topic] = {}
    for record in records:
        if isinstance(record, Schema):
            kinds[record.id] = record.name
        elif isinstance(record, Channel):
            kind = kinds.get(record.schema_id, "")
            topic = Topic(record.topic, kind, record.message_encoding)
            channels[record.id] = topics.setdefault(record.topic, topic)
        elif isinstance(record, Message):
            topic = channels[record.channel_id]
            topic.log_time_ns.append(record.log_time)
            topic.data.append(record.data)
