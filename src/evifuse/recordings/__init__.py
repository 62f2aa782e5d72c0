"""Recordings in and out: scenes and touch recordings as values, and the files they come from."""

from evifuse.recordings.files import read_scene, read_touch, write_scene, write_touch
from evifuse.recordings.images import as_image, read_image
from evifuse.recordings.recording import Camera, Fingertip, Scene, TouchRecording

__all__ = [
    "Camera",
    "Fingertip",
    "Scene",
    "TouchRecording",
    "as_image",
    "read_image",
    "read_scene",
    "read_touch",
    "write_scene",
    "write_touch",
]
