"""Learn how far the estimate of a site is relied on, and write `knowledge/reliance.yaml`.

Simulated recordings with seeds below 1000: all primitives on the catalogue's surfaces and on random bodies,
felt with fine, coarse and real arrays, at every level of noise; a third of those of the fine sphere slips, by
5 to 40 % of the turn. The weights make what is true most likely in the pignistic probabilities of the sites
(logarithmic score), with a weak pull of every weight to 0; a weight can't be positive, as no term makes a
site more reliable. Every second recording tells how the weights of the others do, and what each term does.
"""

import argparse
import pickle
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import touch_cases
from touch_primitives import BINS

from evifuse.errors import EvifuseError
from evifuse.simulation import NOISES, SimulatedScene
from evifuse.simulation.cases import random_case
from evifuse.simulation.dataset import simulated_case
from evifuse.simulation.random_cases import random_body_case
from evifuse.touch import sensor
from evifuse.touch.layouts import load_fingertip
from evifuse.touch.reliance import TERMS

PATH = Path(__file__).parents[1] / "src/evifuse/knowledge/reliance.yaml"
SEED = 500
NOTES = {
    "coarse": "pitch over patch radius",
    "noisy": "noise over peak pressure, tenths",
    "slip": "share of the turn that was not rolled, tenths",
    "unresolved": "standard error over the threshold between flat and curved",
}
PLAN = {  # how many recordings of each, over --count
    ("sphere", "body"): 3.0,
    ("sphere:0.01:0.0018", "cat"): 0.6,
    ("sphere:0.01:0.003", "cat"): 0.6,
    ("paxini:DP-L3530-Omega", "cat"): 1.0,
    ("paxini:DP-M2826-Omega", "cat"): 1.0,
    ("paxini:DP-M2826-Omega", "body"): 0.6,
    ("paxini:DP-S2716-Core", "cat"): 1.0,
    ("paxini:DP-S1813-Elite", "cat"): 0.6,
    ("paxini:DP-S1813-Core", "cat"): 0.6,
}
PULL = 0.02
Row = tuple[int, dict[str, float], dict[str, float], str]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=21, help="recordings with each fingertip, about")
    parser.add_argument("--minutes", type=float, default=60.0, help="stop gathering after so long")
    parser.add_argument(
        "--keep", type=Path, metavar="DIR", help="where simulated recordings are kept, and found"
    )
    parser.add_argument("--write", action="store_true", help="write the model; only print it otherwise")
    arguments = parser.parse_args()
    begun, rows = perf_counter(), list[Row]()
    for row in gathered(arguments.count, arguments.keep):
        rows.append(row)
        if perf_counter() - begun > 60 * arguments.minutes:
            break
    number = np.array([row[0] for row in rows])
    terms = np.array([[row[1].get(name, 0.0) for name in TERMS] for row in rows])
    share = np.array([row[2].get(row[3], 0.0) for row in rows])
    best = np.array([max(row[2].values()) for row in rows])
    right = np.array([max(row[2], key=row[2].__getitem__) == row[3] for row in rows])
    learn, held = number % 2 == 0, number % 2 == 1
    print(
        f"{len(rows)} sites; log score of what is true, and calibration error, on {held.sum()} held-out ones"
    )
    models = {
        "no discount": np.array([50.0] + [0.0] * len(TERMS)),
        "all terms": fitted(terms[learn], share[learn]),
    }
    for i, name in enumerate(TERMS):
        without = terms * (np.arange(len(TERMS)) != i)
        models[f"without {name}"] = fitted(without[learn], share[learn], i)
    for name, model in models.items():
        error = calibration_error(relied(model, terms[held]), best[held], right[held])
        print(f"  {name:<20} {score(model, terms[held], share[held]):8.4f}  {error:.3f}")
    learned = fitted(terms, share)
    lines = [f"  {n}: {w:.3f}  # {NOTES[n]}" for n, w in zip(TERMS, learned[1:], strict=True)]
    text = "\n".join(
        [
            "# How far a touched site is relied on: see evifuse.touch.reliance. Log odds = constant + terms.",
            "# Written by benchmarks/touch_calibrate.py.",
            "title: reliance on felt curvature",
            "source: >-",
            f"  learned by evifuse from {len(rows)} simulated sites, seed {SEED}; what has a weight of 0",
            "  costs no more than the standard errors tell: they follow the taxels' spacing over the patch,",
            "  and the scatter that noise and slip leave",
            f"constant: {learned[0]:.3f}",
            "terms:",
            *lines,
        ]
    )
    print(text)
    if arguments.write:
        PATH.write_text(text + "\n")


