"""What the file formats of mass functions share: the header, rebuilding with all checks, whole files."""

import json
import math
import os
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.belief.frame import Frame
from evifuse.belief.mass import DENSE_LIMIT, MassFunction, every_set, singleton_sets
from evifuse.errors import BeliefError

FORMAT = "evifuse mass function 1"

Sets = NDArray[np.int64]
Masses = NDArray[np.float64]
PathLike = str | os.PathLike[str]


def describe(m: MassFunction) -> dict[str, Any]:
    """Everything but the numbers, ready for JSON; refuses what could not be read again."""
    opened = _has_empty(m)
    MassFunction(
        m.frame, m.focal_sets if m.focal_sets.ndim > 1 else m.focal_sets.tolist(), m.masses, open_world=opened
    )
    lists = m.frame.attributes
    header: dict[str, Any] = {
        "format": FORMAT,
        "frame": list(m.frame.hypotheses),
        "attributes": None
        if lists is None
        else {name: sorted(values) for name, values in zip(m.frame.hypotheses, lists, strict=True)},
        "layout": m.layout,
        "shape": list(m.masses.shape),
        "open_world": opened,
    }
    if m.layout in ("shared", "padded") and m.focal_sets.ndim == 1:
        header["focal_sets"] = [m.frame.names(s) for s in m.focal_sets.tolist()]
    return header


def _has_empty(m: MassFunction) -> bool:
    """Whether the empty set is listed, or has mass where it may be listed without."""
    if m.focal_sets.ndim == 1 and m.layout != "dense":
        return bool((m.focal_sets == 0).any())
    return bool(np.any((m.focal_sets == 0) & (m.masses != 0)))


class Header:
    """A header that was read, checked: the frame, the layout, the shape, and shared focal sets if any."""

    def __init__(self, where: str, values: Any) -> None:
        if not isinstance(values, dict) or values.get("format") != FORMAT:
            raise BeliefError(f"{where}: this is not an evifuse mass function (no header {FORMAT!r})")
        try:
            self.frame = Frame(values["frame"], values["attributes"])
            self.layout = values["layout"]
            self.shape = tuple(int(n) for n in values["shape"])
            self.open_world = bool(values["open_world"])
            listed = values.get("focal_sets")
            self.sets: Sets | None = None if listed is None else self.masks(listed)
        except BeliefError as error:
            raise type(error)(f"{where}: {error}") from None
        except (KeyError, TypeError, ValueError) as error:
            raise BeliefError(f"{where}: the header lacks or spoils {error}") from None
        if self.layout not in ("shared", "padded", "singletons", "dense"):
            raise BeliefError(f"{where}: unknown layout {self.layout!r} in the header")
        count = len(self.frame)
        if self.layout == "dense" and count > DENSE_LIMIT:
            raise BeliefError(f"{where}: {count} hypotheses are too many for the layout 'dense'")
        if self.layout in ("singletons", "dense"):
            self.sets = singleton_sets(count) if self.layout == "singletons" else every_set(count)
        if self.layout == "shared" and self.sets is None:
            raise BeliefError(f"{where}: the header has no 'focal_sets', which the layout 'shared' needs")
        width = self.shape[-1] if self.shape and min(self.shape) >= 0 else -1
        if width < 1 or (self.sets is not None and self.sets.shape != (width,)):
            raise BeliefError(f"{where}: the header's shape {list(self.shape)} does not fit the focal sets")
        self.cases = math.prod(self.shape[:-1])

    def masks(self, listed: Any) -> Sets:
        """Bitmasks of lists of names."""
        return np.array([self.frame.mask(tuple(names)) for names in listed], dtype=np.int64)

    def build(self, where: str, masses: Masses, sets: Sets | None = None) -> MassFunction:
        """The mass function, past the same door as one made by hand; not a digit is changed."""
        given = self.sets if sets is None else sets
        if given is None:
            raise BeliefError(f"{where}: the focal sets of the cases are missing")
        values = np.ascontiguousarray(masses, dtype=np.float64).reshape(self.shape)
        if given.ndim > 1:
            given = given.reshape(self.shape)
        try:
            door = given if given.ndim > 1 else given.tolist()
            MassFunction(self.frame, door, values, open_world=self.open_world)
        except BeliefError as error:
            raise type(error)(f"{where}: {error}") from None
        return MassFunction.trusted(self.frame, given, values, self.layout)


def parse_header(where: str, text: str | bytes) -> Header:
    """Header from JSON."""
    try:
        values = json.loads(text)
    except ValueError as error:
        raise BeliefError(f"{where}: the header is not JSON: {error}") from None
    return Header(where, values)


def read_whole(path: PathLike) -> bytes:
    """All bytes of a file."""
    try:
        return Path(path).read_bytes()
    except OSError as error:
        raise BeliefError(f"{path}: can't be read: {error.strerror or error}") from error


def write_whole(path: PathLike, content: bytes) -> None:
    """Write beside a file, then put it in its place in one step: it appears whole or not at all."""
    target = Path(path)
    if target.is_dir() or not target.parent.is_dir():
        why = "this is a folder: name a file" if target.is_dir() else "create its folder first"
        raise BeliefError(f"{target}: can't be written: {why}")
    beside: Path | None = None
    try:
        handle, name = tempfile.mkstemp(prefix=f".{target.stem}.", suffix=target.suffix, dir=target.parent)
        beside = Path(name)
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        mask = os.umask(0o022)
        os.umask(mask)
        beside.chmod(0o666 & ~mask)
        beside.replace(target)
    except OSError as error:
        raise BeliefError(f"{target}: writing failed: {error.strerror or error}") from error
    finally:
        if beside is not None:
            with suppress(OSError):
                beside.unlink()
