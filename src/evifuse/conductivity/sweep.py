"""Readings by the grid: which of the choices that the print leaves open give the published figures.

The figures are conductivities of appendix A.8; trying readings on them is our own.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.belief import MassFunction
from evifuse.conductivity.aggregate import KnowledgeBase
from evifuse.conductivity.classify import classify
from evifuse.conductivity.reading import READINGS, Reading

__all__ = [
    "OUR_CHOICES",
    "PRINT_CHOICES",
    "Example",
    "Outcome",
    "differences",
    "grid",
    "same_order",
    "single_changes",
    "try_reading",
]

PRINT_CHOICES: dict[str, tuple[Any, ...]] = {
    "entropy_sign": (-1, 1),
    "log_base": (None, 2.0, 10.0),
    "similarity_offset": (0.0, 0.1, 0.25, 0.5, 1.0),
    "divergence": ("symmetric", "printed"),
    "ties": ("mean", "first"),
    "pairs_within": (1, 2),
    "pairs_between": (1, 2),
    "members": ("inner", "within"),
}
"""What the print leaves open."""

OUR_CHOICES: dict[str, tuple[Any, ...]] = {
    "similarity_offset": (0.1, 0.2, 0.25, 0.5),
    "pairs_within": (1, 2),
    "pairs_between": (1, 2),
    "members": ("inner", "within"),
    "projection": (True, False),
    "pooling": ("sum", "mean", "max"),
    "smoothing": (0.0, 0.05, 0.2),
    "sharpness": (1.0, 2.0, 8.0),
    "commitment": (None, 0.8),
    "negligible": (0.0, 0.1),
}
"""What we added, on top of the sound reading."""


def grid(choices: Mapping[str, Sequence[Any]]) -> list[Reading]:
    """Every combination of choices that differs in effect, all else as in the sound reading.

    Parameters
    ----------
    choices : mapping of str to sequence
        Values to try by field of `Reading`.

    Returns
    -------
    list of Reading
        All different. Combinations with a choice that nothing depends on are left out: what concerns the
        branch point (``pairs_between``, ``members``, ``log_base``, ``smoothing``) without projection, and
        crumbs without a nominal commitment.

    Examples
    --------
    >>> len(grid({"projection": (True, False), "smoothing": (0.0, 0.1)}))
    3
    """
    found: dict[Reading, None] = {}
    sound = READINGS["sound"]
    for values in product(*choices.values()):
        reading = replace(sound, **dict(zip(choices, values, strict=True)))
        found.setdefault(_effective(reading, sound))
    return list(found)


def single_changes(choices: Mapping[str, Sequence[Any]]) -> list[Reading]:
    """The sound reading with one choice changed at a time.

    Parameters
    ----------
    choices : mapping of str to sequence
        Values to try by field of `Reading`.

    Returns
    -------
    list of Reading
        All different, the sound one first.

    Examples
    --------
    >>> len(single_changes({"ties": ("mean", "first"), "pairs_within": (1, 2)}))
    3
    """
    sound = READINGS["sound"]
    changed = [replace(sound, **{name: value}) for name, values in choices.items() for value in values]
    return list(dict.fromkeys([sound, *changed]))


def _effective(reading: Reading, sound: Reading) -> Reading:
    """The reading with what it does not use set to the default."""
    if not reading.projection:
        reading = replace(
            reading,
            pairs_between=sound.pairs_between,
            members=sound.members,
            log_base=sound.log_base,
            smoothing=sound.smoothing,
        )
    return replace(reading, negligible=0.0) if reading.commitment is None else reading


def differences(reading: Reading, base: Reading | None = None) -> str:
    """A reading by what it does not share with another one.

    Parameters
    ----------
    reading : Reading
        To describe.
    base : Reading, optional
        To compare with; the sound one by default.

    Returns
    -------
    str
        For example ``projection=False, pooling=max``; ``sound`` if there is no difference.
    """
    other = base or READINGS["sound"]
    names = [f.name for f in fields(Reading) if getattr(reading, f.name) != getattr(other, f.name)]
    return ", ".join(f"{name}={getattr(reading, name)}" for name in names) or "sound"


@dataclass(frozen=True)
class Example:
    """Evidence whose conductivities were published.

    Parameters
    ----------
    name : str
        Where it is printed.
    evidence : MassFunction
        One mass function.
    knowledge : KnowledgeBase
        The printed prototypes.
    published : mapping of str to float
        Conductivity by class, as printed.
    """

    name: str
    evidence: MassFunction
    knowledge: KnowledgeBase
    published: dict[str, float]


@dataclass(frozen=True)
class Outcome:
    """What one reading makes of the published examples.

    Parameters
    ----------
    reading : Reading
        How the formulas are read.
    computed : tuple of float
        Conductivities in the order of the examples and of their classes; NaN where undefined.
    gap : float
        Largest difference from a published one; infinite where one is undefined.
    ranked : bool
        Whether every strict order that was published holds in every example.
    """

    reading: Reading
    computed: tuple[float, ...]
    gap: float
    ranked: bool


def same_order(published: Sequence[float], computed: Sequence[float]) -> bool:
    """Whether every strict order that was published also holds between the computed figures.

    Parameters
    ----------
    published : sequence of float
        As printed.
    computed : sequence of float
        As many.

    Returns
    -------
    bool
        False if a computed one is NaN; equal published figures ask for nothing.
    """
    p, c = np.asarray(published, dtype=np.float64), np.asarray(computed, dtype=np.float64)
    asked: NDArray[np.bool_] = p[:, None] > p[None, :]
    return bool(np.isfinite(c).all()) and bool((c[:, None] > c[None, :])[asked].all())


def try_reading(reading: Reading, examples: Iterable[Example]) -> Outcome:
    """Compute the published conductivities under a reading.

    Parameters
    ----------
    reading : Reading
        How the formulas are read.
    examples : iterable of Example
        What was published.

    Returns
    -------
    Outcome
        Figures, the largest gap, and whether the ranking is the published one.
    """
    computed: list[float] = []
    gap, ranked = 0.0, True
    for example, values in _values(reading, examples):
        published = list(example.published.values())
        gap = max(
            gap, *(abs(c - p) if np.isfinite(c) else np.inf for c, p in zip(values, published, strict=True))
        )
        ranked = ranked and same_order(published, values)
        computed += [c if np.isfinite(c) else float("nan") for c in values]
    return Outcome(reading, tuple(computed), gap, ranked)


def _values(reading: Reading, examples: Iterable[Example]) -> Iterator[tuple[Example, list[float]]]:
    """Conductivities of each example; NaN where a dimension that they rest on is no number."""
    for example in examples:
        with np.errstate(all="ignore"):  # some readings divide by zero
            found = classify(example.evidence, example.knowledge, reading)
        spoilt = {label for label, p in found.properties.items() if np.isnan(p.dimension)}
        missing = np.isnan(found.interaction_dimensions)
        spoilt |= {label for (label, _), nan in zip(found.prototypes, missing, strict=True) if nan}
        values = found.conductivity
        yield example, [float("nan") if label in spoilt else values[label] for label in example.published]
