"""How exactly corners and ellipses are seen: on pictures of known shapes, drawn without aliasing.

Convex polygons and ellipses at random places are drawn at eight times the size, averaged down, blurred a
little, and given noise. Printed are the median and 95th percentile of the distance of corners from
where they are, the medians of that of centres and of the error of axes, and the share of corners inside the
ellipse of 95 % that the sensor states for them.

Usage: python benchmarks/corners.py [--count 30] [--json FILE]
"""

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from evifuse.vision import sense_shapes

SIZE = (240, 320)
FINE = 8
WITHIN_95 = 5.991
"""Squared Mahalanobis distance in the plane that 95 % of normal errors do not exceed."""


Inside: TypeAlias = Callable[[NDArray[np.float32], NDArray[np.float32]], NDArray[np.bool_]]
"""Whether points x and y lie in a shape."""


def drawn(inside: Inside, blur_px: float, noise: float, random: np.random.Generator) -> NDArray[np.uint8]:
    """A dark shape on light ground, by a function of x and y that says what is inside."""
    import cv2

    y, x = (((np.arange(n * FINE) + 0.5) / FINE - 0.5).astype(np.float32) for n in SIZE)
    fine = np.where(inside(x[None, :], y[:, None]), np.float32(70), np.float32(180))
    image = fine.reshape(SIZE[0], FINE, SIZE[1], FINE).mean(axis=(1, 3), dtype=np.float64)
    if blur_px:
        image = np.asarray(cv2.GaussianBlur(image, (0, 0), blur_px), np.float64)
    return np.clip(np.round(image + random.normal(0, noise, SIZE)), 0, 255).astype(np.uint8)


def polygon(corners: NDArray[np.float64]) -> Inside:
    """What is inside a convex polygon, clockwise on the screen."""

    def inside(x: NDArray[np.float32], y: NDArray[np.float32]) -> NDArray[np.bool_]:
        inner = np.ones(np.broadcast(x, y).shape, np.bool_)
        for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            inner &= (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0) >= 0
        return inner

    return inside


def ellipse(centre: NDArray[np.float64], half: NDArray[np.float64], turn: float) -> Inside:
    """What is inside an ellipse."""
    c, s = np.cos(turn), np.sin(turn)

    def inside(x: NDArray[np.float32], y: NDArray[np.float32]) -> NDArray[np.bool_]:
        u = c * (x - centre[0]) + s * (y - centre[1])
        v = c * (y - centre[1]) - s * (x - centre[0])
        return (u / half[0]) ** 2 + (v / half[1]) ** 2 <= 1

    return inside


def random_polygon(kind: str, random: np.random.Generator) -> NDArray[np.float64]:
    """Corners of a rectangle or triangle of 60 to 160 px at a random place, clockwise on the screen."""
    if kind == "rectangle":
        w, h = random.uniform(60, 150), random.uniform(50, 100)
        corners = np.array([[-w, -h], [w, -h], [w, h], [-w, h]]) / 2
    else:
        w, h, tip = random.uniform(80, 150), random.uniform(70, 120), random.uniform(-20, 20)
        corners = np.array([[-w / 2, h / 2], [tip, -h / 2], [w / 2, h / 2]])
    turn = random.uniform(-np.pi, np.pi)
    c, s = np.cos(turn), np.sin(turn)
    return corners @ np.array([[c, s], [-s, c]]) + (160, 120) + random.uniform(-15, 15, 2)


def run(count: int, noise: float, blur_px: float, seed: int) -> dict[str, float]:
    """Errors of one level of noise."""
    random = np.random.default_rng(seed)
    apart: list[float] = []
    within: list[bool] = []
    centres: list[float] = []
    axes: list[float] = []
    missed = 0
    for i in range(count):
        kind = ("rectangle", "triangle")[i % 2]
        truth = random_polygon(kind, random)
        found = _best(drawn(polygon(truth), blur_px, noise, random), kind)
        if found is None:
            missed += 1
        else:
            corners = np.array(found["corners"])
            nearest = np.linalg.norm(truth[:, None] - corners[None], axis=2).argmin(axis=1)
            off = corners[nearest] - truth
            apart += np.linalg.norm(off, axis=1).tolist()
            if "corners_covariance_px2" in found:
                cov = np.array(found["corners_covariance_px2"])[nearest]
                within += (
                    (off[:, None] @ np.linalg.solve(cov, off[..., None]))[:, 0, 0] <= WITHIN_95
                ).tolist()
        centre = np.array([160, 120]) + random.uniform(-15, 15, 2)
        half = np.sort(random.uniform(25, 70, 2))[::-1]
        found = _best(drawn(ellipse(centre, half, random.uniform(0, 3)), blur_px, noise, random), "ellipse")
        if found is None:
            missed += 1
        else:
            centres.append(float(np.linalg.norm(np.array(found["centre"]) - centre)))
            axes += np.abs(np.array(found["axes"]) - 2 * half).tolist()
    return {
        "noise": noise,
        "blur_px": blur_px,
        "corner_median_px": float(np.median(apart)),
        "corner_95_px": float(np.quantile(apart, 0.95)),
        "within_95": float(np.mean(within)) if within else float("nan"),
        "centre_median_px": float(np.median(centres)),
        "axes_median_px": float(np.median(axes)),
        "missed": missed,
    }


def _best(image: NDArray[np.uint8], kind: str) -> dict[str, Any] | None:
    """Geometry of the first object, as the kind that it is."""
    for seen in sense_shapes(image)[:1]:
        for found in seen.primitives:
            if found.kind == kind:
                return dict(found.geometry)
    return None


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=30, help="polygons and ellipses per row")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    rows: list[dict[str, float]] = []
    print("noise  blur  corners: median  95 %   inside 95 %   ellipses: centre  axes   missed")
    for blur_px in (0.0, 0.7, 1.5):
        for noise in (0.0, 5.0, 10.0, 20.0):
            rows.append(run(options.count, noise, blur_px, seed=7))
            r = rows[-1]
            print(
                f"{noise:5.0f} {blur_px:5.1f} {r['corner_median_px']:16.3f} {r['corner_95_px']:6.3f}"
                f" {r['within_95']:12.3f} {r['centre_median_px']:17.3f} {r['axes_median_px']:6.3f}"
                f" {r['missed']:8.0f}",
                flush=True,
            )
    if options.json:
        options.json.write_text(json.dumps(rows, indent=2), encoding="utf-8")


if __name__ == "__main__":
    main()
