import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evifuse.errors import UsageError
from evifuse.fusion import Touched, find_touched, overlap, project
from evifuse.recordings.recording import Camera

LEFT, RIGHT, INNER = (0.0, 0.0, 100.0, 100.0), (200.0, 0.0, 100.0, 100.0), (20.0, 20.0, 40.0, 40.0)
CAMERA = Camera(
    640,
    480,
    np.array([[100.0, 0, 50], [0, 100.0, 50], [0, 0, 1]]),
    np.array([0.0, 0.0, 1.0]),
    np.array([1.0, 0.0, 0.0, 0.0]),
)
"""One metre above the origin, looking down: world x is right, world y is up in the picture."""


def test_projection_of_known_points() -> None:
    assert project(CAMERA, np.zeros(3)) == pytest.approx((50, 50))
    assert project(CAMERA, np.array([0.1, 0.2, 0.0])) == pytest.approx((60, 30))
    assert project(CAMERA, np.array([0.1, 0.2, 0.5])) == pytest.approx((70, 10))
    assert project(CAMERA, np.array([0.0, 0.0, 1.5])) is None


boxes = st.tuples(*[st.floats(0, 50)] * 2, *[st.floats(0.5, 50)] * 2)


@given(boxes, boxes)
def test_overlap_is_symmetric_and_one_for_equal_boxes(a, b) -> None:
    assert overlap(a, b) == pytest.approx(overlap(b, a))
    assert 0 <= overlap(a, b) <= 1 + 1e-9
    assert overlap(a, a) == pytest.approx(1)


def test_the_smallest_object_that_holds_the_contact() -> None:
    chosen = find_touched([LEFT, RIGHT, INNER], camera=CAMERA, contact_m=np.zeros(3))
    assert chosen.index == 2
    assert chosen.warning is None
    assert chosen.pixel == pytest.approx((50, 50))


def test_the_nearest_object_is_taken_and_said() -> None:
    chosen = find_touched([LEFT, RIGHT], camera=CAMERA, contact_m=np.array([1.3, 0.0, 0.0]))
    assert chosen.index == 1
    assert chosen.warning is not None
    assert "(180, 50) px" in chosen.warning
    assert "20 px away" in chosen.warning


def test_a_given_box_wins_over_the_camera() -> None:
    chosen = find_touched([LEFT, RIGHT], box=(190, 10, 90, 90), camera=CAMERA, contact_m=np.zeros(3))
    assert chosen.index == 1
    nothing = find_touched([LEFT, RIGHT], box=(400, 400, 10, 10))
    assert nothing.index is None
    assert nothing.warning is not None
    with pytest.raises(UsageError, match="above 0"):
        find_touched([LEFT], box=(0, 0, 0, 5))


def test_without_a_place_the_most_believed_is_taken_and_said() -> None:
    several = find_touched([RIGHT, LEFT], camera=None, contact_m=np.zeros(3))
    assert several.index == 0
    assert several.warning is not None
    assert "2 objects and there is no camera pose" in several.warning
    assert "--box" in several.warning
    assert "no contact" in (find_touched([RIGHT, LEFT], camera=CAMERA).warning or "")
    assert find_touched([RIGHT]) == Touched(0, None, None)
    assert find_touched([]) == Touched(None, None, None)
