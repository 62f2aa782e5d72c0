"""The copy of a picture that edges are looked for in."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from evifuse.vision import sense_shapes
from evifuse.vision.detect import Chain
from evifuse.vision.group import group_objects
from evifuse.vision.working import working_picture

RED, GREEN = (40, 60, 190), (50, 129, 50)
"""BGR of nearly the same lightness."""


def red_triangle_before_leaves() -> NDArray[np.uint8]:
    picture = np.full((240, 320, 3), GREEN, np.uint8)
    cv2.fillPoly(picture, [np.array([[160, 40], [240, 180], [80, 180]])], RED)
    return picture


def test_red_before_green_is_seen_though_grey_does_not_show_it() -> None:
    picture = red_triangle_before_leaves()
    grey = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
    assert np.ptp(grey.astype(int)) <= 2
    assert sense_shapes(grey) == ()
    seen = sense_shapes(picture)[0]
    assert seen.classification.decision == "triangular"
    np.testing.assert_allclose(seen.box, (80, 40, 161, 141), atol=4)


def test_a_detector_is_asked_about_lightness_and_redness() -> None:
    asked: list[NDArray[np.uint8]] = []

    def detector(grey: NDArray[np.uint8]) -> tuple[Chain, ...]:
        asked.append(grey)
        return ()

    sense_shapes(red_triangle_before_leaves(), detector=detector)
    assert len(asked) == 2
    assert all(layer.ndim == 2 and layer.flags.c_contiguous and layer.dtype == np.uint8 for layer in asked)
    sense_shapes(np.zeros((50, 60), np.uint8), detector=detector)
    assert len(asked) == 3


@pytest.mark.parametrize("shape", [(9, 400), (70, 70, 3), (300, 500), (1500, 4000)])
def test_every_layer_has_the_same_pixels(shape: tuple[int, ...]) -> None:
    picture = np.random.default_rng(0).integers(0, 256, shape, np.uint8)
    working = working_picture(picture)
    assert len({layer.grey.shape for layer in working.layers}) == 1
    height, width = working.layers[0].grey.shape
    corners = working.point(np.array([[7.5, 7.5], [width - 8.5, height - 8.5]]))
    np.testing.assert_allclose(corners, [[-0.5, -0.5], [shape[1] - 0.5, shape[0] - 0.5]], atol=1)


@pytest.mark.parametrize("sigma", [30, 60])
def test_noise_of_all_colours_shows_nothing(sigma: float) -> None:
    for seed in range(3):
        noise = np.random.default_rng(seed).normal(128, sigma, (540, 960, 3))
        assert sense_shapes(np.clip(noise, 0, 255).astype(np.uint8)) == ()


def test_the_rim_stands_for_the_object_unless_it_is_hardly_believed() -> None:
    boxes = np.array([[10, 10, 50, 50], [4, 4, 56, 56], [0, 0, 200, 200]], np.float64)
    prominence = np.array([3.0, 2.0, 1.0])
    for scores, chosen in (([0.8, 0.4, 0.4], [1, 2]), ([0.8, 0.1, 0.4], [0, 2]), ([0.8, 0.4, 0.01], [1])):
        scores = np.array(scores)
        assert group_objects(boxes, scores, np.full(3, 0.5), prominence, 0.04)[0] == chosen


def test_two_that_overlap_are_no_rim_of_one() -> None:
    boxes = np.array([[10, 10, 50, 50], [4, 4, 60, 60]], np.float64)
    scores, prominence = np.array([0.8, 0.8]), np.array([3.0, 2.0])
    assert group_objects(boxes, scores, np.array([0.9, 0.9]), prominence, 0.04)[0] == [1]
    assert group_objects(boxes, scores, np.array([0.9, 0.5]), prominence, 0.04)[0] == [0]


def test_what_lies_on_a_clear_object_is_another_only_if_it_is_clear_too() -> None:
    boxes = np.array([[0, 0, 100, 100], [20, 20, 60, 60]], np.float64)
    scores, prominence = np.array([0.9, 0.9]), np.array([2.0, 1.0])
    for support, chosen in (([0.9, 0.3], [0]), ([0.9, 0.9], [0, 1]), ([0.3, 0.3], [0, 1]), ([0.9, 0.0], [0])):
        assert group_objects(boxes, scores, np.array(support), prominence, 0.04)[0] == chosen


def test_strangers_are_objects_unless_there_are_many() -> None:
    boxes = np.array([[0, 0, 40, 40]]) + 100.0 * np.arange(5)[:, None]
    support = np.array([0.0, 0.9, 0.0, 0.0, 0.9])
    assert group_objects(boxes, np.ones(5), support, -np.arange(5.0), 0.04)[0] == [0, 1, 2, 4]


def test_an_outline_that_shows_one_object_says_nothing_of_the_next() -> None:
    boxes = np.array([[0, 0, 100, 100], [20, 20, 60, 60]], np.float64)
    clear = np.array([0.9, 0.9])
    chosen, members = group_objects(boxes, clear, clear, np.array([2.0, 1.0]), 0.04)
    assert chosen == [0, 1]
    np.testing.assert_array_equal(members, [[True, False], [False, True]])


def test_the_frame_of_a_picture_comes_last() -> None:
    picture = np.full((300, 400), 40, np.uint8)
    cv2.rectangle(picture, (2, 2), (397, 297), (200,), -1)
    cv2.ellipse(picture, (200, 150), (80, 50), 20, 0, 360, (60,), -1)
    first, *others = sense_shapes(picture)
    assert first.classification.decision == "elliptical"
    assert all(s.box[2] > 380 for s in others)


def test_a_picture_of_hardly_any_colour_is_looked_at_once() -> None:
    grey = np.full((300, 300), 90, np.uint8)
    cv2.circle(grey, (150, 150), 60, (180,), -1)
    picture = cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR)
    picture[..., 2] += 10
    assert len(working_picture(picture).layers) == 1
    picture[100:200, 100:200, 2] += 40
    assert len(working_picture(picture).layers) == 2
