"""Ellipses found in drawings of many that hide each other, and coins in a photograph.

An ellipse counts as found if it overlaps the true one by more than 0.8 (intersection over union), each once.
True ones are those of whose outline at least one half is seen. Found by us is the ellipse or circle of every
object that is said to be elliptical; by EdgeDrawing, every ellipse and circle of its own detector.
"""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray
from vision_data import SEED, Image
from vision_rivals import drawn_ellipses, grey_of
from vision_seen import See

from evifuse.recordings.images import read_image
from evifuse.vision import sense_shapes

PHOTO = Path(__file__).parents[1] / "tests" / "data" / "photos" / "coins.png"
TRUTH = Path(__file__).with_name("vision_coins.csv")
"""Ellipses fitted to the regions that a watershed of the gradient gives, and looked at: all 24 fit."""

COUNTS = (4, 12, 24)
PICTURES = 20
SIZE = (640, 480)
LEAST_OVERLAP = 0.8
LEAST_SEEN = 0.5
Ellipse: TypeAlias = NDArray[np.float64]
"""Centre x, y; semi-axes; degrees from x to y."""


def outline_of(ellipse: Ellipse, corners: int = 72) -> NDArray[np.float32]:
    x, y, a, b, degrees = ellipse
    turn = np.linspace(0, 2 * np.pi, corners, endpoint=False)
    c, s = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
    u, v = a * np.cos(turn), b * np.sin(turn)
    return np.column_stack([x + c * u - s * v, y + s * u + c * v]).astype(np.float32)


def drawn(count: int, seed: int) -> tuple[Image, list[NDArray[np.float32]]]:
    """Filled ellipses, each over those before; slightly blurred, with noise of 3 grey levels."""
    rng = np.random.default_rng([SEED, count, seed])
    width, height = SIZE
    grey = np.full((height, width), rng.uniform(40, 215), np.float64)
    owner = np.full((height, width), -1)
    outlines: list[NDArray[np.float32]] = []
    for number in range(count):
        a = rng.uniform(25, 90)
        b = a * rng.uniform(0.45, 1.0)
        place = rng.uniform([a, a], [width - a, height - a])
        outlines.append(outline_of(np.array([*place, a, b, rng.uniform(0, 180)])))
        inside = np.zeros((height, width), np.uint8)
        points = np.round(outlines[-1] * 16).astype(np.int32)
        cv2.fillPoly(inside, [points], 255, cv2.LINE_AA, 4)
        below = float(grey[inside > 128].mean())
        level = (below + rng.uniform(40, 215)) % 255
        grey = grey + (level - grey) * (inside / 255.0)
        owner[inside > 128] = number
    picture = cv2.GaussianBlur(grey, (0, 0), 0.7) + rng.normal(0, 3, grey.shape)
    seen = [o for n, o in enumerate(outlines) if _seen_share(o, n, owner) >= LEAST_SEEN]
    return np.clip(picture, 0, 255).astype(np.uint8), seen


def _seen_share(outline: NDArray[np.float32], number: int, owner: NDArray[np.int_]) -> float:
    """Share of an outline, a pixel inside, that nothing lies over."""
    inward = outline + (outline.mean(axis=0) - outline) * (2.0 / np.abs(np.ptp(outline, axis=0)).min())
    x, y = np.round(inward).astype(int).T
    return float((owner[y.clip(0, owner.shape[0] - 1), x.clip(0, owner.shape[1] - 1)] == number).mean())


def ours(picture: Image, see: See = sense_shapes) -> list[NDArray[np.float32]]:
    found: list[NDArray[np.float32]] = []
    for seen in see(picture):
        if seen.classification.decision == "elliptical":
            arcs = [h for h in seen.primitives if h.kind in ("ellipse", "circle")]
            found += [h.shape.astype(np.float32) for h in arcs[:1]]
    return found


def edge_drawing(picture: Image) -> list[NDArray[np.float32]]:
    found = drawn_ellipses(grey_of(picture))
    whole = [np.array([e[0], e[1], e[2] + e[3], e[2] + e[4], e[5]]) for e in found]
    return [outline_of(e) for e in whole]


def overlap_of(a: NDArray[np.float32], b: NDArray[np.float32]) -> float:
    """Intersection over union of two convex outlines."""
    if (a.max(axis=0) < b.min(axis=0)).any() or (b.max(axis=0) < a.min(axis=0)).any():
        return 0.0
    both = cv2.intersectConvexConvex(a, b)[0]
    return both / max(cv2.contourArea(a) + cv2.contourArea(b) - both, 1e-9)


def matched(found: Sequence[NDArray[np.float32]], true: Sequence[NDArray[np.float32]]) -> int:
    """How many true ones are found, each by one of the found ones, the best pairs first."""
    pairs = sorted(((overlap_of(f, t), i, j) for i, f in enumerate(found) for j, t in enumerate(true)))
    used: tuple[set[int], set[int]] = (set(), set())
    for share, i, j in reversed(pairs):
        if share > LEAST_OVERLAP and i not in used[0] and j not in used[1]:
            used[0].add(i)
            used[1].add(j)
    return len(used[0])


def ellipses(pictures: int = PICTURES, see: See = sense_shapes) -> dict[str, Any]:
    """F of both finders; of the drawings also the 95 % interval, pictures drawn anew with replacement."""
    sets = {f"{n} drawn": [drawn(n, seed) for seed in range(pictures)] for n in COUNTS}
    truth = np.loadtxt(TRUTH, delimiter=",", skiprows=1)
    sets["coins"] = [(read_image(PHOTO), [outline_of(row) for row in truth])]
    finders = {"evifuse": partial(ours, see=see), "EdgeDrawing": edge_drawing}
    figures: dict[str, Any] = {}
    for name, cases in sets.items():
        counted = {
            finder: np.array([_counts(find(image), true) for image, true in cases])
            for finder, find in finders.items()
        }
        figures[name] = {finder: _f_with_interval(rows) for finder, rows in counted.items()}
        figures[name]["pictures"], figures[name]["true"] = len(cases), sum(len(t) for _, t in cases)
    return figures


def _counts(
    found: Sequence[NDArray[np.float32]], true: Sequence[NDArray[np.float32]]
) -> tuple[int, int, int]:
    return matched(found, true), len(found), len(true)


def _f_with_interval(rows: NDArray[np.int_]) -> dict[str, Any]:
    rng = np.random.default_rng(SEED)
    drawn_again = rows[rng.integers(0, len(rows), (1000, len(rows)))].sum(axis=1)
    f = 2 * drawn_again[:, 0] / np.maximum(drawn_again[:, 1] + drawn_again[:, 2], 1)
    hit, found, true = rows.sum(axis=0).tolist()
    return {
        "f": 2 * hit / max(found + true, 1),
        "interval": np.quantile(f, [0.025, 0.975]).tolist() if len(rows) > 1 else None,
        "precision": hit / max(found, 1),
        "recall": hit / max(true, 1),
    }
