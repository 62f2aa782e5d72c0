"""Shape primitives, one per file; a new one is a new file and one entry in `PRIMITIVES`."""

from collections.abc import Callable, Mapping
from typing import TypeAlias

from evifuse.belief import Frame
from evifuse.vision.primitives import bracket, circle, ellipse, rectangle, square, triangle
from evifuse.vision.primitives.agreement import Agreement
from evifuse.vision.primitives.bracket import bracket_belief
from evifuse.vision.primitives.circle import circle_belief
from evifuse.vision.primitives.ellipse import ellipse_belief
from evifuse.vision.primitives.fits import Fits
from evifuse.vision.primitives.hypothesis import Geometry, Hypothesis, Proposals
from evifuse.vision.primitives.outline import Outlines, outlines_of
from evifuse.vision.primitives.polygon import FittedPolygons, mean_of_sides, pattern_proposals
from evifuse.vision.primitives.rectangle import rectangle_belief
from evifuse.vision.primitives.square import square_belief
from evifuse.vision.primitives.triangle import triangle_belief

__all__ = [
    "PRIMITIVES",
    "SHAPE_FRAME",
    "Agreement",
    "Fits",
    "FittedPolygons",
    "Geometry",
    "Hypothesis",
    "Outlines",
    "Primitive",
    "Proposals",
    "bracket_belief",
    "circle_belief",
    "ellipse_belief",
    "mean_of_sides",
    "outlines_of",
    "pattern_proposals",
    "rectangle_belief",
    "square_belief",
    "triangle_belief",
]

Primitive: TypeAlias = Callable[[Fits], Proposals]
"""From what is seen to what one primitive proposes for each outline."""

PRIMITIVES: Mapping[str, Primitive] = {
    "rectangle": rectangle.propose,
    "square": square.propose,
    "triangle": triangle.propose,
    "ellipse": ellipse.propose,
    "circle": circle.propose,
    "bracket": bracket.propose,
}
"""What proposes each primitive, by the name of the hypothesis."""

SHAPE_FRAME = Frame(PRIMITIVES)
"""Frame of discernment of the shape primitives, F_p of section 3.3."""
