"""What every outline of a picture might show, after the primitives have competed for it."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.primitives import PRIMITIVES, Fits, Hypothesis, Outlines, Proposals
from evifuse.vision.primitives.polygon import straight_deviation

__all__ = ["Candidates", "candidates_of"]

RESOLUTION_PX = 20.0
"""An outline so wide, in pixels of the picture, keeps half of its belief (our own)."""

PIXEL_GRID_PX = 0.5
"""Deviation that says nothing when straight and curved hypotheses are compared, px (our own)."""


SIDES = 8
"""An arc must follow the outline more closely than a polygon with so many sides does (our own)."""

SIDES_MARGIN = 1.4
"""Such a polygon, which has more freedom, must follow it so many times more closely to count (our own)."""

WHOLE_ARC = 0.9
"""Arcs that are seen and account for less are not compared with such a polygon: it follows cuts (our own)."""


@dataclass(frozen=True, eq=False)
class Candidates:
    """Outlines with what they might show.

    Parameters
    ----------
    outlines : Outlines
        What is seen.
    proposals : tuple of Proposals
        One per primitive.
    factors : tuple of dict of str to ndarray of float64, shape (B,)
        For each primitive, by what its belief is attenuated, in [0, 1].
    beliefs : ndarray of float64, shape (P, B)
        What is left of the belief in each primitive, in [0, 1].
    """

    outlines: Outlines
    proposals: tuple[Proposals, ...]
    factors: tuple[dict[str, NDArray[np.float64]], ...]
    beliefs: NDArray[np.float64]

    @property
    def scores(self) -> NDArray[np.float64]:
        """Belief in the best primitive of each outline, in [0, 1], shape (B,)."""
        return self.beliefs.max(axis=0)

    @property
    def boxes(self) -> NDArray[np.float64]:
        """Bounds of the best primitive of each outline: x0, y0, x1, y1, px, shape (B, 4)."""
        low = np.stack([p.shape.min(axis=1) for p in self.proposals])
        high = np.stack([p.shape.max(axis=1) for p in self.proposals])
        best = self.beliefs.argmax(axis=0), np.arange(self.beliefs.shape[1])
        return np.concatenate([low[best], high[best]], axis=1)

    def hypotheses(self, i: int) -> tuple[Hypothesis, ...]:
        """What one outline might show.

        Parameters
        ----------
        i : int
            Number of the outline.

        Returns
        -------
        tuple of Hypothesis
            One per primitive at most, most believed first.
        """
        found: list[Hypothesis] = []
        for p, factors, belief in zip(self.proposals, self.factors, self.beliefs[:, i].tolist(), strict=True):
            if p.proposed[i]:
                h = p.hypothesis(i)
                terms = {**h.terms, **{name: float(v[i]) for name, v in factors.items()}}
                found.append(replace(h, belief=belief, terms=terms))
        return tuple(sorted(found, key=lambda h: -h.belief))


def candidates_of(outlines: Outlines, scale: float) -> Candidates:
    """Everything that outlines might show.

    To the belief that each primitive gives, factors are applied that no primitive can know alone (our own).
    *Rivalry*: where a polygon follows the outline more closely than the arc does, the arc loses the squared
    ratio of their deviations, and the other way round. *Simplicity*: four sides are believed as far as three
    are not enough. *Roundness*: where eight sides follow the outline much more closely than an arc, the arc
    loses likewise, to nobody: an octagon is none of the primitives. *Resolution*: ``width / (width + 20
    px)``.

    Parameters
    ----------
    outlines : Outlines
        What is seen, in working pixels.
    scale : float
        Working pixels per pixel of the picture.

    Returns
    -------
    Candidates
        One per outline.
    """
    fits = Fits(outlines)
    proposals = tuple(propose(fits) for propose in PRIMITIVES.values())
    resolution = outlines.width / (outlines.width + scale * RESOLUTION_PX)
    rivals = {curved: _least_deviation(proposals, not curved) for curved in (False, True)}
    trust = np.where(fits.triangle.found, fits.triangle.match.trust, 0.0)
    roundness = _roundness(fits)
    factors: list[dict[str, NDArray[np.float64]]] = []
    for p in proposals:
        rivalry = np.minimum(1.0, (rivals[p.curved] + PIXEL_GRID_PX) / (p.deviation + PIXEL_GRID_PX)) ** 2
        simplicity = 1 - trust if p.kind in ("rectangle", "square") else np.ones_like(trust)
        factors.append({"rivalry": rivalry, "simplicity": simplicity, "resolution": resolution})
        if p.curved:
            factors[-1]["roundness"] = roundness
    beliefs = np.array(
        [
            np.where(p.proposed, p.belief * np.prod(list(f.values()), axis=0), 0.0)
            for p, f in zip(proposals, factors, strict=True)
        ]
    )
    return Candidates(outlines, proposals, tuple(factors), beliefs)


def _least_deviation(proposals: tuple[Proposals, ...], curved: bool) -> NDArray[np.float64]:
    """How closely the best arc or polygon follows each outline; infinite if there is none."""
    return np.min(
        [np.where(p.proposed, p.deviation, np.inf) for p in proposals if p.curved == curved], axis=0
    )


def _roundness(fits: Fits) -> NDArray[np.float64]:
    """How much better an arc follows each outline than eight straight sides do, in [0, 1]."""
    match = fits.ellipse.match
    arcs = np.flatnonzero(fits.ellipse.found & (match.explained * match.coverage >= WHOLE_ARC))
    straight = straight_deviation(fits.outlines, arcs, SIDES)
    ratio = (straight + PIXEL_GRID_PX) / (match.deviation[arcs] + PIXEL_GRID_PX)
    roundness = np.ones(len(match.fit))
    roundness[arcs] = np.minimum(1.0, SIDES_MARGIN * ratio) ** 2
    return roundness
