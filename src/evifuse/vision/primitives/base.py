"""What every primitive shares: the outline it looks at, the hypothesis it makes, how well both agree."""

from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.fit import FittedEdge
from evifuse.vision.geometry import area, distances_to_polygon, perimeter, resample
from evifuse.vision.link import LinkList

__all__ = ["LEAST_TRUST", "Agreement", "Geometry", "Hypothesis", "Outline", "agreement", "outline_of"]

RESIDUAL_PER_SIZE = 0.02
"""Deviation from a primitive that halves the trust in it, as a share of the outline's width (our own)."""

RESIDUAL_PX = 0.7
"""Deviation that the pixel grid causes, px (our own)."""

LEAST_TRUST = 0.02
"""Hypotheses that agree with the outline less than this are dropped at once (our own)."""

Geometry: TypeAlias = dict[str, list[float] | list[list[float]] | float]
"""Where a primitive lies, by name, in px and radians: `corners`, or `centre`, `axes` and `angle_rad`."""


@dataclass(frozen=True, eq=False)
class Outline:
    """A link list prepared for primitives.

    Parameters
    ----------
    links : LinkList
        Edge segments in order.
    points : ndarray of float64, shape (N, 2)
        Points at equal steps on the outline, px.
    hull : ndarray of float64, shape (K, 2)
        Its convex hull, px.
    width : float
        Four times area over perimeter of the hull, px: the side of a square, the diameter of a circle,
        twice the short side of a long rectangle.
    tolerance : float
        Deviation from a primitive that costs it 40 % of its belief, px.
    """

    links: LinkList
    points: NDArray[np.float64]
    hull: NDArray[np.float64]
    width: float
    tolerance: float


@dataclass(frozen=True)
class Hypothesis:
    """A primitive that an outline might show.

    Parameters
    ----------
    kind : str
        Member of the shape frame.
    belief : float
        Belief in it, in [0, 1].
    geometry : Geometry
        Where it lies, px and radians.
    shape : ndarray of float64, shape (K, 2)
        Its own outline as a polygon, px.
    deviation : float
        How far the outline strays from it, px.
    curved : bool
        Whether it is an arc rather than a polygon.
    edges : tuple of FittedEdge
        Fitted edges it is made of; empty for curved primitives.
    terms : dict of str to float
        Factors of the belief by name, each in [0, 1].
    """

    kind: str
    belief: float
    geometry: Geometry
    shape: NDArray[np.float64]
    deviation: float
    curved: bool = False
    edges: tuple[FittedEdge, ...] = ()
    terms: dict[str, float] = field(default_factory=dict[str, float])


@dataclass(frozen=True)
class Agreement:
    """How well an outline and a hypothesised primitive agree (our own).

    Parameters
    ----------
    fit : float
        ``exp(-(r / tolerance)^2 / 2)``, r the root mean square deviation of the nearest 90 % of the points.
    explained : float
        Share of the outline's points that lie near the primitive.
    coverage : float
        Share of the primitive that has points of the outline near it.
    opening : float
        Longest run of the primitive without points near it, as a share of it.
    deviation : float
        Root mean square deviation of all points, each at most four tolerances, px.
    """

    fit: float
    explained: float
    coverage: float
    opening: float
    deviation: float

    @property
    def trust(self) -> float:
        """Share of the outline and of the primitive that account for each other, and how closely."""
        return self.fit * self.explained * self.coverage


def outline_of(links: LinkList) -> Outline | None:
    """Prepare a link list.

    Parameters
    ----------
    links : LinkList
        Edge segments in order, px.

    Returns
    -------
    Outline or None
        None if it encloses next to nothing: a straight line.
    """
    import cv2

    hull = cv2.convexHull(links.points.astype(np.float32)).reshape(-1, 2).astype(np.float64)
    around = perimeter(hull)
    inside = area(hull)
    if len(hull) < 3 or around < 12 or inside < 0.004 * around**2:
        return None
    count = int(np.clip(around / 3, 32, 64))
    width = 4 * inside / around
    return Outline(
        links=links,
        points=resample(links.points, count, links.closed),
        hull=cv2.approxPolyDP(hull.astype(np.float32).reshape(-1, 1, 2), max(0.5, 0.005 * around), True)
        .reshape(-1, 2)
        .astype(np.float64),
        width=width,
        tolerance=RESIDUAL_PER_SIZE * width + RESIDUAL_PX,
    )


def agreement(outline: Outline, shape: NDArray[np.float64]) -> Agreement:
    """Compare an outline with a hypothesised primitive, both ways.

    Parameters
    ----------
    outline : Outline
        What is seen.
    shape : ndarray of float64, shape (K, 2)
        Outline of the primitive as a polygon, px.

    Returns
    -------
    Agreement
        All terms in [0, 1].
    """
    distance, _ = distances_to_polygon(outline.points, shape)
    nearest = np.sort(distance)[: max(1, int(0.9 * len(distance)))]
    residual = float(np.sqrt((nearest**2).mean()))
    reach = 3 * outline.tolerance
    samples = resample(shape, 64, closed=True)
    gap = np.sqrt(((samples[:, None, :] - outline.points[None, :, :]) ** 2).sum(axis=2).min(axis=1))
    step = perimeter(outline.hull) / len(outline.points)
    seen = gap <= reach + step / 2
    return Agreement(
        fit=float(np.exp(-0.5 * (residual / outline.tolerance) ** 2)),
        explained=float((distance <= reach).mean()),
        coverage=float(seen.mean()),
        opening=_longest_run(~seen) / len(seen),
        deviation=float(np.sqrt((np.minimum(distance, 4 * outline.tolerance) ** 2).mean())),
    )


def _longest_run(mask: NDArray[np.bool_]) -> int:
    """Longest run of True on a circle."""
    if mask.all():
        return len(mask)
    seen = np.flatnonzero(~mask)
    gaps = np.diff(np.append(seen, seen[0] + len(mask))) - 1
    return int(gaps.max())
