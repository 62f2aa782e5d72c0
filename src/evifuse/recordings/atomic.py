"""Files that appear whole or not at all."""

import os
import tempfile
from collections.abc import Generator
from contextlib import contextmanager, suppress
from pathlib import Path

from evifuse.errors import RecordingError

__all__ = ["replacing"]


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Generator[Path]:
    """Write beside a file, then put the result in its place in one step.

    On any failure the unfinished file is removed and what was at ``path`` before stays as it was.

    Parameters
    ----------
    path : str or path-like
        The file to be created or replaced; its folder must exist.

    Yields
    ------
    Path
        A new empty file in the same folder, with the same suffix, to write to.

    Raises
    ------
    RecordingError
        If the folder is missing, ``path`` is a folder, or writing fails (no permission, disk full).
    """
    target = Path(path)
    if target.is_dir():
        raise RecordingError(f"{target}: this is a folder, so nothing can be written there: name a file")
    if not target.parent.is_dir():
        raise RecordingError(f"{target}: the folder {target.parent} does not exist: create it first")
    try:
        handle, name = tempfile.mkstemp(prefix=f".{target.stem}.", suffix=target.suffix, dir=target.parent)
        os.close(handle)
    except OSError as error:
        raise RecordingError(f"{target}: can't write there: {error.strerror or error}") from error
    beside = Path(name)
    try:
        beside.chmod(0o666 & ~_umask())
        yield beside
        with beside.open("rb+") as written:
            os.fsync(written.fileno())
        beside.replace(target)
    except OSError as error:
        raise RecordingError(f"{target}: writing failed: {error.strerror or error}") from error
    finally:
        with suppress(OSError):
            beside.unlink()


def _umask() -> int:
    mask = os.umask(0o022)
    os.umask(mask)
    return mask
