"""Quiet hypothesis settings, and simulated scenes that are made once."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
from hypothesis import settings

from evifuse.recordings import write_scene
from evifuse.simulation import SimulatedScene, simulate

settings.register_profile("evifuse", deadline=None, derandomize=True, max_examples=60)
settings.load_profile("evifuse")

PHOTOS = Path(__file__).parent / "data" / "photos"


@cache
def simulated(name: str) -> SimulatedScene:
    return simulate(name, seed=3)


@pytest.fixture(scope="session")
def scene_of() -> Callable[[str], SimulatedScene]:
    """A simulated scene by the name of its surface."""
    return simulated


@pytest.fixture(scope="session")
def scene_file(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The MCAP file of a simulated scene by the name of its surface."""
    folder = tmp_path_factory.mktemp("scenes")

    def file(name: str) -> Path:
        path = folder / f"{name}.mcap"
        if not path.exists():
            write_scene(path, simulated(name).scene)
        return path

    return file
