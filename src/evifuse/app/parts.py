"""A folder of finished parts: it survives a kill, and what is in it is used only if whole and still right."""

import json
import os
import re
import shutil
import uuid
import zlib
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from evifuse.app.arrow import pyarrow, writing
from evifuse.errors import EvifuseError, UsageError

__all__ = ["DamagedPartError", "Parts", "opened_parts"]

FORMAT = "evifuse classify parts 1"
MANIFEST = "manifest.json"
LOCK = "lock"
JOINED = "joined.parquet"
PART = re.compile(r"part-(\d{8,})\.arrow")
WHOLE = 0x2144DF1C  # CRC-32 of any bytes followed by their own CRC-32, least significant byte first
STEP = 1 << 20


class DamagedPartError(EvifuseError):
    """A part is missing, or its bytes are not those that were written."""


class Parts:
    """The folder beside an output file in which its parts wait to be joined.

    A part is an Arrow stream followed by the CRC-32 of its bytes. It appears in one step, so a part that is
    there was finished; the checksum tells whether it still is what was written.

    Parameters
    ----------
    folder : Path
        The folder; it exists.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @property
    def joined(self) -> Path:
        """Where the parts are joined before the result is put in its place."""
        return self.folder / JOINED

    def remove(self) -> None:
        """Remove the folder with all that is in it."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def fingerprint(self) -> dict[str, str] | None:
        """What the parts were made from.

        Returns
        -------
        dict of str to str or None
            As it was written; None if there is no manifest or it can't be read.
        """
        with suppress(OSError, ValueError):
            manifest = json.loads((self.folder / MANIFEST).read_text(encoding="utf-8"))
            if isinstance(manifest, dict) and manifest.get("format") == FORMAT:
                return manifest["made_from"]
        return None

    def finished(self) -> set[int]:
        """Numbers of the parts that are there.

        Returns
        -------
        set of int
            Whether they are still whole is not known.
        """
        return {int(match[1]) for path in self.folder.iterdir() if (match := PART.fullmatch(path.name))}

    def path(self, index: int) -> Path:
        """Where a part is.

        Parameters
        ----------
        index : int
            Its number.

        Returns
        -------
        Path
            Its file.
        """
        return self.folder / f"part-{index:08}.arrow"

    def write(self, index: int, schema: Any, batches: Iterable[Any]) -> None:
        """Write a part: beside its place first, then to the disk, then into its place.

        Parameters
        ----------
        index : int
            Number of the part.
        schema : pyarrow.Schema
            Columns of the batches.
        batches : iterable of pyarrow.RecordBatch
            Its rows.

        Raises
        ------
        UsageError
            If writing fails, for example because the disk is full.
        """
        pa = pyarrow()
        beside = self.folder / f"part-{index:08}.{uuid.uuid4().hex}.tmp"
        try:
            with writing(beside), beside.open("wb") as file:
                sink = _Summed(file)
                with pa.ipc.new_stream(pa.PythonFile(sink, "w"), schema) as stream:
                    for batch in batches:
                        stream.write_batch(batch)
                file.write(sink.checksum.to_bytes(4, "little"))
                file.flush()
                os.fsync(file.fileno())
                beside.replace(self.path(index))
        finally:
            with suppress(OSError):
                beside.unlink()

    def read(self, index: int) -> Iterator[Any]:
        """The rows of a part, once its bytes have proved to be right.

        Parameters
        ----------
        index : int
            Number of the part.

        Yields
        ------
        pyarrow.RecordBatch
            As they were written.

        Raises
        ------
        DamagedPartError
            If it is missing or damaged; it is removed then.
        """
        pa = pyarrow()
        path = self.path(index)
        if not path.exists():
            raise DamagedPartError(f"part {index} is missing")
        if _checksum(path) != WHOLE:
            path.unlink()
            raise DamagedPartError(f"part {index} is damaged")
        with pa.OSFile(str(path)) as file, pa.ipc.open_stream(file) as stream:
            yield from stream


class _Summed:
    """A file that adds up a checksum of what is written to it."""

    closed = False

    def __init__(self, file: Any) -> None:
        self.file, self.checksum = file, 0

    def write(self, data: Any) -> int:
        self.checksum = zlib.crc32(data, self.checksum)
        return self.file.write(data)

    def flush(self) -> None:
        self.file.flush()


def _checksum(path: Path) -> int:
    total = 0
    with path.open("rb") as file:
        while data := file.read(STEP):
            total = zlib.crc32(data, total)
    return total


@contextmanager
def opened_parts(folder: Path, made_from: dict[str, str]) -> Generator[tuple[Parts, str]]:
    """The folder for parts, emptied if what it holds was made from something else, and locked meanwhile.

    Parameters
    ----------
    folder : Path
        Where parts are kept; created if need be.
    made_from : dict of str to str
        What the parts depend on, by name.

    Yields
    ------
    tuple of (Parts, str)
        The folder, and what differs from the parts that were found there: nothing if they can be used.

    Raises
    ------
    UsageError
        If it is not a folder of parts, another process uses it, or it can't be written.
    """
    parts = Parts(folder)
    with writing(folder):
        folder.mkdir(exist_ok=True)
        _refuse_strangers(folder)
        lock = (folder / LOCK).open("wb")
    with lock:
        _lock(lock, folder)
        before = parts.fingerprint()
        changed = [name for name, value in made_from.items() if before is None or before.get(name) != value]
        with writing(folder):
            for path in folder.iterdir():
                if path.name != LOCK and (changed or path.suffix == ".tmp"):
                    path.unlink()
            if changed:
                text = json.dumps({"format": FORMAT, "made_from": made_from}, indent=1)
                beside = folder / f"{MANIFEST}.tmp"
                with beside.open("w", encoding="utf-8") as file:
                    file.write(text + "\n")
                    file.flush()
                    os.fsync(file.fileno())
                beside.replace(folder / MANIFEST)
        yield parts, ", ".join(changed) if before is not None else ""


def _refuse_strangers(folder: Path) -> None:
    """Files that this command did not write are not its to delete."""
    for path in folder.iterdir():
        known = path.name in (MANIFEST, LOCK, JOINED) or path.suffix == ".tmp" or PART.fullmatch(path.name)
        if not known or path.is_dir():
            raise UsageError(f"{folder}: {path.name} is not of this command: move the folder out of the way")


def _lock(lock: Any, folder: Path) -> None:
    try:
        import fcntl
    except ImportError:  # no such locks on Windows
        return
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        raise UsageError(f"{folder}: another run is using it: wait for it, or stop it first") from None
