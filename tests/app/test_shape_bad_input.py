"""Pictures that are none, too small, too large or cut off: one line that says what to do, and exit code 2."""

import struct
import tracemalloc
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest

from evifuse.app.main import main
from evifuse.vision import sense_shapes


def run(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as stopped:
        main(["shape", *map(str, arguments)])
    out, err = capsys.readouterr()
    assert isinstance(stopped.value.code, int)
    return stopped.value.code, out, err


def disc() -> np.ndarray:
    return cv2.circle(np.full((120, 160, 3), 200, np.uint8), (80, 60), 32, (60, 40, 90), -1, cv2.LINE_AA)


def bomb(path: Path) -> Path:
    """Two million bytes of PNG that are a whole picture of 500 million pixels."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    packer = zlib.compressobj(1)
    row = bytes(25001) * 1000
    data = b"".join(packer.compress(row) for _ in range(20)) + packer.flush()
    header = struct.pack(">IIBBBBB", 25000, 20000, 8, 0, 0, 0, 0)
    chunks = chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunks)
    return path


def floats(value: float) -> np.ndarray:
    image = np.full((100, 100), 0.5, np.float32)
    image[3, 4] = value
    return image


@pytest.mark.parametrize(
    ("name", "pixels", "says"),
    [
        ("one.png", np.zeros((1, 1), np.uint8), "1 x 1 px: at least 8 x 8 px"),
        ("high.png", np.zeros((10000, 1), np.uint8), "1 x 10000 px: at least 8 x 8 px"),
        ("wide.png", np.zeros((1, 10000), np.uint8), "10000 x 1 px: at least 8 x 8 px"),
        ("nan.tiff", floats(np.nan), "NaN or infinite"),
        ("inf.tiff", floats(np.inf), "NaN or infinite"),
        ("below.tiff", floats(-1.0), "negative"),
    ],
)
def test_pictures_that_are_none(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, name: str, pixels: np.ndarray, says: str
) -> None:
    assert cv2.imwrite(str(tmp_path / name), pixels)
    for arguments in ([tmp_path / name], [tmp_path / name, "--json"]):
        code, out, err = run(capsys, *arguments)
        assert (code, out) == (2, "")
        assert err.startswith("evifuse: ")
        assert says in err
        assert err.count("\n") == 1


def test_half_a_jpeg(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "a.jpg"), disc())
    whole = (tmp_path / "a.jpg").read_bytes()
    (tmp_path / "a.jpg").write_bytes(whole[: len(whole) // 2])
    code, out, err = run(capsys, tmp_path / "a.jpg")
    assert (code, out) == (2, "")
    assert "a.jpg is truncated" in err
    assert err.count("\n") == 1


def test_a_bomb_is_refused_before_it_is_decoded(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """Nothing of its 500 MB is ever laid out."""
    path = bomb(tmp_path / "bomb.png")
    tracemalloc.start()
    try:
        code, out, err = run(capsys, path)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert (code, out) == (2, "")
    assert "25000 x 20000 px: scale it down" in err
    assert err.count("\n") == 1
    assert peak < 50_000_000


def test_nothing_in_narrow_pictures() -> None:
    """Shapes of a few pixels' width are not made up."""
    noise = np.random.default_rng(3).integers(0, 256, (10000, 8), dtype=np.uint8)
    for image in (noise, noise.T, np.zeros((10000, 8), np.uint8)):
        assert sense_shapes(image) == ()


def test_no_camera(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = run(capsys, "--camera", 77)
    assert (code, out) == (2, "")
    assert err == "evifuse: --camera 77: there is no such camera, or another program uses it\n"


def test_only_broken_files(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        (tmp_path / name).write_text("text")
    code, out, err = run(capsys, tmp_path)
    assert (code, out) == (2, "")
    assert [line.split()[-1] for line in err.splitlines()[:2]] == ["WebP", "WebP"]
    assert err.splitlines()[2].endswith("2 files could not be used, named above")
