"""Random frames and mass functions."""

import numpy as np
from hypothesis import strategies as st

from evifuse.belief import Frame, MassFunction

NAMES = [f"h{i}" for i in range(8)]


@st.composite
def masses_over(
    draw: st.DrawFn, frame: Frame, batch: tuple[int, ...] = (), zeros: bool = True
) -> MassFunction:
    sets = draw(st.lists(st.integers(1, frame.full), min_size=1, max_size=6, unique=True))
    seed = draw(st.integers(0, 2**32 - 1))
    rng = np.random.default_rng(seed)
    values = rng.dirichlet(np.full(len(sets), 0.7), size=batch)
    if zeros and len(sets) > 1 and draw(st.booleans()):
        values[..., 0] = 0.0
    else:
        values = np.maximum(values, 1e-9)
    return MassFunction(frame, sets, values / values.sum(axis=-1, keepdims=True))


@st.composite
def frames(draw: st.DrawFn) -> Frame:
    return Frame(NAMES[: draw(st.integers(1, 6))])


@st.composite
def pairs(draw: st.DrawFn, batch: tuple[int, ...] = ()) -> tuple[MassFunction, MassFunction]:
    frame = draw(frames())
    return draw(masses_over(frame, batch)), draw(masses_over(frame, batch))


def dense(m: MassFunction) -> np.ndarray:
    """Masses over all 2^n subsets, by the definition."""
    out = np.zeros((*m.batch, m.frame.full + 1))
    sets = np.broadcast_to(m.focal_sets, m.masses.shape)
    for where in np.ndindex(m.masses.shape):
        out[(*where[:-1], int(sets[where]))] += m.masses[where]
    return out
