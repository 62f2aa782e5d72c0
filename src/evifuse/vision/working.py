"""The copy of a picture that edges are detected in, and the way back to the picture's own pixels."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.detect import NOISE_GRADIENT, grey_quantile, noise_level
from evifuse.vision.fit import FittedEdge
from evifuse.vision.primitives import Geometry, Hypothesis

__all__ = ["WorkingPicture", "working_picture"]

SHORT_SIDE_PX = 240
"""Pictures with a shorter side are enlarged, up to four times (our own)."""

MAX_PIXELS = 4_000_000
"""Pictures with more pixels are reduced (our own)."""

ENLARGED_NOISE_GRADIENT = 10.0
"""As `NOISE_GRADIENT`, times the scale, for a picture that is enlarged and smoothed (our own, measured)."""

NOISY = 10.0
"""A picture with noise of a higher standard deviation is smoothed first, grey levels (our own)."""

SMOOTHED_NOISE = 0.1
"""What smoothing leaves of the gradient that noise causes (our own, tuned)."""

STRONG = 33.0
"""Of noise with a higher standard deviation more is left, in proportion, grey levels (our own)."""

MARGIN_PX = 8
"""The picture is continued by so much on every side, so that outlines near its border are whole."""


@dataclass(frozen=True, eq=False)
class WorkingPicture:
    """A grey picture in working pixels.

    Parameters
    ----------
    grey : ndarray of uint8, shape (H, W)
        With the margin.
    scale : float
        Working pixels per pixel of the picture.
    noise_gradient : float
        Gradient that the noise of the picture causes in it, grey levels (sum of both Prewitt responses).
    """

    grey: NDArray[np.uint8]
    scale: float
    noise_gradient: float

    def point(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Working coordinates as picture coordinates.

        Parameters
        ----------
        points : ndarray of float64, shape (..., 2)
            Working (x, y), px.

        Returns
        -------
        ndarray of float64, shape (..., 2)
            Picture (x, y), px; pixel centres are whole numbers in both.
        """
        return (points - MARGIN_PX + 0.5) / self.scale - 0.5

    def edge(self, edge: FittedEdge) -> FittedEdge:
        """Move a fitted edge to picture coordinates.

        Parameters
        ----------
        edge : FittedEdge
            In working coordinates.

        Returns
        -------
        FittedEdge
            In picture coordinates, with the same belief.
        """
        return FittedEdge(self.point(edge.start), self.point(edge.end), edge.belief)

    def hypothesis(self, found: Hypothesis) -> Hypothesis:
        """Move a hypothesis to picture coordinates.

        Parameters
        ----------
        found : Hypothesis
            In working coordinates.

        Returns
        -------
        Hypothesis
            In picture coordinates, with the same belief.
        """
        geometry: Geometry = {}
        for name, value in found.geometry.items():
            if name in ("corners", "centre"):
                geometry[name] = self.point(np.asarray(value, np.float64)).tolist()
            elif name in ("axes", "radius"):
                geometry[name] = (np.asarray(value, np.float64) / self.scale).tolist()
            else:
                geometry[name] = value
        edges = tuple(self.edge(e) for e in found.edges)
        return replace(found, geometry=geometry, shape=self.point(found.shape), edges=edges)


def working_picture(picture: NDArray[np.uint8]) -> WorkingPicture:
    """Prepare a picture for edge detection.

    Parameters
    ----------
    picture : ndarray of uint8, shape (H, W) or (H, W, 3)
        Grey or BGR.

    Returns
    -------
    WorkingPicture
        Grey, enlarged or reduced, with a margin, C-contiguous.
    """
    import cv2

    grey = _grey(picture)
    height, width = grey.shape
    scale = float(np.clip(SHORT_SIDE_PX / min(height, width), 1.0, 4.0))
    scale = min(scale, float(np.sqrt(MAX_PIXELS / (height * width))))
    deviation = noise_level(grey)
    grey = _levelled(grey)
    noise = noise_level(grey) * (NOISE_GRADIENT if scale <= 1 else ENLARGED_NOISE_GRADIENT / scale)
    if deviation > NOISY:
        noise *= SMOOTHED_NOISE * max(1.0, deviation / STRONG)
        grey = _levelled(_grey(_smoothed(picture, deviation)))
    if scale != 1:
        how = cv2.INTER_CUBIC if scale > 1 else cv2.INTER_AREA
        grey = cv2.resize(grey, (round(width * scale), round(height * scale)), interpolation=how)
    if scale > 1.5:
        grey = cv2.GaussianBlur(grey, (0, 0), 0.5 * scale)
    grey = np.pad(grey, MARGIN_PX, mode="edge")
    return WorkingPicture(np.ascontiguousarray(grey, dtype=np.uint8), scale, noise)


def _grey(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Grey levels of a picture that may have colours."""
    import cv2

    return picture if picture.ndim == 2 else np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), np.uint8)


def _smoothed(picture: NDArray[np.uint8], deviation: float) -> NDArray[np.uint8]:
    """A picture without most of its noise: a Gaussian of 1 px, then a bilateral filter, twice."""
    import cv2

    soft = cv2.GaussianBlur(picture, (0, 0), 1.0)
    for _ in range(2):
        soft = cv2.bilateralFilter(soft, -1, deviation, 3.0)
    return np.asarray(soft, np.uint8)


def _levelled(grey: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Grey levels as their square root, so that an edge in the shade counts as much as one in the sun.

    The root makes the shot noise of a camera equally strong everywhere.
    """
    import cv2

    top = max(32.0, grey_quantile(grey, 0.995))
    table = np.round(255 * np.sqrt(np.clip(np.arange(256) / top, 0, 1))).astype(np.uint8)
    return np.asarray(cv2.LUT(grey, table), np.uint8)
