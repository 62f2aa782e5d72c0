"""Evidence carried from one frame to another: refinement, coarsening, products, multivalued mappings."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.belief.combine import on_frame
from evifuse.belief.frame import Frame, Subset
from evifuse.belief.mass import MassFunction, every_set, singleton_sets
from evifuse.errors import FrameError

__all__ = ["MultivaluedMapping", "carry", "coarsen", "refine", "refining"]

Sets = NDArray[np.int64]


@dataclass(frozen=True)
class MultivaluedMapping:
    """Which hypotheses of one frame are compatible with each hypothesis of another (Dempster 1967).

    Parameters
    ----------
    source : Frame
        The frame that evidence is about.
    target : Frame
        The frame that it is carried to.
    images : mapping of str to subset
        For each hypothesis of ``source``, the set of hypotheses of ``target`` that it allows.
    partial : bool
        Allow hypotheses without an image: they say that nothing in ``target`` is the case. Without it a
        hypothesis that is left out, or has an empty image, is an error.

    Raises
    ------
    FrameError
        If a name is in neither frame, or a hypothesis has no image and ``partial`` is false.

    Examples
    --------
    >>> weather, ground = Frame(["rain", "sun"]), Frame(["wet", "dry"])
    >>> MultivaluedMapping(weather, ground, {"rain": "wet", "sun": ["wet", "dry"]}).is_refining
    False
    """

    source: Frame
    target: Frame
    masks: tuple[int, ...]

    def __init__(
        self, source: Frame, target: Frame, images: Mapping[str, Subset], *, partial: bool = False
    ) -> None:
        for name in images:
            source.mask(name)
        masks = tuple(target.mask(images.get(name, ())) for name in source.hypotheses)
        if not partial:
            for name, mask in zip(source.hypotheses, masks, strict=True):
                if not mask:
                    raise FrameError(
                        f"{name!r} of {source} has no image in {target}: give it one, or say partial=True"
                    )
        object.__setattr__(self, "source", source)
        object.__setattr__(self, "target", target)
        object.__setattr__(self, "masks", masks)

    @property
    def is_refining(self) -> bool:
        """Whether the images are non-empty and part the target: each of its hypotheses is in exactly one."""
        union = 0
        for mask in self.masks:
            if not mask or mask & union:
                return False
            union |= mask
        return union == self.target.full

    @property
    def inverse(self) -> "MultivaluedMapping":
        """The same relation read from the target to the source; hypotheses may be left without an image."""
        back = {
            name: sum(1 << i for i, mask in enumerate(self.masks) if mask >> j & 1)
            for j, name in enumerate(self.target.hypotheses)
        }
        return MultivaluedMapping(self.target, self.source, back, partial=True)

    def then(self, other: "MultivaluedMapping") -> "MultivaluedMapping":
        """One mapping after another.

        Parameters
        ----------
        other : MultivaluedMapping
            From the target of this one.

        Returns
        -------
        MultivaluedMapping
            From the source of this one to the target of the other.

        Raises
        ------
        FrameError
            If the frames don't meet.
        """
        if other.source != self.target:
            raise FrameError(f"a mapping to {self.target} can't go on from {other.source}")
        images = dict(zip(self.source.hypotheses, map(other.image, self.masks), strict=True))
        return MultivaluedMapping(self.source, other.target, images, partial=True)

    def image(self, subset: Subset) -> int:
        """Everything that some member of a set allows: the union of its members' images.

        Parameters
        ----------
        subset : str, iterable of str, int or Frame
            A set of the source frame.

        Returns
        -------
        int
            Bitmask of the target frame.

        Raises
        ------
        FrameError
            If it is not a set of the source frame.
        """
        chosen, union = self.source.mask(subset), 0
        for i, mask in enumerate(self.masks):
            union |= mask if chosen >> i & 1 else 0
        return union

    def __str__(self) -> str:
        parts = zip(self.source.hypotheses, self.masks, strict=True)
        return "; ".join(f"{name} -> {self.target.label(mask)}" for name, mask in parts)


def refining(coarse: Frame, fine: Frame, parts: Mapping[str, Subset]) -> MultivaluedMapping:
    """A refining: every hypothesis of the coarse frame split into those of the fine one (Shafer 1976).

    Parameters
    ----------
    coarse : Frame
        The coarse frame.
    fine : Frame
        The fine frame.
    parts : mapping of str to subset
        The fine hypotheses of each coarse one: a partition of the fine frame.

    Returns
    -------
    MultivaluedMapping
        From coarse to fine.

    Raises
    ------
    FrameError
        If a name is unknown, or the parts overlap, are empty or leave out a fine hypothesis.

    Examples
    --------
    >>> coarse, fine = Frame(["round", "angular"]), Frame(["circle", "ellipse", "square"])
    >>> split = refining(coarse, fine, {"round": ["circle", "ellipse"], "angular": "square"})
    >>> refine(MassFunction.of(coarse, {"round": 0.75, coarse: 0.25}), split)
    MassFunction(circle|ellipse: 0.75, frame: 0.25)
    >>> coarsen(MassFunction.of(fine, {"circle": 0.5, ("circle", "square"): 0.5}), split)
    MassFunction(round: 0.5, frame: 0.5)
    """
    mapping = MultivaluedMapping(coarse, fine, parts)
    owner: dict[int, str] = {}
    for name, mask in zip(coarse.hypotheses, mapping.masks, strict=True):
        for i in range(len(fine)):
            if mask >> i & 1 and i in owner:
                raise FrameError(
                    f"{fine.hypotheses[i]!r} is in both {owner[i]!r} and {name!r}: parts overlap"
                )
            if mask >> i & 1:
                owner[i] = name
    missing = [name for i, name in enumerate(fine.hypotheses) if i not in owner]
    if missing:
        raise FrameError(f"{missing[0]!r} of {fine} is in no part of {coarse}: a refining leaves nothing out")
    return mapping


def carry(m: MassFunction, mapping: MultivaluedMapping) -> MassFunction:
    """Masses carried to another frame: ``m'(B)`` sums m(A) over the sets A whose image is B (Dempster 1967).

    Parameters
    ----------
    m : MassFunction
        Masses over the mapping's source frame, in any layout, batch shape ``(...)``.
    mapping : MultivaluedMapping
        What each hypothesis allows.

    Returns
    -------
    MassFunction
        Over the target frame, same batch; dense if ``m`` is and the target is no larger. Sets of hypotheses
        without an image (only ``partial`` mappings have them) leave their mass on the empty set.

    Raises
    ------
    FrameError
        If the masses are over another frame.
    """
    m = _over(m, mapping.source)
    moved = np.zeros_like(m.focal_sets)
    for i, mask in enumerate(mapping.masks):
        moved |= np.where(m.focal_sets >> i & 1, np.int64(mask), np.int64(0))
    return _summed(m, moved, mapping.target)


def refine(m: MassFunction, split: MultivaluedMapping) -> MassFunction:
    """Evidence over a coarse frame, said in terms of a finer one (vacuous extension, Shafer 1976).

    Parameters
    ----------
    m : MassFunction
        Masses over the coarse frame, batch shape ``(...)``.
    split : MultivaluedMapping
        A refining, from coarse to fine.

    Returns
    -------
    MassFunction
        Over the fine frame: every focal set becomes the union of its parts, so no belief is gained or lost.

    Raises
    ------
    FrameError
        If the mapping is not a refining, or the masses are not over its coarse frame.
    """
    return carry(m, _checked(split))


def coarsen(m: MassFunction, split: MultivaluedMapping, *, outer: bool = True) -> MassFunction:
    """Evidence over a fine frame, as far as a coarser one can say it (outer or inner reduction, Shafer 1976).

    Parameters
    ----------
    m : MassFunction
        Masses over the fine frame, batch shape ``(...)``.
    split : MultivaluedMapping
        A refining, from coarse to fine.
    outer : bool
        A focal set becomes all coarse hypotheses that it touches, which keeps the belief and plausibility of
        every coarse set. With false it becomes those that it holds entirely.

    Returns
    -------
    MassFunction
        Over the coarse frame. The inner reduction leaves the mass of sets that hold no whole part on the
        empty set.

    Raises
    ------
    FrameError
        If the mapping is not a refining, or the masses are not over its fine frame.
    """
    split = _checked(split)
    m = _over(m, split.target)
    if outer:
        return carry(m, split.inverse)
    moved = np.zeros_like(m.focal_sets)
    for i, mask in enumerate(split.masks):
        moved |= np.where(m.focal_sets & mask == mask, np.int64(1 << i), np.int64(0))
    return _summed(m, moved, split.source)


def _checked(split: MultivaluedMapping) -> MultivaluedMapping:
    if not split.is_refining:
        raise FrameError(f"the mapping {split} is not a refining: its images must part {split.target}")
    return split


def _over(m: MassFunction, frame: Frame) -> MassFunction:
    """Masses over this frame: the same names in another order are remapped, other names refused."""
    if m.frame.hypotheses == frame.hypotheses:
        return m
    if set(m.frame.hypotheses) != set(frame.hypotheses):
        raise FrameError(f"the masses are over {m.frame}, but the mapping speaks of {frame}")
    return on_frame(m, frame)


def _summed(m: MassFunction, moved: Sets, target: Frame) -> MassFunction:
    """Masses of focal sets that were moved, added up where some of them meet."""
    if moved.ndim > 1:
        return _summed_by_case(m, moved, target)
    if m.layout == "dense" and len(target) <= len(m.frame):
        sets = every_set(len(target))
        place = moved
    else:
        used = moved if m.layout != "dense" else moved[np.any(m.masses > 0, axis=tuple(range(len(m.batch))))]
        sets = np.unique(used)
        place = np.minimum(np.searchsorted(sets, moved), len(sets) - 1)
    masses = np.zeros((*m.batch, len(sets)))
    order = np.argsort(place, kind="stable")
    starts = np.flatnonzero(np.diff(place[order], prepend=-1))
    masses[..., place[order][starts]] = np.add.reduceat(m.masses[..., order], starts, axis=-1)
    if m.layout == "dense" and len(target) <= len(m.frame):
        return MassFunction.trusted(target, sets, masses, "dense")
    if np.array_equal(sets, singleton_sets(len(target))):
        return MassFunction.trusted(target, sets, masses, "singletons")
    return MassFunction.trusted(target, sets, masses, "shared")


def _summed_by_case(m: MassFunction, moved: Sets, target: Frame) -> MassFunction:
    """The same for the padded layout, in which every case has sets of its own."""
    order = np.argsort(moved, axis=-1, kind="stable")
    ranked = np.take_along_axis(moved, order, axis=-1)
    values = np.take_along_axis(m.masses, order, axis=-1)
    new = np.concatenate(
        [
            np.zeros((*ranked.shape[:-1], 1), np.int64),
            np.cumsum(ranked[..., 1:] != ranked[..., :-1], axis=-1),
        ],
        axis=-1,
    )
    shape = ranked.shape
    rows = np.repeat(np.arange(int(np.prod(shape[:-1]))), shape[-1])
    sets, masses = np.zeros_like(ranked), np.zeros(shape)
    sets.reshape(-1, shape[-1])[rows, new.reshape(-1)] = ranked.reshape(-1)
    np.add.at(masses.reshape(-1, shape[-1]), (rows, new.reshape(-1)), values.reshape(-1))
    return MassFunction.trusted(target, sets, masses, "padded")
