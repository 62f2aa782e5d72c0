"""Outlines of which a part is hidden: what is seen of them is what counts."""

from itertools import combinations

import cv2
import numpy as np
import pytest

from evifuse.vision import sense_shapes
from evifuse.vision.closing import closed_across_the_gap, closed_by_itself
from evifuse.vision.geometry import intersection, resample
from evifuse.vision.link import link_chains, outer_points
from evifuse.vision.primitives import Fits, outlines_of
from evifuse.vision.sections import CELLS, Sections, straight_sections
from evifuse.vision.strokes import accounted_for, strokes_of

RECTANGLE = np.array([[20.0, 20.0], [140.0, 20.0], [140.0, 80.0], [20.0, 80.0]])
TRIANGLE = np.array([[10.0, 90.0], [150.0, 100.0], [60.0, 10.0]])


def of_lines(*ends: tuple[tuple[float, float], tuple[float, float]]) -> Sections:
    """Sections along given lines."""
    starts, stops = np.moveaxis(np.array(ends, np.float64), 1, 0)
    along = stops - starts
    directions = along / np.linalg.norm(along, axis=1, keepdims=True)
    return Sections(*(a[None] for a in (starts, stops, (starts + stops) / 2, directions)), np.zeros(1))


def corners_of(polygon: np.ndarray) -> set[tuple[float, float]]:
    return {tuple(c) for c in polygon[0].round(6).tolist()}


@pytest.mark.parametrize("seed", range(4))
def test_sections_are_the_best_of_all_divisions(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.normal(0, 1, (1, 64, 2)), axis=1)
    price = np.array([0.3])

    def stray(first: int, last: int) -> float:
        mine = points[0, 2 * first : 2 * last]
        return float(np.linalg.svd(mine - mine.mean(axis=0))[1][1] ** 2)

    line = {(a, b): stray(a, b) for a in range(CELLS) for b in range(a + 2, CELLS + 1)}
    one = min(line[a, b] + 0.6 * (CELLS - b + a) for a, b in line)
    two = min(
        line[a, b] + line[c, d] + 0.6 * (CELLS - b + a - d + c)
        for a, b, c, d in (q for q in combinations(range(CELLS + 1), 4))
        if b - a > 1 and d - c > 1
    )
    for a, b, d in combinations(range(CELLS + 1), 3):  # neighbours that share a bound
        if b - a > 1 and d - b > 1:
            two = min(two, line[a, b] + line[b, d] + 0.6 * (CELLS - d + a))
    found = straight_sections(points, price, 2)
    assert found[1].cost[0] == pytest.approx(one, abs=1e-9)
    assert found[2].cost[0] == pytest.approx(two, abs=1e-9)


def test_sides_are_prolonged_until_they_meet() -> None:
    cut = of_lines(((30, 20), (130, 20)), ((140, 30), (140, 70)), ((130, 80), (30, 80)), ((20, 70), (20, 30)))
    assert corners_of(closed_by_itself(cut, np.array([360.0]))) == {tuple(c) for c in RECTANGLE.tolist()}


def test_sides_meet_where_the_lines_cross() -> None:
    rng = np.random.default_rng(0)
    ends = TRIANGLE[[0, 1, 1, 2, 2, 0]].reshape(3, 2, 2) + rng.normal(0, 3, (50, 3, 2, 2))
    for of in ends:
        sections = of_lines(*((tuple(a), tuple(b)) for a, b in of.tolist()))
        before = np.roll(np.arange(3), 1)
        centres, directions = sections.centres[0], sections.directions[0]
        expected = intersection(centres[before], directions[before], centres, directions)
        np.testing.assert_allclose(closed_by_itself(sections, np.array([420.0]))[0], expected, atol=1e-9)


def test_a_hidden_side_is_closed_virtually_as_long_as_the_longer_neighbour() -> None:
    three = of_lines(((60, 20), (140, 20)), ((140, 20), (140, 80)), ((140, 80), (20, 80)))
    assert corners_of(closed_across_the_gap(three, np.array([360.0]))) == {
        tuple(c) for c in RECTANGLE.tolist()
    }
    two = of_lines(((10, 90), (60, 10)), ((60, 10), (150, 100)))
    assert corners_of(closed_across_the_gap(two, np.array([360.0]))) == {(10, 90), (60, 10), (150, 100)}


def test_nothing_is_closed_where_nothing_is_hidden() -> None:
    met = of_lines(((20, 20), (140, 20)), ((140, 20), (140, 80)), ((140, 80), (20, 21)))
    assert np.isnan(closed_across_the_gap(met, np.array([360.0]))).all()


