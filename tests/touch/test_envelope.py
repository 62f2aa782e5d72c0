"""A finger of any form: where it touches follows from its pose and form, and few taxels are enough."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evifuse.recordings.recording import Fingertip
from evifuse.recordings.rotation import rotate
from evifuse.simulation import simulate
from evifuse.touch import load_fingertip, sense_curvature, surface_of
from evifuse.touch.blended import layout_normals
from evifuse.touch.envelope import closest_contacts
from evifuse.touch.hull import HullSurface, rolling_surface

SEMI_AXES_M = np.array([0.009, 0.014, 0.010])


def oval(pitch_m: float) -> Fingertip:
    """Taxels on the lower side of an ellipsoid, a sunflower's spiral that is stretched."""
    count = round(2 * np.pi * 0.4 * (0.011 / pitch_m) ** 2)
    index = np.arange(count) + 0.5
    axial = 1 - 0.4 * index / count
    azimuth, across = np.pi * (3 - np.sqrt(5)) * index, np.sqrt(1 - axial**2)
    unit = np.stack([across * np.cos(azimuth), across * np.sin(azimuth), -axial], axis=1)
    normals = unit / SEMI_AXES_M
    return Fingertip(0.0105, unit * SEMI_AXES_M, normals / np.linalg.norm(normals, axis=1, keepdims=True))


@settings(max_examples=25, deadline=None)
@given(st.floats(-60, 60), st.floats(-0.2, 0.2), st.floats(-0.002, 0.002))
def test_the_closest_contact_faces_the_surface(k, tilt, aside):
    """On a ball or in a bowl the finger's normal there is along the line to the ball's centre."""
    tip = oval(0.0015)
    theta = np.zeros(16)
    theta[3] = theta[5] = k
    turn = np.array([[np.sin(tilt / 2), 0.0, 0.0, np.cos(tilt / 2)]])
    pose = np.array([[aside, -aside, 0.0105]]), turn
    start, frame = tip.positions_m[:1] + 1e-3, (np.zeros(3), np.eye(3))
    found = closest_contacts(surface_of(tip), tip.radius_m, theta, pose, start, frame, steps=8)
    nearest, facing = surface_of(tip).project(found)
    point, outward = rotate(turn, nearest)[0] + pose[0][0], rotate(turn, facing)[0]
    gradient = np.array(
        [k * point[0], k * point[1], k * point[2] - 1.0]
    )  # away from a ball's centre, at 1 / k
    assert np.abs(outward - gradient / np.linalg.norm(gradient)).max() < 1e-3


@pytest.mark.parametrize(
    ("name", "size"), [("sphere", {"radius_m": 0.02}), ("cylinder", {"radius_m": 0.012})]
)
@pytest.mark.parametrize("pitch_m", [0.0012, 0.003])
def test_few_taxels_on_a_finger_that_is_no_sphere_feel_curvature(name, size, pitch_m):
    """With 3 mm between taxels one of them alone feels a contact at a time."""
    from evifuse.simulation import Noise, simulate

    noise = Noise(pressure_pa=200.0, position_m=2e-5, angle_rad=2e-3)
    made = simulate(name, fingertip=oval(pitch_m), noise=noise, seed=7, picture=False, **size)
    felt = sense_curvature(made.scene.touch)
    true = made.truth.sites[0]
    shape = min(felt.sites, key=lambda s: float(np.linalg.norm(s.position_m - true.position_m))).shape
    assert shape is not None
    for k, t, e in (
        (shape.k1_per_m, true.k1_per_m, shape.k1_error_per_m),
        (shape.k2_per_m, true.k2_per_m, shape.k2_error_per_m),
    ):
        assert abs(k - t) < 0.08 * abs(true.k2_per_m)
        assert abs(k - t) < 3.5 * e


def test_the_normals_of_the_finger_may_be_estimated():
    """The same finger from places alone."""
    tip = oval(0.0015)
    assert np.median(np.arccos(np.clip((layout_normals(tip.positions_m) * tip.normals).sum(1), -1, 1))) < 0.01


def test_a_flat_pad_is_felt_as_the_body_around_its_taxels() -> None:
    """It stands on a few taxels: a surface through all of them would be wrong."""
    tip = load_fingertip("paxini:DP-S3013-Core")
    assert isinstance(rolling_surface(tip), HullSurface)
    scene = simulate("sphere", radius_m=0.04, fingertip=tip, picture=False, rate_hz=200, seed=3)
    for site in sense_curvature(scene.scene.touch).sites:
        assert site.k1_per_m == pytest.approx(-25, abs=8)
        assert site.k2_per_m == pytest.approx(-25, abs=8)
