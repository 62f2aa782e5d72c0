"""Edges and corners: how often they are told, and whether what is round is left alone.

What is sharp: edges that turn by 60 to 120 degrees, corners, rods and tips, with radii of 0 to a tenth of the
fingertip's. What is not: spheres, cylinders, ellipsoids and saddles of 0.15 (domes) or 1.4 (saddles) to 10
fingertip radii, and planes. Between a tenth and 0.15 nothing is drawn: the limit is an eighth, by definition
(`evifuse.simulation.truth.primitive_of`). A finger goes around rods and balls by 70 degrees to either side at
most, as something else holds them, and presses so softly that they don't vanish in its skin. What lies
between taxels without pressing on any isn't felt, and counts for nothing. The chapter has no edges: what is
printed of it is how often its evidence calls a sharp place curved.
"""

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from touch_cases import SiteRow, stream, touch
from touch_sparse import sparse_fingertip

from evifuse.errors import EvifuseError
from evifuse.recordings.recording import Fingertip
from evifuse.simulation import Procedure
from evifuse.simulation.fingertip import Skin

LEVELS = ("clean", "modest", "strong")
LAYOUT = "paxini:DP-M2826-Omega"
SHARP_KINDS = ("edge", "corner", "rod", "tip")
SMOOTH_KINDS = ("sphere", "cylinder", "ellipsoid", "saddle", "plane")
SURFACE = {"rod": "cylinder", "tip": "sphere"}
SHARPEST, BLUNTEST, ROUNDEST = 1e-2, 0.1, 10.0
SMALLEST = {"saddle": 1.4}
THINNEST_TIP = 0.05
AROUND_RAD, DEEPEST = 1.2, 0.8
CURVED = frozenset({"C-", "C+", "E-", "E+", "H"})
CALLED = 0.1
"""A place is called curved when more than this mass is on curved primitives alone."""


def run(
    seed: int, count: int, tips: Mapping[str, Fingertip | None], levels: Sequence[str] = LEVELS
) -> Iterator[SiteRow]:
    """So many recordings of each kind with each fingertip and noise."""
    fingers = {"sphere 305": None, "8 x 8": sparse_fingertip(8)} | dict(tips)
    for (finger, tip), noise in ((item, noise) for item in fingers.items() for noise in levels):
        a = 0.01 if tip is None else tip.radius_m
        for kind in (*SHARP_KINDS, *SMOOTH_KINDS):
            generator = stream(seed, "edges", kind)
            for number in range(count):
                options: dict[str, Any] = {"fingertip": tip, "finger": finger}
                drawn = _drawn(kind, a, generator)
                name = SURFACE.get(kind, kind)
                if name in ("cylinder", "sphere"):
                    options["procedure"] = _gentle(name, drawn["radius_m"], a)
                try:
                    yield from touch(name, noise, seed + number, **options, **drawn)
                except EvifuseError as error:
                    print(f"left out: {finger}, {noise}, {kind} {number}: {error}", file=sys.stderr)


def _drawn(kind: str, a: float, generator: np.random.Generator) -> dict[str, float]:
    """Dimensions of a surface of this kind for a fingertip of radius a, metres; a quarter is quite sharp."""
    if kind in SHARP_KINDS:
        low = THINNEST_TIP if kind == "tip" else -BLUNTEST / 3
        share, turn = generator.uniform(low, BLUNTEST), generator.uniform(np.pi / 3, 2 * np.pi / 3)
        radius = {"radius_m": a * max(share, SHARPEST)}
        return radius | ({"opening_rad": np.pi - turn} if kind == "edge" else {})
    if kind == "plane":
        return {}

    def between(low: float) -> float:
        return a * float(np.exp(generator.uniform(np.log(low), np.log(ROUNDEST))))

    if kind != "ellipsoid":
        return {"radius_m": between(SMALLEST.get(kind, 0.15))}
    first, second = between(0.3), between(0.3)
    height = float(np.sqrt(first * second))
    sides = (float(np.sqrt(r * height)) for r in (first, second))
    return dict(zip(("length_m", "width_m"), sides, strict=True)) | {"height_m": height}


