"""Large NumPy batches through compiled matrices, in machine code.

The same steps as in `_batch`, for batches that repay the second that loading numba takes. Rows are counted
and ordered by their pattern of zeros, then go through in tiles of one pattern that stay in the first cache:
every loop that costs runs along the rows of a tile.
"""

from math import log
from typing import Any

import numba
import numpy as np

from evifuse.conductivity.classify import BRANCH_TOLERANCE, NOTHING

__all__ = ["bad_row", "ordered", "tiles"]

TILE = 128
"""Rows of one pattern that go through together."""

FAST: Any = {"contract", "nsz"}


@numba.njit(cache=True, nogil=True, error_model="numpy")
def bad_row(masses: Any, tolerance: float) -> int:
    """First row of masses [N, F] that are not numbers from 0 that sum to 1; -1 if all are."""
    for row in range(masses.shape[0]):
        total = 0.0
        fine = True
        for i in range(masses.shape[1]):
            fine &= masses[row, i] >= 0.0
            total += masses[row, i]
        if not (fine and abs(total - 1.0) <= tolerance):
            return row
    return -1


@numba.njit(cache=True, nogil=True, error_model="numpy")
def ordered(masses: Any, whole: int, commitment: float, negligible: float, patterns: int) -> Any:
    """Rows in the order of their patterns of zeros as they meet the prototypes, and how many each has."""
    n, given = masses.shape
    codes = np.empty(n, dtype=np.uint16)
    counts = np.zeros(patterns, dtype=np.int64)
    for row in range(n):
        code = 0
        if commitment < 0.0:
            for i in range(given):
                code |= (masses[row, i] > 0.0) << i
        else:
            off = 0.0
            for i in range(given):
                if i != whole:
                    off += masses[row, i]
            least = negligible * off
            at = 0
            kept = 0.0
            for i in range(given):
                if i != whole:
                    if masses[row, i] > 0.0 and masses[row, i] >= least:
                        code |= 1 << at
                        kept += masses[row, i]
                    at += 1
            code = (code if kept > NOTHING else 0) | 1 << at
        codes[row] = code
        counts[code] += 1
    following = np.cumsum(counts) - counts
    order = np.empty(n, dtype=np.int64)
    for row in range(n):
        code = codes[row]
        order[following[code]] = row
        following[code] += 1
    return order, counts


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def tiles(
    masses: Any, order: Any, out: Any, wanted: int, whole: int, commitment: float,
    present: Any, tied: Any, weights: Any, constants: Any, between: Any, inner: Any, top: Any, capacity: Any,
    of_class: Any, sizes: Any, projected: bool, width: float, pooling: int, power: float, keep: bool,
) -> None:  # fmt: skip
    """Rows ``order`` of masses [N, F], all of one pattern, into the same rows of ``out``."""
    f, p = len(present), len(inner)
    v = np.empty((f + len(tied), TILE))
    logs, products = np.empty_like(v), np.empty_like(v)
    acc = np.empty((p + 1, TILE))
    total = np.empty((len(sizes) + 1, TILE))  # the last for the frame
    committed = np.ones(TILE)
    for start in range(0, len(order), TILE):
        rows = order[start : start + TILE]
        n = len(rows)
        _gather(masses, rows, whole, commitment, present, v, committed)
        _terms(v, logs, products, n, tied, weights, constants, between, acc)
        if wanted != 3:
            _dimensions(acc, n, inner, power)
        if wanted >= 2:
            for t in range(n):
                for j in range(p):
                    out[rows[t], j] = acc[j, t]
            continue
        if projected:
            _branches(acc, n, top, capacity, width)
        _pool(acc, n, of_class, sizes, pooling, total)
        if commitment >= 0.0:
            for c in range(len(sizes)):
                for t in range(n):
                    total[c, t] *= committed[t]
        columns = len(sizes)
        if wanted == 1:
            columns = _normalise(total, n, committed, keep)
        for t in range(n):
            for c in range(columns):
                out[rows[t], c] = total[c, t]


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def _gather(
    masses: Any, rows: Any, whole: int, commitment: float, present: Any, v: Any, committed: Any
) -> None:  # fmt: skip
    """Masses as they meet the prototypes, the sets of the pattern only, as columns ``v[:F]``."""
    for t in range(len(rows)):
        row = rows[t]
        if whole >= 0:
            committed[t] = 1.0 - masses[row, whole]
        if commitment < 0.0:
            for i in range(len(present)):
                v[i, t] = masses[row, present[i]]
            continue
        kept = 0.0
        for i in range(len(present) - 1):  # the last is the frame
            v[i, t] = masses[row, present[i]]
            kept += v[i, t]
        scale = commitment / kept if kept > 0.0 else 0.0
        for i in range(len(present) - 1):
            v[i, t] *= scale
        v[len(present) - 1, t] = 1.0 - commitment if kept > 0.0 else 1.0


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def _terms(
    v: Any, logs: Any, products: Any, n: int, tied: Any, weights: Any, constants: Any, between: Any, acc: Any
) -> None:
    """Divergences ``acc[:P]`` and the evidence's own inner entropy ``acc[P]``."""
    f = len(between)
    for m in range(len(tied)):
        v[f + m] = 0.0
        for i in range(f):
            if tied[m, i] != 0.0:
                for t in range(n):
                    v[f + m, t] += tied[m, i] * v[i, t]
    for i in range(len(v)):
        for t in range(n):
            logs[i, t] = log(v[i, t])
            products[i, t] = v[i, t] * logs[i, t]
    for j in range(len(acc)):
        acc[j] = constants[j]
        for i in range(len(v)):
            linear, single, both = weights[j, 0, i], weights[j, 1, i], weights[j, 2, i]
            for t in range(n):
                acc[j, t] += linear * v[i, t] + single * logs[i, t] + both * products[i, t]
    own = acc[len(acc) - 1]
    for i in range(f):
        for j in range(f):
            if i != j:
                for t in range(n):
                    own[t] -= between[i, j] * v[j, t] * logs[i, t]


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def _dimensions(acc: Any, n: int, inner: Any, power: float) -> None:
    """Divergences to interaction dimensions, in place, raised to the sharpness."""
    own = acc[len(inner)]
    for j in range(len(inner)):
        for t in range(n):
            part = own[t] + inner[j]
            whole = part + acc[j, t]
            acc[j, t] = part / whole if whole != 0.0 else 1.0
        if power == np.floor(power) and power <= 64.0:
            left = int(power) - 1
            base = acc[j].copy()
            while left > 0:
                if left & 1:
                    for t in range(n):
                        acc[j, t] *= base[t]
                left >>= 1
                for t in range(n):
                    base[t] *= base[t]
        else:
            for t in range(n):
                acc[j, t] = acc[j, t] ** power


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def _branches(acc: Any, n: int, top: Any, capacity: Any, width: float) -> None:
    """Interaction dimensions to conductivities, in place: A.8 iii and iv, or their smooth variant."""
    for j in range(len(top)):
        for t in range(n):
            dim = acc[j, t]
            seen = dim * capacity[j]
            if width > 0.0:
                seen = min(seen, top[j] + width)
                strong = _left(dim, top[j], width)
                acc[j, t] = strong * dim + (1.0 - strong) * _left(seen, top[j], width) * seen
            else:
                weak = seen if seen <= top[j] else 0.0
                acc[j, t] = dim if dim <= top[j] + BRANCH_TOLERANCE else weak


