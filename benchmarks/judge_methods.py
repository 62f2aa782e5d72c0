"""The methods that are judged: each takes a split and gives functions from features to probabilities.

Settings are chosen on training cases only: the peers' main setting by threefold cross-validation of the log
loss, the random forest as scikit-learn has it with 200 trees. Features are standardised on training cases.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from judge_data import Masses, Split
from numpy.typing import NDArray

from evifuse.belief import MassFunction, dempster, pignistic
from evifuse.conductivity import READINGS, KnowledgeBase, classify, normalised_belief
from evifuse.knowledge import load_knowledge

Array = NDArray[np.float64]
Predictor = Callable[[Array], Array]
TINY = 1e-12


def neighbours(split: Split) -> dict[str, Predictor]:
    """Evidential nearest neighbours (Denœux 1995) on standardised features, means for missing ones."""
    from evifuse.belief.neighbours import EvidentialNeighbours

    scale = scaler(split)
    makers = [partial(EvidentialNeighbours, n_neighbours=k) for k in (3, 5, 10, 20)]
    model = best_of(makers, scale(split.train), split.labels)
    return {"evidential k-NN": lambda x: model.predict_proba(scale(x))}


def bayes(split: Split) -> dict[str, Predictor]:
    """Naive Bayes with normal densities; a missing feature is left out of the product."""
    from sklearn.naive_bayes import GaussianNB

    scale = scaler(split)
    makers = [partial(GaussianNB, var_smoothing=v) for v in (1e-9, 1e-3, 1e-2, 0.1, 1.0)]
    model = best_of(makers, scale(split.train), split.labels)

    def predict(x: Array) -> Array:
        x = scale(x, fill=False)
        logs = -0.5 * (np.log(2 * np.pi * model.var_) + (x[:, None] - model.theta_) ** 2 / model.var_)
        joint = np.log(model.class_prior_) + np.where(np.isnan(logs), 0.0, logs).sum(axis=2)
        shares = np.exp(joint - joint.max(axis=1, keepdims=True))
        return shares / shares.sum(axis=1, keepdims=True)

    return {"naive Bayes": predict}


def logistic(split: Split) -> dict[str, Predictor]:
    """Logistic regression on standardised features, means for missing ones."""
    from sklearn.linear_model import LogisticRegression

    scale = scaler(split)
    makers = [partial(LogisticRegression, C=c, max_iter=2000) for c in (0.1, 1.0, 10.0)]
    model = best_of(makers, scale(split.train), split.labels)
    return {"logistic regression": lambda x: model.predict_proba(scale(x))}


def forest(split: Split) -> dict[str, Predictor]:
    """Random forest of 200 trees, means for missing features."""
    from sklearn.ensemble import RandomForestClassifier

    scale = scaler(split)
    model = RandomForestClassifier(200, random_state=split.seed, n_jobs=1)
    model.fit(scale(split.train), split.labels)
    return {"random forest": lambda x: model.predict_proba(scale(x))}


def scaler(split: Split) -> Callable[..., Array]:
    """Standardise by the training cases; a missing feature becomes their mean, unless fill is off."""
    mean, deviation = split.train.mean(axis=0), split.train.std(axis=0)
    deviation = np.where(deviation > 1e-9, deviation, 1.0)

    def scale(x: Array, fill: bool = True) -> Array:
        z = (x - mean) / deviation
        return np.where(np.isnan(z), 0.0, z) if fill else z

    return scale


def best_of(makers: list[Callable[[], Any]], x: Array, labels: NDArray[Any]) -> Any:
    """The model with the least log loss in threefold cross-validation, fitted to all training cases."""
    from sklearn.metrics import log_loss
    from sklearn.model_selection import StratifiedKFold

    folds = list(StratifiedKFold(3, shuffle=True, random_state=0).split(x, labels))
    classes = np.unique(labels)

    def loss(make: Callable[[], Any]) -> float:
        parts = [(make().fit(x[a], labels[a]).predict_proba(x[b]), labels[b]) for a, b in folds]
        guesses = np.clip(np.concatenate([p for p, _ in parts]), 1e-6, 1)
        guesses /= guesses.sum(axis=1, keepdims=True)
        return float(log_loss(np.concatenate([y for _, y in parts]), guesses, labels=classes))

    return min(makers, key=loss)().fit(x, labels)


def estimator(split: Split, **settings: Any) -> Any:
    """The fitted scikit-learn estimator of this project, its evidence learned from each source's features."""
    from evifuse.conductivity.estimator import ConductivityClassifier

    sources = [columns.tolist() for columns in split.table.sources.values()]
    return ConductivityClassifier(sources=sources, random_state=split.seed, **settings).fit(
        split.train, split.labels
    )


def on_features(split: Split) -> dict[str, Predictor]:
    """Conductivity with learned prototypes, and two other ways to join the very same evidence."""
    model = estimator(split)
    return {
        "conductivity trained": model.predict_proba,
        "Dempster": lambda x: by_dempster(model.source_evidence(x)),
        "posterior product": lambda x: by_product(model.source_evidence(x)),
    }


def by_dempster(sources: list[MassFunction]) -> Array:
    """Pignistic probabilities of the sources' combination; crumbs on the frame prevent total conflict."""
    joint, *others = [_with_doubt(m) for m in sources]
    for m in others:
        joint = dempster(joint, m).mass
    return np.asarray(pignistic(joint))


