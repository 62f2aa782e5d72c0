"""What would change if one prototype were on the other side of its branch point, where A.8 makes a jump.

Our own. Crossing means that one interaction dimension moves just past a branch point, everything else equal.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.belief import MassFunction
from evifuse.conductivity.aggregate import KnowledgeBase
from evifuse.conductivity.classify import BRANCH_TOLERANCE, classify, normalised_belief
from evifuse.conductivity.compiled import compile as compile_knowledge
from evifuse.conductivity.reading import Reading
from evifuse.errors import KnowledgeError

__all__ = ["Crossings", "Met", "Pool", "cross", "decide", "ready_to_meet"]

Array = NDArray[np.float64]
Counts = NDArray[np.int64]


@dataclass(frozen=True)
class Met:
    """A batch of evidence against every prototype.

    Parameters
    ----------
    classes : tuple of str
        The C class labels.
    prototypes : tuple of (str, str)
        Class and name of each of the P prototypes, class by class.
    top : ndarray of float64, shape (P,)
        ``dim(Gamma)`` of each one's class, the branch point.
    capacity : ndarray of float64, shape (P,)
        ``cap(Gamma)`` of each one's class.
    dimensions : ndarray of float64, shape (N, P)
        ``dim(Y; X_i)``.
    sigma : ndarray of float64, shape (N, P)
        Conductivities, 0 where they are undefined.
    """

    classes: tuple[str, ...]
    prototypes: tuple[tuple[str, str], ...]
    top: Array
    capacity: Array
    dimensions: Array
    sigma: Array


def ready_to_meet(
    focal_sets: NDArray[np.int64], knowledge: KnowledgeBase, reading: Reading
) -> Callable[[MassFunction], Met]:
    """Make a knowledge base ready for evidence: compiled, or step by step where a reading divides by zero.

    Parameters
    ----------
    focal_sets : ndarray of int64, shape (F,)
        Focal sets of the evidence to come, of the knowledge base's frame.
    knowledge : KnowledgeBase
        The classes and their prototypes.
    reading : Reading
        How the formulas are read.

    Returns
    -------
    callable
        Lets a batch of shape (N,) on these focal sets meet every prototype.
    """
    compiled = None
    with suppress(KnowledgeError):
        compiled = compile_knowledge(knowledge, focal_sets, reading)

    def meet(evidence: MassFunction) -> Met:
        if compiled is not None:
            found = compiled
            dimensions = found.interaction_dimensions(evidence.masses)
            sigma = found.prototype_conductivities(evidence.masses)
        else:
            found = classify(evidence, knowledge, reading)
            dimensions, sigma = found.interaction_dimensions, found.prototype_conductivities
        properties = [found.properties[label] for label, _ in found.prototypes]
        top = np.array([p.dimension for p in properties])
        capacity = np.array([p.capacity for p in properties])
        sigma = np.nan_to_num(sigma, nan=0.0, posinf=0.0, neginf=0.0)
        return Met(found.classes, found.prototypes, top, capacity, dimensions, sigma)

    return meet


class Pool:
    """Conductivities of prototypes pooled into those of their classes (A.8 v).

    Parameters
    ----------
    met : Met
        Gives the prototypes, class by class.
    reading : Reading
        Gives the pooling.
    """

    def __init__(self, met: Met, reading: Reading) -> None:
        labels = [label for label, _ in met.prototypes]
        self.home = np.array([met.classes.index(label) for label in labels], dtype=np.int64)
        self.sizes = np.bincount(self.home, minlength=len(met.classes))
        self.starts = np.cumsum(self.sizes) - self.sizes
        self.mode = reading.pooling

    def best(self, sigma: Array) -> Array:
        """The best conductivity in each class.

        Parameters
        ----------
        sigma : ndarray of float64, shape (..., P)
            Conductivities of prototypes.

        Returns
        -------
        ndarray of float64, shape (..., C)
            Of each class.
        """
        return np.maximum.reduceat(sigma, self.starts, axis=-1)

    def classes(self, sigma: Array) -> Array:
        """The conductivity of each class.

        Parameters
        ----------
        sigma : ndarray of float64, shape (..., P)
            Conductivities of prototypes.

        Returns
        -------
        ndarray of float64, shape (..., C)
            Of each class.
        """
        if self.mode == "max":
            return self.best(sigma)
        total = np.add.reduceat(sigma, self.starts, axis=-1)
        return total / self.sizes if self.mode == "mean" else total


def decide(conductivities: Array) -> Counts:
    """Index of the class that conducts best, -1 where nothing conducts.

    Parameters
    ----------
    conductivities : ndarray of float64, shape (..., C)
        Of each class.

    Returns
    -------
    ndarray of int64, shape (...)
        The decisions.
    """
    return np.where(conductivities.max(axis=-1) > 0, conductivities.argmax(axis=-1), -1)


@dataclass(frozen=True)
class Crossings:
    """Pairs of an input and a prototype near a branch point, and what its crossing would do.

    Parameters
    ----------
    case : ndarray of int64, shape (M,)
        Which input.
    prototype : ndarray of int64, shape (M,)
        Which prototype.
    change : ndarray of float64, shape (M,)
        How much belief would move, in [0, 1].
    flips : ndarray of bool, shape (M,)
        Whether the decision would be another.
    """

    case: Counts
    prototype: Counts
    change: Array
    flips: NDArray[np.bool_]


def cross(met: Met, committed: Array, pool: Pool, reading: Reading, near: float) -> Crossings:
    """Let every prototype that sits near a branch point cross it, one at a time.

    Parameters
    ----------
    met : Met
        Evidence and prototypes, a batch of shape (N,).
    committed : ndarray of float64, shape (N,)
        Mass of the evidence off the frame.
    pool : Pool
        How prototypes make a class.
    reading : Reading
        How the formulas are read.
    near : float
        What counts as near, as a share of ``dim(Gamma)``.

    Returns
    -------
    Crossings
        In the order of the inputs.
    """
    close, other = _other_side(met, reading, near)
    case, prototype = np.nonzero(close)
    moved = met.sigma[case]
    scale = 1.0 if reading.commitment is None else committed[case]
    moved[np.arange(len(case)), prototype] = other[case, prototype] * scale
    before, after = (np.maximum(pool.classes(sigma), 0.0) for sigma in (met.sigma[case], moved))
    ignorance = 1.0 - committed[case] if reading.keep_ignorance else 0.0
    beliefs = [normalised_belief(met.classes, s, ignorance).masses for s in (before, after)]
    change = 0.5 * np.abs(beliefs[1] - beliefs[0]).sum(axis=-1)
    return Crossings(case, prototype, change, decide(before) != decide(after))


def _other_side(met: Met, reading: Reading, near: float) -> tuple[NDArray[np.bool_], Array]:
    """Whether each prototype is near a branch point that it could cross, and its conductivity just past it.

    The first branch point is ``dim(Gamma)``, from strong to weak; the second lies where the projection is
    ``dim(Gamma)``, from weak to nothing. With a capacity of 1 or more there is no weak branch between them.
    """
    dims, top, cap = met.dimensions, met.top, met.capacity
    if not reading.projection:
        return np.zeros(dims.shape, dtype=np.bool_), dims
    seen = dims * cap
    bounded = reading.divergence == "symmetric" and reading.entropy_sign == -1
    highest = 1.0 if bounded else np.inf
    width = near * np.abs(top)
    below = dims <= top + BRANCH_TOLERANCE
    blocked = ~below & ~(seen <= top)
    first = (np.abs(dims - top) <= width) & (~below | (top < highest))
    past_first = np.where(cap < 1, top * cap, 0.0)
    second = ~below & (cap < 1) & (np.abs(seen - top) <= width) & (blocked | (top < highest * cap))
    nearer_second = second & ~(first & (np.abs(dims - top) <= np.abs(seen - top)))
    upper = np.where(nearer_second & ~blocked, 0.0, top)
    other = np.where(below, past_first, upper)
    return (first | second) & (reading.smoothing <= width), other
