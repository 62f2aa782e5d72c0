"""Corners, edges and ellipses are exact to a fraction of a pixel, and the stated uncertainty is right."""

from functools import cache

import cv2
import numpy as np
import pytest

from evifuse.vision import FittedEdge, Hypothesis, SeenObject, sense_shapes
from evifuse.vision.crossings import crossings
from evifuse.vision.exact import exact_hypotheses
from evifuse.vision.refine import exact_ellipses, exact_lines

SIZE = (180, 200)
FINE = 8
WITHIN_95 = (
    5.991  # squared distance, in standard deviations, that 95 % of normal errors in the plane stay within
)
RECTANGLE = np.array([[-47.0, -31.0], [47.0, -31.0], [47.0, 31.0], [-47.0, 31.0]])
TRIANGLE = np.array([[-50.0, 40.0], [-8.0, -42.0], [50.0, 40.0]])


def turned(corners: np.ndarray, turn: float, shift: np.ndarray) -> np.ndarray:
    c, s = np.cos(turn), np.sin(turn)
    return corners @ np.array([[c, s], [-s, c]]) + (100, 90) + shift


def rendered(inside: np.ndarray, blur_px: float = 0.6) -> np.ndarray:
    """Averaged down from eight times the size, without rounding."""
    fine = np.where(inside, np.float32(70), np.float32(180))
    image = fine.reshape(SIZE[0], FINE, SIZE[1], FINE).mean(axis=(1, 3))
    return cv2.GaussianBlur(image, (0, 0), blur_px)


def grid() -> tuple[np.ndarray, np.ndarray]:
    y, x = ((np.arange(n * FINE, dtype=np.float32) + 0.5) / FINE - 0.5 for n in SIZE)
    return x[None, :], y[:, None]


def polygon(corners: np.ndarray) -> np.ndarray:
    x, y = grid()
    inner = np.ones((SIZE[0] * FINE, SIZE[1] * FINE), np.bool_)
    for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        inner &= (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0) >= 0
    return rendered(inner)


def ellipse(centre: np.ndarray, half: np.ndarray, turn: float) -> np.ndarray:
    (x, y), c, s = grid(), np.float32(np.cos(turn)), np.float32(np.sin(turn))
    x, y = x - np.float32(centre[0]), y - np.float32(centre[1])
    return rendered(((c * x + s * y) / half[0]) ** 2 + ((c * y - s * x) / half[1]) ** 2 <= 1)


def noisy(image: np.ndarray, sigma: float, seed: int) -> np.ndarray:
    noise = np.random.default_rng(seed).normal(0, sigma, image.shape)
    return np.clip(np.round(image + noise), 0, 255).astype(np.uint8)


