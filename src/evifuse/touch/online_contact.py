"""The contact of a fingertip, one sample at a time: `contact_track` for a stream (our own)."""

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import Fingertip
from evifuse.touch.contact import (
    CONTACT_FLOOR_PA,
    NARROW_ERROR,
    NOISY,
    PULLED_ERROR,
    SUMMED,
    WIDE,
    neighbourhoods,
    noise_pa,
    normal_weights,
)
from evifuse.touch.fingersurface import SphereSurface, surface_of
from evifuse.touch.fingertip import surrounded, taxel_coverage, taxel_pitch_m
from evifuse.touch.online_mended import TaxelMender
from evifuse.touch.profile import Profile, pressure_profile

__all__ = ["ContactFinder"]

Array = NDArray[np.float64]

KEPT, EVERY, REVIEW = 64, 8, 256
"""Samples that noise and profile are measured on, how many lie between two of them, and between reviews."""
FAINT = 0.06
"""What stays below this share of the highest pressure may be a baseline that has moved."""


class ContactFinder:
    """Finds the contact in one sample after the other, and learns noise and profile on the way.

    The first 64 samples are never contact: they tell the noise.

    Parameters
    ----------
    fingertip : Fingertip
        Geometry of the fingertip, N taxels.
    usable : ndarray of bool, shape (N,), optional
        Taxels that are known to respond; the others are found on the way, and filled in.
    """

    def __init__(self, fingertip: Fingertip, usable: NDArray[np.bool_] | None = None) -> None:
        self._tip = fingertip
        self._mender = TaxelMender(fingertip, usable)
        surface = surface_of(fingertip)
        self._sphere = surface.centre_m if isinstance(surface, SphereSurface) else None
        self._surface, self._inside = surface, surrounded(fingertip)
        self._pitch_m = taxel_pitch_m(fingertip)
        self._weights = normal_weights(fingertip)
        self._sums = neighbourhoods(fingertip, SUMMED * self._pitch_m)
        self._covered = taxel_coverage(fingertip, 2.5 * self._pitch_m / fingertip.radius_m) > 0.8
        pole = fingertip.normals.mean(axis=0)
        self.pole = pole / np.linalg.norm(pole)
        rim = np.arccos(np.clip((fingertip.normals @ self.pole).min(), -1.0, 1.0))
        self._furthest = float(np.cos(rim - 0.5 * self._pitch_m / fingertip.radius_m))
        self._seen = np.zeros((KEPT, len(fingertip.normals)))
        self._felt = np.zeros((KEPT, len(fingertip.normals)))
        self._raw = np.zeros((2 * KEPT, len(fingertip.normals)))
        self._where = np.zeros((KEPT, 3))
        self._spread_rad = np.zeros(KEPT)
        self._count = self._touched = self._next = 0
        self._noise = self._top = self._top_clear = 0.0
        self._noisy = self._wide = False
        self._first = np.zeros(1, np.int64)
        self.profile: Profile | None = None

    @property
    def scale_error(self) -> float:
        """Relative error of the contact's angle that all samples share."""
        return PULLED_ERROR if self._wide else NARROW_ERROR

    def find(self, pressure_pa: Array) -> tuple[bool, Array | None, Array]:
        """Contact in the next sample.

        Parameters
        ----------
        pressure_pa : ndarray of float64, shape (N,)
            Pressures, pascals; NaN where a taxel reads nothing.

        Returns
        -------
        touching : bool
            Whether there is contact.
        direction : ndarray of float64, shape (3,), or None
            Outward unit normal of the finger there, in the fingertip frame, where the array lies around it.
        centre_m : ndarray of float64, shape (3,)
            Centre, in the fingertip frame, of the sphere of the nominal radius that touches like the finger.
        """
        nowhere = np.zeros(3)
        from evifuse.touch._kernels_contact import contacts, match

        levelled = self._mender.levelled(pressure_pa)
        pressure_pa = self._mender.filled(levelled)
        if self._count % EVERY == 0 or self._count < KEPT:
            self._seen[self._next % KEPT], self._raw[self._next % KEPT] = pressure_pa, levelled
            self._next += 1
        self._count += 1
        if self._count == KEPT:
            self._mender.begin(self._raw[:KEPT])
        if self._count % REVIEW == 0 or self._count == KEPT:
            self._review()
        if self._count < KEPT:
            return False, None, nowhere
        raw = pressure_pa[None]
        clear = raw @ self._sums if self._noisy else raw
        peak = float(clear[0].max())
        self._top = max(self._top, float(pressure_pa.max()))
        self._top_clear = max(self._top_clear, peak)
        threshold = max((3 if self._noisy else 4) * self._noise, CONTACT_FLOOR_PA / 2)
        threshold = max(threshold, (0.02 if self._noisy else 0.01) * self._top_clear)
        if peak < max(2 * threshold, FAINT * self._top_clear):
            self._mender.rest(levelled)
        if not peak > 2 * threshold:
            return False, None, nowhere
        _, strongest, mean = contacts(clear, threshold, self._weights)
        length = float(np.sqrt(mean[0] @ mean[0]))
        if length <= 0.5:
            return False, None, nowhere
        place = mean / length
        if self._touched % EVERY == 0:
            kept = (self._touched // EVERY) % KEPT
            self._felt[kept], self._where[kept] = pressure_pa, self._tip.radius_m * place[0]
            self._raw[KEPT + kept] = levelled
            self._spread_rad[kept] = np.sqrt(max(2 * (1 - length), 0.0))
        self._touched += 1
        if self._sphere is None:
            weights = np.square(np.maximum(raw - threshold, 0.0))
            finger, outward = self._surface.contact(weights + 1e-9 * weights.max())
            covered = self._inside[strongest[0]]
            return True, outward[0] if covered else None, finger[0] - self._tip.radius_m * outward[0]
        if not self._wide or self.profile is None:
            return True, place[0] if self._covered[strongest[0]] else None, self._sphere
        place, height = match(
            raw, self._first, place, self._tip.positions_m, self._tip.radius_m,
            self.profile.reach_m, self.profile.power, 3,
        )  # fmt: skip
        inside = height[0] > 0 and float(place[0] @ self.pole) > self._furthest
        return True, place[0] if inside else None, self._sphere

    def _review(self) -> None:
        """Noise, width and profile from the samples that were kept."""
        self._noise = noise_pa(self._seen[: min(KEPT, self._next)])
        noisy = self._noise > NOISY * self._top
        if noisy != self._noisy:
            self._top_clear = 0.0
        self._noisy = noisy
        count = min(KEPT, self._touched // EVERY)
        if count < KEPT // 8:
            return
        kept = [self._raw[: min(KEPT, self._next)], self._raw[KEPT : KEPT + count]]
        self._mender.review(np.concatenate(kept), self._noise)
        tip, patch_m = self._tip, float(np.median(self._spread_rad[:count])) * self._tip.radius_m
        self._wide = noisy or patch_m > WIDE * self._pitch_m
        furthest = 3.5 * patch_m if self._wide else 0.6 * tip.radius_m
        furthest = max(furthest, 4 * self._pitch_m)
        self.profile = pressure_profile(tip, self._felt[:count], self._where[:count], furthest)
