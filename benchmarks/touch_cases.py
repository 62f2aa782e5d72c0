"""What the benchmarks of touch have in common: levels of noise, and what is felt at each site."""

from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from evifuse.belief import pignistic
from evifuse.recordings.recording import Fingertip
from evifuse.simulation import Noise, SimulatedScene, simulate
from evifuse.simulation.fingertip import Skin
from evifuse.touch import PRIMITIVES, FeltSite, FeltSurface, sense_curvature

NAMES = (*PRIMITIVES, "N")
WHITE = {"pressure_share": 0.1, "position_m": 2e-4, "angle_rad": float(np.deg2rad(0.5))}
NOISES: dict[str, tuple[Noise, Skin]] = {
    "clean": (Noise(), Skin()),
    "modest": (Noise(pressure_pa=200.0, position_m=2e-5, angle_rad=2e-3), Skin()),
    "strong": (Noise(**WHITE), Skin(spread_m=2e-3)),
    "slipping": (Noise(pressure_pa=200.0, position_m=2e-5, angle_rad=2e-3, slip=0.15), Skin()),
}
NOISES["strong peak"] = (Noise(position_m=2e-4, angle_rad=float(np.deg2rad(0.5))), Skin(spread_m=2e-3))
OF_PEAK = {"strong peak": 0.1}
"""Noise on every taxel at all times, over the largest pressure of the recording."""
SAME_PLACE_M = 0.004
OPENING_M = 0.012
FLAT_PER_M = 16.7  # what errors on a plane are compared with


@dataclass(frozen=True)
class SiteRow:
    """One site, as it is and as it was felt; curvatures in 1/m, NaN where they are not known."""

    surface: str
    noise: str
    fingertip: str
    seed: int
    size_m: float
    primitive: str
    k: tuple[float, float]
    felt: tuple[float, float]
    error: tuple[float, float]
    chapter: tuple[float, float]
    pignistic: dict[str, float]
    chapter_pignistic: dict[str, float]
    masses: dict[str, float] = field(default_factory=dict[str, float])
    edge: str = ""
    chapter_masses: dict[str, float] = field(default_factory=dict[str, float])
    radius_m: float = 0.01
    edge_bound_m: float = np.nan

    @property
    def relative(self) -> float:
        """Larger error over the larger principal curvature; NaN if not felt."""
        return _relative(self.felt, self.k)

    @property
    def chapter_relative(self) -> float:
        """The same of the chapter's estimator."""
        return _relative(self.chapter, self.k)

    @property
    def covered(self) -> tuple[bool, ...]:
        """Whether the 95 % intervals of k1 and k2 hold the truth."""
        return tuple(abs(f - t) <= 1.96 * e for f, t, e in zip(self.felt, self.k, self.error, strict=True))

    @property
    def name(self) -> str:
        """The primitive with the largest pignistic probability."""
        return max(self.pignistic, key=self.pignistic.__getitem__)

    def to_json(self) -> dict[str, Any]:
        """Plain values."""
        return asdict(self) | {"relative": self.relative, "chapter_relative": self.chapter_relative}


def _relative(felt: tuple[float, float], true: tuple[float, float]) -> float:
    return max(abs(f - t) for f, t in zip(felt, true, strict=True)) / (max(map(abs, true)) or FLAT_PER_M)


def stream(seed: int, *key: str) -> np.random.Generator:
    """A generator of its own for each seed and purpose."""
    return np.random.default_rng([seed, *(ord(c) for c in "".join(key))])


def touch(
    surface: Any,
    noise: str,
    seed: int,
    *,
    fingertip: Fingertip | None = None,
    finger: str = "sphere 305",
    size_m: float = np.nan,
    **dimensions: float,
) -> list[SiteRow]:
    """Simulate one recording, feel it, and set the truth beside what was felt at each site."""
    kind, skin = NOISES[noise]
    scene = simulate(
        surface, seed=seed, noise=kind, skin=skin, picture=False, fingertip=fingertip, **dimensions
    )
    if noise in OF_PEAK:
        scene = noisy_pressures(scene, OF_PEAK[noise], stream(seed, label_of(surface), noise))
    felt = sense_curvature(scene.scene.touch)
    by_chapter = sense_curvature(scene.scene.touch, belief="chapter")
    return rows_of(scene, felt, by_chapter, (label_of(surface), noise, finger, seed, size_m))


