"""Evidence that the truth is in a set, taken in as certain."""

import numpy as np

from evifuse.belief._sources import merged
from evifuse.belief.combine import Combination
from evifuse.belief.frame import Subset
from evifuse.belief.mass import MassFunction
from evifuse.errors import ConflictError

__all__ = ["condition"]


def condition(m: MassFunction, subset: Subset, *, open_world: bool = False) -> Combination:
    """Dempster's rule of conditioning: each focal set keeps what it has in common with the set.

    Parameters
    ----------
    m : MassFunction
        Masses, batch shape ``(...)``.
    subset : str, iterable of str, int or Frame
        What is certain. The whole frame only scales away mass on the empty set.
    open_world : bool
        Leave the mass of the focal sets that miss the set on the empty set, instead of scaling the others to
        1.

    Returns
    -------
    Combination
        ``m(B | A)``, the sum of m(C) over C ∩ A = B, divided by pl(A) (Shafer 1976) or not (Smets 1990), and
        the conflict ``1 - pl(A)``. A dense source gives a dense result.

    Raises
    ------
    FrameError
        If the set names a hypothesis that the frame does not have.
    ConflictError
        If the set is impossible somewhere in the batch and the world is not open.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> m = MassFunction.of(Frame(["a", "b", "c"]), {"a": 0.5, ("b", "c"): 0.25, ("a", "b", "c"): 0.25})
    >>> condition(m, ["b", "c"]).mass
    MassFunction(b|c: 1)
    >>> condition(m, ["b", "c"]).conflict.item()
    0.5
    """
    mask = m.frame.mask(subset)
    meets = m.focal_sets & mask != 0
    conflict = m.where(~meets)
    possible = np.where(meets, m.masses, 0.0)
    if not open_world:
        total = possible.sum(axis=-1, keepdims=True)
        bad = np.argwhere(~(total[..., 0] > 0))
        if len(bad):
            at = f" at index {tuple(bad[0].tolist())}" if m.batch else ""
            raise ConflictError(
                f"total conflict{at}: the source holds {m.frame.label(mask)!r} impossible; discount it first"
            )
        possible /= total
    sets, masses = merged(m.focal_sets & mask, m.masses if open_world else possible, keep_empty=open_world)
    joint = MassFunction.trusted(m.frame, sets, masses)
    return Combination(joint.to("dense") if m.layout == "dense" else joint, conflict)
