"""What is suspected of a rolled finger whose numbers were written down in another way, and what is not."""

from dataclasses import replace

import numpy as np
import pytest

from evifuse.recordings.recording import TouchRecording
from evifuse.recordings.suspicions import suspected_time_unit, suspicions
from evifuse.simulation import Noise, simulate

INVERSE = np.array([-1.0, -1.0, -1.0, 1.0])


@pytest.fixture(scope="module", params=["saddle", "plane"])
def rolled(request: pytest.FixtureRequest) -> TouchRecording:
    touch = simulate(request.param, rate_hz=100, picture=False).scene.touch
    assert touch is not None
    return touch


CHANGES = {
    "is the position in mm?": lambda r: replace(r, position_m=r.position_m * 1000),
    "is the position in cm?": lambda r: replace(r, position_m=r.position_m * 100),
    "is its radius in metres?": lambda r: replace(r, fingertip=replace(r.fingertip, radius_m=0.9)),
    "order w, x, y, z?": lambda r: replace(r, orientation_xyzw=r.orientation_xyzw[:, [3, 0, 1, 2]]),
    "give its inverse": lambda r: replace(r, orientation_xyzw=r.orientation_xyzw * INVERSE),
    "do the normals point inwards?": lambda r: replace(
        r, fingertip=replace(r.fingertip, normals=-r.fingertip.normals)
    ),
    "no fingertip presses so hard": lambda r: replace(r, pressure_pa=r.pressure_pa * 1000),
    "so little is hardly felt": lambda r: replace(r, pressure_pa=r.pressure_pa / 1000),
    "give the reading at no load as offset": lambda r: replace(r, pressure_pa=r.pressure_pa + 1e5),
}


@pytest.mark.parametrize("says", CHANGES)
def test_another_way_to_write_is_suspected(rolled: TouchRecording, says: str):
    found = [text for _, text in suspicions(CHANGES[says](rolled))]
    assert len(found) == 1
    assert says in found[0]


def test_what_is_right_is_not_suspected(rolled: TouchRecording):
    rng = np.random.default_rng(3)
    noisy = rolled.position_m + rng.normal(0, 1e-4, rolled.position_m.shape)
    still = np.tile([0.0, 0.0, 0.0, 1.0], (len(rolled.time_ns), 1))
    slid = np.cumsum(np.full((len(rolled.time_ns), 3), 1e-5), axis=0)
    for change in ({}, {"position_m": noisy}, {"orientation_xyzw": still}, {"position_m": slid}):
        assert suspicions(replace(rolled, **change)) == []
    for few in (1, 5, 30):
        part = slice(0, few)
        keys = ("time_ns", "position_m", "orientation_xyzw", "joint_angle_rad", "pressure_pa")
        assert suspicions(replace(rolled, **{key: getattr(rolled, key)[part] for key in keys})) == []


@pytest.mark.parametrize("noise", [Noise(slip=0.4), Noise(pressure_pa=1e3, position_m=2e-4, angle_rad=9e-3)])
def test_slip_and_noise_are_not_suspected(noise: Noise):
    touch = simulate("cylinder", rate_hz=200, picture=False, noise=noise, seed=5).scene.touch
    assert touch is not None
    assert suspicions(touch) == []


@pytest.mark.parametrize(("unit", "factor"), [("us", 10**3), ("ms", 10**6), ("s", 10**9), ("", 1)])
@pytest.mark.parametrize("rate_hz", [50, 100, 1000, 8000])
def test_times_in_other_units(unit: str, factor: int, rate_hz: int):
    time_ns = 1_700_000_000_000_000_000 + (np.arange(30 * rate_hz) * (1e9 / rate_hz)).astype(np.int64)
    said = suspected_time_unit(time_ns // factor)
    assert said == (f"{unit}? multiply by {factor}" if unit else "")
