"""Rows of a Parquet file of mass functions, a range at a time, however large the file is."""

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.app.arrow import one_line, pyarrow
from evifuse.belief import Frame, MassFunction
from evifuse.belief._portable import Header, parse_header
from evifuse.belief.mass import TOLERANCE
from evifuse.errors import BeliefError

__all__ = ["BATCH", "MassRows", "open_rows"]

BATCH = 1 << 16
"""Rows that are read and computed together."""

READ_AHEAD = 1 << 20
"""Bytes of a column that are read from the file at a time."""


@dataclass(frozen=True)
class MassRows:
    """A Parquet file of mass functions whose header was checked, and what identifies its content.

    Parameters
    ----------
    path : Path
        The file.
    frame : Frame
        What the masses are about.
    focal_sets : ndarray of int64, shape (F,)
        Bitmasks of the focal sets of every row; the empty set among them where all subsets are listed.
    shape : tuple of int
        Batch dimensions that the rows were laid out from; their product is ``count``.
    count : int
        Number of rows.
    carried : pyarrow.Schema
        The columns beside the masses; what is a dictionary in the file is carried as plain values.
    groups : ndarray of int64, shape (G + 1,)
        Where each row group begins, and where the last one ends.
    identity : str
        Size, time of last change, and hash of the footer.
    """

    path: Path
    frame: Frame
    focal_sets: NDArray[np.int64]
    shape: tuple[int, ...]
    count: int
    carried: Any
    groups: NDArray[np.int64]
    identity: str

    def read(self, start: int, stop: int) -> Iterator[tuple[int, NDArray[np.float64], list[Any]]]:
        """Masses and carried columns of a range of rows, in batches.

        Only the row groups that the range touches are read, page by page.

        Parameters
        ----------
        start : int
            First row.
        stop : int
            The row after the last.

        Yields
        ------
        tuple of (int, ndarray of float64 of shape (n, F), list of pyarrow.Array)
            Row number of the first row, masses, and the other columns. The masses are numbers, but nothing
            else is known about them.

        Raises
        ------
        BeliefError
            If the file is damaged, or a row lacks masses.
        """
        first = int(np.searchsorted(self.groups, start, side="right")) - 1
        last = int(np.searchsorted(self.groups, stop, side="left"))
        at = int(self.groups[first])
        for batch in self._batches(list(range(first, last))):
            low, high = max(start - at, 0), min(stop - at, len(batch))
            if high > low:
                part = batch.slice(low, high - low)
                yield at + low, self._masses(part.column("masses"), at + low), self._carried(part)
            at += len(batch)

    def _batches(self, groups: list[int]) -> Iterator[Any]:
        pa = pyarrow()
        try:
            with pa.OSFile(str(self.path)) as raw:  # of a bare name with a colon pyarrow would make a URI
                file = pa.parquet.ParquetFile(raw, buffer_size=READ_AHEAD, pre_buffer=False)
                columns = ["masses", *self.carried.names]
                yield from file.iter_batches(BATCH, row_groups=groups, columns=columns)
        except (pa.ArrowException, OSError) as error:
            raise BeliefError(f"{self.path}: can't be read, damaged or cut off: {one_line(error)}") from None

    def _carried(self, batch: Any) -> list[Any]:
        columns = [batch.column(name) for name in self.carried.names]
        return [c.dictionary_decode() if hasattr(c, "dictionary_decode") else c for c in columns]

    def _masses(self, column: Any, at: int) -> NDArray[np.float64]:
        """A column of lists as an array (n, F)."""
        width = len(self.focal_sets)
        if column.null_count:
            row = int(np.flatnonzero(column.is_null().to_numpy(zero_copy_only=False))[0])
            raise BeliefError(f"{self.path}: row {at + row} of 'masses' is empty")
        flat = column.flatten()
        if not hasattr(column.type, "list_size"):
            lengths = column.value_lengths().to_numpy(zero_copy_only=False)
            if (lengths != width).any():
                row = int(np.flatnonzero(lengths != width)[0])
                raise BeliefError(
                    f"{self.path}: row {at + row} of 'masses' has {lengths[row]} numbers, not {width}"
                )
        if flat.null_count:
            slot = int(np.flatnonzero(flat.is_null().to_numpy(zero_copy_only=False))[0])
            raise BeliefError(f"{self.path}: row {at + slot // width} of 'masses' lacks a number")
        return flat.to_numpy(zero_copy_only=False).reshape(-1, width)

    def refuse(self, masses: NDArray[np.float64], at: int) -> None:
        """Name the first row that is not a mass function, if there is one.

        Parameters
        ----------
        masses : ndarray of float64, shape (n, F)
            What `read` gave.
        at : int
            Row number of the first.

        Raises
        ------
        BeliefError
            With the file, the row, and what is wrong with it.
        """
        with np.errstate(invalid="ignore"):
            fine = (masses >= 0).all(axis=1) & (np.abs(masses.sum(axis=1) - 1) <= 0.1 * TOLERANCE)
        suspect = ~fine | (masses[:, self.focal_sets == 0] != 0).any(axis=1)
        for row in np.flatnonzero(suspect).tolist():
            try:
                MassFunction(self.frame, self.focal_sets, masses[row])
            except BeliefError as error:
                raise type(error)(f"{self.path}: row {at + row}: {error}") from None


