"""MuJoCo worlds that write recordings: a fingertip rolls over a known surface, a camera looks at it."""

from evifuse.simulation.cases import CASE_PRIMITIVES, Case, random_case
from evifuse.simulation.dataset import random_scenes, simulated_case, truth_row, write_dataset
from evifuse.simulation.defects import Defects, with_defects
from evifuse.simulation.fingertip import Skin, grid_fingertip
from evifuse.simulation.mesh import MeshSurface, load_mesh
from evifuse.simulation.noise import NOISES, Noise
from evifuse.simulation.procedure import Procedure
from evifuse.simulation.simulate import SimulatedScene, simulate
from evifuse.simulation.sites import auto_sites
from evifuse.simulation.surface import Surface
from evifuse.simulation.surfaces import SURFACES, surface
from evifuse.simulation.truth import SiteTruth, Truth, primitive_of

__all__ = [
    "CASE_PRIMITIVES",
    "NOISES",
    "SURFACES",
    "Case",
    "Defects",
    "MeshSurface",
    "Noise",
    "Procedure",
    "SimulatedScene",
    "SiteTruth",
    "Skin",
    "Surface",
    "Truth",
    "auto_sites",
    "grid_fingertip",
    "load_mesh",
    "primitive_of",
    "random_case",
    "random_scenes",
    "simulate",
    "simulated_case",
    "surface",
    "truth_row",
    "with_defects",
    "write_dataset",
]
