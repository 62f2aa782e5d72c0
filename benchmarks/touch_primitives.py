"""Figure (iii): the seven primitives on random surfaces, how often right, and whether beliefs are honest."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from touch_cases import NAMES, SiteRow, interval, stream, touch

from evifuse.errors import EvifuseError
from evifuse.recordings.recording import Fingertip
from evifuse.touch import curvature_threshold_per_m

NOISE_OF = ("clean", "modest", "strong", "slipping")
BINS = 10


def random_surface(primitive: str, generator: np.random.Generator) -> tuple[str, dict[str, float]]:
    """A surface that shows this primitive, of 6 to 100 mm (hollow ones of 16 mm or more)."""

    def size(low: float) -> float:
        return float(np.exp(generator.uniform(np.log(low), np.log(0.1))))

    dome, hollow = size(0.006), size(0.016)
    if primitive == "E-" and generator.random() < 0.5:
        height = dome * generator.uniform(0.8, 1.0)
        other = dome * generator.uniform(1.0, min(2.5, 0.15 / dome))
        sides = {"length_m": float(np.sqrt(other * height)), "width_m": float(np.sqrt(dome * height))}
        return "ellipsoid", sides | {"height_m": float(height)}
    sized = {
        "C-": ("cylinder", dome),
        "C+": ("trough", hollow),
        "H": ("saddle", hollow),
        "E-": ("sphere", dome),
        "E+": ("bowl", hollow),
        "N": ("hole", 0.016 + 0.5 * hollow),
    }
    if primitive == "P":
        return "plane", {}
    name, radius = sized[primitive]
    return name, {"radius_m": radius}


def run(seed: int, count: int, tips: dict[str, Fingertip | None]) -> Iterator[SiteRow]:
    """So many surfaces of each primitive; noise and fingertip are drawn."""
    for primitive in NAMES:
        for number in range(count):
            generator = stream(seed + number, "primitive", primitive)
            name, size = random_surface(primitive, generator)
            finger = list(tips)[int(generator.integers(len(tips)))]
            levels = NOISE_OF[: 4 if tips[finger] is None else 3]  # only spheres can slip
            noise = levels[int(generator.integers(len(levels)))]
            radius = 0.01 if tips[finger] is None else tips[finger].radius_m
            options: dict[str, Any] = {"fingertip": tips[finger], "finger": finger}
            try:
                rows = touch(name, noise, seed + number, **options, **size)
            except EvifuseError as error:
                print(f"left out: {finger}, {name}: {error}")
                continue
            for row in rows:
                yield labelled(row, radius)


def labelled(row: SiteRow, radius_m: float) -> SiteRow:
    """With the primitive of table 3 at the fingertip's threshold; a dome of any size is one."""
    if not np.isfinite(row.k[0]):
        return replace(row, primitive="N")
    gamma = curvature_threshold_per_m(radius_m)
    kind = tuple(int(k > gamma) - int(k < -gamma) for k in row.k)
    names = {(0, 0): "P", (0, -1): "C-", (1, 0): "C+", (1, -1): "H", (-1, -1): "E-", (1, 1): "E+"}
    return replace(row, primitive=names[kind])


def calibration(
    rows: Sequence[SiteRow], chapter: bool = False
) -> tuple[float, list[tuple[int, float, float]]]:
    """Calibration error of the largest pignistic probability; count, mean, share right by tenth."""
    shares = [row.chapter_pignistic if chapter else row.pignistic for row in rows]
    best = [max(s, key=s.__getitem__) for s in shares]
    sure = np.array([s[name] for s, name in zip(shares, best, strict=True)])
    right = np.array([name == row.primitive for name, row in zip(best, rows, strict=True)])
    label = np.minimum((sure * BINS).astype(int), BINS - 1)
    tenths = [
        (int((label == b).sum()), float(sure[label == b].mean()), float(right[label == b].mean()))
        for b in np.unique(label)
    ]
    return sum(n * abs(p - r) for n, p, r in tenths) / max(len(rows), 1), tenths


def confusion(rows: Sequence[SiteRow]) -> list[list[int]]:
    """Sites by true (rows) and felt (columns) primitive."""
    table = np.zeros((len(NAMES), len(NAMES)), dtype=int)
    for row in rows:
        table[NAMES.index(row.primitive), NAMES.index(row.name)] += 1
    return table.tolist()


def summary(rows: list[SiteRow]) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = []
    groups = {"all": rows}
    groups |= {noise: [row for row in rows if row.noise == noise] for noise in NOISE_OF}
    groups |= {
        tip: [row for row in rows if row.fingertip == tip] for tip in {row.fingertip: 0 for row in rows}
    }
    for name, group in groups.items():
        if group:
            error, tenths = calibration(group)
            chapter, _ = calibration(group, chapter=True)
            by_chapter = [max(r.chapter_pignistic, key=r.chapter_pignistic.__getitem__) for r in group]
            found.append(
                {
                    "group": name,
                    "sites": len(group),
                    "accuracy": interval([float(row.name == row.primitive) for row in group], np.mean),
                    "ece": error,
                    "tenths": tenths,
                    "confusion": confusion(group),
                    "chapter_accuracy": float(
                        np.mean([b == r.primitive for b, r in zip(by_chapter, group, strict=True)])
                    ),
                    "chapter_ece": chapter,
                }
            )
    return found


def print_summary(rows: list[dict[str, Any]]) -> None:
    print("group                  sites | right % (95 %)         ECE   | chapter: right %  ECE")
    for row in rows:
        accuracy, low, high = (100 * v for v in row["accuracy"])
        print(
            f"{row['group']:<22} {row['sites']:5d} | {accuracy:5.1f} ({low:5.1f} to {high:5.1f})"
            f"  {row['ece']:.3f} | {100 * row['chapter_accuracy']:14.1f}  {row['chapter_ece']:.3f}"
        )
    print("true \\ felt " + "".join(f"{name:>5}" for name in NAMES))
    for name, counts in zip(NAMES, rows[0]["confusion"], strict=True):
        print(f"{name:>11} " + "".join(f"{count:5d}" for count in counts))
