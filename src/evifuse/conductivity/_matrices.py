"""What a knowledge base and known focal sets compile to: a few small matrices.

With the focal sets known, similarities and best matches are known. Write ``b`` for the masses, ``v`` for
``b`` followed by the means of tied best matches (linear in ``b``), and ``l = log v``. Then each divergence to
a prototype is ``const + A v + B l + C (v l)``, and the inner entropy of the evidence is of the same form less
the bilinear ``b' W l`` of its focal divergence. Appendix A.1 to A.6; the arrangement is our own.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import log as natural_log

import numpy as np
from numpy.typing import NDArray

from evifuse.belief import Frame, MassFunction
from evifuse.conductivity.entropy import TIE, core_entropy, similarity
from evifuse.conductivity.reading import Reading

__all__ = ["Matrices", "Parts", "Pattern", "matrices_for"]

Array = NDArray[np.float64]
Pattern = tuple[bool, ...]


@dataclass(frozen=True, eq=False)
class Matrices:
    """One pattern of F focal sets against P prototypes.

    Parameters
    ----------
    tied : ndarray of float64, shape (M, F)
        Each row averages the masses that tie as the best match of some focal set of a prototype.
    weights : ndarray of float64, shape (P + 1, 3 (F + M))
        Coefficients of ``[v, log v, v log v]``: the divergence to each prototype, and last the inner entropy.
    constants : ndarray of float64, shape (P + 1, 1)
        What does not depend on the masses.
    between : ndarray of float64, shape (F, F)
        ``W`` of the bilinear term ``b' W log b`` that the inner entropy lacks.
    """

    tied: Array
    weights: Array
    constants: Array
    between: Array


def matrices_for(like: MassFunction, prototypes: Sequence[MassFunction], reading: Reading) -> Matrices:
    """Matrices of one pattern: all the focal sets of ``like`` carry mass, and no others.

    Parameters
    ----------
    like : MassFunction
        Evidence with the F focal sets; its masses do not matter.
    prototypes : sequence of MassFunction
        P prototypes over the same frame.
    reading : Reading
        How the formulas are read.

    Returns
    -------
    Matrices
        Good for any positive masses on these focal sets.
    """
    terms = _Terms(len(like.focal_sets), reading)
    for row, x in enumerate(prototypes):
        similar = similarity(like.frame, like.focal_sets, x.focal_sets, reading)
        terms.against(row, similar, x.masses)
    within = similarity(like.frame, like.focal_sets, like.focal_sets, reading)
    scale = 1.0 if reading.log_base is None else 1.0 / natural_log(reading.log_base)
    weights, constants = terms.stacked(len(prototypes))
    gaps = scale * reading.pairs_within * (1.0 / within) * (1.0 - np.eye(len(within)))
    f, v = terms.count, len(terms.columns)
    weights[-1, 2 * v : 2 * v + f] = gaps.sum(axis=1) + scale * reading.entropy_sign
    constants[-1] = core_entropy(like, reading).ravel()[0]
    weights[:-1] *= scale
    constants[:-1] *= scale
    return Matrices(np.array(terms.columns[f:]).reshape(-1, f), weights, constants, gaps)


class _Terms:
    """Collects coefficients of ``v``, ``log v`` and ``v log v`` while the prototypes are gone through."""

    def __init__(self, count: int, reading: Reading) -> None:
        self.count = count
        self.reading = reading
        self.columns = [tuple(row) for row in np.eye(count).tolist()]
        self.entries: list[tuple[int, int, int, float]] = []  # prototype, kind, column, coefficient
        self.constants: dict[int, float] = {}

    def against(self, row: int, similar: Array, masses: Array) -> None:
        """Both directions of A.6 against one prototype: similarities ``(F, G)``, masses ``(G,)``."""
        for i in range(self.count):
            best, match = self._best(similar[i])
            self._add(row, i, float(match @ masses), 1.0 / best, from_evidence=True)
        for j, c in enumerate(masses.tolist()):
            best, match = self._best(similar[:, j])
            self._add(row, self._column(match), c, 1.0 / best, from_evidence=False)

    def _best(self, similar: Array) -> tuple[float, Array]:
        best = float(similar.max())
        match = similar >= best - TIE
        if self.reading.ties == "first":
            match = match & (np.cumsum(match) == 1)
        return best, match / match.sum()

    def _column(self, match: Array) -> int:
        key = tuple(match.tolist())
        if key not in self.columns:
            self.columns.append(key)
        return self.columns.index(key)

    def _add(self, row: int, column: int, m: float, weight: float, *, from_evidence: bool) -> None:
        """A term between ``v[column]`` and the constant ``m``, in either form of A.6."""
        log_m = natural_log(m)
        linear, log, both, constant = -log_m, -m, 1.0, m * log_m
        if self.reading.divergence == "printed":
            linear, log, both, constant = (
                (-log_m, 0.0, 1.0, 0.0) if from_evidence else (0.0, -m, 0.0, m * log_m)
            )
        for kind, value in enumerate((linear, log, both)):
            self.entries.append((row, kind, column, weight * value))
        self.constants[row] = self.constants.get(row, 0.0) + weight * constant

    def stacked(self, prototypes: int) -> tuple[Array, Array]:
        """Coefficients as one matrix, with a last row left for the inner entropy."""
        weights = np.zeros((prototypes + 1, 3, len(self.columns)))
        for row, kind, column, value in self.entries:
            weights[row, kind, column] += value
        constants = np.zeros((prototypes + 1, 1))
        for row, value in self.constants.items():
            constants[row] = value
        return weights.reshape(prototypes + 1, -1), constants


@dataclass(frozen=True, eq=False)
class Parts:
    """What does not depend on the masses. Arrays have a row for each of the P prototypes.

    Parameters
    ----------
    frame : Frame
        Frame of evidence and prototypes.
    prototypes : tuple of MassFunction
        The prototypes.
    reading : Reading
        How the formulas are read.
    met : ndarray of int64, shape (F',)
        Focal sets as they meet the prototypes: under a nominal commitment the frame comes last.
    whole : ndarray of bool, shape (F,)
        Which focal set of the evidence is the frame.
    inner : ndarray of float64, shape (P, 1)
        Inner entropies of the prototypes.
    top : ndarray of float64, shape (P, 1)
        Dimensions of their aggregates: the branch points.
    capacity : ndarray of float64, shape (P, 1)
        Capacities of their aggregates.
    members : ndarray of bool, shape (C, P)
        Which prototype belongs to which class.
    """

    frame: Frame
    prototypes: tuple[MassFunction, ...]
    reading: Reading
    met: NDArray[np.int64]
    whole: NDArray[np.bool_]
    inner: Array
    top: Array
    capacity: Array
    members: NDArray[np.bool_]
    _made: dict[Pattern, Matrices] = field(default_factory=dict[Pattern, Matrices])

    def matrices(self, pattern: Pattern) -> Matrices:
        """Matrices for the cases in which just these of the met focal sets carry mass.

        Parameters
        ----------
        pattern : tuple of bool
            One for each met focal set.

        Returns
        -------
        Matrices
            Made once and remembered.
        """
        if pattern not in self._made:
            sets = self.met[np.array(pattern)]
            like = MassFunction.trusted(self.frame, sets, np.full(len(sets), 1.0 / len(sets)))
            self._made[pattern] = matrices_for(like, self.prototypes, self.reading)
        return self._made[pattern]
