"""What would change if one prototype were on the other side of its branch point, where A.8 makes a jump.

Our own. Crossing means that one interaction dimension moves just past a branch point, everything else equal.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.conductivity.classify import Classification, normalised_belief
from evifuse.conductivity.reading import Reading

__all__ = ["Crossings", "Pool", "cross", "decide"]

Array = NDArray[np.float64]
Counts = NDArray[np.int64]


class Pool:
    """Conductivities of prototypes pooled into those of their classes (A.8 v).

    Parameters
    ----------
    found : Classification
        Gives the prototypes, class by class.
    reading : Reading
        Gives the pooling.
    """

    def __init__(self, found: Classification, reading: Reading) -> None:
        labels = [label for label, _ in found.prototypes]
        self.home = np.array([found.classes.index(label) for label in labels], dtype=np.int64)
        self.sizes = np.bincount(self.home, minlength=len(found.classes))
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


def cross(
    found: Classification, sigma: Array, committed: Array, pool: Pool, reading: Reading, near: float
) -> Crossings:
    """Let every prototype that sits near a branch point cross it, one at a time.

    Parameters
    ----------
    found : Classification
        Of a batch of shape (N,).
    sigma : ndarray of float64, shape (N, P)
        Conductivities of the prototypes, all finite.
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
    close, other = _other_side(found, reading, near)
    case, prototype = np.nonzero(close)
    moved = sigma[case]
    scale = 1.0 if reading.commitment is None else committed[case]
    moved[np.arange(len(case)), prototype] = other[case, prototype] * scale
    before, after = np.maximum(pool.classes(sigma[case]), 0.0), np.maximum(pool.classes(moved), 0.0)
    ignorance = 1.0 - committed[case] if reading.keep_ignorance else 0.0
    beliefs = [normalised_belief(found.classes, s, ignorance).masses for s in (before, after)]
    change = 0.5 * np.abs(beliefs[1] - beliefs[0]).sum(axis=-1)
    return Crossings(case, prototype, change, decide(before) != decide(after))


def _other_side(found: Classification, reading: Reading, near: float) -> tuple[NDArray[np.bool_], Array]:
    """Whether each prototype is near a branch point that it could cross, and its conductivity just past it.

    The first branch point is ``dim(Gamma)``, from strong to weak; the second lies where the projection is
    ``dim(Gamma)``, from weak to nothing. With a capacity of 1 or more there is no weak branch between them.
    """
    dims, seen = found.interaction_dimensions, found.projected_dimensions
    top = np.array([found.properties[label].dimension for label, _ in found.prototypes])
    cap = np.array([found.properties[label].capacity for label, _ in found.prototypes])
    if not reading.projection:
        return np.zeros(dims.shape, dtype=np.bool_), dims
    bounded = reading.divergence == "symmetric" and reading.entropy_sign == -1
    highest = 1.0 if bounded else np.inf
    width = near * np.abs(top)
    below = found.branches == 0
    first = (np.abs(dims - top) <= width) & (~below | (top < highest))
    past_first = np.where(cap < 1, top * cap, 0.0)
    blocked = found.branches == 2
    second = ~below & (cap < 1) & (np.abs(seen - top) <= width) & (blocked | (top < highest * cap))
    nearer_second = second & ~(first & (np.abs(dims - top) <= np.abs(seen - top)))
    upper = np.where(nearer_second & ~blocked, 0.0, top)
    other = np.where(below, past_first, upper)
    return (first | second) & (reading.smoothing <= width), other
