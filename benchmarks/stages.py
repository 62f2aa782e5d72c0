"""Time of each stage: a photo of 640 x 480 and a recording of 10 s at 1 kHz.

Stages are interleaved over the rounds, so that a busy machine slows all of them alike; medians are printed.
The photo is one of the test photographs, scaled to 640 x 480; the recording is a simulated cylinder.
"""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from evifuse.conductivity import classify
from evifuse.fusion import fuse, fuse_percepts
from evifuse.knowledge import load_knowledge
from evifuse.recordings import read_image, read_scene, write_scene
from evifuse.simulation import simulate
from evifuse.touch import sense_curvature
from evifuse.vision import EdgeDrawing, sense_shapes

PHOTOS = Path(__file__).parents[1] / "tests" / "data" / "photos"


def seconds(work: Callable[[], Any]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def start_up(*arguments: str) -> Callable[[], Any]:
    return lambda: subprocess.run([sys.executable, *arguments], capture_output=True, check=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--json", type=Path, help="also write the medians here")
    arguments = parser.parse_args()
    photo = max(PHOTOS.glob("*.jpg"), key=lambda p: p.stat().st_size)
    image = cv2.resize(read_image(photo), (640, 480), interpolation=cv2.INTER_AREA)
    grey = np.ascontiguousarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY))
    made = simulate("cylinder", seed=0)
    touch = made.scene.touch
    assert touch is not None
    span = (touch.time_ns[-1] - touch.time_ns[0]) / 1e9
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "scene.mcap"
        write_scene(file, made.scene)
        felt, seen = sense_curvature(touch), sense_shapes(image)
        detector = EdgeDrawing()
        stages: dict[str, Callable[[], Any]] = {
            "import numpy (whole process)": start_up("-c", "import numpy"),
            "import evifuse (whole process)": start_up("-c", "import evifuse"),
            "evifuse --help (whole process)": start_up("-m", "evifuse", "--help"),
            "shape: edge detection": lambda: detector(grey),
            "shape: objects": lambda: sense_shapes(image),
            "shape: whole sensor": lambda: [(s.primitives, s.fitted_edges) for s in sense_shapes(image)],
            "touch: whole sensor": lambda: sense_curvature(touch),
            "classify one percept": lambda: classify(felt.evidence, load_knowledge("curvature")),
            "fuse two percepts": lambda: fuse_percepts(seen[0] if seen else None, felt),
            "write scene (MCAP)": lambda: write_scene(file, made.scene),
            "read scene (MCAP)": lambda: read_scene(file),
            "fuse a scene, all of it": lambda: fuse(made.scene),
            "simulate 10 s and a picture": lambda: simulate("cylinder", seed=0),
        }
        times: dict[str, list[float]] = {name: [] for name in stages}
        for round_ in range(arguments.rounds + 1):
            for name, work in stages.items():
                if name.startswith("simulate") and round_ > 2:
                    continue
                taken = seconds(work)
                if round_ > 0:  # the first round warms up
                    times[name].append(taken)
    medians = {name: statistics.median(values) for name, values in times.items()}
    print(f"photo {photo.name} at 640 x 480: {len(seen)} objects; medians of {arguments.rounds} rounds")
    samples, taxels = touch.pressure_pa.shape
    print(f"recording: {samples} samples, {span:.1f} s, {taxels} taxels\n")
    for name, value in medians.items():
        print(f"{name:<34} {1000 * value:10.2f} ms")
    ratio = medians["evifuse --help (whole process)"] / medians["import numpy (whole process)"]
    print(f"\nevifuse --help takes {ratio:.2f} times the import of NumPy")
    print(f"touch runs at {span / medians['touch: whole sensor']:.0f} times real time")
    if arguments.json:
        arguments.json.write_text(json.dumps(medians, indent=2) + "\n")


if __name__ == "__main__":
    main()
