"""How well curvature is felt: truth and estimate on simulated surfaces of several radii.

The default simulated recording: a fingertip of 10 mm with 305 taxels, 10 s at 1 kHz, two sites, four
directions; clean and with noise. Errors are in percent of the larger principal curvature (of 16.7 1/m on a
plane); the worst site counts.
"""

import argparse
import json
from time import perf_counter
from typing import Any

import numpy as np

from evifuse.knowledge import load_knowledge
from evifuse.simulation import simulate
from evifuse.simulation.simulate import Noise
from evifuse.touch import curvature_threshold_per_m, sense_curvature

RADII_M = (0.015, 0.020, 0.030, 0.040, 0.060)
HOLLOW_RADII_M = (0.025, 0.030, 0.040, 0.060)  # a finger of 10 mm needs room to be lifted in a hollow
CURVED = {"cylinder": "C-", "trough": "C+", "sphere": "E-", "bowl": "E+", "saddle": "H"}
CLASSES = {"P": "quasiplanar", "N": "occluded"}
NOISES = {
    "clean": Noise(),
    "modest": Noise(pressure_pa=200.0, position_m=2e-5, angle_rad=2e-3),
    "strong": Noise(pressure_pa=1000.0, position_m=1e-4, angle_rad=1e-2),
}


def measure(name: str, noise: str, radius_m: float | None, rate_hz: float) -> dict[str, Any]:
    size = {} if radius_m is None else {"radius_m": radius_m}
    scene = simulate(name, picture=False, rate_hz=rate_hz, noise=NOISES[noise], **size)
    knowledge = load_knowledge("curvature")
    started = perf_counter()
    felt = sense_curvature(scene.scene.touch, knowledge)
    seconds = perf_counter() - started
    expected = "N" if name == "hole" else "P" if name == "plane" else CURVED[name]
    masses = {k: v for k, v in felt.evidence.as_dict().items() if k != "frame"}
    primitive = "N" if "N" in masses else max(masses, key=masses.__getitem__, default="frame")
    pairs = [
        (true, site)
        for true, site in zip(scene.truth.sites, felt.sites, strict=False)
        if true.contact and site.k1_per_m is not None
    ]
    errors = [
        100
        * max(abs(site.k1_per_m - true.k1_per_m), abs(site.k2_per_m - true.k2_per_m))
        / max(abs(true.k1_per_m), abs(true.k2_per_m), 16.7)
        for true, site in pairs
    ]
    if not errors:
        raise SystemExit(f"{name}, {radius_m} m, {noise}: no site has two curvatures: {felt.warnings}")
    true, site = pairs[int(np.argmax(errors))]
    return {
        "surface": name,
        "radius_m": radius_m,
        "noise": noise,
        "true_k1_per_m": true.k1_per_m,
        "true_k2_per_m": true.k2_per_m,
        "k1_per_m": site.k1_per_m,
        "k2_per_m": site.k2_per_m,
        "error_percent": max(errors),
        "sites": f"{len(felt.sites)} of {len(scene.truth.sites)}",
        "primitive": primitive,
        "mass": masses.get(primitive, 1.0),
        "decision": felt.classification.decision,
        "right": primitive == expected and felt.classification.decision == CLASSES.get(expected, "curved"),
        "sense_s": seconds,
    }


def cases() -> list[tuple[str, float | None]]:
    found: list[tuple[str, float | None]] = [("plane", None)]
    for name in CURVED:
        found += [(name, radius) for radius in (HOLLOW_RADII_M if name in ("trough", "bowl") else RADII_M)]
    return [*found, ("hole", None)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--noise", choices=NOISES, action="append", help="levels to run; all by default")
    parser.add_argument("--rate-hz", type=float, default=1000.0)
    arguments = parser.parse_args()
    rows = [
        measure(name, noise, radius, arguments.rate_hz)
        for noise in arguments.noise or NOISES
        for name, radius in cases()
    ]
    if arguments.json:
        print(json.dumps(rows))
        return
    print(f"flat below {curvature_threshold_per_m(0.010):g} 1/m; noise levels:")
    for name, noise in NOISES.items():
        print(f"  {name}: {noise.pressure_pa:g} Pa, {noise.position_m:g} m, {noise.angle_rad:g} rad")
    print(
        "noise    surface    R mm |  true k1      k2 |       k1      k2 | error % | sites  | felt, decision"
    )
    for row in rows:
        radius = "" if row["radius_m"] is None else f"{1000 * row['radius_m']:.0f}"
        k = "".join(f"{row[key]:8.2f}" for key in ("true_k1_per_m", "true_k2_per_m"))
        found = "".join(f"{row[key]:8.2f}" for key in ("k1_per_m", "k2_per_m"))
        felt = f"{row['primitive']} {row['mass']:.2f}, {row['decision']}{'' if row['right'] else '  WRONG'}"
        print(
            f"{row['noise']:<8} {row['surface']:<10} {radius:>4} | {k} | {found} |"
            f" {row['error_percent']:7.2f} | {row['sites']} | {felt}"
        )
    for noise in dict.fromkeys(row["noise"] for row in rows):
        level = [row for row in rows if row["noise"] == noise]
        errors = [row["error_percent"] for row in level]
        print(
            f"{noise}: worst error {max(errors):.2f} %, median {np.median(errors):.2f} %, "
            f"{sum(row['right'] for row in level)} of {len(level)} primitives and decisions right, "
            f"median time {1000 * np.median([row['sense_s'] for row in level]):.0f} ms"
        )


if __name__ == "__main__":
    main()
