"""What the shape sensor makes of odd pictures: noise at 1080p, and time and memory of pictures of 8K.

Noise shows nothing, so every object in it is a false one. Memory is the growth of a fresh process's peak
while a picture of 7680 x 4320 px is read and seen, after a small one was; it is compared with the decoded
picture. The peak is read from /proc, so that part needs Linux.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from evifuse.recordings import read_image
from evifuse.vision import sense_shapes

PHOTO = Path(__file__).parents[1] / "tests" / "data" / "photos" / "road-00001.jpg"
SHAPE = (1080, 1920)
Noise = Callable[[np.random.Generator], NDArray[np.uint8]]


def gaussian(sigma: float, mean: float = 128.0) -> Noise:
    return lambda g: np.clip(g.normal(mean, sigma, SHAPE), 0, 255).astype(np.uint8)


def smoothed(width_px: float) -> Noise:
    """Noise through a lens that blurs, stretched to the whole range again."""

    def make(g: np.random.Generator) -> NDArray[np.uint8]:
        soft = cv2.GaussianBlur(g.normal(size=SHAPE), (0, 0), width_px)
        return np.clip(128 + 50 * soft / soft.std(), 0, 255).astype(np.uint8)

    return make


def salt_and_pepper(g: np.random.Generator) -> NDArray[np.uint8]:
    return np.where(g.random(SHAPE) < 0.1, 255 * g.integers(0, 2, SHAPE), 128).astype(np.uint8)


NOISES: dict[str, Noise] = {
    **{f"gaussian, sigma {s}": gaussian(s) for s in (2, 10, 30, 60)},
    "gaussian, dark, sigma 4": gaussian(4, 6.0),
    "uniform, grey": lambda g: g.integers(0, 256, SHAPE, dtype=np.uint8),
    "uniform, colour": lambda g: g.integers(0, 256, (*SHAPE, 3), dtype=np.uint8),
    "salt and pepper, 10 %": salt_and_pepper,
    "blurred by 1 px": smoothed(1),
    "blurred by 2 px": smoothed(2),
}


def false_objects(make: Noise, seeds: int) -> dict[str, Any]:
    found = [(seed, o) for seed in range(seeds) for o in sense_shapes(make(np.random.default_rng(seed)))]
    beliefs = [o.primitives[0].belief for _, o in found]
    with_one = sorted({seed for seed, _ in found})
    return {"objects": len(found), "seeds": with_one, "highest belief": max(beliefs, default=0.0)}


def large_pictures(folder: Path) -> dict[str, tuple[Path, int]]:
    """Files of 8K and the bytes of each when decoded."""
    image = cv2.resize(read_image(PHOTO), (7680, 4320), interpolation=cv2.INTER_CUBIC)
    alpha = np.dstack([image, np.full(image.shape[:2], 255, np.uint8)])
    kinds = {
        "JPEG": ("a.jpg", image),
        "PNG, grey": ("b.png", np.ascontiguousarray(image[..., 1])),
        "PNG, alpha": ("c.png", alpha),
        "PNG, 16 bit": ("d.png", image.astype(np.uint16) * 257),
        "PNG, 16 bit, alpha": ("e.png", alpha.astype(np.uint16) * 257),
        "TIFF, float": ("f.tiff", (image / 255).astype(np.float32)),
    }
    for name, pixels in kinds.values():
        quick = [cv2.IMWRITE_PNG_COMPRESSION, 1] if name.endswith("png") else []
        cv2.imwrite(str(folder / name), pixels, quick)
    return {kind: (folder / name, pixels.nbytes) for kind, (name, pixels) in kinds.items()}


def peak_bytes() -> int:
    """Most memory that this process ever held; unlike getrusage, without what its parent held."""
    status = Path("/proc/self/status").read_text()
    return next(int(line.split()[1]) * 1024 for line in status.splitlines() if line.startswith("VmHWM"))


def see(image: NDArray[np.uint8]) -> None:
    """The whole sensor: objects, and the primitives and fitted edges of each."""
    for seen in sense_shapes(image):
        _ = seen.primitives, seen.fitted_edges


def one_large(path: str) -> None:
    """In a process of its own: seconds to read and to see, and how much the peak grew."""
    see(read_image(PHOTO))
    before, start = peak_bytes(), time.perf_counter()
    image = read_image(path)
    read = time.perf_counter()
    see(image)
    print(json.dumps([read - start, time.perf_counter() - read, peak_bytes() - before]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--json", type=Path, help="also write the figures here")
    parser.add_argument("--one", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        one_large(arguments.one)
        return
    figures: dict[str, Any] = {"noise": {}, "8K": {}}
    print(
        f"{f'noise of 1920 x 1080, {arguments.seeds} seeds':<36}{'false objects':>14}{'highest belief':>16}"
    )
    for name, make in NOISES.items():
        found = figures["noise"][name] = false_objects(make, arguments.seeds)
        print(f"{name:<36}{found['objects']:>14}{found['highest belief']:>16.2f}", flush=True)
    print(f"\n{'7680 x 4320':<24}{'read (s)':>10}{'see (s)':>10}{'peak (MB)':>12}{'times the image':>18}")
    with tempfile.TemporaryDirectory() as folder:
        for kind, (path, size) in large_pictures(Path(folder)).items():
            command = [sys.executable, __file__, "--one", str(path)]
            done = subprocess.run(command, capture_output=True, text=True, check=True)
            read, see, grown = json.loads(done.stdout)
            figures["8K"][kind] = {"read_s": read, "see_s": see, "peak_bytes": grown, "ratio": grown / size}
            print(f"{kind:<24}{read:>10.2f}{see:>10.2f}{grown / 1e6:>12.0f}{grown / size:>18.1f}", flush=True)
    if arguments.json:
        arguments.json.write_text(json.dumps(figures, indent=2) + "\n")


if __name__ == "__main__":
    main()
