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
    sample, at = recording.pressure_pa[::every], seconds[::every]
    piece = np.minimum((WINDOWS * np.arange(len(at))) // max(len(at), 1), WINDOWS - 1)
    free = _free(sample)
    found = [np.flatnonzero(free & (piece == k)) for k in range(WINDOWS)]
    found = [rows for rows in found if len(rows) >= FEWEST]
    if not found:
        return Baseline(np.zeros(1), np.zeros((1, sample.shape[1])), np.inf)
    level = np.stack([np.median(sample[rows], axis=0) for rows in found])
    scatter = np.median([np.median(np.abs(sample[rows] - m)) for rows, m in zip(found, level, strict=True)])
    fewest = min(len(rows) for rows in found)
    middle = np.array([at[rows].mean() for rows in found])
    return Baseline(middle, level, 1.48 * 1.25 * float(scatter) / np.sqrt(fewest))


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
    place = np.clip(np.interp(seconds, baseline.seconds, np.arange(len(baseline.seconds))), 0, None)
    low = np.minimum(place.astype(np.int64), max(len(baseline.seconds) - 2, 0))
    high = np.minimum(low + 1, len(baseline.seconds) - 1)
    share = (place - low)[:, None]
    level = (1 - share) * baseline.level_pa[low] + share * baseline.level_pa[high]
    return replace(recording, pressure_pa=recording.pressure_pa - level)


def _free(sample: Array) -> NDArray[np.bool_]:
    """Samples (S,) without contact: no taxel stands out, its own middle reading removed."""
    rise = sample - np.median(sample, axis=0)
    contrast = rise.max(axis=1) - np.median(rise, axis=1)
    quietest, loudest = np.percentile(contrast, [5, 95])
    if quietest > PAUSES * loudest:
        return np.zeros(len(contrast), dtype=np.bool_)  # always in contact, or never
    return contrast < max(FREE * loudest, QUIET * quietest)
