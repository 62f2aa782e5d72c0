"""MuJoCo worlds that write recordings: a fingertip rolls over a known surface, a camera looks at it."""

from evifuse.simulation.procedure import Procedure
from evifuse.simulation.simulate import Noise, SimulatedScene, SiteTruth, Truth, simulate
from evifuse.simulation.surfaces import SURFACES

__all__ = ["SURFACES", "Noise", "Procedure", "SimulatedScene", "SiteTruth", "Truth", "simulate"]
