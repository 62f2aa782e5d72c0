"""A mesh is touched as the smooth body that it stands for."""

import numpy as np
import pytest
import trimesh

from evifuse.errors import UsageError
from evifuse.simulation import Procedure, auto_sites, load_mesh, primitive_of, simulate

QUICK = Procedure(directions_rad=(0.0, 1.0), roll_s=0.2)


@pytest.fixture(scope="module")
def ball():
    mesh = trimesh.creation.icosphere(4, 0.03)
    return load_mesh((mesh.vertices, mesh.faces))


@pytest.fixture(scope="module")
def ring():
    mesh = trimesh.creation.torus(0.04, 0.015, 72, 48)
    return load_mesh((mesh.vertices, mesh.faces))


def test_nearest_points_of_a_ball(ball):
    rng = np.random.default_rng(1)
    away = rng.normal(size=(300, 3))
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    points = away * rng.uniform(0.025, 0.05, (300, 1))
    foot, normal = ball.nearest(points)
    np.testing.assert_allclose(np.linalg.norm(foot, axis=1), 0.03, atol=4e-5)
    assert (np.einsum("ij,ij->i", normal, away) > np.cos(0.01)).all()
    np.testing.assert_allclose(np.cross(points - foot, normal), 0.0, atol=1e-7)
    plain = np.array([ball.nearest_one(*point) for point in points[:5].tolist()])
    np.testing.assert_allclose(plain, np.stack([foot, normal], axis=1)[:5])


def test_where_the_search_begins_changes_nothing(ball):
    # right over the middle of a sample's neighbours some are equally near
    points = np.concatenate([ball.samples_m[:40], [[0.0, 0.0, 0.04]], ball.samples_m[:40] * 1.3])
    found = []
    for start in (0, len(ball.samples_m) - 1, len(ball.samples_m) // 2):
        ball.last[0] = start
        found.append(np.concatenate([ball.nearest(points[i : i + 1]) for i in range(len(points))]))
    np.testing.assert_array_equal(found[0], found[1])
    np.testing.assert_array_equal(found[0], found[2])


def test_curvatures_are_those_of_the_body(ball, ring):
    rng = np.random.default_rng(2)
    for point in ball.samples_m[rng.choice(len(ball.samples_m), 60)]:
        np.testing.assert_allclose(ball.principal_curvatures(point), -1 / 0.03, rtol=0.06)
    for point in ring.samples_m[rng.choice(len(ring.samples_m), 60)]:
        across = np.hypot(*point[:2])
        along = -(across - 0.04) / 0.015 / across
        k1, k2 = ring.principal_curvatures(point)
        np.testing.assert_allclose(k1, along, atol=2)
        np.testing.assert_allclose(k2, -1 / 0.015, rtol=0.06)


def test_the_top_of_a_ball_is_above_its_middle(ball):
    np.testing.assert_allclose(ball.above(1e-4, 2e-4), [0.0, 0.0, 0.03], atol=3e-4)
    assert ball.above(0.031, 0.0) is None


def test_sites_are_of_the_wanted_kind_apart_and_the_same_again(ring):
    for primitive in ("E-", "H"):
        (site,) = auto_sites(ring, 1, seed=5, primitive=primitive, procedure=QUICK)
        k1, k2 = ring.principal_curvatures(np.array(site))
        assert primitive_of(k1, k2, 0.01) == primitive
    sites = auto_sites(ring, 2, seed=5, procedure=QUICK)
    assert sites == auto_sites(ring, 2, seed=5, procedure=QUICK)
    assert sites != auto_sites(ring, 2, seed=6, procedure=QUICK)
    first, second = np.array(sites)
    assert np.linalg.norm(first - second) >= 0.02
    with pytest.raises(UsageError, match="sites of kind E\\+ found on mesh"):
        auto_sites(ring, 1, primitive="E+")


@pytest.mark.parametrize("control", ["force", "pose"])
def test_the_finger_stays_on_the_body_and_out_of_it(ring, control):
    sites = auto_sites(ring, 2, seed=3, procedure=QUICK)
    made = simulate(ring, sites=sites, procedure=QUICK, rate_hz=200, control=control)
    touch, roll = made.scene.touch, made.truth.roll
    assert made.scene.image is None
    height = ring.distance(touch.position_m)
    for number in range(4):
        rolling = np.flatnonzero(roll == number)[8:]
        assert (np.abs(height[rolling] - 0.01 + 1.5e-4) < 5e-5).all()
        assert (touch.pressure_pa[rolling].max(axis=1) > 1e5).all()
        nearest = np.linalg.norm(ring.nearest(touch.position_m[rolling])[0] - sites[number // 2], axis=1)
        assert nearest.min() < 1e-3
    assert height[roll < 0].min() > 0.0095


def test_files_are_read_and_bad_ones_named(tmp_path):
    mesh = trimesh.creation.icosphere(2, 0.03)
    for ending in ("stl", "obj", "ply"):
        mesh.export(tmp_path / f"ball.{ending}")
        assert load_mesh(tmp_path / f"ball.{ending}").label == "ball"
    mesh.apply_scale(1000)
    mesh.export(tmp_path / "mm.stl")
    with pytest.raises(UsageError, match="were they millimetres"):
        load_mesh(tmp_path / "mm.stl")
    mesh = trimesh.creation.icosphere(2, 0.03)
    with pytest.raises(UsageError, match="not watertight"):
        load_mesh((mesh.vertices, mesh.faces[1:]))
    (tmp_path / "text.stl").write_text("no mesh")
    with pytest.raises(UsageError, match=r"text\.stl"):
        load_mesh(tmp_path / "text.stl")
    with pytest.raises(UsageError, match="no such mesh"):
        load_mesh(tmp_path / "none.stl")
