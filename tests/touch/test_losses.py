"""A finger that jumps off the surface or slips for a moment feels the same surface."""

import numpy as np
import pytest

from evifuse.simulation import Noise, simulate
from evifuse.simulation import noise as noises
from evifuse.simulation.surfaces import surface
from evifuse.touch import FeltSurface, sense_curvature


def felt(name: str, radius_m: float, noise: Noise) -> FeltSurface:
    touch = simulate(
        surface(name, radius_m=radius_m), rate_hz=250, picture=False, noise=noise, seed=47
    ).scene.touch
    assert touch is not None
    return sense_curvature(touch)


def errors(surface: FeltSurface, name: str, radius_m: float) -> list[float]:
    """Of both curvatures at every site, relative to the larger."""
    truth = {"sphere": (-1 / radius_m, -1 / radius_m), "cylinder": (0.0, -1 / radius_m)}[name]
    found: list[float] = []
    for site in surface.sites:
        assert site.shape is not None
        pairs = zip((site.shape.k1_per_m, site.shape.k2_per_m), truth, strict=True)
        found += [abs(k - true) * radius_m for k, true in pairs]
    return found


def test_losses_and_bursts_of_slip_hardly_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    """About three jumps of 0.1 s in each recording, slip for 0.3 s at a time: less than twice the error."""
    monkeypatch.setattr(noises, "LIFTED_S", 0.1)
    monkeypatch.setattr(noises, "BURST_S", 0.3)
    modest = {"pressure_pa": 200.0, "position_m": 2e-5, "angle_rad": 2e-3}
    found: dict[str, list[float]] = {"calm": [], "troubled": []}
    for name, radius_m in (("sphere", 0.012), ("sphere", 0.05), ("cylinder", 0.012), ("cylinder", 0.025)):
        calm = felt(name, radius_m, Noise(**modest))
        troubled = felt(name, radius_m, Noise(**modest, loss_of_contact=3 / 8, slip=0.3))
        assert len(troubled.sites) == len(calm.sites) == 2  # half a roll is no site of its own
        found["calm"] += errors(calm, name, radius_m)
        found["troubled"] += errors(troubled, name, radius_m)
    assert np.median(found["troubled"]) < 2 * np.median(found["calm"])
    assert max(found["troubled"]) < 0.05
