"""The compiled fits give what NumPy gives."""

from statistics import NormalDist

import numpy as np
import pytest

from evifuse.touch import _kernels_arcs as arcs
from evifuse.touch import _kernels_blend as blends
from evifuse.touch import _kernels_contact as contact
from evifuse.touch import _kernels_fit as fits
from evifuse.touch import _kernels_patch as patch
from evifuse.touch import _kernels_primitives as primitives
from evifuse.touch import _kernels_rolls as rolls
from evifuse.touch.blended import blended_surface
from tests.touch import twins_fits as twins

LIMITS = (1.3e-4, 1e-4, 2.0, 1000.0, 2.0)


def over_a_ridge(draw, rounding_m, turn_rad, noise_m):
    """Centre (M, 3) and normal (M, 3) of a finger of 10 mm on rolls over a rounded ridge along y."""
    found = []
    for heading in (0.1, 1.3):
        angle = np.clip(np.linspace(-1.5, 1.5, 240), -0.5, 0.5) * turn_rad
        beyond = np.linspace(-0.01, 0.01, 240) - np.clip(np.linspace(-0.01, 0.01, 240), -0.003, 0.003)
        x = (0.01 + rounding_m) * np.sin(angle) + beyond * np.cos(angle)
        z = (0.01 + rounding_m) * np.cos(angle) - beyond * np.sin(angle)
        centre = np.stack([x, x / np.tan(heading), z], axis=1) + draw.normal(0, noise_m, (240, 3))
        normal = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1) + draw.normal(0, 0.003, (240, 3))
        found.append((centre, normal / np.linalg.norm(normal, axis=1, keepdims=True)))
    return found


@pytest.mark.parametrize("directions", [1, 2])
@pytest.mark.parametrize(("rounding_m", "noise_m"), [(0.0, 1e-6), (5e-4, 3e-5), (3e-3, 1e-5)])
def test_roundings_are_those_of_numpy(rounding_m, noise_m, directions):
    draw = np.random.default_rng(7)
    ways = over_a_ridge(draw, rounding_m, 1.2, noise_m)[:directions]
    frame, origin = np.linalg.qr(draw.normal(0, 1, (3, 3)))[0], draw.normal(0, 0.1, 3)
    limits = (2.5e-6, 0.03, 0.03, 1.5, 0.1)
    expected = twins.site_roundings(*zip(*ways, strict=True), 0.01, 0.25, 32, 5, 0.2, limits)
    position = np.concatenate([centre for centre, _ in ways]) @ frame.T + origin
    normal = np.concatenate([normal for _, normal in ways]) @ frame.T
    starts = np.arange(directions + 1) * 240
    found = arcs.site_roundings(
        position, normal, np.arange(len(position)), starts, origin, frame, 0.01, 0.25, 32, 5, 0.2, limits
    )
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-10)
    assert expected[:, 1, 3].any()


def test_a_finger_that_turns_in_its_place_is_found_as_by_numpy():
    angle = np.linspace(-0.6, 0.6, 200)
    normal = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    place = np.random.default_rng(1).normal(0, 1e-6, (200, 3))
    limits = (2.5e-6, 0.03, 0.03, 1.5, 0.1)
    expected = twins.site_roundings([place], [normal], 0.01, 0.25, 32, 5, 0.2, limits)
    found = arcs.site_roundings(
        place,
        normal,
        np.arange(200),
        np.array([0, 200]),
        np.zeros(3),
        np.eye(3),
        0.01,
        0.25,
        32,
        5,
        0.2,
        limits,
    )
    assert expected[0, 0, 3] == 1
    assert found[:, 0] == pytest.approx(expected[:, 0], rel=1e-9)


