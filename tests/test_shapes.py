"""Shapes of what goes between the rooms: the same letter is the same number everywhere in a value."""

from collections.abc import Callable

import numpy as np
import pytest
from beartype import beartype
from jaxtyping import Float64, Int8, Int64, UInt8, jaxtyped

from evifuse.belief import MassFunction
from evifuse.conductivity import Classification, classify
from evifuse.knowledge import load_knowledge
from evifuse.recordings.recording import Camera, TouchRecording
from evifuse.simulation import SimulatedScene
from evifuse.touch import CURVATURE_FRAME, contact_track

Array = np.ndarray


@jaxtyped(typechecker=beartype)
def samples(
    time_ns: Int64[Array, " T"],
    position_m: Float64[Array, "T 3"],
    orientation_xyzw: Float64[Array, "T 4"],
    joint_angle_rad: Float64[Array, " T"],
    pressure_pa: Float64[Array, "T N"],
    positions_m: Float64[Array, "N 3"],
    normals: Float64[Array, "N 3"],
) -> None: ...


@jaxtyped(typechecker=beartype)
def view(
    image: UInt8[Array, "H W"] | UInt8[Array, "H W 3"],
    matrix: Float64[Array, "3 3"],
    position_m: Float64[Array, "3"],
    orientation_xyzw: Float64[Array, "4"],
) -> None: ...


@jaxtyped(typechecker=beartype)
def classification(
    evidence: Float64[Array, "*batch F"],
    conductivities: Float64[Array, "*batch C"],
    belief: Float64[Array, "*batch G"],
    interaction_dimensions: Float64[Array, "*batch P"],
    projected_dimensions: Float64[Array, "*batch P"],
    prototype_conductivities: Float64[Array, "*batch P"],
    branches: Int8[Array, "*batch P"],
) -> None: ...


def check_touch(touch: TouchRecording) -> None:
    samples(
        touch.time_ns,
        touch.position_m,
        touch.orientation_xyzw,
        touch.joint_angle_rad,
        touch.pressure_pa,
        touch.fingertip.positions_m,
        touch.fingertip.normals,
    )


def check_classification(evidence: MassFunction, found: Classification) -> None:
    classification(
        evidence.masses,
        found.conductivities,
        found.belief.masses,
        found.interaction_dimensions,
        found.projected_dimensions,
        found.prototype_conductivities,
        found.branches,
    )


def test_a_recording_and_its_picture(scene_of: Callable[[str], SimulatedScene]) -> None:
    scene = scene_of("sphere").scene
    assert scene.touch is not None
    check_touch(scene.touch)
    assert isinstance(scene.camera, Camera)
    assert scene.image is not None
    view(scene.image, scene.camera.matrix, scene.camera.position_m, scene.camera.orientation_xyzw)
    track = contact_track(scene.touch)
    assert len(track.normal) == len(scene.touch.time_ns)


@pytest.mark.parametrize("batch", [(), (3,), (2, 4)])
def test_a_classification(batch: tuple[int, ...]) -> None:
    evidence = MassFunction.vacuous(CURVATURE_FRAME, batch)
    check_classification(evidence, classify(evidence, load_knowledge("chapter-curvature")))


def test_the_check_itself_finds_a_wrong_shape(scene_of: Callable[[str], SimulatedScene]) -> None:
    touch = scene_of("sphere").scene.touch
    assert touch is not None
    wrong = TouchRecording(
        touch.fingertip,
        touch.time_ns[1:],
        touch.position_m,
        touch.orientation_xyzw,
        touch.joint_angle_rad,
        touch.pressure_pa,
    )
    with pytest.raises(Exception, match="position_m"):
        check_touch(wrong)
