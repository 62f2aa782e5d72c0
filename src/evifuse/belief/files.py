"""Mass functions in files: JSON to read, CSV for spreadsheets, Parquet for many; all exact."""

import csv
import io
import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.belief._csv_rows import case_columns, check_case, label_of, row_of, slots_of
from evifuse.belief._portable import (
    Header,
    PathLike,
    describe,
    parse_header,
    read_whole,
    write_whole,
)
from evifuse.belief.mass import MassFunction
from evifuse.errors import BeliefError, MissingExtraError

__all__ = ["from_csv", "from_json", "from_parquet", "to_csv", "to_json", "to_parquet"]


def to_json(m: MassFunction, path: PathLike) -> None:
    """Write one mass function or a batch as JSON, with frame, attributes and layout.

    Focal sets are lists of names. Numbers are written so that the very same ones are read back.

    Parameters
    ----------
    m : MassFunction
        In any layout, with any batch dimensions.
    path : str or path-like
        File to create or replace, in one step.

    Raises
    ------
    BeliefError
        If it can't be written, or the masses would not pass the door again.
    """
    content = describe(m)
    if m.focal_sets.ndim > 1:
        distinct, which = np.unique(m.focal_sets, return_inverse=True)
        content["focal_sets"] = [m.frame.names(s) for s in distinct.tolist()]
        content["which"] = which.reshape(m.focal_sets.shape).tolist()
    content["masses"] = m.masses.tolist()
    lines = [f" {json.dumps(key)}: {_rows(value)}" for key, value in content.items()]
    write_whole(path, ("{\n" + ",\n".join(lines) + "\n}\n").encode())


def from_json(path: PathLike) -> MassFunction:
    """Read what `to_json` wrote.

    Parameters
    ----------
    path : str or path-like
        The file.

    Returns
    -------
    MassFunction
        With the same frame, layout, focal sets and masses.

    Raises
    ------
    BeliefError
        If the file can't be read or is not valid; the message names the file and the case.
    """
    where = str(path)
    try:
        content = json.loads(read_whole(path))
    except (ValueError, RecursionError) as error:
        raise BeliefError(f"{where}: this is not JSON: {error}") from None
    padded = isinstance(content, dict) and "which" in content
    listed = content.pop("focal_sets", None) if padded else None
    header = Header(where, content)
    masses = _array(where, "masses", content.get("masses"), header, "if")
    if not padded:
        return header.build(where, masses)
    try:
        distinct = header.masks(listed)
    except (BeliefError, TypeError) as error:
        raise BeliefError(f"{where}: focal_sets: {error}") from None
    which = _array(where, "which", content["which"], header, "i")
    if np.any((which < 0) | (which >= len(distinct))):
        raise BeliefError(f"{where}: 'which' points outside the {len(distinct)} focal sets")
    return header.build(where, masses, distinct[which] if which.size else which.astype(np.int64))


def to_csv(m: MassFunction, path: PathLike) -> None:
    """Write one mass function or a batch as CSV: a row for each focal set of each case.

    The first line is a comment with frame, attributes and layout as JSON. Columns are the batch index
    (``case``, or ``case_0``, ``case_1``, ...), the names of the focal set joined by ``|`` (nothing for the
    empty set; a backslash escapes), and its mass.

    Parameters
    ----------
    m : MassFunction
        In any layout, with any batch dimensions.
    path : str or path-like
        File to create or replace, in one step.

    Raises
    ------
    BeliefError
        If it can't be written, or the masses would not pass the door again.
    """
    text = io.StringIO(newline="")
    text.write("# " + json.dumps(describe(m)) + "\n")
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow([*case_columns(len(m.batch)), "focal_set", "mass"])
    labels = {s: label_of(m.frame, s) for s in np.unique(m.focal_sets).tolist()}
    sets = np.broadcast_to(m.focal_sets, m.masses.shape)
    for case in np.ndindex(m.batch):
        for s, value in zip(sets[case].tolist(), m.masses[case].tolist(), strict=True):
            rows.writerow([*case, labels[s], repr(value)])
    write_whole(path, text.getvalue().encode("utf-8", "surrogatepass"))


def from_csv(path: PathLike) -> MassFunction:
    """Read what `to_csv` wrote; rows must be in the order in which they were written.

    Parameters
    ----------
    path : str or path-like
        The file.

    Returns
    -------
    MassFunction
        With the same frame, layout, focal sets and masses.

    Raises
    ------
    BeliefError
        If the file can't be read or is not valid; the message names the file and the line.
    """
    where = str(path)
    try:
        text = read_whole(path).decode("utf-8-sig", "surrogatepass")
    except UnicodeDecodeError as error:
        raise BeliefError(f"{where}: this is not text in UTF-8: {error.reason}") from None
    first, _, rest = text.partition("\n")
    if not first.startswith("#"):
        raise BeliefError(
            f"{where}:1: the first line must be the comment with the header, as to_csv writes it"
        )
    header = parse_header(f"{where}:1", first[1:])
    table = csv.reader(io.StringIO(rest, newline=""))
    expected = [*case_columns(len(header.shape) - 1), "focal_set", "mass"]
    if (columns := next(table, [])) != expected:
        raise BeliefError(f"{where}:2: columns must be {','.join(expected)}, not {','.join(columns)}")
    if header.cases * header.shape[-1] > len(rest):
        raise BeliefError(f"{where}:2: the file is shorter than the header's shape {list(header.shape)} says")
    sets, masses = np.empty(header.shape, np.int64), np.empty(header.shape)
    masks: dict[str, int] = {}
    slots = slots_of(header)
    line = 2
    try:
        for row in table:
            line = table.line_num + 1
            if not row:
                continue
            slot = next(slots, None)
            if slot is None:
                raise BeliefError(f"more rows than the {masses.size} that the header announces")
            sets[slot], masses[slot] = row_of(header, slot, row, masks)
            if slot[-1] == header.shape[-1] - 1:
                check_case(header, sets[slot[:-1]], masses[slot[:-1]])
    except (BeliefError, csv.Error) as error:
        kind = type(error) if isinstance(error, BeliefError) else BeliefError
        raise kind(f"{where}:{line}: {error}") from None
    if next(slots, None) is not None:
        raise BeliefError(f"{where}:{line}: the file ends before the {masses.size} rows of the header")
    return header.build(where, masses, sets if header.sets is None else None)


