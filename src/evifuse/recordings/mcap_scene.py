"""From the messages of a recording to a scene."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import InputError, RecordingError
from evifuse.recordings import messages
from evifuse.recordings.door import touch_of
from evifuse.recordings.mcap_reader import RawRecording, Topic
from evifuse.recordings.mcap_touch import raw_touch
from evifuse.recordings.pictures import picture
from evifuse.recordings.raw import NOTHING_GIVEN, Given, RawTouch, completed
from evifuse.recordings.recording import Camera, Scene
from evifuse.recordings.topics import holds_touch

__all__ = ["RawScene", "raw_scene", "scene_of"]


@dataclass(frozen=True)
class RawScene:
    """What a recording holds, before anything of it is refused.

    Parameters
    ----------
    name : str
        Name of the file.
    touch : RawTouch or None
        None if nothing of a touch was recorded.
    image : ndarray of uint8, shape (H, W) or (H, W, 3), or None
        Picture without lens distortion.
    camera : Camera or None
        Where it was taken from.
    trouble : str
        Why the picture or its camera can't be used; empty if nothing is wrong.
    damage : str
        Why the rest of the file can't be read; empty if it is whole.
    held : str
        What the file holds, for messages.
    """

    name: str
    touch: RawTouch | None
    image: NDArray[np.uint8] | None = None
    camera: Camera | None = None
    trouble: str = ""
    damage: str = ""
    held: str = ""


def raw_scene(
    raw: RawRecording, name: str, *, pictures: bool = True, given: Given = NOTHING_GIVEN
) -> RawScene:
    """Sort the messages of a recording into picture, camera and touch.

    The first image is taken, with the camera pose nearest to it in time.

    Parameters
    ----------
    raw : RawRecording
        Messages by topic. Topics and types are listed in `evifuse.recordings.messages`.
    name : str
        Name of the file, for messages.
    pictures : bool
        Whether to look at the picture at all.
    given : Given
        What the file leaves open about its touch.

    Returns
    -------
    RawScene
        What was found.
    """
    count = sum(len(topic.data) for topic in raw.topics.values())
    damage = f"{raw.damage} after {count} messages" if raw.damage else ""
    held = "topics in the file: " + (", ".join(sorted(raw.topics)) or "none")
    image, camera, trouble = None, None, ""
    if pictures:
        try:
            image, camera = picture(_seen(raw.topics, name), name)
        except InputError as error:
            trouble = str(error)
    touch = None
    if holds_touch(raw.topics, given.topics):
        touch = completed(raw_touch(raw.topics, name, damage, given.topics), given)
    return RawScene(name, touch, image, camera, trouble, damage, held)


def scene_of(raw: RawScene, where: str, *, partial: bool = False) -> Scene:
    """Check what a recording holds.

    Parameters
    ----------
    raw : RawScene
        As it was read.
    where : str
        Path of the file, for messages.
    partial : bool
        Accept what is whole of a file that was cut off or damaged.

    Returns
    -------
    Scene
        Image, camera and touch; None for what is not there.

    Raises
    ------
    RecordingError
        If the file is damaged and ``partial`` is off, holds neither an image nor taxels, or something in it
        is wrong.
    """
    if raw.damage and not partial:
        raise RecordingError(f"{where}: {raw.damage}: copy it again, or accept what is whole (partial=True)")
    if raw.trouble:
        raise RecordingError(raw.trouble)
    if raw.image is None and raw.touch is None:
        raise RecordingError(f"{where}: no messages on {messages.IMAGE} or {messages.TAXELS}; {raw.held}")
    touch = None if raw.touch is None else touch_of(raw.touch)
    cut = f"{raw.name}: {raw.damage}; what comes before is read"
    notes = (cut,) if raw.damage and touch is None else ()  # a touch says so itself
    return Scene(raw.image, raw.camera, touch, raw.name, notes)


def _seen(topics: dict[str, Topic], name: str) -> dict[str, Topic]:
    """Topics of the picture and the camera, of the types that are expected."""
    found = {
        key: topics[key]
        for key in (messages.IMAGE, messages.CAMERA_INFO, messages.CAMERA_POSE)
        if key in topics
    }
    for topic in found.values():
        expected = messages.TOPIC_TYPES[topic.name]
        if topic.kind != expected:
            raise RecordingError(
                f"{name}: topic {topic.name} has type {topic.kind!r}, but {expected} is expected"
            )
    return found
