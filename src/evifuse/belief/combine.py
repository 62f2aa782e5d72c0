"""Rules that multiply focal sets in pairs: two sources into one."""

from importlib import import_module
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from evifuse.belief.frame import Frame
from evifuse.belief.mass import MassFunction
from evifuse.errors import ConflictError, FrameError

__all__ = [
    "Combination",
    "conjunctive",
    "dempster",
    "disjunctive",
    "dubois_prade",
    "on_frame",
    "pcr5",
    "yager",
]

Array = NDArray[np.float64]
INTERSECTION, UNION, DUBOIS_PRADE = range(3)

SMALLEST = 1e-280
"""Below this sum, products of masses have lost digits: logarithms are used."""

_kernels: Any = None


def kernels() -> Any:
    """The compiled inner loops; numba is imported on the first use of a rule, not before."""
    global _kernels
    if _kernels is None:
        _kernels = import_module("evifuse.belief._kernels")
    return _kernels


class Combination(NamedTuple):
    """The combined masses, and how much the sources contradicted each other.

    Parameters
    ----------
    mass : MassFunction
        The combination.
    conflict : ndarray of float64, or one float64
        Mass that the conjunctive combination puts on the empty set, batch shape ``(...)``.
    """

    mass: MassFunction
    conflict: Array | np.float64


