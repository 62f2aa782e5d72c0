"""The theory of evidence, useful on its own: frames, mass functions, and what is computed from them."""

from importlib import import_module
from typing import Any

from evifuse.belief.average import average, murphy
from evifuse.belief.cautious import bold, cautious, decombine
from evifuse.belief.combine import (
    Combination,
    conjunctive,
    dempster,
    disjunctive,
    dubois_prade,
    on_frame,
    pcr5,
    yager,
)
from evifuse.belief.condition import condition
from evifuse.belief.correct import (
    Context,
    contextual_discounting,
    contextual_reinforcement,
    fit_reliabilities,
)
from evifuse.belief.decide import (
    REJECTED,
    Expectation,
    decide,
    expected_cost,
    maximum_belief,
    maximum_pignistic,
    maximum_plausibility,
    names_of,
)
from evifuse.belief.desiderata import DESIDERATA, MEASURES, Measure
from evifuse.belief.discount import discount
from evifuse.belief.distance import bhattacharyya, conflict, jousselme
from evifuse.belief.dominance import bound_dominance, interval_dominance, maximality
from evifuse.belief.entropies import (
    belief_entropy,
    core_entropy,
    deng_entropy,
    information_dimension,
    jirousek_shenoy_entropy,
    pignistic_entropy,
    within_set_entropy,
)
from evifuse.belief.files import from_csv, from_json, from_parquet, to_csv, to_json, to_parquet
from evifuse.belief.fractal import fractal_belief_entropy
from evifuse.belief.frame import MAX_HYPOTHESES, Frame, Subset
from evifuse.belief.intervals import INTERVAL_LIMIT, from_intervals
from evifuse.belief.logistic import from_logistic_regression, from_logits
from evifuse.belief.many import RULES, CombinationRule, combine
from evifuse.belief.mass import DENSE_LIMIT, TOLERANCE, Layout, MassFunction
from evifuse.belief.masses_from import (
    consonant_from_probabilities,
    from_counts,
    from_likelihoods,
    from_probabilities,
    from_samples,
)
from evifuse.belief.pcr6 import pcr6
from evifuse.belief.product import ProductFrame, marginalise, product_frame, vacuous_extension
from evifuse.belief.reliability import Distance, disagreement, reliability_from_disagreement
from evifuse.belief.remap import MultivaluedMapping, carry, coarsen, refine, refining
from evifuse.belief.representations import (
    contour,
    from_belief,
    from_commonality,
    from_implicability,
    from_plausibility,
    plausibility_transform,
    to_belief,
    to_commonality,
    to_implicability,
    to_plausibility,
)
from evifuse.belief.transform import belief, commonality, mass, pignistic, plausibility
from evifuse.belief.uncertainty import confusion, discord, dissonance, nonspecificity, strife
from evifuse.belief.weights import (
    from_conjunctive_weights,
    from_disjunctive_weights,
    to_conjunctive_weights,
    to_disjunctive_weights,
)

__all__ = [
    "DENSE_LIMIT",
    "DESIDERATA",
    "INTERVAL_LIMIT",
    "MAX_HYPOTHESES",
    "MEASURES",
    "REJECTED",
    "RULES",
    "TOLERANCE",
    "Combination",
    "CombinationRule",
    "Context",
    "Distance",
    "Expectation",
    "Frame",
    "Layout",
    "MassFunction",
    "Measure",
    "MultivaluedMapping",
    "ProductFrame",
    "Subset",
    "average",
    "belief",
    "belief_entropy",
    "bhattacharyya",
    "bold",
    "bound_dominance",
    "carry",
    "cautious",
    "coarsen",
    "combine",
    "commonality",
    "condition",
    "conflict",
    "confusion",
    "conjunctive",
    "consonant_from_probabilities",
    "contextual_discounting",
    "contextual_reinforcement",
    "contour",
    "core_entropy",
    "decide",
    "decombine",
    "dempster",
    "deng_entropy",
    "disagreement",
    "discord",
    "discount",
    "disjunctive",
    "dissonance",
    "dubois_prade",
    "expected_cost",
    "fit_reliabilities",
    "fractal_belief_entropy",
    "from_belief",
    "from_commonality",
    "from_conjunctive_weights",
    "from_counts",
    "from_csv",
    "from_disjunctive_weights",
    "from_implicability",
    "from_intervals",
    "from_json",
    "from_likelihoods",
    "from_logistic_regression",
    "from_logits",
    "from_parquet",
    "from_plausibility",
    "from_probabilities",
    "from_samples",
    "information_dimension",
    "interval_dominance",
    "jirousek_shenoy_entropy",
    "jousselme",
    "marginalise",
    "mass",
    "maximality",
    "maximum_belief",
    "maximum_pignistic",
    "maximum_plausibility",
    "murphy",
    "names_of",
    "nonspecificity",
    "on_frame",
    "pcr5",
    "pcr6",
    "pignistic",
    "pignistic_entropy",
    "plausibility",
    "plausibility_transform",
    "product_frame",
    "refine",
    "refining",
    "reliability_from_disagreement",
    "strife",
    "to_belief",
    "to_commonality",
    "to_conjunctive_weights",
    "to_csv",
    "to_disjunctive_weights",
    "to_implicability",
    "to_json",
    "to_parquet",
    "to_plausibility",
    "vacuous_extension",
    "within_set_entropy",
    "yager",
]


def __getattr__(name: str) -> Any:
    """Import the estimator when it is asked for: it needs scikit-learn, so it is not part of ``import *``."""
    if name == "EvidentialNeighbours":
        return import_module("evifuse.belief.neighbours").EvidentialNeighbours
    raise AttributeError(f"module 'evifuse.belief' has no attribute {name!r}")
