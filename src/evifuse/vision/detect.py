"""Edges of a picture as chains of points: the one place that speaks to an edge detector."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["NOISE_GRADIENT", "Chain", "Detector", "EdgeDrawing", "grey_quantile", "noise_level"]

Chain: TypeAlias = NDArray[np.float64]
"""Edge points in order along an edge, shape (N, 2), (x, y) in px; pixel centres are whole numbers."""


NOISE_GRADIENT = 4.0
"""Gradient that noise of one grey level causes now and then after smoothing (our own, measured)."""


class Detector(Protocol):
    """Anything that finds chains of edge points in a grey picture.

    A function is enough; `examples/07_detector.py` makes one of OpenCV's line segments. It is asked once for
    each layer of a picture: its lightness and, in colour, its redness.
    """

    def __call__(self, grey: NDArray[np.uint8]) -> tuple[Chain, ...]:
        """Find edges.

        Parameters
        ----------
        grey : ndarray of uint8, shape (H, W)
            Picture, C-contiguous; it may be enlarged or reduced, and has a margin. It must not be changed.

        Returns
        -------
        tuple of Chain
            Each an ndarray of float64, C-contiguous, shape (N, 2): the points (x, y) of one edge in order
            along it, neighbours about one pixel apart, pixel centres at whole numbers, inside the picture.
            The direction, and whether an outline is one chain or several, do not matter; what is further
            apart than two pixels counts as a gap. Chains of fewer than 24 points are left out.
        """
        ...


@dataclass(frozen=True)
class EdgeDrawing:
    """The EdgeDrawing detector of OpenCV (Topal and Akinlar, 2012) with false alarms rejected.

    Its chains are one pixel wide and ordered, and each has passed a test that noise would hardly ever
    pass (the number of false alarms expected from noise is at most one per picture). The gradient
    threshold follows the noise of the picture.

    Parameters
    ----------
    smoothing_px : float
        Standard deviation of the Gaussian smoothing, px; at least 1.
    lowest_threshold : float
        Gradient threshold of a picture without noise, grey levels (sum of both Prewitt responses).
    noise_gradient : float or None
        Gradient that the noise of the picture causes, in the same units; it is added to the threshold.
        Estimated from the picture without it, which is right only for a picture that was not enlarged.
    shortest_px : int
        Chains of fewer points are dropped, px.
    """

    smoothing_px: float = 1.0
    lowest_threshold: float = 16.0
    noise_gradient: float | None = None
    shortest_px: int = 10

    def __call__(self, grey: NDArray[np.uint8]) -> tuple[Chain, ...]:
        """Find edges.

        Parameters
        ----------
        grey : ndarray of uint8, shape (H, W)
            Picture.

        Returns
        -------
        tuple of Chain
            Points of each edge, in order.
        """
        import cv2

        detector = cv2.ximgproc.createEdgeDrawing()
        settings = _settings()
        settings.Sigma = max(1.0, self.smoothing_px)
        noise = NOISE_GRADIENT * noise_level(grey) if self.noise_gradient is None else self.noise_gradient
        settings.GradientThresholdValue = int(min(self.lowest_threshold + noise, 250.0))
        settings.MinPathLength = self.shortest_px
        settings.NFAValidation = True
        detector.setParams(settings)
        detector.detectEdges(np.ascontiguousarray(grey))
        found = [s for s in detector.getSegments() if len(s) >= self.shortest_px]
        if not found:
            return ()
        points = np.concatenate(found).reshape(-1, 2).astype(np.float64)
        until = np.cumsum([len(s) for s in found]).tolist()
        return tuple(points[a:b] for a, b in pairwise([0, *until]))


def noise_level(grey: NDArray[np.uint8]) -> float:
    """Standard deviation of the noise of a picture.

    Median absolute response to the difference of two Laplacians, which cancels slopes and straight edges
    (Immerkær, 1996, with the median in place of the mean so that texture counts little).

    Parameters
    ----------
    grey : ndarray of uint8, shape (H, W)
        Picture.

    Returns
    -------
    float
        Estimate, grey levels.
    """
    import cv2

    kernel = np.array([[1.0, -2.0, 1.0], [-2.0, 4.0, -2.0], [1.0, -2.0, 1.0]], dtype=np.float32)
    response = cv2.convertScaleAbs(cv2.filter2D(grey, cv2.CV_16S, kernel)[1:-1, 1:-1])
    return grey_quantile(np.asarray(response, np.uint8), 0.5) / 6.0 / 0.6745


def grey_quantile(grey: NDArray[np.uint8], share: float) -> float:
    """Quantile of whole numbers, by counting them.

    Parameters
    ----------
    grey : ndarray of uint8, shape (H, W)
        Picture.
    share : float
        In (0, 1).

    Returns
    -------
    float
        Lowest grey level that at least this share of the pixels does not exceed.
    """
    import cv2

    counts = cv2.calcHist([grey], [0], None, [256], [0, 256]).ravel()
    return float(np.searchsorted(np.cumsum(counts, dtype=np.float64), share * grey.size))


def _settings():  # pyright: ignore[reportUnknownParameterType]
    """Parameters object of EdgeDrawing, whose name differs between OpenCV 4 and 5."""
    import cv2

    module = cv2.ximgproc
    old = getattr(module, "EdgeDrawing_Params", None)
    return old() if old is not None else module.EdgeDrawing.Params()