def aligned(a: MassFunction, b: MassFunction) -> MassFunction:
    """The second source over the frame of the first: a reordered frame is remapped, a different one refused.

    Parameters
    ----------
    a : MassFunction
        Gives the frame.
    b : MassFunction
        To be moved to it.

    Returns
    -------
    MassFunction
        ``b``, over the frame of ``a``.

    Raises
    ------
    FrameError
        If the frames don't hold the same hypotheses with the same attributes.
    """
    if a.frame is b.frame or a.frame == b.frame:
        return b
    if set(a.frame.hypotheses) != set(b.frame.hypotheses):
        raise FrameError(f"the sources speak of different frames: {a.frame} and {b.frame}")
    mine, other = a.frame.attributes, b.frame.attributes
    if mine is not None and other is not None:
        lists = dict(zip(b.frame.hypotheses, other, strict=True))
        for name, expected in zip(a.frame.hypotheses, mine, strict=True):
            if lists[name] != expected:
                raise FrameError(f"the sources' frames give {name!r} different attributes")
    return on_frame(b, a.frame)


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
    moved = np.zeros_like(m.focal_sets)
    for i, name in enumerate(m.frame.hypotheses):
        moved |= np.where(m.focal_sets >> i & 1, np.int64(frame.mask(name)), 0)
    moved[m.focal_sets == m.frame.full] = frame.full
    return MassFunction.trusted(frame, moved, m.masses)


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
    return _product(a, aligned(a, b), INTERSECTION, keep_empty=True, normalise=False)


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
        sum of the non-empty masses, not 1 - conflict, which would lose every digit near total conflict; where
        that sum is too small for a number, logarithms are used.

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
    >>> dempster(a, a).mass
    MassFunction(rectangle: 0.75, frame: 0.25)
    """
    return _product(a, aligned(a, b), INTERSECTION, keep_empty=False, normalise=True)


def disjunctive(a: MassFunction, b: MassFunction) -> Combination:
    """At least one source is right: ``m(C)`` sums a(A) b(B) over A ∪ B = C.

    Parameters
    ----------
    a : MassFunction
        First source.
    b : MassFunction
        Second source, over the same frame; batch dimensions broadcast.

    Returns
    -------
    Combination
        The combination (Dubois and Prade 1986, Smets 1993); its conflict is 0, because none arises.

    Raises
    ------
    FrameError
        If the frames differ.
    """
    return _product(a, aligned(a, b), UNION, keep_empty=True, normalise=False)


def yager(a: MassFunction, b: MassFunction) -> Combination:
    """Yager's rule: conflict is ignorance, so the frame gets it (Yager 1987).

    Parameters
    ----------
    a : MassFunction
        First source.
    b : MassFunction
        Second source, over the same frame; batch dimensions broadcast. Not associative.

    Returns
    -------
    Combination
        The combination and the conflict that went to the frame.

    Raises
    ------
    FrameError
        If the frames differ.
    """
    joint, conflict = _product(a, aligned(a, b), INTERSECTION, keep_empty=False, normalise=False)
    return Combination(add_to_frame(joint, conflict), conflict)


def dubois_prade(a: MassFunction, b: MassFunction) -> Combination:
    """Dubois and Prade's rule: where two focal sets contradict, one of them is right, so their union gets it.

    Parameters
    ----------
    a : MassFunction
        First source.
    b : MassFunction
        Second source, over the same frame; batch dimensions broadcast. Not associative.

    Returns
    -------
    Combination
        The combination (Dubois and Prade 1988) and the conflict that went to unions.

    Raises
    ------
    FrameError
        If the frames differ.
    """
    return _product(a, aligned(a, b), DUBOIS_PRADE, keep_empty=False, normalise=False)


def pcr5(a: MassFunction, b: MassFunction) -> Combination:
    """Proportional conflict redistribution: contradicting focal sets share their product (rule 5).

    A product x y of two focal sets that don't meet goes back to them as x² y / (x + y) and x y² / (x + y).

    Parameters
    ----------
    a : MassFunction
        First source.
    b : MassFunction
        Second source, over the same frame; batch dimensions broadcast. Not associative.

    Returns
    -------
    Combination
        The combination (Smarandache and Dezert 2005) and the conflict that was redistributed.

    Raises
    ------
    FrameError
        If the frames differ.
    """
    b = aligned(a, b)
    if a.layout == b.layout == "dense":
        joint, conflict = _dense(a, b, upward=False, keep_empty=False, normalise=False)
        masses = joint.masses.copy()
        rows = masses.reshape(-1, masses.shape[-1])
        mine, other = _rows(a.masses, joint.batch), _rows(b.masses, joint.batch)
        kernels().dense_proportional(mine, other, len(rows), rows)
        return Combination(MassFunction.trusted(a.frame, joint.focal_sets, masses, "dense"), conflict)
    return _proportional(a, b)


def add_to_frame(m: MassFunction, extra: Array | np.float64) -> MassFunction:
    """More mass on the frame, which becomes focal if it was not.

    Parameters
    ----------
    m : MassFunction
        Masses that sum to ``1 - extra``.
    extra : ndarray of float64, shape (...)
        Mass to add.

    Returns
    -------
    MassFunction
        The sum.
    """
    full = m.focal_sets == m.frame.full
    if m.focal_sets.ndim == 1 and full.any():
        masses = m.masses.copy()
        masses[..., int(np.flatnonzero(full)[0])] += extra
        return MassFunction.trusted(m.frame, m.focal_sets, masses, m.layout)
    before = m.where(full)
    masses = np.where(full, 0.0, m.masses) if full.any() else m.masses
    sets = np.where(full, 0, m.focal_sets) if full.any() else m.focal_sets
    one = np.full((*sets.shape[:-1], 1), m.frame.full, dtype=np.int64)
    masses = np.concatenate([masses, np.asarray(before + extra)[..., None]], axis=-1)
    return MassFunction.trusted(m.frame, np.concatenate([sets, one], axis=-1), masses).tidy()


def _rows(values: NDArray[Any], batch: tuple[int, ...]) -> NDArray[Any]:
    """An operand as rows: one if it is the same for the whole batch."""
    width = values.shape[-1]
    if values.ndim == 1:
        return values.reshape(1, width)
    if values.shape[:-1] == batch:
        return np.ascontiguousarray(values).reshape(-1, width)
    return np.ascontiguousarray(np.broadcast_to(values, (*batch, width))).reshape(-1, width)


def _product(
    a: MassFunction, b: MassFunction, operation: int, *, keep_empty: bool, normalise: bool
) -> Combination:
    """Products of focal sets by the way that suits the layouts."""
    if a.layout == b.layout and (a.masses.ndim > 1 or b.masses.ndim > 1):
        if a.layout == "singletons" and operation == INTERSECTION:
            return _singletons(a, b, keep_empty, normalise)
        if a.layout == "shared":
            return _by_slot(a, b, operation, keep_empty, normalise)
    if a.layout == b.layout == "dense" and operation in (INTERSECTION, UNION):
        return _dense(a, b, operation == UNION, keep_empty, normalise)
    if a.masses.ndim == b.masses.ndim == 1:
        return _one_pair(a, b, operation, keep_empty, normalise)
    return _pairs(a, b, operation, keep_empty, normalise)


def _one_pair(
    a: MassFunction, b: MassFunction, operation: int, keep_empty: bool, normalise: bool
) -> Combination:
    """A single case, with as little around the kernel as can be."""
    count = len(a.frame.hypotheses)
    width = a.masses.size * b.masses.size
    if count < 40:
        width = min(width, 1 << count)
    sets, masses = np.empty(width + 1, np.int64), np.empty(width + 1)
    found, conflict, total = kernels().one_pair(
        a.focal_sets, a.masses, b.focal_sets, b.masses, operation, count, keep_empty, normalise, sets, masses
    )
    if normalise and not total > SMALLEST:
        return Combination(_by_logarithms(a, b), np.float64(conflict))
    joint = MassFunction.trusted(a.frame, sets[:found], masses[:found], "shared")
    return Combination(joint, np.float64(conflict))


def _pairs(
    a: MassFunction, b: MassFunction, operation: int, keep_empty: bool, normalise: bool
) -> Combination:
    batch, rows = _batch_of(a, b)
    count = len(a.frame)
    width = a.masses.shape[-1] * b.masses.shape[-1]
    if count < 40:
        width = min(width, 1 << count)
    width += 1
    sets = np.zeros((rows, width), dtype=np.int64)
    masses = np.zeros((rows, width))
    counts, conflict, totals = kernels().pairs(
        _rows(a.focal_sets, batch),
        _rows(a.masses, batch),
        _rows(b.focal_sets, batch),
        _rows(b.masses, batch),
        rows,
        operation,
        count,
        keep_empty,
        normalise,
        sets,
        masses,
    )
    if normalise and not np.all(totals > SMALLEST):
        if batch:
            return _rescue(a, b, batch)
        return Combination(_by_logarithms(a, b), conflict[0])
    return _collected(a.frame, sets, masses, counts, conflict, batch)


def _batch_of(a: MassFunction, b: MassFunction) -> tuple[tuple[int, ...], int]:
    """Batch dimensions of a combination, and how many cases that is."""
    if a.masses.ndim == b.masses.ndim == 1:
        return (), 1
    batch = np.broadcast_shapes(a.batch, b.batch)
    return batch, int(np.prod(batch))


def _collected(
    frame: Frame,
    sets: NDArray[np.int64],
    masses: Array,
    counts: NDArray[np.int64],
    conflict: Array,
    batch: tuple[int, ...],
) -> Combination:
    """Rows of a kernel's output as a combination."""
    if batch == ():
        most = counts[0]
        return Combination(
            MassFunction.trusted(frame, sets[0, :most], masses[0, :most], "shared"), conflict[0]
        )
    most = int(counts.max(initial=1))
    shape = (*batch, most)
    joint = MassFunction.trusted(
        frame, sets[:, :most].reshape(shape), masses[:, :most].reshape(shape), "padded"
    )
    return Combination(joint, conflict.reshape(batch))


