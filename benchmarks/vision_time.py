"""Time of the whole shape sensor beside EdgeDrawing's own lines and ellipses, and beside LSD's lines.

All see the same photographs, cropped and scaled to 640 x 480 and 1920 x 1080 px, in turns, in one thread
each; medians are printed, and ratios of the medians. *Objects* is `sense_shapes`: places, evidence and
classes of all objects. *Whole* also reads every primitive and fitted edge, as the command line does. A
profile says where the time goes: samples, every millisecond, by the file of the package that was at work.
Last, what the first picture of a new process costs (machine code is already cached on disk).

Usage: python benchmarks/vision_time.py [--data DIR] [--rounds 9] [--json FILE]
DIR holds `signs/`, whose first photographs are added at 1920 x 1080 px.
"""

import argparse
import json
import signal
import statistics
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import cv2
import numpy as np
from threadpoolctl import threadpool_limits
from vision_data import Image

import evifuse
from evifuse.recordings.images import read_image
from evifuse.vision import sense_shapes

PACKAGE = f"{Path(evifuse.__file__).parent}/"
PHOTOS = Path(__file__).parents[1] / "tests" / "data" / "photos"
SMALL = ("road-00001.jpg", "blocks.jpg", "board.jpg", "box.jpg", "desk.jpg", "sudoku.jpg", "sweets.jpg")
SIZES = {"640 x 480": (640, 480), "1920 x 1080": (1920, 1080)}
TICK_S = 0.001

FIRST = """
import json, sys, time
start = time.perf_counter()
from evifuse.recordings.images import read_image
from evifuse.vision import sense_shapes
took = [time.perf_counter() - start]
image = read_image(sys.argv[1])
for _ in range(3):
    start = time.perf_counter()
    [(s.primitives, s.fitted_edges) for s in sense_shapes(image)]
    took.append(time.perf_counter() - start)
print(json.dumps(took))
"""


def scaled(image: Image, size: tuple[int, int]) -> Image:
    """The middle of a picture with the proportions of a size, in this size."""
    height, width = image.shape[:2]
    share = min(width / size[0], height / size[1])
    w, h = round(size[0] * share), round(size[1] * share)
    x, y = (width - w) // 2, (height - h) // 2
    how = cv2.INTER_AREA if share > 1 else cv2.INTER_CUBIC
    return np.ascontiguousarray(cv2.resize(image[y : y + h, x : x + w], size, interpolation=how), np.uint8)


def photographs(size: str, data: Path | None) -> dict[str, Image]:
    """Photographs by name; those that are much smaller than the size are left out."""
    files = [PHOTOS / name for name in SMALL]
    if data is not None and size != "640 x 480":
        files += sorted((data / "signs").glob("*.jpg"))[1:5]
    images = {file.name: read_image(file) for file in files}
    least = 0.5 * SIZES[size][0]
    return {name: scaled(image, SIZES[size]) for name, image in images.items() if image.shape[1] >= least}


def grey_of(image: Image) -> Image:
    return np.ascontiguousarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)) if image.ndim == 3 else image


def edge_drawing(image: Image) -> None:
    detector = cv2.ximgproc.createEdgeDrawing()
    detector.detectEdges(grey_of(image))
    detector.detectLines()
    detector.detectEllipses()


def lsd(image: Image) -> None:
    cv2.createLineSegmentDetector().detect(grey_of(image))


def objects(image: Image) -> None:
    sense_shapes(image)


def whole(image: Image) -> None:
    for seen in sense_shapes(image):
        _ = seen.primitives, seen.fitted_edges


CONTESTANTS: dict[str, Callable[[Image], None]] = {
    "EdgeDrawing": edge_drawing,
    "LSD": lsd,
    "objects": objects,
    "whole": whole,
}


def in_turns(image: Image, rounds: int) -> dict[str, float]:
    """Median seconds of each; the first round warms up."""
    taken: dict[str, list[float]] = {name: [] for name in CONTESTANTS}
    for number in range(rounds + 1):
        for name, work in CONTESTANTS.items():
            start = time.perf_counter()
            work(image)
            if number:
                taken[name].append(time.perf_counter() - start)
    return {name: statistics.median(values) for name, values in taken.items()}


def profile(images: list[Image], rounds: int) -> dict[str, float]:
    """Share of the time of the whole sensor by the innermost file of the package that was at work.

    A sample counts as long as it took since the one before, so that a long call into a library counts in full
    for the file that made it.
    """
    seconds: Counter[str] = Counter()
    last = time.perf_counter()

    def sample(_: int, frame: FrameType | None) -> None:
        nonlocal last
        now = time.perf_counter()
        while frame is not None and not frame.f_code.co_filename.startswith(PACKAGE):
            frame = frame.f_back
        if frame is not None:
            seconds[frame.f_code.co_filename[len(PACKAGE) :]] += now - last
        last = time.perf_counter()
        signal.setitimer(signal.ITIMER_REAL, TICK_S)  # only once this one is done

    before = signal.signal(signal.SIGALRM, sample)
    signal.setitimer(signal.ITIMER_REAL, TICK_S)
    try:
        for _ in range(rounds):
            for image in images:
                whole(image)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    total = sum(seconds.values())
    return {name: value / total for name, value in seconds.most_common()}


def first_picture() -> list[float]:
    """Seconds to import, to see the first picture, and to see it twice again, in a new process."""
    command = [sys.executable, "-c", FIRST, str(PHOTOS / "desk.jpg")]
    tries = [
        json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
        for _ in range(4)
    ]
    return [statistics.median(values) for values in zip(*tries[1:], strict=True)]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--json", type=Path, help="also write the figures here")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    figures: dict[str, Any] = {"rounds": options.rounds, "opencv": cv2.__version__}
    with threadpool_limits(1):
        for size in SIZES:
            images = photographs(size, options.data)
            print(f"{size:18}{'':4}" + "".join(f"{name + ' (ms)':>18}" for name in CONTESTANTS) + "   ratio")
            rows: dict[str, dict[str, float]] = {}
            for name, image in images.items():
                rows[name] = in_turns(image, options.rounds)
                print_row(name, rows[name])
            middle = {c: statistics.median(r[c] for r in rows.values()) for c in CONTESTANTS}
            ratios = [r["whole"] / r["EdgeDrawing"] for r in rows.values()]
            print_row("median", middle)
            print(f"ratio whole / EdgeDrawing: {statistics.median(ratios):.2f} in the median,", end=" ")
            print(f"{min(ratios):.2f} to {max(ratios):.2f}\n")
            shares = profile(list(images.values()), max(2, options.rounds // 3))
            print(f"where the time of the whole sensor goes at {size}")
            for file, share in list(shares.items())[:14]:
                print(f"    {file:40}{100 * share:6.1f} %{1000 * share * middle['whole']:9.2f} ms")
            print(flush=True)
            figures[size] = {"photographs": rows, "median": middle, "ratios": ratios, "profile": shares}
    took = figures["first picture"] = first_picture()
    print(f"new process: import {took[0]:.2f} s, first picture {took[1]:.2f} s, then {1000 * took[3]:.0f} ms")
    if options.json:
        options.json.write_text(json.dumps(figures, indent=1) + "\n")


def print_row(name: str, row: dict[str, float]) -> None:
    cells = "".join(f"{1000 * row[c]:18.2f}" for c in CONTESTANTS)
    print(f"{name:22}{cells}{row['whole'] / row['EdgeDrawing']:8.2f}", flush=True)


if __name__ == "__main__":
    main()
