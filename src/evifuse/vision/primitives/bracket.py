"""The bracket primitive, an arc that is open like a C: our own, the chapter leaves its construction out."""

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.primitives.agreement import Agreement
from evifuse.vision.primitives.fits import Fits
from evifuse.vision.primitives.hypothesis import Proposals

__all__ = ["bracket_belief", "propose"]

FULL_OPENING = 0.3
"""An arc that lacks this share of its ellipse in one piece is as open as a bracket gets (our own)."""


def bracket_belief(match: Agreement, tangency: NDArray[np.float64]) -> NDArray[np.float64]:
    """Belief in a bracket (our own).

    Product of fit, explained share, and opening: the longest run of the ellipse that is not seen, 0 if
    closed and 1 from 30 % of it on; the run must be the only one (the rest is seen), and at least a
    quarter of the ellipse must be seen for its fit to say anything.

    Parameters
    ----------
    match : Agreement
        How well outlines and fitted ellipses agree.
    tangency : ndarray of float64, shape (B,)
        How well the edge segments follow its direction, in [0, 1].

    Returns
    -------
    ndarray of float64, shape (B,)
        In [0, 1].
    """
    opening = np.minimum(1.0, match.opening / FULL_OPENING)
    one_piece = match.coverage / np.maximum(1 - match.opening, 1e-9)
    enough = np.minimum(1.0, match.coverage / 0.75) ** 2
    return tangency * match.fit * match.explained * opening * one_piece * enough


def propose(fits: Fits) -> Proposals:
    """Bracket hypotheses.

    Parameters
    ----------
    fits : Fits
        What is seen, and what was fitted to it.

    Returns
    -------
    Proposals
        Where an ellipse can be fitted.
    """
    ellipse, match = fits.ellipse, fits.ellipse.match
    return Proposals(
        kind="bracket",
        family="ellipse",
        proposed=ellipse.found,
        belief=bracket_belief(match, ellipse.tangency),
        shape=ellipse.shape,
        deviation=match.deviation,
        odds=ellipse.odds,
        terms={
            "fit": match.fit,
            "explained": match.explained,
            "opening": match.opening,
            "coverage": match.coverage,
            "tangency": ellipse.tangency,
        },
        geometry=ellipse.geometry,
    )
