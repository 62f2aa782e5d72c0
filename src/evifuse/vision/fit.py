"""Fitted edges: one straight line for many edge segments, with the belief of section 3.1."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.geometry import fit_line
from evifuse.vision.link import GAP_PX

__all__ = [
    "ANGLE_TOLERANCE_RAD",
    "FittedEdge",
    "FittedEdges",
    "edge_belief",
    "fit_edge",
    "fit_edges",
]

ANGLE_TOLERANCE_RAD = float(np.deg2rad(10.0))
"""Segments whose angle to the fitted line is so near to the smallest such angle count in n* (our own)."""


def _unknown() -> NDArray[np.float64]:
    return np.full((2, 2), np.nan)


@dataclass(frozen=True)
class FittedEdge:
    """A straight line that stands for a run of edge segments.

    Parameters
    ----------
    start, end : ndarray of float64, shape (2,)
        End points x and y, px.
    belief : float
        Belief in it, in [0, 1] (section 3.1); the balance is on the frame.
    start_covariance_px2, end_covariance_px2 : ndarray of float64, shape (2, 2)
        How uncertain each end point is: covariance of its x and y, square px; NaN while it is not known.
    """

    start: NDArray[np.float64]
    end: NDArray[np.float64]
    belief: float
    start_covariance_px2: NDArray[np.float64] = field(default_factory=_unknown)
    end_covariance_px2: NDArray[np.float64] = field(default_factory=_unknown)

    @property
    def length(self) -> float:
        """Distance of the end points, px."""
        return float(np.hypot(*(self.end - self.start)))


def edge_belief(
    starts: NDArray[np.float64],
    ends: NDArray[np.float64],
    x: NDArray[np.float64],
    y: NDArray[np.float64],
) -> float:
    """Belief in a fitted edge (section 3.1).

    ``b = |x - y| / L * (1 - sin phi) * n* / n_T``: L is the total length of segments and link edges, phi the
    smallest acute angle between a segment and the fitted line, n* the number of segments within 10
    degrees of that angle (the tolerance is our own) and n_T the number of segments and link edges.

    Parameters
    ----------
    starts, ends : ndarray of float64, shape (S, 2)
        Edge segments in order, px.
    x, y : ndarray of float64, shape (2,)
        End points of the fitted edge, px.

    Returns
    -------
    float
        In [0, 1].

    Examples
    --------
    >>> whole = np.array([[0.0, 0.0]]), np.array([[10.0, 0.0]])
    >>> edge_belief(*whole, np.array([0.0, 0.0]), np.array([10.0, 0.0]))
    1.0
    """
    along = ends - starts
    lengths = np.hypot(along[:, 0], along[:, 1])
    gaps = np.hypot(*(starts[1:] - ends[:-1]).T)
    gaps = gaps[gaps > GAP_PX]
    total = lengths.sum() + gaps.sum()
    edge = y - x
    span = float(np.hypot(edge[0], edge[1]))
    if total <= 0 or span <= 0:
        return 0.0
    sine = np.abs(along[:, 0] * edge[1] - along[:, 1] * edge[0]) / np.maximum(lengths * span, 1e-12)
    angles = np.arcsin(np.clip(sine, 0.0, 1.0))
    smallest = float(angles.min())
    near = int((angles <= smallest + ANGLE_TOLERANCE_RAD).sum())
    share = min(1.0, span / total)
    return float(share * (1 - np.sin(smallest)) * near / (len(starts) + len(gaps)))


def fit_edge(starts: NDArray[np.float64], ends: NDArray[np.float64]) -> FittedEdge:
    """Fit one edge to segments in order.

    Parameters
    ----------
    starts, ends : ndarray of float64, shape (S, 2)
        Edge segments in order, px.

    Returns
    -------
    FittedEdge
        On the line of least squared distance, from the projection of the first point to that of the last.
    """
    lengths = np.hypot(*(ends - starts).T)
    both = np.vstack([starts, ends])
    centre, direction = fit_line(both, np.maximum(np.tile(lengths, 2), 1e-9))
    x = centre + direction * float((starts[0] - centre) @ direction)
    y = centre + direction * float((ends[-1] - centre) @ direction)
    return FittedEdge(x, y, edge_belief(starts, ends, x, y))


@dataclass(frozen=True, eq=False)
class FittedEdges:
    """Many fitted edges.

    Parameters
    ----------
    starts, ends : ndarray of float64, shape (..., 2)
        End points x and y, px; NaN where there is none.
    beliefs : ndarray of float64, shape (...)
        Belief in each, in [0, 1]; NaN where there is none.
    """

    starts: NDArray[np.float64]
    ends: NDArray[np.float64]
    beliefs: NDArray[np.float64]

    def listed(self, *at: int) -> tuple[FittedEdge, ...]:
        """Those that are there, one by one.

        Parameters
        ----------
        *at : int
            Place in the leading dimensions, all but the last.

        Returns
        -------
        tuple of FittedEdge
            In order.
        """
        rows = zip(self.starts[at], self.ends[at], self.beliefs[at].tolist(), strict=True)
        return tuple(FittedEdge(x, y, b) for x, y, b in rows if b == b)


def fit_edges(starts: NDArray[np.float64], ends: NDArray[np.float64], first: NDArray[np.intp]) -> FittedEdges:
    """As `fit_edge`, for many runs of segments at once.

    Parameters
    ----------
    starts, ends : ndarray of float64, shape (S, 2)
        Edge segments, run after run, px.
    first : ndarray of intp, shape (G,)
        Where each run starts, rising from 0; none is empty.

    Returns
    -------
    FittedEdges
        One per run, shape (G,).
    """
    from evifuse.vision import _kernels_edges

    x, y, belief = np.empty((len(first), 2)), np.empty((len(first), 2)), np.empty(len(first))
    bounds = np.append(first, len(starts))
    _kernels_edges.fit_runs(starts, ends, bounds, GAP_PX, ANGLE_TOLERANCE_RAD, x, y, belief)
    return FittedEdges(x, y, belief)
