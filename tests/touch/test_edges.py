from dataclasses import asdict

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evifuse.simulation import Noise, Procedure, simulate
from evifuse.touch import Edge, contact_track, find_edge, find_sites, sense_curvature
from evifuse.touch.edges import beside_edges, site_edge
from evifuse.touch.fingertip import spherical_fingertip
from evifuse.touch.layouts import load_fingertip
from evifuse.touch.rounding import Rounding, roundings, taxel_angle_rad
from tests.touch.rolled import ball, cylinder, plane, quadric, rolled

NOISY = {"position_noise_m": 1e-4, "angle_noise_rad": 5e-3, "pressure_noise_pa": 300.0}
MODEST = Noise(pressure_pa=200.0, position_m=2e-5, angle_rad=2e-3)
SMALL = spherical_fingertip(0.005, 0.91e-3)
"""A finger of 5 mm with few taxels."""
GENTLE = Procedure(press_n=0.4, arc_rad=0.15)
"""Something thin is pressed in by less than its radius, and not rolled around."""


def edges_of(recording):
    track = contact_track(recording)
    return [find_edge(recording, track, site) for site in find_sites(recording, track)]


def felt_at(surface, noise=MODEST, fingertip=None, seed=3, **dimensions):
    """What is felt at the sites of a simulated surface, each the nearest felt site."""
    scene = simulate(
        surface, picture=False, rate_hz=250, noise=noise, seed=seed, fingertip=fingertip, **dimensions
    )
    felt = sense_curvature(scene.scene.touch)
    return felt, [
        min(felt.sites, key=lambda site: float(np.linalg.norm(site.position_m - true.position_m)))
        for true in scene.truth.sites
    ]


@pytest.mark.parametrize("noise", [{}, NOISY], ids=["clean", "noisy"])
@pytest.mark.parametrize(
    "surface",
    [plane(), ball(0.004), ball(-0.013), cylinder(0.004, 0.3), cylinder(-0.015), quadric(60.0, -60.0)],
    ids=["plane", "ball", "bowl", "cylinder", "trough", "saddle"],
)
def test_a_smooth_surface_has_no_edge_however_curved_it_is(surface, noise):
    assert set(edges_of(rolled(surface, **noise))) == {None}


@pytest.mark.parametrize("noise", [{}, NOISY], ids=["clean", "noisy"])
def test_a_rod_of_half_a_millimetre_is_an_edge_along_its_axis(noise):
    found = [edge for edge in edges_of(rolled(cylinder(5e-4, 0.4), **noise)) if edge is not None]
    assert found
    for edge in found:
        assert edge.convex
        assert not edge.corner
        assert edge.turn_rad > 0.25
        assert edge.radius_m <= 1.5e-3
        assert 5e-4 <= edge.largest_radius_m < 5e-3
        assert abs(np.angle(np.exp(2j * (edge.direction_rad - 0.4))) / 2) < 0.2


def test_the_radius_of_a_thin_rod_is_measured_on_the_arc_of_the_centre():
    for radius in (0.0015, 0.0025, 0.004):
        recording = rolled(cylinder(radius))
        track = contact_track(recording)
        (site,) = find_sites(recording, track)
        best = min(roundings(recording, track, site), key=lambda own: own.error_m)
        assert abs(best.radius_m - radius) < 2.5 * best.error_m
        assert best.error_m < 4e-4


@pytest.fixture(scope="module", params=["edge", "corner"])
def felt_edge(request):
    return request.param, *felt_at(request.param)


def test_a_simulated_edge_is_told_and_not_called_curved(felt_edge):
    name, felt, sites = felt_edge
    for site in sites:
        assert site.edge is not None
        assert site.shape is None
        assert site.evidence.as_dict() == {"frame": 1.0}
        assert site.edge.radius_m <= 5e-4 + 2e-4
        assert 4e-4 < site.edge.largest_radius_m < 1.5e-3
    assert [site.edge.corner for site in sites] == [name == "corner", False]
    curved = sum(mass for focal, mass in felt.evidence.as_dict().items() if focal in ("C-", "E-", "C+", "E+"))
    assert curved < 0.1
    assert felt.classification.decision != "curved"
    article = "a corner" if name == "corner" else "an edge"
    assert any(f"is {article} (turn " in line and " rad, radius below " in line for line in felt.warnings)


def test_the_direction_of_an_edge_is_that_of_its_ridge(felt_edge):
    name, _, sites = felt_edge
    if name == "edge":  # along x
        for site in sites:
            assert abs(np.angle(np.exp(2j * site.edge.direction_rad)) / 2) < 0.05
    else:
        assert sites[0].edge.direction_rad is None


def test_an_edge_is_written_with_its_numbers(felt_edge):
    _, felt, _ = felt_edge
    written = felt.to_json()["sites"]
    assert [site["edge"] for site in written] == [s.edge and asdict(s.edge) for s in felt.sites]
    assert all(site["k1_per_m"] is None for site in written if site["edge"])


