"""What goes wrong with real taxels: some are dead or stuck, all saturate, drift, are quantised, and leak.

Our own models; the order is that of the signal's way through a sensor: the skin spreads the load, the
baseline drifts, the amplifier clips, the converter rounds, and a broken taxel says nothing of all that.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from evifuse.errors import UsageError
from evifuse.recordings.recording import Fingertip, TouchRecording

__all__ = ["BrokenTaxels", "Defects", "broken_taxels", "with_defects"]


@dataclass(frozen=True)
class Defects:
    """How many taxels are broken and how, drawn from a seed.

    Parameters
    ----------
    dead : float
        Share of the taxels that read 0 whatever happens, in [0, 1].
    stuck : float
        Share that are stuck at one value between 0 and the largest pressure of the recording, in [0, 1].
    drifting : float
        Share whose baseline moves, in [0, 1].
    drift_pa_per_s : float
        Standard deviation of their linear drift, pascals per second.
    wander_pa : float
        Standard deviation that their random walk reaches after one second, pascals.
    saturation_pa : float
        Largest pressure that is read; infinity for none.
    step_pa : float
        Quantisation step, pascals; 0 for none.
    crosstalk_m : float
        Standard deviation of a Gaussian point spread between taxels, metres; 0 for none.
    seed : int
        Which taxels, which values.
    """

    dead: float = 0.0
    stuck: float = 0.0
    drifting: float = 0.0
    drift_pa_per_s: float = 0.0
    wander_pa: float = 0.0
    saturation_pa: float = np.inf
    step_pa: float = 0.0
    crosstalk_m: float = 0.0
    seed: int = 0


@dataclass(frozen=True)
class BrokenTaxels:
    """Which taxels are broken.

    Parameters
    ----------
    dead, stuck, drifting : ndarray of bool, shape (N,)
        No taxel is both dead and stuck; broken ones don't drift.
    """

    dead: NDArray[np.bool_]
    stuck: NDArray[np.bool_]
    drifting: NDArray[np.bool_]


def broken_taxels(defects: Defects, taxels: int) -> BrokenTaxels:
    """Choose the taxels that are broken: the truth beside `with_defects`.

    Parameters
    ----------
    defects : Defects
        Shares and seed.
    taxels : int
        How many taxels N there are.

    Returns
    -------
    BrokenTaxels
        Which are broken.

    Raises
    ------
    UsageError
        If a share is not in [0, 1], dead and stuck ones are more than all, or a size is negative.
    """
    shares = (defects.dead, defects.stuck, defects.drifting)
    sizes = (
        defects.drift_pa_per_s,
        defects.wander_pa,
        defects.saturation_pa,
        defects.step_pa,
        defects.crosstalk_m,
    )
    if not (all(0 <= share <= 1 for share in shares) and defects.dead + defects.stuck <= 1):
        raise UsageError("shares of defective taxels must be in [0, 1], and dead and stuck ones together too")
    if not all(size >= 0 for size in sizes):
        raise UsageError(
            "drift, wander, saturation, step and crosstalk of defective taxels must not be negative"
        )
    generator = np.random.default_rng([defects.seed, 1])
    order = generator.permutation(taxels)
    dead, stuck = round(defects.dead * taxels), round(defects.stuck * taxels)
    masks = np.zeros((3, taxels), dtype=np.bool_)
    masks[0, order[:dead]] = True
    masks[1, order[dead : dead + stuck]] = True
    masks[2, generator.permutation(taxels)[: round(defects.drifting * taxels)]] = True
    masks[2] &= ~(masks[0] | masks[1])
    return BrokenTaxels(*masks)


def with_defects(touch: TouchRecording, defects: Defects) -> TouchRecording:
    """What the same touch reads with defective taxels.

    Parameters
    ----------
    touch : TouchRecording
        Pressures of sound taxels.
    defects : Defects
        What is wrong; the same ones change the same recording alike, bit by bit.

    Returns
    -------
    TouchRecording
        With other pressures.

    Raises
    ------
    UsageError
        See `broken_taxels`.
    """
    broken = broken_taxels(defects, len(touch.fingertip.positions_m))
    generator = np.random.default_rng([defects.seed, 2])
    pressure = touch.pressure_pa.copy()
    top = float(pressure.max(initial=0.0))
    if defects.crosstalk_m > 0:
        pressure = pressure @ _crosstalk(touch.fingertip, defects.crosstalk_m)
    if broken.drifting.any():
        pressure[:, broken.drifting] += _drift(touch.time_ns, int(broken.drifting.sum()), defects, generator)
    pressure = np.minimum(pressure, defects.saturation_pa)
    levels = generator.uniform(0.0, top, len(broken.stuck))
    if defects.step_pa > 0:
        pressure = np.round(pressure / defects.step_pa) * defects.step_pa
        levels = np.round(levels / defects.step_pa) * defects.step_pa
    pressure[:, broken.dead] = 0.0
    pressure[:, broken.stuck] = levels[broken.stuck]
    return replace(touch, pressure_pa=pressure)


def _crosstalk(fingertip: Fingertip, width_m: float) -> NDArray[np.float64]:
    """Matrix (N, N): what one loaded taxel adds to each other; every row sums to 1."""
    apart = fingertip.positions_m[:, None] - fingertip.positions_m[None]
    weight = np.exp(-np.square(apart).sum(axis=-1) / (2 * width_m**2))
    return weight / weight.sum(axis=1, keepdims=True)


def _drift(
    time_ns: NDArray[np.int64], taxels: int, defects: Defects, generator: np.random.Generator
) -> NDArray[np.float64]:
    """Baselines (T, taxels): a line and a random walk from 0, pascals."""
    seconds = (time_ns - time_ns[0]) * 1e-9
    line = seconds[:, None] * generator.normal(0.0, defects.drift_pa_per_s, taxels)
    steps = (
        generator.normal(0.0, 1.0, (len(seconds), taxels)) * np.sqrt(np.diff(seconds, prepend=0.0))[:, None]
    )
    return line + defects.wander_pa * np.cumsum(steps, axis=0)
