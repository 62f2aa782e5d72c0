"""Accuracy of the shape sensor on human drawings and on road photographs.

Each figure is the share of right decisions (rectangular, triangular, elliptical) of the most believed
object, with the 95 % interval of Wilson; `AUROC` says how well mass on the frame tells drawings and signs of
other shapes from those of the three. Drawings are split by the person who drew them and signs by the
photograph, by a fixed seed: thresholds are tuned on `dev`, figures are reported on `test`. Occlusion erases
an angular sector about the middle; noise is Gaussian, its standard deviation in grey levels.

With `--rivals` the same pictures are given to others in the same run: contour approximation on the convex
hull, area ratios, and HOG with a support vector machine trained on clean pictures of `dev`, 5 or 50 of each
class or all.

Usage: python benchmarks/vision.py --data DIR [--split test] [--json FILE] [--quick N] [--rivals]
DIR holds `drawings/` and `signs/`.
"""

import argparse
import csv
import json
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from vision_rivals import rivals_of

SEED = 1989
CLASSES = ("rectangular", "triangular", "elliptical")
DRAWN = {"rectangle": "rectangular", "triangle": "triangular", "ellipse": "elliptical", "other": "other"}
Image = NDArray[np.uint8]


def in_split(names: list[str], split: str) -> set[str]:
    """One half of the names, by the seed; `dev` or `test`."""
    order = np.random.default_rng(SEED).permutation(len(names))
    half = order[: len(names) // 2] if split == "dev" else order[len(names) // 2 :]
    return {names[i] for i in half}


def drawings(data: Path, split: str) -> Iterator[tuple[str, Image, str]]:
    """Drawings of one half of the people; file names are `shape.person.number.png`."""
    from evifuse.recordings.images import read_image

    files = {folder: sorted((data / "drawings" / folder).glob("*.png")) for folder in DRAWN}
    people = in_split(sorted({f.name.split(".")[1] for some in files.values() for f in some}), split)
    for folder, label in DRAWN.items():
        for file in files[folder]:
            if file.name.split(".")[1] in people:
                yield label, read_image(file), file.name


def sign_scenes(data: Path, split: str) -> Iterator[tuple[Image, list[dict[str, str]], str]]:
    from evifuse.recordings.images import read_image

    with (data / "signs" / "labels.csv").open() as handle:
        rows = list(csv.DictReader(handle))
    files = sorted({r["file"] for r in rows})
    chosen = in_split(files, split)
    for file in (f for f in files if f in chosen):
        yield read_image(data / "signs" / file), [r for r in rows if r["file"] == file], file


def sign_crops(data: Path, split: str, margin: float = 0.15) -> Iterator[tuple[str, Image, str]]:
    for image, rows, name in sign_scenes(data, split):
        for k, row in enumerate(rows):
            x, y, w, h = (int(row[c]) for c in ("x_px", "y_px", "width_px", "height_px"))
            m = int(np.ceil(margin * max(w, h)))
            crop = image[max(0, y - m) : y + h + m, max(0, x - m) : x + w + m]
            yield "other" if row["shape"] == "octagon" else row["shape"], crop, f"{name}#{k}"


def occluded(share: float) -> Callable[[Image, np.random.Generator], Image]:
    def erase(image: Image, rng: np.random.Generator) -> Image:
        height, width = image.shape[:2]
        y, x = np.mgrid[:height, :width]
        turn = (np.arctan2(y - height / 2, x - width / 2) / (2 * np.pi) - rng.random()) % 1
        out = image.copy()
        border = np.concatenate([image[0], image[-1], image[:, 0], image[:, -1]])
        out[turn < share] = np.median(border, axis=0).astype(np.uint8)
        return out

    return erase


def noisy(sigma: float) -> Callable[[Image, np.random.Generator], Image]:
    def add(image: Image, rng: np.random.Generator) -> Image:
        return np.clip(image + rng.normal(0, sigma, image.shape), 0, 255).astype(np.uint8)

    return add


def clean(image: Image, rng: np.random.Generator) -> Image:
    return image


CONDITIONS: dict[str, dict[str, Callable[[Image, np.random.Generator], Image]]] = {
    "drawings": {"clean": clean, "25 %": occluded(0.25), "40 %": occluded(0.40), "noise 60": noisy(60)},
    "crops": {"clean": clean, "25 %": occluded(0.25), "40 %": occluded(0.40), "noise 40": noisy(40)},
}


def interval(right: int, count: int) -> tuple[float, float]:
    """95 % interval of Wilson."""
    if count == 0:
        return 0.0, 1.0
    p, z = right / count, 1.96
    middle = (p + z * z / (2 * count)) / (1 + z * z / count)
    half = z * np.sqrt(p * (1 - p) / count + z * z / (4 * count**2)) / (1 + z * z / count)
    return float(middle - half), float(middle + half)


def auroc(known: list[float], other: list[float]) -> float | None:
    """Share of pairs of a known and another shape of which the other one has the higher value."""
    if not known or not other:
        return None
    a, b = np.array(known)[:, None], np.array(other)[None]
    return float((b > a).mean() + 0.5 * (b == a).mean())


def accuracy(
    items: list[tuple[str, Image, str]], change: Callable[[Image, np.random.Generator], Image]
) -> dict:
    from evifuse.vision import sense_shapes

    rng = np.random.default_rng(SEED)
    tally: dict[str, list[int]] = {c: [0, 0] for c in CLASSES}
    nothing, doubt, wrong = 0, {"known": [], "other": []}, []
    started = time.perf_counter()
    for label, image, name in items:
        seen = sense_shapes(change(image, rng))
        ignorance = seen[0].evidence.as_dict().get("frame", 0.0) if seen else 1.0
        doubt["other" if label == "other" else "known"].append(ignorance)
        if label == "other":
            continue
        decision = seen[0].classification.decision if seen else None
        nothing += decision is None
        tally[label][0] += decision == label
        tally[label][1] += 1
        if decision != label:
            wrong.append((name, label, decision))
    right, count = (sum(t[i] for t in tally.values()) for i in (0, 1))
    return {
        "accuracy": right / max(count, 1),
        "interval": interval(right, count),
        "count": count,
        "per_class": {c: t[0] / max(t[1], 1) for c, t in tally.items()},
        "nothing_seen": nothing,
        "mean_frame_mass": {k: float(np.mean(v)) for k, v in doubt.items() if v},
        "auroc": auroc(doubt["known"], doubt["other"]),
        "ms_per_image": 1000 * (time.perf_counter() - started) / max(len(items), 1),
        "wrong": wrong,
    }


def rival_accuracy(
    items: list[tuple[str, Image, str]],
    change: Callable[[Image, np.random.Generator], Image],
    rival: Callable[[Image], str],
) -> float:
    """Share of right decisions of a rival on the very same pictures."""
    rng = np.random.default_rng(SEED)
    right = [
        rival(picture) == label
        for label, picture in ((i[0], change(i[1], rng)) for i in items)
        if label in CLASSES
    ]
    return float(np.mean(right))


def overlap(a: tuple[float, ...], b: tuple[float, ...]) -> float:
    """Intersection over union of two boxes x, y, w, h."""
    w = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    h = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    both = max(w, 0) * max(h, 0)
    return both / (a[2] * a[3] + b[2] * b[3] - both)


def scenes(data: Path, split: str, limit: int | None) -> dict:
    """Signs found in whole photographs: box overlap of at least one half, and the right decision."""
    from evifuse.vision import sense_shapes

    found, right, count, objects, times, missed = 0, 0, 0, [], [], []
    for image, rows, name in list(sign_scenes(data, split))[:limit]:
        started = time.perf_counter()
        seen = sense_shapes(image)
        times.append(time.perf_counter() - started)
        objects.append(len(seen))
        for row in rows:
            if row["shape"] == "octagon":
                continue
            box = tuple(float(row[c]) for c in ("x_px", "y_px", "width_px", "height_px"))
            matches = [s for s in seen if overlap(s.box, box) >= 0.5]
            count += 1
            found += bool(matches)
            hit = any(s.classification.decision == row["shape"] for s in matches)
            right += hit
            if not hit:
                missed.append((name, row["shape"], box, [s.classification.decision for s in matches]))
    return {
        "found": found / max(count, 1),
        "accuracy": right / max(count, 1),
        "interval": interval(right, count),
        "count": count,
        "objects_per_photo": float(np.mean(objects)),
        "ms_per_image": 1000 * float(np.mean(times)),
        "wrong": missed,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description="Accuracy of the shape sensor.")
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--split", choices=["dev", "test"], default="test")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--quick", type=int, help="take every N-th item only")
    parser.add_argument("--only", choices=["drawings", "crops", "scenes"])
    parser.add_argument("--condition")
    parser.add_argument("--rivals", action="store_true", help="give the same pictures to others as well")
    options = parser.parse_args()
    results: dict[str, dict | float] = {}
    sources = {"drawings": drawings, "crops": sign_crops}
    print(
        f"{'':22}{'right':>7}  {'95 % interval':15}{'n':>5}{'ms':>7}"
        "  by class (R, T, E), frame mass: known, other; AUROC"
    )
    for source, read in sources.items():
        if options.only not in (None, source):
            continue
        items = list(read(options.data, options.split))[:: options.quick or 1]
        rivals = rivals_of(list(read(options.data, "dev"))) if options.rivals else {}
        for condition, change in CONDITIONS[source].items():
            if options.condition not in (None, condition):
                continue
            r = results[f"{source} {condition}"] = accuracy(items, change)
            low, high = r["interval"]
            shares = " / ".join(f"{v:.3f}" for v in r["per_class"].values())
            masses = ", ".join(f"{v:.2f}" for v in r["mean_frame_mass"].values())
            print(
                f"{source + ' ' + condition:22}{r['accuracy']:7.3f}  {low:.3f} - {high:.3f}  {r['count']:5}"
                f"{r['ms_per_image']:7.1f}  {shares}      {masses}"
                + ("" if r["auroc"] is None else f"; {r['auroc']:.2f}")
            )
            for name, rival in rivals.items():
                share = results[f"{source} {condition}, {name}"] = rival_accuracy(items, change, rival)
                print(f"    {name:18}{share:7.3f}")
    if options.only in (None, "scenes"):
        r = results["scenes"] = scenes(options.data, options.split, None if not options.quick else 12)
        low, high = r["interval"]
        print(
            f"{'scenes':22}{r['accuracy']:7.3f}  {low:.3f} - {high:.3f}  {r['count']:5}"
            f"{r['ms_per_image']:7.1f}  found {r['found']:.3f}, {r['objects_per_photo']:.1f} objects each"
        )
    if options.json:
        options.json.write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    sys.exit(main())
