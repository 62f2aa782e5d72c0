"""Pictures from files and arrays: what works, and one clear line for what does not."""

import struct
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest

from evifuse.errors import ImageError
from evifuse.recordings.headers import declared_size
from evifuse.recordings.images import as_image, read_image

COLOUR = np.random.default_rng(5).integers(0, 256, (20, 30, 3), dtype=np.uint8)


def write(path: Path, array: np.ndarray) -> Path:
    assert cv2.imwrite(str(path), array)
    return path


@pytest.mark.parametrize("name", ["a.png", "a.bmp", "a.tiff", "a.ppm"])
def test_a_lossless_colour_file_is_read_as_it_is(tmp_path: Path, name: str) -> None:
    image = read_image(write(tmp_path / name, COLOUR))
    assert image.flags.c_contiguous
    np.testing.assert_array_equal(image, COLOUR)


def test_grey_stays_grey(tmp_path: Path) -> None:
    np.testing.assert_array_equal(read_image(write(tmp_path / "g.png", COLOUR[..., 0])), COLOUR[..., 0])


def test_transparency_is_laid_over_white(tmp_path: Path) -> None:
    rgba = np.dstack([COLOUR, np.full(COLOUR.shape[:2], 255, np.uint8)])
    rgba[:10, :, 3] = 0
    image = read_image(write(tmp_path / "t.png", rgba))
    assert (image[:10] == 255).all()
    np.testing.assert_array_equal(image[10:], COLOUR[10:])


def test_16_bit_files_keep_their_contrast(tmp_path: Path) -> None:
    deep = COLOUR[..., 0].astype(np.uint16) * 257
    np.testing.assert_array_equal(read_image(write(tmp_path / "d.png", deep)), COLOUR[..., 0])


def test_a_12_bit_picture_is_not_dark() -> None:
    ramp = np.tile(np.linspace(0, 4095, 32).astype(np.uint16), (16, 1))
    assert as_image(ramp).max() == 255


@pytest.mark.parametrize("scale", [1.0, 1 / 255])
@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_floats_of_either_range(scale: float, kind: type) -> None:
    np.testing.assert_array_equal(as_image((COLOUR * scale).astype(kind)), COLOUR)


def test_a_view_becomes_contiguous() -> None:
    view = as_image(COLOUR[::2, ::-1])
    assert view.flags.c_contiguous
    np.testing.assert_array_equal(view, COLOUR[::2, ::-1])


def test_first_frame_of_an_animation(tmp_path: Path) -> None:
    animation = cv2.Animation()
    animation.frames = [np.full((16, 16, 3), v, np.uint8) for v in (0, 255)]
    animation.durations = np.array([100, 100], np.int32)
    path = tmp_path / "a.gif"
    assert cv2.imwriteanimation(str(path), animation)
    assert read_image(path).max() < 30


@pytest.mark.parametrize(
    ("array", "words"),
    [
        (np.zeros((1, 1), np.uint8), "at least 8 x 8"),
        (np.zeros((0, 9), np.uint8), "at least 8 x 8"),
        (np.zeros((9, 9, 5), np.uint8), "shape"),
        (np.zeros(9, np.uint8), "shape"),
        (np.full((9, 9), np.nan), "NaN or infinite"),
        (np.full((9, 9), np.inf), "NaN or infinite"),
        (np.full((9, 9), -0.5), "negative"),
        (np.full((9, 9), 300.0), "300"),
        (np.full((9, 9), 70000), "16 bits"),
        (np.full((9, 9), "x"), "expected integers or floats"),
        (np.broadcast_to(np.uint8(0), (20000, 20000)), "scale it down"),
    ],
)
def test_arrays_that_are_no_pictures(array: np.ndarray, words: str) -> None:
    with pytest.raises(ImageError, match=words) as caught:
        as_image(array, "image seen.png")
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith("image seen.png")


def test_files_that_are_no_pictures(tmp_path: Path) -> None:
    (tmp_path / "empty.png").touch()
    (tmp_path / "text.png").write_text("not a picture")
    for name, words in [
        ("gone.png", "does not exist"),
        ("empty.png", "is empty"),
        ("text.png", "is not an image"),
        ("", "is a directory"),
    ]:
        with pytest.raises(ImageError, match=words) as caught:
            read_image(tmp_path / name)
        assert "\n" not in str(caught.value)
        assert str(tmp_path) in str(caught.value)


@pytest.mark.parametrize("name", ["a.png", "a.jpg"])
@pytest.mark.parametrize("share", [0.1, 0.5, 0.9, 0.999])
def test_truncated_files_are_refused(tmp_path: Path, name: str, share: float) -> None:
    whole = write(tmp_path / name, np.tile(COLOUR, (8, 8, 1))).read_bytes()
    path = tmp_path / f"cut-{name}"
    path.write_bytes(whole[: int(len(whole) * share)])
    with pytest.raises(ImageError, match=r"truncated|not an image"):
        read_image(path)


def test_a_gigantic_declared_size_is_refused_before_decoding(tmp_path: Path) -> None:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", 60000, 60000, 8, 0, 0, 0, 0)
    body = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(b"\0" * 99)) + chunk(b"IEND", b"")
    path = tmp_path / "bomb.png"
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + body)
    with pytest.raises(ImageError, match="60000 x 60000"):
        read_image(path)


@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.bmp", "a.tiff", "a.webp", "a.gif"])
def test_declared_size_agrees_with_the_decoder(tmp_path: Path, name: str) -> None:
    assert declared_size(write(tmp_path / name, COLOUR).read_bytes()) == (30, 20)
