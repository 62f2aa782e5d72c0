"""Folders that ``ros2 bag record`` makes: one or several files, MCAP or SQLite."""

import os
import re
import sqlite3
from pathlib import Path

from evifuse.errors import RecordingError
from evifuse.recordings.mcap_reader import RawRecording, Topic, read_raw
from evifuse.recordings.sqlite_cut import is_cut, rows_of

__all__ = ["bag_files", "is_bag", "read_bag", "read_sqlite"]

_KINDS = (".mcap", ".db3")
_PACKED = (".mcap.zstd", ".db3.zstd")


def bag_files(folder: str | os.PathLike[str]) -> list[Path]:
    """Files of a bag in order, ``bag_2`` before ``bag_10``.

    Parameters
    ----------
    folder : str or path-like
        A folder.

    Returns
    -------
    list of Path
        MCAP and SQLite files in it, empty if there are none.
    """
    found = [
        p for p in Path(folder).iterdir() if p.name.lower().endswith((*_KINDS, *_PACKED)) and p.is_file()
    ]
    return sorted(found, key=lambda p: [int(n) if n.isdecimal() else n for n in re.split(r"(\d+)", p.name)])


def is_bag(path: str | os.PathLike[str]) -> bool:
    """Whether a folder is one recording.

    Parameters
    ----------
    path : str or path-like
        The folder.

    Returns
    -------
    bool
        If it holds ``metadata.yaml``, or SQLite files: a recorder that was stopped hard leaves no
        ``metadata.yaml``.
    """
    folder = Path(path)
    if not folder.is_dir():
        return False
    return (folder / "metadata.yaml").exists() or any(p.suffix == ".db3" for p in bag_files(folder))


def read_bag(path: str | os.PathLike[str]) -> RawRecording:
    """Read every message of a bag.

    Parameters
    ----------
    path : str or path-like
        The folder.

    Returns
    -------
    RawRecording
        Messages of all its files, and what is wrong with the first that is damaged.

    Raises
    ------
    RecordingError
        If there is no file in it that can be read.
    """
    files = bag_files(path)
    if not files:
        raise RecordingError(f"{path}: this bag holds no .mcap or .db3 file: name the recording's file")
    topics: dict[str, Topic] = {}
    damage = ""
    for file in files:
        if file.name.lower().endswith(_PACKED):
            raise RecordingError(f"{file}: the file is compressed as a whole: unpack it with 'zstd -d' first")
        try:
            part = read_sqlite(file) if file.suffix.lower() == ".db3" else read_raw(file)
        except RecordingError as error:
            if len(files) == 1:
                raise
            part = RawRecording({}, str(error))
        damage = damage or (f"{file.name}: {part.damage}" if part.damage else "")
        for name, topic in part.topics.items():
            whole = topics.setdefault(name, Topic(name, topic.kind, topic.encoding))
            if topic.kind != whole.kind:
                raise RecordingError(
                    f"{file}: topic {name} changes its type: read the bag's files one by one"
                )
            whole.log_time_ns += topic.log_time_ns
            whole.data += topic.data
    return RawRecording(topics, damage)


def read_sqlite(path: str | os.PathLike[str]) -> RawRecording:
    """Read every message of a ``.db3`` file, as rosbag2 stores them; stop at the first damage.

    Parameters
    ----------
    path : str or path-like
        The file.

    Returns
    -------
    RawRecording
        The messages by topic, and what is wrong with the file if anything is.

    Raises
    ------
    RecordingError
        If it is not such a file.
    """
    file = Path(path)
    try:
        with file.open("rb") as stream:
            start = stream.read(100)
    except OSError as error:
        raise RecordingError(f"{path}: can't read the file: {error.strerror or error}") from error
    if not start:
        raise RecordingError(f"{path}: the file is empty: record or copy it again")
    if not start.startswith(b"SQLite format 3\0"):
        raise RecordingError(f"{path}: this is not a SQLite bag (wrong first bytes): check the file's name")
    if is_cut(start, file.stat().st_size):
        return _salvaged(file.read_bytes())
    link = sqlite3.connect(f"{file.resolve().as_uri()}?mode=ro", uri=True)
    try:
        return _stored(link)
    except (sqlite3.Error, TypeError, ValueError, OverflowError) as error:
        raise RecordingError(f"{path}: this is not a whole rosbag2 file: {error}") from error
    finally:
        link.close()


def _salvaged(data: bytes) -> RawRecording:
    """Messages of a file that was cut off, told by what its rows look like."""
    topics: dict[int, Topic] = {}
    messages: dict[int, tuple[int, int, bytes]] = {}
    for number, values in rows_of(data):
        if len(values) < 4:
            continue
        _, second, third, fourth = values[:4]
        if isinstance(second, str) and isinstance(third, str) and isinstance(fourth, str):
            if fourth == "cdr":
                topics[number] = Topic(second, third, fourth)
        elif isinstance(second, int) and isinstance(third, int) and isinstance(fourth, bytes):
            messages[number] = (second, third, fourth)
    for number in sorted(messages):
        key, time_ns, content = messages[number]
        if key in topics:
            topics[key].log_time_ns.append(time_ns)
            topics[key].data.append(content)
    return RawRecording({topic.name: topic for topic in topics.values()}, "the file is cut off or damaged")


def _stored(link: sqlite3.Connection) -> RawRecording:
    numbers: dict[int, Topic] = {}
    for number, name, kind, encoding in link.execute(
        "SELECT id, name, type, serialization_format FROM topics"
    ):
        numbers[number] = Topic(str(name), str(kind), str(encoding))
    topics = {topic.name: topic for topic in numbers.values()}
    damage = ""
    try:
        for number, time_ns, data in link.execute(
            "SELECT topic_id, timestamp, data FROM messages ORDER BY id"
        ):
            topic = numbers.get(number)
            if topic is None or not isinstance(data, bytes) or not isinstance(time_ns, int):
                damage = "the file is damaged"
                break
            topic.log_time_ns.append(time_ns)
            topic.data.append(data)
    except sqlite3.Error:
        damage = "the file is cut off or damaged"
    return RawRecording(topics, damage)
