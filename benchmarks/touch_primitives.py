"""Figure (iii): the seven primitives on random surfaces, how often right, and whether beliefs are honest."""

import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from touch_cases import NAMES, SiteRow, interval, rows_of

from evifuse.errors import EvifuseError
from evifuse.recordings.recording import Fingertip
from evifuse.simulation import NOISES, SimulatedScene, simulate
from evifuse.simulation.cases import Case, random_case
from evifuse.simulation.mesh import MeshSurface, load_mesh
from evifuse.simulation.random_cases import random_body_case
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
    """So many random recordings with each fingertip, seven primitives in turn.

    They are felt on random bodies, on the catalogue's surfaces, and on household objects where there are any;
    random bodies with the first fingertip six times as many.
    """
    for finger, tip in tips.items():
        for where in ("random", "catalogue", "household") if meshes else ("random", "catalogue"):
            more = 6 if where == "random" and finger == next(iter(tips)) else 1
            for number in range(more * count):
                yield from felt_case(seed, number, finger, tip, where, meshes)


def felt_case(
    seed: int, number: int, finger: str, tip: Fingertip | None, where: str, meshes: list[MeshSurface]
) -> list[SiteRow]:
    """Rows of one recording; what does not fit is said."""
    try:
        if where == "random":
            case = random_body_case(seed, number, fingertip=tip)
        else:
            case = random_case(seed, number, fingertip=tip, meshes=meshes if where == "household" else ())
        scene = simulated(case, tip)
    except EvifuseError as error:
        print(f"left out: {finger}, {where} {number}: {error}", file=sys.stderr)
        return []
    felt = sense_curvature(scene.scene.touch)
    by_chapter = sense_curvature(scene.scene.touch, belief="chapter")
    key = (where, case.noise, finger, number, np.nan)
    return rows_of(scene, felt, by_chapter, key)


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


def is_clear(row: SiteRow) -> bool:
    """Whether no curvature is within a fifth of the threshold between flat and curved."""
    gamma = curvature_threshold_per_m(row.radius_m)
    return not any(0.8 < abs(k) / gamma < 1.2 for k in row.k)


def summary(rows: list[SiteRow]) -> list[dict[str, Any]]:
    """One entry for each group of sites; the first is all of them."""
    first = rows[0].fingertip if rows else ""
    groups: dict[str, list[SiteRow]] = {"all": rows}
    for tip in {row.fingertip: 0 for row in rows}:
        for where in ("random", "catalogue", "household"):
            own = [row for row in rows if row.surface == where and row.fingertip == tip]
            groups[f"{tip.removeprefix('paxini:')}, {where}"] = own
            if where == "random" and tip == first:
                groups |= {f"  noise {noise}": [row for row in own if row.noise == noise] for noise in NOISES}
                groups["  clear of the threshold"] = [row for row in own if is_clear(row)]
    return [_measured(name, group) for name, group in groups.items() if group]


def _measured(name: str, group: list[SiteRow]) -> dict[str, Any]:
    error, tenths = calibration(group)
    by_chapter = [max(r.chapter_pignistic, key=r.chapter_pignistic.__getitem__) for r in group]
    planes = [row for row in group if row.primitive == "P"]
    beliefs = {"belief_in_planes": [row.masses.get("P", 0.0) for row in planes]}
    beliefs["chapter_belief_in_planes"] = [row.chapter_masses.get("P", 0.0) for row in planes]
    return {
        "group": name,
        "sites": len(group),
        "accuracy": interval([float(row.name == row.primitive) for row in group], np.mean),
        "ece": error,
        "tenths": tenths,
        "confusion": confusion(group),
        "chapter_accuracy": float(
            np.mean([b == r.primitive for b, r in zip(by_chapter, group, strict=True)])
        ),
        "chapter_ece": calibration(group, chapter=True)[0],
        **{key: float(np.median(values)) if values else None for key, values in beliefs.items()},
    }


def print_summary(rows: list[dict[str, Any]]) -> None:
    """The table: accuracy, calibration, and the median belief in P where the surface is flat."""
    print(
        "group                      sites  right % (95 %)         ECE  m(P) on P | chapter: right % ECE  m(P)"
    )
    for row in rows:
        accuracy, low, high = (100 * v for v in row["accuracy"])
        own, other = (
            "   -" if row[key] is None else f"{row[key]:.2f}"
            for key in ("belief_in_planes", "chapter_belief_in_planes")
        )
        print(
            f"{row['group']:<26} {row['sites']:5d} {accuracy:6.1f} ({low:5.1f} to {high:5.1f})"
            f" {row['ece']:.3f}       {own} |"
            f" {100 * row['chapter_accuracy']:16.1f} {row['chapter_ece']:.3f}  {other}"
        )
    for row in rows[:2]:
        print(f"{row['group']}: true \\ felt".ljust(28) + "".join(f"{name:>5}" for name in NAMES))
        for name, counts in zip(NAMES, row["confusion"], strict=True):
            print(f"{name:>27} " + "".join(f"{count:5d}" for count in counts))