def to_parquet(m: MassFunction, path: PathLike) -> None:
    """Write one mass function or a batch as Parquet: a row for each case. Needs the extra ``parquet``.

    The column ``masses`` holds a list of doubles, ``focal_sets`` one of bitmasks where each case has its own;
    frame, attributes, layout and shared focal sets are in the schema's metadata under ``evifuse``.

    Parameters
    ----------
    m : MassFunction
        In any layout, with any batch dimensions.
    path : str or path-like
        File to create or replace, in one step.

    Raises
    ------
    BeliefError
        If it can't be written, or the masses would not pass the door again.
    MissingExtraError
        If pyarrow is not installed.
    """
    pa, parquet = _pyarrow()
    width = m.masses.shape[-1]
    columns = {"masses": _list_column(pa, m.masses, width)}
    if m.focal_sets.ndim > 1:
        columns["focal_sets"] = _list_column(pa, m.focal_sets, width)
    table = pa.table(columns).replace_schema_metadata({"evifuse": json.dumps(describe(m))})
    content = io.BytesIO()
    parquet.write_table(table, content)
    write_whole(path, content.getvalue())


def from_parquet(path: PathLike) -> MassFunction:
    """Read what `to_parquet` wrote. Needs the extra ``parquet``.

    Parameters
    ----------
    path : str or path-like
        The file.

    Returns
    -------
    MassFunction
        With the same frame, layout, focal sets and masses.

    Raises
    ------
    BeliefError
        If the file can't be read or is not valid; the message names the file and the row.
    MissingExtraError
        If pyarrow is not installed.
    """
    pa, parquet = _pyarrow()
    where = str(path)
    content = read_whole(path)
    try:
        table = parquet.read_table(pa.BufferReader(content))
    except (pa.ArrowException, OSError) as error:
        raise BeliefError(f"{where}: this is not Parquet: {str(error).splitlines()[0]}") from None
    metadata = table.schema.metadata or {}
    header = parse_header(where, metadata.get(b"evifuse", b"null"))
    masses = _from_column(where, table, "masses", header)
    sets = None if header.sets is not None else _from_column(where, table, "focal_sets", header)
    return header.build(where, masses, sets)


def _rows(value: Any) -> str:
    """JSON with one line for each row of a table."""
    if isinstance(value, list) and value and isinstance(value[0], list):
        return "[\n  " + ",\n  ".join(json.dumps(row) for row in value) + "\n ]"
    return json.dumps(value)


def _array(where: str, key: str, given: Any, header: Header, kinds: str) -> NDArray[Any]:
    """Nested lists as an array of the header's shape; the message says which row is not one."""
    values = _numbers(given, kinds)
    if values is not None and (values.shape == header.shape or (not header.cases and not values.size)):
        return values.reshape(header.shape)
    rows: list[Any] = given if isinstance(given, list) else []
    for i, row in enumerate(rows):
        numbers = _numbers(row, kinds)
        if numbers is None or numbers.shape != header.shape[1:]:
            raise BeliefError(f"{where}: row {i} of {key!r} is not numbers of shape {list(header.shape[1:])}")
    raise BeliefError(f"{where}: {key!r} has {len(rows)} rows, not shape {list(header.shape)}")


def _numbers(given: Any, kinds: str) -> NDArray[Any] | None:
    try:
        values = np.array(given)
    except ValueError:  # rows of different lengths
        return None
    return values if values.dtype.kind in kinds or not values.size else None


def _pyarrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError as error:
        raise MissingExtraError("Parquet files need pyarrow: pip install 'evifuse[parquet]'") from error
    return pyarrow, pyarrow.parquet


def _list_column(pa: Any, values: NDArray[Any], width: int) -> Any:
    return pa.FixedSizeListArray.from_arrays(pa.array(np.ascontiguousarray(values).ravel()), width)


def _from_column(where: str, table: Any, name: str, header: Header) -> NDArray[Any]:
    if name not in table.column_names:
        raise BeliefError(f"{where}: there is no column {name!r}")
    rows = table.column(name).combine_chunks()
    if len(rows) != header.cases:
        raise BeliefError(f"{where}: {len(rows)} rows in {name!r}, not the {header.cases} of the header")
    for i, row in enumerate(rows.is_null().to_pylist()):
        if row:
            raise BeliefError(f"{where}: row {i} of {name!r} is empty")
    try:
        flat = rows.flatten()
        if str(flat.type) != ("double" if name == "masses" else "int64"):
            raise BeliefError(f"{where}: {name!r} holds {flat.type}, not doubles or bitmasks")
        if flat.null_count:
            first = int(np.flatnonzero(flat.is_null().to_numpy(zero_copy_only=False))[0])
            raise BeliefError(f"{where}: row {first // header.shape[-1]} of {name!r} lacks a number")
        return flat.to_numpy(zero_copy_only=False).reshape(header.shape)
    except (AttributeError, ValueError) as error:
        if isinstance(error, BeliefError):
            raise
        raise BeliefError(f"{where}: {name!r} does not hold lists of {header.shape[-1]} numbers") from None
