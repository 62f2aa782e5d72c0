"""The shape sensor on drawn pictures: what is seen does not depend on where, how large or which way round."""

import json

import cv2
import numpy as np
import pytest

from evifuse.errors import ImageError
from evifuse.vision import EdgeDrawing, SeenObject, sense_shapes
from evifuse.vision.detect import noise_level

NAMES = {"rectangle": "rectangular", "triangle": "triangular", "ellipse": "elliptical"}
POLYGONS = {
    "rectangle": [(-60, -35), (60, -35), (60, 35), (-60, 35)],
    "triangle": [(-60, 45), (60, 45), (10, -50)],
}


def picture(kind: str, turn: float = 0.0, scale: float = 1.0, thickness: int = -1) -> np.ndarray:
    """A dark shape on light ground, 240 x 320, smoothed a little."""
    image = np.full((240, 320), 220, np.uint8)
    middle = (160, 120)
    if kind == "ellipse":
        axes = (round(60 * scale), round(38 * scale))
        cv2.ellipse(image, middle, axes, np.rad2deg(turn), 0, 360, 60, thickness, cv2.LINE_AA)
    else:
        c, s = np.cos(turn), np.sin(turn)
        corners = np.array(POLYGONS[kind]) * scale @ np.array([[c, s], [-s, c]]) + middle
        whole = corners.round().astype(np.int32)
        if thickness < 0:
            cv2.fillPoly(image, [whole], 60, cv2.LINE_AA)
        else:
            cv2.polylines(image, [whole], True, 60, thickness, cv2.LINE_AA)
    return image


def first(image: np.ndarray) -> SeenObject:
    seen = sense_shapes(image)
    assert seen
    return seen[0]


@pytest.mark.parametrize("kind", NAMES)
@pytest.mark.parametrize("turn", [0.0, 0.4, 1.2])
@pytest.mark.parametrize("thickness", [-1, 4])
def test_clean_shapes(kind: str, turn: float, thickness: int) -> None:
    seen = first(picture(kind, turn, thickness=thickness))
    assert seen.classification.decision == NAMES[kind]
    assert seen.primitives[0].kind == kind


@pytest.mark.parametrize("kind", NAMES)
def test_mirrored_inverted_and_coloured_pictures_show_the_same(kind: str) -> None:
    image = picture(kind, 0.3)
    mirrored = image[:, ::-1]
    for other in (mirrored, image[::-1], 255 - image, np.dstack([image] * 3), image / 255.0):
        assert first(other).classification.decision == NAMES[kind]
    x, _, width, _ = first(image).box
    assert first(mirrored).box[0] == pytest.approx(320 - x - width, abs=2)


@pytest.mark.parametrize("kind", NAMES)
def test_size_of_the_picture_does_not_matter(kind: str) -> None:
    image = picture(kind, 0.2)
    for factor in (0.35, 2.0, 8.0):
        how = cv2.INTER_AREA if factor < 1 else cv2.INTER_CUBIC
        scaled = cv2.resize(image, None, fx=factor, fy=factor, interpolation=how)
        seen = first(scaled)
        assert seen.classification.decision == NAMES[kind]
        np.testing.assert_allclose(np.array(seen.box) / factor, first(image).box, atol=3 + 1 / factor)


def test_geometry_is_that_of_the_drawing() -> None:
    rectangle = first(picture("rectangle"))
    assert rectangle.box == pytest.approx((100, 85, 121, 71), abs=2)
    corners = np.array(rectangle.primitives[0].geometry["corners"])
    truth = np.add(POLYGONS["rectangle"], (160, 120))
    assert np.abs(corners[:, None] - truth[None]).max(axis=2).min(axis=1).max() < 2
    assert len(rectangle.fitted_edges) == 4
    ellipse = first(picture("ellipse")).primitives[0].geometry
    np.testing.assert_allclose(ellipse["centre"], (160, 120), atol=1)
    np.testing.assert_allclose(ellipse["axes"], (120, 76), atol=3)


def test_special_cases_are_known_as_such() -> None:
    image = np.full((240, 240), 220, np.uint8)
    cv2.circle(image, (120, 120), 60, 60, -1, cv2.LINE_AA)
    circle = {h.kind: h.belief for h in first(image).primitives}
    assert circle["circle"] > 0.9 * circle["ellipse"]
    image[:] = 220
    cv2.rectangle(image, (70, 70), (170, 170), 60, -1)
    square = {h.kind: h.belief for h in first(image).primitives}
    assert square["square"] > 0.9 * square["rectangle"]
    image[:] = 220
    cv2.ellipse(image, (120, 120), (70, 70), 0, 50, 310, 60, 3, cv2.LINE_AA)
    arc = {h.kind: h.belief for h in first(image).primitives}
    assert arc["bracket"] > max(arc.get("rectangle", 0), arc.get("triangle", 0), 0.2)


