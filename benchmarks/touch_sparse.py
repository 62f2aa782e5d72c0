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


def run(seed: int, noise: str, sides: tuple[int, ...], step: int) -> Iterator[SiteRow]:
    """Every radius of spheres and cylinders, jittered by half a millimetre, and as many planes."""
    for side in sides:
        tip = sparse_fingertip(side)
        for shape in CLASSES:
            generator = stream(seed, "sparse", shape)
            for number, radius in enumerate(RADII_MM[::step]):
                size = 1e-3 * max(radius + generator.uniform(-0.5, 0.5), 1.0)
                dimensions = {} if shape == "plane" else {"radius_m": size}
                options: dict[str, Any] = {"fingertip": tip, "finger": f"{side} x {side}", "size_m": size}
                yield from touch(shape, noise, seed + number, **options, **dimensions)


def class_of(row: SiteRow) -> str:
    """The class with the largest pignistic probability of its primitives, or nothing."""
    if row.edge or not np.isfinite(row.felt[0]):
        return "none"
    shares = {name: sum(row.pignistic[p] for p in of) for name, of in OF_CLASS.items()}
    return max(shares, key=shares.__getitem__)


def radius_error_m(row: SiteRow) -> float:
    """Error of the radius of a sphere (mean curvature) or cylinder (sharper curvature)."""
    k = float(np.mean(row.felt)) if row.surface == "sphere" else float(max(row.felt, key=abs))
    return abs(1 / abs(k) - row.size_m) if np.isfinite(k) and k != 0 else np.nan


def summary(rows: list[SiteRow]) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = []
    for finger in dict.fromkeys(row.fingertip for row in rows):
        level = [row for row in rows if row.fingertip == finger]
        round_ones = [row for row in level if row.surface != "plane"]
        errors = [1000 * radius_error_m(row) for row in round_ones]
        found.append(
            {
                "fingertip": finger,
                "sites": len(level),
                "accuracy": interval([float(class_of(row) == row.surface) for row in level], np.mean),
                "radius_error_mm": interval([e for e in errors if np.isfinite(e)], np.mean),
                "without_radius": int(np.isnan(errors).sum()),
                "wrong": [
                    (r.surface, round(1e3 * r.size_m, 1), class_of(r))
                    for r in level
                    if class_of(r) != r.surface
                ],
            }
        )
    return found


def print_summary(rows: list[dict[str, Any]]) -> None:
    print(
        "taxels  sites | class right % (95 %), published 93.1 | mean radius error mm, published 1.87 | none"
    )
    for row in rows:
        accuracy, low, high = (100 * v for v in row["accuracy"])
        error, least, most = row["radius_error_mm"]
        print(
            f"{row['fingertip']:<7} {row['sites']:5d} | {accuracy:5.1f} ({low:.1f} to {high:.1f})"
            f"                  | {error:5.2f} ({least:.2f} to {most:.2f}) {'':16} | {row['without_radius']}"
        )
        if row["wrong"]:
            print("        wrong: " + ", ".join(f"{s} {r:g} mm as {c}" for s, r, c in row["wrong"][:12]))
