"""What is computed for all outlines at once, against the same for one, by formula or by brute force."""

from itertools import combinations, pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evifuse.vision import fit_edge
from evifuse.vision.fit import fit_edges
from evifuse.vision.geometry import distances_to_polygon, resample
from evifuse.vision.group import group_objects
from evifuse.vision.link import link_chains
from evifuse.vision.primitives import Fits, outlines_of
from evifuse.vision.sides import fit_sides

RECTANGLE = np.array([[20.0, 20.0], [140.0, 20.0], [140.0, 80.0], [20.0, 80.0]])
TRIANGLE = np.array([[10.0, 90.0], [150.0, 100.0], [60.0, 10.0]])


def ring(corners: np.ndarray, count: int = 300) -> np.ndarray:
    """Points along a closed polygon, back to the first."""
    points = resample(corners, count)
    return np.concatenate([points, points[:1]])


def ellipse(count: int = 200) -> np.ndarray:
    t = np.linspace(0, 2 * np.pi, count)
    turned = np.array([[np.cos(0.5), np.sin(0.5)], [-np.sin(0.5), np.cos(0.5)]])
    return np.column_stack([60 * np.cos(t), 35 * np.sin(t)]) @ turned + (80, 60)


def steps(start: tuple[float, float], *ways: tuple[int, int, int]) -> np.ndarray:
    """A chain of whole pixels: so many steps in each direction."""
    moves = [(dx, dy) for dx, dy, n in ways for _ in range(n)]
    return np.cumsum([start, *moves], axis=0).astype(np.float64)


@given(st.lists(st.integers(1, 6), min_size=1, max_size=5), st.integers(0, 999))
def test_edges_fitted_together_are_those_fitted_alone(counts: list[int], seed: int) -> None:
    rng = np.random.default_rng(seed)
    starts, ends = rng.normal(0, 30, (2, sum(counts), 2))
    first = np.cumsum([0, *counts])
    together = fit_edges(starts, ends, first[:-1])
    for i, (a, b) in enumerate(pairwise(first)):
        alone = fit_edge(starts[a:b], ends[a:b])
        assert together.beliefs[i] == pytest.approx(alone.belief, abs=1e-9)
        np.testing.assert_allclose(
            [together.starts[i], together.ends[i]], [alone.start, alone.end], atol=1e-6
        )


def test_sides_go_to_the_right_polygon_and_missing_ones_are_missing() -> None:
    three = RECTANGLE[:-1], RECTANGLE[1:]
    starts, ends = (
        np.concatenate([three[0], TRIANGLE]),
        np.concatenate([three[1], np.roll(TRIANGLE, -1, axis=0)]),
    )
    polygons = np.stack([RECTANGLE, np.vstack([TRIANGLE, TRIANGLE[2:]]), np.full((4, 2), np.nan)])
    sides = fit_sides(starts, ends, np.array([0, 0, 0, 1, 1, 1]), polygons)
    np.testing.assert_allclose(sides.beliefs[0], [1, 1, 1, np.nan])
    np.testing.assert_allclose(sides.beliefs[1, :2], 1)
    assert np.isnan(sides.beliefs[2]).all()
    assert [len(sides.listed(i)) for i in range(3)] == [3, 3, 0]
    np.testing.assert_allclose(sides.listed(0)[1].end, RECTANGLE[2], atol=1e-9)


@given(st.integers(0, 99), st.integers(3, 7))
def test_distances_against_many_points_of_the_polygon(seed: int, corners: int) -> None:
    rng = np.random.default_rng(seed)
    polygons, points = rng.uniform(0, 100, (2, corners, 2)), rng.uniform(-20, 120, (2, 9, 2))
    distance, position = distances_to_polygon(points, polygons)
    side = np.minimum(position.astype(int), corners - 1)
    for b in range(2):
        closed = np.concatenate([polygons[b], polygons[b, :1]])
        share = np.linspace(0, 1, 2001)[:, None]
        fine = np.stack([p + share * (q - p) for p, q in pairwise(closed)])
        brute = np.linalg.norm(fine[None] - points[b, :, None, None], axis=-1).min(axis=2)
        np.testing.assert_allclose(distance[b], brute.min(axis=1), atol=0.1)
        np.testing.assert_allclose(brute[np.arange(9), side[b]], brute.min(axis=1), atol=0.1)
        nearest = closed[side[b]] + (position[b] - side[b])[:, None] * np.diff(closed, axis=0)[side[b]]
        np.testing.assert_allclose(np.linalg.norm(points[b] - nearest, axis=1), distance[b], atol=1e-9)


def test_fitted_shapes_follow_their_outlines_and_only_theirs() -> None:
    chains = [ring(RECTANGLE), ring(TRIANGLE), ellipse()]
    fits = Fits(outlines_of([link_chains((c,), True) for c in chains]))
    assert all([fits.quadrilateral.found[0], fits.triangle.found[1], fits.ellipse.found[2]])
    trust = [fits.quadrilateral.match.trust, fits.triangle.match.trust, fits.ellipse.match.trust]
    odds = [
        np.exp(np.nan_to_num(f.odds)) * f.match.trust
        for f in (fits.quadrilateral, fits.triangle, fits.ellipse)
    ]
    assert np.argmax(odds, axis=0).tolist() == [0, 1, 2]
    assert np.diag(trust).min() > 0.95
    apart = np.abs(fits.quadrilateral.corners[0][:, None] - RECTANGLE).max(axis=2)
    assert apart.min(axis=1).max() < 1
    np.testing.assert_allclose(fits.ellipse.centre[2], (80, 60), atol=0.5)
    np.testing.assert_allclose(fits.ellipse.axes[2], (120, 70), atol=1)
    assert fits.ellipse.angle_rad[2] == pytest.approx(0.5, abs=0.02)
    alone = Fits(outlines_of([link_chains((chains[1],), True)]))
    np.testing.assert_allclose(alone.triangle.corners[0], fits.triangle.corners[1], atol=1e-6)


def test_half_an_ellipse_is_half_covered_and_open_in_one_piece() -> None:
    whole, half = ellipse(), ellipse()[:100]
    match = Fits(outlines_of([link_chains((whole,), True), link_chains((half,), False)])).ellipse.match
    assert match.coverage[0] == 1
    assert match.opening[0] == 0
    assert match.coverage[1] == pytest.approx(0.5, abs=0.12)
    assert match.opening[1] == pytest.approx(1 - match.coverage[1], abs=1e-9)


def test_one_outline_for_each_object() -> None:
    boxes = np.array([[0, 0, 100, 100], [10, 10, 90, 90], [300, 0, 340, 40], [0, 0, 20, 20]], np.float64)
    scores = np.array([0.5, 0.55, 0.3, 0.05])
    assert group_objects(boxes, scores, scores, np.array([2.0, 1.0, 3.0, 4.0]), 0.08)[0] == [2, 0]
    assert group_objects(boxes, scores, scores, np.array([1.0, 2.0, 0.5, 4.0]), 0.08)[0] == [0, 2]  # the rim
    doubted = np.array([0.1, 0.55, 0.3, 0.05])
    assert group_objects(boxes, doubted, doubted, np.array([1.0, 2.0, 0.5, 4.0]), 0.08)[0] == [1, 2]
    for order in combinations(range(4), 2):
        some = np.where(np.isin(np.arange(4), order), 0.5, 0.0)
        assert set(group_objects(boxes, some, some, scores, 0.08)[0]) <= set(order)
