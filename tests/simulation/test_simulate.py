import subprocess
import sys

import numpy as np
import pytest

from evifuse.errors import MissingExtraError, UsageError
from evifuse.recordings import read_scene, write_scene
from evifuse.recordings.checks import checked_touch
from evifuse.simulation import SURFACES, Noise, simulate
from evifuse.simulation.procedure import Procedure
from tests.recordings.made import assert_same_touch

QUICK = Procedure(directions_rad=(0.0, 1.0), roll_s=0.2)


@pytest.mark.parametrize("name", SURFACES)
def test_every_surface_gives_a_valid_recording_and_its_truth(name):
    simulated = simulate(name, rate_hz=200, procedure=QUICK, picture=False)
    touch = checked_touch(simulated.scene.touch)
    assert simulated.truth.surface.name == name
    assert len(simulated.truth.roll) == len(touch.time_ns)
    assert len(simulated.truth.sites) == 2
    pressed = touch.pressure_pa.max(axis=1) > 0
    for number in range(4):
        samples = simulated.truth.roll == number
        assert samples.any() == simulated.truth.sites[number // 2].contact
        # on an edge the patch is narrower than the taxels are apart
        enough = 0.9 if simulated.truth.category == "edge" else 1.0
        assert pressed[samples].sum() >= enough * samples.sum()


def test_the_default_is_ten_seconds_at_one_kilohertz_with_a_picture():
    simulated = simulate("plane")
    touch = simulated.scene.touch
    assert len(touch.time_ns) == 10_000
    assert set(np.diff(touch.time_ns)) == {1_000_000}
    assert set(simulated.truth.roll) == set(range(-1, 8))
    assert simulated.scene.image.shape == (480, 640, 3)
    assert simulated.scene.camera is not None
    assert simulated.scene.image.std() > 20


def test_over_the_hole_the_finger_goes_below_the_plate_and_meets_nothing():
    simulated = simulate("hole", rate_hz=200, picture=False)
    touch, roll = simulated.scene.touch, simulated.truth.roll
    beside, over = simulated.truth.sites
    assert (beside.k1_per_m, beside.k2_per_m, beside.contact) == (0.0, 0.0, True)
    assert (over.k1_per_m, over.k2_per_m, over.contact) == (None, None, False)
    assert simulated.truth.category == "occluded"
    at_hole = np.hypot(*touch.position_m[:, :2].T) < 1e-6
    assert not touch.pressure_pa[at_hole].any()
    deep = touch.position_m[:, 2] < touch.fingertip.radius_m - 0.005
    assert deep.sum() > 0.3 * at_hole.sum()
    assert (at_hole[deep]).all()
    assert touch.position_m[roll >= 0, 2].min() > touch.fingertip.radius_m - 0.0005


def test_the_same_seed_gives_the_same_scene_and_another_another():
    noise = Noise(pressure_pa=2e3, position_m=1e-5, angle_rad=1e-3, grey=2.0)
    first, again, other = (
        simulate("cylinder", seed=seed, rate_hz=200, procedure=QUICK, noise=noise) for seed in (4, 4, 5)
    )
    assert_same_touch(first.scene.touch, again.scene.touch, 0.0)
    np.testing.assert_array_equal(first.scene.image, again.scene.image)
    assert (first.scene.touch.pressure_pa != other.scene.touch.pressure_pa).any()
    assert (first.scene.image != other.scene.image).any()


def test_noise_has_the_stated_size():
    noise = Noise(pressure_pa=2e3, position_m=1e-5, angle_rad=1e-3)
    share = Noise(pressure_share=0.1)
    clean, noisy, scaled = (
        simulate("bowl", rate_hz=1000, procedure=QUICK, noise=n, picture=False).scene.touch
        for n in (None, noise, share)
    )
    checked_touch(noisy)
    for key, expected in (("pressure_pa", 2e3), ("position_m", 1e-5), ("joint_angle_rad", 1e-3)):
        np.testing.assert_allclose((getattr(noisy, key) - getattr(clean, key)).std(), expected, rtol=0.05)
    cosine = np.abs(np.sum(noisy.orientation_xyzw * clean.orientation_xyzw, axis=1))
    angle = 2 * np.arccos(np.clip(cosine, 0, 1))
    np.testing.assert_allclose(np.sqrt((angle**2).mean() / 3), 1e-3, rtol=0.05)
    loaded = clean.pressure_pa > 1e4
    off = scaled.pressure_pa[loaded] / clean.pressure_pa[loaded] - 1
    np.testing.assert_allclose(off.std(), 0.1, rtol=0.05)


def test_a_simulated_scene_survives_its_file(tmp_path):
    scene = simulate("saddle", rate_hz=200, procedure=QUICK).scene
    write_scene(tmp_path / "s.mcap", scene)
    again = read_scene(tmp_path / "s.mcap")
    np.testing.assert_array_equal(again.image, scene.image)
    np.testing.assert_allclose(again.camera.position_m, scene.camera.position_m)
    assert_same_touch(again.touch, scene.touch)


def test_dimensions_sites_and_fingertips_can_be_chosen():
    simulated = simulate(
        "sphere", radius_m=0.05, fingertip_radius_m=0.006, sites=((0.0, 0.0),), rate_hz=200, procedure=QUICK
    )
    (site,) = simulated.truth.sites
    np.testing.assert_allclose((site.k1_per_m, site.k2_per_m), (-20.0, -20.0))
    assert simulated.scene.touch.fingertip.radius_m == 0.006
    assert set(simulated.truth.roll) == {-1, 0, 1}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"name": "cube"}, "unknown surface 'cube'"),
        ({"name": "bowl", "radius_m": 0.011}, "does not fit into the bowl"),
        ({"name": "hole", "radius_m": 0.009}, "does not fit into the hole"),
        ({"name": "plane", "rate_hz": 10.0}, "at least 100 Hz"),
        ({"name": "plane", "fingertip_radius_m": -1.0}, "fingertip's radius"),
        ({"name": "plane", "sites": ()}, "at least one site"),
        ({"name": "plane", "sites": ((1.0, 1.0),)}, "beside the plane"),
        ({"name": "plane", "wrong": 1.0}, "no dimension 'wrong'"),
    ],
)
def test_what_can_not_be_simulated_is_named(arguments, message):
    with pytest.raises(UsageError, match=message):
        simulate(arguments.pop("name"), **arguments)


def test_without_mujoco_the_message_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'evifuse\[simulation\]'"):
        simulate("plane")


def test_heavy_libraries_are_not_imported_before_they_are_needed():
    code = (
        "import sys, evifuse.simulation, evifuse.recordings; "
        "print(sorted({'mujoco', 'cv2', 'mcap', 'rosbags', 'scipy'} & sys.modules.keys()))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("name", ["trough", "bowl"])
@pytest.mark.parametrize("radius_m", [0.013, 0.015, 0.02])
def test_a_finger_lifted_out_of_a_tight_hollow_touches_nothing(name: str, radius_m: float) -> None:
    touch = simulate(name, radius_m=radius_m, picture=False, rate_hz=200).scene.touch
    assert touch is not None
    highest = touch.pressure_pa.max(axis=1)
    lifted = touch.position_m[:, 2] > 0.01 + 0.003
    assert np.all(highest[lifted] == 0)
    assert 1e5 < highest.max() < 1e6
