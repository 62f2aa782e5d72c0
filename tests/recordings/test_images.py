"""Pictures from files and arrays: what works, and one clear line for what does not."""

import os
import struct
import threading
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image, ImageOps

from evifuse.errors import ImageError
from evifuse.recordings import images
from evifuse.recordings.animation import frame_count
from evifuse.recordings.depth import read_depth
from evifuse.recordings.headers import declared_size
from evifuse.recordings.images import as_image, read_image
from evifuse.recordings.orientation import stored_orientation

COLOUR = np.random.default_rng(5).integers(0, 256, (20, 30, 3), dtype=np.uint8)

SMOOTH = np.stack(np.broadcast_arrays(*np.ogrid[0:200:20j, 0:240:30j], 120.0), axis=-1).astype(np.uint8)


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


FORMATS = ["a.png", "a.jpg", "a.bmp", "a.tiff", "a.webp", "a.gif", "a.ppm"]


@pytest.mark.parametrize("name", FORMATS)
def test_declared_size_agrees_with_the_decoder(tmp_path: Path, name: str) -> None:
    assert declared_size(write(tmp_path / name, COLOUR).read_bytes()) == (30, 20)


def test_declared_size_of_what_other_programs_write(tmp_path: Path) -> None:
    picture = Image.fromarray(np.ascontiguousarray(COLOUR[..., ::-1]))
    for name, options in {
        "lossy.webp": {},
        "alpha.webp": {"exif": b"Exif\0\0II*\0\x08\0\0\0\0\0"},
        "lossless.webp": {"lossless": True},
        "progressive.jpg": {"progressive": True},
        "lzw.tif": {"compression": "tiff_lzw"},
        "big.tif": {"big_tiff": True},
    }.items():
        picture.save(tmp_path / name, **options)
        expected = None if name == "big.tif" else (30, 20)
        assert declared_size((tmp_path / name).read_bytes()) == expected
    old = b"BM" + struct.pack("<IHHI", 26 + 92 * 20, 0, 0, 26) + struct.pack("<IHHHH", 12, 30, 20, 1, 24)
    assert declared_size(old + bytes(92 * 20)) == (30, 20)
    assert declared_size(b"P6 # a comment\n# another\n30 20\n255\n" + bytes(1800)) == (30, 20)


def bomb(name: str, path: Path, width: int = 25000, height: int = 20000) -> Path:
    """A small file that declares a picture of 500 million pixels."""
    data = bytearray(write(path / name, COLOUR).read_bytes())
    kind = name[2:]
    if kind == "png":
        struct.pack_into(">II", data, 16, width, height)
    elif kind == "jpg":
        struct.pack_into(">HH", data, data.index(b"\xff\xc0") + 5, height, width)
    elif kind == "bmp":
        struct.pack_into("<ii", data, 18, width, -height)
    elif kind == "gif":
        struct.pack_into("<HH", data, 6, width, height)
    elif kind == "webp":
        inner = bytes(data[12:])
        canvas = (width - 1).to_bytes(3, "little") + (height - 1).to_bytes(3, "little")
        data = bytearray(data[:12] + b"VP8X" + struct.pack("<I", 10) + bytes(4) + canvas + inner)
    elif kind == "tiff":
        start = struct.unpack_from("<I", data, 4)[0]
        for i in range(struct.unpack_from("<H", data, start)[0]):
            tag = struct.unpack_from("<H", data, start + 2 + 12 * i)[0]
            if tag in (256, 257):
                struct.pack_into("<HII", data, start + 4 + 12 * i, 4, 1, width if tag == 256 else height)
    else:
        data = data.replace(b"30 20", b"%d %d" % (width, height))
    (path / name).write_bytes(data)
    return path / name


