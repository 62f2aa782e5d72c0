"""Learn which shape an outline shows and which outline shows an object: `src/evifuse/knowledge/rivalry.yaml`.

Pictures are drawings and signs, clean and spoilt at random, signs drawn on pieces of photographs, and piles
of drawn shapes (`shape_pictures.py`). The likelihood of what a picture shows is the mean of the shares of its
family over all outlines, weighted by their standing; where a sign stands in a whole photograph, or its box is
known, outlines that do not bound it count as wrong. What is no sign of a photograph counts as texture, though
some of it has a shape. Weights are drawn towards 0 by a penalty on their squares.

The figures that are printed are cross-validated over everything: people and photographs are held out in turn.
The weights of the package are learned from both halves of the data. Those learned from one half only are kept
beside this file, `rivalry-dev.yaml` and `rivalry-test.yaml`, for `vision.py` to judge the other half with.

Usage: python benchmarks/train_shapes.py --data DIR [--write] [--every N] [--cache FILE]
DIR holds `drawings/` and `signs/`. Without `--write` nothing is changed.
"""

import argparse
import pickle
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from shape_pictures import Example, examples, piles, textures
from vision_data import SEED, Image, box_of, sign_scenes
from vision_measures import auroc, calibration

from evifuse.vision.group import same_object
from evifuse.vision.rivalry import FAMILIES, FARTHEST, KNOWN, Rivalry
from evifuse.vision.sensor import find_candidates
from evifuse.vision.working import working_picture

Array = NDArray[np.float64]

LABELS = ("triangular", "rectangular", "elliptical", "other", "texture")
"""What the families are called in the data, in their order; the first three are known."""

FOLDS = 3
PENALTY = 3.0
ROUNDS = 100
STRANGERS = 0.6
"""What strangers count: fewer are met than where the data was gathered (our own)."""

WEIGHTS = {"drawings": 1.5, "crops": 2.0, "drawn": 1.0, "scenes": 4.0, "textures": 1.0, "piles": 0.5}
"""What a picture of each source counts (tuned by cross-validation)."""

TEXTURES = 120
"""So many pictures that show nothing, and outlines of each."""

PER_TEXTURE = 8

PER_SCENE = 8
"""So many outlines of each photograph that are no sign, and of each pile that are no shape, are texture."""

PILES = 240
"""So many piles of drawn shapes."""

NOTHING = 0.15
"""What an outline of a photograph or a pile that is no object counts, of what an object there does."""

BOUNDED = 0.5
"""What the same picture counts again with only the outlines that bound the object, if all of it is seen."""

OVERLAP = 0.5
"""An outline bounds an object if their boxes overlap so much (intersection over union)."""

CLOSE = 0.8
"""The same in a pile, where others are near."""

FILE = Path(__file__).parents[1] / "src" / "evifuse" / "knowledge" / "rivalry.yaml"
HALVES = {s: Path(__file__).with_name(f"rivalry-{s}.yaml") for s in ("dev", "test")}
"""What was learned from one half of the people and photographs only."""

HEAD = """\
# Which shape an outline shows, and which outline of an object is believed: see evifuse.vision.rivalry.
# Written by benchmarks/train_shapes.py, which prints the figures too; change it there.
# Of each feature: its mean and spread; what a spread adds to the standing of an outline; what it adds to the
# logarithm of the odds of each family. What is none of the families is the stranger.
title: rivalry of shapes
source: >-
  learned by evifuse from WHAT the Hand-drawn Shapes Dataset, (c) 2022 Francois Robert, CC BY 4.0,
  and WHAT 154 photographs of the German Traffic Sign Detection Benchmark (Houben et al., 2013)
"""


@dataclass(frozen=True, eq=False)
class Case:
    """The outlines of one picture, or of one sign in a photograph.

    Parameters
    ----------
    source, group, condition : str
        As in `Example`.
    family : int
        What it is, in the order of the families.
    names : tuple of str
        Of the features.
    features : ndarray of float64, shape (B, F)
        Of each outline.
    bounds : ndarray of bool, shape (B,)
        Which outlines bound the object.
    weight : float
        What it counts.
    """

    source: str
    group: str
    condition: str
    family: int
    names: tuple[str, ...]
    features: Array
    bounds: NDArray[np.bool_]
    weight: float


