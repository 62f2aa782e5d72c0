"""The registry of uncertainty measures: where each comes from, and what it satisfies."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from evifuse.belief import entropies as e
from evifuse.belief import uncertainty as u
from evifuse.belief.fractal import fractal_belief_entropy
from evifuse.belief.mass import MassFunction

__all__ = ["DESIDERATA", "MEASURES", "Measure"]

DESIDERATA: Mapping[str, str] = MappingProxyType(
    {
        "probability": "equals Shannon's entropy where all focal sets are single hypotheses",
        "set": "equals log|A| where one set A has all mass",
        "range": "stays within [0, log K] over K hypotheses",
        "subadditivity": "is at most the sum of both marginals' values, on a product frame",
        "additivity": "is that sum where the masses are the product of the marginals'",
        "monotonicity": "does not fall where the belief of no set rises",
    }
)
"""What a measure of total uncertainty should satisfy (Klir and Wierman 1999; Abellán and Masegosa 2008).

A measure of one kind of uncertainty alone, such as non-specificity, can't satisfy all of them."""


@dataclass(frozen=True)
class Measure:
    """An uncertainty measure and what is known of it.

    Parameters
    ----------
    name : str
        Its key in `MEASURES`.
    function : callable
        Takes a mass function and the base of the logarithm.
    source : str
        Who published it, and when.
    kind : str
        What it measures: ``nonspecificity``, ``conflict``, ``total`` or ``dimension``.
    unit : str
        ``bits`` to base 2, ``1`` for a ratio.
    desiderata : mapping of str to bool
        For each key of `DESIDERATA`, whether it holds.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> measure = MEASURES["deng"]
    >>> round(float(measure(MassFunction.vacuous(Frame(["a", "b"])))), 4), measure.source
    (1.585, 'Deng 2016')
    """

    name: str
    function: Callable[[MassFunction, float], NDArray[np.float64]]
    source: str
    kind: str
    unit: str
    desiderata: Mapping[str, bool]

    def __call__(self, m: MassFunction, base: float = 2.0) -> NDArray[np.float64]:
        """The measure of ``m``."""
        return self.function(m, base)


def _measure(
    name: str,
    function: Callable[[MassFunction, float], NDArray[np.float64]],
    source: str,
    kind: str,
    holds: str,
    unit: str = "bits",
) -> Measure:
    marks = {key: mark == "+" for key, mark in zip(DESIDERATA, holds, strict=True)}
    return Measure(name, function, source, kind, unit, MappingProxyType(marks))


_ALL = (
    # in the order of DESIDERATA: probability, set, range, subadditivity, additivity, monotonicity
    _measure("nonspecificity", u.nonspecificity, "Dubois and Prade 1985", "nonspecificity", "-+++++"),
    _measure("strife", u.strife, "Klir and Parviz 1992", "conflict", "+-+-+-"),
    _measure("discord", u.discord, "Klir and Ramer 1990", "conflict", "+-+-+-"),
    _measure("dissonance", u.dissonance, "Yager 1983", "conflict", "+-+-+-"),
    _measure("confusion", u.confusion, "Höhle 1982", "conflict", "+---+-"),
    _measure("deng", e.deng_entropy, "Deng 2016", "total", "+-----"),
    _measure("jirousek_shenoy", e.jirousek_shenoy_entropy, "Jiroušek and Shenoy 2018", "total", "+---+-"),
    _measure("pignistic", e.pignistic_entropy, "Jousselme et al. 2006", "total", "+++-+-"),
    _measure("fractal_belief", fractal_belief_entropy, "Zhou and Deng 2022", "total", "+-----"),
    _measure(
        "information_dimension",
        e.information_dimension,
        "after Qiang, Deng and Cheong 2022, read at finite size",
        "dimension",
        "---+--",  # subadditive: our own proof, in docs/uncertainty.md
        unit="1",
    ),
    _measure("belief_entropy", e.belief_entropy, "appendix A.1; Nguyen 1987", "conflict", "+---+-"),
    _measure("core_entropy", e.core_entropy, "appendix A.1", "conflict", "----+-"),
    _measure("within_set_entropy", e.within_set_entropy, "appendix A.1", "conflict", "----+-"),
)

MEASURES: Mapping[str, Measure] = MappingProxyType({measure.name: measure for measure in _ALL})
"""Every measure by name."""
