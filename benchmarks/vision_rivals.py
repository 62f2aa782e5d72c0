"""What others use to tell shapes: rules on the convex hull, and a trained classifier (see `vision.py`)."""

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

CLASSES = ("rectangular", "triangular", "elliptical")
SEED = 1989
SIDE_PX = 64

Image = NDArray[np.uint8]


def rivals_of(training: list[tuple[str, Image, str]]) -> dict[str, Callable[[Image], str]]:
    """Every rival by name; the trained ones see clean pictures of the development split only."""
    known = [(label, image) for label, image, _ in training if label in CLASSES]
    rng = np.random.default_rng(SEED)
    found: dict[str, Callable[[Image], str]] = {"hull, corners": by_corners, "hull, areas": by_areas}
    for count in (5, 50, None):
        some: list[tuple[str, Image]] = []
        for label in CLASSES:
            mine = [pair for pair in known if pair[0] == label]
            order = rng.permutation(len(mine))[: count or len(mine)]
            some += [mine[i] for i in order]
        found[f"HOG + SVM, {count or 'all'}"] = trained(some)
    return found


def hull_of(image: Image) -> NDArray[np.float32] | None:
    """Convex hull of the largest thing that differs from its ground (threshold by Otsu's method)."""
    grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    smooth = cv2.GaussianBlur(grey, (0, 0), 1.0)
    _, mask = cv2.threshold(smooth, 0, 255, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
    border = np.concatenate([mask[0], mask[-1], mask[:, 0], mask[:, -1]])
    if np.median(border) > 0:
        mask = 255 - mask
    contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not contours:
        return None
    hull = max((cv2.convexHull(c) for c in contours), key=cv2.contourArea)
    return hull.astype(np.float32) if cv2.contourArea(hull) > 0 else None


def by_corners(image: Image) -> str:
    """Number of corners of the hull after approximation within 4 % of its length."""
    hull = hull_of(image)
    if hull is None:
        return "nothing"
    corners = len(cv2.approxPolyDP(hull, 0.04 * cv2.arcLength(hull, True), True))
    return {3: "triangular", 4: "rectangular"}.get(corners, "elliptical")


def by_areas(image: Image) -> str:
    """The nearest of area over the areas of the smallest rectangle, the smallest triangle and the ellipse."""
    hull = hull_of(image)
    if hull is None:
        return "nothing"
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


def trained(training: list[tuple[str, Image]]) -> Callable[[Image], str]:
    """Histograms of oriented gradients and a support vector machine with a Gaussian kernel."""
    from sklearn.svm import SVC

    model = SVC(C=10.0, gamma="scale")  # HOG is normalised already: scaling its columns ruins few examples
    model.fit(np.stack([hog(image) for _, image in training]), [label for label, _ in training])
    return lambda image: str(model.predict(hog(image)[None])[0])


def hog(image: Image) -> NDArray[np.float32]:
    """Histograms of oriented gradients of the whole picture at 64 x 64 px."""
    grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    small = cv2.resize(grey, (SIDE_PX, SIDE_PX), interpolation=cv2.INTER_AREA)
    describe = cv2.HOGDescriptor((SIDE_PX, SIDE_PX), (16, 16), (8, 8), (8, 8), 9)
    return np.asarray(describe.compute(small), np.float32).ravel()
