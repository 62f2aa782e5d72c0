"""One sample after the other without what defective taxels would do: `mended` for a stream (our own)."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import Fingertip
from evifuse.touch.contact import CONTACT_FLOOR_PA
from evifuse.touch.glance import glance_of
from evifuse.touch.health import silent_among
from evifuse.touch.repair import repair_weights

__all__ = ["TaxelMender"]

Array = NDArray[np.float64]

SLOWNESS = 50
"""Samples without contact over which the reading of unloaded taxels is averaged."""
HELD = 20
"""A taxel that reads nothing keeps its last reading for so many samples."""
RESPONDS = 0.5
"""A taxel that moves by this share of the peak is not silent after all."""
BESIDE, ALONE = 6, 0.2
"""A still taxel is stuck when some of the nearest others show less than this share before any touch."""
MOST_KEPT = 16
"""Sets of silent taxels whose weights are kept."""


class TaxelMender:
    """Fills in taxels that read nothing, and takes moving baselines off, sample by sample.

    Taxels that read NaN are filled in as long as they do; those that never respond, from when they are found.

    Parameters
    ----------
    fingertip : Fingertip
        Geometry of the fingertip, N taxels.
    usable : ndarray of bool, shape (N,), optional
        Taxels that are known to respond, such as `FingertipHealth.usable` of an earlier recording.
    """

    def __init__(self, fingertip: Fingertip, usable: NDArray[np.bool_] | None = None) -> None:
        count = len(fingertip.normals)
        self._tip = fingertip
        self._known = np.zeros(count, np.bool_) if usable is None else ~np.asarray(usable, np.bool_)
        self._silent = self._known.copy()
        self._level, self._last = np.zeros((2, count))
        self._gone = np.full(count, HELD)
        self._weights: dict[bytes, Array] = {}

    @property
    def silent(self) -> NDArray[np.bool_]:
        """Taxels (N,) that are filled in, but for those that are NaN at times."""
        return self._silent

    def levelled(self, pressure_pa: Array) -> Array:
        """A sample above the baseline, with NaN where a taxel reads nothing.

        Parameters
        ----------
        pressure_pa : ndarray of float64, shape (N,)
            Pressures, pascals.

        Returns
        -------
        ndarray of float64, shape (N,)
            Pressures, pascals.
        """
        return np.asarray(pressure_pa, dtype=np.float64) - self._level

    def filled(self, levelled_pa: Array) -> Array:
        """The same with silent taxels filled in from those around them.

        Parameters
        ----------
        levelled_pa : ndarray of float64, shape (N,)
            From `levelled`.

        Returns
        -------
        ndarray of float64, shape (N,)
            Pressures, pascals; 0 where every taxel is silent.
        """
        there = np.isfinite(levelled_pa)
        if there.all() and not self._silent.any():
            self._last, self._gone[:] = levelled_pa, 0
            return levelled_pa
        self._gone = np.where(there, 0, self._gone + 1)
        self._last = levelled_pa = np.where(there, levelled_pa, self._last)
        silent = self._silent | (self._gone > HELD)
        if not silent.any():
            return levelled_pa
        key = silent.tobytes()
        if key not in self._weights:
            if len(self._weights) >= MOST_KEPT:
                self._weights.clear()
            self._weights[key] = repair_weights(self._tip, silent)[:, silent]
        pressure = np.where(silent, 0.0, levelled_pa)
        pressure[silent] = np.maximum(pressure @ self._weights[key], 0.0)
        return pressure

    def rest(self, levelled_pa: Array) -> None:
        """Take in a sample without contact: it tells the baseline.

        Parameters
        ----------
        levelled_pa : ndarray of float64, shape (N,)
            From `levelled`.
        """
        if np.isfinite(levelled_pa).all():
            self._level += levelled_pa / SLOWNESS
        else:
            self._level += np.nan_to_num(levelled_pa, posinf=0.0, neginf=0.0) / SLOWNESS

    def begin(self, levelled_pa: Array) -> None:
        """Look for taxels that are stuck, before anything was touched.

        Parameters
        ----------
        levelled_pa : ndarray of float64, shape (S, N)
            The first samples, from `levelled`.
        """
        sample = np.nan_to_num(levelled_pa, nan=0.0, posinf=0.0, neginf=0.0)
        reading = np.median(sample, axis=0)
        apart = np.linalg.norm(self._tip.positions_m[:, None] - self._tip.positions_m, axis=2)
        beside = np.percentile(reading[np.argsort(apart, axis=1)[:, 1 : BESIDE + 1]], 25, axis=1)
        still = np.ptp(sample, axis=0) == 0
        self._silent = self._silent | (still & (reading > CONTACT_FLOOR_PA) & (beside < ALONE * reading))

    def review(self, levelled_pa: Array, noise_pa: float) -> None:
        """Look for taxels that never respond though those around them do.

        Parameters
        ----------
        levelled_pa : ndarray of float64, shape (S, N)
            Samples with and without contact, from `levelled`.
        noise_pa : float
            Standard deviation of the taxels' noise, pascals; samples with contact don't tell.
        """
        seen = glance_of(np.nan_to_num(levelled_pa, nan=0.0, posinf=0.0, neginf=0.0))
        seen = replace(seen, spread=np.full(len(seen.spread), noise_pa / 1.48))
        dead, stuck = silent_among(self._tip, seen)
        responds = seen.reach > RESPONDS * float(seen.rise.max(initial=0.0))
        self._silent = self._known | dead | stuck | (self._silent & ~responds)
