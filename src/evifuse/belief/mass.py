"""The mass function: how much belief is committed to each focal set, for one case or a million."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evifuse.belief.frame import Frame, Subset
from evifuse.errors import FrameError, MassError

__all__ = ["DENSE_LIMIT", "TOLERANCE", "Layout", "MassFunction"]

TOLERANCE = 1e-9
"""How far a sum of masses may be from 1 through rounding alone."""

DENSE_LIMIT = 20
"""Largest number of hypotheses for which all subsets are laid out."""

Layout = Literal["shared", "padded", "singletons", "dense"]
"""How focal sets are stored: see `MassFunction`."""

Sets = NDArray[np.int64]
Masses = NDArray[np.float64]


@dataclass(frozen=True, eq=False, slots=True)
class MassFunction:
    """Masses over focal sets of a frame, with leading batch dimensions.

    There are four layouts, chosen by what the focal sets are:

    - ``shared``: any F sets, the same for the whole batch;
    - ``padded``: F sets for each case of its own, filled up with the empty set at mass 0;
    - ``singletons``: every hypothesis in order, then the frame (K + 1 sets);
    - ``dense``: all 2^K subsets in the order of their bitmasks, the empty set first (up to 20 hypotheses).

    Parameters
    ----------
    frame : Frame
        What the masses are about.
    focal_sets : iterable of subset, or array_like of int of shape (F,) or (..., F)
        Names, tuples of names or bitmasks, all different, none empty. A set may carry mass 0.
    masses : array_like of float, shape (..., F)
        Mass of each focal set, in [0, 1], summing to 1 along the last axis within 1e-9. Nothing is
        renormalised.
    open_world : bool
        Allow mass on the empty set, as the unnormalised rules leave it.

    Raises
    ------
    FrameError
        If a focal set is not a subset of the frame or is listed twice.
    MassError
        If shapes disagree, a mass is negative or not finite, the empty set carries mass, or a sum is not 1.

    Examples
    --------
    >>> frame = Frame(["rectangle", "triangle"])
    >>> MassFunction.of(frame, {"rectangle": 0.3, frame: 0.7})
    MassFunction(frame: 0.7, rectangle: 0.3)
    """

    frame: Frame
    focal_sets: Sets
    masses: Masses
    layout: Layout

    def __init__(
        self,
        frame: Frame,
        focal_sets: Iterable[Subset] | NDArray[np.integer[Any]],
        masses: ArrayLike,
        *,
        open_world: bool = False,
    ) -> None:
        values = np.array(masses, dtype=np.float64)
        sets = _sets(frame, focal_sets)
        count = sets.shape[-1]
        if values.ndim == 0 or values.shape[-1] != count:
            raise MassError(f"{count} focal sets need masses of shape (..., {count}), not {values.shape}")
        if sets.ndim > 1 and sets.shape != values.shape:
            raise MassError(f"focal sets of shape {sets.shape} need masses of that shape, not {values.shape}")
        if not count:
            raise MassError("a mass function needs at least one focal set")
        _check(frame, sets, values, open_world)
        _store(self, frame, sets, values, "padded" if sets.ndim > 1 else _recognise(frame, sets))

    @classmethod
    def of(cls, frame: Frame, masses: Mapping[Subset, float], *, open_world: bool = False) -> "MassFunction":
        """One mass function from a mapping of subsets to masses.

        Parameters
        ----------
        frame : Frame
            What the masses are about.
        masses : mapping of subset to float
            A key is one name, a tuple of names, a bitmask, or the frame itself for ignorance.
        open_world : bool
            Allow mass on the empty set, with the key ``()``.

        Returns
        -------
        MassFunction
            Without batch dimensions.
        """
        return cls(frame, list(masses), [float(v) for v in masses.values()], open_world=open_world)

    @classmethod
    def vacuous(cls, frame: Frame, batch: tuple[int, ...] = ()) -> "MassFunction":
        """Total ignorance: all mass on the frame.

        Parameters
        ----------
        frame : Frame
            What nothing is known about.
        batch : tuple of int, optional
            Leading batch dimensions.

        Returns
        -------
        MassFunction
            With one focal set, the frame.
        """
        return cls.trusted(frame, np.array([frame.full], dtype=np.int64), np.ones((*batch, 1)))

    @classmethod
    def trusted(
        cls, frame: Frame, focal_sets: Sets, masses: Masses, layout: Layout | None = None
    ) -> "MassFunction":
        """Arrays that are already known to be valid, without a second check.

        Parameters
        ----------
        frame : Frame
            What the masses are about.
        focal_sets : ndarray of int64, shape (F,) or (..., F)
            Bitmasks.
        masses : ndarray of float64, shape (..., F)
            Valid masses; the arrays are kept, not copied, and made read-only.
        layout : {"shared", "padded", "singletons", "dense"}, optional
            If known; ``shared`` or ``padded`` by the shape of the focal sets without it.

        Returns
        -------
        MassFunction
            Over the same arrays.
        """
        self = object.__new__(cls)
        _store(self, frame, focal_sets, masses, layout or ("shared" if focal_sets.ndim == 1 else "padded"))
        return self

    @property
    def batch(self) -> tuple[int, ...]:
        """Leading batch dimensions; ``()`` for a single mass function."""
        return self.masses.shape[:-1]

    def to(self, layout: Layout) -> "MassFunction":
        """The same masses in another layout.

        Parameters
        ----------
        layout : {"shared", "padded", "singletons", "dense"}
            The layout to use. ``shared`` lists every set that is focal anywhere in the batch; ``padded``
            lists those of each case and drops masses of 0.

        Returns
        -------
        MassFunction
            Equal to this one.

        Raises
        ------
        MassError
            If the layout can't hold these masses: ``singletons`` with other focal sets, ``dense`` with more
            than 20 hypotheses.
        """
        if layout == self.layout:
            return self
        if layout == "shared":
            sets = np.unique(self.focal_sets[self.masses > 0]) if self.layout == "padded" else self.focal_sets
            return MassFunction.trusted(self.frame, sets, self.on(sets), "shared")
        if layout == "padded":
            return self._padded()
        sets = every_set(len(self.frame)) if layout == "dense" else singleton_sets(len(self.frame))
        values = self.on(sets)
        if layout == "singletons":
            lost = self.masses.sum(axis=-1) - values.sum(axis=-1)
            if np.any(np.abs(lost) > TOLERANCE):
                raise MassError(
                    "the layout 'singletons' holds single hypotheses and the frame, but other sets have mass"
                )
        return MassFunction.trusted(self.frame, sets, values, layout)

    def _padded(self) -> "MassFunction":
        sets = np.broadcast_to(self.focal_sets, self.masses.shape)
        order = np.argsort(self.masses <= 0, axis=-1, kind="stable")
        width = max(1, int((self.masses > 0).sum(axis=-1).max(initial=1)))
        values = np.take_along_axis(self.masses, order, axis=-1)[..., :width]
        kept = np.take_along_axis(sets, order, axis=-1)[..., :width]
        return MassFunction.trusted(self.frame, np.where(values > 0, kept, 0), values.copy(), "padded")

    def on(self, focal_sets: Sets) -> Masses:
        """Masses laid out over given focal sets.

        Parameters
        ----------
        focal_sets : ndarray of int64, shape (G,)
            Bitmasks, all different.

        Returns
        -------
        ndarray of float64, shape (..., G)
            Mass of each, 0 for sets that are not focal.
        """
        out = np.zeros((*self.batch, len(focal_sets)))
        order = np.argsort(focal_sets, kind="stable")
        ranked = focal_sets[order]
        place = np.minimum(np.searchsorted(ranked, self.focal_sets), len(ranked) - 1)
        there = ranked[place] == self.focal_sets
        column = order[place]
        if self.focal_sets.ndim == 1:
            out[..., column[there]] = self.masses[..., there]
            return out
        flat, width = out.reshape(-1, len(focal_sets)), self.masses.shape[-1]
        rows = np.repeat(np.arange(len(flat)), width)
        values = np.where(there, self.masses, 0.0).reshape(-1)
        np.add.at(flat, (rows, column.reshape(-1)), values)
        return out

    def where(self, chosen: NDArray[np.bool_]) -> Masses:
        """Sum of the masses of chosen focal sets.

        Parameters
        ----------
        chosen : ndarray of bool, shape of ``focal_sets``
            Which focal sets count.

        Returns
        -------
        ndarray of float64, shape (...)
            The sums.
        """
        if chosen.ndim == 1:
            return self.masses[..., chosen].sum(axis=-1)
        return np.where(chosen, self.masses, 0.0).sum(axis=-1)

    def __getitem__(self, index: Any) -> "MassFunction":
        """Part of a batch, by any NumPy index of the batch dimensions."""
        if not self.batch:
            raise IndexError("a single mass function has no batch dimension to index")
        batch = np.empty(self.batch, dtype=np.void)[index]  # an index that goes past the batch fails here
        del batch
        masses = self.masses[index]
        if self.focal_sets.ndim == 1:
            return MassFunction.trusted(self.frame, self.focal_sets, masses, self.layout)
        sets = self.focal_sets[index]
        return MassFunction.trusted(
            self.frame, sets, masses, "padded" if masses.ndim > 1 else "shared"
        ).tidy()

    def tidy(self) -> "MassFunction":
        """Without the padding, if this is a single mass function; else as it is.

        Returns
        -------
        MassFunction
            Equal to this one.
        """
        if self.batch or self.layout != "shared":
            return self
        keep = (self.focal_sets != 0) | (self.masses > 0)
        if keep.all():
            return self
        return MassFunction.trusted(self.frame, self.focal_sets[keep], self.masses[keep], "shared")

    def __len__(self) -> int:
        if not self.batch:
            raise TypeError("a single mass function has no length; len(m.focal_sets) counts its focal sets")
        return self.batch[0]

    def __iter__(self) -> Iterator["MassFunction"]:
        return (self[i] for i in range(len(self)))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, MassFunction) or self.frame != other.frame or self.batch != other.batch:
            return False
        sets = np.union1d(self.focal_sets, other.focal_sets)
        return bool(np.array_equal(self.on(sets), other.on(sets)))

    __hash__ = None  # pyright: ignore[reportAssignmentType]

    def __reduce__(self) -> tuple[Any, ...]:
        return MassFunction.trusted, (self.frame, self.focal_sets, self.masses, self.layout)

    def as_dict(self, digits: int | None = None) -> dict[str, float]:
        """Masses by label, largest first, zero masses left out.

        Parameters
        ----------
        digits : int, optional
            Round to so many decimals; as they are without it.

        Returns
        -------
        dict of str to float
            Keys are ``name``, ``name|name`` or ``frame``; ``∅`` for the empty set.

        Raises
        ------
        MassError
            If this is a batch.
        """
        if self.batch:
            raise MassError(f"a batch of shape {self.batch} has no single dictionary; index one first")
        order = np.argsort(-self.masses, kind="stable")
        pairs = ((self.frame.label(int(self.focal_sets[i])), float(self.masses[i])) for i in order)
        return {k: v if digits is None else round(v, digits) for k, v in pairs if v > 0}

    def __repr__(self) -> str:
        if self.batch:
            width = self.masses.shape[-1]
            return f"MassFunction(batch={self.batch}, {width} focal sets over {self.frame}, {self.layout})"
        return "MassFunction(" + ", ".join(f"{k}: {v:.6g}" for k, v in self.as_dict().items()) + ")"


@lru_cache(maxsize=DENSE_LIMIT + 1)
def every_set(count: int) -> Sets:
    """All subsets of so many hypotheses, read-only: the focal sets of the dense layout."""
    if count > DENSE_LIMIT:
        raise MassError(f"{count} hypotheses have too many subsets to lay out: the limit is {DENSE_LIMIT}")
    sets = np.arange(1 << count, dtype=np.int64)
    sets.setflags(write=False)
    return sets


@lru_cache(maxsize=64)
def singleton_sets(count: int) -> Sets:
    """Each of so many hypotheses and then the frame, read-only: the focal sets of the singletons layout."""
    singles = [1 << i for i in range(count)]
    sets = np.array(singles if count == 1 else [*singles, (1 << count) - 1], dtype=np.int64)
    sets.setflags(write=False)
    return sets


def _sets(frame: Frame, given: Iterable[Subset] | NDArray[np.integer[Any]]) -> Sets:
    if isinstance(given, np.ndarray) and given.ndim > 1:
        sets = given.astype(np.int64)
        for bad in sets[(sets < 0) | (sets > frame.full)][:1].tolist():
            frame.mask(bad)
        return sets
    masks = [frame.mask(int(s) if isinstance(s, np.integer) else s) for s in given]
    return np.array(masks, dtype=np.int64)


def _recognise(frame: Frame, sets: Sets) -> Layout:
    """The layout of a list of focal sets."""
    count = len(frame)
    if np.array_equal(sets, singleton_sets(count)):
        return "singletons"
    if count <= DENSE_LIMIT and len(sets) == 1 << count and np.array_equal(sets, every_set(count)):
        return "dense"
    return "shared"


def _store(m: MassFunction, frame: Frame, sets: Sets, values: Masses, layout: Layout) -> None:
    sets.flags.writeable = False
    values.flags.writeable = False
    put = object.__setattr__
    put(m, "frame", frame)
    put(m, "focal_sets", sets)
    put(m, "masses", values)
    put(m, "layout", layout)


def _check(frame: Frame, sets: Sets, values: Masses, open_world: bool) -> None:
    """Refuse bad masses, naming the first offender."""
    spread = np.broadcast_to(sets, values.shape)
    _check_sets(frame, sets, spread, values, open_world)
    for bad, what in ((~np.isfinite(values), "is not a finite number"), (values < 0, "is negative")):
        if bad.any():
            where = [int(i) for i in np.argwhere(bad)[0]]
            at = f" at index {tuple(where[:-1])}" if len(where) > 1 else ""
            name = frame.label(int(spread[tuple(where)]))
            raise MassError(f"mass {values[tuple(where)]!s} of {name!r}{at} {what}")
    total = values.sum(axis=-1)
    off = np.abs(total - 1) > TOLERANCE
    if off.any():
        where = tuple(int(i) for i in np.argwhere(off)[0])
        at = f" at index {where}" if where else ""
        hint = "put the balance on the frame" if total[where] < 1 else "masses are shares of one belief"
        raise MassError(f"masses{at} sum to {float(total[where]):.9g}, not 1: {hint}")


def _check_sets(frame: Frame, sets: Sets, spread: Sets, values: Masses, open_world: bool) -> None:
    dense = sets.ndim == 1 and _recognise(frame, sets) == "dense"
    empty = (spread == 0) & (values != 0) if dense or sets.ndim > 1 else spread == 0
    if not open_world and empty.any():
        raise MassError("mass on the empty set: evidence always supports some hypothesis; remove that entry")
    ranked = np.sort(sets, axis=-1)
    twice = (ranked[..., 1:] == ranked[..., :-1]) & ((ranked[..., 1:] != 0) | (sets.ndim == 1))
    if twice.any():
        repeated = int(ranked[..., 1:][twice][0])
        raise FrameError(f"focal set {frame.label(repeated)!r} is listed more than once; add its masses up")