def label_of(surface: Any) -> str:
    """Name of a surface."""
    return surface if isinstance(surface, str) else type(surface).__name__.lower()


def noisy_pressures(scene: SimulatedScene, share: float, generator: np.random.Generator) -> SimulatedScene:
    """White noise of a share of the peak on every taxel."""
    touched = scene.scene.touch
    noise = generator.normal(0, share * float(touched.pressure_pa.max()), touched.pressure_pa.shape)
    touched = replace(touched, pressure_pa=touched.pressure_pa + noise)
    return replace(scene, scene=replace(scene.scene, touch=touched))


def rows_of(
    scene: SimulatedScene,
    felt: FeltSurface,
    by_chapter: FeltSurface,
    key: tuple[str, str, str, int, float],
) -> list[SiteRow]:
    rows: list[SiteRow] = []
    radius = scene.scene.touch.fingertip.radius_m
    for true in scene.truth.sites:
        reach = SAME_PLACE_M if true.contact else max(OPENING_M, radius)
        near = [s for s in felt.sites if np.linalg.norm(s.position_m - true.position_m) < reach]
        site = min(near, key=lambda s: float(np.linalg.norm(s.position_m - true.position_m)), default=None)
        index = next((i for i, s in enumerate(felt.sites) if s is site), -1)
        alone = [c.joint_curvature_per_m for c in felt.local_curvatures if c.site == index]
        unknown = (np.nan, np.nan)
        rows.append(
            SiteRow(
                *key,
                primitive=true.primitive,
                k=unknown
                if true.k1_per_m is None or true.k2_per_m is None
                else (true.k1_per_m, true.k2_per_m),
                felt=unknown
                if site is None or site.shape is None
                else (site.shape.k1_per_m, site.shape.k2_per_m),
                error=_errors(site),
                chapter=(max(alone), min(alone)) if alone else unknown,
                pignistic=_shares(None if site is None else site.evidence),
                chapter_pignistic=_shares(by_chapter.evidence),
                masses={} if site is None else site.evidence.as_dict(),
                edge=_edge(site),
                chapter_masses=by_chapter.evidence.as_dict(),
                radius_m=radius,
                edge_bound_m=np.nan if site is None or site.edge is None else site.edge.largest_radius_m,
            )
        )
    return rows


def _edge(site: FeltSite | None) -> str:
    """What kind of edge was felt, or nothing."""
    if site is None or site.edge is None:
        return ""
    return "corner" if site.edge.corner else "edge"


def _errors(site: FeltSite | None) -> tuple[float, float]:
    if site is None or site.shape is None:
        return (np.nan, np.nan)
    return site.shape.k1_error_per_m, site.shape.k2_error_per_m


def _shares(evidence: Any) -> dict[str, float]:
    if evidence is None:
        return dict.fromkeys(NAMES, 1 / len(NAMES))
    return dict(zip(NAMES, np.asarray(pignistic(evidence)).ravel().tolist(), strict=True))


def interval(values: list[float], measure: Any = np.median, seed: int = 0) -> tuple[float, float, float]:
    """A measure of values with its 95 % bootstrap interval; NaN counts as the worst."""
    worst = np.where(np.isnan(values), np.inf, values)
    if not len(worst):
        return (np.nan, np.nan, np.nan)
    draws = np.random.default_rng(seed).integers(0, len(worst), (400, len(worst)))
    low, high = np.percentile([measure(worst[draw]) for draw in draws], [2.5, 97.5], method="nearest")
    return float(measure(worst)), float(low), float(high)
