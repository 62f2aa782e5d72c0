"""The theory of evidence, useful on its own: frames, mass functions, and what is computed from them."""

from evifuse.belief.frame import MAX_HYPOTHESES, Frame, Subset
from evifuse.belief.mass import TOLERANCE, MassFunction

__all__ = ["MAX_HYPOTHESES", "TOLERANCE", "Frame", "MassFunction", "Subset"]
