"""From pixels to metres: known shapes under perspective get their sizes back; one line for what can't be."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evifuse.errors import ImageError, InputError, UsageError
from evifuse.fusion import project
from evifuse.recordings.intrinsics import Intrinsics
from evifuse.recordings.recording import Camera
from evifuse.vision import FittedEdge, SeenObject, sense_shapes
from evifuse.vision.metric import (
    Plane,
    covariance_on_plane,
    ellipse_on_plane,
    measure,
    on_depth,
    on_plane,
    plane_in_depth,
)

K = Intrinsics.of(900.0, 870.0, 652.5, 340.25).matrix
SIZE = (1280, 720)


def seen_by(points_m: np.ndarray, matrix: np.ndarray = K) -> np.ndarray:
    """Pixels of points in the camera frame, by the projection that the fusion uses."""
    camera = Camera(*SIZE, matrix, np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))
    flat = [project(camera, p) for p in points_m.reshape(-1, 3)]
    return np.array(flat).reshape(*points_m.shape[:-1], 2)


def tilted(pitch: float, yaw: float, distance: float) -> tuple[Plane, np.ndarray, np.ndarray, np.ndarray]:
    """A plane through (0, 0, distance) that is turned from facing the camera, with a point and two axes."""
    c, s = np.cos(pitch), np.sin(pitch)
    around_x = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    c, s = np.cos(yaw), np.sin(yaw)
    across, along, normal = (np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) @ around_x).T
    middle = np.array([0.0, 0.0, distance])
    return Plane(normal, float(normal @ middle)), middle, across, along


ANGLES = st.floats(-1.1, 1.1)


@given(ANGLES, ANGLES, st.floats(0.2, 20), st.floats(0.01, 0.2), st.floats(0.01, 0.2), st.booleans())
def test_a_rectangle_under_perspective_gets_its_sides_back(
    pitch: float, yaw: float, distance: float, width: float, height: float, faces: bool
) -> None:
    plane, middle, across, along = tilted(pitch, yaw, distance)
    if faces:
        plane = Plane(-plane.normal, -plane.distance_m)
    x, y = width * distance / 2 * across, height * distance / 2 * along
    corners = middle + np.array([-x - y, x - y, x + y, y - x])
    found = on_plane(seen_by(corners), K, plane)
    np.testing.assert_allclose(found, corners, rtol=0, atol=1e-9 * distance)
    sides = np.linalg.norm(np.roll(found, -1, axis=0) - found, axis=1)
    np.testing.assert_allclose(sides, np.tile([width, height], 2) * distance, rtol=1e-9)


@given(ANGLES, ANGLES, st.floats(0.02, 0.2), st.floats(0.3, 1.0), st.floats(0, 3.1))
def test_an_ellipse_under_perspective_gets_its_axes_back(
    pitch: float, yaw: float, longer: float, ratio: float, turn: float
) -> None:
    import cv2

    plane, middle, across, along = tilted(pitch, yaw, 2.0)
    first = np.cos(turn) * across + np.sin(turn) * along
    second = np.cos(turn) * along - np.sin(turn) * across
    t = np.linspace(0, 2 * np.pi, 60, endpoint=False)[:, None]
    outline = middle + longer * (np.cos(t) * first + ratio * np.sin(t) * second)
    centre, axes, degrees = cv2.fitEllipseDirect(seen_by(outline).astype(np.float32))
    centre_m, axes_m, ends_m = ellipse_on_plane(centre, axes, np.deg2rad(degrees), K, plane)
    np.testing.assert_allclose(centre_m, middle, atol=1e-4)  # OpenCV fits in single precision
    np.testing.assert_allclose(axes_m, 2 * longer * np.array([1, ratio]), rtol=2e-3)
    np.testing.assert_allclose(np.linalg.norm(ends_m[::2] - ends_m[1::2], axis=1), axes_m, rtol=1e-9)
    np.testing.assert_allclose(ends_m @ plane.normal, plane.distance_m, rtol=1e-9)


def test_ellipses_are_exact_and_in_batches() -> None:
    """The outline of each found ellipse is seen on the ellipse of the picture it was made from."""
    plane = tilted(0.7, -0.4, 1.5)[0]
    centre = np.array([[[600.0, 300.0], [700.0, 420.0]], [[650.0, 100.0], [90.0, 600.0]]])
    axes, angle = np.full((2, 2, 2), [160.0, 90.0]), np.array([[0.0, 0.5], [1.2, -0.7]])
    centre_m, axes_m, ends = ellipse_on_plane(centre, axes, angle, K, plane)
    assert (centre_m.shape, axes_m.shape, ends.shape) == ((2, 2, 3), (2, 2, 2), (2, 2, 4, 3))
    assert (axes_m[..., 0] > axes_m[..., 1]).all()
    t = np.linspace(0, 6, 50)[:, None, None, None]
    outline = centre_m + np.cos(t) * (ends[..., 0, :] - centre_m) + np.sin(t) * (ends[..., 2, :] - centre_m)
    off = seen_by(outline) - centre
    c, s = np.cos(angle), np.sin(angle)
    u, v = off[..., 0] * c + off[..., 1] * s, off[..., 1] * c - off[..., 0] * s
    np.testing.assert_allclose((u / 80) ** 2 + (v / 45) ** 2, 1, rtol=1e-9)
    one = ellipse_on_plane(centre[1, 1], axes[1, 1], angle[1, 1], K, plane)
    np.testing.assert_allclose(one[0], centre_m[1, 1], rtol=1e-12)


def test_perspective_moves_the_centre() -> None:
    plane = tilted(1.0, 0.0, 1.0)[0]
    centre_m, _, _ = ellipse_on_plane([652.5, 340.25], [300.0, 200.0], 0.0, K, plane)
    assert np.linalg.norm(centre_m - on_plane([652.5, 340.25], K, plane)) > 0.02


def test_a_depth_is_a_plane_that_faces_the_camera() -> None:
    pixels = np.random.default_rng(0).uniform(0, 700, (5, 4, 2))
    facing = on_plane(pixels, K, Plane(np.array([0, 0, 1]), 0.8))
    np.testing.assert_allclose(on_depth(pixels, K, 0.8), facing, rtol=1e-12)
    np.testing.assert_allclose(on_depth(pixels, K, np.full((720, 1280), 0.8)), facing, rtol=1e-12)
    assert (facing[..., 2] == 0.8).all()


def test_skew_is_heeded() -> None:
    skewed = K + np.array([[0, 7.0, 0], [0, 0, 0], [0, 0, 0]])
    point = np.array([0.3, -0.2, 1.7])
    np.testing.assert_allclose(on_depth(seen_by(point, skewed), skewed, 1.7), point, rtol=1e-12)


def depth_of(plane: Plane) -> np.ndarray:
    v, u = np.mgrid[: SIZE[1], : SIZE[0]]
    return on_plane(np.stack([u, v], axis=-1), K, plane)[..., 2]


def test_the_plane_in_a_depth_picture_is_exact_without_noise() -> None:
    plane = tilted(0.5, -0.3, 0.9)[0]
    found, error = plane_in_depth([[500, 300], [700, 300], [700, 420], [500, 420]], K, depth_of(plane))
    np.testing.assert_allclose(found.normal * np.sign(found.normal @ plane.normal), plane.normal, atol=1e-9)
    assert abs(found.distance_m) == pytest.approx(plane.distance_m, abs=1e-9)
    assert error < 1e-9


def test_holes_noise_and_things_in_front_do_little_harm() -> None:
    random = np.random.default_rng(1)
    plane = tilted(0.5, -0.3, 0.9)[0]
    depth = depth_of(plane) + random.normal(0, 0.001, SIZE[::-1])
    depth[random.random(depth.shape) < 0.3] = np.nan
    depth[random.random(depth.shape) < 0.1] = 0
    depth[300:420, 500:560] = 0.5
    found, error = plane_in_depth([[500, 300], [700, 300], [700, 420], [500, 420]], K, depth)
    assert abs(float(found.normal @ plane.normal)) > np.cos(np.deg2rad(1))
    assert abs(found.distance_m) == pytest.approx(plane.distance_m, abs=0.003)
    assert 0.0005 < error < 0.002


def picture_of(plane: Plane, polygon_m: np.ndarray) -> np.ndarray:
    import cv2

    image = np.full((720, 1280), 210, np.uint8)
    cv2.fillPoly(image, [np.rint(seen_by(polygon_m) * 16).astype(np.int32)], 60, cv2.LINE_AA, shift=4)
    return image


@pytest.fixture(scope="module")
def tile() -> tuple[SeenObject, Plane]:
    """A tile of 0.30 m x 0.20 m, seen obliquely."""
    plane, middle, across, along = tilted(0.6, 0.3, 1.2)
    x, y = 0.15 * across, 0.10 * along
    seen = sense_shapes(picture_of(plane, middle + np.array([-x - y, x - y, x + y, y - x])))
    return next(s for s in seen if s.classification.decision == "rectangular"), plane


def test_a_seen_tile_has_its_size(tile: tuple[SeenObject, Plane]) -> None:
    seen, plane = tile
    i = next(i for i, h in enumerate(seen.primitives) if h.kind == "rectangle")
    for surface in (plane, depth_of(plane)):
        found = measure(seen, K, surface)
        sides = np.sort(found["primitives"][i]["sides_m"])
        np.testing.assert_allclose(sides, [0.2, 0.2, 0.3, 0.3], rtol=0.02)
        corners = np.array(found["primitives"][i]["corners_m"])
        np.testing.assert_allclose(corners @ plane.normal, plane.distance_m, rtol=1e-3)
        assert len(found["fitted_edges"]) == len(seen.fitted_edges)
        assert max(e["length_m"] for e in found["fitted_edges"]) == pytest.approx(0.3, rel=0.03)
    assert found["plane"]["error_m"] < 1e-6


def test_a_seen_disc_has_its_diameter() -> None:
    plane, middle, across, along = tilted(-0.5, 0.4, 1.2)
    t = np.linspace(0, 2 * np.pi, 200, endpoint=False)[:, None]
    seen = sense_shapes(picture_of(plane, middle + 0.11 * (np.cos(t) * across + np.sin(t) * along)))
    round_one = next(s for s in seen if s.classification.decision == "elliptical")
    i = next(i for i, h in enumerate(round_one.primitives) if h.kind == "ellipse")
    found = measure(round_one, K, plane)["primitives"][i]
    np.testing.assert_allclose(found["axes_m"], 0.22, rtol=0.02)
    np.testing.assert_allclose(found["centre_m"], middle, atol=0.003)


def test_a_circle_has_a_radius(tile: tuple[SeenObject, Plane]) -> None:
    circle = replace(
        tile[0].primitives[0], kind="circle", geometry={"centre": [652.5, 340.25], "radius": 90.0}
    )
    found = measure(
        replace(tile[0], primitives=(circle,)), Intrinsics.of(900, 900, 652.5, 340.25).matrix, 2.0
    )
    assert found["primitives"][0]["radius_m"] == pytest.approx(0.2, rel=1e-12)
    assert found["primitives"][0]["axes_m"] == pytest.approx([0.4, 0.4], rel=1e-12)


@given(ANGLES, ANGLES, st.integers(0, 999))
def test_uncertainty_carries_over_to_metres(pitch: float, yaw: float, seed: int) -> None:
    """As the spread of the points of many pixels, drawn by the covariance, would be."""
    random = np.random.default_rng(seed)
    plane = tilted(pitch, yaw, 1.5)[0]
    pixel = random.uniform([600, 300], [700, 400])
    root = random.normal(0, 1e-3, (2, 2))
    found = covariance_on_plane(pixel, root @ root.T, K, plane)
    drawn = on_plane(pixel + random.normal(size=(4000, 2)) @ root.T, K, plane)
    np.testing.assert_allclose(np.cov(drawn.T), found, rtol=0.15, atol=0.15 * np.abs(found).max())
    np.testing.assert_allclose(found @ plane.normal, 0, atol=1e-9 * np.abs(found).max())


def test_a_seen_tile_knows_how_uncertain_it_is(tile: tuple[SeenObject, Plane]) -> None:
    seen, plane = tile
    found = measure(seen, K, plane)
    for edge in found["fitted_edges"]:
        assert 0 < edge["length_std_m"] < 0.002
        assert (
            min(abs(edge["length_m"] - 0.2), abs(edge["length_m"] - 0.3)) < 0.005
        )  # drawn a little too wide
        for end in ("start", "end"):
            covariance = np.array(edge[f"{end}_covariance_m2"])
            assert covariance.shape == (3, 3)
            assert np.linalg.eigvalsh(covariance)[-1] > 0
    corners = np.array(found["primitives"][0]["corners_covariance_m2"])
    assert corners.shape == (4, 3, 3)
    vague = replace(seen, fitted_edges=(FittedEdge(np.array([600.0, 300]), np.array([640.0, 300]), 0.5),))
    assert set(measure(vague, K, plane)["fitted_edges"][0]) == {"start_m", "end_m", "length_m"}


HORIZON = Plane(np.array([0.0, 1.0, 0.0]), 1.2)  # a floor 1.2 m below the camera
HOLE = np.full((720, 1280), np.nan)


@pytest.mark.parametrize(
    ("kind", "what", "words"),
    [
        (UsageError, lambda: Plane(np.zeros(3), 1.0), "other than 0, 0, 0"),
        (UsageError, lambda: Plane(np.array([0, np.nan, 1]), 1.0), "other than"),
        (UsageError, lambda: Plane(np.array([0, 1]), 1.0), "normal"),
        (UsageError, lambda: Plane(np.array([0, 0, 1]), 0.0), "can't be measured on"),
        (UsageError, lambda: Plane(np.array([0, 0, 1]), np.inf), "can't be measured on"),
        (ImageError, lambda: on_plane([5, 5], K, Plane(np.array([0, 0, 1]), -1.0)), "behind the camera"),
        (ImageError, lambda: on_plane([[600, 700], [600, 100]], K, HORIZON), r"pixel \(600.0, 100.0\)"),
        (ImageError, lambda: on_plane([5, np.nan], K, HORIZON), "NaN"),
        (
            ImageError,
            lambda: ellipse_on_plane([600, 400], [300, 300], 0.0, K, HORIZON),
            "part of the ellipse",
        ),
        (ImageError, lambda: ellipse_on_plane([600, 400], [300, 0], 0.0, K, HORIZON), "axes above 0"),
        (ImageError, lambda: on_depth([5, 5], K, HOLE), "nothing was measured"),
        (ImageError, lambda: on_depth([5, 5], K, np.zeros((9, 9))), "nothing was measured"),
        (ImageError, lambda: on_depth([1280, 5], K, HOLE), "outside the depth picture"),
        (ImageError, lambda: on_depth([5, 5], K, np.ones(9)), "shape"),
        (UsageError, lambda: on_depth([5, 5], K, np.nan), "above 0"),
        (UsageError, lambda: on_depth([5, 5], K, -1.0), "above 0"),
        (UsageError, lambda: on_depth([5, 5], np.eye(2), 1.0), "3 x 3"),
        (UsageError, lambda: on_depth([5, 5], np.ones((3, 3)), 1.0), "fx, s, cx"),
        (UsageError, lambda: on_depth([5, 5, 5], K, 1.0), "shape"),
        (UsageError, lambda: Intrinsics.of(0, 1, 1, 1), "above 0"),
        (UsageError, lambda: Intrinsics.of(1, 1, np.nan, 1), "finite"),
        (ImageError, lambda: plane_in_depth([[5, 5], [50, 5], [5, 50]], K, HOLE), "only 0 depths"),
        (ImageError, lambda: plane_in_depth([[5, 5], [90, 5], [5, 90]], K, np.ones((4, 4))), "outside"),
        (ImageError, lambda: plane_in_depth([[5, 5], [90, 5], [90, 5]], K, np.ones((99, 99))), "no plane"),
    ],
)
def test_what_can_not_be_measured_is_said_in_a_line(kind: type[InputError], what, words: str) -> None:
    with pytest.raises(kind, match=words) as caught:
        what()
    assert "\n" not in str(caught.value)
