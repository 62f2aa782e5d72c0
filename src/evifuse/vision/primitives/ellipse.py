"""The ellipse primitive: our own, the chapter leaves it out."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.geometry import distances_to_polygon
from evifuse.vision.primitives.base import Agreement, Hypothesis, Outline, agreement

__all__ = ["Ellipse", "ellipse_belief", "fit_ellipse", "propose", "tangency_of"]


@dataclass(frozen=True)
class Ellipse:
    """An ellipse in the picture.

    Parameters
    ----------
    centre : tuple of float
        (x, y), px.
    axes : tuple of float
        Full lengths of the long and the short axis, px.
    angle_rad : float
        Direction of the long axis from x towards y, radians.
    """

    centre: tuple[float, float]
    axes: tuple[float, float]
    angle_rad: float

    def polygon(self, corners: int = 48) -> NDArray[np.float64]:
        """Points on it.

        Parameters
        ----------
        corners : int, optional
            How many.

        Returns
        -------
        ndarray of float64, shape (corners, 2)
            In order, px.
        """
        t = np.linspace(0, 2 * np.pi, corners, endpoint=False)
        p, q = self.axes[0] / 2 * np.cos(t), self.axes[1] / 2 * np.sin(t)
        c, s = np.cos(self.angle_rad), np.sin(self.angle_rad)
        return np.column_stack([self.centre[0] + p * c - q * s, self.centre[1] + p * s + q * c])


def ellipse_belief(match: Agreement, tangency: float) -> float:
    """Belief in an ellipse (our own).

    Product of fit (how near the points are), explained share (how many points are near), arc coverage (how
    much of the ellipse is seen) and tangency (how well the edge segments follow its direction).

    Parameters
    ----------
    match : Agreement
        How well the outline and the fitted ellipse agree.
    tangency : float
        See `tangency_of`, in [0, 1].

    Returns
    -------
    float
        In [0, 1].
    """
    return match.fit * match.explained * match.coverage * tangency


def tangency_of(outline: Outline, ellipse: Ellipse) -> float:
    """How well the edge segments of an outline run along an ellipse (our own).

    For an arc what ``|x - y| / L * (1 - sin phi)`` is for a fitted edge: the mean over the segments, weighted
    by length, of ``1 - sin`` of the angle to the tangent; what the chord of an arc can't avoid is not
    counted.

    Parameters
    ----------
    outline : Outline
        What is seen.
    ellipse : Ellipse
        The fitted ellipse.

    Returns
    -------
    float
        In [0, 1].
    """
    c, s = np.cos(ellipse.angle_rad), np.sin(ellipse.angle_rad)
    turn = np.array([[c, -s], [s, c]])
    along = (outline.links.ends - outline.links.starts) @ turn
    middle = ((outline.links.starts + outline.links.ends) / 2 - np.array(ellipse.centre)) @ turn
    normal = middle / np.square(np.array(ellipse.axes))
    lengths = np.hypot(along[:, 0], along[:, 1])
    off = np.abs((along * normal).sum(axis=1)) / np.maximum(lengths * np.hypot(*normal.T), 1e-12)
    return float(lengths @ (1 - np.clip(off, 0, 1)) / max(float(lengths.sum()), 1e-12))


@lru_cache(maxsize=4)
def fit_ellipse(outline: Outline) -> tuple[Ellipse, Agreement, float] | None:
    """Ellipse of least squared algebraic distance that stays an ellipse (Fitzgibbon et al., 1999).

    Fitted twice: once to all points, once to the nearest 85 % of them.

    Parameters
    ----------
    outline : Outline
        What is seen.

    Returns
    -------
    tuple of Ellipse, Agreement and tangency, or None
        None if the points lie on no ellipse of a size comparable with the outline.
    """
    first = _direct(outline.points)
    if first is None:
        return None
    best, match = first, agreement(outline, first.polygon())
    distance, _ = distances_to_polygon(outline.points, first.polygon())
    keep = np.sort(np.argsort(distance)[: int(0.85 * len(distance))])
    second = _direct(outline.points[keep])
    if second is not None:
        other = agreement(outline, second.polygon())
        if ellipse_belief(other, 1.0) > ellipse_belief(match, 1.0):
            best, match = second, other
    extent = float(np.ptp(outline.hull, axis=0).max())
    return None if best.axes[0] > 3 * extent else (best, match, tangency_of(outline, best))


def _direct(points: NDArray[np.float64]) -> Ellipse | None:
    import cv2

    if len(points) < 8:
        return None
    (x, y), (a, b), degrees = cv2.fitEllipseDirect(points.astype(np.float32))
    if not np.isfinite([x, y, a, b, degrees]).all() or min(a, b) <= 0.5:
        return None
    if a < b:
        a, b, degrees = b, a, degrees + 90
    angle = np.deg2rad(degrees)
    return Ellipse((x, y), (a, b), float((angle + np.pi / 2) % np.pi - np.pi / 2))


def propose(outline: Outline) -> Hypothesis | None:
    """Ellipse hypothesis for an outline.

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
        kind="ellipse",
        belief=ellipse_belief(match, tangency),
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
            "coverage": match.coverage,
            "tangency": tangency,
        },
    )
