"""The same scene gives the same objects, however its pixels are stored."""

import cv2
import numpy as np
import pytest

from evifuse.vision import SeenObject, sense_shapes

TILE = np.array([[30, 60], [140, 45], [152, 130], [42, 146]])
WEDGE = np.array([[300, 60], [380, 80], [330, 180]])


def scene(scale: int = 1) -> np.ndarray:
    """A brown tile, a blue disc and a green wedge on light ground, BGR."""
    image = np.full((240 * scale, 400 * scale, 3), (205, 215, 210), np.uint8)
    cv2.fillPoly(image, [TILE * scale], (60, 80, 120), cv2.LINE_AA)
    cv2.circle(image, (230 * scale, 150 * scale), 52 * scale, (140, 70, 50), -1, cv2.LINE_AA)
    cv2.fillPoly(image, [WEDGE * scale], (60, 110, 70), cv2.LINE_AA)
    return cv2.GaussianBlur(image, (0, 0), 0.7)


SCENE = scene()
GREY = cv2.cvtColor(SCENE, cv2.COLOR_BGR2GRAY)


def view_of(image: np.ndarray) -> np.ndarray:
    """The picture as a window into every other row and column of a larger array, mirrored."""
    whole = np.zeros((image.shape[0] * 2 + 7, image.shape[1] * 2 + 9, *image.shape[2:]), image.dtype)
    whole[5 : 5 + 2 * image.shape[0] : 2, 3 : 3 + 2 * image.shape[1] : 2] = image[:, ::-1]
    window = whole[5 : 5 + 2 * image.shape[0] : 2, 3 : 3 + 2 * image.shape[1] : 2][:, ::-1]
    assert not window.flags.c_contiguous
    assert (window == image).all()
    return window


def to_12_bit(image: np.ndarray) -> np.ndarray:
    return np.round(image.astype(np.float64) * 4095 / 255).astype(np.uint16)


EXACT = {
    "copy": SCENE.copy(),
    "view": view_of(SCENE),
    "fortran": np.asfortranarray(SCENE),
    "16 bit": SCENE.astype(np.uint16) * 257,
    "16 bit, big-endian": (SCENE.astype(np.uint16) * 257).astype(">u2"),
    "16 bit, view": view_of(SCENE.astype(np.uint16) * 257),
    "12 bit": to_12_bit(np.maximum(SCENE, 9)),
    "32 bit integers": SCENE.astype(np.int32),
    "float, 0 to 1": SCENE / 255.0,
    "float, 0 to 255": SCENE.astype(np.float32),
    "float, big-endian": (SCENE / 255.0).astype(">f8"),
    "half floats": SCENE.astype(np.float16),
    "opaque": np.dstack([SCENE, np.full(SCENE.shape[:2], 255, np.uint8)]),
    "16 bit, opaque": np.dstack([SCENE, np.full(SCENE.shape[:2], 255, np.uint8)]).astype(np.uint16) * 257,
    "lists": SCENE.tolist(),
}


def as_numbers(seen: tuple[SeenObject, ...]) -> list[tuple[str | None, list[int], np.ndarray]]:
    in_order = sorted(seen, key=lambda s: s.box)
    return [(s.classification.decision, list(s.box), s.primitives[0].shape) for s in in_order]


@pytest.fixture(scope="module")
def expected() -> list[tuple[str | None, list[int], np.ndarray]]:
    found = as_numbers(sense_shapes(SCENE))
    assert [f[0] for f in found] == ["rectangular", "elliptical", "triangular"]
    return found


@pytest.mark.parametrize("how", EXACT)
def test_the_same_pixels_stored_otherwise(how: str, expected: list) -> None:
    for (decision, box, shape), (same, as_box, as_shape) in zip(
        as_numbers(sense_shapes(EXACT[how])), expected, strict=True
    ):
        assert (decision, box) == (same, as_box)
        np.testing.assert_allclose(shape, as_shape, atol=1e-6)


@pytest.mark.parametrize(
    ("how", "image"),
    [
        ("grey", GREY),
        ("grey, one channel", GREY[..., None]),
        ("grey, float", GREY / 255.0),
        ("grey, 16 bit, big-endian", (GREY.astype(np.uint16) * 257).astype(">u2")),
        ("grey, opaque", np.dstack([GREY, np.full_like(GREY, 255)])),
        ("channels exchanged", SCENE[..., ::-1]),
        ("on a transparent ground", np.dstack([SCENE, np.where(GREY > 190, 0, 255).astype(np.uint8)])),
    ],
)
def test_other_colours_show_the_same_to_half_a_pixel(how: str, image: np.ndarray, expected: list) -> None:
    for (decision, box, shape), (same, as_box, as_shape) in zip(
        as_numbers(sense_shapes(image)), expected, strict=True
    ):
        assert decision == same, how
        np.testing.assert_allclose(box, as_box, atol=2)
        off = np.linalg.norm(shape[:, None] - as_shape, axis=2).min(axis=1)
        assert off.max() < (4 if len(shape) == 48 else 1), how  # points of an ellipse start anywhere


def test_8k_shows_the_same_eighteen_times_as_large(expected: list) -> None:
    found = as_numbers(sense_shapes(scene(18)))
    assert [f[0] for f in found] == [f[0] for f in expected]
    for shape, truth in ((found[0][2], TILE * 18), (found[2][2], WEDGE * 18)):
        assert np.linalg.norm(shape[:, None] - truth, axis=2).min(axis=1).max() < 4
