"""Both senses into one belief."""

from evifuse.fusion.curvature_from_shape import NO_CONTACT, SHAPE_CLASS, curvature_from_shape
from evifuse.fusion.fuse import (
    Fusion,
    fuse,
    fuse_percepts,
    fuse_scene,
    gather_scene,
    total_conductivity,
    touched_place,
)
from evifuse.fusion.touched import Box, Touched, find_touched, overlap, project

__all__ = [
    "NO_CONTACT",
    "SHAPE_CLASS",
    "Box",
    "Fusion",
    "Touched",
    "curvature_from_shape",
    "find_touched",
    "fuse",
    "fuse_percepts",
    "fuse_scene",
    "gather_scene",
    "overlap",
    "project",
    "total_conductivity",
    "touched_place",
]
