"""Figure (ii): plane, sphere or cylinder, and of what radius, felt with a sparse array.

After Liu et al., "Discrimination of Object Curvature Based on a Sparse Tactile Sensor Array", Micromachines
2020, 11:583: planes, convex spheres and convex cylinders with radii of 1 to 30 mm; 93.1 % of the classes
right, mean radius error 1.87 mm. What is not reproduced: their sensor lies under a compliant layer and is
pressed, and a neural network learns from such presses; here a spherical fingertip of 5 mm with few taxels
rolls in four directions, and nothing is trained on these shapes. Their samples were real, ours are simulated.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from touch_cases import SiteRow, interval, stream, touch

from evifuse.recordings.recording import Fingertip

CLASSES = ("plane", "sphere", "cylinder")
OF_CLASS = {"plane": ("P",), "sphere": ("E-", "E+"), "cylinder": ("C-", "C+")}
RADII_MM = range(1, 31)
FINGER_M = 0.005
CAP_RAD = 0.9


def sparse_fingertip(side: int) -> Fingertip:
    """A spherical fingertip of 5 mm with `side` x `side` taxels, square in the azimuthal projection."""
    steps = np.linspace(-1.0, 1.0, side) * CAP_RAD * FINGER_M / np.sqrt(2)
    x, y = (axis.ravel() for axis in np.meshgrid(steps, steps))
    angle = np.hypot(x, y) / FINGER_M
    scale = np.sinc(angle / np.pi) / FINGER_M
    normals = np.stack([x * scale, y * scale, -np.cos(angle)], axis=1)
    return Fingertip(FINGER_M, FINGER_M * normals, normals)


def run(seed: int, noises: tuple[str, ...], sides: tuple[int, ...], step: int) -> Iterator[SiteRow]:
    """Every radius of spheres and cylinders, jittered by half a millimetre, and as many planes."""
    for noise, side in ((noise, side) for noise in noises for side in sides):
        tip = sparse_fingertip(side)
        for shape in CLASSES:
            generator = stream(seed, "sparse", shape)
            for number, radius in enumerate(RADII_MM[::step]):
                size = 1e-3 * max(radius + generator.uniform(-0.5, 0.5), 1.0)
                dimensions = {} if shape == "plane" else {"radius_m": size}
                options: dict[str, Any] = {"fingertip": tip, "finger": f"{side} x {side}", "size_m": size}
                yield from touch(shape, noise, seed + number, **options, **dimensions)


def class_of(row: SiteRow) -> str:
    """What the sensor says: the class with the largest pignistic probability of its primitives.

    An edge is a ridge, so it counts as a cylinder; a corner or tip turns in all directions, so it counts as a
    sphere. A site without contact, or with one rolled direction, has no class.
    """
    if row.edge:
        return "sphere" if row.edge == "corner" else "cylinder"
    if not np.isfinite(row.felt[0]):
        return "none"
    return _class(row.pignistic)


def radius_error_m(row: SiteRow, chapter: bool = False) -> float:
    """Error of the radius of a sphere (mean curvature) or cylinder (sharper curvature); NaN without one."""
    felt = row.chapter if chapter else row.felt
    k = float(np.mean(felt)) if row.surface == "sphere" else float(max(felt, key=abs))
    return abs(1 / abs(k) - row.size_m) if np.isfinite(k) and k != 0 else np.nan


def _class(pignistic: dict[str, float]) -> str:
    shares = {name: sum(pignistic[p] for p in of) for name, of in OF_CLASS.items()}
    return max(shares, key=shares.__getitem__)


def summary(rows: list[SiteRow]) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = []
    for finger, noise in dict.fromkeys((row.fingertip, row.noise) for row in rows):
        level = [row for row in rows if row.fingertip == finger and row.noise == noise]
        round_ones = [row for row in level if row.surface != "plane"]
        errors = [1000 * radius_error_m(row) for row in round_ones]
        by_chapter = [1000 * radius_error_m(row, chapter=True) for row in round_ones]
        found.append(
            {
                "fingertip": finger,
                "noise": noise,
                "sites": len(level),
                "accuracy": interval([float(class_of(row) == row.surface) for row in level], np.mean),
                "radius_error_mm": interval([e for e in errors if np.isfinite(e)], np.mean),
                "radius_error_median_mm": float(np.nanmedian(errors)),
                "without_radius": int(np.isnan(errors).sum()),
                "edges": sum(bool(row.edge) for row in level),
                "chapter_accuracy": float(np.mean([_class(r.chapter_pignistic) == r.surface for r in level])),
                "chapter_radius_error_mm": float(np.nanmean(by_chapter)),
                "chapter_radius_error_median_mm": float(np.nanmedian(by_chapter)),
                "wrong": [
                    (r.surface, round(1e3 * r.size_m, 1), class_of(r))
                    for r in level
                    if class_of(r) != r.surface
                ],
            }
        )
    return found


def print_summary(rows: list[dict[str, Any]]) -> None:
    print("published (Liu et al. 2020): 93.1 % of the classes right, mean radius error 1.87 mm")
    print(
        "                     class right %     radius error mm: mean      median | no radius | chapter: %,"
    )
    print(
        "taxels noise   sites (95 %)                             (95 %)           | (edges)   | mean, median"
    )
    for row in rows:
        accuracy, low, high = (100 * v for v in row["accuracy"])
        error, least, most = row["radius_error_mm"]
        print(
            f"{row['fingertip']:<6} {row['noise']:<7} {row['sites']:5d}"
            f" {accuracy:5.1f} ({low:5.1f} to {high:5.1f})"
            f"   {error:5.2f} ({least:.2f} to {most:.2f}) {row['radius_error_median_mm']:9.2f} |"
            f" {row['without_radius']:3d} ({row['edges']:3d}) | {100 * row['chapter_accuracy']:5.1f},"
            f" {row['chapter_radius_error_mm']:.2f}, {row['chapter_radius_error_median_mm']:.2f}"
        )
        if row["wrong"]:
            print("       wrong: " + ", ".join(f"{s} {r:g} mm as {c}" for s, r, c in row["wrong"][:12]))
