from dataclasses import replace

import numpy as np
import pytest

from evifuse.errors import RecordingError
from evifuse.recordings.checks import checked_touch
from evifuse.recordings.recording import Fingertip
from evifuse.recordings.units import PRESSURE_UNITS, to_pascal
from tests.recordings.made import assert_same_touch, made_touch

GOOD = made_touch()


def with_nan(values: np.ndarray) -> np.ndarray:
    changed = values.copy()
    changed[(3, *[0] * (values.ndim - 1))] = np.nan
    return changed


def test_a_valid_recording_passes_unchanged():
    assert_same_touch(checked_touch(GOOD), GOOD, 0.0)


def test_lengths_near_one_become_one():
    stretched = replace(GOOD, orientation_xyzw=GOOD.orientation_xyzw * 1.004)
    np.testing.assert_allclose(np.linalg.norm(checked_touch(stretched).orientation_xyzw, axis=1), 1.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"time_ns": GOOD.time_ns[:0]}, "T = 0"),
        ({"time_ns": GOOD.time_ns[::-1]}, "does not increase at sample 1"),
        ({"time_ns": np.append(GOOD.time_ns[:-1], GOOD.time_ns[-2])}, "does not increase at sample 39"),
        ({"time_ns": GOOD.time_ns * 1.0}, "whole nanoseconds"),
        ({"position_m": GOOD.position_m[:, :2]}, r"position_m must have shape \(40, 3\)"),
        ({"position_m": with_nan(GOOD.position_m)}, "position_m is NaN or infinite at row 3"),
        ({"orientation_xyzw": GOOD.orientation_xyzw * 2}, "orientation_xyzw must have length 1"),
        ({"orientation_xyzw": GOOD.orientation_xyzw[:-1]}, "orientation_xyzw must have shape"),
        ({"joint_angle_rad": with_nan(GOOD.joint_angle_rad)}, "joint_angle_rad is NaN"),
        ({"pressure_pa": GOOD.pressure_pa[:, 1:]}, r"pressure_pa must have shape \(40, 5\)"),
        ({"pressure_pa": with_nan(GOOD.pressure_pa)}, "pressure_pa is NaN or infinite at row 3"),
        ({"fingertip": replace(GOOD.fingertip, radius_m=10.0)}, "radius must be in"),
        ({"fingertip": replace(GOOD.fingertip, radius_m=np.nan)}, "radius must be in"),
        ({"fingertip": Fingertip(0.01, np.empty((0, 3)), np.empty((0, 3)))}, "N >= 1"),
        ({"fingertip": replace(GOOD.fingertip, normals=GOOD.fingertip.normals * 3)}, "normals must"),
    ],
)
def test_what_is_wrong_is_named(change, message):
    with pytest.raises(RecordingError, match=message) as caught:
        checked_touch(replace(GOOD, **change))
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith("made: ")


@pytest.mark.parametrize("unit", PRESSURE_UNITS)
def test_units_scale_and_the_offset_is_in_the_unit(unit):
    values = np.array([[1.0, 2.5]])
    np.testing.assert_allclose(to_pascal(values, unit, offset=0.5), (values - 0.5) * PRESSURE_UNITS[unit])


def test_newtons_need_an_area():
    np.testing.assert_allclose(to_pascal(np.array([2.0]), "N", area_m2=1e-6), [2e6])
    for area in (0.0, -1.0, np.nan):
        with pytest.raises(RecordingError, match="area"):
            to_pascal(np.array([2.0]), "N", area_m2=area)


def test_unknown_units_name_what_is_accepted():
    with pytest.raises(RecordingError, match=r"'psi'.*Pa, hPa, kPa, MPa, bar"):
        to_pascal(np.array([2.0]), "psi")
    with pytest.raises(RecordingError, match="no load"):
        to_pascal(np.array([2.0]), "Pa", offset=np.inf)
