"""The bracket primitive, an arc that is open like a C: our own, the chapter leaves its construction out."""

from evifuse.vision.primitives.base import Agreement, Hypothesis, Outline
from evifuse.vision.primitives.ellipse import fit_ellipse

__all__ = ["bracket_belief", "propose"]

FULL_OPENING = 0.3
"""An arc that lacks this share of its ellipse in one piece is as open as a bracket gets (our own)."""


def bracket_belief(match: Agreement, tangency: float) -> float:
    """Belief in a bracket (our own).

    Product of fit, explained share, and opening: the longest run of the ellipse that is not seen, 0 if
    closed and 1 from 30 % of it on; the run must be the only one (the rest is seen), and at least a
    quarter of the ellipse must be seen for its fit to say anything.

    Parameters
    ----------
    match : Agreement
        How well the outline and the fitted ellipse agree.
    tangency : float
        How well the edge segments follow its direction, in [0, 1].

    Returns
    -------
    float
        In [0, 1].
    """
    opening = min(1.0, match.opening / FULL_OPENING)
    rest = 1 - match.opening
    one_piece = match.coverage / rest if rest > 0 else 0.0
    return tangency * match.fit * match.explained * opening * one_piece * min(1.0, match.coverage / 0.75) ** 2


def propose(outline: Outline) -> Hypothesis | None:
    """Bracket hypothesis for an outline.

    Parameters
    ----------
    outline : Outline
        What is seen.

    Returns
    -------
    Hypothesis or None
        None if no ellipse can be fitted.
    """
    found = fit_ellipse(outline)
    if found is None:
        return None
    ellipse, match, tangency = found
    return Hypothesis(
        kind="bracket",
        belief=bracket_belief(match, tangency),
        geometry={
            "centre": list(ellipse.centre),
            "axes": list(ellipse.axes),
            "angle_rad": ellipse.angle_rad,
        },
        shape=ellipse.polygon(),
        deviation=match.deviation,
        curved=True,
        terms={
            "fit": match.fit,
            "explained": match.explained,
            "opening": match.opening,
            "coverage": match.coverage,
            "tangency": tangency,
        },
    )
