"""Evidential fusion of vision and touch: what a robot sees and feels, fused into one honest belief.

The way through: a picture and a rolled finger become belief functions (`sense_shapes`, `sense_curvature`), a
knowledge base conducts them (`classify`), and `fuse` adds the two and says what the surface is.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from evifuse._version import __version__

if TYPE_CHECKING:
    from evifuse.belief import Frame, MassFunction
    from evifuse.conductivity import KnowledgeBase, Reading, classify
    from evifuse.errors import EvifuseError
    from evifuse.fusion import Fusion, fuse
    from evifuse.knowledge import load_knowledge
    from evifuse.recordings import read_image, read_scene, read_touch, write_scene
    from evifuse.recordings.recording import Camera, Fingertip, Scene, TouchRecording
    from evifuse.simulation import simulate
    from evifuse.touch import FeltSurface, sense_curvature
    from evifuse.vision import SeenObject, sense_shapes

__all__ = [
    "Camera",
    "EvifuseError",
    "FeltSurface",
    "Fingertip",
    "Frame",
    "Fusion",
    "KnowledgeBase",
    "MassFunction",
    "Reading",
    "Scene",
    "SeenObject",
    "TouchRecording",
    "__version__",
    "classify",
    "fuse",
    "load_knowledge",
    "read_image",
    "read_scene",
    "read_touch",
    "sense_curvature",
    "sense_shapes",
    "simulate",
    "write_scene",
]

_HOME = {
    "Camera": "recordings.recording",
    "EvifuseError": "errors",
    "FeltSurface": "touch",
    "Fingertip": "recordings.recording",
    "Frame": "belief",
    "Fusion": "fusion",
    "KnowledgeBase": "conductivity",
    "MassFunction": "belief",
    "Reading": "conductivity",
    "Scene": "recordings.recording",
    "SeenObject": "vision",
    "TouchRecording": "recordings.recording",
    "classify": "conductivity",
    "fuse": "fusion",
    "load_knowledge": "knowledge",
    "read_image": "recordings",
    "read_scene": "recordings",
    "read_touch": "recordings",
    "sense_curvature": "touch",
    "sense_shapes": "vision",
    "simulate": "simulation",
    "write_scene": "recordings",
}


def __getattr__(name: str) -> Any:
    """Import what is asked for, when it is asked for: ``import evifuse`` alone costs next to nothing."""
    if name not in _HOME:
        raise AttributeError(f"module 'evifuse' has no attribute {name!r}")
    value = getattr(import_module(f"evifuse.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
