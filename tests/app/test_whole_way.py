"""From MuJoCo's physics to curvature and decision: what was simulated is what is felt."""

from collections.abc import Callable

import numpy as np
import pytest

from evifuse import fuse, sense_curvature, simulate
from evifuse.recordings.recording import Scene, TouchRecording
from evifuse.simulation import SimulatedScene


def felt_within(made: SimulatedScene, share: float) -> None:
    assert made.scene.touch is not None
    felt = sense_curvature(made.scene.touch)
    contacts = [site for site in felt.sites if site.contact]
    assert contacts
    for site in contacts:
        near = min(made.truth.sites, key=lambda t: float(np.linalg.norm(t.position_m - site.position_m)))
        assert near.k1_per_m is not None
        assert near.k2_per_m is not None
        largest = max(abs(near.k1_per_m), abs(near.k2_per_m))
        assert site.k1_per_m == pytest.approx(near.k1_per_m, abs=share * largest)
        assert site.k2_per_m == pytest.approx(near.k2_per_m, abs=share * largest)


@pytest.mark.parametrize("surface", ["cylinder", "sphere", "saddle", "bowl", "trough"])
def test_curvature_is_within_two_percent_of_the_truth(
    scene_of: Callable[[str], SimulatedScene], surface: str
) -> None:
    felt_within(scene_of(surface), 0.02)


@pytest.mark.parametrize("surface", ["cylinder", "sphere", "saddle"])
@pytest.mark.parametrize("radius_m", [0.02, 0.06])
def test_at_other_radii_too(surface: str, radius_m: float) -> None:
    felt_within(simulate(surface, radius_m=radius_m, picture=False, rate_hz=500), 0.02)


def test_a_recording_without_any_contact_is_evidence(scene_of: Callable[[str], SimulatedScene]) -> None:
    touch = scene_of("plane").scene.touch
    assert touch is not None
    silent = TouchRecording(
        touch.fingertip,
        touch.time_ns,
        touch.position_m,
        touch.orientation_xyzw,
        touch.joint_angle_rad,
        np.zeros_like(touch.pressure_pa),
    )
    found = fuse(recording=silent)
    assert found.decision == "occluded"
    assert found.touch is not None
    assert found.touch.evidence.as_dict()["N"] > 0.5
    assert found.to_json()["touch"]["sites"][0]["k1_per_m"] is None


def test_touch_corrects_what_the_outline_suggests(scene_of: Callable[[str], SimulatedScene]) -> None:
    scene = scene_of("cylinder").scene
    both = fuse(scene)
    seen = fuse(Scene(scene.image, scene.camera, None))
    assert seen.total["quasiplanar"] == pytest.approx(seen.total["curved"])
    assert both.decision == "curved"
    assert both.pignistic["curved"] > seen.pignistic["curved"]
