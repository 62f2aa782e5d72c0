"""What every outline of a picture might show, after the families of shapes have competed for it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.features import features_of
from evifuse.vision.group import same_object
from evifuse.vision.primitives import PRIMITIVES, Fits, Hypothesis, Outlines, Primitive, Proposals
from evifuse.vision.rivalry import FAMILIES, KNOWN, STRANGER, Rivalry, load_rivalry, pooled
from evifuse.vision.strokes import Strokes, accounted_for

__all__ = ["Candidates", "candidates_of"]

Column = NDArray[np.float64]

FULL_FORM = 0.7
"""A quadrilateral that has so much of the form of a rectangle is wholly believed to be one (our own)."""

RESOLUTION_PX = 20.0
"""An outline so wide, in pixels of the picture, is half as clear as a large one (our own)."""


@dataclass(frozen=True, eq=False)
class Candidates:
    """Outlines with what they might show.

    Parameters
    ----------
    outlines : Outlines
        What is seen.
    proposals : tuple of Proposals
        One per primitive.
    features : mapping of str to ndarray of float64, shape (B,)
        What the outlines were judged by, see `features_of`.
    own : ndarray of float64, shape (B, 5)
        Share of each of the `FAMILIES` by each outline alone.
    prominence : ndarray of float64, shape (B,)
        How much each outline stands out among those of its object: logarithm of the odds.
    clearness : ndarray of float64, shape (B,)
        How clear outlines of such a size are, in [0, 1].
    together : ndarray of bool, shape (B, B), optional
        Which outlines show the same object as each; by their boxes without it.
    """

    outlines: Outlines
    proposals: tuple[Proposals, ...]
    features: Mapping[str, Column]
    own: NDArray[np.float64]
    prominence: Column
    clearness: Column
    together: NDArray[np.bool_] | None = None

    @property
    def support(self) -> Column:
        """Belief that each outline, by itself, shows any primitive at all, in [0, 1], shape (B,)."""
        shares = _by_family(self.own, self.proposals)
        return np.sum(
            [s * k for s, k in zip((shares[p.family] for p in self.proposals), self.parts, strict=True)],
            axis=0,
        )

    def grouped(self, chosen: Sequence[int], members: NDArray[np.bool_]) -> "Candidates":
        """The same, knowing which outlines show each object.

        Parameters
        ----------
        chosen : sequence of int
            Outline that stands for each of N objects.
        members : ndarray of bool, shape (N, B)
            Outlines that show each.

        Returns
        -------
        Candidates
            Shares of the outlines that are chosen are averaged over these.
        """
        together = np.eye(len(self.own), dtype=np.bool_)
        together[list(chosen)] = members
        return replace(self, together=together)

    @property
    def scores(self) -> Column:
        """How clearly each outline alone shows any primitive or stranger, in [0, 1], shape (B,)."""
        shares = _by_family(self.own, self.proposals)
        clear = [np.where(p.proposed, p.belief, 0.0) * shares[p.family] for p in self.proposals]
        known = np.maximum(np.sum(list(shares.values()), axis=0), 1e-9)
        return np.max(clear, axis=0) / known * self.clearness

    @cached_property
    def boxes(self) -> NDArray[np.float64]:
        """Bounds of the best primitive of each outline alone: x0, y0, x1, y1, px, shape (B, 4)."""
        shares = _by_family(self.own, self.proposals)
        own = {id(p.shape): p.shape for p in self.proposals}  # several primitives share one shape
        bounds = {key: _bounds(shape) for key, shape in own.items()}
        every = np.stack([bounds[id(p.shape)] for p in self.proposals])
        beliefs = np.array([shares[p.family] for p in self.proposals]) * self.parts
        best = beliefs.argmax(axis=0), np.arange(len(self.own))
        return every[best]

    @cached_property
    def shares(self) -> dict[str, Column]:
        """Share of each family, by all outlines of the object that each is part of, shape (B,)."""
        together = self.together
        if together is None:
            together = same_object(self.boxes) | np.eye(len(self.own), dtype=np.bool_)
        return _by_family(pooled(self.own, self.prominence, together), self.proposals)

    @cached_property
    def parts(self) -> NDArray[np.float64]:
        """Part of each primitive in the share of its family, in [0, 1], shape (P, B).

        In proportion to the beliefs. A family that was not learned gets no more than it believes itself. Of a
        quadrilateral that is no rectangle, because it is one that is seen obliquely or none at all, a part
        stays on the frame: `form` over 0.7.
        """
        beliefs = np.array([np.where(p.proposed, p.belief, 0.0) for p in self.proposals])
        parts = np.zeros_like(beliefs)
        for family in {p.family for p in self.proposals}:
            mine = [k for k, p in enumerate(self.proposals) if p.family == family]
            least = 1e-12 if family in KNOWN else 1.0
            parts[mine] = beliefs[mine] / np.maximum(beliefs[mine].sum(axis=0), least)
            forms = [self.proposals[k].terms["form"] for k in mine if "form" in self.proposals[k].terms]
            for form in forms:
                parts[mine] *= np.minimum(1.0, np.nan_to_num(form) / FULL_FORM)
        return parts

    @cached_property
    def beliefs(self) -> NDArray[np.float64]:
        """Belief in each primitive of each outline, in [0, 1], shape (P, B)."""
        return np.array([self.shares[p.family] for p in self.proposals]) * self.parts

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
        for k, p in enumerate(self.proposals):
            if p.proposed[i]:
                h = p.hypothesis(i)
                shares = {"share": float(self.shares[p.family][i]), "part": float(self.parts[k, i])}
                found.append(replace(h, belief=float(self.beliefs[k, i]), terms={**h.terms, **shares}))
        return tuple(sorted(found, key=lambda h: -h.belief))


def _bounds(shape: NDArray[np.float64]) -> NDArray[np.float64]:
    """Bounds x0, y0, x1, y1 of polygons (B, K, 2)."""
    x, y = shape[..., 0], shape[..., 1]
    return np.stack([x.min(axis=1), y.min(axis=1), x.max(axis=1), y.max(axis=1)], axis=1)


def candidates_of(
    outlines: Outlines,
    scale: float,
    strokes: Strokes,
    primitives: Mapping[str, Primitive] = PRIMITIVES,
    rivalry: Rivalry | None = None,
) -> Candidates:
    """Everything that outlines might show.

    The families of shapes, the stranger, who is none of them, and texture share one belief in proportion to
    their learned odds, averaged over the outlines of the object (`Rivalry`, our own). The beliefs of section
    3.2 say how the share of a family is divided among its members: a square is a rectangle too. What falls to
    the stranger or to texture is believed of no primitive and stays on the frame.

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
    rivalry : Rivalry, optional
        What weighs the families; that of the package without it.

    Returns
    -------
    Candidates
        One per outline.
    """
    fits = Fits(outlines)
    features = features_of(fits, accounts_of(fits, strokes), scale)
    own, standing = (rivalry or load_rivalry()).judge(features)
    return Candidates(
        outlines=outlines,
        proposals=tuple(propose(fits) for propose in primitives.values()),
        features=features,
        own=own,
        prominence=standing,
        clearness=outlines.width / (outlines.width + scale * RESOLUTION_PX),
    )


def accounts_of(fits: Fits, strokes: Strokes) -> dict[str, Column]:
    """Share of the strokes that the triangle, quadrilateral and ellipse of each outline account for.

    Parameters
    ----------
    fits : Fits
        What is seen, and what was fitted to it.
    strokes : Strokes
        What the outlines are part of.

    Returns
    -------
    dict of str to ndarray of float64, shape (B,)
        By family, in [0, 1].
    """
    shapes = (fits.triangle.corners, fits.quadrilateral.corners, fits.ellipse.shape)
    tolerance = fits.outlines.tolerance
    return {f: accounted_for(strokes, s, tolerance) for f, s in zip(KNOWN, shapes, strict=True)}


def _by_family(shares: NDArray[np.float64], proposals: tuple[Proposals, ...]) -> dict[str, Column]:
    """Shares by name; families that were not learned take theirs from the stranger, by how well they follow.

    Of the stranger's share each gets its odds against the best of the learned families and the new ones.
    """
    found = dict(zip(FAMILIES, shares.T, strict=True))
    odds: dict[str, Column] = {}
    for p in proposals:
        mine = np.where(p.proposed, np.nan_to_num(p.odds, nan=-1e3), -1e3)
        odds[p.family] = np.maximum(odds.get(p.family, mine), mine)
    best = np.max([odds[f] for f in KNOWN if f in odds] or [np.zeros(len(shares))], axis=0)
    new = {f: np.exp(np.clip(o - best, -50, 50)) for f, o in odds.items() if f not in KNOWN}
    total = 1 + np.sum(list(new.values()), axis=0)
    known = {f: found[f] for f in KNOWN}
    return known | {f: found[STRANGER] * weight / total for f, weight in new.items()}
