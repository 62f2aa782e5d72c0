"""Any number of sources into one, by the name of the rule, and what each rule promises."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import reduce
from types import MappingProxyType
from typing import Any

import numpy as np

from evifuse.belief._joint import joint
from evifuse.belief._sources import checked
from evifuse.belief.average import average, murphy
from evifuse.belief.cautious import bold, bold_of, cautious, cautious_of
from evifuse.belief.combine import (
    Combination,
    conjunctive,
    dempster,
    disjunctive,
    dubois_prade,
    pcr5,
    yager,
)
from evifuse.belief.mass import MassFunction
from evifuse.belief.pcr6 import pcr6
from evifuse.errors import MassError

__all__ = ["RULES", "CombinationRule", "combine"]

Sources = list[MassFunction]


@dataclass(frozen=True)
class CombinationRule:
    """What a rule of combination promises.

    Parameters
    ----------
    function : callable
        The rule itself: of two sources, or of an iterable of them if ``takes_many``.
    associative : bool
        Two at a time, in any grouping, is the same as all at once.
    commutative : bool
        The order of two sources doesn't matter (that of three does, unless the rule is associative or
        ``takes_many``).
    idempotent : bool
        A source combined with itself is itself.
    source : str
        Who published it.
    takes_many : bool
        The rule is defined for any number of sources at once.
    fold : callable, optional
        How an associative rule takes a list of checked sources.
    """

    function: Callable[..., Combination]
    associative: bool
    commutative: bool
    idempotent: bool
    source: str
    takes_many: bool = False
    fold: Callable[[Sources], Combination] | None = None


def _disjunctive(sources: Sources) -> Combination:
    mass = reduce(lambda a, b: disjunctive(a, b).mass, sources)
    return Combination(mass, np.zeros(mass.batch))


def _conjunctive(sources: Sources) -> Combination:
    return joint(sources, normalise=False)


def _dempster(sources: Sources) -> Combination:
    return joint(sources, normalise=True)


RULES: Mapping[str, CombinationRule] = MappingProxyType(
    {
        "conjunctive": CombinationRule(conjunctive, True, True, False, "Smets 1990", fold=_conjunctive),
        "dempster": CombinationRule(
            dempster, True, True, False, "Dempster 1967, Shafer 1976", fold=_dempster
        ),
        "disjunctive": CombinationRule(
            disjunctive, True, True, False, "Dubois and Prade 1986, Smets 1993", fold=_disjunctive
        ),
        "cautious": CombinationRule(cautious, True, True, True, "Denoeux 2008", fold=cautious_of),
        "bold": CombinationRule(bold, True, True, True, "Denoeux 2008", fold=bold_of),
        "yager": CombinationRule(yager, False, True, False, "Yager 1987"),
        "dubois_prade": CombinationRule(dubois_prade, False, True, False, "Dubois and Prade 1988"),
        "pcr5": CombinationRule(pcr5, False, True, False, "Smarandache and Dezert 2005"),
        "pcr6": CombinationRule(pcr6, False, True, False, "Martin and Osswald 2006", takes_many=True),
        "average": CombinationRule(average, False, True, True, "Murphy 2000", takes_many=True),
        "murphy": CombinationRule(murphy, False, True, False, "Murphy 2000", takes_many=True),
    }
)
"""Every rule by name; the names are what `combine` takes."""


def combine(
    many: Iterable[MassFunction], rule: str = "dempster", *, order_matters: bool = False
) -> Combination:
    """Any number of sources into one.

    Associative rules, and those that are defined for any number of sources, give the same in every order. The
    others (``yager``, ``dubois_prade``, ``pcr5``) are defined for two: of three or more, each order gives
    another result, so that has to be asked for, and then goes from the first source to the last.

    Parameters
    ----------
    many : iterable of MassFunction
        One or more sources over one frame; batch dimensions broadcast. A batch is taken as a list along its
        first dimension.
    rule : str
        A name in `RULES`.
    order_matters : bool
        Accept that the order of the sources decides.

    Returns
    -------
    Combination
        The combination. Its conflict is the mass of the empty set in the conjunctive combination of all
        sources; it is 0 for ``disjunctive`` and ``bold``, where none arises, and what the cautious rule
        itself leaves on the empty set for ``cautious``. A thousand sources that contradict each other don't
        underflow.

    Raises
    ------
    FrameError
        If the frames differ.
    MassError
        If there are no sources, the rule is unknown, or it is not associative and the order of three or more
        sources was not said to matter.
    ConflictError
        If the rule is ``dempster`` and the sources contradict each other totally.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> frame = Frame(["rectangle", "triangle"])
    >>> combine([MassFunction.of(frame, {"rectangle": 0.5, frame: 0.5})] * 3).mass
    MassFunction(rectangle: 0.875, frame: 0.125)
    >>> RULES["yager"].associative
    False
    """
    known: Any = RULES.get(rule)
    if known is None:
        raise MassError(f"unknown rule {rule!r}: choose one of {', '.join(RULES)}")
    facts: CombinationRule = known
    sources = checked(many)
    if facts.takes_many:
        return facts.function(sources)
    if len(sources) == 1:
        only = sources[0]
        return joint(sources, normalise=True) if rule == "dempster" else _alone(only, rule)
    if facts.fold is not None:
        return facts.fold(sources)
    if len(sources) > 2 and not order_matters:
        raise MassError(
            f"{rule!r} is not associative: the order of {len(sources)} sources decides; say "
            "order_matters=True to take them first to last, or use 'pcr6', 'murphy' or 'average'"
        )
    mass = reduce(lambda a, b: facts.function(a, b).mass, sources)
    return Combination(mass, joint(sources, normalise=False).conflict)


def _alone(only: MassFunction, rule: str) -> Combination:
    conflict = only.where(only.focal_sets == 0)
    return Combination(only, np.zeros(only.batch) if rule in ("disjunctive", "bold") else conflict)
