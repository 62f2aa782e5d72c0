"""The theory of evidence, useful on its own: frames, mass functions, and what is computed from them."""

from evifuse.belief.combine import Combination, conjunctive, dempster, discount, on_frame
from evifuse.belief.frame import MAX_HYPOTHESES, Frame, Subset
from evifuse.belief.mass import TOLERANCE, MassFunction
from evifuse.belief.transform import belief, commonality, mass, pignistic, plausibility

__all__ = [
    "MAX_HYPOTHESES",
    "TOLERANCE",
    "Combination",
    "Frame",
    "MassFunction",
    "Subset",
    "belief",
    "commonality",
    "conjunctive",
    "dempster",
    "discount",
    "mass",
    "on_frame",
    "pignistic",
    "plausibility",
]
