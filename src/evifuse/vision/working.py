"""The copy of a picture that edges are detected in, and the way back to the picture's own pixels."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.detect import NOISE_GRADIENT, Chain, Detector, EdgeDrawing, grey_quantile, noise_level
from evifuse.vision.fit import FittedEdge
from evifuse.vision.primitives import Geometry, Hypothesis

__all__ = ["Layer", "WorkingPicture", "working_picture"]

SHORT_SIDE_PX = 240
"""Pictures with a shorter side are enlarged, up to four times (our own)."""

MAX_PIXELS = 4_000_000
"""Pictures with more pixels are reduced (our own)."""

ENLARGED_NOISE_GRADIENT = 10.0
"""As `NOISE_GRADIENT`, times the scale, for a picture that is enlarged and smoothed (our own, measured)."""

LEAST_GRADIENT = 16.0
"""Gradient of an edge in a picture without noise, over the root of the scale if it is enlarged (our own)."""

LEAST_REDNESS = 24
"""A picture whose redness spans fewer levels is not looked at for edges in it (our own)."""

NOISY = 10.0
"""A picture with noise of a higher standard deviation is smoothed first, grey levels (our own)."""

SMOOTHED_NOISE = 0.1
"""What smoothing leaves of the gradient that noise causes (our own, tuned)."""

LIGHTNESS_POWER = 0.5
"""In lightness enlarged it leaves less, by the scale to this power; colours are noisier (our own, tuned)."""

STRONG = 33.0
"""Of noise with a higher standard deviation more is left, in proportion, grey levels (our own)."""

MARGIN_PX = 8
"""The picture is continued by so much on every side, so that outlines near its border are whole."""


@dataclass(frozen=True, eq=False)
class Layer:
    """One quantity of a picture, to look for edges in.

    Parameters
    ----------
    grey : ndarray of uint8, shape (H, W)
        Its values, with the margin, C-contiguous.
    noise_gradient : float
        Gradient that the noise of the picture causes in it, grey levels (sum of both Prewitt responses).
    """

    grey: NDArray[np.uint8]
    noise_gradient: float


@dataclass(frozen=True, eq=False)
class WorkingPicture:
    """A picture in working pixels.

    Parameters
    ----------
    layers : tuple of Layer
        Its lightness and, if it has colours, its redness.
    scale : float
        Working pixels per pixel of the picture.
    """

    layers: tuple[Layer, ...]
    scale: float

    def edges(self, detector: Detector | None = None) -> tuple[Chain, ...]:
        """Edges of all layers.

        Parameters
        ----------
        detector : Detector, optional
            Asked about each layer; `EdgeDrawing`, told of the noise, without it.

        Returns
        -------
        tuple of Chain
            Working (x, y), px; those in lightness first.
        """
        found: list[Chain] = []
        for layer in self.layers:
            ask = detector or EdgeDrawing(
                lowest_threshold=LEAST_GRADIENT / max(1.0, self.scale) ** 0.5,
                noise_gradient=layer.noise_gradient,
            )
            found += ask(layer.grey)
        return tuple(found)

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

    def fitted(self, edges: Sequence[FittedEdge]) -> tuple[FittedEdge, ...]:
        """Move fitted edges to picture coordinates.

        Parameters
        ----------
        edges : sequence of FittedEdge
            In working coordinates.

        Returns
        -------
        tuple of FittedEdge
            In picture coordinates, with the same beliefs.
        """
        ends = self.point(np.array([(e.start, e.end) for e in edges]).reshape(-1, 2, 2))
        return tuple(FittedEdge(x, y, e.belief) for (x, y), e in zip(ends, edges, strict=True))

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
        edges = self.fitted(found.edges)
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
        Enlarged or reduced, with a margin.
    """
    import cv2

    height, width = picture.shape[:2]
    scale = float(np.clip(SHORT_SIDE_PX / min(height, width), 1.0, 4.0))
    scale = min(scale, float(np.sqrt(MAX_PIXELS / (height * width))))
    deviation = noise_level(_grey(picture))
    soft = _smoothed(picture, deviation) if deviation > NOISY else picture
    layers: list[Layer] = []
    for grey, smooth in zip(_quantities(picture), _quantities(soft), strict=True):
        if layers and grey_quantile(grey, 0.998) - grey_quantile(grey, 0.002) < LEAST_REDNESS:
            break
        noise = noise_level(grey) * (NOISE_GRADIENT if scale <= 1 else ENLARGED_NOISE_GRADIENT / scale)
        if deviation > NOISY:
            noise *= SMOOTHED_NOISE * max(1.0, deviation / STRONG)
            noise /= 1.0 if layers else max(1.0, scale) ** LIGHTNESS_POWER
        if scale != 1:
            how = cv2.INTER_CUBIC if scale > 1 else cv2.INTER_AREA
            smooth = cv2.resize(smooth, (round(width * scale), round(height * scale)), interpolation=how)
        if scale > 1.5:
            smooth = cv2.GaussianBlur(smooth, (0, 0), 0.5 * scale)
        smooth = np.pad(smooth, MARGIN_PX, mode="edge")
        layers.append(Layer(np.ascontiguousarray(smooth, dtype=np.uint8), noise))
    return WorkingPicture(tuple(layers), scale)


def _quantities(picture: NDArray[np.uint8]) -> list[NDArray[np.uint8]]:
    """Lightness and, of a picture with colours, how much redder than the rest it is, about 128."""
    import cv2

    grey = _grey(picture)
    table = _levels(grey)
    quantities = [np.asarray(cv2.LUT(grey, table), np.uint8)]
    if picture.ndim == 3:
        blue, green, red = cv2.split(cv2.LUT(picture, table))
        redder = np.asarray(cv2.addWeighted(blue, 0.5, green, 0.5, 0), np.int16)
        redder = np.clip(128 + np.asarray(red, np.int16) - redder, 0, 255).astype(np.uint8)
        quantities.append(redder)
    return quantities


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


def _levels(grey: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Square roots of all levels, so that an edge in the shade counts as much as one in the sun.

    The root makes the shot noise of a camera equally strong everywhere.
    """
    top = max(32.0, grey_quantile(grey, 0.995))
    return np.round(255 * np.sqrt(np.clip(np.arange(256) / top, 0, 1))).astype(np.uint8)
