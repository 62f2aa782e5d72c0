"""The circle primitive: our own, the chapter leaves its construction out."""

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.primitives.agreement import Agreement
from evifuse.vision.primitives.ellipse import ellipse_belief
from evifuse.vision.primitives.fits import Fits
from evifuse.vision.primitives.hypothesis import Proposals

__all__ = ["circle_belief", "propose"]


def circle_belief(
    match: Agreement, tangency: NDArray[np.float64], axis_ratio: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Belief in a circle (our own).

    The belief in the ellipse times the fourth power of its axis ratio: 0.8 leaves 0.41.

    Parameters
    ----------
    match : Agreement
        How well outlines and fitted ellipses agree.
    tangency : ndarray of float64, shape (B,)
        How well the edge segments follow its direction, in [0, 1].
    axis_ratio : ndarray of float64, shape (B,)
        Short axis over long axis, in (0, 1].

    Returns
    -------
    ndarray of float64, shape (B,)
        In [0, 1].
    """
    return ellipse_belief(match, tangency) * axis_ratio**4


def propose(fits: Fits) -> Proposals:
    """Circle hypotheses.

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
    ratio = ellipse.axes[:, 1] / ellipse.axes[:, 0]
    return Proposals(
        kind="circle",
        family="ellipse",
        proposed=ellipse.found,
        belief=circle_belief(match, ellipse.tangency, ratio),
        shape=ellipse.shape,
        deviation=match.deviation,
        odds=ellipse.odds,
        terms={
            "fit": match.fit,
            "explained": match.explained,
            "coverage": match.coverage,
            "tangency": ellipse.tangency,
            "axis_ratio": ratio**4,
        },
        geometry=lambda i: {
            "centre": ellipse.centre[i].tolist(),
            "radius": float(ellipse.axes[i].mean() / 2),
        },
    )
