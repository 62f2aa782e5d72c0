"""How hypotheses about one outline stand against each other."""

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.primitives.agreement import Agreement

__all__ = ["LEAST_DEVIATION", "log_odds"]

DEVIATION_POWER = 2.5
"""How fast odds fall with the deviation, beside what it does to the fit (our own, tuned)."""

LEAST_DEVIATION = 0.2
"""Deviation that says nothing, as a share of the tolerance (our own)."""

UNBROKEN_POWER = 1.1
"""How fast odds fall where what is not seen of a primitive lies in several places (our own, tuned)."""


def log_odds(match: Agreement, tolerance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Logarithm of the odds of hypotheses, up to a constant of the outline (our own).

    ``1.1 log(unbroken) - 2.5 log(deviation)``, the deviation relative to the tolerance: what is hidden in one
    piece counts less against a hypothesis than what is missing here and there.

    Parameters
    ----------
    match : Agreement
        How well outlines and hypothesised primitives agree.
    tolerance : ndarray of float64, shape (B,)
        Of the outlines, px.

    Returns
    -------
    ndarray of float64, shape (B,)
        Higher for the better hypothesis.
    """
    deviation = np.hypot(match.deviation / tolerance, LEAST_DEVIATION)
    return UNBROKEN_POWER * np.log(np.maximum(match.unbroken, 1e-2)) - DEVIATION_POWER * np.log(deviation)
