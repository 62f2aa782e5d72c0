"""The evidential classifier of appendix A: how well a knowledge base conducts evidence."""

from evifuse.conductivity.aggregate import (
    Aggregate,
    AggregateProperties,
    KnowledgeBase,
    aggregate_properties,
)
from evifuse.conductivity.classify import (
    BRANCHES,
    Classification,
    PrototypeExplanation,
    classify,
    normalised_belief,
)
from evifuse.conductivity.compiled import CompiledClassifier, compile  # noqa: A004
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

__all__ = [
    "BRANCHES",
    "READINGS",
    "Aggregate",
    "AggregateProperties",
    "Classification",
    "CompiledClassifier",
    "KnowledgeBase",
    "PrototypeExplanation",
    "Reading",
    "aggregate_properties",
    "belief_entropy",
    "capacity",
    "classify",
    "compile",
    "core_entropy",
    "divergence",
    "focal_distance",
    "focal_divergence",
    "fractal_dimension",
    "inner_entropy",
    "interaction_dimension",
    "normalised_belief",
    "projection",
    "similarity",
    "within_set_entropy",
]