def _proportional(a: MassFunction, b: MassFunction) -> Combination:
    batch, rows = _batch_of(a, b)
    f, g = a.masses.shape[-1], b.masses.shape[-1]
    width = f * g + f + g
    if len(a.frame) < 40:
        width = min(width, 1 << len(a.frame))
    sets = np.zeros((rows, width), dtype=np.int64)
    masses = np.zeros((rows, width))
    operands = [_rows(x, batch) for x in (a.focal_sets, a.masses, b.focal_sets, b.masses)]
    counts, conflict = kernels().proportional(*operands, rows, sets, masses)
    return _collected(a.frame, sets, masses, counts, conflict, batch)


def _rescue(a: MassFunction, b: MassFunction, batch: tuple[int, ...]) -> Combination:
    """A batch in which the products of some case are too small for a number: case by case."""
    wide = [MassFunction.trusted(m.frame, *_spread(m, batch)) for m in (a, b)]
    done: list[Combination] = []
    for i in np.ndindex(batch):
        try:
            done.append(dempster(wide[0][i], wide[1][i]))
        except ConflictError as e:
            raise ConflictError(str(e).replace("total conflict", f"total conflict at index {i}", 1)) from None
    padded = stack([c.mass for c in done], batch)
    return Combination(padded, np.array([float(c.conflict) for c in done]).reshape(batch))


def _spread(m: MassFunction, batch: tuple[int, ...]) -> tuple[NDArray[np.int64], Array]:
    shape = (*batch, m.masses.shape[-1])
    return np.broadcast_to(m.focal_sets, shape).copy(), np.broadcast_to(m.masses, shape).copy()


def stack(single: list[MassFunction], batch: tuple[int, ...]) -> MassFunction:
    """Single mass functions over one frame as a batch.

    Parameters
    ----------
    single : list of MassFunction
        As many as the batch has cases, in C order.
    batch : tuple of int
        Shape of the batch.

    Returns
    -------
    MassFunction
        In the padded layout.
    """
    width = max(len(m.focal_sets) for m in single)
    sets, masses = np.zeros((len(single), width), dtype=np.int64), np.zeros((len(single), width))
    for i, m in enumerate(single):
        sets[i, : len(m.focal_sets)], masses[i, : len(m.focal_sets)] = m.focal_sets, m.masses
    shape = (*batch, width)
    return MassFunction.trusted(single[0].frame, sets.reshape(shape), masses.reshape(shape), "padded")


