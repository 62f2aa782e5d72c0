"""The logical shape sensor (section 3): from edges to the belief in shape primitives."""

from evifuse.vision.detect import Detector, EdgeDrawing
from evifuse.vision.evidence import shape_evidence
from evifuse.vision.fit import FittedEdge, edge_belief, fit_edge
from evifuse.vision.link import LinkList
from evifuse.vision.primitives import (
    PRIMITIVES,
    SHAPE_FRAME,
    Hypothesis,
    bracket_belief,
    circle_belief,
    ellipse_belief,
    rectangle_belief,
    square_belief,
    triangle_belief,
)
from evifuse.vision.sensor import SeenObject, sense_shapes
from evifuse.vision.view import View

__all__ = [
    "PRIMITIVES",
    "SHAPE_FRAME",
    "Detector",
    "EdgeDrawing",
    "FittedEdge",
    "Hypothesis",
    "LinkList",
    "SeenObject",
    "View",
    "bracket_belief",
    "circle_belief",
    "edge_belief",
    "ellipse_belief",
    "fit_edge",
    "rectangle_belief",
    "sense_shapes",
    "shape_evidence",
    "square_belief",
    "triangle_belief",
]
