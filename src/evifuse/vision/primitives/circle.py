"""The circle primitive: our own, the chapter leaves its construction out."""

from evifuse.vision.primitives.base import Agreement, Hypothesis, Outline
from evifuse.vision.primitives.ellipse import ellipse_belief, fit_ellipse

__all__ = ["circle_belief", "propose"]


def circle_belief(match: Agreement, tangency: float, axis_ratio: float) -> float:
    """Belief in a circle (our own).

    The belief in the ellipse times the fourth power of its axis ratio: 0.8 leaves 0.41.

    Parameters
    ----------
    match : Agreement
        How well the outline and the fitted ellipse agree.
    tangency : float
        How well the edge segments follow its direction, in [0, 1].
    axis_ratio : float
        Short axis over long axis, in (0, 1].

    Returns
    -------
    float
        In [0, 1].
    """
    return ellipse_belief(match, tangency) * axis_ratio**4


def propose(outline: Outline) -> Hypothesis | None:
    """Circle hypothesis for an outline.

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
    ratio = ellipse.axes[1] / ellipse.axes[0]
    return Hypothesis(
        kind="circle",
        belief=circle_belief(match, tangency, ratio),
        geometry={"centre": list(ellipse.centre), "radius": sum(ellipse.axes) / 4},
        shape=ellipse.polygon(),
        deviation=match.deviation,
        curved=True,
        terms={
            "fit": match.fit,
            "explained": match.explained,
            "coverage": match.coverage,
            "tangency": tangency,
            "axis_ratio": ratio**4,
        },
    )