def test_an_octagon_leaves_more_doubt_than_a_circle() -> None:
    image = np.full((240, 240), 220, np.uint8)
    cv2.circle(image, (120, 120), 60, 60, -1, cv2.LINE_AA)
    round_one = first(image).evidence.as_dict()["frame"]
    t = (np.arange(8) + 0.5) * np.pi / 4
    corners = (120 + 62 * np.column_stack([np.cos(t), np.sin(t)])).round().astype(np.int32)
    image[:] = 220
    cv2.fillPoly(image, [corners], 60, cv2.LINE_AA)
    assert first(image).evidence.as_dict()["frame"] > 3 * round_one


def test_several_objects_are_seen_with_their_boxes() -> None:
    image = np.full((300, 500), 220, np.uint8)
    cv2.rectangle(image, (40, 60), (160, 140), 60, -1)
    cv2.circle(image, (260, 200), 50, 60, -1, cv2.LINE_AA)
    cv2.fillPoly(image, [np.array([[350, 150], [460, 150], [400, 40]], np.int32)], 60, cv2.LINE_AA)
    seen = sense_shapes(image)
    found = {s.classification.decision: s.box for s in seen}
    assert len(seen) == 3
    assert found["rectangular"] == pytest.approx((40, 60, 121, 81), abs=3)
    assert found["elliptical"] == pytest.approx((210, 150, 101, 101), abs=3)
    assert found["triangular"] == pytest.approx((350, 40, 111, 111), abs=5)


@pytest.mark.parametrize("sigma", [0, 5, 20])
@pytest.mark.parametrize("shape", [(240, 320), (90, 110)])
def test_nothing_is_seen_in_nothing(sigma: float, shape: tuple[int, int]) -> None:
    noise = np.random.default_rng(3).normal(128, sigma, shape)
    assert sense_shapes(np.clip(noise, 0, 255).astype(np.uint8)) == ()


@pytest.mark.parametrize("kind", NAMES)
def test_noise_and_hidden_parts_do_not_change_the_decision(kind: str) -> None:
    image = picture(kind, 0.2)
    noisy = image + np.random.default_rng(4).normal(0, 25, image.shape)
    assert first(np.clip(noisy, 0, 255)).classification.decision == NAMES[kind]
    hidden = picture(kind, 0.2, thickness=4)
    hidden[120:, 170:200] = 220
    assert first(hidden).classification.decision == NAMES[kind]


def test_doubt_grows_when_a_part_is_hidden() -> None:
    whole, hidden = picture("ellipse", thickness=4), picture("ellipse", thickness=4)
    hidden[120:, 160:] = 220
    assert first(hidden).primitives[0].belief < first(whole).primitives[0].belief


def test_json_has_what_others_parse() -> None:
    seen = first(picture("triangle"))
    value = json.loads(json.dumps(seen.to_json(), allow_nan=False))
    assert list(value) == [
        "box",
        "fitted_edges",
        "primitives",
        "belief",
        "conductivity",
        "feature",
        "decision",
    ]
    assert set(value["belief"]) == {
        "rectangle",
        "square",
        "triangle",
        "ellipse",
        "circle",
        "bracket",
        "frame",
    }
    assert sum(value["belief"].values()) == pytest.approx(1.0)
    assert set(value["conductivity"]) == {"rectangular", "triangular", "elliptical"}
    assert value["decision"] == "triangular"
    keys = {"start", "end", "belief", "start_covariance_px2", "end_covariance_px2"}
    assert all(set(e) == keys for e in value["fitted_edges"])
    assert all({"kind", "belief"} < set(p) for p in value["primitives"])


def test_the_same_picture_gives_the_same_answer() -> None:
    image = picture("rectangle", 0.5)
    assert [s.to_json() for s in sense_shapes(image)] == [s.to_json() for s in sense_shapes(image.copy())]


def test_what_is_no_picture_is_refused() -> None:
    with pytest.raises(ImageError, match="at least 8 x 8"):
        sense_shapes(np.zeros((1, 1), np.uint8))


def test_noise_level_is_measured() -> None:
    rng = np.random.default_rng(6)
    for sigma in (3.0, 12.0):
        image = np.clip(np.linspace(60, 190, 320) + rng.normal(0, sigma, (240, 320)), 0, 255).astype(np.uint8)
        assert noise_level(image) == pytest.approx(sigma, rel=0.1)


def test_a_view_gives_the_detector_as_many_edges_as_a_copy() -> None:
    wide = np.hstack([picture("rectangle"), picture("ellipse")])
    view = wide[:, 320:]
    assert sum(map(len, EdgeDrawing()(view))) == sum(map(len, EdgeDrawing()(view.copy())))