def open_rows(path: Path) -> MassRows:
    """The header of a Parquet file of mass functions, as `evifuse.belief.to_parquet` writes it, checked.

    Parameters
    ----------
    path : Path
        The file.

    Returns
    -------
    MassRows
        Ready to read ranges of rows.

    Raises
    ------
    BeliefError
        If it can't be read, is not such a file, or its focal sets are not the same for all rows.
    """
    pa = pyarrow()
    try:
        path.open("rb").close()
    except OSError as error:
        raise BeliefError(f"{path}: can't be read: {error.strerror or error}") from None
    try:
        with pa.OSFile(str(path)) as raw:
            file = pa.parquet.ParquetFile(raw)
            schema, footer = file.schema_arrow, file.metadata
        identity = _identity(path)
    except (pa.ArrowException, OSError) as error:
        raise BeliefError(f"{path}: this is not Parquet, or was cut off: {one_line(error)}") from None
    header = parse_header(str(path), (schema.metadata or {}).get(b"evifuse", b"null"))
    if "masses" not in schema.names:
        raise BeliefError(f"{path}: there is no column 'masses'")
    sets = _check(path, header, schema.field("masses").type, footer.num_rows)
    is_dictionary = pa.types.is_dictionary
    carried = [f.with_type(f.type.value_type) if is_dictionary(f.type) else f for f in schema]
    others = pa.schema([f for f in carried if f.name != "masses"])
    groups = np.cumsum([0, *(footer.row_group(i).num_rows for i in range(footer.num_row_groups))])
    return MassRows(path, header.frame, sets, header.shape[:-1], footer.num_rows, others, groups, identity)


def _check(path: Path, header: Header, kind: Any, count: int) -> NDArray[np.int64]:
    """Refuse files that can't be read row by row with the same focal sets; else those focal sets."""
    if header.sets is None:
        raise BeliefError(
            f"{path}: each row has focal sets of its own: write the file again with the same for all, "
            'to_parquet(from_parquet(PATH).to("shared"), PATH)'
        )
    if header.open_world:
        raise BeliefError(
            f"{path}: the empty set may have mass here, which nothing conducts: normalise it first"
        )
    if str(getattr(kind, "value_type", "")) != "double":
        raise BeliefError(f"{path}: 'masses' holds {kind}, not lists of doubles")
    width = header.shape[-1]
    if getattr(kind, "list_size", width) != width:
        raise BeliefError(f"{path}: 'masses' does not hold lists of {width} numbers, as the header says")
    if count != header.cases:
        raise BeliefError(f"{path}: {count} rows in 'masses', not the {header.cases} of the header")
    return header.sets


def _identity(path: Path) -> str:
    """Size, time of last change and hash of the footer: what changes when the content does."""
    state = path.stat()
    with path.open("rb") as file:
        file.seek(-8, 2)
        length = int.from_bytes(file.read(4), "little")
        file.seek(-8 - length, 2)
        footer = hashlib.sha256(file.read()).hexdigest()
    return f"{state.st_size} bytes, changed at {state.st_mtime_ns} ns, footer {footer}"
