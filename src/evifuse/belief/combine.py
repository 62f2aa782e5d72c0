"""Two sources into one, and a source that is only partly trusted."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evifuse.belief.frame import Frame
from evifuse.belief.mass import MassFunction
from evifuse.errors import ConflictError, FrameError, MassError

__all__ = ["Combination", "conjunctive", "dempster", "discount", "on_frame"]


class Combination(NamedTuple):
    """The combined masses, and how much the sources contradicted each other.

    Parameters
    ----------
    mass : MassFunction
        The combination.
    conflict : ndarray of float64
        Mass that the conjunctive combination puts on the empty set, batch shape ``(...)``.
    """

    mass: MassFunction
    conflict: NDArray[np.float64]


def conjunctive(a: MassFunction, b: MassFunction) -> Combination:
    """Both sources are right: ``m(C)`` sums a(A) b(B) over A ∩ B = C, with conflict left on the empty set.

    Parameters
    ----------
    a : MassFunction
        First source.
    b : MassFunction
        Second source, over the same frame; batch dimensions broadcast.

    Returns
    -------
    Combination
        The unnormalised combination (Smets 1990); its empty set carries the conflict.

    Raises
    ------
    FrameError
        If the frames differ.
    """
    if a.frame != b.frame:
        raise FrameError(f"the sources speak of different frames: {a.frame} and {b.frame}")
    meets = a.focal_sets[:, None] & b.focal_sets[None, :]
    sets, where = np.unique(meets, return_inverse=True)
    scatter = np.zeros((meets.size, len(sets)))
    scatter[np.arange(meets.size), where.ravel()] = 1
    products = a.masses[..., :, None] * b.masses[..., None, :]
    masses = products.reshape(*products.shape[:-2], meets.size) @ scatter
    conflict = masses[..., 0] if sets[0] == 0 else np.zeros(masses.shape[:-1])
    return Combination(MassFunction.trusted(a.frame, sets, masses), conflict.copy())


def dempster(a: MassFunction, b: MassFunction) -> Combination:
    """Dempster's rule: the conjunctive combination, with the mass of non-empty sets scaled back to 1.

    Parameters
    ----------
    a : MassFunction
        First source.
    b : MassFunction
        Second source, over the same frame; batch dimensions broadcast.

    Returns
    -------
    Combination
        The combination (Dempster 1967, Shafer 1976) and the conflict that was divided out. The divisor is the
        sum of the non-empty masses, not 1 - conflict, which would lose every digit near total conflict.

    Raises
    ------
    FrameError
        If the frames differ.
    ConflictError
        If the sources contradict each other totally anywhere in the batch.

    Examples
    --------
    >>> from evifuse.belief import Frame, MassFunction
    >>> frame = Frame(["rectangle", "triangle"])
    >>> a = MassFunction.of(frame, {"rectangle": 0.5, frame: 0.5})
    >>> dempster(a, a)
    Combination(mass=MassFunction(rectangle: 0.75, frame: 0.25), conflict=array(0.))
    """
    joint, conflict = conjunctive(a, b)
    keep = joint.focal_sets != 0
    masses = joint.masses[..., keep]
    total = masses.sum(axis=-1, keepdims=True)
    if not keep.any() or np.any(total <= 0):
        at = np.argwhere(np.atleast_1d(total[..., 0] <= 0))[0].tolist() if keep.any() and joint.batch else []
        where = f" at index {tuple(at)}" if at else ""
        raise ConflictError(
            f"total conflict{where}: the two sources have no focal set in common; discount one of them first"
        )
    return Combination(MassFunction.trusted(a.frame, joint.focal_sets[keep], masses / total), conflict)


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
    sets = m.focal_sets
    masses = m.masses * trust[..., None]
    full = np.flatnonzero(sets == m.frame.full)
    if not full.size:
        sets = np.append(sets, np.int64(m.frame.full))
        masses = np.concatenate([masses, np.zeros((*masses.shape[:-1], 1))], axis=-1)
        full = np.array([len(sets) - 1])
    masses[..., full[0]] += 1 - trust
    return MassFunction.trusted(m.frame, sets, masses)


def on_frame(m: MassFunction, frame: Frame) -> MassFunction:
    """The same evidence over a frame that holds the same names, in another order or among more of them.

    Ignorance stays ignorance: mass on the old frame goes to the new one. Every other focal set keeps its
    members.

    Parameters
    ----------
    m : MassFunction
        Evidence over a smaller or reordered frame.
    frame : Frame
        A frame with all of its hypotheses.

    Returns
    -------
    MassFunction
        The same masses over ``frame``.

    Raises
    ------
    FrameError
        If ``frame`` lacks a hypothesis.
    """
    if m.frame == frame:
        return m
    missing = [name for name in m.frame.hypotheses if name not in frame.hypotheses]
    if missing:
        raise FrameError(f"the frame {frame} lacks {missing[0]!r}, which the evidence is about")
    sets = [frame.full if s == m.frame.full else frame.mask(m.frame.names(int(s))) for s in m.focal_sets]
    return MassFunction.trusted(frame, np.array(sets, dtype=np.int64), m.masses)
