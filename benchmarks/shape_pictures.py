"""The pictures that the shape sensor learns from: drawings and signs, spoilt at random, and drawn ones.

There are few signs of each shape among the photographs, so signs are drawn as well, of any shape and colour,
on pieces of the photographs that show no sign: rounded corners, rims, figures, posts, shade, blur. Piles of
drawn shapes that hide each other show which outlines are of one object, and which of two.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from vision_data import SEED, Image, box_of, drawings, group_of, noisy, occluded, sign_scenes

Array = NDArray[np.float64]

DRAWN_SIGNS = 700
KINDS = {"triangular": 0.28, "rectangular": 0.34, "elliptical": 0.28, "other": 0.10}
PAINTS = (
    (40, 30, 190),
    (250, 250, 250),
    (170, 90, 20),
    (60, 210, 240),
    (130, 130, 130),
    (20, 20, 20),
    (235, 235, 235),
    (30, 140, 240),
)
FINER = 4
"""Signs are drawn so many times larger, and then reduced."""


@dataclass(frozen=True, eq=False)
class Example:
    """A picture of one object.

    Parameters
    ----------
    source : str
        Where it is from: `drawings`, `crops` or `drawn`.
    label : str
        A class, or `other`.
    group : str
        What is held out together: the person, or the photograph.
    picture : Image
        Grey or BGR.
    box : tuple of float
        Bounds of the object, x0, y0, x1, y1, px.
    whole : bool
        Whether all of the object is seen.
    condition : str
        How the picture was spoilt.
    """

    source: str
    label: str
    group: str
    picture: Image
    box: tuple[float, float, float, float]
    whole: bool
    condition: str


def examples(data: Path, split: str, every: int = 1) -> Iterator[Example]:
    """Every picture of a split to learn from, in a fixed order; or each so many only."""
    rng = np.random.default_rng(SEED)
    for label, picture, name in list(drawings(data, split))[::every]:
        dark = np.nonzero((picture if picture.ndim == 2 else picture.min(axis=2)) < 128)
        box = (dark[1].min(), dark[0].min(), dark[1].max(), dark[0].max())
        base = Example("drawings", label, group_of(name), picture, box, True, "clean")
        yield from _spoilt(base, rng, most_noise=60.0, rounds=1)
    scenes = list(sign_scenes(data, split))
    for label, picture, name, box in list(_crops(scenes))[::every]:
        base = Example("crops", label, group_of(name), picture, box, True, "clean")
        yield from _spoilt(base, rng, most_noise=40.0, rounds=2)
    for label, picture, name, box in list(_drawn_signs(scenes, DRAWN_SIGNS))[::every]:
        base = Example("drawn", label, name, picture, box, True, "clean")
        yield base
        yield _changed(base, rng, rng.uniform(0.1, 0.45), 0.0, "occluded")
        yield _changed(base, rng, 0.0, rng.uniform(10, 45), "noise")


def piles(count: int) -> Iterator[tuple[Image, list[tuple[str, Array]]]]:
    """Drawn shapes over each other, with label and bounds of those of whose outline one third is seen."""
    rng = np.random.default_rng(SEED + 4)
    for _ in range(count):
        height, width = rng.integers(200, 480, 2).tolist()
        picture = np.full((height, width, 3), rng.uniform(30, 225, 3))
        owner = np.full((height, width), -1)
        corners: list[tuple[str, Array]] = []
        for number in range(int(rng.integers(2, 16))):
            label = str(rng.choice(list(KINDS)[:3], p=[0.2, 0.3, 0.5]))
            size = float(np.exp(rng.uniform(np.log(30), np.log(0.6 * min(height, width)))))
            shape = _corners(label, round(1.3 * size), size, rng) - 0.65 * size
            shape += rng.uniform([0.5 * size] * 2, [width - 0.5 * size, height - 0.5 * size])
            mask = np.zeros((height, width), np.uint8)
            cv2.fillPoly(mask, [np.round(shape * 16).astype(np.int32)], (255,), cv2.LINE_AA, 4)
            below = picture[mask > 128].mean(axis=0) if (mask > 128).any() else picture[0, 0]
            paint = (below + rng.choice([-1, 1], 3) * rng.uniform(20, 110, 3)).clip(0, 255)
            picture += (paint - picture) * (mask / 255.0)[..., None]
            owner[mask > 128] = number
            corners.append((label, shape))
        picture = cv2.GaussianBlur(picture, (0, 0), rng.uniform(0.4, 1.4))
        picture += rng.normal(0, rng.uniform(0.5, 6), picture.shape)
        true = [
            (label, np.append(shape.min(axis=0), shape.max(axis=0)))
            for number, (label, shape) in enumerate(corners)
            if _seen(shape, number, owner) >= 1 / 3
        ]
        yield np.clip(picture, 0, 255).astype(np.uint8), true


def _seen(shape: Array, number: int, owner: NDArray[np.int_]) -> float:
    """Share of an outline, just inside it, that nothing lies over."""
    t = np.linspace(0, 1, 24, endpoint=False)[:, None]
    around = np.concatenate([a + t * (b - a) for a, b in zip(shape, np.roll(shape, -1, axis=0), strict=True)])
    x, y = np.round(around + (shape.mean(axis=0) - around) * 0.05).astype(int).T
    inside = (x >= 0) & (y >= 0) & (x < owner.shape[1]) & (y < owner.shape[0])
    return float((owner[y[inside], x[inside]] == number).sum() / len(around))


def textures(count: int) -> Iterator[Image]:
    """Pictures that show nothing: smooth noise of one or all wavelengths, grains of salt and pepper."""
    rng = np.random.default_rng(SEED + 3)
    for _ in range(count):
        height, width = rng.integers(100, 400, 2).tolist()
        blur = float(np.exp(rng.uniform(np.log(1.5), np.log(12))))
        if rng.random() < 0.2:
            grains = rng.random((height, width))
            share = rng.uniform(0.01, 0.08)
            smooth = np.where(grains < share, -3.0, np.where(grains > 1 - share, 3.0, 0.0))
        elif rng.random() < 0.6:
            smooth = cv2.GaussianBlur(rng.normal(0, 1, (height, width)), (0, 0), blur)
        else:
            smooth = np.zeros((height, width))
            for step in (4, 8, 16, 32):
                coarse = rng.normal(0, step, (height // step + 1, width // step + 1))
                smooth += cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC)
        yield np.clip(128 + rng.uniform(15, 60) * smooth / smooth.std(), 0, 255).astype(np.uint8)


def _spoilt(base: Example, rng: np.random.Generator, most_noise: float, rounds: int) -> Iterator[Example]:
    yield base
    for _ in range(rounds):
        yield _changed(base, rng, 0.25, 0.0, "25 %")
        yield _changed(base, rng, 0.40, 0.0, "40 %")
        yield _changed(base, rng, 0.0, most_noise, "noise")
        yield _changed(base, rng, rng.uniform(0.02, 0.45), 0.0, "some")


def _changed(base: Example, rng: np.random.Generator, hidden: float, sigma: float, name: str) -> Example:
    picture = occluded(hidden)(base.picture, rng) if hidden else base.picture
    picture = noisy(sigma)(picture, rng) if sigma else picture
    return Example(base.source, base.label, base.group, picture, base.box, not hidden, name)


def _crops(
    scenes: list[tuple[Image, list[dict[str, str]], str]], margin: float = 0.15
) -> Iterator[tuple[str, Image, str, tuple[float, float, float, float]]]:
    for image, rows, name in scenes:
        for k, row in enumerate(rows):
            x, y, w, h = (int(v) for v in box_of(row))
            m = int(np.ceil(margin * max(w, h)))
            left, top = max(0, x - m), max(0, y - m)
            box = (x - left, y - top, x - left + w - 1, y - top + h - 1)
            label = "other" if row["shape"] == "octagon" else row["shape"]
            yield label, image[top : y + h + m, left : x + w + m], f"{name}#{k}", box


def _drawn_signs(
    scenes: list[tuple[Image, list[dict[str, str]], str]], count: int
) -> Iterator[tuple[str, Image, str, tuple[float, float, float, float]]]:
    """Signs on pieces of photographs."""
    rng = np.random.default_rng(SEED + 2)
    for _ in range(count):
        image, rows, name = scenes[rng.integers(len(scenes))]
        label = str(rng.choice(list(KINDS), p=list(KINDS.values())))
        side = round(1.3 * np.exp(rng.uniform(np.log(22), np.log(110))))
        picture, box = _sign(label, _ground(image, rows, side, rng), rng)
        yield label, picture, name, box


def _ground(image: Image, rows: list[dict[str, str]], side: int, rng: np.random.Generator) -> Image:
    """A square of a photograph, not of the road in front, that shows no sign."""
    height, width = image.shape[:2]
    while True:
        x, y = int(rng.integers(0, width - side)), int(rng.integers(0, int(0.8 * height) - side))
        boxes = [box_of(row) for row in rows]
        if not any(
            x < a + w + 5 and x + side > a - 5 and y < b + h + 5 and y + side > b - 5 for a, b, w, h in boxes
        ):
            return np.ascontiguousarray(image[y : y + side, x : x + side])


def _sign(
    label: str, ground: Image, rng: np.random.Generator
) -> tuple[Image, tuple[float, float, float, float]]:
    side = ground.shape[0] * FINER
    size = side / 1.3
    corners = _corners(label, side, size, rng)
    radius = size * rng.choice([0, 0.03, 0.06, 0.09]) * rng.uniform(0.5, 1.2)
    radius = radius if label in ("triangular", "rectangular") else 0.0
    large = np.ascontiguousarray(cv2.resize(ground, (side, side), interpolation=cv2.INTER_LINEAR))
    paints = [
        tuple(rng.uniform(0.55, 1.0) * np.array(PAINTS[k], np.float64)) for k in rng.permutation(len(PAINTS))
    ]
    if rng.random() < 0.5:  # a post
        half, x = int(side * rng.uniform(0.015, 0.03)), int(side / 2 + rng.normal(0, 0.01 * side))
        large[side // 2 :, x - half : x + half + 1] = rng.uniform(60, 170)
    outer = _rounded(corners, radius, side)
    large[outer > 0] = paints[0]
    if rng.random() < 0.75:  # a rim
        inner = (corners - side / 2) * rng.uniform(0.6, 0.9) + side / 2
        large[_rounded(inner, radius * rng.uniform(0.3, 1), side) > 0] = paints[1]
    if rng.random() < 0.75:
        _figure(large, size * (0.18 if label == "triangular" else 0.25), paints[2], rng)
    picture = cv2.resize(large, ground.shape[1::-1], interpolation=cv2.INTER_AREA).astype(np.float64)
    mask = cv2.resize(outer, ground.shape[1::-1], interpolation=cv2.INTER_AREA) / 255.0
    box = (*(corners.min(axis=0) / FINER), *(corners.max(axis=0) / FINER))
    return _photographed(picture, mask, rng), tuple(float(v) for v in box)  # type: ignore[return-value]


def _corners(label: str, side: int, size: float, rng: np.random.Generator) -> Array:
    """Corners of the outline of a sign, seen a little from the side."""
    turn = rng.normal(0, 0.07)
    if label == "elliptical":
        t = np.linspace(0, 2 * np.pi, 90)[:-1]
        points = (
            np.column_stack([np.cos(t), np.sin(t) * rng.choice([1.0, rng.uniform(0.6, 1)], p=[0.6, 0.4])]) / 2
        )
        turn = rng.uniform(0, np.pi)
    elif label == "triangular":
        t = np.arange(3) * 2 * np.pi / 3 - np.pi / 2
        points = np.column_stack([np.cos(t), rng.uniform(0.75, 1.15) * np.sin(t)]) / np.sqrt(3)
        turn += rng.choice([0.0, np.pi, rng.uniform(0, 2 * np.pi)], p=[0.4, 0.4, 0.2])
    elif label == "rectangular":
        high = rng.choice([1.0, rng.uniform(0.4, 1)], p=[0.6, 0.4])
        points = np.array([[-1, -high], [1, -high], [1, high], [-1, high]]) / 2
        turn += rng.choice([0.0, np.pi / 4, rng.uniform(0, 2 * np.pi)], p=[0.4, 0.5, 0.1])
        points *= min(1.0, 1 / np.abs(points @ _turned(turn)).max() / 2)
    else:
        t = (np.arange(k := int(rng.choice([8, 6, 5], p=[0.7, 0.15, 0.15]))) + 0.5) * 2 * np.pi / k
        points = np.column_stack([np.cos(t), np.sin(t)]) * 0.52
    points = points @ _turned(turn) * size
    points[:, 0] *= rng.uniform(0.88, 1.0)
    return points * (1 + points @ rng.normal(0, 0.08 / size, (2, 1))) + side / 2


def _turned(angle: float) -> Array:
    return np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])


def _rounded(corners: Array, radius: float, side: int) -> Image:
    """Mask of a polygon with round corners."""
    mask = np.zeros((side, side), np.uint8)
    cv2.fillPoly(mask, [np.round(corners).astype(np.int32)], (255,))
    if radius < 1:
        return mask
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * int(radius) + 1,) * 2)
    return np.asarray(cv2.morphologyEx(mask, cv2.MORPH_OPEN, disc), np.uint8)


def _figure(picture: Image, reach: float, paint: Any, rng: np.random.Generator) -> None:
    """A number, a bar or some patches in the middle."""
    middle, what = picture.shape[0] / 2, rng.integers(3)
    if what == 0:
        at = (int(middle - reach), int(middle + reach / 2))
        font = cv2.FONT_HERSHEY_SIMPLEX
        cv2.putText(picture, str(rng.integers(20, 130)), at, font, reach / 42, paint, max(1, int(reach / 6)))
    elif what == 1:
        for _ in range(rng.integers(1, 4)):
            patch = 0.8 * rng.uniform(-reach, reach, (rng.integers(3, 6), 2)) + middle
            cv2.fillPoly(picture, [patch.astype(np.int32)], paint)
    else:
        low, high = middle - reach * np.array([1.3, 0.3]), middle + reach * np.array([1.3, 0.3])
        cv2.rectangle(picture, tuple(low.astype(int).tolist()), tuple(high.astype(int).tolist()), paint, -1)


def _photographed(picture: Array, mask: Array, rng: np.random.Generator) -> Image:
    """Blurred, perhaps in the shade, with the noise of a camera."""
    blur = rng.uniform(0, 1.4)
    if blur > 0.3:
        picture = cv2.GaussianBlur(picture, (0, 0), blur)
    if rng.random() < 0.35:
        shade = rng.uniform(0.08, 0.5)
        picture = picture * (shade if rng.random() < 0.5 else 1 - mask[..., None] * (1 - shade))
    return np.clip(picture + rng.normal(0, rng.uniform(0.5, 3), picture.shape), 0, 255).astype(np.uint8)
