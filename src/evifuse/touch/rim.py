"""What the rim of an array does to a wide patch of pressure, and how to undo it (our own).

Skin spreads pressure to its neighbours. Near the rim there are fewer of them, and each gets more: the side
of the patch that is closer to the rim reads too high, and the patch seems to lie further out than the contact
does. How much more a patch reads there is seen from its height alone, as the force is steady: the height
grows by a power of what the rim cuts off. A patch moves by the variance of the contact's own pressure times
the logarithmic slope of that growth, as any density does that is multiplied by an exponential.
"""

import numpy as np
from numpy.typing import NDArray

from evifuse.recordings.recording import Fingertip
from evifuse.touch.profile import Profile

__all__ = ["without_rim"]

Array = NDArray[np.float64]

USUAL_VARIANCE_M2 = 4e-7
"""Variance of the pressure of our finger of 10 mm without spread, per axis: ``b^2 / 6`` of a bed of springs
with a contact of radius b. It is 0.5 square millimetres where 2 N press it into a plane, and less on a dome;
it grows by the power 3/2 of the radius.
"""
STEADY = 0.4
"""Heights within this share of their middle are of a finger that is pressed in steadily."""
BINS, FEWEST = 12, 20


def without_rim(tip: Fingertip, contact: Array, height_pa: Array, profile: Profile) -> Array:
    """Move contacts back to where they are without the rim's pull.

    Parameters
    ----------
    tip : Fingertip
        N taxels on a sphere.
    contact : ndarray of float64, shape (M, 3)
        Unit vectors to the middles of patches, fingertip frame.
    height_pa : ndarray of float64, shape (M,)
        Their heights, pascals; zero where there is none.
    profile : Profile
        Their shape.

    Returns
    -------
    ndarray of float64, shape (M, 3)
        Unit vectors to the contacts.
    """
    from evifuse.touch._kernels_contact import held

    share, slope = held(contact, tip.positions_m, tip.radius_m, profile.reach_m, profile.power)
    growth = _growth(share, height_pa)
    usual = USUAL_VARIANCE_M2 * (100 * tip.radius_m) ** 1.5
    variance = min(usual, 0.25 * profile.reach_m**2 / (profile.power + 2))
    moved = contact + growth * variance / tip.radius_m * slope
    return moved / np.linalg.norm(moved, axis=1, keepdims=True)


def _growth(share: Array, height_pa: Array) -> float:
    """Power, in [0, 1], by which heights grow with what the rim cuts off."""
    known = (height_pa > 0) & (share > 0)
    if not known.any():
        return 0.0
    known &= np.abs(height_pa - np.median(height_pa[known])) < STEADY * np.median(height_pa[known])
    if known.sum() < BINS * FEWEST:
        return 0.0
    held, height = np.log(share[known]), np.log(height_pa[known])
    order = np.argsort(held, kind="stable")
    x, y = (
        np.array([np.median(part) for part in np.array_split(values[order], BINS)])
        for values in (held, height)
    )
    x, y = x - x.mean(), y - y.mean()
    return float(np.clip(-(x @ y) / max(float(x @ x), 1e-3), 0.0, 1.0))
