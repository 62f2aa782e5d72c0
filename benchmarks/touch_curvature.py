"""Figure (i): how well curvature is felt, and whether its errors are honest."""

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
from touch_cases import SiteRow, interval, stream, touch

from evifuse.errors import EvifuseError
from evifuse.recordings.recording import Fingertip

SHAPES = ("sphere", "cylinder", "ellipsoid", "saddle")
NARROWEST_M = {"saddle": 0.015}
"""A saddle is hollow along one direction: the finger has to fit in."""
LARGEST_M = 0.1
BINS_M = (0.005, 0.01, 0.02, 0.04, 0.1)
FEW_LAYOUTS = ("paxini:DP-S1813-Core", "paxini:DP-M2826-Omega", "paxini:DP-L3530-Omega")
LAYOUTS = (
    *FEW_LAYOUTS,
    "paxini:DP-S1813-Elite",
    "paxini:DP-S2015-Elite",
    "paxini:DP-S2716-Core",
    "paxini:DP-S3013-Core",
    "paxini:CP-M3025-Core",
    "paxini:IP-M2324-Core",
)
"""All that have 31 to 135 taxels; other parts use the first three."""
LEVELS = ("clean", "modest", "slipping", "strong", "strong peak")


def sized(shape: str, radius_m: float, generator: np.random.Generator) -> dict[str, float]:
    """Dimensions of a surface whose sharper curvature is 1 / radius, about."""
    if shape == "ellipsoid":
        height = radius_m * generator.uniform(0.8, 1.0)
        other = radius_m * generator.uniform(1.2, 3.0)
        return {
            "length_m": float(np.sqrt(other * height)),
            "width_m": float(np.sqrt(radius_m * height)),
            "height_m": float(height),
        }
    return {"radius_m": radius_m}


def radii_m(shape: str, count: int, generator: np.random.Generator) -> list[float]:
    """One radius from each of so many equal steps of its logarithm."""
    low, high = np.log(NARROWEST_M.get(shape, 0.005)), np.log(LARGEST_M)
    return np.exp(low + (high - low) * (np.arange(count) + generator.random(count)) / count).tolist()


def run(
    seed: int, count: int, noises: tuple[str, ...], tips: dict[str, Fingertip | None]
) -> Iterator[SiteRow]:
    """Rows of every shape, noise and fingertip; a finger that does not fit is left out."""
    for finger, tip in tips.items():
        for shape in SHAPES:
            generator = stream(seed, shape)
            for number, radius in enumerate(radii_m(shape, count, generator)):
                size = sized(shape, radius, generator)
                for noise in noises:
                    options: dict[str, Any] = {"fingertip": tip, "finger": finger, "size_m": radius}
                    try:
                        yield from touch(shape, noise, seed + number, **options, **size)
                    except EvifuseError as error:
                        print(f"left out: {finger}, {shape} of {1000 * radius:.0f} mm: {error}")


def summary(rows: list[SiteRow]) -> list[dict[str, Any]]:
    """For each fingertip and noise: errors of each shape and each range of radii, and coverage."""
    found: list[dict[str, Any]] = []
    for finger, noise in dict.fromkeys((row.fingertip, row.noise) for row in rows):
        level = [row for row in rows if (row.fingertip, row.noise) == (finger, noise)]
        groups = {"all": level}
        groups |= {shape: [r for r in level if r.surface == shape] for shape in SHAPES}
        groups |= {
            f"{1000 * low:.0f} to {1000 * high:.0f} mm": [r for r in level if low <= r.size_m < high]
            for low, high in pairwise(BINS_M)
        }
        for name, group in groups.items():
            if group:
                found.append({"fingertip": finger, "noise": noise, "group": name} | _measures(group))
    return found


def _measures(rows: list[SiteRow]) -> dict[str, Any]:
    known = [row for row in rows if np.isfinite(row.relative)]
    covered = [value for row in known for value in row.covered]
    return {
        "sites": len(rows),
        "not_felt": len(rows) - len(known),
        "median": interval([row.relative for row in rows]),
        "worst": float(np.max([row.relative for row in known], initial=0.0)),
        "chapter_median": interval([row.chapter_relative for row in rows]),
        "coverage": interval([float(value) for value in covered], np.mean),
    }


def print_summary(rows: list[dict[str, Any]]) -> None:
    print("fingertip             noise       group        sites lost | median error % (95 %)  worst", end="")
    print(" | chapter % | coverage %")
    for row in rows:
        median, low, high = (100 * v for v in row["median"])
        cover, least, most = (100 * v for v in row["coverage"])
        print(
            f"{row['fingertip']:<21} {row['noise']:<11} {row['group']:<12}"
            f" {row['sites']:5d} {row['not_felt']:4d} |"
            f" {median:6.2f} ({low:5.2f} to {high:5.2f}) {100 * row['worst']:6.1f} |"
            f" {100 * row['chapter_median'][0]:8.2f}  | {cover:3.0f} ({least:.0f} to {most:.0f})"
        )
