"""Data to judge classifiers on: six public tables and the evidence of the project's own senses.

The features of every set are split into the sources that a person would name. For the project's own
evidence the features are masses, and a missing one goes to the frame of its source.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.belief import Frame

Array = NDArray[np.float64]
SIZES = ("5", "20", "100", "all")
"""Training cases per class; where a class has fewer, all that it has."""
CONDITIONS = ("complete", "20 % missing", "50 % missing", "one corrupted")
TEST_SHARE = 0.4


@dataclass(frozen=True)
class Masses:
    """What the columns of a source of evidence mean: masses of these focal sets, the frame last."""

    frame: Frame
    focal_sets: NDArray[np.int64]


@dataclass(frozen=True)
class Table:
    """A set of cases: features (N, J), labels (N,), columns by source, and where it comes from."""

    name: str
    features: Array
    labels: NDArray[Any]
    sources: dict[str, NDArray[np.intp]]
    origin: str
    masses: dict[str, Masses] | None = None
    groups: NDArray[Any] | None = None


@dataclass(frozen=True)
class Split:
    """One seed's training cases, at one size, and its test cases under every condition."""

    table: Table
    train: Array
    labels: NDArray[Any]
    tests: dict[str, Array]
    truth: NDArray[np.intp]
    classes: NDArray[Any]
    seed: int
    groups: NDArray[Any] | None = None


def tables(evidence: Path | None) -> Iterator[Table]:
    """Every set, the public ones first.

    Parameters
    ----------
    evidence : Path or None
        Folder that `evidence.py` wrote; without it there are public sets only.

    Yields
    ------
    Table
        One set.
    """
    for make in (iris, wine, breast_cancer, digits, phishing, segments):
        yield make()
    for name, files in OWN.items() if evidence is not None else ():
        if all((evidence / f"{file}.parquet").exists() for file in files.values()):
            yield own_evidence(name, {source: evidence / f"{f}.parquet" for source, f in files.items()})


OWN = {
    "shapes": {"sight": "shapes"},
    "curvature": {"touch": "curvature"},
    "objects": {"sight": "objects-shape", "touch": "objects-touch"},
}
"""The project's own evidence: file of each source."""


def _columns(names: list[str], **sources: Callable[[str], bool]) -> dict[str, NDArray[np.intp]]:
    return {
        source: np.array([i for i, name in enumerate(names) if belongs(name)])
        for source, belongs in sources.items()
    }


def _from_sklearn(name: str, loaded: Any, origin: str, **sources: Callable[[str], bool]) -> Table:
    names = [str(n) for n in loaded.feature_names]
    labels = np.array([str(loaded.target_names[t]) for t in loaded.target])
    return Table(name, np.asarray(loaded.data, float), labels, _columns(names, **sources), origin)


def iris() -> Table:
    from sklearn.datasets import load_iris

    origin = "Iris (Fisher 1936), UCI, CC BY 4.0; in scikit-learn"
    return _from_sklearn(
        "iris", load_iris(), origin, sepal=lambda n: "sepal" in n, petal=lambda n: "petal" in n
    )


def wine() -> Table:
    from sklearn.datasets import load_wine

    phenols = ("total_phenols", "flavanoids", "nonflavanoid_phenols", "proanthocyanins")
    colour = ("color_intensity", "hue", "od280/od315_of_diluted_wines")
    return _from_sklearn(
        "wine",
        load_wine(),
        "Wine (Forina et al. 1991), UCI, CC BY 4.0; in scikit-learn",
        body=lambda n: n not in phenols + colour,
        phenols=lambda n: n in phenols,
        colour=lambda n: n in colour,
    )


def breast_cancer() -> Table:
    from sklearn.datasets import load_breast_cancer

    return _from_sklearn(
        "breast cancer",
        load_breast_cancer(),
        "Breast Cancer Wisconsin, Diagnostic (Wolberg et al. 1993), UCI, CC BY 4.0; in scikit-learn",
        mean=lambda n: n.startswith("mean"),
        error=lambda n: n.endswith("error"),
        worst=lambda n: n.startswith("worst"),
    )


def digits() -> Table:
    from sklearn.datasets import load_digits

    return _from_sklearn(
        "digits",
        load_digits(),
        "Handwritten Digits (Alpaydin and Kaynak 1998), UCI, CC BY 4.0; in scikit-learn",
        upper=lambda n: int(n.split("_")[1]) < 4,
        lower=lambda n: int(n.split("_")[1]) >= 4,
    )


def _from_river(name: str, stream: Any, origin: str, **sources: Callable[[str], bool]) -> Table:
    cases = list(stream)
    names = list(cases[0][0])
    features = np.array([[float(x[n]) for n in names] for x, _ in cases])
    return Table(name, features, np.array([str(y) for _, y in cases]), _columns(names, **sources), origin)


