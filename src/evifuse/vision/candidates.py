"""What every outline of a picture might show, after the primitives have competed for it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.closing import closed_by_itself
from evifuse.vision.geometry import distances_to_polygon
from evifuse.vision.primitives import PRIMITIVES, Fits, Hypothesis, Outlines, Primitive, Proposals
from evifuse.vision.primitives.fits import MOST_SECTIONS
from evifuse.vision.primitives.odds import LEAST_DEVIATION
from evifuse.vision.strokes import Strokes, accounted_for

__all__ = ["Candidates", "candidates_of"]

RESOLUTION_PX = 20.0
"""An outline so wide, in pixels of the picture, keeps half of its belief (our own)."""

KIND_ODDS = {"triangle": 0.6, "quadrilateral": 0.0, "ellipse": 0.2}
"""Logarithm of the odds of each kind of shape before anything is seen (our own, tuned)."""


ACCOUNT_POWER = 4.0
"""How fast belief falls with the share of the strokes that is not accounted for (our own, tuned)."""

PIXEL_GRID_PX = 0.3
"""Deviation that says nothing when arcs are compared with eight sides, px (our own)."""

SIDES_MARGIN = 1.4
"""Eight sides, which have more freedom, count if they follow so many times more closely (our own)."""

WHOLE_ARC = 0.9
"""Arcs that are seen and account for less are not compared with eight sides: they follow cuts (our own)."""


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
        """Belief in the best primitive of each outline, whatever else is there, in [0, 1], shape (B,)."""
        without = [f["account"] for f in self.factors]
        return (self.beliefs / np.maximum(without, 1e-9)).max(axis=0)

    @property
    def prominence(self) -> NDArray[np.float64]:
        """How much each outline stands out, in no unit, shape (B,).

        Belief in the best primitive, times the third power of the width, over that of the deviation, relative
        to the tolerance, to the power of 1.25 (our own, tuned): of the outlines of one object the outer one,
        unless it is followed badly.
        """
        outlines = self.outlines
        least = np.min([np.where(p.proposed, p.deviation, np.inf) for p in self.proposals], axis=0)
        closeness = np.hypot(least / outlines.tolerance, LEAST_DEVIATION) ** -1.25
        return self.scores * outlines.width**3 * closeness

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


def candidates_of(
    outlines: Outlines, scale: float, strokes: Strokes, primitives: Mapping[str, Primitive] = PRIMITIVES
) -> Candidates:
    """Everything that outlines might show.

    To the belief that each primitive gives, factors are applied that no primitive can know alone (our own).
    *Rivalry*: triangle, quadrilateral and ellipse share one belief in proportion to their odds.
    *Roundness*: where eight sides follow a whole outline much more closely than an arc, the arc loses the
    squared ratio of their deviations, to nobody: an octagon is none of the primitives. *Account*: the share
    of the strokes of the object that the primitive accounts for, to the fourth power. *Resolution*:
    ``width / (width + 20 px)``.

    Parameters
    ----------
    outlines : Outlines
        What is seen, in working pixels.
    scale : float
        Working pixels per pixel of the picture.
    strokes : Strokes
        What the outlines are part of, in working pixels.
    primitives : mapping of str to callable
        What proposes each primitive.

    Returns
    -------
    Candidates
        One per outline.
    """
    fits = Fits(outlines)
    proposals = tuple(propose(fits) for propose in primitives.values())
    resolution = outlines.width / (outlines.width + scale * RESOLUTION_PX)
    shares = _shares(proposals)
    account: dict[str, NDArray[np.float64]] = {}
    for p in proposals:
        if p.family not in account:
            account[p.family] = accounted_for(strokes, p.shape, outlines.tolerance) ** ACCOUNT_POWER + 1e-6
    factors = tuple(
        {"rivalry": shares[p.family], "account": account[p.family], "resolution": resolution}
        for p in proposals
    )
    roundness = _roundness(fits)
    for p, f in zip(proposals, factors, strict=True):
        if p.family == "ellipse":
            f["roundness"] = roundness
    beliefs = np.array(
        [
            np.where(p.proposed, p.belief * np.prod(list(f.values()), axis=0), 0.0)
            for p, f in zip(proposals, factors, strict=True)
        ]
    )
    return Candidates(outlines, proposals, factors, beliefs)


def _shares(proposals: tuple[Proposals, ...]) -> dict[str, NDArray[np.float64]]:
    """Share of each family of shapes in the belief about each outline, by the odds of its best member."""
    best: dict[str, NDArray[np.float64]] = {}
    for p in proposals:
        odds = np.where(p.proposed, np.nan_to_num(p.odds, nan=-1e3), -1e3) + KIND_ODDS.get(p.family, 0.0)
        best[p.family] = np.maximum(best.get(p.family, np.full_like(odds, -1e3)), odds)
    odds = np.stack(list(best.values()))
    weight = np.exp(odds - odds.max(axis=0))
    return dict(zip(best, weight / weight.sum(axis=0), strict=True))


def _roundness(fits: Fits) -> NDArray[np.float64]:
    """How much better an arc follows each outline than eight straight sides do, in [0, 1]."""
    match, outlines = fits.ellipse.match, fits.outlines
    whole = np.flatnonzero(fits.ellipse.found & (match.explained * match.coverage >= WHOLE_ARC))
    polygon = closed_by_itself(fits.sections[MOST_SECTIONS], outlines.around)[whole]
    distance, _ = distances_to_polygon(outlines.points[whole], polygon)
    straight = np.nan_to_num(np.sqrt((distance**2).mean(axis=1)), nan=np.inf)
    ratio = (straight + PIXEL_GRID_PX) / (match.deviation[whole] + PIXEL_GRID_PX)
    roundness = np.ones(len(match.fit))
    roundness[whole] = np.minimum(1.0, SIDES_MARGIN * ratio) ** 2
    return roundness
