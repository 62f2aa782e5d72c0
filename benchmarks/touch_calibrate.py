"""Learn how far the estimate of a site is relied on, and write `knowledge/reliance.yaml`.

Simulated recordings of all primitives, with seeds below 1000. The weights make what is true most likely in
the pignistic probabilities of the sites (logarithmic score), with a weak pull of every weight to 0; a weight
can't be positive, as no term makes a site more reliable. The rest of the seeds tells how it does.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import touch_cases
from touch import real_layouts
from touch_primitives import labelled, simulated

from evifuse.errors import EvifuseError
from evifuse.simulation.dataset import random_case
from evifuse.touch import reliance as rely
from evifuse.touch import sensor
from evifuse.touch.reliance import TERMS

PATH = Path(__file__).parents[1] / "src/evifuse/knowledge/reliance.yaml"
NOTES = {
    "coarse": "pitch over patch radius",
    "noisy": "noise over peak pressure, tenths",
    "slip": "share of the turn that was not rolled, tenths",
    "unresolved": "standard error over the threshold between flat and curved",
}
PULL = 0.02


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=70, help="recordings with each fingertip")
    parser.add_argument("--minutes", type=float, default=60.0, help="stop gathering after so long")
    parser.add_argument("--write", action="store_true", help="write the model; only print it otherwise")
    arguments = parser.parse_args()
    begun, rows = perf_counter(), list[tuple[dict[str, float], float]]()
    for row in gathered(arguments.count):
        rows.append(row)
        if perf_counter() - begun > 60 * arguments.minutes:
            break
    terms = np.array([[values.get(name, 0.0) for name in TERMS] for values, _ in rows])
    share = np.array([given for _, given in rows])
    learned = fitted(terms[::2], share[::2])
    for name, part in (("learned on", slice(0, None, 2)), ("held out", slice(1, None, 2))):
        print(f"{name}: {len(share[part])} sites, log score {score(learned, terms[part], share[part]):.4f}")
    learned = fitted(terms, share)
    lines = [f"  {n}: {w:.3f}  # {NOTES[n]}" for n, w in zip(TERMS, learned[1:], strict=True)]
    text = "\n".join(
        [
            "# How far a touched site is relied on: see evifuse.touch.reliance. Log odds = constant + terms.",
            "# Written by benchmarks/touch_calibrate.py.",
            "title: reliance on felt curvature",
            f"source: learned by evifuse from {len(rows)} simulated sites, seed 500",
            f"constant: {learned[0]:.3f}",
            "terms:",
            *lines,
        ]
    )
    print(text)
    if arguments.write:
        PATH.write_text(text + "\n")


def gathered(count: int) -> Iterator[tuple[dict[str, float], float]]:
    """Terms of each touched site, and the probability that its distribution gives to what is true."""
    tips: dict[str, Any] = {"sphere 305": None} | real_layouts()
    seen: list[dict[str, float]] = []
    kept = rely

    def recorded(terms: dict[str, float]) -> float:
        seen.append(terms)
        return 1.0

    sensor.reliance = recorded
    try:
        for number in range(count):
            for tip in tips.values():
                radius = 0.01 if tip is None else tip.radius_m
                try:
                    case = random_case(500, number, fingertip=tip)
                    scene = simulated(case, tip)
                except EvifuseError:
                    continue
                seen.clear()
                felt = sensor.sense_curvature(scene.scene.touch)
                touched = touch_cases.rows_of(scene, felt, felt, ("", "", "", number, 0.0))
                for row in touched:
                    if row.masses and np.isfinite(row.felt[0]) and seen:
                        yield dict(seen[0]), row.masses.get(labelled(row, radius).primitive, 0.0)
    finally:
        sensor.reliance = kept


def score(weights: np.ndarray, terms: np.ndarray, share: np.ndarray) -> float:
    """Mean logarithm of the pignistic probability of what is true."""
    relied = 1 / (1 + np.exp(-np.clip(weights[0] + terms @ weights[1:], -50, 50)))
    return float(np.mean(np.log(relied * share + (1 - relied) / len(touch_cases.NAMES))))


def fitted(terms: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Constant and weights, by L-BFGS."""
    from scipy.optimize import minimize

    def loss(weights: np.ndarray) -> float:
        return -score(weights, terms, share) + PULL * float(np.square(weights[1:]).mean())

    bounds = [(-2.0, 6.0), *[(-8.0, 0.0)] * len(TERMS)]
    return minimize(loss, np.array([3.0, *[-0.5] * len(TERMS)]), method="L-BFGS-B", bounds=bounds).x


if __name__ == "__main__":
    main()
