from dataclasses import asdict

import numpy as np
import pytest

from evifuse.simulation import simulate
from evifuse.simulation.simulate import Noise
from evifuse.touch import Edge, contact_track, find_edge, find_sites, sense_curvature, site_edge
from evifuse.touch.edges import beside_edges
from tests.touch.rolled import ball, cylinder, plane, quadric, rolled

NOISY = {"position_noise_m": 1e-4, "angle_noise_rad": 5e-3, "pressure_noise_pa": 300.0}


def edges_of(recording):
    track = contact_track(recording)
    sites = find_sites(recording, track)
    return [site_edge([find_edge(recording, track, site, roll) for roll in site.rolls]) for site in sites]


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
        assert edge.turn_rad > 0.25
        assert edge.width_m < 0.1 * 0.010 * edge.turn_rad
        across = np.angle(np.exp(2j * (edge.direction_rad - 0.4 - np.pi / 2))) / 2
        assert abs(across) < 0.5


@pytest.fixture(scope="module", params=["edge", "corner"])
def felt_edge(request):
    noise = Noise(pressure_pa=200.0, position_m=2e-5, angle_rad=2e-3)
    scene = simulate(request.param, picture=False, rate_hz=250, noise=noise, seed=3)
    return request.param, sense_curvature(scene.scene.touch)


def test_a_simulated_edge_is_told_and_not_called_curved(felt_edge):
    name, felt = felt_edge
    said = [site for site in felt.sites if site.edge is not None]
    assert said
    for site in said:
        assert site.shape is None
        assert site.evidence.as_dict() == {"frame": 1.0}
    curved = sum(mass for focal, mass in felt.evidence.as_dict().items() if focal in ("C-", "E-", "C+", "E+"))
    assert curved < 0.1
    assert felt.classification.decision != "curved"
    article = "a corner" if name == "corner" else "an edge"
    assert any(f"is {article} (turn " in line and " rad within " in line for line in felt.warnings)


def test_an_edge_is_written_with_its_numbers(felt_edge):
    _, felt = felt_edge
    written = felt.to_json()["sites"]
    assert [site["edge"] for site in written] == [s.edge and asdict(s.edge) for s in felt.sites]
    assert all(site["k1_per_m"] is None for site in written if site["edge"])


def test_rolls_that_turn_in_different_directions_meet_a_corner():
    one, other = Edge(0.6, 1e-4, True, 0.1), Edge(0.4, 1e-4, True, 1.2)
    assert str(site_edge([one, None])) == "an edge (turn 0.6 rad within 0.1 mm)"
    assert str(site_edge([one, other])) == "a corner (turn 0.6 rad within 0.1 mm)"
    assert site_edge([None, None]) is None
    across_the_seam = Edge(0.4, 1e-4, True, np.pi - 0.1)
    assert site_edge([Edge(0.6, 1e-4, True, 0.05), across_the_seam]).corner is False
    assert str(Edge(0.5, 2e-4, False, 0.0)) == "an inner edge (turn 0.5 rad within 0.2 mm)"


def test_only_sites_close_to_an_edge_are_beside_it():
    recording = rolled(plane())
    sites = find_sites(recording, contact_track(recording))
    edge = Edge(0.6, 1e-4, True, 0.1)
    assert beside_edges(sites, [None] * len(sites), 0.01) == [False] * len(sites)
    assert beside_edges(sites, [edge] * len(sites), 0.01) == [True] * len(sites)
