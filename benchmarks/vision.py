"""Accuracy of the shape sensor on human drawings and road photographs, beside what others reach.

- Each drawing and each crop of a sign: share of right decisions (rectangular, triangular, elliptical) of the
  first object, clean, with a sector erased and with noise; how well ignorance and conflict tell strangers
  ("other" drawings, octagons); how far the pignistic probability can be trusted.
- The same pictures given to others: rules on contours and hulls, EdgeDrawing's ellipses, and HOG with a
  support vector machine trained on 5 or 50 of each class, or all, beside prototypes trained on the very same.
- Whole photographs of roads: which signs are found, precision and recall over belief.
- Drawings of ellipses that hide each other, and coins: F, beside EdgeDrawing's.

Drawings are split by the person who drew them and signs by the photograph, by a fixed seed: thresholds are
tuned on `dev`, figures are reported on `test`. What is trained here on the way is trained on `dev`; where
`dev` is judged, on the other half of its people and photographs. The weights that come with the sensor are
learned from everything (`train_shapes.py`), so each half is judged with weights that were learned in the same
way from the other half only, which are kept beside this file. `--weights package` takes those of the package.

Usage: python benchmarks/vision.py --data DIR [--split test] [--json FILE] [--draw DIR] [--quick N]
DIR holds `drawings/` and `signs/`. With --quick N every N-th item is taken, and others only with --rivals.
"""

import argparse
import json
import sys
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import vision_print as show
from vision_data import (
    CLASSES,
    CONDITIONS,
    DRAWN,
    SEED,
    SOURCES,
    Change,
    Image,
    Item,
    clean,
    drawings,
    folds,
    in_split,
    noisy,
    occluded,
    sign_crops,
    sign_scenes,
)
from vision_draw import draw
from vision_ellipses import PICTURES, ellipses
from vision_measures import calibration, interval
from vision_rivals import RULES
from vision_scenes import scenes
from vision_seen import Firsts, See, judged, look
from vision_training import DRAWS, Fold, features_of, few_examples

from evifuse.vision import sense_shapes
from evifuse.vision.rivalry import load_rivalry

__all__ = [
    "CLASSES",
    "CONDITIONS",
    "DRAWN",
    "SEED",
    "accuracy",
    "clean",
    "drawings",
    "in_split",
    "noisy",
    "occluded",
    "sign_crops",
    "sign_scenes",
]


def changed(items: list[Item], change: Change) -> list[Image]:
    """The pictures under a condition, the same ones in every run."""
    rng = np.random.default_rng(SEED)
    return [change(image, rng) for _, image, _ in items]


def seen_in(items: list[Item], pictures: list[Image], what: str, see: See = sense_shapes) -> Firsts:
    return look(pictures, [label for label, _, _ in items], [name for _, _, name in items], what, see)


def accuracy(items: list[Item], change: Change, split: str) -> dict[str, Any]:
    """Every figure of the sensor under one condition, with weights that have not seen the split."""
    return judged(seen_in(items, changed(items, change), "", held_out(split)))


def held_out(split: str) -> See:
    """The sensor with weights that were learned from the other half only."""
    return partial(sense_shapes, rivalry=load_rivalry(weights_for(split)))


def weights_for(split: str) -> Path:
    other = {"dev": "test", "test": "dev"}[split]
    return Path(__file__).with_name(f"rivalry-{other}.yaml")


def by_rules(items: list[Item], pictures: list[Image]) -> dict[str, dict[str, Any]]:
    """Share of right decisions of each rule on the very same pictures."""
    known = [i for i, item in enumerate(items) if item[0] in CLASSES]
    rows: dict[str, dict[str, Any]] = {}
    for name, rule in RULES.items():
        right = sum(rule(pictures[i]) == items[i][0] for i in known)
        rows[name] = {"accuracy": right / max(len(known), 1), "interval": interval(right, len(known))}
    return rows


