from dataclasses import replace

import numpy as np
import pytest

from evifuse.recordings.recording import Fingertip
from evifuse.recordings.rotation import rotate
from evifuse.simulation.defects import Defects, with_defects
from evifuse.touch import contact_track, find_sites
from evifuse.touch.online import CurvatureTracker
from evifuse.touch.site_shape import site_shape
from tests.touch.rolled import ball, cylinder, joined, plane, quadric, rolled

NOISE = {"pressure_noise_pa": 150.0, "position_noise_m": 5e-5, "angle_noise_rad": 5e-3, "smear_m": 4e-4}


def followed(recording):
    tracker = CurvatureTracker(recording.fingertip)
    rows = zip(
        recording.time_ns.tolist(), recording.position_m, recording.orientation_xyzw,
        recording.joint_angle_rad.tolist(), recording.pressure_pa, strict=True,
    )  # fmt: skip
    return tracker, [tracker.update(*row) for row in rows]


@pytest.mark.parametrize("noise", [{}, NOISE], ids=["clean", "noisy"])
@pytest.mark.parametrize(
    "surface", [cylinder(0.02, 0.3), ball(0.04), quadric(30.0, -30.0)], ids=lambda s: s.name
)
def test_it_ends_at_the_batch_estimate(surface, noise):
    recording = rolled(surface, turn_rad=0.25, depth_m=1.2e-4, samples=400, **noise)
    track = contact_track(recording)
    (site,) = find_sites(recording, track)
    batch = site_shape(recording, track, site)
    tracker, _ = followed(recording)
    (found,) = tracker.finish()
    off = found.shape.matrix - batch.matrix
    error = np.sqrt(np.diag(batch.covariance))
    assert (np.abs(off[[0, 0, 1], [0, 1, 1]]) < error).all()
    assert np.linalg.norm(found.centre_m - site.centre_m) < 3e-4


def test_the_estimate_is_there_before_the_lift_and_its_error_shrinks():
    _, tracked = followed(rolled(cylinder(0.02), (np.pi / 2, 0.0), turn_rad=0.3, depth_m=1.2e-4, samples=400))
    known = [t for t in tracked if t.curvature_per_m is not None]
    first = [t for t in known if t.shape is None]
    assert first[0].standard_error_per_m > first[-1].standard_error_per_m
    assert abs(first[-1].curvature_per_m + 50.0) < 2 * first[-1].standard_error_per_m
    assert first[-1].direction_rad == pytest.approx(np.pi / 2, abs=0.01)
    assert known[-1].shape.k2_per_m == pytest.approx(-50.0, abs=1.0)
    assert known[-1].shape.k1_per_m == pytest.approx(0.0, abs=1.0)


def test_a_place_apart_is_another_site_and_the_air_is_none():
    recording = joined(rolled(plane(), samples=300), rolled(plane(), samples=300, offset_m=(0.03, 0.0, 0.0)))
    tracker, tracked = followed(recording)
    assert [site.shape is not None for site in tracker.finish()] == [True, True]
    assert not tracked[0].touching
    assert {t.site for t in tracked if t.touching} == {None, 0, 1}


def test_noise_alone_is_no_contact_and_no_site():
    tip = rolled(plane(), (0.0,)).fingertip
    tracker = CurvatureTracker(tip)
    noise = np.random.default_rng(3).normal(0.0, 200.0, (600, len(tip.normals)))
    pose = [0.0, 0.0, 0.02], [0.0, 0.0, 0.0, 1.0], 0.0
    assert not any(tracker.update(1_000_000 * i, *pose, row).touching for i, row in enumerate(noise))
    assert tracker.finish() == ()


def test_one_direction_leaves_the_shape_open():
    tracker, _ = followed(rolled(cylinder(0.02), (np.pi / 2,), samples=400))
    (site,) = tracker.finish()
    assert site.shape is None


ROLLED = rolled(cylinder(0.02), (0.0, 0.8, 1.6, 2.4), turn_rad=0.25, depth_m=1.2e-4, samples=400)


def spoilt(kind):
    """The same rolls with taxels that never respond, are stuck, or read NaN always or at times."""
    if kind in ("dead", "stuck"):
        return with_defects(ROLLED, Defects(**{kind: 0.08}, seed=1))
    gone = np.random.default_rng(5).random(ROLLED.pressure_pa.shape) < 0.01
    if kind == "nan always":
        gone[:] = gone[0] | gone[1] | gone[2]
    return replace(ROLLED, pressure_pa=np.where(gone, np.nan, ROLLED.pressure_pa))


@pytest.mark.parametrize("kind", ["dead", "stuck", "nan always", "nan at times"])
def test_defective_taxels_are_found_on_the_way_and_filled_in(kind):
    tracker, _ = followed(spoilt(kind))
    sites = [site for site in tracker.finish() if site.shape is not None]  # one taxel alone has no shape
    found = min(sites, key=lambda site: site.shape.k2_error_per_m)
    assert len(sites) == 1 or kind == "stuck"  # what is stuck may have counted as touched before
    assert abs(found.shape.k1_per_m) < max(3 * found.shape.k1_error_per_m, 0.5)
    assert abs(found.shape.k2_per_m + 50) < max(3 * found.shape.k2_error_per_m, 1.0)
    assert found.shape.k2_error_per_m < 2.0


def test_taxels_known_to_be_useless_are_not_looked_at():
    broken = np.zeros(ROLLED.pressure_pa.shape[1], dtype=np.bool_)
    broken[::17] = True
    noise = np.random.default_rng(7).normal(0, 3e4, ROLLED.pressure_pa.shape) * broken
    wild = replace(ROLLED, pressure_pa=ROLLED.pressure_pa + noise)
    tracker = CurvatureTracker(wild.fingertip, usable=~broken)
    for i in range(len(wild.time_ns)):
        tracker.update(
            int(wild.time_ns[i]), wild.position_m[i], wild.orientation_xyzw[i], 0.0, wild.pressure_pa[i]
        )
    (found,) = tracker.finish()
    assert found.shape.k2_per_m == pytest.approx(-50, abs=3.0)


def test_a_sphere_whose_frame_is_elsewhere_is_felt_alike():
    tip, aside = ROLLED.fingertip, np.array([0.002, 0.0, -0.01])
    moved = replace(
        ROLLED,
        fingertip=Fingertip(tip.radius_m, tip.positions_m + aside, tip.normals),
        position_m=ROLLED.position_m - rotate(ROLLED.orientation_xyzw, aside[None]),
    )
    (one,), (other,) = followed(ROLLED)[0].finish(), followed(moved)[0].finish()
    assert np.allclose(one.shape.matrix, other.shape.matrix, atol=1.0)
    assert np.allclose(one.centre_m, other.centre_m, atol=1e-4)
