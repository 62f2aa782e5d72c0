"""Rules on canonical weights: sources that are not independent, and a source taken out again."""

from collections.abc import Callable, Sequence
from functools import reduce
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from evifuse.belief._lattice import masses_of, swept
from evifuse.belief.combine import Combination, aligned, conjunctive
from evifuse.belief.frame import Frame
from evifuse.belief.mass import MassFunction
from evifuse.belief.weights import (
    from_log_conjunctive_weights,
    from_log_disjunctive_weights,
    log_conjunctive_weights,
    log_disjunctive_weights,
)
from evifuse.errors import ConflictError, MassError

__all__ = ["bold", "cautious", "decombine"]

Array = NDArray[np.float64]


def cautious(a: MassFunction, b: MassFunction) -> Combination:
    """Cautious rule: both sources are right, but may rest on the same evidence, so nothing counts twice.

    Parameters
    ----------
    a : MassFunction
        First source, over up to 20 hypotheses, with mass on the frame.
    b : MassFunction
        Second source, over the same frame, with mass on it; batch dimensions broadcast.

    Returns
    -------
    Combination
        The combination whose conjunctive weights are the smaller of the two (Denoeux 2008), in the dense
        layout, and the conflict that it leaves on the empty set; `condition` on the frame scales it away. The
        rule is commutative, associative and idempotent; ignorance is neutral only where no weight is above 1.

    Raises
    ------
    FrameError
        If the frames differ.
    MassError
        If a source has no mass on the frame (discount it first), or the frame more than 20 hypotheses.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> frame = Frame(["rectangle", "triangle"])
    >>> a = MassFunction.of(frame, {"rectangle": 0.5, frame: 0.5})
    >>> cautious(a, a).mass
    MassFunction(rectangle: 0.5, frame: 0.5)
    """
    return cautious_of([a, aligned(a, b)])


def bold(a: MassFunction, b: MassFunction) -> Combination:
    """Bold rule: at least one source is right, and they may rest on the same evidence.

    Parameters
    ----------
    a : MassFunction
        First source, over up to 20 hypotheses, with mass on the empty set.
    b : MassFunction
        Second source, over the same frame, with mass on the empty set; batch dimensions broadcast.

    Returns
    -------
    Combination
        The combination whose disjunctive weights are the smaller of the two (Denoeux 2008), in the dense
        layout; its conflict is 0, because none arises. The rule is commutative, associative and idempotent.

    Raises
    ------
    FrameError
        If the frames differ.
    MassError
        If a source has no mass on the empty set (move a little there first), or the frame more than 20
        hypotheses.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> frame = Frame(["rectangle", "triangle"])
    >>> a = MassFunction.of(frame, {"rectangle": 0.75, (): 0.25}, open_world=True)
    >>> bold(a, a).mass
    MassFunction(rectangle: 0.75, ∅: 0.25)
    """
    return bold_of([a, aligned(a, b)])


def decombine(
    joint: MassFunction, source: MassFunction, *, rule: Literal["dempster", "conjunctive"] = "dempster"
) -> Combination:
    """A source taken out of a combination that it went into: the commonalities are divided.

    Parameters
    ----------
    joint : MassFunction
        The combination, over up to 20 hypotheses.
    source : MassFunction
        What to take out, over the same frame, with mass on the frame; batch dimensions broadcast.
    rule : {"dempster", "conjunctive"}
        How it went in: ``dempster`` scales what remains to 1, ``conjunctive`` keeps the empty set.

    Returns
    -------
    Combination
        What was combined with the source (Shenoy 1994, Denoeux 2008), in the dense layout, and how much it
        and the source contradict each other.

    Raises
    ------
    FrameError
        If the frames differ.
    MassError
        If the source has no mass on the frame, or was not part of the combination, so that what remains is
        not a mass function.
    ConflictError
        If all of the combination's mass is on the empty set and the rule is ``dempster``.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction, dempster
    >>> frame = Frame(["rectangle", "triangle"])
    >>> a = MassFunction.of(frame, {"rectangle": 0.5, frame: 0.5})
    >>> b = MassFunction.of(frame, {"triangle": 0.25, frame: 0.75})
    >>> decombine(dempster(a, b).mass, b).mass
    MassFunction(rectangle: 0.5, frame: 0.5)
    """
    source = aligned(joint, source)
    if rule not in ("dempster", "conjunctive"):
        raise MassError(f"unknown rule {rule!r}: a source can be taken out of 'dempster' or 'conjunctive'")
    mine, other = joint.to("dense").masses, source.to("dense").masses
    bad = np.argwhere(~(other[..., -1] > 0))
    if len(bad):
        at = f" at index {tuple(bad[0].tolist())}" if source.batch else ""
        raise MassError(
            f"the source{at} has no mass on the frame: what it ruled out can't be recovered; discount "
            "sources before they are combined"
        )
    divisor = swept("sums_down", other)
    quotient = swept("sums_down", mine) / divisor
    if rule == "dempster":
        quotient, divisor = _closed(quotient, divisor)
    without = "the source was not part of the combination: without it there is no"
    rest = masses_of(joint.frame, "differences_down", quotient, quotient + 1.0 / divisor, without)
    if rule == "dempster":
        total = rest.masses.sum(axis=-1, keepdims=True)
        rest = MassFunction.trusted(joint.frame, rest.focal_sets, rest.masses / total, "dense")
    return Combination(rest, conjunctive(rest, source).conflict)


def _closed(quotient: Array, divisor: Array) -> tuple[Array, Array]:
    """Commonalities scaled to 1, with no mass on the empty set."""
    count = quotient.shape[-1]
    singles = 1 << np.arange(count.bit_length() - 1)
    largest = quotient[..., singles].max(axis=-1, keepdims=True)
    bad = np.argwhere(~(largest[..., 0] > 0))
    if len(bad):
        at = f" at index {tuple(bad[0].tolist())}" if quotient.ndim > 1 else ""
        raise ConflictError(
            f"all mass of the combination{at} is on the empty set: nothing is left to scale to 1"
        )
    quotient = quotient / largest
    quotient[..., 0] = 0.0
    total = -swept("differences_down", quotient)[..., :1]  # of all masses but that of the empty set
    quotient[..., :1] = total
    scale = np.where(total > 0, total, 1.0)
    return quotient / scale, divisor * largest * scale


def cautious_of(sources: Sequence[MassFunction]) -> Combination:
    """Cautious combination of any number of sources over one frame."""
    joint = _least(sources, log_conjunctive_weights, from_log_conjunctive_weights)
    return Combination(joint, joint.masses[..., 0].copy())


def bold_of(sources: Sequence[MassFunction]) -> Combination:
    """Bold combination of any number of sources over one frame."""
    joint = _least(sources, log_disjunctive_weights, from_log_disjunctive_weights)
    return Combination(joint, np.zeros(joint.batch))


def _least(
    sources: Sequence[MassFunction],
    weights: Callable[[MassFunction], Array],
    back: Callable[[Frame, Array], MassFunction],
) -> MassFunction:
    return back(sources[0].frame, reduce(np.minimum, (weights(m) for m in sources)))
