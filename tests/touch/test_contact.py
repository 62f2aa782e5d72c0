from dataclasses import replace

import numpy as np
import pytest

from evifuse.touch import contact_track
from evifuse.touch.contact import noise_pa
from tests.touch.rolled import ball, cylinder, plane, rolled


@pytest.mark.parametrize("surface", [plane(), ball(0.03), cylinder(0.02), ball(-0.04)], ids=lambda s: s.name)
def test_normals_and_points_are_the_surfaces(surface):
    recording = rolled(surface, turn_rad=0.25, depth_m=1e-4)
    track = contact_track(recording)
    inside = track.interior
    true = surface.normal(recording.position_m[inside])
    error = np.linalg.norm(np.cross(true, track.normal[inside]), axis=1)
    assert np.sqrt(np.mean(error**2)) < 0.003
    assert np.abs(surface.distance(track.point_m[inside])).max() < 1.3e-4


@pytest.mark.parametrize("noise", [0.0, 100.0, 300.0])
def test_contact_is_told_from_a_lift_whatever_the_noise(noise):
    clean = rolled(plane())
    felt = contact_track(rolled(plane(), pressure_noise_pa=noise, seed=3)).touching
    truth = (clean.pressure_pa > 0).any(axis=1)
    assert np.array_equal(felt, truth)


@pytest.mark.parametrize("cut", [True, False])
def test_noise_is_measured_with_and_without_a_cut_at_zero(cut):
    pressure = np.random.default_rng(5).normal(0.0, 120.0, (2000, 100))
    if cut:
        pressure = np.maximum(pressure, 0.0)
    assert noise_pa(pressure) == pytest.approx(120.0, rel=0.1)


def test_noise_alone_is_no_contact():
    recording = rolled(plane(), (0.0,))
    noise = np.random.default_rng(8).normal(0.0, 200.0, recording.pressure_pa.shape)
    assert not contact_track(replace(recording, pressure_pa=noise)).touching.any()


def test_a_contact_on_the_edge_of_the_array_is_not_used():
    recording = rolled(plane(), (0.0,), turn_rad=0.6)
    track = contact_track(recording)
    edge = np.abs(recording.joint_angle_rad) > 0.57  # the array ends at 0.61
    assert (track.touching & edge).any()
    assert not (track.interior & edge).any()


def test_pressure_all_around_is_a_squeeze_and_no_contact_with_one_surface():
    recording = rolled(plane(), (0.0,))
    tip = recording.fingertip
    everywhere = replace(
        tip,
        positions_m=np.concatenate([tip.positions_m, -tip.positions_m]),
        normals=np.concatenate([tip.normals, -tip.normals]),
    )
    squeezed = np.full((len(recording.time_ns), len(everywhere.normals)), 5000.0)
    assert not contact_track(replace(recording, fingertip=everywhere, pressure_pa=squeezed)).touching.any()
