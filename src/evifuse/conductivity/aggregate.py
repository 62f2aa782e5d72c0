"""Appendix A.7: aggregates of prototypes, one per class, and the knowledge base they make."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from evifuse.belief import Frame, MassFunction
from evifuse.conductivity.entropy import capacity, divergence, inner_entropy, ratio, within_set_entropy
from evifuse.conductivity.reading import Reading

__all__ = ["Aggregate", "AggregateProperties", "KnowledgeBase", "aggregate_properties"]


@dataclass(frozen=True)
class Aggregate:
    """A class of patterns: its label and its prototypes.

    Parameters
    ----------
    label : str
        Name of the class, for example ``rectangular``.
    prototypes : mapping of str to MassFunction
        Prototypes by name, each without batch dimensions and with positive masses.
    """

    label: str
    prototypes: dict[str, MassFunction]


@dataclass(frozen=True, eq=False)
class KnowledgeBase:
    """Classes of patterns over one frame, and how the formulas are to be read with them.

    Parameters
    ----------
    name : str
        Title, for messages.
    frame : Frame
        The hypotheses that the prototypes speak of.
    aggregates : tuple of Aggregate
        One per class, labels all different.
    reading : Reading
        The reading that the prototypes were made for.
    source : str
        Where the prototypes come from.
    """

    name: str
    frame: Frame
    aggregates: tuple[Aggregate, ...]
    reading: Reading
    source: str = ""

    @property
    def classes(self) -> tuple[str, ...]:
        """Labels of the classes."""
        return tuple(a.label for a in self.aggregates)


@dataclass(frozen=True)
class AggregateProperties:
    """Numbers of A.7 for one aggregate.

    Parameters
    ----------
    within_set_entropy : float
        ``H_w(Gamma)``.
    internal_divergence : float
        ``D(Gamma)``.
    inner_entropy : float
        ``H_in(Gamma) = H_w + D``.
    dimension : float
        ``H_w / H_in``; 1 for a single prototype under the sound reading.
    capacity : float
        ``1 / H_in``.
    """

    within_set_entropy: float
    internal_divergence: float
    inner_entropy: float
    dimension: float
    capacity: float


def aggregate_properties(aggregate: Aggregate, reading: Reading) -> AggregateProperties:
    """Entropies, dimension and capacity of an aggregate (A.7).

    Parameters
    ----------
    aggregate : Aggregate
        The prototypes of one class.
    reading : Reading
        How the formulas are read.

    Returns
    -------
    AggregateProperties
        The numbers.
    """
    prototypes = list(aggregate.prototypes.values())
    member = inner_entropy if reading.members == "inner" else within_set_entropy
    within = float(sum(float(member(x, reading)) for x in prototypes))
    internal = reading.pairs_between * float(
        sum(float(divergence(x, y, reading)) for x, y in combinations(prototypes, 2))
    )
    inner = within + internal
    dimension = float(ratio(np.array(within), np.array(inner)))
    return AggregateProperties(within, internal, inner, dimension, float(capacity(inner)))
