"""What `judge.py` has found, by method, set, size and condition."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from judge_data import SIZES
from numpy.typing import NDArray

Array = NDArray[np.float64]
Cell = tuple[str, str, str]  # set, size, condition
Record = dict[str, Any]
MEASURES = {
    "accuracy": ("Accuracy, %", 100.0, True, 1),
    "brier": ("Brier score (0 to 2, lower is better)", 1.0, False, 3),
    "calibration": ("Expected calibration error, % (lower is better)", 100.0, False, 1),
    "rejection": ("Area under accuracy over coverage, %", 100.0, True, 1),
}
"""Title, factor, whether higher is better, decimals."""
ORDER = (
    "conductivity trained",
    "conductivity smooth",
    "conductivity chapter",
    "conductivity built in",
    "conductivity of masses",
    "Dempster",
    "posterior product",
    "evidential k-NN",
    "naive Bayes",
    "logistic regression",
    "random forest",
)


class Results:
    """Every score by method and cell, an array over seeds."""

    def __init__(self, records: list[Record]) -> None:
        self.sets = tuple(dict.fromkeys(r["set"] for r in records))
        self.sizes = tuple(s for s in SIZES if any(r["size"] == s for r in records))
        self.by_seed: dict[tuple[str, Cell], dict[int, Record]] = {}
        self.times: dict[str, list[tuple[float, float]]] = {}
        for r in records:
            for method, found in r["methods"].items():
                self.times.setdefault(method, []).append((found["fit_s"], found["predict_us"]))
                for condition, score in found["scores"].items():
                    cell = (r["set"], r["size"], condition)
                    self.by_seed.setdefault((method, cell), {})[r["seed"]] = score
        self.methods = tuple(m for m in ORDER if m in self.times)

    def at(self, method: str, cell: Cell, measure: str) -> Array | None:
        """Values over seeds, in their order; a size that holds all cases anyway is that of all."""
        found = self.by_seed.get((method, cell)) or self.by_seed.get((method, (cell[0], "all", cell[2])))
        return np.array([found[seed][measure] for seed in sorted(found)]) if found else None

    def mean(self, method: str, cells: Iterable[Cell], measure: str) -> Array | None:
        """Mean over cells, for each seed; None if the method was not judged on all of them."""
        values = [v for v in (self.at(method, cell, measure) for cell in cells) if v is not None]
        return np.mean(values, axis=0) if values else None

    def cells(self, sets: Iterable[str], sizes: Iterable[str], condition: str) -> list[Cell]:
        """Cells of a condition, those left out where it doesn't exist (a single source)."""
        every = [(t, s, condition) for t in sets for s in sizes]
        return [c for c in every if any(self.at(m, c, "accuracy") is not None for m in self.methods)]

    def methods_of(self, sets: Iterable[str]) -> tuple[str, ...]:
        """Methods that were judged on these sets."""
        names = set(sets)
        return tuple(m for m in self.methods if any(k == m and c[0] in names for k, c in self.by_seed))