@numba.njit(cache=True, nogil=True, inline="always")
def _left(x: Any, top: Any, width: Any) -> Any:
    """1 up to the branch point, falling smoothly to 0 over the width above it."""
    t = min(max((x - top) / width, 0.0), 1.0)
    return 1.0 - t * t * (3.0 - 2.0 * t)


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def _pool(acc: Any, n: int, of_class: Any, sizes: Any, pooling: int, total: Any) -> None:
    """Conductivity of each class: sum (0), mean (1) or maximum (2) over its prototypes."""
    total[:] = 0.0
    for j in range(len(of_class)):
        pooled = total[of_class[j]]
        if pooling == 2:
            for t in range(n):
                pooled[t] = max(pooled[t], acc[j, t])
        else:
            share = 1.0 / sizes[of_class[j]] if pooling == 1 else 1.0
            for t in range(n):
                pooled[t] += share * acc[j, t]


@numba.njit(cache=True, nogil=True, error_model="numpy", fastmath=FAST)
def _normalise(total: Any, n: int, committed: Any, keep: bool) -> int:
    """Conductivities to masses of the classes and, unless there is only one, of the frame, in place."""
    frame = len(total) - 1
    if frame == 1:
        total[0] = 1.0
        return 1
    for t in range(n):
        everything = 0.0
        for c in range(frame):
            everything += total[c, t]
        known = committed[t] if keep else 1.0
        whole = everything if everything > 0.0 else 1.0
        known = known if everything > 0.0 else 0.0
        rest = 1.0
        for c in range(frame):
            total[c, t] = total[c, t] / whole * known
            rest -= total[c, t]
        total[frame, t] = rest if rest >= 1e-15 else 0.0
    return frame + 1
