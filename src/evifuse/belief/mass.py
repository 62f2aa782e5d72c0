"""The mass function: how much belief is committed to each focal set, for one case or a million."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evifuse.belief.frame import Frame, Subset
from evifuse.errors import FrameError, MassError

__all__ = ["TOLERANCE", "MassFunction"]

TOLERANCE = 1e-9
"""How far a sum of masses may be from 1 through rounding alone."""


@dataclass(frozen=True, eq=False)
class MassFunction:
    """Masses over focal sets of a frame, with leading batch dimensions.

    Parameters
    ----------
    frame : Frame
        What the masses are about.
    focal_sets : array_like of int, shape (F,)
        Bitmasks, all different, none empty; shared by the whole batch. A set may carry mass 0.
    masses : array_like of float, shape (..., F)
        Mass of each focal set, in [0, 1], summing to 1 along the last axis within 1e-9. Nothing is
        renormalised.

    Raises
    ------
    FrameError
        If a focal set is not a subset of the frame or is listed twice.
    MassError
        If shapes disagree, a mass is negative or not finite, the empty set is listed, or a sum is not 1.

    Examples
    --------
    >>> frame = Frame(["rectangle", "triangle"])
    >>> MassFunction.of(frame, {"rectangle": 0.3, frame: 0.7})
    MassFunction(rectangle: 0.3, frame: 0.7)
    """

    frame: Frame
    focal_sets: NDArray[np.int64]
    masses: NDArray[np.float64]

    def __init__(
        self, frame: Frame, focal_sets: Iterable[Subset] | NDArray[np.int64], masses: ArrayLike
    ) -> None:
        sets = [frame.mask(int(s) if isinstance(s, np.integer) else s) for s in focal_sets]
        values = np.array(masses, dtype=np.float64)
        if values.ndim == 0 or values.shape[-1] != len(sets):
            raise MassError(
                f"{len(sets)} focal sets need masses of shape (..., {len(sets)}), not {values.shape}"
            )
        if not sets:
            raise MassError("a mass function needs at least one focal set")
        if 0 in sets:
            raise MassError(
                "mass on the empty set: evidence always supports some hypothesis; remove that entry"
            )
        if len(set(sets)) != len(sets):
            repeated = next(s for s in sets if sets.count(s) > 1)
            raise FrameError(
                f"focal set {frame.label(repeated)!r} is listed more than once; add its masses up"
            )
        _check(frame, sets, values)
        _store(self, frame, np.array(sets, dtype=np.int64), values)

    @classmethod
    def of(cls, frame: Frame, masses: Mapping[Subset, float]) -> "MassFunction":
        """One mass function from a mapping of subsets to masses.

        Parameters
        ----------
        frame : Frame
            What the masses are about.
        masses : mapping of subset to float
            A key is one name, a tuple of names, a bitmask, or the frame itself for ignorance.

        Returns
        -------
        MassFunction
            Without batch dimensions.
        """
        return cls(frame, list(masses), [float(v) for v in masses.values()])

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
        cls, frame: Frame, focal_sets: NDArray[np.int64], masses: NDArray[np.float64]
    ) -> "MassFunction":
        """Arrays that are already known to be valid, without a second check.

        Parameters
        ----------
        frame : Frame
            What the masses are about.
        focal_sets : ndarray of int64, shape (F,)
            Different, non-empty bitmasks.
        masses : ndarray of float64, shape (..., F)
            Valid masses; the array is kept, not copied, and made read-only.

        Returns
        -------
        MassFunction
            Over the same arrays.
        """
        self = object.__new__(cls)
        _store(self, frame, focal_sets, masses)
        return self

    @property
    def batch(self) -> tuple[int, ...]:
        """Leading batch dimensions; ``()`` for a single mass function."""
        return self.masses.shape[:-1]

    def __getitem__(self, index: int | slice | tuple[int | slice, ...] | NDArray[np.bool_]) -> "MassFunction":
        """Part of a batch."""
        if not self.batch:
            raise IndexError("a single mass function has no batch dimension to index")
        return MassFunction.trusted(self.frame, self.focal_sets, self.masses[index])

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

    def on(self, focal_sets: NDArray[np.int64]) -> NDArray[np.float64]:
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
        match = focal_sets[:, None] == self.focal_sets[None, :]
        return self.masses @ match.T.astype(np.float64)

    def as_dict(self, digits: int | None = None) -> dict[str, float]:
        """Masses by label, largest first, zero masses left out.

        Parameters
        ----------
        digits : int, optional
            Round to so many decimals; as they are without it.

        Returns
        -------
        dict of str to float
            Keys are ``name``, ``name|name`` or ``frame``.

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
            return f"MassFunction(batch={self.batch}, {len(self.focal_sets)} focal sets over {self.frame})"
        return "MassFunction(" + ", ".join(f"{k}: {v:.6g}" for k, v in self.as_dict().items()) + ")"


def _store(m: MassFunction, frame: Frame, sets: NDArray[np.int64], values: NDArray[np.float64]) -> None:
    sets.setflags(write=False)
    values.setflags(write=False)
    object.__setattr__(m, "frame", frame)
    object.__setattr__(m, "focal_sets", sets)
    object.__setattr__(m, "masses", values)


def _check(frame: Frame, sets: list[int], values: NDArray[np.float64]) -> None:
    """Refuse bad masses, naming the first offender."""
    for bad, what in ((~np.isfinite(values), "is not a finite number"), (values < 0, "is negative")):
        if bad.any():
            where = [int(i) for i in np.argwhere(bad)[0]]
            at = f" at index {tuple(where[:-1])}" if len(where) > 1 else ""
            raise MassError(f"mass {values[tuple(where)]!s} of {frame.label(sets[where[-1]])!r}{at} {what}")
    total = values.sum(axis=-1)
    off = np.abs(total - 1) > TOLERANCE
    if off.any():
        where = tuple(int(i) for i in np.argwhere(off)[0])
        at = f" at index {where}" if where else ""
        hint = "put the balance on the frame" if total[where] < 1 else "masses are shares of one belief"
        raise MassError(f"masses{at} sum to {float(total[where]):.9g}, not 1: {hint}")
