"""How a batch of evidence meets a knowledge base: idle prototypes, missing decisions, inputs near a jump.

The projection rule of A.8 makes conductivity jump where an interaction dimension passes the branch point, so
a small change of the evidence can turn a decision over there. The diagnosis itself is our own.
"""

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.belief import MassFunction, on_frame
from evifuse.conductivity.aggregate import KnowledgeBase
from evifuse.conductivity.crossing import Crossings, Met, Pool, cross, decide, ready_to_meet
from evifuse.conductivity.reading import Reading
from evifuse.errors import KnowledgeError

__all__ = ["CONTRIBUTION", "MATTERS", "Diagnosis", "diagnose"]

CONTRIBUTION = 0.01
"""Share of its class's conductivity from which on a prototype counts as firing."""

MATTERS = 0.01
"""Change of belief from which on a crossing matters."""

CHUNK = 32_768
"""Cases that are looked at together, to bound the memory."""

EQUAL = 1.0 - 1e-12
"""Conductivities this close to the best one are equally good."""

Array = NDArray[np.float64]
Counts = NDArray[np.int64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Diagnosis:
    """What happened when a batch of evidence met a knowledge base.

    Parameters
    ----------
    reading : Reading
        How the formulas were read.
    near : float
        What counts as near a branch point, as a share of ``dim(Gamma)``.
    classes : tuple of str
        The C class labels.
    prototypes : tuple of (str, str)
        Class and name of each of the P prototypes.
    cases : int
        Number of inputs.
    conducts : ndarray of int64, shape (P,)
        Inputs that the prototype conducts at all.
    best_of_class : ndarray of int64, shape (P,)
        Inputs that no other prototype of the class conducts better; equals count together.
    best_of_all : ndarray of int64, shape (P,)
        The same among the prototypes of all classes.
    fires : ndarray of int64, shape (P,)
        Inputs for which it is the best of its class or, where conductivities are summed or averaged, gives at
        least a hundredth of what the class conducts.
    decisive : ndarray of int64, shape (P,)
        Inputs whose decision would be another if this prototype conducted nothing.
    crossings : ndarray of int64, shape (P,)
        Inputs for which this prototype sits near a branch point and its crossing matters.
    decided : ndarray of int64, shape (C,)
        Inputs decided for each class.
    nothing : int
        Inputs that conduct into nothing at all.
    near_branch : ndarray of bool, shape (...)
        Whether a prototype sits near a branch point where its crossing matters: it would change the decision,
        or the belief over the classes by a hundredth or more.
    change : ndarray of float64, shape (...)
        How much belief would move to other classes if one such prototype crossed, in [0, 1]; the largest.
    flips : ndarray of bool, shape (...)
        Whether one such crossing would change the decision.
    crossing : ndarray of int64, shape (...)
        Index of the prototype whose crossing would change most; -1 where none is near.
    """

    reading: Reading
    near: float
    classes: tuple[str, ...]
    prototypes: tuple[tuple[str, str], ...]
    cases: int
    conducts: Counts
    best_of_class: Counts
    best_of_all: Counts
    fires: Counts
    decisive: Counts
    crossings: Counts
    decided: Counts
    nothing: int
    near_branch: Flags
    change: Array
    flips: Flags
    crossing: Counts

    @property
    def never_fire(self) -> tuple[tuple[str, str], ...]:
        """Prototypes that no input makes fire: they could be left out or are in the wrong place."""
        return tuple(p for p, count in zip(self.prototypes, self.fires, strict=True) if count == 0)

    @property
    def never_decided(self) -> tuple[str, ...]:
        """Classes that no input is decided for."""
        return tuple(label for label, count in zip(self.classes, self.decided, strict=True) if count == 0)

    def to_json(self, worst: int = 10) -> dict[str, Any]:
        """The diagnosis as plain values; of the inputs near a branch point, those that would change most.

        Parameters
        ----------
        worst : int
            How many single inputs to list.

        Returns
        -------
        dict
            Ready for JSON. Inputs are numbered from 0, in the order of the flattened batch.
        """
        counts = ("conducts", "best_of_class", "best_of_all", "fires", "decisive", "crossings")
        change, flips, crossing = self.change.ravel(), self.flips.ravel(), self.crossing.ravel()
        order = np.argsort(-change, kind="stable")[: min(worst, int(self.near_branch.sum()))]
        return {
            "cases": self.cases,
            "reading": asdict(self.reading),
            "near": self.near,
            "prototypes": [
                {"class": label, "prototype": name, **{key: int(getattr(self, key)[i]) for key in counts}}
                for i, (label, name) in enumerate(self.prototypes)
            ],
            "never_fire": ["/".join(p) for p in self.never_fire],
            "decided": dict(zip(self.classes, self.decided.tolist(), strict=True)),
            "never_decided": list(self.never_decided),
            "nothing": self.nothing,
            "near_branch": int(self.near_branch.sum()),
            "flips": int(flips.sum()),
            "worst": [
                {
                    "case": int(n),
                    "prototype": "/".join(self.prototypes[crossing[n]]),
                    "change": float(change[n]),
                    "flips": bool(flips[n]),
                }
                for n in order
            ],
        }


def diagnose(
    evidence: MassFunction, knowledge: KnowledgeBase, reading: Reading | None = None, *, near: float = 0.05
) -> Diagnosis:
    """Which prototypes work, which classes are decided, and which inputs sit near a jump (our own).

    A branch point is ``dim(Gamma)``, between the strong and the weak branch of A.8, and the dimension whose
    projection is ``dim(Gamma)``, between the weak branch and nothing. Crossing means that one interaction
    dimension moves just past it. Readings without projection have no branch point, a class of one prototype
    none that can be passed under the sound reading, and a fade (``Reading.smoothing``) that is wider than
    ``near`` is no jump any more.

    Parameters
    ----------
    evidence : MassFunction
        Over the knowledge base's frame or some of its hypotheses, batch shape ``(...)``.
    knowledge : KnowledgeBase
        The classes and their prototypes.
    reading : Reading, optional
        How the formulas are read; the knowledge base's own by default.
    near : float
        What counts as near a branch point, as a share of ``dim(Gamma)``.

    Returns
    -------
    Diagnosis
        Counts for the batch, and what would change for each input.

    Raises
    ------
    FrameError
        If the evidence is about a hypothesis that the knowledge base's frame lacks.
    KnowledgeError
        If ``near`` is not a share.

    Examples
    --------
    >>> from evifuse.knowledge import load_knowledge
    >>> knowledge = load_knowledge("shape")
    >>> masses = [[0.9, 0.1, 0.0], [0.0, 0.2, 0.8]]
    >>> found = diagnose(MassFunction(knowledge.frame, ["triangle", "ellipse", 63], masses), knowledge)
    >>> found.never_decided
    ('rectangular',)
    """
    if not 0 < near < 1:
        raise KnowledgeError(f"diagnose: near must be a share between 0 and 1, not {near!r}")
    reading = reading or knowledge.reading
    shared = on_frame(evidence.to("shared"), knowledge.frame)
    flat = MassFunction.trusted(
        shared.frame, shared.focal_sets, shared.masses.reshape(-1, shared.masses.shape[-1])
    )
    with np.errstate(all="ignore"):  # the printed reading may divide by zero: that conducts nothing
        meet = ready_to_meet(flat.focal_sets, knowledge, reading)
        parts = [_part(flat[rows], meet, reading, near) for rows in _chunks(len(flat))]
    whole = {key: [part[key] for part in parts] for key in parts[0]}
    sums = {key: np.sum(whole.pop(key), axis=0) for key in list(whole) if key in _SUMMED}
    each = {key: np.concatenate(values).reshape(evidence.batch) for key, values in whole.items()}
    nothing = int(sums.pop("nothing")[0])
    prototypes = tuple((a.label, name) for a in knowledge.aggregates for name in a.prototypes)
    return Diagnosis(reading, near, knowledge.classes, prototypes, len(flat), nothing=nothing, **sums, **each)


_SUMMED = (
    "conducts",
    "best_of_class",
    "best_of_all",
    "fires",
    "decisive",
    "crossings",
    "decided",
    "nothing",
)


def _chunks(count: int) -> Iterator[slice]:
    return (slice(start, start + CHUNK) for start in range(0, max(count, 1), CHUNK))


def _part(
    evidence: MassFunction, meet: Callable[[MassFunction], Met], reading: Reading, near: float
) -> dict[str, NDArray[Any]]:
    """Everything of one chunk of inputs: counts to be added up, and arrays over the inputs."""
    met = meet(evidence)
    pool = Pool(met, reading)
    committed = 1.0 - evidence.where(evidence.focal_sets == evidence.frame.full)
    crossed = cross(met, committed, pool, reading, near)
    return {**_counts(met, pool), **_near(crossed, *met.sigma.shape)}


def _counts(met: Met, pool: Pool) -> dict[str, Counts]:
    """How often each prototype conducts, is the best, fires and decides; how often each class is decided."""
    sigma = met.sigma
    decisions = decide(pool.classes(sigma))
    best = pool.best(sigma)[:, pool.home]
    conducts = sigma > 0
    of_class = conducts & (sigma >= best * EQUAL)
    share = sigma / np.add.reduceat(np.maximum(sigma, 0.0), pool.starts, axis=-1)[:, pool.home]
    fires = of_class if pool.mode == "max" else of_class | (share >= CONTRIBUTION)
    decisive = np.zeros(sigma.shape[1], dtype=np.int64)
    for i, home in enumerate(pool.home):
        without = sigma[(decisions == home) & conducts[:, i]]
        without[:, i] = 0.0
        decisive[i] = np.sum(decide(pool.classes(without)) != home)
    return {
        "conducts": conducts.sum(axis=0),
        "best_of_class": of_class.sum(axis=0),
        "best_of_all": (of_class & (sigma >= best.max(axis=1, keepdims=True) * EQUAL)).sum(axis=0),
        "fires": fires.sum(axis=0),
        "decisive": decisive,
        "decided": np.bincount(decisions[decisions >= 0], minlength=len(met.classes)),
        "nothing": np.count_nonzero(decisions < 0, keepdims=True),
    }


def _near(crossed: Crossings, cases: int, prototypes: int) -> dict[str, NDArray[Any]]:
    """For each input the crossing that would change most, among those that matter."""
    matters = crossed.flips | (crossed.change >= MATTERS)
    case, prototype = crossed.case[matters], crossed.prototype[matters]
    order = np.argsort(crossed.change[matters], kind="stable")  # the largest is written last
    change, crossing = np.zeros(cases), np.full(cases, -1)
    change[case[order]] = crossed.change[matters][order]
    crossing[case[order]] = prototype[order]
    flips = np.zeros(cases, dtype=np.bool_)
    flips[crossed.case[crossed.flips]] = True
    return {
        "crossings": np.bincount(prototype, minlength=prototypes),
        "near_branch": crossing >= 0,
        "change": change,
        "flips": flips,
        "crossing": crossing,
    }