def phishing() -> Table:
    from river.datasets import Phishing

    address = ("https", "is_popular", "long_url", "age_of_domain", "ip_in_url")
    return _from_river(
        "phishing",
        Phishing(),
        "Website Phishing (Abdelhamid 2014), UCI, CC BY 4.0; in river",
        address=lambda n: n in address,
        page=lambda n: n not in address,
    )


def segments() -> Table:
    from river.datasets import ImageSegments

    texture = (
        "short-line-density-5",
        "short-line-density-2",
        "vedge-mean",
        "vegde-sd",
        "hedge-mean",
        "hedge-sd",
    )
    return _from_river(
        "segments",
        ImageSegments(),
        "Image Segmentation (Vision Group, University of Massachusetts 1990), UCI, CC BY 4.0; in river",
        place=lambda n: "centroid" in n,
        texture=lambda n: n in texture,
        colour=lambda n: "centroid" not in n and n not in texture,
    )


def own_evidence(name: str, files: dict[str, Path]) -> Table:
    """Evidence of the project's senses, from Parquet files with a label column."""
    from pyarrow.parquet import read_table

    from evifuse.belief import from_parquet

    features, sources, masses, start = [], {}, {}, 0
    for source, path in files.items():
        m, rows = from_parquet(path), read_table(path)
        if int(m.focal_sets[-1]) != m.frame.full:
            raise SystemExit(f"{path}: the frame must be the last focal set, as evidence.py writes it")
        features.append(m.masses)
        sources[source] = np.arange(start, start + len(m.focal_sets))
        masses[source] = Masses(m.frame, m.focal_sets)
        start += len(m.focal_sets)
    labels = np.array(rows["label"].to_pylist())
    groups = np.array(rows["group"].to_pylist())
    origin = "own sensors on the Hand-drawn Shapes Dataset, (c) 2022 Francois Robert, CC BY 4.0"
    return Table(
        name,
        np.concatenate(features, axis=1),
        labels,
        sources,
        origin if name == "shapes" else "own sensors on the project's own simulation",
        masses,
        groups if name == "shapes" else None,
    )


def split(table: Table, seed: int) -> Split:
    """Test cases (40 %) under every condition, and all the training cases, shuffled.

    Stratified by class; where cases have groups (people who drew), whole groups are held out.
    """
    rng = np.random.default_rng([seed, 1989])
    order = rng.permutation(len(table.labels))
    held_out = np.zeros(len(order), dtype=bool)
    if table.groups is not None:
        for group in rng.permutation(np.unique(table.groups)):
            if held_out.mean() < TEST_SHARE:
                held_out |= table.groups == group
    else:
        for label in np.unique(table.labels):
            mine = order[table.labels[order] == label]
            held_out[mine[: round(TEST_SHARE * len(mine))]] = True
    train, test = order[~held_out[order]], np.flatnonzero(held_out)
    classes, truth = np.unique(table.labels, return_inverse=True)
    tests = {name: changed(table, table.features[test], name, seed) for name in conditions(table)}
    groups = None if table.groups is None else table.groups[train]
    return Split(table, table.features[train], table.labels[train], tests, truth[test], classes, seed, groups)


def conditions(table: Table) -> tuple[str, ...]:
    """All conditions; a single source can't be corrupted without losing everything."""
    return CONDITIONS if len(table.sources) > 1 else CONDITIONS[:3]


def changed(table: Table, features: Array, condition: str, seed: int) -> Array:
    """Test features with some missing at random (NaN, or moved to the frame), or one source permuted.

    All cases are there once for every source that is permuted.
    """
    rng = np.random.default_rng([seed, CONDITIONS.index(condition)])
    out = features.copy()
    if condition == "one corrupted":
        out = np.concatenate([features] * len(table.sources))
        for part, columns in zip(np.split(out, len(table.sources)), table.sources.values(), strict=True):
            part[:, columns] = features[rng.permutation(len(features))][:, columns]
    elif condition != "complete":
        gone = rng.random(features.shape) < float(condition.split()[0]) / 100
        if table.masses is None:
            out[gone] = np.nan
        else:
            for columns in table.sources.values():
                lost = gone[:, columns[:-1]]
                out[:, columns[-1]] += np.where(lost, features[:, columns[:-1]], 0.0).sum(axis=1)
                out[:, columns[:-1]] = np.where(lost, 0.0, features[:, columns[:-1]])
    return out


def shortened(whole: Split, size: str) -> Split | None:
    """The same split with so many training cases per class; None if that would be all of them."""
    if size == "all":
        return whole
    ranks = np.array([np.sum(whole.labels[:i] == label) for i, label in enumerate(whole.labels)])
    kept = ranks < int(size)
    if kept.all():
        return None
    groups = None if whole.groups is None else whole.groups[kept]
    return replace(whole, train=whole.train[kept], labels=whole.labels[kept], groups=groups)