@pytest.mark.parametrize("noise", [1e-7, 1e-5])
@pytest.mark.parametrize("k", [(0.0, 0.0, 0.0), (-30.0, 5.0, 12.0), (-60.0, 0.0, -60.0)])
def test_a_fit_is_that_of_numpy(k, noise):
    draw = np.random.default_rng(5)
    way = np.repeat([0.1, 1.2, 2.2], 20)
    along = np.tile(np.linspace(-0.004, 0.004, 20), 3)
    (xx, xy, yy), (x, y) = k, (along * np.cos(way), along * np.sin(way))
    normal = np.stack([-(xx * x + xy * y), -(xy * x + yy * y), np.ones(60)], axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    height = 0.5 * (xx * x * x + 2 * xy * x * y + yy * y * y)
    centre = np.stack([x, y, height], axis=1) + 0.01 * normal + draw.normal(0, noise, (60, 3))
    normal += draw.normal(0, 100 * noise, (60, 3))
    weight, label = draw.uniform(0.3, 1, 60), np.repeat(np.arange(3), 20)
    radius, tilt = np.full(60, 0.01), normal - np.array([0.0, -0.1, 0.9])
    start = None
    for iterations in (10, 2):  # the second one goes on from the first
        expected = twins.fit(
            centre, normal, radius, tilt, weight, label, (1e-3, 2e-4), iterations, start, LIMITS
        )
        theta, error = (np.zeros(16), np.zeros(2)) if start is None else start
        found = fits.fit(
            centre, normal, radius, tilt, weight, label, 1e-3, 2e-4, iterations, start is not None, theta,
            error, LIMITS,
        )  # fmt: skip
        for fast, slow in zip(found, expected, strict=True):
            assert fast == pytest.approx(slow, rel=1e-6, abs=1e-8 * np.abs(slow).max())
        start = (expected[0], expected[2])


def test_scatter_is_that_of_numpy():
    draw = np.random.default_rng(9)
    left, label = draw.normal(0, 1, (40, 3)).cumsum(axis=0), np.repeat(np.arange(4), 10)
    weight, whole = draw.uniform(0.2, 1, (40, 2)), draw.uniform(0.5, 1, 40)
    given = (left, np.array([3.0, 8.0]), weight, whole, label, 1.2)
    for fast, slow in zip(patch.scatter(*given), twins.scatter(*given), strict=True):
        assert fast == pytest.approx(slow)


def test_rings_are_those_of_numpy():
    draw = np.random.default_rng(3)
    positions, places, pressure = (
        draw.normal(0, 1, (30, 3)),
        draw.normal(0, 0.3, (7, 3)),
        draw.uniform(0, 9, (7, 30)),
    )
    found = contact.rings(positions, places, pressure, 12, 2.5)
    for fast, slow in zip(found, twins.rings(positions, places, pressure, 12, 2.5), strict=True):
        assert fast == pytest.approx(np.array(slow))


@pytest.mark.parametrize("bend", [0.0, 0.4, -0.4])
def test_ways_without_contact_are_held_against_the_arc_of_numpy(bend):
    draw = np.random.default_rng(11)
    x = np.linspace(0, 0.004, 41)
    position = np.stack([x, 0.1 * x, 3e-5 * np.sin(900 * x)], axis=1) + draw.normal(0, 1e-6, (41, 3))
    angle = bend * np.linspace(-1, 1, 41)
    normal = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    touching = np.ones(41, bool)
    touching[[3, 38, *range(12, 30)]] = False
    before, after = (normal[rows][touching[rows]].mean(axis=0) for rows in (slice(3, 12), slice(30, 39)))
    expected = twins.off_the_arc(position[11:31], before, after, 0.9)
    assert rolls.off_the_arc(position, normal, touching, 11, 30, 8, 0.9) == pytest.approx(expected)
    position[30] = position[11]  # it comes back to where it was
    apart = np.sort(np.linalg.norm(position[11:31] - position[11], axis=1))[17]
    assert rolls.off_the_arc(position, normal, touching, 11, 30, 8, 0.9) == pytest.approx(apart)


def test_a_blend_is_that_of_numpy():
    draw = np.random.default_rng(13)
    u, v = (grid.ravel() for grid in np.meshgrid(np.linspace(-8, 8, 7), np.linspace(-5, 5, 5)))
    positions = 1e-3 * np.stack([u, v, -0.03 * u * u - 0.05 * v * v], axis=1)
    normals = np.stack([0.06 * u, 0.1 * v, np.ones(35)], axis=1)
    surface = blended_surface(positions, normals / np.linalg.norm(normals, axis=1, keepdims=True))
    points = positions[draw.integers(0, 35, 200)] + draw.normal(0, 5e-4, (200, 3))
    table, weight = surface._table, np.empty(35)
    found = np.array([blends.blend(*point, table, surface.width_m, weight) for point in points])
    value, gradient = twins.blend(points, surface)
    assert found[:, 0] == pytest.approx(value, rel=1e-9, abs=1e-14)
    assert found[:, 1:] == pytest.approx(gradient, rel=1e-8, abs=1e-9)
    nearest, facing = surface.project(points)
    value, gradient = twins.blend(nearest, surface)
    assert np.abs(value).max() < 1e-9
    assert facing == pytest.approx(gradient / np.linalg.norm(gradient, axis=1, keepdims=True), abs=1e-8)
    aside = np.cross(points - nearest, facing)
    assert np.linalg.norm(aside, axis=1).max() < 1e-8
    order = draw.permutation(200)  # what was looked at before doesn't matter
    assert surface.project(points[order])[0] == pytest.approx(nearest[order], abs=1e-9)


def test_probabilities_of_primitives_are_numpys():
    draw, below = np.random.default_rng(17), np.vectorize(NormalDist().cdf)
    for _ in range(5):
        nodes, axes = draw.normal(0, 1, (50, 2)), np.linalg.qr(draw.normal(0, 1, (2, 2)))[0]
        given = (nodes, draw.uniform(0.1, 5, 2), axes, draw.normal(0, 1, 2), draw.normal(0, 8, 3), 1.5, 5.0)
        found = primitives.primitive_shares(*given)
        assert found == pytest.approx(twins.primitive_shares(*given, below), abs=1e-6)
        assert sum(found) == pytest.approx(1)