def corners_of(seen: SeenObject, kind: str, truth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Errors of the corners of a primitive, and their covariances, in the order of the truth."""
    geometry = next(h for h in seen.primitives if h.kind == kind).geometry
    corners, covariances = np.array(geometry["corners"]), np.array(geometry["corners_covariance_px2"])
    nearest = np.linalg.norm(truth[:, None] - corners, axis=2).argmin(axis=1)
    return corners[nearest] - truth, covariances[nearest]


@cache
def errors(sigma: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Errors of the corners of many rectangles and triangles, and their covariances."""
    off: list[np.ndarray] = []
    cov: list[np.ndarray] = []
    random = np.random.default_rng(1)
    for i in range(count):
        kind, form = (("rectangle", RECTANGLE), ("triangle", TRIANGLE))[i % 2]
        truth = turned(form, random.uniform(-np.pi, np.pi), random.uniform(-5, 5, 2))
        seen = sense_shapes(noisy(polygon(truth), sigma, i))
        assert seen, "nothing was seen"
        a, b = corners_of(seen[0], kind, truth)
        off.append(a)
        cov.append(b)
    return np.concatenate(off), np.concatenate(cov)


@pytest.mark.parametrize(("sigma", "median_px"), [(0, 0.05), (10, 0.15), (20, 0.3)])
def test_corners_are_exact(sigma: float, median_px: float) -> None:
    off, _ = errors(sigma, 20)
    assert np.median(np.linalg.norm(off, axis=1)) < median_px


def test_the_stated_uncertainty_of_corners_is_right() -> None:
    """Of the errors, about 95 % lie inside the ellipses of 95 %."""
    found = [errors(sigma, 20) for sigma in (10, 20)]
    off, cov = (np.concatenate(part) for part in zip(*found, strict=True))
    squared = (off[:, None] @ np.linalg.solve(cov, off[..., None]))[:, 0, 0]
    assert 0.90 <= np.mean(squared <= WITHIN_95) <= 0.985


@pytest.mark.parametrize(("sigma", "most_px"), [(0, 0.05), (10, 0.15)])
def test_ellipses_are_exact_and_know_their_uncertainty(sigma: float, most_px: float) -> None:
    random = np.random.default_rng(2)
    centres, axes, scores = [], [], []
    for i in range(12):
        centre, half = 95 + random.uniform(-5, 5, 2), np.sort(random.uniform(25, 60, 2))[::-1]
        seen = sense_shapes(noisy(ellipse(centre, half, random.uniform(0, 3)), sigma, i))
        found = next(h for h in seen[0].primitives if h.kind == "ellipse").geometry
        off = np.array(found["centre"]) - centre
        centres.append(np.linalg.norm(off))
        axes.append(np.abs(np.array(found["axes"]) - 2 * half))
        scores.append(off @ np.linalg.solve(np.array(found["centre_covariance_px2"]), off))
        scores.extend(2 * (axes[-1] / np.array(found["axes_std_px"])) ** 2)
    assert np.median(centres) < most_px
    assert np.median(axes) < 2 * most_px
    assert np.mean(np.array(scores) < 2 * WITHIN_95) > 0.9


def test_uncertainty_grows_with_the_noise() -> None:
    truth = turned(RECTANGLE, 0.2, np.zeros(2))
    spread = [
        np.median(
            np.trace(
                corners_of(sense_shapes(noisy(polygon(truth), s, 0))[0], "rectangle", truth)[1],
                axis1=1,
                axis2=2,
            )
        )
        for s in (0, 8, 20)
    ]
    assert spread[0] < spread[1] < spread[2]


def test_corners_beside_a_hidden_side_are_uncertain() -> None:
    """They lie on the side that is seen, but where along it is not known."""
    truth = turned(RECTANGLE, 0.3, np.zeros(2))
    rough = truth + np.array([[0.4, -0.3], [-0.5, 0.2], [0.3, 0.5], [-0.2, -0.4]])
    seen = tuple(FittedEdge(rough[i], rough[(i + 1) % 4], 0.8) for i in (0, 2, 3))
    found = Hypothesis("rectangle", 0.6, {"corners": rough.tolist()}, rough, deviation=0.5, edges=seen)
    placed = exact_hypotheses([(found,)], noisy(polygon(truth), 3, 0), 1.0)[0][0]
    assert len(placed.edges) == 3
    covariance = np.array(placed.geometry["corners_covariance_px2"])
    spread = np.trace(covariance, axis1=1, axis2=2)
    assert spread[[1, 2]].min() > 1000 * spread[[0, 3]].max()
    assert np.linalg.norm(placed.shape - truth, axis=1)[[0, 3]].max() < 0.1
    across = np.array([-np.sin(0.3), np.cos(0.3)])  # of the sides that lead to the hidden one
    for corner in (1, 2):
        assert across @ covariance[corner] @ across < 0.01
        assert abs((placed.shape[corner] - truth[corner]) @ across) < 0.1


def test_fitted_edges_end_in_the_corners() -> None:
    truth = turned(RECTANGLE, 0.4, np.array([0.3, -0.2]))
    seen = sense_shapes(noisy(polygon(truth), 3, 0))[0]
    assert len(seen.fitted_edges) == 4
    for edge in seen.fitted_edges:
        for point, cov in ((edge.start, edge.start_covariance_px2), (edge.end, edge.end_covariance_px2)):
            assert np.linalg.norm(truth - point, axis=1).min() < 0.2
            assert cov.shape == (2, 2)
            assert 0 < np.linalg.eigvalsh(cov)[0] <= np.linalg.eigvalsh(cov)[1] < 0.1


def test_edges_of_an_arc_have_a_rough_uncertainty() -> None:
    seen = sense_shapes(noisy(ellipse(np.array([100, 90]), np.array([60, 40]), 0.3), 2, 0))[0]
    assert seen.fitted_edges
    for edge in seen.fitted_edges:
        assert 0.01 < np.linalg.eigvalsh(edge.start_covariance_px2)[0] < 4


def test_a_picture_that_is_overwritten_later_changes_nothing() -> None:
    """A camera may fill the same array again before places are asked for."""
    image = noisy(polygon(turned(RECTANGLE, 0.4, np.zeros(2))), 3, 0)
    first, second = sense_shapes(image)[0], sense_shapes(image)[0]
    before = first.to_json()
    image[:] = 0
    assert second.to_json() == before


def test_red_on_green_of_the_same_brightness_has_an_edge() -> None:
    image = np.full((60, 80, 3), (40, 130, 60), np.uint8)
    image[:, 40:] = (40, 68, 182)  # the same grey
    grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    assert np.ptp(grey) <= 1
    y = np.arange(10.0, 50.0)
    places = np.stack([np.full_like(y, 40.3), y], axis=-1)[None]
    normals = np.broadcast_to([1.0, 0.0], places.shape)
    np.testing.assert_allclose(crossings(image, places, normals, 1.0), -0.8, atol=0.02)
    assert np.isnan(crossings(np.full((60, 80), 9, np.uint8), places, normals, 1.0)).all()


def test_a_wavy_side_is_less_certain_than_a_straight_one() -> None:
    y, x = np.mgrid[:100, :160].astype(np.float64)
    spread = []
    for height in (0.0, 1.0):
        edge = 50 + height * np.sin(x / 12)
        image = np.clip(128 + 60 * (y - edge), 60, 200).astype(np.uint8)
        line = exact_lines(image, np.array([[10.0, 50.0]]), np.array([[150.0, 50.0]]), 1.0, np.array([9.0]))
        assert line.found.all()
        spread.append(float(line.variance_at(np.array([[80.0, 50.0]]))[0]))
    assert spread[1] > 20 * spread[0]


def test_where_there_is_no_edge_things_stay_and_are_rough() -> None:
    blank = np.full((90, 90), 128, np.uint8)
    starts, ends = np.array([[10.0, 10.0]]), np.array([[70.0, 40.0]])
    line = exact_lines(blank, starts, ends, 1.0, np.array([0.7]))
    assert not line.found.any()
    np.testing.assert_allclose(line.foot(starts), starts, atol=1e-9)
    assert line.variance_at((starts + ends) / 2)[0] == pytest.approx(0.49, rel=0.01)
    middle, axes = np.array([[45.0, 45.0]]), np.array([[50.0, 30.0]])
    found = exact_ellipses(blank, middle, axes, np.array([0.3]), 1.0, np.array([0.7]))
    assert not found.found.any()
    np.testing.assert_allclose(found.axes, axes)
    np.testing.assert_allclose(found.angle_rad, 0.3)
    np.testing.assert_allclose(found.axes_std, 1.4)


def test_a_very_wide_picture_is_no_mistake() -> None:
    wide = np.full((60, 33_000), 200, np.uint8)
    places = np.full((1, 5, 2), 20.0)
    assert np.isnan(crossings(wide, places, np.ones((1, 5, 2)), 1.0)).all()
