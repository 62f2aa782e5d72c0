from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evifuse.touch import contact_track, find_sites
from evifuse.touch.rolling import contact_intervals, split_by_direction, tangents
from tests.touch.rolled import joined, plane, rolled


def sites_of(recording):
    return find_sites(recording, contact_track(recording))


@settings(max_examples=40, deadline=None)
@given(
    turns=st.lists(st.floats(1.0, np.pi), min_size=0, max_size=4),
    signs=st.lists(st.booleans(), min_size=4, max_size=4),
    start=st.floats(-np.pi, np.pi),
)
def test_a_path_is_cut_at_its_corners_and_nowhere_else(turns, signs, start):
    heading, corners = start, [np.zeros(2)]
    for turn, sign in zip([0.0, *turns], [True, *signs], strict=False):
        heading += turn if sign else -turn
        corners.append(corners[-1] + 0.01 * np.array([np.cos(heading), np.sin(heading)]))
    share = np.arange(100)[:, None] / 100
    legs = pairwise(corners)
    path = np.concatenate([a + share * (b - a) for a, b in legs] + [corners[-1][None]])
    pieces = split_by_direction(path, 0.001)
    assert len(pieces) == len(corners) - 1
    assert [start for start, _ in pieces] == pytest.approx([100 * i for i in range(len(pieces))], abs=10)


def test_short_bounces_neither_join_nor_split_contacts():
    time = np.arange(1000, dtype=np.int64) * 1_000_000
    touching = np.zeros(1000, dtype=bool)
    touching[100:400] = True
    touching[250:255] = False
    touching[600:610] = True
    touching[700:900] = True
    assert contact_intervals(touching, time) == [(100, 400), (700, 900)]


@settings(max_examples=50, deadline=None)
@given(st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1))
def test_tangents_are_a_right_handed_frame(vector):
    normal = np.array(vector) / np.linalg.norm(vector)
    first, second = tangents(normal)
    frame = np.stack([first, second, normal])
    assert np.allclose(frame @ frame.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(frame) == pytest.approx(1.0)


def test_four_directions_with_lifts_are_one_site():
    (site,) = sites_of(rolled(plane()))
    assert len(site.rolls) == 4
    assert np.allclose(site.centre_m, [0, 0, 0.010 - 6e-5], atol=2e-5)
    assert site.normal @ [0, 0, 1] > 0.9999


@pytest.mark.parametrize("gap_m", [0.0025, 0.004, 0.03])
def test_sites_are_told_apart_by_their_middles(gap_m):
    recording = joined(rolled(plane()), rolled(plane(), offset_m=(gap_m, 0.3 * gap_m, 0.0)))
    found = sites_of(recording)
    assert [len(site.rolls) for site in found] == [4, 4]
    assert np.allclose(found[1].centre_m - found[0].centre_m, [gap_m, 0.3 * gap_m, 0.0], atol=5e-5)


def test_rolling_there_and_back_without_a_lift_is_two_rolls():
    one = rolled(plane(), (0.0, np.pi / 2))
    back = replace(
        one,
        position_m=one.position_m[::-1].copy(),
        orientation_xyzw=one.orientation_xyzw[::-1].copy(),
        joint_angle_rad=one.joint_angle_rad[::-1].copy(),
        pressure_pa=one.pressure_pa[::-1].copy(),
    )
    keep = np.flatnonzero(contact_track(one).touching[: len(one.time_ns) // 2])
    there_and_back = joined(*(
        replace(r, time_ns=r.time_ns[i], position_m=r.position_m[i], orientation_xyzw=r.orientation_xyzw[i],
                joint_angle_rad=r.joint_angle_rad[i], pressure_pa=r.pressure_pa[i])
        for r, i in ((one, keep), (back, len(one.time_ns) - 1 - keep[::-1]))
    ))  # fmt: skip
    (site,) = sites_of(there_and_back)
    assert len(site.rolls) == 2


def test_rays_that_start_at_a_site_belong_to_it():
    halves = []
    for direction in (0.0, 1.5, 2.9, 4.5):
        whole = rolled(plane(), (direction,))
        on = np.flatnonzero(contact_track(whole).touching)
        on = on[len(on) // 2 :]
        lift = np.arange(on[-1] + 1, len(whole.time_ns))
        i = np.concatenate([on, lift])
        halves.append(
            replace(whole, time_ns=whole.time_ns[i], position_m=whole.position_m[i],
                    orientation_xyzw=whole.orientation_xyzw[i], joint_angle_rad=whole.joint_angle_rad[i],
                    pressure_pa=whole.pressure_pa[i])
        )  # fmt: skip
    (site,) = sites_of(joined(*halves))
    assert len(site.rolls) == 4
    assert np.linalg.norm(site.centre_m[:2]) < 3e-4
