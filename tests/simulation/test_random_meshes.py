"""Random bodies: closed, the same again, and as curved as the relief that they were made from."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from evifuse.simulation import auto_sites
from evifuse.simulation.random_meshes import random_body
from evifuse.simulation.reliefs import Relief


@pytest.fixture(scope="module", params=["plate", "ball"])
def body(request):
    return random_body(7, 1, kind=request.param)


def test_a_body_is_closed_and_a_plate_has_one_opening(body):
    mesh = trimesh.Trimesh(body.surface.vertices_m, body.surface.faces)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume > 0
    assert mesh.euler_number == (2 if body.opening_m is None else 0)
    if body.opening:
        assert body.pierced().place(body.opening[0]) is None
        assert body.surface.place((0.055, 0.055)) is not None


def test_the_mesh_is_as_curved_as_its_relief(body):
    sites = np.array(auto_sites(body.surface, 4, seed=1, within=body.on_relief, doubtful=True))
    assert body.on_relief(sites).all()
    relief = np.stack(body.principal_of_relief(sites), axis=1)
    mesh = np.array([body.surface.principal_curvatures(site) for site in sites])
    assert np.abs(relief).max() > 5
    np.testing.assert_allclose(mesh, relief, atol=0.6, rtol=0.04)


def test_the_relief_of_a_bare_body_is_level(body):
    none = tuple(
        Relief(r.place_m[:0], r.axes[:0], r.curvature_per_m[:0], r.width_m[:0], r.ball_m)
        for r in body.reliefs
    )
    points = body.surface.samples_m[:50]
    ball = body.opening_m is None
    there = body.size_m * points / np.linalg.norm(points, axis=1)[:, None] if ball else points * [1, 1, 0]
    for found in replace(body, reliefs=none).principal_of_relief(there):
        np.testing.assert_allclose(found, -1 / body.size_m if ball else 0.0, atol=1e-3)


def test_the_same_seed_gives_the_same_body_and_another_an_other():
    one, again, other = (random_body(s, 0, kind="ball", radius_m=0.004) for s in (5, 5, 6))
    np.testing.assert_array_equal(one.surface.samples_m, again.surface.samples_m)
    assert one.size_m != other.size_m
    # all lengths go with the finger: 4.5 to 8 of its radii, and features upon that
    assert 0.016 < one.surface.around[1] < 0.05