@pytest.mark.parametrize(
    ("surface", "dimensions", "fingertip"),
    [
        ("edge", {"radius_m": 1e-4}, None),
        ("edge", {"radius_m": 1e-3, "opening_rad": 2.0}, None),
        ("edge", {"opening_rad": np.deg2rad(155)}, None),
        ("cylinder", {"radius_m": 2e-4, "procedure": GENTLE}, SMALL),
        ("cylinder", {"radius_m": 4e-4, "procedure": GENTLE}, SMALL),
    ],
    ids=["sharp", "rounded", "ridge", "wire", "thicker wire"],
)
def test_what_is_sharp_is_no_curvature(surface, dimensions, fingertip):
    _, sites = felt_at(surface, fingertip=fingertip, **dimensions)
    for site in sites:
        assert site.edge is not None
        assert site.edge.convex
        assert site.edge.corner == (surface == "sphere")
        assert site.edge.largest_radius_m >= 0.9 * dimensions.get("radius_m", 5e-4)


@pytest.mark.parametrize(
    ("surface", "radius_m", "fingertip"),
    [
        ("edge", 3e-3, None),
        ("cylinder", 2e-3, None),
        ("sphere", 2e-3, None),
        ("cylinder", 1.2e-3, SMALL),
        ("sphere", 1.2e-3, SMALL),
    ],
)
def test_what_is_rounded_enough_to_be_measured_is_no_edge(surface, radius_m, fingertip):
    _, sites = felt_at(surface, fingertip=fingertip, radius_m=radius_m)
    for site in sites:
        assert site.edge is None
        assert -1 / site.k2_per_m == pytest.approx(radius_m, abs=2.5e-4 if fingertip else 7e-4)


@pytest.mark.parametrize(
    ("surface", "dimensions", "sharp"),
    [
        ("edge", {"radius_m": 5e-4}, True),
        ("edge", {"radius_m": 1.7e-3, "opening_rad": 2.0}, True),
        ("cylinder", {"radius_m": 0.008}, False),
        ("saddle", {"radius_m": 0.035}, False),
    ],
)
def test_a_real_fingertip_tells_edges_from_what_is_round(surface, dimensions, sharp):
    pytest.importorskip("paxini_sdk")
    _, sites = felt_at(surface, fingertip=load_fingertip("paxini:DP-M2826-Omega"), **dimensions)
    for site in sites:
        assert (site.edge is not None) == sharp
        if sharp:
            assert site.evidence.as_dict() == {"frame": 1.0}
            assert site.edge.largest_radius_m >= dimensions["radius_m"]


def rounding(radius_m, error_m=2e-4, across_rad=0.0, turn_rad=0.6, convex=True):
    return Rounding(radius_m, error_m, turn_rad, across_rad, convex)


def test_a_corner_is_where_rolls_turn_in_different_directions():
    edge = site_edge([rounding(1e-4), rounding(2e-4, 3e-4, 0.3, 0.4)], 0.01)
    assert str(edge) == "an edge (turn 0.6 rad, radius below 0.5 mm)"
    assert edge.direction_rad == pytest.approx(np.pi / 2)
    corner = site_edge([rounding(1e-4), rounding(2e-4, 3e-4, 1.2, 0.8)], 0.01)  # they disagree by 0.1 mm
    assert str(corner) == "a corner (turn 0.8 rad, radius below 0.9 mm)"
    assert corner.direction_rad is None
    either = [rounding(4e-3, 1e-4), rounding(1e-3, 3e-4)]
    assert site_edge(either, 0.01) is None
    assert site_edge(either, 0.01, sphere=False).largest_radius_m == pytest.approx(4.2e-3)
    across_the_seam = site_edge([rounding(0.0, across_rad=0.05), rounding(0.0, across_rad=np.pi - 0.1)], 0.01)
    assert not across_the_seam.corner
    assert str(site_edge([rounding(0.0, convex=False)], 0.01)) == (
        "an inner edge (turn 0.6 rad, radius below 0.4 mm)"
    )
    assert site_edge([], 0.01) is None


def test_a_roll_that_knows_better_decides():
    vague = rounding(5e-4, 1e-3)
    assert site_edge([vague], 0.01) is not None
    assert site_edge([vague, rounding(2e-3, 2e-4)], 0.01) is None
    assert site_edge([vague, rounding(2e-3, 2e-3)], 0.01) is not None


@given(st.floats(-1e-3, 0.02), st.floats(1e-5, 5e-3), st.floats(1e-3, 0.03))
def test_an_edge_is_narrow_or_holds_zero(radius_m, error_m, finger_m):
    edge = site_edge([rounding(radius_m, error_m)], finger_m)
    bounded = max(radius_m, 0.0) + 2 * error_m <= 0.35 * finger_m
    narrow = radius_m <= 0.125 * finger_m or radius_m - 2 * error_m <= 0
    assert (edge is not None) == (bounded and narrow)
    if edge is not None:
        assert 0 <= edge.radius_m < edge.largest_radius_m


def test_only_sites_close_to_an_edge_are_beside_it():
    recording = rolled(plane())
    sites = find_sites(recording, contact_track(recording))
    edge = Edge(0.6, 0.0, 1e-4, True, 0.1)
    assert beside_edges(sites, [None] * len(sites), 0.01) == [False] * len(sites)
    assert beside_edges(sites, [edge] * len(sites), 0.01) == [True] * len(sites)


def test_the_angle_between_taxels_is_the_pitch_over_the_radius():
    assert taxel_angle_rad(spherical_fingertip(0.01, 0.7e-3)) == pytest.approx(0.07, rel=0.15)