@pytest.mark.parametrize("name", FORMATS)
def test_bombs_are_refused_before_decoding(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def opened(data: bytes) -> None:
        raise AssertionError("decoded")

    monkeypatch.setattr(images, "decoded", opened)
    with pytest.raises(ImageError, match="25000 x 20000 px: scale it down"):
        read_image(bomb(name, tmp_path))


def test_formats_whose_size_is_not_known_before_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(images, "decoded", None)
    path = write(tmp_path / "a.jp2", np.tile(COLOUR, (8, 8, 1)))
    with pytest.raises(ImageError, match="not an image that can be read"):
        read_image(path)


def test_gigantic_files_are_refused_before_they_are_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(images, "MAX_BYTES", 1000)
    with pytest.raises(ImageError, match="more than 1,000 bytes"):
        read_image(write(tmp_path / "a.bmp", COLOUR))


def test_a_picture_from_a_pipe_is_read_to_its_end(tmp_path: Path) -> None:
    whole = write(tmp_path / "a.bmp", np.tile(COLOUR, (40, 60, 1))).read_bytes()
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    writer = threading.Thread(target=pipe.write_bytes, args=(whole,))
    writer.start()
    content = images.bytes_of(pipe)
    writer.join()
    assert len(whole) > 3 << 20
    assert content == whole


@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.gif", "a.bmp", "a.tiff", "a.webp", "a.ppm"])
@pytest.mark.parametrize("share", [0.3, 0.5, 0.9])
def test_no_format_is_read_when_it_is_cut_off(tmp_path: Path, name: str, share: float) -> None:
    path = write(tmp_path / name, np.tile(COLOUR, (4, 4, 1)))
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * share)])
    with pytest.raises(ImageError):
        read_image(path)


RGB = np.ascontiguousarray(SMOOTH[..., ::-1])


@pytest.mark.parametrize("mode", ["1", "L", "P", "LA", "RGBA", "CMYK"])
def test_colours_of_every_kind(tmp_path: Path, mode: str) -> None:
    """What Pillow makes of its own file; transparency is full here."""
    suffix = ".jpg" if mode == "CMYK" else ".png"
    path = tmp_path / f"a{suffix}"
    made = Image.fromarray(RGB).convert(mode)
    made.save(path, **({"quality": 95} if mode == "CMYK" else {}))
    image = read_image(path)
    found = image if image.ndim == 2 else image[..., ::-1]
    with Image.open(path) as again:
        expected = np.asarray(again.convert("L" if image.ndim == 2 else "RGB"))
    assert np.abs(found.astype(int) - expected).max() <= 2


def test_a_palette_with_a_transparent_colour(tmp_path: Path) -> None:
    made = Image.new("P", (20, 10), 1)
    made.putpalette([10, 20, 30, 200, 100, 50])
    made.paste(0, (0, 0, 10, 10))
    made.save(tmp_path / "p.png", transparency=0)
    image = read_image(tmp_path / "p.png")
    assert (image[:, :10] == 255).all()
    assert (image[:, 10:] == [50, 100, 200]).all()


@pytest.mark.parametrize("orientation", range(1, 9))
@pytest.mark.parametrize("name", ["a.jpg", "a.tif", "a.png", "a.webp"])
def test_pictures_of_a_turned_camera_stand_upright(tmp_path: Path, name: str, orientation: int) -> None:
    exif = Image.Exif()
    exif[0x0112] = orientation
    options = {"a.jpg": {"quality": 100, "subsampling": 0}, "a.webp": {"lossless": True}}.get(name, {})
    Image.fromarray(RGB).save(tmp_path / name, exif=exif, **options)
    with Image.open(tmp_path / name) as made:
        upright = np.asarray(ImageOps.exif_transpose(made))
    image = read_image(tmp_path / name)
    assert image.shape == upright.shape
    assert np.abs(image[..., ::-1].astype(int) - upright).max() <= 2


@pytest.mark.parametrize("mode", ["L", "P", "LA", "RGBA"])
@pytest.mark.parametrize("name", ["a.png", "a.webp"])
def test_turned_pictures_of_every_kind(tmp_path: Path, mode: str, name: str) -> None:
    exif = Image.Exif()
    exif[0x0112] = 6
    picture = Image.fromarray(RGB).convert(mode)
    picture.save(tmp_path / name, exif=exif, **({"lossless": True} if name == "a.webp" else {}))
    image = read_image(tmp_path / name)
    assert image.shape[:2] == (30, 20)
    with Image.open(tmp_path / name) as made:
        expected = np.asarray(ImageOps.exif_transpose(made).convert("L" if image.ndim == 2 else "RGB"))
    found = image if image.ndim == 2 else image[..., ::-1]
    assert np.abs(found.astype(int) - expected).max() <= 2


