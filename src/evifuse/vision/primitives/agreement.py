"""How well outlines and hypothesised primitives agree, both ways."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.geometry import resample
from evifuse.vision.primitives.outline import POINTS, Outlines

__all__ = ["LEAST_TRUST", "Agreement", "agreement"]

LEAST_TRUST = 0.02
"""Hypotheses that agree with the outline less than this are dropped at once (our own)."""

SAMPLES = 64
"""So many points of a primitive are looked for in the outline (our own)."""


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
        Share of the primitive that has points of the outline near it.
    opening : ndarray of float64
        Longest run of the primitive without points near it, as a share of it.
    deviation : ndarray of float64
        Root mean square deviation of all points, each at most four tolerances, px.
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


def agreement(outlines: Outlines, shape: NDArray[np.float64], distance: NDArray[np.float64]) -> Agreement:
    """Compare outlines with hypothesised primitives.

    Parameters
    ----------
    outlines : Outlines
        What is seen.
    shape : ndarray of float64, shape (B, K, 2)
        Outline of each primitive as a polygon, px.
    distance : ndarray of float64, shape (B, 64)
        How far the points of each outline are from its primitive, px.

    Returns
    -------
    Agreement
        All terms but the deviation in [0, 1]; where the points stray so far that the trust is less than 2 %
        whatever is covered, or the shape is NaN, nothing counts as covered.
    """
    tolerance = outlines.tolerance
    reach = 3 * tolerance
    ordered = np.sort(np.nan_to_num(distance, nan=np.inf), axis=1)
    fit = np.exp(-0.5 * (ordered[:, : int(0.9 * POINTS)] ** 2).mean(axis=1) / tolerance**2)
    explained = (ordered <= reach[:, None]).mean(axis=1)
    rows = np.flatnonzero(fit * explained >= LEAST_TRUST)
    gap = _nearest(resample(shape[rows], SAMPLES), outlines.points[rows])
    seen = gap <= (reach + outlines.around / POINTS / 2)[rows, None]
    coverage, opening = np.zeros(len(fit)), np.ones(len(fit))
    coverage[rows], opening[rows] = seen.mean(axis=1), _longest_run(~seen) / SAMPLES
    deviation = np.sqrt((np.minimum(ordered, 4 * tolerance[:, None]) ** 2).mean(axis=1))
    return Agreement(fit, explained, coverage, opening, deviation)


def _nearest(samples: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance of each sample from the nearest point, per outline."""
    middle = points.mean(axis=1, keepdims=True)
    a, b = samples - middle, points - middle
    squared = (b**2).sum(axis=2)[:, None, :] - 2 * (a @ b.swapaxes(1, 2))
    return np.sqrt(np.maximum(squared.min(axis=2) + (a**2).sum(axis=2), 0.0))


def _longest_run(mask: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Longest run of True in each row, which is a circle."""
    count = mask.shape[1]
    place = np.arange(2 * count)
    blocked = np.where(np.tile(mask, 2), -1, place)
    return np.minimum((place - np.maximum.accumulate(blocked, axis=1)).max(axis=1), count)