def outlines_of(picture: Image) -> tuple[dict[str, Array], Array] | None:
    """Features and boxes, in pixels of the picture, of every outline."""
    working = working_picture(picture)
    found = find_candidates(working)
    if found is None:
        return None
    corners = found.boxes.reshape(-1, 2, 2)
    return dict(found.features), working.point(corners).reshape(-1, 4)


def cases_of(data: Path, split: str, every: int) -> list[Case]:
    """Everything that is learned from in a split."""
    rng = np.random.default_rng(SEED)
    found: list[Case] = []
    for e in examples(data, split, every):
        seen = outlines_of(e.picture)
        if seen is not None:
            found += _of_example(e, *seen)
    for image, rows, name in list(sign_scenes(data, split))[::every]:
        labels = ["other" if row["shape"] == "octagon" else row["shape"] for row in rows]
        places = [box_of(row) for row in rows]
        boxes = np.array([[x, y, x + w - 1, y + h - 1] for x, y, w, h in places])
        found += _of_scene(("scenes", name), image, labels, boxes, OVERLAP, rng)
    return found


def drawn_cases(every: int) -> list[Case]:
    """Everything that is learned from whatever the split: textures and piles."""
    rng = np.random.default_rng(SEED)
    found = _of_textures(every)
    for number, (picture, true) in enumerate(piles(PILES // every)):
        labels, boxes = [label for label, _ in true], np.array([box for _, box in true]).reshape(-1, 4)
        found += _of_scene(("piles", f"pile {number}"), picture, labels, boxes, CLOSE, rng)
    return found


def _of_scene(
    parts: tuple[str, str],
    picture: Image,
    labels: Sequence[str],
    boxes: Array,
    least: float,
    rng: np.random.Generator,
) -> list[Case]:
    """Each object with the outlines near it, and some outlines that are none."""
    seen = outlines_of(picture)
    if seen is None:
        return []
    names, columns = tuple(seen[0]), np.stack(list(seen[0].values()), axis=1)
    weight = WEIGHTS[parts[0]]
    found: list[Case] = []
    none = np.ones(len(columns), np.bool_)
    for label, box in zip(labels, boxes, strict=True):
        near = same_object(np.concatenate([box[None], seen[1]]))[0, 1:]
        bounds = overlap(seen[1], box) >= least
        none &= ~near if parts[0] == "scenes" else overlap(seen[1], box) < OVERLAP
        if (near & bounds).any():
            case = (*parts, parts[0], LABELS.index(label), names, columns[near])
            found.append(Case(*case, bounds[near], weight))
    for i in rng.permutation(np.flatnonzero(none))[:PER_SCENE]:
        case = (*parts, f"{parts[0]} none", LABELS.index("texture"), names, columns[i : i + 1])
        found.append(Case(*case, np.ones(1, np.bool_), NOTHING * weight))
    return found


def _of_textures(every: int) -> list[Case]:
    """Outlines in pictures that show nothing: each is a stranger."""
    rng = np.random.default_rng(SEED)
    found: list[Case] = []
    for number, picture in enumerate(textures(TEXTURES // every)):
        seen = outlines_of(picture)
        if seen is not None:
            columns = np.stack(list(seen[0].values()), axis=1)
            together = same_object(seen[1]) | np.eye(len(columns), dtype=np.bool_)
            for i in rng.permutation(len(columns))[:PER_TEXTURE]:
                case = ("textures", f"texture {number}", "textures", LABELS.index("texture"), tuple(seen[0]))
                mine = columns[together[i]]
                found.append(Case(*case, mine, np.ones(len(mine), np.bool_), WEIGHTS["textures"]))
    return found


def _of_example(e: Example, features: dict[str, Array], boxes: Array) -> list[Case]:
    columns = np.stack(list(features.values()), axis=1)
    parts = (e.source, e.group, e.condition, LABELS.index(e.label), tuple(features), columns)
    weight = WEIGHTS[e.source]
    found = [Case(*parts, np.ones(len(boxes), np.bool_), weight)]
    bounds = overlap(boxes, np.array(e.box)) >= OVERLAP
    if e.whole and bounds.any():
        found.append(Case(*parts[:2], "bounded", *parts[3:], bounds, BOUNDED * weight))
    return found


def overlap(boxes: Array, box: Array) -> Array:
    """Intersection over union of boxes x0, y0, x1, y1 with one of them, all pixels included."""
    inside = np.minimum(boxes[:, 2:], box[2:]) - np.maximum(boxes[:, :2], box[:2]) + 1
    both = np.clip(inside, 0, None).prod(axis=1)
    return both / ((boxes[:, 2:] - boxes[:, :2] + 1).prod(axis=1) + (box[2:] - box[:2] + 1).prod() - both)


def fit(cases: Sequence[Case]) -> Rivalry:
    """Weights that make what was seen most likely."""
    rows = np.concatenate([c.features for c in cases])
    mean, spread = rows.mean(axis=0), rows.std(axis=0) + 1e-6
    scaled = np.clip((rows - mean) / spread, -FARTHEST, FARTHEST)
    problem = _likelihood(np.column_stack([scaled, np.ones(len(scaled))]), cases)
    start = np.zeros((scaled.shape[1] + 1) * (1 + len(FAMILIES)))
    best = minimize(problem, start, jac=True, method="L-BFGS-B", options={"maxiter": ROUNDS}).x
    standing, families = np.split(best, [scaled.shape[1] + 1])
    families = families.reshape(-1, len(FAMILIES))
    return Rivalry(cases[0].names, mean, spread, standing[:-1], families[:-1], families[-1])


def _likelihood(scaled: Array, cases: Sequence[Case]) -> Callable[[Array], tuple[float, Array]]:
    """Negative logarithm of the likelihood, and its gradient, of standing and families in one row."""
    count = np.array([len(c.features) for c in cases])
    first = np.cumsum(count) - count
    owner = np.repeat(np.arange(len(cases)), count)
    family = np.array([c.family for c in cases])[owner]
    bounds = np.concatenate([c.bounds for c in cases]).astype(np.float64)
    stranger = LABELS.index("other")
    weight = np.array([c.weight * (STRANGERS if c.family == stranger else 1.0) for c in cases])
    every, width, kinds = np.arange(len(scaled)), scaled.shape[1], len(FAMILIES)
    hot = np.eye(kinds)[family]
    penalised = np.ones((width, 1 + kinds)) * PENALTY
    penalised[-1] = 0.0

    def value(flat: Array) -> tuple[float, Array]:
        table = np.column_stack([flat[:width], flat[width:].reshape(width, kinds)])
        odds = scaled @ table
        standing = np.exp(odds[:, 0] - np.maximum.reduceat(odds[:, 0], first)[owner])
        standing /= np.add.reduceat(standing, first)[owner]
        shares = np.exp(odds[:, 1:] - odds[:, 1:].max(axis=1, keepdims=True))
        shares /= shares.sum(axis=1, keepdims=True)
        joint = standing * bounds * shares[every, family]
        total = np.add.reduceat(joint, first) + 1e-9
        told = weight[owner] * joint / total[owner]
        slope = np.column_stack([told - weight[owner] * standing, told[:, None] * (hot - shares)])
        gradient = penalised * table - scaled.T @ slope
        loss = 0.5 * float((penalised * table**2).sum()) - float((weight * np.log(total)).sum())
        return loss, np.concatenate([gradient[:, 0], gradient[:, 1:].ravel()])

    return value


def shares_of(model: Rivalry, case: Case) -> Array:
    """Shares of the families in a picture."""
    shares, standing = model.judge(dict(zip(case.names, case.features.T, strict=True)))
    weight = np.exp(standing - standing.max())
    return weight @ shares / weight.sum()


def held_out(cases: Sequence[Case]) -> Array:
    """Shares of the families in every picture by models that have not seen its person or photograph."""
    fold = fold_of(cases)
    shares = np.zeros((len(cases), len(FAMILIES)))
    for k in range(FOLDS):
        model = fit([c for c, f in zip(cases, fold, strict=True) if f != k])
        for i in np.flatnonzero(fold == k):
            shares[i] = shares_of(model, cases[i])
    return shares


def fold_of(cases: Sequence[Case]) -> NDArray[np.intp]:
    """Which fold each case is held out in: all that is from one person or one photograph together."""
    order = np.random.default_rng(SEED).permutation(sorted({c.group for c in cases}))
    number = {group: k % FOLDS for k, group in enumerate(order.tolist())}
    return np.array([number[c.group] for c in cases])


def report(cases: Sequence[Case], shares: Array) -> None:
    """Accuracy, calibration and how well strangers are told, by source and condition."""
    print(f"{'held out':20}{'right':>7}{'ECE':>7}{'AUROC':>7}{'n':>6}")
    kinds = sorted({(c.source, c.condition) for c in cases if c.condition != "bounded"})
    family = np.array([c.family for c in cases])
    doubt = shares[:, len(KNOWN) :].sum(axis=1)
    pignistic = shares[:, : len(KNOWN)] + doubt[:, None] / len(KNOWN)
    for kind in kinds:
        mine = np.array([(c.source, c.condition) == kind for c in cases])
        known = mine & (family < len(KNOWN))
        if not known.any():
            print(f"{' '.join(kind):20}  mean doubt {doubt[mine].mean():.3f}{mine.sum():6}")
            continue
        right = (pignistic[known].argmax(axis=1) == family[known]).mean()
        error = calibration(pignistic[known], family[known])["error"]
        strange = auroc(doubt[known], doubt[mine & ~known])
        print(f"{' '.join(kind):20}{right:7.3f}{error:7.3f}{strange or np.nan:7.3f}{known.sum():6}")


def written(model: Rivalry, what: str = "all of") -> str:
    """The model as YAML, learned from so much of the data."""
    lines = [
        HEAD.replace("WHAT", what) + f"families: [{', '.join(FAMILIES)}]",
        f"constants: {_numbers(model.constants)}",
    ]
    lines.append(f"features:  # mean, spread, standing, {', '.join(FAMILIES)}")
    rows = np.column_stack([model.mean, model.spread, model.standing, model.families])
    lines += [f"  {name}: {_numbers(row)}" for name, row in zip(model.features, rows, strict=True)]
    return "\n".join(lines) + "\n"


def _numbers(values: Array) -> str:
    return "[" + ", ".join(f"{v:.3f}" for v in values + 0.0) + "]"


def main() -> None:
    parser = argparse.ArgumentParser(description="Learn the rivalry of shapes.")
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--write", action="store_true", help="replace the model of the package")
    parser.add_argument("--every", type=int, default=1, help="take every N-th picture only")
    parser.add_argument(
        "--cache", type=Path, help="keep what was seen here, and start from it if it is there"
    )
    options = parser.parse_args()
    cv2.setNumThreads(1)
    started = time.perf_counter()
    if options.cache and options.cache.exists():
        cases = pickle.loads(options.cache.read_bytes())
    else:
        cases = {half: cases_of(options.data, half, options.every) for half in HALVES}
        cases["drawn"] = drawn_cases(options.every)
        if options.cache:
            options.cache.write_bytes(pickle.dumps(cases))
    every = [case for some in cases.values() for case in some]
    print(f"{len(every)} cases, {time.perf_counter() - started:.0f} s")
    if options.write:
        for half, file in HALVES.items():
            what = f"the half called {half} of"
            file.write_text(written(fit(cases[half] + cases["drawn"]), what), encoding="utf-8")
        FILE.write_text(written(fit(every)), encoding="utf-8")
        print(
            f"wrote {FILE.name} and, from each half, {' and '.join(f.name for f in HALVES.values())}",
            flush=True,
        )
    report(every, held_out(every))
    print(f"{time.perf_counter() - started:.0f} s in all")


if __name__ == "__main__":
    sys.exit(main())
