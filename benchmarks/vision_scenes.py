"""Whole photographs of roads: which signs are found, and how the belief in an object tells right from wrong.

A sign counts as found if an object's box overlaps its box by at least one half (intersection over union) and
the object has its shape. Signs whose shorter side is below 36 px are left out: finding them is neither right
nor wrong. Everything else that is named counts as wrong, stop signs too, although a road is full of things
that do have these shapes and are no signs: windows, wheels, number plates. So precision is a lower bound.
"""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from vision_data import Box, box_of, sign_scenes
from vision_measures import interval, overlap
from vision_seen import See, shown

from evifuse.vision import SeenObject, sense_shapes

LEAST_SIDE_PX = 36
LEAST_OVERLAP = 0.5
LEVELS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)

Named = tuple[float, int]
"""Belief in what an object is said to be, and which sign it is rightly: -1 for none."""


def scenes(data: Path, split: str, every: int = 1, see: See = sense_shapes) -> dict[str, Any]:
    """Recall of the signs, and precision and recall over the least belief of what is named."""
    named: list[Named] = []
    signs, found, objects, times = 0, 0, [], []
    missed: list[tuple[str, str, Box, list[str | None]]] = []
    scores: list[float] = []
    for image, rows, name in shown(list(sign_scenes(data, split))[::every], "scenes"):
        start = time.perf_counter()
        seen = see(image)
        times.append(time.perf_counter() - start)
        objects.append(len(seen))
        some = [r for r in rows if r["shape"] != "octagon"]
        large = [r for r in some if min(box_of(r)[2:]) >= LEAST_SIDE_PX]
        right, boxes = _named(seen, large, [r for r in some if r not in large])
        named += [(belief, signs + i if i >= 0 else -1) for belief, i in right]
        hits = {i for _, i in right}
        for i, row in enumerate(large):
            at = [s.classification.decision for s in seen if overlap(s.box, box_of(row)) >= LEAST_OVERLAP]
            found += bool(at)
            if i not in hits:
                missed.append((name, row["shape"], box_of(row), at))
        signs += len(large)
        scores += boxes
    hit = len({i for _, i in named if i >= 0})
    return {
        "recall": hit / max(signs, 1),
        "interval": interval(hit, signs),
        "count": signs,
        "found": found / max(signs, 1),
        "curve": curve(named, signs),
        "best_overlap": [float(v) for v in np.quantile(scores, [0.1, 0.25, 0.5, 0.75, 0.9])],
        "objects_per_photo": float(np.mean(objects)),
        "ms_per_image": 1000 * float(np.mean(times)),
        "wrong": missed,
    }


def strength(seen: SeenObject) -> float:
    """Belief in what an object is said to be."""
    decision = seen.classification.decision
    return 0.0 if decision is None else float(seen.classification.belief.as_dict().get(decision, 0.0))


def _named(
    seen: Sequence[SeenObject], large: list[dict[str, str]], small: list[dict[str, str]]
) -> tuple[list[Named], list[float]]:
    """What is named, with the sign that it is; and the best overlap with each sign."""
    named: list[Named] = []
    taken: set[int] = set()
    best = [max((overlap(s.box, box_of(r)) for s in seen), default=0.0) for r in large]
    for one in sorted(seen, key=strength, reverse=True):
        decision = one.classification.decision
        if decision is None or any(overlap(one.box, box_of(r)) >= LEAST_OVERLAP for r in small):
            continue
        shared = [overlap(one.box, box_of(r)) if r["shape"] == decision else 0.0 for r in large]
        sign = int(np.argmax(shared)) if shared else -1
        if sign < 0 or shared[sign] < LEAST_OVERLAP or sign in taken:  # named twice: once is wrong
            named.append((strength(one), -1))
            continue
        taken.add(sign)
        named.append((strength(one), sign))
    return named, best


def curve(named: Sequence[Named], signs: int) -> list[dict[str, float | None]]:
    """Precision and recall of what is named with at least some belief."""
    rows: list[dict[str, float | None]] = []
    for level in LEVELS:
        kept = [sign for belief, sign in named if belief >= level]
        hit = sum(sign >= 0 for sign in kept)
        precision = hit / len(kept) if kept else None
        rows.append(
            {"belief": level, "named": len(kept), "precision": precision, "recall": hit / max(signs, 1)}
        )
    return rows
