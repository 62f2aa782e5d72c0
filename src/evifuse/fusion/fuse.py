"""Section 5.3: both senses into one belief, or one of them where the other is missing."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.belief import MassFunction, mass, pignistic
from evifuse.conductivity import KnowledgeBase, normalised_belief
from evifuse.errors import UsageError
from evifuse.fusion.curvature_from_shape import NO_CONTACT, curvature_from_shape
from evifuse.fusion.touched import Box, find_touched
from evifuse.knowledge import load_knowledge
from evifuse.recordings import as_image, read_scene, read_touch
from evifuse.recordings.raw import NOTHING_GIVEN, Given
from evifuse.recordings.recording import Camera, Scene, TouchRecording
from evifuse.touch import FeltSurface, sense_curvature
from evifuse.vision import SeenObject, sense_shapes

__all__ = ["Fusion", "fuse", "fuse_percepts", "fuse_scene", "gather_scene", "total_conductivity"]

Picture = str | Path | NDArray[Any] | Scene
Touch = str | Path | TouchRecording


@dataclass(frozen=True)
class Fusion:
    """What the surface is, from both senses.

    Parameters
    ----------
    shape : SeenObject or None
        The object that was touched, as seen; None without a picture or an object in it.
    touch : FeltSurface or None
        The surface as felt; None without a touch recording.
    objects : tuple of SeenObject
        Everything that was seen, most prominent first.
    from_shape : dict of str to float
        Conductivity of the shape features into each curvature class (section 5.2).
    from_touch : dict of str to float
        Conductivity of the curvature primitives into each curvature class (section 4.3).
    total : dict of str to float
        Their sum (section 5.3).
    belief : MassFunction
        The total, normalised, over the curvature classes.
    warnings : tuple of str
        What was assumed or missing, a line each.
    """

    shape: SeenObject | None
    touch: FeltSurface | None
    objects: tuple[SeenObject, ...]
    from_shape: dict[str, float]
    from_touch: dict[str, float]
    total: dict[str, float]
    belief: MassFunction
    warnings: tuple[str, ...]

    @property
    def decision(self) -> str | None:
        """Class with the highest total conductivity; None if nothing conducts."""
        best = max(self.total, key=lambda label: self.total[label])
        return best if self.total[best] > 0 else None

    @property
    def pignistic(self) -> dict[str, float]:
        """Probability of each class for a bet (pignistic transform of the belief)."""
        return dict(zip(self.belief.frame.hypotheses, pignistic(self.belief).tolist(), strict=True))

    def to_json(self) -> dict[str, Any]:
        """Everything as plain values.

        Returns
        -------
        dict
            ``shape``, ``touch``, ``from_shape``, ``from_touch``, ``total``, ``belief``, ``decision``,
            ``pignistic`` and ``warnings``.
        """
        return {
            "shape": None if self.shape is None else self.shape.to_json(),
            "touch": None if self.touch is None else self.touch.to_json(),
            "from_shape": self.from_shape,
            "from_touch": self.from_touch,
            "total": self.total,
            "belief": _with_zeros(self.belief),
            "decision": self.decision,
            "pignistic": self.pignistic,
            "warnings": list(self.warnings),
        }


def _with_zeros(m: MassFunction) -> dict[str, float]:
    return {m.frame.label(int(s)): float(b) for s, b in zip(m.focal_sets, m.masses, strict=True)}


def total_conductivity(*sources: Mapping[str, float]) -> dict[str, float]:
    """Sum of conductivities over the senses (section 5.3): conductivity is a measure, so it is additive.

    Parameters
    ----------
    *sources : mapping of str to float
        Conductivity by class, of each sense.

    Returns
    -------
    dict of str to float
        Total by class.

    Examples
    --------
    >>> total_conductivity({"quasiplanar": 1.25}, {"quasiplanar": 0.5, "curved": 0.25})
    {'quasiplanar': 1.75, 'curved': 0.25}
    """
    labels = dict.fromkeys(label for source in sources for label in source)
    return {label: float(sum(source.get(label, 0.0) for source in sources)) for label in labels}


def fuse_percepts(
    shape: SeenObject | None,
    touch: FeltSurface | None,
    knowledge: KnowledgeBase | None = None,
    *,
    objects: tuple[SeenObject, ...] = (),
    warnings: tuple[str, ...] = (),
) -> Fusion:
    """Fuse what was seen with what was felt; either may be missing.

    Parameters
    ----------
    shape : SeenObject or None
        The object that was touched, as seen.
    touch : FeltSurface or None
        The surface as felt.
    knowledge : KnowledgeBase, optional
        Classes of curvature features; the built-in ``curvature`` by default.
    objects : tuple of SeenObject
        Everything that was seen, kept for the report.
    warnings : tuple of str
        What was assumed on the way here.

    Returns
    -------
    Fusion
        Sum of conductivities, normalised belief, decision. If the knowledge base's reading keeps ignorance,
        the frame keeps the share that neither sense committed: the product of their ignorances (our own).
    """
    knowledge = knowledge or load_knowledge("curvature")
    empty = dict.fromkeys(knowledge.classes, 0.0)
    from_shape, from_touch, ignorance = empty, empty, 1.0
    if touch is not None:
        from_touch = touch.classification.conductivity
        ignorance *= float(mass(touch.evidence, touch.evidence.frame))
    if shape is not None:
        no_contact = 0.0 if touch is None else float(mass(touch.evidence, NO_CONTACT))
        from_shape = curvature_from_shape(shape.classification.conductivity, knowledge, no_contact)
        ignorance *= float(mass(shape.evidence, shape.evidence.frame))
    total = total_conductivity(from_touch, from_shape)
    kept = ignorance if knowledge.reading.keep_ignorance else 0.0
    belief = normalised_belief(
        knowledge.classes, np.array([total[c] for c in knowledge.classes]), np.array(kept)
    )
    said = warnings + (touch.warnings if touch is not None else ())
    return Fusion(shape, touch, objects, from_shape, from_touch, total, belief, said)


def fuse_scene(
    scene: Scene,
    *,
    box: Box | None = None,
    shape_knowledge: KnowledgeBase | None = None,
    curvature_knowledge: KnowledgeBase | None = None,
) -> Fusion:
    """Fuse the picture and the rolled finger of a scene.

    Parameters
    ----------
    scene : Scene
        Picture, camera and touch; any may be missing, but not both senses.
    box : tuple of float, optional
        Pixel box ``(x, y, w, h)`` of the object that was touched. Without it the contact is projected into
        the picture, if the camera's pose is known; else the most believed object is taken, with a warning.
    shape_knowledge : KnowledgeBase, optional
        Classes of shape features; the built-in ``shape`` by default.
    curvature_knowledge : KnowledgeBase, optional
        Classes of curvature features; the built-in ``curvature`` by default.

    Returns
    -------
    Fusion
        The fused belief and everything that led to it.

    Raises
    ------
    UsageError
        If the scene has neither a picture nor a touch.
    """
    if scene.image is None and scene.touch is None:
        raise UsageError(f"{scene.name}: neither a picture nor a touch recording: there is nothing to fuse")
    warnings = list(scene.notes)
    touch = None
    if scene.touch is None:
        warnings.append(f"{scene.name}: no touch recording: the shape alone speaks")
    else:
        touch = sense_curvature(scene.touch, curvature_knowledge)
    objects: tuple[SeenObject, ...] = ()
    shape = None
    if scene.image is None:
        warnings.append(f"{scene.name}: no picture: touch alone speaks")
    else:
        objects = sense_shapes(scene.image, shape_knowledge)
        place = None if touch is None else touched_place(touch)
        chosen = find_touched([o.box for o in objects], box=box, camera=scene.camera, contact_m=place)
        if chosen.warning:
            warnings.append(f"{scene.name}: {chosen.warning}")
        if not objects:
            warnings.append(f"{scene.name}: no object was found in the picture")
        shape = None if chosen.index is None else objects[chosen.index]
    return fuse_percepts(shape, touch, curvature_knowledge, objects=objects, warnings=tuple(warnings))


def touched_place(touch: FeltSurface) -> NDArray[np.float64] | None:
    """Where the finger met the surface, or failed to meet one: the mean of its sites.

    Parameters
    ----------
    touch : FeltSurface
        The surface as felt.

    Returns
    -------
    ndarray of float64, shape (3,), or None
        World frame, metres. Sites without contact come first: the hole is what was explored there.
    """
    for contact in (False, True):
        places = [site.position_m for site in touch.sites if site.contact is contact]
        if places:
            return np.mean(places, axis=0)
    return None


def fuse(
    image: Picture | None = None,
    recording: Touch | None = None,
    *,
    box: Box | None = None,
    camera: Camera | None = None,
    shape_knowledge: KnowledgeBase | None = None,
    curvature_knowledge: KnowledgeBase | None = None,
) -> Fusion:
    """Say what a surface is from a picture and a rolled finger.

    Parameters
    ----------
    image : str, Path, ndarray or Scene, optional
        A picture (file or array of any usual kind), or a scene: an MCAP file or a `Scene` with both senses.
    recording : str, Path or TouchRecording, optional
        A rolled finger (MCAP, CSV, NPZ, or in memory). It takes the place of the one in ``image``.
    box : tuple of float, optional
        Pixel box ``(x, y, w, h)`` of the object that was touched.
    camera : Camera, optional
        Where the picture was taken from; replaces the one in the files.
    shape_knowledge : KnowledgeBase, optional
        Classes of shape features; the built-in ``shape`` by default.
    curvature_knowledge : KnowledgeBase, optional
        Classes of curvature features; the built-in ``curvature`` by default.

    Returns
    -------
    Fusion
        ``decision``, ``belief``, ``total`` and the trace of both senses.

    Raises
    ------
    UsageError
        If there is neither a picture nor a recording.
    ImageError, RecordingError
        If a file can't be used.
    """
    scene = gather_scene(image, recording)
    if camera is not None:
        scene = replace(scene, camera=camera)
    return fuse_scene(
        scene, box=box, shape_knowledge=shape_knowledge, curvature_knowledge=curvature_knowledge
    )


def gather_scene(
    image: Picture | None = None, recording: Touch | None = None, given: Given = NOTHING_GIVEN
) -> Scene:
    """The values behind files and arrays, as one scene; the camera may come with either file.

    Of a file that was cut off or damaged what is whole is taken, and a note says so.

    Parameters
    ----------
    image : str, Path, ndarray or Scene, optional
        A picture or a scene.
    recording : str, Path or TouchRecording, optional
        A rolled finger, in place of the one in ``image``.
    given : Given
        What the recording leaves open.

    Returns
    -------
    Scene
        Picture, camera and touch, as far as they are there.

    Raises
    ------
    UsageError
        If there is neither.
    ImageError, RecordingError
        If a file can't be used.
    """
    if image is None and recording is None:
        raise UsageError("nothing to fuse: give a picture, a touch recording, or a scene that holds both")
    if image is None:
        seen = Scene(None, None, None, "")
    elif isinstance(image, Scene):
        seen = image
    elif isinstance(image, str | Path):
        seen = read_scene(image, partial=True, given=given)
    else:
        seen = Scene(as_image(image), None, None, "image")
    if recording is None:
        return seen
    if isinstance(recording, TouchRecording):
        felt = Scene(None, None, recording, recording.name)
    else:
        touch = read_touch(
            recording, partial=True, fingertip=given.fingertip, topics=given.topics, unit=given.unit
        )
        whole = None
        if seen.camera is None and image is not None:
            whole = read_scene(recording, partial=True, given=given)
        felt = Scene(None, whole.camera if whole is not None else None, touch, str(recording))
    return Scene(seen.image, seen.camera or felt.camera, felt.touch, seen.name or felt.name, seen.notes)