def recorded(keep: Path | None, finger: str, where: str, number: int) -> SimulatedScene | None:
    """One recording of the plan, simulated or read back; None where the finger does not fit."""
    file = None if keep is None else keep / f"{finger}-{where}-{SEED}-{number}.pickle"
    if file is not None and file.is_file():
        return pickle.loads(file.read_bytes())
    tip = None if finger == "sphere" else load_fingertip(finger)
    scene = None
    try:
        case = (random_body_case if where == "body" else random_case)(SEED, number, fingertip=tip)
        generator, noise = np.random.default_rng([SEED, number, 99]), NOISES[case.noise]
        if finger == "sphere" and generator.uniform() < 0.35:
            noise = replace(noise, slip=float(generator.uniform(0.05, 0.4)))
        scene = simulated_case(case, tip, noise, 1000.0)
        scene = replace(scene, truth=replace(scene.truth, surface=None))
    except EvifuseError:
        pass
    if file is not None:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(pickle.dumps(scene))
    return scene


def gathered(count: int, keep: Path | None) -> Iterator[Row]:
    """Number, terms, probabilities of the primitives and the true one of each touched site."""
    seen: list[dict[str, float]] = []
    kept: Any = sensor.reliance

    def taken(terms: dict[str, float]) -> float:
        seen.append(dict(terms))
        return 1.0

    sensor.reliance = taken
    try:
        for (finger, where), share in PLAN.items():
            for number in range(round(share * count)):
                scene = recorded(keep, finger, where, number)
                if scene is None or scene.scene.touch is None:
                    continue
                seen.clear()
                felt = sensor.sense_curvature(scene.scene.touch)
                rows = touch_cases.rows_of(scene, felt, felt, ("", "", finger, number, 0.0))
                touched = [row for row in rows if np.isfinite(row.k[0])]
                if len(seen) == 1 and len(touched) == 1 and touched[0].masses:
                    yield number, seen[0], touched[0].pignistic, touched[0].primitive
    finally:
        sensor.reliance = kept


def relied(weights: np.ndarray, terms: np.ndarray) -> np.ndarray:
    """How far each site is relied on."""
    return 1 / (1 + np.exp(-np.clip(weights[0] + terms @ weights[1:], -50, 50)))


def score(weights: np.ndarray, terms: np.ndarray, share: np.ndarray) -> float:
    """Mean logarithm of the pignistic probability of what is true."""
    kept = relied(weights, terms)
    return float(np.mean(np.log(np.maximum(kept * share + (1 - kept) / len(touch_cases.NAMES), 1e-12))))


def calibration_error(kept: np.ndarray, best: np.ndarray, right: np.ndarray) -> float:
    """How far the largest pignistic probabilities are from the share that is right, by tenths."""
    sure = kept * best + (1 - kept) / len(touch_cases.NAMES)
    label = np.minimum((sure * BINS).astype(int), BINS - 1)
    return float(sum(abs((sure - right)[label == b].sum()) for b in range(BINS)) / len(sure))


def fitted(terms: np.ndarray, share: np.ndarray, left_out: int | None = None) -> np.ndarray:
    """Constant and weights, by L-BFGS; one may be left out."""
    from scipy.optimize import minimize

    def loss(weights: np.ndarray) -> float:
        return -score(weights, terms, share) + PULL * float(np.square(weights[1:]).mean())

    bounds = [(-2.0, 6.0), *[(-8.0, 0.0)] * len(TERMS)]
    if left_out is not None:
        bounds[1 + left_out] = (0.0, 0.0)
    start = np.array([3.0, *[-0.5] * len(TERMS)])
    return minimize(loss, start, method="L-BFGS-B", bounds=bounds).x


if __name__ == "__main__":
    main()
