"""A source that is only partly trusted."""

import numpy as np
from numpy.typing import ArrayLike

from evifuse.belief.combine import add_to_frame
from evifuse.belief.mass import MassFunction
from evifuse.errors import MassError

__all__ = ["discount"]


def discount(m: MassFunction, *, reliability: ArrayLike) -> MassFunction:
    """Trust a source only so far: masses times the reliability, the balance on the frame (Shafer 1976).

    Parameters
    ----------
    m : MassFunction
        The source, batch shape ``(...)``.
    reliability : array_like of float
        Share of trust in [0, 1], broadcast against the batch: 1 leaves the source as it is, 0 leaves
        ignorance.

    Returns
    -------
    MassFunction
        Discounted masses.

    Raises
    ------
    MassError
        If a reliability is outside [0, 1] or not a number.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> discount(MassFunction.of(Frame(["a", "b"]), {"a": 1.0}), reliability=0.75)
    MassFunction(a: 0.75, frame: 0.25)
    """
    trust = np.asarray(reliability, dtype=np.float64)
    if not np.all((trust >= 0) & (trust <= 1)):
        raise MassError(f"reliability must be in [0, 1], not {reliability!r}")
    masses = m.masses * trust[..., None]
    sets = m.focal_sets
    if sets.ndim > 1:
        sets = np.broadcast_to(sets, masses.shape).copy()
    scaled = MassFunction.trusted(m.frame, sets, masses, m.layout)
    return add_to_frame(scaled, np.broadcast_to(1.0 - trust, masses.shape[:-1]))
