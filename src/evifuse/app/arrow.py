"""The package pyarrow, if it is there, and what goes wrong with files in one line."""

import os
from collections.abc import Generator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

from evifuse.errors import MissingExtraError, UsageError

__all__ = ["one_line", "pyarrow", "writing"]


def pyarrow() -> Any:
    """The package pyarrow, with its Parquet part loaded.

    Returns
    -------
    module
        ``pyarrow``.

    Raises
    ------
    MissingExtraError
        If it is not installed.
    """
    try:
        import_module("pyarrow.parquet")
    except ImportError as error:
        raise MissingExtraError("Parquet files need pyarrow: pip install 'evifuse[parquet]'") from error
    return import_module("pyarrow")


def one_line(error: BaseException) -> str:
    """First line of another library's message.

    Parameters
    ----------
    error : BaseException
        What it raised.

    Returns
    -------
    str
        Its first line, or its name if it has none.
    """
    return (str(error).strip().splitlines() or [type(error).__name__])[0]


@contextmanager
def writing(path: Path) -> Generator[None]:
    """Turn failures to write into one line that names the file.

    Parameters
    ----------
    path : Path
        What is written.

    Yields
    ------
    None
        While it is written.

    Raises
    ------
    UsageError
        If writing fails.
    """
    try:
        yield
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else one_line(error)
        raise UsageError(f"{path}: writing failed: {reason} (the same command goes on later)") from error
