"""Batches through compiled matrices with the array API: NumPy, PyTorch or JAX, on any device."""

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from evifuse.belief.mass import TOLERANCE
from evifuse.conductivity._matrices import Parts, Pattern
from evifuse.conductivity.classify import BRANCH_TOLERANCE, NOTHING
from evifuse.errors import MassError

__all__ = ["Batch", "Wanted", "bad_row", "spans"]

CHUNK = 1 << 13
"""Columns that go through the matrices together: on a processor they stay in the cache of one core."""

WORD = 30
"""Focal sets whose pattern of zeros fits into one number, whatever integers the array library has."""

Wanted = Literal["conductivities", "belief", "dimensions", "divergences"]


def bad_row(row: int, masses: Any) -> MassError:
    """What to say of a row that is not a mass function.

    Parameters
    ----------
    row : int
        Which one.
    masses : array of float, shape (F,)
        What it holds.

    Returns
    -------
    MassError
        To be raised.
    """
    listed = ", ".join(f"{float(v):.6g}" for v in masses)
    return MassError(f"row {row}: masses must be numbers from 0 that sum to 1, not {listed}")


def spans(count: int, size: int) -> list[tuple[int, int]]:
    """Start and end of pieces of at most ``size``; an empty batch is one empty piece.

    Parameters
    ----------
    count : int
        How many there are.
    size : int
        Largest piece.

    Returns
    -------
    list of (int, int)
        In order.
    """
    return [(at, min(at + size, count)) for at in range(0, max(count, 1), size)]