def judge_source(source: str, options: argparse.Namespace, results: dict[str, Any]) -> None:
    """All conditions of one kind of pictures, printed as they are done."""
    items = list(SOURCES[source](options.data, options.split))[:: options.quick or 1]
    seen: dict[str, Firsts] = {}
    pictures: dict[str, list[Image]] = {}
    for condition, change in CONDITIONS[source].items():
        if options.condition in (None, condition):
            name = f"{source} {condition}"
            pictures[condition] = changed(items, change)
            seen[condition] = seen_in(items, pictures[condition], name, options.see)
            results["sensor"][name] = judged(seen[condition])
            show.print_sensor(name, results["sensor"][name])
            if options.rivals:
                results["rivals"][name] = by_rules(items, pictures[condition])
                show.print_rivals(results["rivals"][name])
    if not seen:
        return
    probabilities = np.concatenate([f.pignistic[f.known] for f in seen.values()])
    truth = np.concatenate([[CLASSES.index(v) for v in f.labels[f.known]] for f in seen.values()])
    row = results["calibration"][source] = calibration(probabilities, truth.astype(np.intp))
    show.print_overall(source, row)
    if options.rivals:
        learned = learn(source, items, seen, pictures, options)
        results["learned"][source] = learned
        show.print_learned(source, learned)
        show.print_header() if source != list(SOURCES)[-1] else None


def learn(
    source: str,
    items: list[Item],
    seen: dict[str, Firsts],
    pictures: dict[str, list[Image]],
    options: argparse.Namespace,
) -> dict[str, Any]:
    """Few examples, learned from by prototypes and by a support vector machine."""
    dev = items
    if options.split != "dev":
        dev = list(SOURCES[source](options.data, "dev"))[:: options.quick or 1]
    made: list[Fold] = []
    for examples, numbers in folds(items, options.split, dev):
        images = [image for _, image, _ in examples]
        known = seen_in(examples, images, "examples", options.see)
        made.append(Fold(known, features_of(images), np.array(numbers, np.intp)))
    features = {condition: features_of(some) for condition, some in pictures.items()}
    return few_examples(made, seen, features, DRAWS if options.quick is None else 3)


def parsed() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--split", choices=["dev", "test"], default="test")
    parser.add_argument("--json", type=Path, help="also write every figure here")
    parser.add_argument("--draw", type=Path, help="folder for diagrams")
    parser.add_argument("--weights", choices=["held-out", "package"], default="held-out")
    parser.add_argument("--quick", type=int, help="take every N-th item only")
    parser.add_argument("--only", choices=[*SOURCES, "scenes", "ellipses"])
    parser.add_argument("--condition", help="one condition only, for example 'noise 60'")
    parser.add_argument("--rivals", action=argparse.BooleanOptionalAction, help="give the same to others")
    options = parser.parse_args()
    if options.rivals is None:
        options.rivals = options.quick is None and options.condition is None
    if options.weights == "held-out":
        options.see = held_out(options.split)
        print(f"weights: {weights_for(options.split).name}")
    else:
        options.see = sense_shapes
        print("weights: those of the package, learned from these pictures too")
    return options


def main() -> None:
    options = parsed()
    results: dict[str, Any] = {"split": options.split, "seed": SEED, "sensor": {}, "calibration": {}}
    results |= {"rivals": {}, "learned": {}} if options.rivals else {}
    chosen = [s for s in SOURCES if options.only in (None, s)]
    if chosen:
        print(f"split {options.split}, seed {SEED}")
        show.print_header()
    for source in chosen:
        judge_source(source, options, results)
    if results["sensor"]:
        show.print_strangers(results["sensor"])
    if options.only in (None, "scenes") and options.condition is None:
        results["scenes"] = scenes(options.data, options.split, options.quick or 1, options.see)
        show.print_scenes(results["scenes"])
    if options.only in (None, "ellipses") and options.condition is None:
        results["ellipses"] = ellipses(
            PICTURES if options.quick is None else max(2, PICTURES // options.quick), options.see
        )
        show.print_ellipses(results["ellipses"])
    if options.draw:
        for path in draw(results, options.draw):
            print(f"drawn: {path}")
    if options.json:
        options.json.write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    sys.exit(main())
