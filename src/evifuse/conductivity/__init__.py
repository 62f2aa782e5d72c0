"""The evidential classifier of appendix A: how well a knowledge base conducts evidence."""

from importlib import import_module
from typing import Any

from evifuse.conductivity.aggregate import (
    Aggregate,
    AggregateProperties,
    KnowledgeBase,
    aggregate_properties,
)
from evifuse.conductivity.choose import Choice, Judged, choose_reading
from evifuse.conductivity.classify import (
    BRANCHES,
    Classification,
    PrototypeExplanation,
    classify,
    normalised_belief,
)
from evifuse.conductivity.compiled import CompiledClassifier, compile  # noqa: A004
from evifuse.conductivity.diagnose import Diagnosis, diagnose
from evifuse.conductivity.entropy import (
    belief_entropy,
    capacity,
    core_entropy,
    divergence,
    focal_distance,
    focal_divergence,
    fractal_dimension,
    inner_entropy,
    interaction_dimension,
    projection,
    similarity,
    within_set_entropy,
)
from evifuse.conductivity.reading import READINGS, Reading
from evifuse.conductivity.rehearse import Trial
from evifuse.conductivity.train import TRAINED_READINGS, TrainingReport, train, train_report

__all__ = [
    "BRANCHES",
    "READINGS",
    "TRAINED_READINGS",
    "Aggregate",
    "AggregateProperties",
    "Choice",
    "Classification",
    "CompiledClassifier",
    "Diagnosis",
    "Judged",
    "KnowledgeBase",
    "PrototypeExplanation",
    "Reading",
    "TrainingReport",
    "Trial",
    "aggregate_properties",
    "belief_entropy",
    "capacity",
    "choose_reading",
    "classify",
    "compile",
    "core_entropy",
    "diagnose",
    "divergence",
    "focal_distance",
    "focal_divergence",
    "fractal_dimension",
    "inner_entropy",
    "interaction_dimension",
    "normalised_belief",
    "projection",
    "similarity",
    "train",
    "train_report",
    "within_set_entropy",
]


def __getattr__(name: str) -> Any:
    """Import the estimator when it is asked for: it needs scikit-learn, so it is not part of ``import *``."""
    if name == "ConductivityClassifier":
        return import_module("evifuse.conductivity.estimator").ConductivityClassifier
    raise AttributeError(f"module 'evifuse.conductivity' has no attribute {name!r}")