def _with_doubt(m: MassFunction) -> MassFunction:
    m = m.to("shared")
    masses = (1 - TINY) * m.masses + TINY * (m.focal_sets == m.frame.full)
    return MassFunction.trusted(m.frame, m.focal_sets, masses)


def by_product(sources: list[MassFunction]) -> Array:
    """Product of the sources' pignistic probabilities, normalised: posteriors with equal priors."""
    logs = sum(np.log(np.maximum(pignistic(m), TINY)) for m in sources)
    shares = np.exp(logs - logs.max(axis=1, keepdims=True))
    return shares / shares.sum(axis=1, keepdims=True)


def chapter(split: Split) -> dict[str, Predictor]:
    """The sound reading: the printed tables for the senses, else one prototype for each class; plain sums."""
    if split.table.masses is not None:
        return {"conductivity chapter": by_tables(split, "chapter-")}
    model = estimator(split, reading=READINGS["sound"], max_prototypes=1)

    def predict(x: Array) -> Array:
        told = zip(model.source_evidence(x), model.knowledge_, strict=True)
        return summed([classify(said, base) for said, base in told], split)

    return {"conductivity chapter": predict}


def smooth(split: Split) -> dict[str, Predictor]:
    """Learned prototypes under the sound reading, the jump of A.8 smoothed."""
    from evifuse.conductivity.train import TRAINED_READINGS

    model = estimator(split, reading=TRAINED_READINGS["smooth"])
    return {"conductivity smooth": model.predict_proba}


def on_masses(split: Split) -> dict[str, Predictor]:
    """For the senses' own evidence: prototypes learned from the masses themselves, and our own tables."""
    if split.table.masses is None:
        return {}
    return {"conductivity of masses": by_training(split)}


def own_tables(split: Split) -> dict[str, Predictor]:
    """The knowledge bases that the sensors use by default."""
    return {} if split.table.masses is None else {"conductivity built in": by_tables(split, "")}


def evidence_of(split: Split, x: Array) -> dict[str, MassFunction]:
    """Features of the senses' own evidence as what they are: masses, by source."""
    masses: dict[str, Masses] = split.table.masses or {}
    return {
        name: MassFunction.trusted(m.frame, m.focal_sets, x[:, split.table.sources[name]].copy())
        for name, m in masses.items()
    }


def by_training(split: Split) -> Predictor:
    """A knowledge base learned from each sense's evidence, joined as the estimator joins its sources."""
    from evifuse.conductivity.estimator import joined
    from evifuse.conductivity.train import train

    names = split.classes.tolist()
    bases = {
        name: train(m, split.labels.tolist(), seed=split.seed, groups=split.groups)
        for name, m in evidence_of(split, split.train).items()
    }

    def predict(x: Array) -> Array:
        found = [classify(m, bases[name]).belief for name, m in evidence_of(split, x).items()]
        order = np.array([found[0].frame.mask(name) for name in names])
        return np.asarray(pignistic(joined(names, [belief.on(order) for belief in found])))

    return predict


def summed(found: list[Any], split: Split) -> Array:
    """Sum of conductivities, normalised; the frame keeps what no source commits, if the reading keeps it."""
    total = sum(_in_order(c.classes, c.conductivities, split) for c in found)
    ignorance = np.prod([c.belief.on(np.array([c.belief.frame.full]))[:, 0] for c in found], axis=0)
    return np.asarray(pignistic(normalised_belief(split.classes.tolist(), total, ignorance)))


def _in_order(classes: tuple[str, ...], conductivities: Array, split: Split) -> Array:
    return conductivities[:, [classes.index(c) for c in split.classes.tolist()]]


def by_tables(split: Split, prefix: str) -> Predictor:
    """Shapes by table 1, touch by table 4, both fused as in section 5."""
    shape, curvature = load_knowledge(f"{prefix}shape"), load_knowledge(f"{prefix}curvature")

    def predict(x: Array) -> Array:
        evidence = evidence_of(split, x)
        if "touch" not in evidence:
            return summed([classify(evidence["sight"], shape)], split)
        touched = classify(evidence["touch"], curvature)
        if "sight" not in evidence:
            return summed([touched], split)
        return fused(split, classify(evidence["sight"], shape), touched, evidence, curvature)

    return predict


def fused(
    split: Split, seen: Any, touched: Any, evidence: dict[str, MassFunction], curvature: KnowledgeBase
) -> Array:
    """Section 5.2 and 5.3, case by case."""
    from evifuse.fusion import curvature_from_shape

    touch = evidence["touch"]
    missed = touch.on(np.array([touch.frame.mask("N")]))[:, 0]
    from_shape = np.array(
        [
            list(curvature_from_shape(dict(zip(seen.classes, row, strict=True)), curvature, n).values())
            for row, n in zip(seen.conductivities.tolist(), missed.tolist(), strict=True)
        ]
    )
    total = _in_order(curvature.classes, touched.conductivities + from_shape, split)
    kept = float(curvature.reading.keep_ignorance)
    ignorance = kept * np.prod([m.on(np.array([m.frame.full]))[:, 0] for m in evidence.values()], axis=0)
    return np.asarray(pignistic(normalised_belief(split.classes.tolist(), total, ignorance)))


UNITS: dict[str, Callable[[Split], dict[str, Predictor]]] = {
    "chapter": chapter,
    "tables": own_tables,
    "features": on_features,
    "masses": on_masses,
    "smooth": smooth,
    "neighbours": neighbours,
    "bayes": bayes,
    "logistic": logistic,
    "forest": forest,
}
"""What is fitted together; the names of the methods are in what each returns."""
