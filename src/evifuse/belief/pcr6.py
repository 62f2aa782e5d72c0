"""Proportional conflict redistribution among any number of sources at once."""

from collections.abc import Iterable

import numpy as np

from evifuse.belief._joint import joint, loops
from evifuse.belief._sources import checked, merged, spread
from evifuse.belief.combine import Combination
from evifuse.belief.mass import MassFunction
from evifuse.errors import MassError

__all__ = ["pcr6"]

MOST_WAYS = 10**9
"""So many ways to take one focal set of each source are a few seconds of work."""


def pcr6(many: Iterable[MassFunction]) -> Combination:
    """Proportional conflict redistribution of all sources at once (rule 6).

    Of each way to take one focal set of each source, the product p of their masses goes to their
    intersection; where that is empty, the set of source i gets back the share p m_i / (m_1 + ... + m_S).

    Parameters
    ----------
    many : iterable of MassFunction
        One or more sources over one frame; batch dimensions broadcast. A batch is taken as a list. The work
        grows with the product of the numbers of focal sets.

    Returns
    -------
    Combination
        The combination (Martin and Osswald 2006) and the conflict that was redistributed. Commutative, but
        not associative: two at a time is another rule. Of two sources it is `pcr5`.

    Raises
    ------
    FrameError
        If the frames differ.
    MassError
        If there are no sources, a source has mass on the empty set, or there are more than 10^9 ways.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> frame = Frame(["rectangle", "triangle"])
    >>> a = MassFunction.of(frame, {"rectangle": 0.75, "triangle": 0.25})
    >>> pcr6([a, MassFunction.of(frame, {"triangle": 1.0}), MassFunction.vacuous(frame)]).conflict.item()
    0.75
    """
    sources = checked(many)
    frame = sources[0].frame
    for i, m in enumerate(sources):
        if np.any(m.where(m.focal_sets == 0) > 0):
            raise MassError(
                f"source {i} has mass on the empty set: there is no set to give its conflict back to"
            )
    product = joint(sources, normalise=False)
    if not np.any(product.conflict > 0):
        return Combination(product.mass, product.conflict)
    packed = [m.to("padded") for m in sources]
    ways = float(np.prod([float(m.masses.shape[-1]) for m in packed]))
    rows = int(np.prod(product.mass.batch))
    if ways * rows > MOST_WAYS:
        raise MassError(
            f"{len(sources)} sources leave {ways * rows:.3g} ways to take one focal set of each, more than "
            f"{MOST_WAYS:.0e}: combine fewer, or use 'murphy'"
        )
    batch, all_sets, all_masses = spread(packed)
    width = max(m.shape[-1] for m in all_masses)
    sets = np.zeros((rows, len(sources), width), dtype=np.int64)
    masses = np.zeros((rows, len(sources), width))
    for i, (some, values) in enumerate(zip(all_sets, all_masses, strict=True)):
        sets[:, i, : some.shape[-1]] = some.reshape(rows, -1)
        masses[:, i, : some.shape[-1]] = values.reshape(rows, -1)
    shares = np.zeros_like(masses)
    loops().shares_of_conflict(sets, masses, shares)
    agreed = product.mass.masses.reshape(rows, -1)
    agreed_sets = np.broadcast_to(product.mass.focal_sets, product.mass.masses.shape).reshape(rows, -1)
    found, values = merged(
        np.concatenate([agreed_sets, sets.reshape(rows, -1)], axis=-1),
        np.concatenate([agreed, shares.reshape(rows, -1)], axis=-1),
    )
    shape = (*batch, found.shape[-1])
    result = MassFunction.trusted(frame, found.reshape(shape), values.reshape(shape))
    return Combination(result.to("dense") if product.mass.layout == "dense" else result, product.conflict)
