import json
from dataclasses import replace

import numpy as np
import pytest

from evifuse.errors import UsageError
from evifuse.simulation import simulate
from evifuse.simulation.simulate import Noise
from evifuse.touch import sense_curvature
from tests.touch.rolled import ball, cylinder, joined, plane, quadric, rolled

EXPECTED = {
    "plane": ("P", "quasiplanar"),
    "cylinder": ("C-", "curved"),
    "trough": ("C+", "curved"),
    "sphere": ("E-", "curved"),
    "bowl": ("E+", "curved"),
    "saddle": ("H", "curved"),
}


@pytest.fixture(scope="module", params=EXPECTED)
def simulated(request):
    scene = simulate(request.param, picture=False, rate_hz=250)
    return request.param, scene.truth, sense_curvature(scene.scene.touch)


def test_simulated_surfaces_are_known_by_touch(simulated):
    name, _, felt = simulated
    primitive, decision = EXPECTED[name]
    masses = felt.evidence.as_dict()
    assert masses[primitive] > 0.6
    assert masses[primitive] + masses["frame"] > 0.999
    assert felt.classification.decision == decision
    assert felt.warnings == ()


def test_simulated_curvatures_are_within_two_percent(simulated):
    _, truth, felt = simulated
    assert len(felt.sites) == len(truth.sites)
    for site, true in zip(felt.sites, truth.sites, strict=True):
        assert np.linalg.norm(site.position_m - true.position_m) < 5e-4
        scale = max(abs(true.k1_per_m), abs(true.k2_per_m), 25.0)
        assert site.k1_per_m == pytest.approx(true.k1_per_m, abs=0.02 * scale)
        assert site.k2_per_m == pytest.approx(true.k2_per_m, abs=0.02 * scale)


def test_a_hole_is_a_site_without_contact():
    scene = simulate("hole", picture=False, rate_hz=250)
    felt = sense_curvature(scene.scene.touch)
    assert [site.contact for site in felt.sites] == [True, False]
    assert np.linalg.norm(felt.sites[1].position_m - scene.truth.sites[1].position_m) < 1e-3
    masses = felt.evidence.as_dict()
    assert masses["N"] == pytest.approx(0.5, abs=0.05)
    assert masses["P"] > 0.35
    assert felt.classification.decision == "occluded"


def test_noise_leaves_the_primitive_and_widens_the_errors():
    noise = Noise(pressure_pa=500.0, position_m=5e-5, angle_rad=3e-3)
    noisy = sense_curvature(simulate("cylinder", picture=False, rate_hz=250, noise=noise).scene.touch)
    assert noisy.evidence.as_dict()["C-"] > 0.6
    for site in noisy.sites:
        assert site.k2_per_m == pytest.approx(-1 / 0.03, rel=0.04)


def test_nothing_touched_at_all_is_evidence_of_no_contact():
    recording = rolled(plane())
    empty = replace(recording, pressure_pa=np.zeros_like(recording.pressure_pa))
    felt = sense_curvature(empty)
    assert felt.evidence.as_dict() == pytest.approx({"N": 0.8, "frame": 0.2})
    assert [site.contact for site in felt.sites] == [False]
    assert felt.classification.decision == "occluded"
    assert "met nothing" in felt.warnings[0]


@pytest.mark.parametrize("depth_m", [0.001, 0.004, 0.012])
def test_only_a_clear_miss_is_a_missed_site(depth_m):
    touched, aside = rolled(plane()), rolled(plane(), (0.0,), offset_m=(0.03, 0.0, -depth_m))
    felt = sense_curvature(joined(touched, replace(aside, pressure_pa=np.zeros_like(aside.pressure_pa))))
    assert len([site for site in felt.sites if not site.contact]) == (1 if depth_m > 0.002 else 0)


def test_lifts_and_the_fall_of_a_dome_are_no_missed_sites():
    beside = rolled(ball(0.02), (0.0,), offset_m=(0.025, 0.0, -0.006))
    away = replace(beside, pressure_pa=np.zeros_like(beside.pressure_pa))
    felt = sense_curvature(joined(rolled(ball(0.02)), away))
    assert [site.contact for site in felt.sites] == [True]


