"""The reading of unloaded taxels, and how it moves (our own)."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import TouchRecording

__all__ = ["Baseline", "baseline_of", "without_baseline"]

WINDOWS = 20
"""Pieces of a recording in which the baseline is measured."""
FREE = 0.1
"""A sample is without contact when no taxel rises above its middle reading by this share of the peak,"""
QUIET = 1.5
"""or by so many times what the quietest samples show, which is noise,"""
PAUSES = 0.35
"""provided that the quietest samples show less than this share of the loudest."""
FEWEST = 4
"""Free samples that a piece must have."""
OFTEN_LOADED = 0.2
"""A taxel whose middle reading is over its low ones by more than this share of the peak is often loaded."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Baseline:
    """Readings of unloaded taxels at some instants.

    Parameters
    ----------
    seconds : ndarray of float64, shape (W,)
        Instants, from the start of the recording.
    level_pa : ndarray of float64, shape (W, N)
        Reading of each taxel without contact, pascals.
    error_pa : float
        Standard error of a level, pascals.
    """

    seconds: Array
    level_pa: Array
    error_pa: float


def baseline_of(recording: TouchRecording) -> Baseline:
    """Measure the baseline in the pauses between touches.

    Parameters
    ----------
    recording : TouchRecording
        T samples of N taxels.

    Returns
    -------
    Baseline
        One level only where the finger was hardly ever without contact.
    """
    seconds = (recording.time_ns - recording.time_ns[0]) * 1e-9
    every = max(1, len(seconds) // (40 * WINDOWS))
    sample, at = np.ascontiguousarray(recording.pressure_pa[::every]), seconds[::every]
    piece = np.minimum((WINDOWS * np.arange(len(at))) // max(len(at), 1), WINDOWS - 1)
    found = _measured(sample, at, piece, sample)
    for _ in range(2):  # pauses are told better once the drift is known
        if len(found.seconds) > 1:
            found = _measured(sample, at, piece, sample - _levels(found, at))
    return found


def _measured(sample: Array, at: Array, piece: NDArray[np.int64], level: Array) -> Baseline:
    """Baseline in the pauses that pressures show from which the drift known so far is taken off."""
    from evifuse.touch._kernels_health import window_levels

    rows = np.flatnonzero(_free(level))
    size = np.bincount(piece[rows], minlength=WINDOWS)
    enough = size >= FEWEST
    rows, size = rows[enough[piece[rows]]], size[enough]
    if not len(size):
        return Baseline(np.zeros(1), np.zeros((1, sample.shape[1])), np.inf)
    starts = np.concatenate([[0], np.cumsum(size)])
    middle, scatter = window_levels(sample, rows, starts)
    seconds = np.add.reduceat(at[rows], starts[:-1]) / size
    return Baseline(seconds, middle, 1.48 * 1.25 * float(np.median(scatter)) / np.sqrt(int(size.min())))


def without_baseline(recording: TouchRecording, baseline: Baseline) -> TouchRecording:
    """Subtract a baseline, linear between its instants.

    Parameters
    ----------
    recording : TouchRecording
        T samples of N taxels.
    baseline : Baseline
        Its baseline.

    Returns
    -------
    TouchRecording
        With pressures that are 0 without contact, but for noise.
    """
    seconds = (recording.time_ns - recording.time_ns[0]) * 1e-9
    return replace(recording, pressure_pa=recording.pressure_pa - _levels(baseline, seconds))


def _levels(baseline: Baseline, seconds: Array) -> Array:
    """Baseline (T, N) at instants, linear between those of the baseline and beyond them."""
    last = len(baseline.seconds) - 1
    if last == 0:
        return np.repeat(baseline.level_pa, len(seconds), axis=0)
    low = np.clip(np.searchsorted(baseline.seconds, seconds) - 1, 0, last - 1)
    start, end = baseline.seconds[low], baseline.seconds[low + 1]
    share = np.clip((seconds - start) / (end - start), -1.0, 2.0)[:, None]
    return (1 - share) * baseline.level_pa[low] + share * baseline.level_pa[low + 1]


def _free(sample: Array) -> NDArray[np.bool_]:
    """Samples (S,) without contact: no taxel stands out, its own resting reading removed."""
    from evifuse.touch._kernels_health import contrasts

    contrast = contrasts(sample, _resting(sample))
    quietest, loudest = np.percentile(contrast, [5, 95])
    if quietest > PAUSES * loudest:
        return np.zeros(len(contrast), dtype=np.bool_)  # always in contact, or never
    return contrast < max(FREE * loudest, QUIET * quietest)


def _resting(sample: Array) -> Array:
    """Reading (N,) of each taxel at rest: its middle one, or a low one if it is loaded half of the time."""
    low, middle, high = np.percentile(sample, [5, 50, 95], axis=0)
    return np.where(middle - low > OFTEN_LOADED * (high - low).max(), low, middle)
