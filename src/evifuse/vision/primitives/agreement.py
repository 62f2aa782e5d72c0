"""How well outlines and hypothesised primitives agree, both ways."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.primitives.outline import Outlines

__all__ = ["LEAST_TRUST", "MOST_TOLERANCES", "Agreement", "agreement"]

LEAST_TRUST = 0.02
"""Hypotheses that agree with the outline less than this are dropped at once (our own)."""

MOST_TOLERANCES = 2.5
"""A point that strays further than so many tolerances is not on the primitive at all (our own)."""


@dataclass(frozen=True, eq=False)
class Agreement:
    """How well outlines and hypothesised primitives agree (our own); each array has shape (B,).

    Parameters
    ----------
    fit : ndarray of float64
        ``exp(-(r / tolerance)^2 / 2)``, r the root mean square deviation of the nearest 90 % of the points.
    explained : ndarray of float64
        Share of the outline's points that lie near the primitive.
    coverage : ndarray of float64
        Share of the primitive that points of the outline are nearest to, in 32 parts.
    opening : ndarray of float64
        Longest run of the primitive that no point is nearest to, as a share of it.
    deviation : ndarray of float64
        Root mean square deviation of all points, each at most 2.5 tolerances, px.
    """

    fit: NDArray[np.float64]
    explained: NDArray[np.float64]
    coverage: NDArray[np.float64]
    opening: NDArray[np.float64]
    deviation: NDArray[np.float64]

    @property
    def trust(self) -> NDArray[np.float64]:
        """Share of the outline and of the primitive that account for each other, and how closely."""
        return self.fit * self.explained * self.coverage

    @property
    def unbroken(self) -> NDArray[np.float64]:
        """What is seen and the longest run that is not: 1 if the rest is hidden in one piece."""
        return np.minimum(1.0, self.coverage + self.opening)

    def where(self, choose: NDArray[np.bool_], other: "Agreement") -> "Agreement":
        """Agreement with one of two primitives.

        Parameters
        ----------
        choose : ndarray of bool, shape (B,)
            Where this one is meant.
        other : Agreement
            What is meant elsewhere.

        Returns
        -------
        Agreement
            Of both.
        """
        return Agreement(
            np.where(choose, self.fit, other.fit),
            np.where(choose, self.explained, other.explained),
            np.where(choose, self.coverage, other.coverage),
            np.where(choose, self.opening, other.opening),
            np.where(choose, self.deviation, other.deviation),
        )


def agreement(outlines: Outlines, distance: NDArray[np.float64], position: NDArray[np.float64]) -> Agreement:
    """Compare outlines with hypothesised primitives.

    Parameters
    ----------
    outlines : Outlines
        What is seen.
    distance : ndarray of float64, shape (B, 64)
        How far the points of each outline are from its primitive, px; NaN without one.
    position : ndarray of float64, shape (B, 64)
        Where on the primitive they are nearest to, as a share of its length, in [0, 1].

    Returns
    -------
    Agreement
        All terms but the deviation in [0, 1]; without a primitive nothing fits.
    """
    from evifuse.vision import _kernels_match

    terms = np.empty((5, len(distance)))
    _kernels_match.agree(distance, position, outlines.tolerance, MOST_TOLERANCES, *terms)
    return Agreement(*terms)