def test_a_contact_that_never_moves_is_ignorance():
    recording = rolled(plane(), (0.0,))
    held = np.full(len(recording.time_ns), 250)
    felt = sense_curvature(
        replace(
            recording,
            position_m=recording.position_m[held],
            orientation_xyzw=recording.orientation_xyzw[held],
            joint_angle_rad=recording.joint_angle_rad[held],
            pressure_pa=recording.pressure_pa[held],
        )
    )
    assert felt.evidence.as_dict() == {"frame": 1.0}
    assert felt.local_curvatures == ()
    assert felt.sites[0].contact
    assert felt.sites[0].k1_per_m is None
    assert "not rolled over" in felt.warnings[0]


def test_one_direction_says_so_and_leaves_k1_and_k2_open():
    felt = sense_curvature(rolled(cylinder(0.02), (np.pi / 2,)))
    assert felt.sites[0].k2_per_m is None
    assert felt.local_curvatures[0].curvature_per_m == pytest.approx(-50.0, rel=0.03)
    assert felt.evidence.as_dict()["C-|H|E-"] > 0.5
    assert "one direction" in felt.warnings[0]


@pytest.mark.parametrize("samples", [3, 6, 20, 60])
@pytest.mark.parametrize("turn", [0.07, 0.35])
def test_short_and_sparse_rolls_never_fail(samples, turn):
    felt = sense_curvature(rolled(cylinder(0.02), samples=samples, turn_rad=turn))
    assert felt.evidence.masses.sum() == pytest.approx(1.0)


@pytest.mark.parametrize("length", [1, 2, 3, 10])
def test_recordings_of_a_few_samples_never_fail(length):
    whole = rolled(plane(), (0.0,))
    part = slice(200, 200 + length)
    felt = sense_curvature(
        replace(
            whole,
            time_ns=whole.time_ns[part],
            position_m=whole.position_m[part],
            orientation_xyzw=whole.orientation_xyzw[part],
            joint_angle_rad=whole.joint_angle_rad[part],
            pressure_pa=whole.pressure_pa[part],
        )
    )
    assert felt.evidence.as_dict().get("frame", 0.0) > 0.1


def test_much_slip_is_reported():
    felt = sense_curvature(rolled(plane(), slip=0.3))
    assert "slip" in felt.warnings[0]


def test_the_chapters_model_gives_a_plane_no_belief_and_a_saddle_some():
    flat = sense_curvature(rolled(plane()), belief="chapter")
    assert flat.evidence.as_dict()["frame"] > 0.99
    rolls = tuple(np.arange(4) * np.pi / 4)
    bent = sense_curvature(rolled(quadric(33.0, -33.0), rolls, turn_rad=0.25), belief="chapter")
    assert bent.evidence.as_dict()["frame"] < 0.95
    with pytest.raises(UsageError, match="unknown belief model"):
        sense_curvature(rolled(plane(), (0.0,)), belief="none")


def test_json_has_the_documented_shape():
    touched, aside = rolled(ball(-0.03), turn_rad=0.2), rolled(plane(), (0.0,), offset_m=(0.0, 0.0, -0.02))
    missed = replace(aside, pressure_pa=np.zeros_like(aside.pressure_pa))
    values = json.loads(json.dumps(sense_curvature(joined(touched, missed)).to_json(), allow_nan=False))
    assert {"local_curvatures", "sites", "belief", "conductivity", "decision"} <= set(values)
    assert {"site", "direction_rad", "curvature_per_m", "belief"} <= set(values["local_curvatures"][0])
    assert [site["contact"] for site in values["sites"]] == [True, False]
    assert values["sites"][1]["k1_per_m"] is None
    assert set(values["conductivity"]) == {"quasiplanar", "curved", "occluded"}
    assert sum(values["belief"].values()) == pytest.approx(1.0)
    assert {"P", "C-", "C+", "H", "E-", "E+", "N", "frame"} <= set(values["belief"])
