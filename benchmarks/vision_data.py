"""The pictures that the shape sensor is judged on: human drawings, road photographs and the signs in them.

Drawings are split by the person who drew them and signs by the photograph, by a fixed seed: thresholds are
tuned on `dev`, figures are reported on `test`. Occlusion erases an angular sector about the middle; noise is
Gaussian, its standard deviation in grey levels.
"""

import csv
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.images import read_image

SEED = 1989
CLASSES = ("rectangular", "triangular", "elliptical")
DRAWN = {"rectangle": "rectangular", "triangle": "triangular", "ellipse": "elliptical", "other": "other"}
Image: TypeAlias = NDArray[np.uint8]
Item: TypeAlias = tuple[str, Image, str]
"""Label (a class or ``other``), picture, and name."""
Change: TypeAlias = Callable[[Image, np.random.Generator], Image]
Box: TypeAlias = tuple[float, float, float, float]
"""x, y, width, height, px."""


def in_split(names: list[str], split: str) -> set[str]:
    """One half of the names, by the seed; `dev` or `test`."""
    order = np.random.default_rng(SEED).permutation(len(names))
    half = order[: len(names) // 2] if split == "dev" else order[len(names) // 2 :]
    return {names[i] for i in half}


def drawings(data: Path, split: str) -> Iterator[Item]:
    """Drawings of one half of the people; file names are `shape.person.number.png`."""
    files = {folder: sorted((data / "drawings" / folder).glob("*.png")) for folder in DRAWN}
    people = in_split(sorted({f.name.split(".")[1] for some in files.values() for f in some}), split)
    for folder, label in DRAWN.items():
        for file in files[folder]:
            if file.name.split(".")[1] in people:
                yield label, read_image(file), file.name


def sign_scenes(data: Path, split: str) -> Iterator[tuple[Image, list[dict[str, str]], str]]:
    """Photographs of one half, each with the rows of `labels.csv` that are about it, and its name."""
    with (data / "signs" / "labels.csv").open() as handle:
        rows = list(csv.DictReader(handle))
    files = sorted({r["file"] for r in rows})
    chosen = in_split(files, split)
    for file in (f for f in files if f in chosen):
        yield read_image(data / "signs" / file), [r for r in rows if r["file"] == file], file


def sign_crops(data: Path, split: str, margin: float = 0.15) -> Iterator[Item]:
    """The signs of one half of the photographs, cut out with a margin."""
    for image, rows, name in sign_scenes(data, split):
        for k, row in enumerate(rows):
            x, y, w, h = (int(v) for v in box_of(row))
            m = int(np.ceil(margin * max(w, h)))
            crop = image[max(0, y - m) : y + h + m, max(0, x - m) : x + w + m]
            yield "other" if row["shape"] == "octagon" else row["shape"], crop, f"{name}#{k}"


def box_of(row: dict[str, str]) -> Box:
    x, y, w, h = (float(row[c]) for c in ("x_px", "y_px", "width_px", "height_px"))
    return x, y, w, h


def group_of(name: str) -> str:
    """What items are held out together: the person who drew it, or the photograph that it is cut from."""
    return name.split("#")[0] if "#" in name else name.split(".")[1]


def folds(items: list[Item], split: str, dev: list[Item]) -> list[tuple[list[Item], list[int]]]:
    """Examples to learn from, and the numbers of the items to be judged by what was learned from them.

    On `test` the examples are all of `dev`. On `dev` each half of the people (photographs) is judged by what
    was learned from the other half.
    """
    if split != "dev":
        return [(dev, list(range(len(items))))]
    groups = sorted({group_of(name) for _, _, name in dev})
    first = set(np.random.default_rng(SEED + 1).permutation(groups)[: len(groups) // 2].tolist())
    found: list[tuple[list[Item], list[int]]] = []
    for side in (True, False):
        examples = [item for item in dev if (group_of(item[2]) in first) == side]
        judged = [i for i, item in enumerate(items) if (group_of(item[2]) in first) != side]
        found.append((examples, judged))
    return found


def occluded(share: float) -> Change:
    """What erases a sector of so many turns, in a random direction."""

    def erase(image: Image, rng: np.random.Generator) -> Image:
        height, width = image.shape[:2]
        y, x = np.mgrid[:height, :width]
        turn = (np.arctan2(y - height / 2, x - width / 2) / (2 * np.pi) - rng.random()) % 1
        out = image.copy()
        border = np.concatenate([image[0], image[-1], image[:, 0], image[:, -1]])
        out[turn < share] = np.median(border, axis=0).astype(np.uint8)
        return out

    return erase


def noisy(sigma: float) -> Change:
    """What adds noise of a standard deviation."""

    def add(image: Image, rng: np.random.Generator) -> Image:
        return np.clip(image + rng.normal(0, sigma, image.shape), 0, 255).astype(np.uint8)

    return add


def clean(image: Image, rng: np.random.Generator) -> Image:
    return image


CONDITIONS: dict[str, dict[str, Change]] = {
    "drawings": {"clean": clean, "25 %": occluded(0.25), "40 %": occluded(0.40), "noise 60": noisy(60)},
    "crops": {"clean": clean, "25 %": occluded(0.25), "40 %": occluded(0.40), "noise 40": noisy(40)},
}
SOURCES: dict[str, Callable[[Path, str], Iterator[Item]]] = {"drawings": drawings, "crops": sign_crops}
