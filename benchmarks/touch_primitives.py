"""Figure (iii): the seven primitives on random surfaces, how often right, and whether beliefs are honest."""

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from touch_cases import NAMES, SiteRow, interval, rows_of

from evifuse.errors import EvifuseError
from evifuse.recordings.recording import Fingertip
from evifuse.simulation import NOISES, SimulatedScene, simulate
from evifuse.simulation.dataset import Case, random_case
from evifuse.simulation.mesh import MeshSurface, load_mesh
from evifuse.touch import curvature_threshold_per_m, sense_curvature

BINS = 10


def load_meshes(folder: Path | None) -> list[MeshSurface]:
    """The watertight meshes of a folder; what can't be used is said."""
    found: list[MeshSurface] = []
    for file in sorted(folder.iterdir()) if folder is not None else []:
        if file.suffix.lower() in (".stl", ".obj", ".ply"):
            try:
                found.append(load_mesh(file))
            except EvifuseError as error:
                print(f"left out: {error}", file=sys.stderr)
    return found


def run(
    seed: int, count: int, tips: Mapping[str, Fingertip | None], meshes: list[MeshSurface]
) -> Iterator[SiteRow]:
    """So many random recordings with each fingertip, seven primitives in turn, and as many on meshes."""
    for finger, tip in tips.items():
        radius = 0.01 if tip is None else tip.radius_m
        for where, bodies in {"catalogue": [], "mesh": meshes}.items():
            if where == "mesh" and not meshes:
                continue
            for number in range(count):
                try:
                    case = random_case(seed, number, fingertip=tip, meshes=bodies)
                    scene = simulated(case, tip)
                except EvifuseError as error:
                    print(f"left out: {finger}, {where} {number}: {error}", file=sys.stderr)
                    continue
                felt = sense_curvature(scene.scene.touch)
                by_chapter = sense_curvature(scene.scene.touch, belief="chapter")
                for row in rows_of(scene, felt, by_chapter, (where, case.noise, finger, number, np.nan)):
                    yield labelled(row, radius)


def simulated(case: Case, tip: Fingertip | None) -> SimulatedScene:
    """The recording of a random case and the truth about it."""
    return simulate(
        case.surface,
        seed=case.seed,
        sites=case.sites,
        procedure=case.procedure,
        noise=NOISES[case.noise],
        fingertip=tip,
        picture=False,
    )


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
    groups |= {noise: [row for row in rows if row.noise == noise] for noise in NOISES}
    groups |= {where: [row for row in rows if row.surface == where] for where in ("catalogue", "mesh")}
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
