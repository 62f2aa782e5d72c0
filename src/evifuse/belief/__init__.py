"""The theory of evidence, useful on its own: frames, mass functions, and what is computed from them."""

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
from evifuse.belief.discount import discount
from evifuse.belief.frame import MAX_HYPOTHESES, Frame, Subset
from evifuse.belief.mass import DENSE_LIMIT, TOLERANCE, Layout, MassFunction
from evifuse.belief.transform import belief, commonality, mass, pignistic, plausibility

__all__ = [
    "DENSE_LIMIT",
    "MAX_HYPOTHESES",
    "TOLERANCE",
    "Combination",
    "Frame",
    "Layout",
    "MassFunction",
    "Subset",
    "belief",
    "commonality",
    "conjunctive",
    "dempster",
    "discount",
    "disjunctive",
    "dubois_prade",
    "mass",
    "on_frame",
    "pcr5",
    "pignistic",
    "plausibility",
    "yager",
]
