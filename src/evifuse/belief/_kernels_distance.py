"""Inner loops of the distances, compiled by numba on first use and cached on disk."""

# numba finds the types itself
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUntypedFunctionDecorator=false

import numba
import numpy as np

njit = numba.njit(cache=True, nogil=True, error_model="numpy")
MASKS, VALUES, ROW, OUT = (
    numba.types.Array(numba.int64, 2, "C", readonly=True),
    numba.types.Array(numba.float64, 2, "C", readonly=True),
    numba.types.Array(numba.float64, 1, "C", readonly=True),
    numba.types.Array(numba.float64, 1, "C"),
)
SIZES = numba.types.Array(numba.uint8, 1, "C", readonly=True)
"""Types are given, so that writable and read-only operands share one compiled version."""

reorder = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"})


def compiled(*types):
    """A kernel for these types of operands."""
    return numba.njit(numba.void(*types), cache=True, nogil=True, error_model="numpy")


@njit
def _size(s):
    """Number of members of a bitmask."""
    x = np.uint64(s)
    x = x - ((x >> np.uint64(1)) & np.uint64(0x5555555555555555))
    x = (x & np.uint64(0x3333333333333333)) + ((x >> np.uint64(2)) & np.uint64(0x3333333333333333))
    x = (x + (x >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return np.int64((x * np.uint64(0x0101010101010101)) >> np.uint64(56))


@reorder
def _weighed(v, sizes):
    """Sum of squares, each times the size of its set; all terms are positive, so their order is free."""
    total = 0.0
    for k in range(v.shape[0]):
        total += sizes[k] * v[k] * v[k]
    return total


@njit
def _shares(v, t, scale):
    """In place: ``scale^|C|`` times the sum over A that hold C of ``v(A) t^|A - C|``."""
    half = 1
    size = v.shape[0]
    a, b, c = t * t, t * scale, scale * scale
    while 4 * half <= size:
        for start in range(0, size, 4 * half):
            for k in range(start, start + half):
                w, x, y, z = v[k], v[k + half], v[k + 2 * half], v[k + 3 * half]
                v[k] = w + t * (x + y) + a * z
                v[k + half] = scale * x + b * z
                v[k + 2 * half] = scale * y + b * z
                v[k + 3 * half] = c * z
        half *= 4
    if 2 * half <= size:
        for k in range(half):
            v[k] += t * v[k + half]
            v[k + half] *= scale


@compiled(VALUES, VALUES, numba.int64, ROW, ROW, SIZES, OUT)
def dense(masses_a, masses_b, rows, nodes, weights, sizes, out):
    """Squared Jousselme distances of arrays over all subsets, by quadrature over ``nodes`` in (0, 1)."""
    size = masses_a.shape[1]
    u, v = np.empty(size), np.empty(size)
    step_a, step_b = int(masses_a.shape[0] > 1), int(masses_b.shape[0] > 1)
    for row in range(rows):
        a, b = masses_a[row * step_a], masses_b[row * step_b]
        for k in range(size):
            u[k] = a[k] - b[k]
        total = u[0] * u[0]
        u[0] = 0.0
        for node in range(nodes.shape[0]):
            t = nodes[node]
            product = t * (1.0 - t)
            v[:] = u
            _shares(v, t, np.sqrt(product))
            total += weights[node] / product * _weighed(v, sizes)
        out[row] = 0.5 * total


@compiled(MASKS, VALUES, MASKS, VALUES, numba.int64, OUT)
def pairs(sets_a, masses_a, sets_b, masses_b, rows, out):
    """Squared Jousselme distances by the definition, over the focal sets of each pair."""
    f, g = sets_a.shape[1], sets_b.shape[1]
    step_sa, step_a = int(sets_a.shape[0] > 1), int(masses_a.shape[0] > 1)
    step_sb, step_b = int(sets_b.shape[0] > 1), int(masses_b.shape[0] > 1)
    sets, u, sizes = np.empty(f + g, np.int64), np.empty(f + g), np.empty(f + g, np.int64)
    for row in range(rows):
        count = 0
        for i in range(f):
            x = masses_a[row * step_a, i]
            if x != 0.0:
                sets[count], u[count] = sets_a[row * step_sa, i], x
                count += 1
        mine = count
        for j in range(g):
            y = masses_b[row * step_b, j]
            if y == 0.0:
                continue
            s = sets_b[row * step_sb, j]
            at = 0
            while at < mine and sets[at] != s:
                at += 1
            if at < mine:
                u[at] -= y
            else:
                sets[count], u[count] = s, -y
                count += 1
        for i in range(count):
            sizes[i] = _size(sets[i])
        total = 0.0
        for i in range(count):
            x = u[i]
            if x == 0.0:
                continue
            inner = 0.5 * x
            for j in range(i):
                meet = _size(sets[i] & sets[j])
                if meet:
                    inner += u[j] * meet / (sizes[i] + sizes[j] - meet)
            total += x * inner
        out[row] = max(total, 0.0)


@compiled(MASKS, VALUES, MASKS, VALUES, numba.int64, OUT)
def roots(sets_a, masses_a, sets_b, masses_b, rows, out):
    """Half the squared differences of the roots of masses, over the focal sets of each pair."""
    f, g = sets_a.shape[1], sets_b.shape[1]
    step_sa, step_a = int(sets_a.shape[0] > 1), int(masses_a.shape[0] > 1)
    step_sb, step_b = int(sets_b.shape[0] > 1), int(masses_b.shape[0] > 1)
    met = np.empty(g, np.int64)
    for row in range(rows):
        met[:] = 0
        total = 0.0
        for i in range(f):
            x = masses_a[row * step_a, i]
            if x == 0.0:
                continue
            s = sets_a[row * step_sa, i]
            y = 0.0
            for j in range(g):
                if sets_b[row * step_sb, j] == s and masses_b[row * step_b, j] > 0.0:
                    y = masses_b[row * step_b, j]
                    met[j] = 1
                    break
            total += (np.sqrt(x) - np.sqrt(y)) ** 2
        for j in range(g):
            if met[j] == 0:
                total += masses_b[row * step_b, j]
        out[row] = 0.5 * total