@pytest.mark.parametrize(
    ("exif", "orientation"),
    [
        (b"Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x08\0\0\0", 8),
        (b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x03\0\0", 3),
        (b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x09\0\0", 1),
        (b"MM\0*\0\0\0\x08\0\x09\x01\x12", 1),
        (b"MM\0*\xff\xff\xff\xff", 1),
        (b"Exif", 1),
        (b"", 1),
    ],
)
def test_orientation_of_odd_exif(exif: bytes, orientation: int) -> None:
    chunk = struct.pack(">I4s", len(exif), b"eXIf") + exif + bytes(4)
    assert stored_orientation(b"\x89PNG\r\n\x1a\n" + chunk) == orientation
    odd = b"EXIF" + struct.pack("<I", len(exif)) + exif + bytes(len(exif) % 2)
    before = b"ALPH" + struct.pack("<I", 3) + bytes(4)
    assert stored_orientation(b"RIFF" + bytes(4) + b"WEBP" + before + odd) == orientation


def test_16_bits_with_transparency(tmp_path: Path) -> None:
    deep = np.dstack([COLOUR, np.full(COLOUR.shape[:2], 255, np.uint8)]).astype(np.uint16) * 257
    deep[:10, :, 3] = 0
    image = read_image(write(tmp_path / "d.png", deep))
    assert (image[:10] == 255).all()
    np.testing.assert_array_equal(image[10:], COLOUR[10:])


def test_large_pictures_are_converted_as_small_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    """Row by row, and all at once."""
    deep = np.random.default_rng(2).integers(0, 65536, (37, 11, 4)).astype(np.uint16)
    whole = as_image(deep), as_image((deep / 65535).astype(np.float32))
    monkeypatch.setattr(images, "_BLOCK", 20)
    np.testing.assert_array_equal(as_image(deep), whole[0])
    np.testing.assert_array_equal(as_image((deep / 65535).astype(np.float32)), whole[1])


def test_frames_are_counted(tmp_path: Path) -> None:
    frames = [Image.fromarray(np.full((16, 16, 3), v, np.uint8)) for v in (0, 90, 180, 250)]
    for name in ("a.gif", "a.png", "a.webp", "a.tif"):
        frames[0].save(tmp_path / name, save_all=True, append_images=frames[1:])
        assert frame_count(tmp_path / name) == 4
        assert read_image(tmp_path / name).max() < 30
        frames[0].save(tmp_path / name)
        assert frame_count(tmp_path / name) == 1
    (tmp_path / "a.gif").write_bytes(b"GIF89a\x10\0")
    assert frame_count(tmp_path / "a.gif") == 1
    assert frame_count(write(tmp_path / "a.jpg", COLOUR)) == 1


def test_a_chain_of_pages_in_a_circle_ends(tmp_path: Path) -> None:
    (tmp_path / "a.tif").write_bytes(b"II*\0" + struct.pack("<IHI", 8, 0, 8))
    assert frame_count(tmp_path / "a.tif") > 1


def test_depths_are_metres(tmp_path: Path) -> None:
    expected = np.array([[0.5, np.nan], [2.0, np.nan]] * 5)
    np.save(tmp_path / "a.npy", np.array([[0.5, np.inf], [2.0, 0.0]] * 5, np.float32))
    write(tmp_path / "a.tiff", np.array([[0.5, np.nan], [2.0, 0.0]] * 5, np.float32))
    write(tmp_path / "a.png", np.array([[500, 0], [2000, 0]] * 5, np.uint16))
    for name in ("a.npy", "a.tiff", "a.png"):
        np.testing.assert_array_equal(read_depth(tmp_path / name), expected)
    with pytest.raises(ImageError, match="shape"):
        read_depth(write(tmp_path / "c.png", COLOUR.astype(np.uint16)))
    with pytest.raises(ImageError, match="25000 x 20000"):
        read_depth(bomb("a.png", tmp_path))