def test_gaps_are_no_evidence() -> None:
    points = resample(RECTANGLE, 360)
    outline = outlines_of([link_chains((points[:100], points[200:]), False)])
    apart = np.linalg.norm(outline.points[0][:, None] - points[110:190], axis=-1).min()
    assert apart > 5
    steps = np.linalg.norm(np.diff(outline.points[0], axis=0), axis=1)
    assert np.sort(steps)[:-1].max() < 5
    farthest = np.linalg.norm(RECTANGLE - outline.points[0][0], axis=1).min()
    assert farthest < 3


@pytest.mark.parametrize("hidden", [(40, 130), (100, 190), (200, 290), (300, 359)])
def test_a_part_that_is_hidden_does_not_change_what_is_fitted(hidden: tuple[int, int]) -> None:
    turn = np.linspace(0, 2 * np.pi, 361)[:-1]
    ellipse = np.column_stack([80 + 60 * np.cos(turn), 60 + 35 * np.sin(turn)])
    outlines = [
        np.roll(p, -hidden[1], axis=0) for p in (resample(RECTANGLE, 360), resample(TRIANGLE, 360), ellipse)
    ]
    left = 360 - hidden[1] + hidden[0]
    fits = Fits(outlines_of([link_chains((p[:left],), False) for p in outlines]))
    odds = np.array(
        [
            np.nan_to_num(f.odds) + np.log(f.match.trust + 1e-9)
            for f in (fits.quadrilateral, fits.triangle, fits.ellipse)
        ]
    )
    assert odds.argmax(axis=0).tolist() == [0, 1, 2]


def test_what_is_seen_from_outside_is_seen_evenly_on_a_narrow_outline() -> None:
    t = np.linspace(0, 2 * np.pi, 2000)
    outer = np.column_stack([200 * np.cos(t), 20 * np.sin(t)])
    found = outer_points(np.concatenate([outer, 0.8 * outer]))
    assert np.abs(np.hypot(found[:, 0] / 200, found[:, 1] / 20) - 1).max() < 0.02
    turned = np.unwrap(np.arctan2(found[:, 1], found[:, 0]))
    assert (np.diff(turned) > 0).all()


def test_strokes_beside_the_shape_are_not_accounted_for() -> None:
    ring = np.concatenate([resample(RECTANGLE, 360).round(), RECTANGLE[:1]])
    beside = np.column_stack([np.arange(150.0, 270.0), np.full(120, 50.0)])
    outlines = outlines_of([link_chains((ring,), True)])
    alone = strokes_of([ring], outlines)
    both = strokes_of([ring, beside], outlines)
    polygon = RECTANGLE[None]
    assert accounted_for(alone, polygon, outlines.tolerance)[0] == 1
    assert accounted_for(both, polygon, outlines.tolerance)[0] == pytest.approx(0.75, abs=0.1)
    assert accounted_for(np.full((1, 96, 2), np.nan), polygon, outlines.tolerance)[0] == 1


@pytest.mark.parametrize("start", [0.0, 1.1, 2.6, 4.0])
@pytest.mark.parametrize("kind", ["rectangular", "triangular", "elliptical"])
def test_a_quarter_turn_may_be_hidden(kind: str, start: float) -> None:
    image = np.full((240, 320), 220, np.uint8)
    if kind == "elliptical":
        cv2.ellipse(image, (160, 120), (80, 60), 20, 0, 360, 60, 6, cv2.LINE_AA)
    else:
        corners = (
            [(80, 60), (240, 70), (235, 175), (85, 170)]
            if kind == "rectangular"
            else [(160, 30), (240, 180), (75, 175)]
        )
        cv2.polylines(image, [np.array(corners, np.int32)], True, 60, 6, cv2.LINE_AA)
    y, x = np.mgrid[:240, :320]
    image[(np.arctan2(y - 120, x - 160) - start) % (2 * np.pi) < np.pi / 2] = 220
    assert sense_shapes(image)[0].classification.decision == kind


@pytest.mark.parametrize("sigma", [20.0, 60.0])
def test_strong_noise_is_smoothed_away_without_false_objects(sigma: float) -> None:
    rng = np.random.default_rng(8)
    assert sense_shapes(np.clip(rng.normal(128, sigma, (200, 300)), 0, 255).astype(np.uint8)) == ()
    sign = np.full((90, 90, 3), 90, np.uint8)
    cv2.fillPoly(sign, [np.array([[45, 15], [78, 72], [12, 72]], np.int32)], (220, 230, 225), cv2.LINE_AA)
    noisy = np.clip(sign + rng.normal(0, 0.7 * sigma, sign.shape), 0, 255).astype(np.uint8)
    assert sense_shapes(noisy)[0].classification.decision == "triangular"