class Batch:
    """One call: the matrices as arrays of the caller's kind, and the steps of A.8 on them."""

    def __init__(self, parts: Parts, xp: Any, dtype: Any, device: Any, wanted: Wanted) -> None:
        self.parts, self.reading, self.xp, self.wanted = parts, parts.reading, xp, wanted
        self.dtype, self.device = dtype, device
        self.on_processor = "cpu" in str(device).lower()
        self.inner, self.top, self.capacity = map(self.array, (parts.inner, parts.top, parts.capacity))
        self.tolerance = max(TOLERANCE, 16 * float(xp.finfo(dtype).eps))
        self.classes = [np.flatnonzero(row).tolist() for row in parts.members]
        self.seen: dict[Pattern, tuple[Any, ...]] = {}

    def array(self, values: NDArray[Any]) -> Any:
        return self.xp.asarray(values, dtype=self.dtype, device=self.device)

    def block(self, flat: Any, first: int) -> Any:
        """Rows ``[n, F]`` in, rows of results out."""
        xp = self.xp
        b = xp.stack([flat[:, i] for i in range(flat.shape[1])])
        self.check(b, first)
        unknown = [i for i, is_frame in enumerate(self.parts.whole.tolist()) if is_frame]
        committed = 1.0 - b[unknown[0], :] if unknown else xp.ones_like(b[0, :])
        if self.reading.commitment is not None:
            b = self.at_commitment(b, unknown)
        if not b.shape[1] or bool(xp.all(b > 0)):
            return self.rows((True,) * b.shape[0], b, committed)
        return self.by_pattern(b, committed)

    def check(self, b: Any, first: int) -> None:
        xp = self.xp
        if not b.shape[1]:
            return
        fine = (xp.abs(xp.sum(b, axis=0) - 1.0) <= self.tolerance) & (xp.min(b, axis=0) >= 0)
        if not bool(xp.all(fine)):
            row = int(xp.argmin(xp.astype(fine, xp.int32)))
            raise bad_row(first + row, b[:, row])

    def at_commitment(self, b: Any, unknown: list[int]) -> Any:
        """The masses with a nominal share off the frame, without crumbs; ignorance where nothing is."""
        xp, nominal = self.xp, self.reading.commitment or 1.0
        if b.shape[0] == len(unknown):
            return b
        off = xp.stack([b[i, :] for i in range(b.shape[0]) if i not in unknown])
        zero = xp.zeros_like(off)
        off = xp.where(off < self.reading.negligible * xp.sum(off, axis=0), zero, off)
        kept = xp.sum(off, axis=0)
        some = kept > NOTHING
        off = off * xp.where(some, nominal / xp.where(some, kept, xp.ones_like(kept)), zero[0, :])
        rest = xp.where(some, (1.0 - nominal) * xp.ones_like(kept), xp.ones_like(kept))
        return xp.concat([off, rest[None, :]], axis=0)

    def by_pattern(self, b: Any, committed: Any) -> Any:
        """Cases with the same zeros together: a set without mass is not a focal set."""
        xp = self.xp
        order, counts, patterns = self.sorted_by_pattern(b > 0)
        b, committed = xp.take(b, order, axis=1), xp.take(committed, order, axis=0)
        out: list[Any] = []
        at = 0
        for count, pattern in zip(counts, patterns, strict=True):
            rows = [i for i, present in enumerate(pattern) if present]
            part = xp.stack([b[i, at : at + count] for i in rows])
            out.append(self.rows(pattern, part, committed[at : at + count]))
            at += count
        return xp.take(xp.concat(out, axis=0), xp.argsort(order), axis=0)

    def sorted_by_pattern(self, present: Any) -> tuple[Any, list[int], list[Pattern]]:
        """An order of the cases that brings equal patterns together, and how many there are of each."""
        xp, count = self.xp, present.shape[0]
        if count <= WORD:
            small = count < 15 and self.on_processor
            code = xp.zeros(present.shape[1], dtype=xp.int16 if small else xp.int32, device=self.device)
            for i in range(count):
                code = code + xp.astype(present[i, :], code.dtype) * (1 << i)
            order = xp.argsort(code, stable=True)
            found = xp.unique_counts(code)
            codes = [int(v) for v in found.values]
            patterns = [tuple(bool(v >> i & 1) for i in range(count)) for v in codes]
            return order, [int(v) for v in found.counts], patterns
        table = np.array([[bool(v) for v in row] for row in present])
        distinct, which, counts = np.unique(table, axis=1, return_inverse=True, return_counts=True)
        order = xp.asarray(np.argsort(which.ravel(), kind="stable"), device=self.device)
        return order, counts.tolist(), [tuple(column) for column in distinct.T.tolist()]

    def rows(self, pattern: Pattern, b: Any, committed: Any) -> Any:
        """Results of cases with one pattern, ``b`` of shape [F, n] and all positive, as rows [n, ...]."""
        xp, count = self.xp, b.shape[1]
        size = CHUNK if self.on_processor else max(count, 1)
        pieces = [self.finished(pattern, b[:, at:end], committed[at:end]) for at, end in spans(count, size)]
        return xp.permute_dims(pieces[0] if len(pieces) == 1 else xp.concat(pieces, axis=1), (1, 0))

    def finished(self, pattern: Pattern, b: Any, committed: Any) -> Any:
        """What was asked for, as columns [..., n]."""
        divergence, own = self.terms(pattern, b)
        if self.wanted == "divergences":
            return divergence
        dims = self.sharpened(_ratio(self.xp, own + self.inner, divergence))
        if self.wanted == "dimensions":
            return dims
        pooled = self.pooled(self.conducted(dims))
        if self.reading.commitment is not None:
            pooled = pooled * committed
        return pooled if self.wanted == "conductivities" else self.normalised(pooled, committed)

    def terms(self, pattern: Pattern, b: Any) -> tuple[Any, Any]:
        """Divergence to each prototype [P, n] and the evidence's inner entropy [n]."""
        xp = self.xp
        if pattern not in self.seen:
            made = self.parts.matrices(pattern)
            self.seen[pattern] = tuple(
                map(self.array, (made.tied, made.weights, made.constants, made.between))
            )
        tied, weights, constants, between = self.seen[pattern]
        v = xp.concat([b, tied @ b], axis=0) if tied.shape[0] else b
        logs = xp.log(v)
        linear = weights @ xp.concat([v, logs, v * logs], axis=0) + constants
        own = linear[-1, :] - xp.sum((between @ b) * logs[: b.shape[0], :], axis=0)
        return linear[:-1, :], own

    def sharpened(self, dims: Any) -> Any:
        power = self.reading.sharpness
        if power != round(power) or power > 64:
            return dims**power
        out, left = None, int(power)
        while left:
            if left & 1:
                out = dims if out is None else out * dims
            left >>= 1
            dims = dims * dims if left else dims
        return out

    def conducted(self, dims: Any) -> Any:
        """Conductivity of each prototype: the branches of A.8, or their smooth variant."""
        xp, width = self.xp, self.reading.smoothing
        if not self.reading.projection:
            return dims
        seen = dims * self.capacity
        if width > 0:
            seen = xp.minimum(seen, self.top + width)
            strong = _left(xp, dims, self.top, width)
            return strong * dims + (1.0 - strong) * _left(xp, seen, self.top, width) * seen
        weak = xp.where(seen <= self.top, seen, xp.zeros_like(seen))
        return xp.where(dims <= self.top + BRANCH_TOLERANCE, dims, weak)

    def pooled(self, sigma: Any) -> Any:
        """Conductivity of each class [C, n] from those of its prototypes [P, n]."""
        xp = self.xp
        out: list[Any] = []
        for rows in self.classes:
            total = sigma[rows[0], :]
            for row in rows[1:]:
                other = sigma[row, :]
                total = xp.maximum(total, other) if self.reading.pooling == "max" else total + other
            out.append(total / len(rows) if self.reading.pooling == "mean" else total)
        return xp.stack(out)

    def normalised(self, pooled: Any, committed: Any) -> Any:
        """Masses of the classes and the frame [C + 1, n]."""
        xp = self.xp
        if pooled.shape[0] == 1:
            return xp.ones_like(pooled)
        total = xp.sum(pooled, axis=0)
        none = xp.zeros_like(total)
        known = committed if self.reading.keep_ignorance else xp.ones_like(total)
        known = xp.where(total > 0, known, none)
        masses = pooled / xp.where(total > 0, total, none + 1.0) * known
        rest = 1.0 - xp.sum(masses, axis=0)
        rest = xp.where(rest < 1e-15, none, rest)
        return xp.concat([masses, rest[None, :]], axis=0)


def _ratio(xp: Any, part: Any, gap: Any) -> Any:
    """``part / (part + gap)``, and 1 where both vanish."""
    whole = part + gap
    one = xp.ones_like(whole)
    return xp.where(whole == 0, one, part / xp.where(whole == 0, one, whole))


def _left(xp: Any, x: Any, top: Any, width: float) -> Any:
    """1 up to the branch point, falling smoothly to 0 over the width above it."""
    t = xp.clip((x - top) / width, 0.0, 1.0)
    return 1.0 - t * t * (3.0 - 2.0 * t)
