"""A quick look at the readings of every taxel, which tells most recordings to be sound (our own)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import TouchRecording

__all__ = ["Glance", "glance_at", "glance_of"]

SAMPLES = 400
"""Samples that are looked at, about."""
USUAL = 150
"""Of these, so many tell what is usual, about."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Glance:
    """Some samples of a recording, and what is usual in them.

    Parameters
    ----------
    sample : ndarray of float64, shape (S, N)
        Pressures, pascals.
    columns : ndarray of float64, shape (N, S)
        The same, taxel by taxel.
    quiet : ndarray of float64, shape (N,)
        Median reading of each taxel.
    spread : ndarray of float64, shape (N,)
        Median distance of its readings from that.
    rise, reach : ndarray of float64, shape (N,)
        Largest difference from it, upwards and in either direction.
    """

    sample: Array
    columns: Array
    quiet: Array
    spread: Array
    rise: Array
    reach: Array


def glance_at(recording: TouchRecording) -> Glance:
    """Look at some 400 samples, evenly spaced.

    Parameters
    ----------
    recording : TouchRecording
        T samples of N taxels.

    Returns
    -------
    Glance
        Enough to tell that nothing is wrong.
    """
    every = max(1, len(recording.pressure_pa) // SAMPLES)
    return glance_of(np.ascontiguousarray(recording.pressure_pa[::every]))


def glance_of(sample: Array) -> Glance:
    """What is usual in some samples.

    Parameters
    ----------
    sample : ndarray of float64, shape (S, N)
        Pressures, pascals.

    Returns
    -------
    Glance
        With the samples.
    """
    from evifuse.touch._kernels_health import taxel_statistics

    columns = np.ascontiguousarray(sample.T)
    return Glance(sample, columns, *taxel_statistics(columns, max(1, len(sample) // USUAL)))
