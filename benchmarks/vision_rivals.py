"""What others use to tell shapes: rules on contours, EdgeDrawing's own ellipses, a trained classifier."""

from collections.abc import Callable, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray
from vision_data import Image

SIDE_PX = 64
LEAST_ELLIPSE = 0.4
"""EdgeDrawing's ellipse counts as the object if it is so long, of the picture's shorter side."""


def thing_in(image: Image) -> NDArray[np.int32] | None:
    """Contour of the largest thing that differs from its ground (threshold by Otsu's method)."""
    smooth = cv2.GaussianBlur(grey_of(image), (0, 0), 1.0)
    _, mask = cv2.threshold(smooth, 0, 255, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
    border = np.concatenate([mask[0], mask[-1], mask[:, 0], mask[:, -1]])
    if np.median(border) > 0:
        mask = 255 - mask
    contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    found = max(contours, key=lambda c: cv2.contourArea(cv2.convexHull(c)), default=None)
    return None if found is None or cv2.contourArea(cv2.convexHull(found)) == 0 else np.asarray(found)


def grey_of(image: Image) -> Image:
    grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    return np.ascontiguousarray(grey, np.uint8)


def by_contour(image: Image) -> str:
    """Number of corners of the contour as it is, after approximation within 4 % of its length."""
    contour = thing_in(image)
    return "nothing" if contour is None else _by_corners(contour)


def by_hull(image: Image) -> str:
    """Number of corners of its convex hull, after approximation within 4 % of its length."""
    contour = thing_in(image)
    return "nothing" if contour is None else _by_corners(cv2.convexHull(contour))


def _by_corners(contour: NDArray[np.int32]) -> str:
    corners = len(cv2.approxPolyDP(contour, 0.04 * cv2.arcLength(contour, True), True))
    return {3: "triangular", 4: "rectangular"}.get(corners, "elliptical")


def by_areas(image: Image) -> str:
    """The nearest of area over the areas of the smallest rectangle, the smallest triangle and the ellipse."""
    contour = thing_in(image)
    if contour is None:
        return "nothing"
    hull = cv2.convexHull(contour).astype(np.float32)
    area = cv2.contourArea(hull)
    _, size, _ = cv2.minAreaRect(hull)
    triangle, _ = cv2.minEnclosingTriangle(hull)
    moments = cv2.moments(hull)
    spread = moments["mu20"] * moments["mu02"] - moments["mu11"] ** 2
    ellipse = 4 * np.pi * np.sqrt(max(spread, 0.0)) / max(area, 1e-9)
    ratios = {
        "rectangular": area / max(size[0] * size[1], 1e-9),
        "triangular": area / max(triangle, 1e-9),
        "elliptical": min(area / max(ellipse, 1e-9), ellipse / max(area, 1e-9)) ** 4,
    }
    return max(ratios, key=ratios.__getitem__)


def by_ellipses(image: Image) -> str:
    """Elliptical if EdgeDrawing finds an ellipse of the picture's size; else by the corners of the hull."""
    grey = grey_of(image)
    longest = max((2 * float(e[2] + max(e[3:5])) for e in drawn_ellipses(grey)), default=0.0)
    return "elliptical" if longest >= LEAST_ELLIPSE * min(grey.shape) else by_hull(image)


def drawn_ellipses(grey: Image) -> NDArray[np.float64]:
    """EdgeDrawing's ellipses and circles: centre, radius of a circle, semi-axes, degrees; shape (N, 6)."""
    detector = cv2.ximgproc.createEdgeDrawing()
    detector.detectEdges(np.ascontiguousarray(grey))
    found = detector.detectEllipses()
    return np.zeros((0, 6)) if found is None else np.asarray(found, np.float64).reshape(-1, 6)


RULES: dict[str, Callable[[Image], str]] = {
    "contour, corners": by_contour,
    "hull, corners": by_hull,
    "hull, areas": by_areas,
    "EdgeDrawing's ellipse, else hull": by_ellipses,
}


def hog(image: Image) -> NDArray[np.float32]:
    """Histograms of oriented gradients of the whole picture at 64 x 64 px."""
    small = cv2.resize(grey_of(image), (SIDE_PX, SIDE_PX), interpolation=cv2.INTER_AREA)
    describe = cv2.HOGDescriptor((SIDE_PX, SIDE_PX), (16, 16), (8, 8), (8, 8), 9)
    return np.asarray(describe.compute(small), np.float32).ravel()


def trained(
    features: NDArray[np.float32], labels: Sequence[str] | NDArray[np.str_]
) -> Callable[[NDArray[np.float32]], NDArray[np.str_]]:
    """A support vector machine with a Gaussian kernel on histograms of oriented gradients."""
    from sklearn.svm import SVC

    model = SVC(C=10.0, gamma="scale")  # HOG is normalised already: scaling its columns ruins few examples
    model.fit(features, labels)
    return lambda others: np.asarray(model.predict(others), np.str_)
