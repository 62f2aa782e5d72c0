"""What ``evifuse shape`` takes in and gives out: many files, videos, cameras, drawings, metres, bad input."""

import json
import os
import pty
import re
import shlex
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from evifuse.app import shapes, videos
from evifuse.app.labels import place_labels
from evifuse.app.main import main
from evifuse.recordings import write_scene
from evifuse.recordings.recording import Camera, Scene
from evifuse.vision import sense_shapes

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    def call(*arguments: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as stopped:
            main(["shape", *map(str, arguments)])
        out, err = capsys.readouterr()
        assert isinstance(stopped.value.code, int)
        assert "Traceback" not in err
        return stopped.value.code, out, err

    return call


def disc(x: int = 80) -> np.ndarray:
    image = np.full((120, 160, 3), 200, np.uint8)
    return cv2.circle(image, (x, 60), 32, (60, 40, 90), -1, cv2.LINE_AA)


def lines_of(out: str) -> list[dict]:
    return [json.loads(line) for line in out.splitlines()]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Three pictures, a note, a hidden file, and a folder with one more."""
    (tmp_path / "in" / "deeper").mkdir(parents=True)
    for name in ("a10.png", "a9.png", "b.JPG", "deeper/c.png"):
        assert cv2.imwrite(str(tmp_path / "in" / name), disc())
    (tmp_path / "in" / "notes.txt").write_text("not a picture")
    (tmp_path / "in" / ".hidden.png").write_text("not a picture either")
    return tmp_path / "in"


@pytest.fixture
def film(tmp_path: Path) -> Path:
    """Twelve frames, 25 each second."""
    path = tmp_path / "film.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), 25, (160, 120))
    for i in range(12):
        writer.write(disc(60 + 3 * i))
    writer.release()
    return path


# Which pictures


def test_a_folder_gives_a_line_for_each_picture_in_the_order_of_counting(run: Run, folder: Path) -> None:
    code, out, err = run(folder, "--json")
    found = lines_of(out)
    assert code == 0
    assert [Path(f["path"]).name for f in found] == ["a9.png", "a10.png", "b.JPG"]
    assert all(f["objects"][0]["decision"] == "elliptical" for f in found)
    assert all(set(f) == {"path", "objects"} for f in found)
    assert err.startswith("evifuse: 3 objects in 3 pictures")


def test_patterns_are_followed_here_when_the_shell_does_not(run: Run, folder: Path) -> None:
    names = [Path(f["path"]).name for f in lines_of(run(folder / "a*", "--json")[1])]
    assert names == ["a9.png", "a10.png"]
    names = [Path(f["path"]).name for f in lines_of(run(folder / "**" / "*.png", "--json")[1])]
    assert names == ["a9.png", "a10.png", "c.png"]
    assert len(lines_of(run(folder / "a9.png", folder, folder / "a*", "--json")[1])) == 3


def test_a_name_with_brackets_is_a_name(run: Run, folder: Path) -> None:
    shutil.copy(folder / "a9.png", folder / "x[1].png")
    code, out, _ = run(folder / "x[1].png", "--json")
    assert (code, list(json.loads(out))) == (0, ["objects"])


def test_one_picture_gives_one_object_as_ever(run: Run, folder: Path) -> None:
    code, out, err = run(folder / "a9.png", "--json")
    assert (code, err) == (0, "")
    assert list(json.loads(out)) == ["objects"]


def test_a_table_of_many(run: Run, folder: Path) -> None:
    code, out, _ = run(folder)
    header, *rows = out.splitlines()
    assert code == 0
    assert " ".join(header.split()) == "picture objects and the belief in them, best primitive first"
    assert len(rows) == 3
    assert all("elliptical 0." in row for row in rows)


def recorded(path: Path, image: np.ndarray) -> Path:
    """A recording of a picture by a camera of 800 px focal length."""
    matrix = np.array([[800.0, 0, 159.5], [0, 800, 119.5], [0, 0, 1]])
    height, width = image.shape[:2]
    camera = Camera(width, height, matrix, np.zeros(3), np.array([0.0, 0, 0, 1]))
    write_scene(path, Scene(image, camera, None))
    return path


def test_a_name_of_any_bytes(run: Run, tmp_path: Path) -> None:
    image = bytes(cv2.imencode(".png", disc())[1])
    try:
        (tmp_path / os.fsdecode(b"\xff.png")).write_bytes(image)
    except OSError:
        pytest.skip("this file system wants names in UTF-8")
    done = subprocess.run(
        [sys.executable, "-m", "evifuse", "shape", str(tmp_path)], capture_output=True, text=True, check=True
    )
    assert "udcff.png  elliptical" in done.stdout
    assert lines_of(run(tmp_path, "--json")[1])[0]["path"].endswith("\udcff.png")


def test_a_closed_pipe_is_not_an_error(folder: Path) -> None:
    command = f"{sys.executable} -m evifuse shape {folder} {folder}/deeper --json | head -c 1"
    done = subprocess.run(["bash", "-o", "pipefail", "-c", command], capture_output=True, check=False)
    assert (done.returncode, done.stdout) == (0, b"{")
    assert b"Traceback" not in done.stderr


def test_a_recording_counts_as_a_picture(run: Run, tmp_path: Path) -> None:
    file = recorded(tmp_path / "seen.mcap", disc())
    found = lines_of(run(tmp_path, "--json")[1])
    assert [f["path"] for f in found] == [str(file)]
    assert found[0]["objects"]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["{in}/deeper/*.gif"], "this pattern holds no picture"),
        (["{tmp}/empty"], "this folder holds no picture"),
        ([], "IMAGE"),
        (["{in}/a9.png", "--camera", "0"], "not both"),
        (["{in}/a9.png", "--every", "0"], "--every 0"),
        (["{in}/a9.png", "--frames", "0"], "--frames 0"),
        (["--camera", "77"], "no such camera"),
        (["--camera", "-1"], "numbered from 0"),
        (["--camera", "1800"], "numbered from 0"),
        (["{in}", "--draw", "{tmp}/x.png"], "name a folder"),
        (["{in}", "--draw", "{in}"], "draw to another place"),
        (["{in}/a9.png", "--draw", "{in}/a9.png"], "draw to another place"),
        (["{in}/deeper/missing.mp4"], "missing.mp4"),
        (["{in}/deeper/notes.mp4"], "not a video"),
        (["{in}/deeper/none.mp4"], "none.mp4 is empty"),
    ],
)
def test_mistakes_in_a_line(run: Run, folder: Path, tmp_path: Path, arguments: list[str], says: str) -> None:
    (tmp_path / "empty").mkdir()
    (folder / "deeper" / "notes.mp4").write_text("not a video")
    (folder / "deeper" / "none.mp4").write_text("")
    whole = (folder / "a9.png").read_bytes()
    code, _, err = run(*(a.replace("{in}", str(folder)).replace("{tmp}", str(tmp_path)) for a in arguments))
    assert code == 2
    assert says in err
    assert all(line.startswith("evifuse: ") for line in err.splitlines())
    assert (folder / "a9.png").read_bytes() == whole


# One broken among many


def test_one_broken_among_a_thousand(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shapes, "sense_shapes", lambda image, base: ())
    first = tmp_path / "0.png"
    cv2.imwrite(str(first), disc())
    for i in range(1, 1000):
        (tmp_path / f"{i}.png").hardlink_to(first)
    (tmp_path / "437.png").unlink()
    (tmp_path / "437.png").write_bytes(first.read_bytes()[:300])
    code, out, err = run(tmp_path, "--json")
    names = [Path(f["path"]).name for f in lines_of(out)]
    assert code == 2
    assert names == [f"{i}.png" for i in range(1000) if i != 437]
    broken, summary = err.splitlines()
    assert "437.png is truncated" in broken
    assert "0 objects in 999 pictures" in summary
    assert "1 file could not be used" in summary


def test_what_went_wrong_is_said_for_each_and_the_rest_is_done(run: Run, folder: Path) -> None:
    (folder / "a1.png").write_text("text")
    code, out, err = run(folder / "gone.png", folder, "--json")
    assert code == 2
    assert len(lines_of(out)) == 3
    assert "gone.png" in err.splitlines()[0]
    assert "a1.png" in err.splitlines()[1]
    assert "2 files could not be used" in err.splitlines()[2]


def test_too_little_memory_for_one_of_many(run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def greedy(image: np.ndarray, base: object) -> tuple:
        raise MemoryError

    monkeypatch.setattr(shapes, "sense_shapes", greedy)
    code, _, err = run(folder)
    assert code == 2
    assert err.count("not enough memory") == 3


def test_a_slip_of_ours_is_not_called_a_broken_file(
    run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(image: np.ndarray, base: object) -> tuple:
        raise ZeroDivisionError("ours")

    monkeypatch.setattr(shapes, "sense_shapes", broken)
    assert run(folder)[0] == 1


def test_ctrl_c_keeps_what_was_done(run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []

    def stopped(image: np.ndarray, base: object) -> tuple:
        calls.append(1)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return sense_shapes(image)

    monkeypatch.setattr(shapes, "sense_shapes", stopped)
    code, out, err = run(folder, "--json")
    assert code == 130
    assert len(lines_of(out)) == 2
    assert err.startswith("evifuse: stopped: 2 objects in 2 pictures")
    assert err.count("\n") == 1


def test_ctrl_c_in_a_process_of_its_own(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "0.png"), disc())
    for i in range(1, 2000):
        (tmp_path / f"{i}.png").hardlink_to(tmp_path / "0.png")
    process = subprocess.Popen(
        [sys.executable, "-m", "evifuse", "shape", str(tmp_path), "--json"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    first = process.stdout.readline()
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert 1 <= len(lines_of(first + out)) < 2000
    assert err.startswith("evifuse: stopped: ")
    assert err.count("\n") == 1


def test_the_bar_is_for_a_terminal_and_leaves_the_output_alone(folder: Path) -> None:
    terminal, end = pty.openpty()
    done = subprocess.run(
        [sys.executable, "-m", "evifuse", "shape", str(folder), "--json"],
        stdout=subprocess.PIPE,
        stderr=end,
        check=True,
        env={**os.environ, "TERM": "xterm", "COLUMNS": "100"},
    )
    os.close(end)
    shown = b""
    try:
        while part := os.read(terminal, 65536):
            shown += part
    except OSError:
        pass  # nothing more to read
    os.close(terminal)
    assert len(lines_of(done.stdout.decode())) == 3
    assert b"\x1b[" in shown
    assert b"0/3" in shown
    assert b"3 objects in 3 pictures" in shown


# Videos and cameras


def test_every_frame_of_a_video_with_its_time(run: Run, film: Path) -> None:
    code, out, err = run(film, "--json")
    found = lines_of(out)
    assert code == 0
    assert [f["frame"] for f in found] == list(range(12))
    assert [f["time_s"] for f in found] == pytest.approx(np.arange(12) / 25)
    assert {f["path"] for f in found} == {str(film)}
    left = [f["objects"][0]["box"][0] for f in found]
    np.testing.assert_allclose(left, 28 + 3 * np.arange(12), atol=2)
    assert "12 pictures" in err


def test_some_frames_of_a_video(run: Run, film: Path) -> None:
    found = lines_of(run(film, "--every", 5, "--json")[1])
    assert [f["frame"] for f in found] == [0, 5, 10]
    found = lines_of(run(film, "--every", 2, "--frames", 3, "--json")[1])
    assert [f["frame"] for f in found] == [0, 2, 4]
    assert [f["time_s"] for f in found] == pytest.approx([0, 0.08, 0.16])


def test_a_video_that_was_cut_off_gives_its_whole_frames_and_is_listed(run: Run, film: Path) -> None:
    data = film.read_bytes()
    film.write_bytes(data[: len(data) // 2])
    code, out, err = run(film, "--json")
    found = lines_of(out)
    assert code == 2
    assert 1 <= len(found) < 12
    assert f"it ends after {len(found)} of its 12 frames" in err


def test_a_gigantic_video_is_refused_before_a_frame_is_decoded(
    run: Run, film: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(videos, "MAX_PIXELS", 160 * 120 - 1)
    monkeypatch.setattr(videos, "_retrieved", None)
    code, _, err = run(film)
    assert code == 2
    assert "160 x 120 px: scale it down" in err


@pytest.fixture
def camera(film: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A camera with number 0 that shows the film once."""
    monkeypatch.setattr(videos, "_capture", lambda which: cv2.VideoCapture(str(film)))


@pytest.mark.usefixtures("camera")
def test_a_camera(run: Run) -> None:
    code, out, _ = run("--camera", 0, "--every", 3, "--frames", 4, "--json")
    found = lines_of(out)
    assert code == 0
    assert [f["path"] for f in found] == ["camera 0"] * 4
    assert [f["frame"] for f in found] == [0, 3, 6, 9]
    assert found[0]["time_s"] == 0
    assert (np.diff([f["time_s"] for f in found]) > 0).all()


@pytest.mark.usefixtures("camera")
def test_a_camera_that_stops(run: Run) -> None:
    code, out, err = run("--camera", 0, "--frames", 99)
    assert code == 2
    assert len(out.splitlines()) == 1 + 12
    assert "gives no more pictures after 12" in err


# Drawings


def test_drawings_of_many_have_names_of_their_own(run: Run, folder: Path, film: Path, tmp_path: Path) -> None:
    shutil.copy(folder / "a9.png", folder / "b.png")
    out = tmp_path / "drawn" / "here"
    assert run(folder, film, "--every", 6, "--draw", out)[0] == 0
    names = sorted(p.name for p in out.iterdir())
    assert names == ["a10.png", "a9.png", "b-2.png", "b.png", "film-000000.png", "film-000006.png"]
    drawn = cv2.imread(str(out / "film-000006.png"))
    assert drawn.shape[0] > 400
    assert drawn.std() > 10


def test_one_drawing_into_a_folder(run: Run, folder: Path, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    assert run(folder / "a9.png", "--draw", tmp_path / "out")[0] == 0
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["a9.png"]


def test_labels_never_cover_each_other() -> None:
    random = np.random.default_rng(4)
    boxes = np.column_stack([random.uniform(0, 350, (60, 2)), random.uniform(5, 60, (60, 2))])
    sizes = [(float(w), 14.0) for w in random.uniform(40, 110, 60)]
    places = place_labels(boxes, sizes, (400.0, 400.0))
    put = [(*p, p[0] + w, p[1] + h) for p, (w, h) in zip(places, sizes, strict=True) if p is not None]
    assert 25 < len(put) < 60
    for i, a in enumerate(put):
        assert 0 <= a[0] <= a[2] <= 400
        assert 0 <= a[1] <= a[3] <= 400
        assert all(a[0] >= b[2] or a[2] <= b[0] or a[1] >= b[3] or a[3] <= b[1] for b in put[:i])


# Bad and odd input


@pytest.mark.parametrize("sigma", [10, 30, 60, None])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_noise_shows_nothing(sigma: float | None, seed: int) -> None:
    random = np.random.default_rng(seed)
    if sigma is None:
        noise = random.integers(0, 256, (1080, 1920), dtype=np.uint8)
    else:
        noise = np.clip(random.normal(128, sigma, (1080, 1920)), 0, 255).astype(np.uint8)
    assert sense_shapes(noise) == ()


@pytest.mark.parametrize("value", [0, 128, 255])
def test_plain_pictures_show_nothing(run: Run, tmp_path: Path, value: int) -> None:
    cv2.imwrite(str(tmp_path / "plain.png"), np.full((480, 640, 3), value, np.uint8))
    code, out, _ = run(tmp_path / "plain.png")
    assert (code, out) == (0, "Seen: no object.\n")
    assert run(tmp_path / "plain.png", "--json")[1] == '{"objects": []}\n'


def test_a_saturated_picture_keeps_what_is_not(run: Run, tmp_path: Path) -> None:
    image = np.full((240, 320), 255, np.uint8)
    image[:, :3] = 0
    cv2.circle(image, (160, 120), 60, 180, -1, cv2.LINE_AA)
    cv2.imwrite(str(tmp_path / "bright.png"), image)
    found = json.loads(run(tmp_path / "bright.png", "--json")[1])["objects"]
    assert found[0]["decision"] == "elliptical"


def test_an_animation_is_said_to_be_one(run: Run, tmp_path: Path) -> None:
    animation = cv2.Animation()
    animation.frames = [disc(), disc(100), disc(120)]
    animation.durations = np.array([100, 100, 100], np.int32)
    assert cv2.imwriteanimation(str(tmp_path / "a.gif"), animation)
    code, out, err = run(tmp_path / "a.gif", "--json")
    assert code == 0
    assert abs(json.loads(out)["objects"][0]["box"][0] - 48) <= 2
    assert err == f"evifuse: {tmp_path}/a.gif: an animation: the first of its 3 frames is taken\n"


def test_decoders_say_nothing_of_their_own(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "a.jpg"), disc())
    data = (tmp_path / "a.jpg").read_bytes()
    (tmp_path / "a.jpg").write_bytes(data[: len(data) // 2])
    cv2.imwrite(str(tmp_path / "d.png"), disc())
    data = bytearray((tmp_path / "d.png").read_bytes())
    data[len(data) // 2] ^= 255
    (tmp_path / "d.png").write_bytes(data)
    (tmp_path / "b.avi").write_bytes(b"RIFF" + bytes(500))
    (tmp_path / "c.mp4").write_bytes(bytes(4) + b"ftypisom" + bytes(500))
    done = subprocess.run(
        [sys.executable, "-m", "evifuse", "shape", str(tmp_path)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert [line.split(":")[0] for line in done.stderr.splitlines()] == ["evifuse"] * 5


@pytest.mark.slow
def test_large_pictures_and_noise(tmp_path: Path) -> None:
    """White noise shows nothing; a picture of 8K needs no more than 20 times its size in memory."""
    benchmark = Path(__file__).parents[2] / "benchmarks" / "pictures.py"
    command = [sys.executable, str(benchmark), "--seeds", "3", "--json", str(tmp_path / "figures.json")]
    subprocess.run(command, capture_output=True, check=True)
    figures = json.loads((tmp_path / "figures.json").read_text())
    white = [name for name in figures["noise"] if name.startswith(("gaussian", "uniform"))]
    assert len(white) == 7
    assert all(figures["noise"][name]["objects"] == 0 for name in white)
    assert all(0 < kind["ratio"] < 20 for kind in figures["8K"].values())


# Metres


@pytest.fixture
def tile(tmp_path: Path) -> Path:
    """A tile of 160 x 80 px, 0.2 m x 0.1 m where 800 px of focal length see it at 1 m."""
    image = np.full((240, 320), 210, np.uint8)
    image[80:160, 80:240] = 60
    cv2.imwrite(str(tmp_path / "tile.png"), image)
    return tmp_path / "tile.png"


def rectangle_in(out: str) -> dict:
    found = json.loads(out)["objects"][0]
    return next(p for p in found["primitives"] if p["kind"] == "rectangle")


CAMERA = ("--intrinsics", "800,800,159.5,119.5")


def yaml_of(folder: Path, **changes: object) -> Path:
    known = {
        "image_width": 320,
        "image_height": 240,
        "camera_matrix": "{rows: 3, cols: 3, data: [800, 0, 159.5, 0, 800, 119.5, 0, 0, 1]}",
        "distortion_model": "plumb_bob",
        "distortion_coefficients": "{rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}",
        **changes,
    }
    path = folder / "camera.yaml"
    path.write_text("".join(f"{k}: {v}\n" for k, v in known.items()))
    return path


@pytest.mark.parametrize("plane", ["0,0,1,1", "0,0,-2,-1"])
def test_metres_on_a_plane(run: Run, tile: Path, plane: str) -> None:
    code, out, err = run(tile, *CAMERA, "--plane", plane, "--json")
    assert (code, err) == (0, "")
    found = rectangle_in(out)
    assert sorted(found["sides_m"]) == pytest.approx([0.1, 0.1, 0.2, 0.2], abs=0.002)
    np.testing.assert_allclose(np.array(found["corners_m"])[:, 2], 1.0)
    np.testing.assert_allclose(np.abs(found["corners_m"])[:, :2], [[0.1, 0.05]] * 4, atol=0.002)
    seen = json.loads(out)["objects"][0]
    assert seen["plane"]["distance_m"] * seen["plane"]["normal"][2] == 1
    assert {"start_m", "end_m", "length_m"} <= set(seen["fitted_edges"][0])


def test_metres_by_depth(run: Run, tile: Path, tmp_path: Path) -> None:
    np.save(tmp_path / "depth.npy", np.full((240, 320), 2.0))
    cv2.imwrite(str(tmp_path / "depth.png"), np.full((240, 320), 2000, np.uint16))
    cv2.imwrite(str(tmp_path / "depth.tiff"), np.full((240, 320), 2, np.float32))
    for depth in (2, tmp_path / "depth.npy", tmp_path / "depth.png", tmp_path / "depth.tiff"):
        code, out, _ = run(tile, *CAMERA, "--depth", depth, "--json")
        assert code == 0
        assert sorted(rectangle_in(out)["sides_m"]) == pytest.approx([0.2, 0.2, 0.4, 0.4], abs=0.004)


def test_metres_in_the_table(run: Run, tile: Path) -> None:
    _, out, _ = run(tile, *CAMERA, "--depth", 1)
    assert "size (m)" in out
    assert "0.200" in out or "0.199" in out


def test_intrinsics_from_a_calibration_file(run: Run, tile: Path) -> None:
    _, plain, _ = run(tile, *CAMERA, "--depth", 1, "--json")
    given = yaml_of(tile.parent)
    assert run(tile, "--intrinsics", given, "--depth", 1, "--json")[1] == plain
    given.write_text("k: [800, 0, 159.5, 0, 800, 119.5, 0, 0, 1]\nd: []\nheight: 240\nwidth: 320\n---\n")
    assert run(tile, "--intrinsics", given, "--depth", 1, "--json")[1] == plain


def test_lens_distortion_is_removed_before_measuring(run: Run, tile: Path) -> None:
    """A tile that is bent by the lens is straight again, and as large as it is."""
    given = yaml_of(tile.parent, distortion_coefficients="[-3.0, 0, 0, 0, 0]")
    k = np.array([[800, 0, 159.5], [0, 800, 119.5], [0, 0, 1]])
    v, u = np.mgrid[:240, :320].astype(np.float32)
    bent = np.stack([u, v], axis=-1).reshape(-1, 1, 2)
    straight = cv2.undistortPoints(bent, k, np.array([-3.0, 0, 0, 0, 0]), P=k).reshape(240, 320, 2)
    seen = cv2.remap(cv2.imread(str(tile)), straight.astype(np.float32), None, cv2.INTER_LINEAR, None, 1)
    cv2.imwrite(str(tile), seen)
    crooked = rectangle_in(run(tile, *CAMERA, "--depth", 1, "--json")[1])["sides_m"]
    sides = rectangle_in(run(tile, "--intrinsics", given, "--depth", 1, "--json")[1])["sides_m"]
    assert sorted(sides) == pytest.approx([0.1, 0.1, 0.2, 0.2], abs=0.002)
    assert max(crooked) < 0.197


def test_a_recording_brings_its_intrinsics(run: Run, tile: Path, tmp_path: Path) -> None:
    file = recorded(tmp_path / "seen.mcap", cv2.imread(str(tile)))
    code, out, _ = run(file, "--depth", 1, "--json")
    assert code == 0
    assert sorted(rectangle_in(out)["sides_m"]) == pytest.approx([0.1, 0.1, 0.2, 0.2], abs=0.002)
    assert out == run(tile, *CAMERA, "--depth", 1, "--json")[1]
    assert out == run(file, "--intrinsics", file, "--depth", 1, "--json")[1]
    write_scene(file, Scene(cv2.imread(str(tile)), None, None))
    code, _, err = run(file, "--depth", 1)
    assert code == 2
    assert "no message on /camera/camera_info" in err


def test_what_lies_above_the_horizon_has_no_metres(run: Run, tmp_path: Path) -> None:
    """A floor 1 m below the camera; its horizon is at the height of the principal point."""
    image = np.full((480, 320), 210, np.uint8)
    image[60:120, 90:230] = 60
    image[330:420, 60:180] = 60
    cv2.imwrite(str(tmp_path / "two.png"), image)
    code, out, _ = run(
        tmp_path / "two.png", "--intrinsics", "800,800,160,240", "--plane", "0,1,0,1", "--json"
    )
    assert code == 0
    high, low = sorted(json.loads(out)["objects"], key=lambda o: o["box"][1])
    assert "behind the camera" in high["not_measured"]
    assert "corners_m" not in high["primitives"][0]
    assert "not_measured" not in low
    assert any("sides_m" in p for p in low["primitives"])
    table = run(tmp_path / "two.png", "--intrinsics", "800,800,160,240", "--plane", "0,1,0,1")[1]
    assert "Not measured: 1 of 2" in table


def test_an_object_in_a_hole_of_the_depth_has_no_metres(run: Run, tile: Path, tmp_path: Path) -> None:
    depth = np.full((240, 320), 2.0)
    depth[60:180, 60:260] = np.nan
    np.save(tmp_path / "depth.npy", depth)
    code, out, _ = run(tile, *CAMERA, "--depth", tmp_path / "depth.npy", "--json")
    assert code == 0
    assert "only 0 depths" in json.loads(out)["objects"][0]["not_measured"]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--intrinsics", "800,800,160,120"], "--plane"),
        (["--plane", "0,0,1,1"], "give --intrinsics"),
        ([*CAMERA, "--plane", "0,0,1,1", "--depth", "1"], "not both"),
        ([*CAMERA, "--plane", "0,0,1"], "four numbers nx,ny,nz,d"),
        ([*CAMERA, "--plane", "0,0,0,1"], "normal"),
        ([*CAMERA, "--plane", "0,0,1,0"], "distance"),
        ([*CAMERA, "--plane", "0,0,1,-1"], "behind the camera"),
        ([*CAMERA, "--plane", "0,0,nan,1"], "normal"),
        ([*CAMERA, "--depth", "0"], "above 0"),
        ([*CAMERA, "--depth", "nan"], "above 0"),
        ([*CAMERA, "--depth", "{tmp}/gone.npy"], "gone.npy does not exist"),
        ([*CAMERA, "--depth", "{tmp}/nan.npy"], "nothing was measured"),
        ([*CAMERA, "--depth", "{tmp}/below.npy"], "negative"),
        ([*CAMERA, "--depth", "{tmp}/flat.npy"], "shape (9,)"),
        ([*CAMERA, "--depth", "{tmp}/small.npy"], "the same pixels"),
        ([*CAMERA, "--depth", "{tmp}/objects.npy"], "not a NumPy file"),
        ([*CAMERA, "--depth", "{tmp}/tile.png"], "holds uint8"),
        ([*CAMERA, "--depth", "{tmp}/camera.yaml"], "not a depth picture"),
        (["--intrinsics", "800,800,160", "--depth", "1"], "four numbers fx,fy,cx,cy"),
        (["--intrinsics", "0,800,160,120", "--depth", "1"], "above 0"),
        (["--intrinsics", "800,inf,160,120", "--depth", "1"], "finite"),
        (["--intrinsics", "{tmp}/gone.yaml", "--depth", "1"], "gone.yaml"),
        (["--intrinsics", "{tmp}/camera.yaml", "--depth", "1"], "its intrinsics are for 640 x 480 px"),
        (["--intrinsics", "{tmp}/list.yaml", "--depth", "1"], "not a ROS camera calibration"),
        (["--intrinsics", "{tmp}/bare.yaml", "--depth", "1"], "neither camera_matrix nor k"),
        (["--intrinsics", "{tmp}/torn.yaml", "--depth", "1"], "not valid YAML"),
        (["--intrinsics", "{tmp}/zero.yaml", "--depth", "1"], "not that of a calibrated camera"),
        (["--intrinsics", "{tmp}/fish.yaml", "--depth", "1"], "'fisheye'"),
        (["--intrinsics", "{tmp}/odd.yaml", "--depth", "1"], "do not fit"),
        (["--intrinsics", "{tmp}/tile.png", "--depth", "1"], "not UTF-8 text"),
    ],
)
def test_what_can_not_be_measured_with(run: Run, tile: Path, arguments: list[str], says: str) -> None:
    here = tile.parent
    fish = yaml_of(here, distortion_model="fisheye", distortion_coefficients="[1, 1, 1, 1]").read_text()
    (here / "fish.yaml").write_text(fish)
    odd = yaml_of(here, distortion_coefficients="[0.1, 0.1, 0.1]").read_text()
    (here / "odd.yaml").write_text(odd)
    yaml_of(here, image_width=640, image_height=480)
    for name, text in {
        "list": "- 1\n",
        "bare": "a: 1\n",
        "torn": "a: [1\n",
        "zero": "k: [0, 0, 0, 0, 0, 0, 0, 0, 0]\n",
    }.items():
        (here / f"{name}.yaml").write_text(text)
    np.save(here / "nan.npy", np.full((240, 320), np.nan))
    np.save(here / "below.npy", np.full((240, 320), -1.0))
    np.save(here / "flat.npy", np.ones(9))
    np.save(here / "small.npy", np.ones((24, 32)))
    np.save(here / "objects.npy", np.array([{}, 1], dtype=object), allow_pickle=True)
    code, out, err = run(tile, *(a.replace("{tmp}", str(here)) for a in arguments))
    assert (code, out) == (2, "")
    assert says in err
    assert err.count("\n") == 1


# The documentation


PAGE = (Path(__file__).parents[2] / "docs" / "shape.md").read_text(encoding="utf-8")
COMMANDS = [
    line.split("#")[0].strip()
    for block in re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL)
    for line in block.splitlines()
]


def test_the_commands_of_the_documentation(
    run: Run, film: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert len(COMMANDS) == 12
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(videos, "_capture", lambda which: cv2.VideoCapture(str(film)))
    image = cv2.resize(disc(), (320, 240))
    for name in ("photo.jpg", "photos/a.jpg", "photos/deeper/b.jpg", "more/c.png"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        cv2.imwrite(name, image)
    shutil.copy(film, "clip.mp4")
    recorded(tmp_path / "scene.mcap", image)
    yaml_of(tmp_path)
    cv2.imwrite("depth.png", np.full((240, 320), 600, np.uint16))
    for command in COMMANDS:
        program, name, *arguments = shlex.split(command)
        assert (program, name) == ("evifuse", "shape")
        arguments = ["12" if a == "100" else "more/c.png" if a == "more/*.png" else a for a in arguments]
        code, out, _ = run(*arguments)
        assert code == 0, command
        assert "elliptical" in out, command
        if {"--plane", "--depth"} & set(arguments) and "--json" in arguments:
            assert "axes_m" in out, command
    assert sorted(p.name for p in (tmp_path / "drawn").iterdir()) == [
        "a.png",
        "clip-000000.png",
        "clip-000005.png",
        "clip-000010.png",
    ]


def test_every_field_in_metres_is_documented(run: Run, tile: Path, tmp_path: Path) -> None:
    np.save(tmp_path / "depth.npy", np.full((240, 320), 2.0))
    cv2.imwrite(str(tmp_path / "disc.png"), cv2.resize(disc(), (320, 240)))
    for name in ("tile.png", "disc.png"):
        _, out, _ = run(tmp_path / name, *CAMERA, "--depth", tmp_path / "depth.npy", "--json")
        for field in set(re.findall(r'"(\w+_m|plane)"', out)):
            assert f"`{field}`" in PAGE