def _gentle(name: str, radius_m: float, a: float) -> Procedure:
    """Rolls around a rod or ball that is pressed in by 0.8 of its radius at most."""
    usual = Procedure()
    relative = (1 / a + 1 / radius_m) * (1 / a if name == "cylinder" else 1 / a + 1 / radius_m)
    depth = Skin().depth_m(usual.press_n) * (relative * 0.01**2) ** 0.25
    press = usual.press_n * min(1.0, DEEPEST * radius_m / depth) ** 2
    return replace(usual, press_n=press, arc_rad=min(2 * AROUND_RAD * radius_m / a, usual.arc_rad))


def is_felt(row: SiteRow) -> bool:
    """Whether a surface was met there."""
    return bool(row.masses) and row.masses.get("N", 0.0) <= CALLED


def is_sharp(row: SiteRow) -> bool:
    """Whether the place is an edge, by the truth's own name for it."""
    return row.primitive == "edge"


def curved_mass(masses: Mapping[str, float]) -> float:
    """Mass on sets of curved primitives alone."""
    return sum(mass for label, mass in masses.items() if CURVED.issuperset(label.split("|")))


def summary(rows: list[SiteRow]) -> list[dict[str, Any]]:
    """One entry for each fingertip and noise."""
    groups = dict.fromkeys((row.fingertip, row.noise) for row in rows)
    return [_measured([r for r in rows if (r.fingertip, r.noise) == group]) for group in groups]


def _measured(rows: list[SiteRow]) -> dict[str, Any]:
    every = len(rows)
    rows = [r for r in rows if is_felt(r)]
    sharp, smooth = [r for r in rows if is_sharp(r)], [r for r in rows if not is_sharp(r)]
    told, radii = [r for r in sharp if r.edge], [-1 / r.k[1] for r in sharp if r.edge]
    bounds = [r.edge_bound_m for r in told]
    return {
        "fingertip": rows[0].fingertip,
        "noise": rows[0].noise,
        "not_felt": every - len(rows),
        "sharp": len(sharp),
        "recall": _share([bool(r.edge) for r in sharp]),
        "called_curved": _share([curved_mass(r.masses) > CALLED for r in sharp]),
        "bound_holds": _share([t <= b for t, b in zip(radii, bounds, strict=True)]),
        "bound_over_radius": float(np.median([b / r.radius_m for b, r in zip(bounds, told, strict=True)]))
        if told
        else None,
        "smooth": len(smooth),
        "false_alarms": _share([bool(r.edge) for r in smooth]),
        "chapter_called_curved": _share([curved_mass(r.chapter_masses) > CALLED for r in sharp]),
        "missed": [_said(r) for r in sharp if not r.edge],
        "alarms": [_said(r) for r in smooth if r.edge],
    }


def _share(values: list[bool]) -> float | None:
    return float(np.mean(values)) if values else None


def _said(row: SiteRow) -> str:
    own = max(row.k, key=abs, default=0.0)
    return f"{row.surface} of {abs(1e3 / own):.2g} mm" if own else row.surface


def print_summary(rows: list[dict[str, Any]]) -> None:
    """The table, and below each line what was missed and what was called an edge."""
    print("               sharp  told  called  bound  its size | round  called an | chapter: called | not")
    print("taxels  noise  sites     %  curved  holds  over a   | sites     edge % |          curved | felt")
    for row in rows:
        recall, curved, holds, alarms, chapter = (
            "   - " if row[key] is None else f"{100 * row[key]:5.1f}"
            for key in ("recall", "called_curved", "bound_holds", "false_alarms", "chapter_called_curved")
        )
        bound = "    -" if row["bound_over_radius"] is None else f"{row['bound_over_radius']:5.3f}"
        finger = row["fingertip"].removeprefix("paxini:").removesuffix("-Omega")
        print(
            f"{finger:<11} {row['noise']:<7} {row['sharp']:8d} {recall}   {curved}  {holds}"
            f"     {bound} | {row['smooth']:5d}      {alarms} |           {chapter} | {row['not_felt']:4d}"
        )
        for key, said in (("missed", "not told"), ("alarms", "called an edge")):
            if row[key]:
                print(f"       {said}: " + ", ".join(row[key][:8]))
