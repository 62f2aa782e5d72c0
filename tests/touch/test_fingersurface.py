"""Surfaces through layouts, against the sphere, the ellipsoid and the pad that they were laid on."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evifuse.recordings.recording import Fingertip
from evifuse.touch.blended import layout_normals
from evifuse.touch.fingersurface import SphereSurface, surface_of
from evifuse.touch.fingertip import spherical_fingertip
from evifuse.touch.quadrics import estimated_normals, tangent_axes


def ellipsoid(axes_m, pitch_m, cap_rad=1.3):
    """Taxels on an ellipsoid: places and true normals."""
    axes = np.array(axes_m)
    directions = spherical_fingertip(1.0, pitch_m / np.prod(axes) ** (1 / 3), cap_rad).normals
    normals = directions / axes
    return directions * axes, normals / np.linalg.norm(normals, axis=1, keepdims=True)


def ellipsoid_curvatures(points, axes_m):
    hessian = np.diag(1 / np.array(axes_m) ** 2)
    gradient = points @ hessian
    size = np.linalg.norm(gradient, axis=1, keepdims=True)
    along = tangent_axes(gradient / size)
    operators = np.einsum("nia,ij,njb->nab", along, hessian, along) / size[..., None]
    return np.linalg.eigvalsh(operators)


def angles_deg(a, b):
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.sum(a * b, axis=1)))


def rounded_pad(half_m=0.006, rim_m=0.004, pitch_m=0.0015):
    """A flat square pad, facing down, whose rim is a quarter of a circle: places and true normals."""
    steps = np.arange(-7, 8) * pitch_m
    x, y = (values.ravel() for values in np.meshgrid(steps, steps))
    core = np.stack([np.clip(x, -half_m, half_m), np.clip(y, -half_m, half_m)], axis=1)
    arc = np.stack([x, y], axis=1) - core
    length = np.linalg.norm(arc, axis=1)
    angle = np.minimum(length / rim_m, np.pi / 2)
    side = arc / np.maximum(length, 1e-12)[:, None] * np.sin(angle)[:, None]
    normals = np.column_stack([side, -np.cos(angle)])
    return np.column_stack([core, np.zeros(len(x))]) + rim_m * normals, normals


@settings(max_examples=20, deadline=None)
@given(radius=st.floats(0.004, 0.04), shift=st.sampled_from([0.0, 0.5, -3.0]), seed=st.integers(0, 1000))
def test_a_layout_on_a_sphere_is_that_sphere_wherever_it_is(radius, shift, seed):
    tip = spherical_fingertip(radius, 0.25 * radius, 1.0)
    centre = shift * radius * np.random.default_rng(seed).standard_normal(3)
    surface = surface_of(Fingertip(radius, tip.positions_m + centre, tip.normals))
    assert isinstance(surface, SphereSurface)
    points = centre + 1.3 * radius * tip.normals
    nearest, normals = surface.project(points)
    assert np.allclose(normals, tip.normals)
    assert np.allclose(nearest, tip.positions_m + centre)
    assert np.allclose(surface.distance(points), 0.3 * radius)
    operators, axes = surface.shape_operators(nearest)
    assert np.allclose(operators, np.eye(2) / radius)
    assert np.allclose(np.cross(axes[:, :, 0], axes[:, :, 1]), normals)


def test_the_middle_of_a_patch_on_a_sphere_is_where_it_points():
    tip = spherical_fingertip(0.01, 0.0007, 0.6)
    target = np.array([0.15, -0.1, -1.0]) / np.linalg.norm([0.15, -0.1, -1.0])
    weights = np.square(np.maximum(tip.normals @ target - np.cos(0.2), 0.0))[None]
    point, normal = surface_of(tip).contact(weights)
    assert angles_deg(normal, target[None])[0] < 0.2
    assert np.allclose(point, 0.01 * normal)


@pytest.mark.parametrize("known", [True, False], ids=["normals given", "normals estimated"])
@pytest.mark.parametrize(("pitch", "slack"), [(0.003, 1.0), (0.0015, 0.25)])
def test_an_ellipsoid_is_found_through_its_taxels(pitch, slack, known):
    axes = (0.008, 0.016, 0.010)
    positions, normals = ellipsoid(axes, pitch)
    surface = surface_of(Fingertip(0.01, positions, normals if known else layout_normals(positions)))
    true, facing = ellipsoid(axes, 0.0011, 0.9)
    nearest, found = surface.project(true + 0.0003 * facing)
    assert np.linalg.norm(nearest - true, axis=1).max() < slack * 20e-6
    assert angles_deg(found, facing).max() < slack * 0.8
    operators, _ = surface.shape_operators(nearest)
    expected = ellipsoid_curvatures(true, axes)
    error = np.abs(np.linalg.eigvalsh(operators) - expected).max(axis=1) / expected[:, 1]
    assert np.median(error) < slack * 0.02
    assert error.max() < slack * 0.08


def test_estimated_normals_are_those_of_the_ellipsoid():
    positions, normals = ellipsoid((0.008, 0.016, 0.010), 0.0015)
    moved = positions + np.array([0.1, 0.2, 0.3])
    first, better = (angles_deg(found(moved), normals) for found in (estimated_normals, layout_normals))
    assert np.median(first) < 0.6
    assert first.max() < 3.0
    assert np.median(better) < 0.03
    assert better.max() < 0.4


def test_a_flat_pad_with_a_round_rim_is_flat_in_the_middle_and_round_at_the_rim():
    positions, normals = rounded_pad()
    surface = surface_of(Fingertip(0.1, positions, normals))
    middle, rim = (
        np.array([[0.001, 0.002, -0.004]]),
        np.array([[0.006 + 0.004 * np.sin(0.5), 0.0, -0.004 * np.cos(0.5)]]),
    )
    for point, facing, expected, tolerance in (
        (middle, [0.0, 0.0, -1.0], (0.0, 0.0), 2.0),
        (rim, [np.sin(0.5), 0.0, -np.cos(0.5)], (0.0, 250.0), 45.0),
    ):
        nearest, found = surface.project(point)
        assert np.linalg.norm(nearest - point) < 0.0001
        assert angles_deg(found, np.array([facing]))[0] < 1.5
        curvatures = np.linalg.eigvalsh(surface.shape_operators(nearest)[0][0])
        assert np.allclose(curvatures, expected, atol=tolerance)


@settings(max_examples=15, deadline=None)
@given(off=st.floats(-0.002, 0.004), pick=st.integers(0, 59))
def test_nearest_points_are_on_the_surface_and_straight_below(off, pick):
    positions, normals = ellipsoid((0.008, 0.016, 0.010), 0.003)
    surface = surface_of(Fingertip(0.01, positions, normals))
    points = (positions + off * normals)[pick : pick + 1]
    nearest, facing = surface.project(points)
    again, _ = surface.project(nearest)
    assert np.allclose(again, nearest, atol=2e-7)
    aside = np.cross(points - nearest, facing)
    assert np.linalg.norm(aside) < 0.03 * abs(off) + 1e-7
    assert surface.distance(points)[0] == pytest.approx(
        np.linalg.norm(points - nearest) * np.sign(off), abs=1e-6
    )


def test_no_points_give_no_points():
    positions, normals = ellipsoid((0.008, 0.016, 0.010), 0.003)
    surface = surface_of(Fingertip(0.01, positions, normals))
    assert surface.project(np.zeros((0, 3)))[0].shape == (0, 3)
    assert surface.shape_operators(np.zeros((0, 3)))[0].shape == (0, 2, 2)
    assert surface.distance(np.zeros((0, 3))).shape == (0,)
