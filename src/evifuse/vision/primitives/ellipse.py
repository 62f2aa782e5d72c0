"""The ellipse primitive: our own, the chapter leaves it out."""

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.primitives.agreement import Agreement
from evifuse.vision.primitives.fits import Fits
from evifuse.vision.primitives.hypothesis import Proposals

__all__ = ["ellipse_belief", "propose"]


def ellipse_belief(match: Agreement, tangency: NDArray[np.float64]) -> NDArray[np.float64]:
    """Belief in an ellipse (our own).

    Product of fit (how near the points are), explained share (how many points are near), arc coverage (how
    much of the ellipse is seen) and tangency (how well the edge segments follow its direction).

    Parameters
    ----------
    match : Agreement
        How well outlines and fitted ellipses agree.
    tangency : ndarray of float64, shape (B,)
        See `tangency_of`, in [0, 1].

    Returns
    -------
    ndarray of float64, shape (B,)
        In [0, 1].
    """
    return match.fit * match.explained * match.coverage * tangency


def propose(fits: Fits) -> Proposals:
    """Ellipse hypotheses.

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
        kind="ellipse",
        family="ellipse",
        proposed=ellipse.found,
        belief=ellipse_belief(match, ellipse.tangency),
        shape=ellipse.shape,
        deviation=match.deviation,
        odds=ellipse.odds,
        terms={
            "fit": match.fit,
            "explained": match.explained,
            "coverage": match.coverage,
            "tangency": ellipse.tangency,
        },
        geometry=ellipse.geometry,
    )