def _by_logarithms(a: MassFunction, b: MassFunction) -> MassFunction:
    """Dempster's rule of two single sources whose products underflow."""
    meets = (a.focal_sets[:, None] & b.focal_sets[None, :]).ravel()
    with np.errstate(divide="ignore"):
        logs = (np.log(a.masses)[:, None] + np.log(b.masses)[None, :]).ravel()
    real = (meets != 0) & np.isfinite(logs)
    if not real.any():
        raise ConflictError(
            "total conflict: the two sources have no focal set in common; discount one of them first"
        )
    sets, where = np.unique(meets[real], return_inverse=True)
    masses = np.zeros(len(sets))
    np.add.at(masses, where, np.exp(logs[real] - logs[real].max()))
    return MassFunction.trusted(a.frame, sets, masses / masses.sum())


def _by_slot(
    a: MassFunction, b: MassFunction, operation: int, keep_empty: bool, normalise: bool
) -> Combination:
    """Batches whose focal sets are shared: where each pair of sets goes is found once."""
    s, t = a.focal_sets[:, None], b.focal_sets[None, :]
    goes = s | t if operation == UNION else s & t
    clash = s & t == 0
    if operation == DUBOIS_PRADE:
        goes = np.where(clash, s | t, goes)
    sets, slots = np.unique(goes, return_inverse=True)
    batch = np.broadcast_shapes(a.batch, b.batch)
    rows = int(np.prod(batch))
    out = np.zeros((rows, len(sets)))
    mine, other = _rows(a.masses, batch), _rows(b.masses, batch)
    kernels().products_by_slot(mine, other, rows, slots.reshape(goes.shape), out)
    joint = MassFunction.trusted(a.frame, sets, out.reshape(*batch, len(sets)), "shared")
    if operation == DUBOIS_PRADE:
        both = np.zeros((rows, 2))
        kernels().products_by_slot(mine, other, rows, np.where(clash, 0, 1), both)
        conflict = both[:, 0]
        return Combination(joint, conflict.reshape(batch))
    if operation == UNION or sets[0] != 0:
        return Combination(joint, np.zeros(batch))
    conflict = joint.masses[..., 0].copy()
    if keep_empty:
        return Combination(joint, conflict)
    masses = joint.masses[..., 1:]
    if normalise:
        total = masses.sum(axis=-1, keepdims=True)
        if not np.all(total > SMALLEST):
            return _rescue(a, b, batch)
        masses = masses / total
    return Combination(MassFunction.trusted(a.frame, sets[1:], masses.copy(), "shared"), conflict)


def _singletons(a: MassFunction, b: MassFunction, keep_empty: bool, normalise: bool) -> Combination:
    """Closed form over single hypotheses and the frame: only equal hypotheses, and the frame, meet."""
    x, y = a.masses[..., :-1], b.masses[..., :-1]
    u, v = a.masses[..., -1:], b.masses[..., -1:]
    if len(a.frame) == 1:
        return Combination(a if a.batch else b, np.zeros(np.broadcast_shapes(a.batch, b.batch)))
    masses = np.concatenate([x * y + x * v + u * y, u * v], axis=-1)
    total = masses.sum(axis=-1, keepdims=True)
    clash = x.sum(axis=-1) * y.sum(axis=-1) - (x * y).sum(axis=-1)
    conflict = np.maximum(clash, 0.0)
    if keep_empty:
        sets = np.append(a.focal_sets, np.int64(0))
        joint = MassFunction.trusted(a.frame, sets, np.concatenate([masses, conflict[..., None]], axis=-1))
        return Combination(joint, conflict)
    if normalise:
        if not np.all(total > SMALLEST):
            return _rescue(a, b, np.broadcast_shapes(a.batch, b.batch))
        masses /= total
    return Combination(MassFunction.trusted(a.frame, a.focal_sets, masses, "singletons"), conflict)


def _dense(a: MassFunction, b: MassFunction, upward: bool, keep_empty: bool, normalise: bool) -> Combination:
    """By transforms: commonalities multiply, and so do implicabilities (``upward``)."""
    batch, rows = _batch_of(a, b)
    size = a.masses.shape[-1]
    out, conflict, totals = np.empty((rows, size)), np.empty(rows), np.empty(rows)
    mine, other = _rows(a.masses, batch), _rows(b.masses, batch)
    kernels().dense_product(
        mine, other, rows, len(a.frame), upward, keep_empty, normalise, out, conflict, totals
    )
    if normalise and not (totals > SMALLEST).all():
        if batch:
            return _rescue(a, b, batch)
        return Combination(_by_logarithms(a, b).to("dense"), np.float64(conflict[0]))
    joint = MassFunction.trusted(a.frame, a.focal_sets, out.reshape(*batch, size), "dense")
    return Combination(joint, conflict.reshape(batch) if batch else conflict[0])
