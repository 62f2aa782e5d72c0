"""What is fitted to all outlines by compiled loops, against plain fits of one outline."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evifuse.vision.closing import closed_by_itself
from evifuse.vision.geometry import distances_to_polygon, length_before, resample
from evifuse.vision.link import link_chains
from evifuse.vision.primitives import Fits, outlines_of
from evifuse.vision.primitives.agreement import agreement
from evifuse.vision.sections import straight_sections
from tests.vision.oracles import plain_fits as plain

SEEDS = st.integers(0, 10_000)


def blob(rng: np.random.Generator, count: int = 200) -> np.ndarray:
    """A closed wavy outline, now of whole pixels, now not."""
    t = np.linspace(0, 2 * np.pi, count)
    radius = 40 + rng.uniform(0, 8) * np.cos(rng.integers(2, 6) * t + rng.uniform(0, 6))
    points = np.column_stack([100 + rng.uniform(0.5, 1.5) * radius * np.cos(t), 90 + radius * np.sin(t)])
    return points.round() if rng.random() < 0.5 else points


@settings(max_examples=30, deadline=None)
@given(SEEDS)
def test_outlines_are_prepared_as_one_by_one(seed: int) -> None:
    rng = np.random.default_rng(seed)
    several = []
    for _ in range(3):
        points = blob(rng)
        cuts = np.sort(rng.integers(10, len(points) - 10, 2))
        several.append([c for c in np.split(points, cuts) if len(c) > 1])
    outlines = outlines_of([link_chains(tuple(c), False) for c in several])
    for i, chains in enumerate(several):
        points, around, inside, extent = plain.prepared(chains)
        assert outlines.around[i] == pytest.approx(around)
        assert outlines.inside[i] == pytest.approx(inside)
        assert outlines.extent[i] == pytest.approx(extent)
        away = np.abs(outlines.points[i] - points).max(axis=1)
        assert (away < 1e-6).mean() > 0.95  # a step may begin at either end of a gap


@settings(max_examples=30, deadline=None)
@given(SEEDS, st.integers(1, 8))
def test_lines_of_sections_are_those_of_singular_values(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    points = resample(blob(rng)[None, :-1], 64) + rng.normal(0, 0.5, (1, 64, 2))
    division = straight_sections(points, np.array([rng.uniform(1, 30)]), 8)
    found = division[count]
    for k, (low, high) in enumerate(division.bounds[0, count - 1, :count]):
        first, last = plain.section(points[0, low:high])
        np.testing.assert_allclose([found.starts[0, k], found.ends[0, k]], [first, last], atol=1e-8)
        way = found.directions[0, k]
        np.testing.assert_allclose(np.linalg.norm(way), 1)
        assert (last - first) @ way >= 0
    some = division.of(np.array([0]), count)
    np.testing.assert_array_equal(some.starts, found.starts)


@settings(max_examples=30, deadline=None)
@given(SEEDS, st.integers(3, 8))
def test_sections_meet_where_their_lines_do(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    points = resample(blob(rng)[None, :-1], 64)
    found = straight_sections(points, np.array([4.0]), 8)[count]
    polygon = closed_by_itself(found, np.array([250.0]))[0]
    expected = plain.meeting(list(zip(found.centres[0], found.directions[0], strict=True)))
    if np.isnan(polygon).any():
        side = np.roll(expected, -1, axis=0) - expected
        before = np.roll(side, 1, axis=0)
        turn = before[:, 0] * side[:, 1] - before[:, 1] * side[:, 0]
        convex = (turn > 0).all() or (turn < 0).all()
        assert not convex or np.abs(expected - expected[0]).max() > 4 * 250
    else:
        np.testing.assert_allclose(polygon, expected, atol=1e-7)


@settings(max_examples=40, deadline=None)
@given(SEEDS)
def test_ellipses_solve_the_published_equations(seed: int) -> None:
    rng = np.random.default_rng(seed)
    outlines = outlines_of([link_chains((blob(rng)[: rng.integers(120, 200)],), False)])
    points = outlines.points[0]
    ellipse = Fits(outlines).ellipse
    scale = points.std()
    x, y = (ellipse.shape[0] - points.mean(axis=0)).T / scale
    conics = [plain.direct_ellipse((p - points.mean(axis=0)) / scale) for p in (points, _nearest(points))]
    off = [
        np.abs(np.column_stack([x * x, x * y, y * y, x, y, np.ones_like(x)]) @ conic).max()
        for conic in conics
    ]
    assert min(off) < 1e-6


def _nearest(points: np.ndarray) -> np.ndarray:
    """The 54 points that lie nearest to the ellipse through all of them, to first order."""
    centre, scale = points.mean(axis=0), points.std()
    x, y = (points - centre).T / scale
    a, b, c, d, e, f = plain.direct_ellipse((points - centre) / scale)
    middle = np.linalg.solve([[2 * a, b], [b, 2 * c]], [-d, -e])
    u, v = x - middle[0], y - middle[1]
    level = a * middle[0] ** 2 + b * middle[0] * middle[1] + c * middle[1] ** 2 - f
    gauge = np.sqrt((a * u * u + b * u * v + c * v * v) / level)
    slope = np.hypot(a * u + b * v / 2, b * u / 2 + c * v) / abs(level) / gauge
    return points[np.argsort(np.abs(gauge - 1) / slope)[:54]]


@settings(max_examples=30, deadline=None)
@given(SEEDS)
def test_a_true_ellipse_is_found_to_the_last_digits(seed: int) -> None:
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 2 * np.pi, 2000)
    long, share, turn = rng.uniform(30, 300), rng.uniform(0.1, 0.98), rng.uniform(-1.5, 1.5)
    own = np.column_stack([long * np.cos(t), share * long * np.sin(t)])
    c, s = np.cos(turn), np.sin(turn)
    outlines = outlines_of([link_chains((own @ [[c, s], [-s, c]] + (400, 300),), True)])
    on = np.linalg.norm(outlines.points[0][:, None] - (own @ [[c, s], [-s, c]] + (400, 300)), axis=2).min()
    assert on < 1.0
    found = Fits(outlines).ellipse
    np.testing.assert_allclose(found.axes[0], [2 * long, 2 * share * long], rtol=1e-4)
    np.testing.assert_allclose(found.centre[0], [400, 300], atol=1e-2)
    off = (found.angle_rad[0] - turn + np.pi / 2) % np.pi - np.pi / 2
    assert abs(off) * (1 - share) < 1e-3
    assert found.match.coverage[0] == 1
    assert found.tangency[0] > 0.98


@settings(max_examples=30, deadline=None)
@given(SEEDS)
def test_agreement_is_that_of_one_outline(seed: int) -> None:
    rng = np.random.default_rng(seed)
    outlines = outlines_of([link_chains((blob(rng),), False) for _ in range(4)])
    distance = rng.exponential(outlines.tolerance[:, None] * rng.uniform(0.2, 3), (4, 64))
    place = np.clip(rng.uniform(0, rng.uniform(0.3, 1.2), (4, 64)), 0, 1)
    distance[3] = np.nan
    found = agreement(outlines, distance, place)
    terms = np.stack([found.fit, found.explained, found.coverage, found.opening, found.deviation], axis=1)
    for i in range(3):
        np.testing.assert_allclose(terms[i], plain.agreed(distance[i], place[i], outlines.tolerance[i]))
    np.testing.assert_allclose(terms[3], [0, 0, 0, 1, 2.5 * outlines.tolerance[3]])


@settings(max_examples=30, deadline=None)
@given(SEEDS, st.integers(3, 48))
def test_lengths_before_places_on_polygons(seed: int, corners: int) -> None:
    rng = np.random.default_rng(seed)
    polygon = rng.uniform(0, 100, (2, corners, 2))
    along = rng.uniform(0, 1, (2, 9))
    around = np.concatenate([polygon, polygon[:, :1]], axis=1)
    until = np.concatenate(
        [np.zeros((2, 1)), np.cumsum(np.linalg.norm(np.diff(around, axis=1), axis=2), 1)], 1
    )
    position = np.stack(
        [np.interp(a * u[-1], u, np.arange(corners + 1)) for a, u in zip(along, until, strict=True)]
    )
    np.testing.assert_allclose(length_before(polygon, position), along, atol=1e-9)


def test_nothing_is_near_to_what_is_not_there() -> None:
    polygon = np.array([[[0.0, 0.0], [9.0, 0.0], [np.nan, np.nan]], [[0.0, 0.0], [9.0, 0.0], [0.0, 9.0]]])
    points = np.array([[[1.0, 1.0]], [[np.nan, 1.0]]])
    assert np.isnan(distances_to_polygon(points, polygon)[0]).all()
    assert distances_to_polygon(np.empty((0, 3, 2)), np.empty((0, 4, 2)))[0].shape == (0, 3)
