"""How much of the strokes of an object a hypothesised primitive accounts for."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.detect import Chain
from evifuse.vision.geometry import distances_to_polygon
from evifuse.vision.outlines import neighbours
from evifuse.vision.primitives import Outlines

__all__ = ["Strokes", "accounted_for", "strokes_of"]

SAMPLES = 96
"""So many points stand for the strokes of an object (our own)."""

REACH_TOLERANCES = 4.0
"""Strokes are accounted for within so many tolerances, plus 3 px: the other side of one is (our own)."""

Strokes = NDArray[np.float64]
"""Points at equal steps of all strokes that an outline is part of, shape (B, 96, 2), px; NaN for none."""


def strokes_of(chains: Sequence[Chain], outlines: Outlines) -> Strokes:
    """The strokes that each outline is part of.

    Parameters
    ----------
    chains : sequence of Chain
        Edges of the picture, px, of which the outlines are made.
    outlines : Outlines
        What is seen.

    Returns
    -------
    Strokes
        NaN where there are so many edges that they may belong to anything.
    """
    groups = neighbours(chains)
    if not groups:
        return np.full((len(outlines.links), SAMPLES, 2), np.nan)
    found = np.full((len(groups) + 1, SAMPLES, 2), np.nan)
    of_chain = np.full(len(chains), len(groups))
    for k, group in enumerate(groups):
        points = np.concatenate([chains[i] for i in group])
        found[k] = points[np.linspace(0, len(points) - 1, SAMPLES).astype(np.intp)]
        of_chain[group] = k
    owner = np.repeat(of_chain, [len(c) for c in chains])
    code = _code(np.concatenate(chains))
    order = np.argsort(code, kind="stable")
    first = _code(np.array([link.points[0] for link in outlines.links]))
    return found[owner[order[np.searchsorted(code[order], first)]]]


def accounted_for(
    strokes: Strokes, shape: NDArray[np.float64], tolerance: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Share of the strokes that lie near a primitive (our own).

    Parameters
    ----------
    strokes : Strokes
        Of each outline.
    shape : ndarray of float64, shape (B, K, 2)
        Outline of the primitive as a polygon, px; NaN for none.
    tolerance : ndarray of float64, shape (B,)
        Of the outlines, px.

    Returns
    -------
    ndarray of float64, shape (B,)
        In [0, 1]; 1 where the strokes are not known, or there is no primitive.
    """
    share = np.ones(len(shape))
    known = np.flatnonzero(~np.isnan(strokes[:, 0, 0]) & ~np.isnan(shape[:, 0, 0]))
    distance, _ = distances_to_polygon(strokes[known], shape[known])
    share[known] = (distance <= REACH_TOLERANCES * tolerance[known, None] + 3).mean(axis=1)
    return share


def _code(points: NDArray[np.float64]) -> NDArray[np.int64]:
    """One number per pixel."""
    whole = points.astype(np.int64)
    return whole[:, 0] * 65536 + whole[:, 1]
