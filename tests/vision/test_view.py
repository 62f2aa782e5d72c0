"""With a camera and a plane, shapes are believed as they lie on it; without, belief falls with the tilt."""

import cv2
import numpy as np
import pytest

from evifuse.errors import UsageError
from evifuse.recordings.intrinsics import Intrinsics
from evifuse.vision import SeenObject, View, sense_shapes
from evifuse.vision.metric import Plane, measure, on_plane

SIZE = (480, 640)
K = Intrinsics.of(800.0, 800.0, 319.5, 239.5).matrix
SQUARE = np.array([[-0.12, -0.12], [0.12, -0.12], [0.12, 0.12], [-0.12, 0.12]])


def view_of(tilt: float, turn: float = 0.0) -> tuple[View, np.ndarray]:
    """A plane 0.8 m away that is tilted, and a map (3, 3) from metres on it to the camera frame."""
    c, s = np.cos(tilt), np.sin(tilt)
    around_x = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    across, along, normal = around_x.T
    c, s = np.cos(turn), np.sin(turn)
    place = np.stack([c * across + s * along, c * along - s * across, [0, 0, 0.8]], axis=-1)
    return View(K, Plane(normal, float(normal[2] * 0.8))), place


def pixels(points: np.ndarray, place: np.ndarray) -> np.ndarray:
    seen = np.column_stack([points, np.ones(len(points))]) @ (K @ place).T
    return seen[:, :2] / seen[:, 2:]


def picture(points: np.ndarray, place: np.ndarray) -> np.ndarray:
    """A dark figure of the plane, drawn at four times the size."""
    fine = np.full((SIZE[0] * 4, SIZE[1] * 4), 200, np.uint8)
    at = (pixels(points, place) + 0.5) * 4 - 0.5
    cv2.fillPoly(fine, [np.rint(at * 16).astype(np.int32)], 60, cv2.LINE_AA, shift=4)
    return cv2.resize(fine, SIZE[::-1], interpolation=cv2.INTER_AREA)


def belief(seen: tuple[SeenObject, ...], kind: str) -> float:
    return next((h.belief for h in seen[0].primitives if h.kind == kind), 0.0) if seen else 0.0


def four_sided(seen: tuple[SeenObject, ...]) -> float:
    return belief(seen, "square") + belief(seen, "rectangle")


def test_a_tilted_square_is_a_square_only_with_the_view() -> None:
    view, place = view_of(np.deg2rad(60), turn=0.6)
    image = picture(SQUARE, place)
    blind, knowing = sense_shapes(image), sense_shapes(image, view=view)
    assert belief(knowing, "square") > 0.45  # and as much that it is a rectangle: it is one too
    assert four_sided(knowing) > 0.9
    assert belief(blind, "square") < 0.35
    assert four_sided(blind) < 0.65
    assert blind[0].evidence.as_dict()["frame"] > 0.3


def test_belief_falls_with_the_tilt_unless_the_view_is_known() -> None:
    blind: list[float] = []
    knowing: list[float] = []
    for degrees in (0, 20, 40, 60, 70):
        view, place = view_of(np.deg2rad(degrees), turn=0.6)
        image = picture(SQUARE, place)
        blind.append(four_sided(sense_shapes(image)))
        knowing.append(four_sided(sense_shapes(image, view=view)))
    assert (np.diff(blind) < 1e-3).all()
    assert blind[-1] < 0.4 < 0.9 < blind[0]
    assert min(knowing) > 0.95 * max(knowing)


def test_a_tilted_rectangle_is_not_taken_for_a_square_that_it_looks_like() -> None:
    """Twice as long as wide, and tilted so that the picture shows it about as high as wide."""
    view, place = view_of(np.deg2rad(60))
    image = picture(SQUARE * (0.7, 1.4), place)
    knowing = sense_shapes(image, view=view)
    assert belief(knowing, "rectangle") > 1.5 * belief(knowing, "square")
    assert belief(sense_shapes(image), "square") > 1.15 * belief(knowing, "square")


def test_a_tilted_disc_is_a_circle_with_the_view() -> None:
    view, place = view_of(np.deg2rad(55), turn=0.3)
    t = np.linspace(0, 2 * np.pi, 240, endpoint=False)
    image = picture(0.13 * np.column_stack([np.cos(t), np.sin(t)]), place)
    blind, knowing = sense_shapes(image), sense_shapes(image, view=view)
    assert belief(blind, "circle") < 0.2
    assert belief(knowing, "circle") > 0.45  # and as much that it is an ellipse: it is one too
    circle = next(h for h in knowing[0].primitives if h.kind == "circle")
    assert {"centre", "axes", "angle_rad"} <= set(circle.geometry)
    found = measure(knowing[0], K, view.plane)["primitives"][knowing[0].primitives.index(circle)]
    assert found["radius_m"] == pytest.approx(0.13, rel=0.01)
    np.testing.assert_allclose(found["centre_m"], [0, 0, 0.8], atol=0.002)


def test_what_is_judged_from_above_lies_where_it_is_seen() -> None:
    view, place = view_of(np.deg2rad(50), turn=0.4)
    image = picture(SQUARE, place)
    truth = pixels(SQUARE, place)
    seen = sense_shapes(image, view=view)[0]
    corners = np.array(next(h for h in seen.primitives if h.kind == "square").geometry["corners"])
    apart = np.linalg.norm(truth[:, None] - corners, axis=2).min(axis=1)
    assert apart.max() < 0.3
    for edge in seen.fitted_edges:
        assert np.linalg.norm(truth - edge.start, axis=1).min() < 0.3
    low = truth.min(axis=0)
    assert seen.box[:2] == pytest.approx(low.tolist(), abs=1.5)
    sides = measure(seen, K, view.plane)["primitives"][0]["sides_m"]
    np.testing.assert_allclose(sides, 0.24, rtol=0.005)


def test_seen_straight_from_above_nothing_changes() -> None:
    view, place = view_of(0.0, turn=0.3)
    image = picture(SQUARE * (1.0, 0.6), place)
    blind, knowing = sense_shapes(image)[0], sense_shapes(image, view=view)[0]
    for a, b in zip(blind.primitives[:2], knowing.primitives[:2], strict=True):
        assert (a.kind, a.belief) == (b.kind, pytest.approx(b.belief, abs=0.01))


def test_what_lies_above_the_horizon_is_judged_as_it_is_seen() -> None:
    floor = View(K, Plane(np.array([0.0, 1.0, 0.0]), 1.2))
    image = np.full(SIZE, 200, np.uint8)
    cv2.rectangle(image, (200, 40), (320, 160), 60, -1)
    assert belief(sense_shapes(image, view=floor), "square") == pytest.approx(
        belief(sense_shapes(image), "square"), abs=1e-9
    )


def test_a_view_needs_a_camera() -> None:
    with pytest.raises(UsageError, match="camera matrix"):
        View(np.eye(2), Plane(np.array([0, 0, 1]), 1.0))


def test_the_homography_is_that_of_the_plane() -> None:
    view, _ = view_of(0.7)
    at = np.random.default_rng(0).uniform(0, 400, (9, 2))
    mapped = np.column_stack([at, np.ones(9)]) @ view.homography().T
    flat = mapped[:, :2] / mapped[:, 2:]
    points = on_plane(at, K, view.plane)
    apart = np.linalg.norm(points[:, None] - points, axis=2)
    np.testing.assert_allclose(np.linalg.norm(flat[:, None] - flat, axis=2), apart, atol=1e-9)
    assert (mapped[:, 2] > 0).all()
