"""Inner loops of the combination rules, compiled by numba on first use and cached on disk.

Every kernel works on C-contiguous rows: ``sets`` and ``masses`` of shape (R, F), where R is 1 for operands
that are the same for the whole batch. Nothing outside `evifuse.belief` calls them.
"""

# numba finds the types itself
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUntypedFunctionDecorator=false

import numba
import numpy as np

INTERSECTION, UNION, DUBOIS_PRADE = 0, 1, 2
"""What becomes of the product of two focal sets."""

SCRATCH_BITS = 12
"""Up to so many hypotheses sums are kept in an array over all subsets; above, in a hash table."""

GOLDEN = np.uint64(0x9E3779B97F4A7C15)

njit = numba.njit(cache=True, nogil=True, error_model="numpy")


@njit
def _by_scan(sa, ma, sb, mb, union, sums):
    """Sums of products over all subsets: no look-up, for many pairs in a small frame."""
    f, g = sa.shape[0], sb.shape[0]
    if union:
        for i in range(f):
            s, x = sa[i], ma[i]
            for j in range(g):
                sums[s | sb[j]] += x * mb[j]
    else:
        for i in range(f):
            s, x = sa[i], ma[i]
            for j in range(g):
                sums[s & sb[j]] += x * mb[j]


@njit
def _by_list(sa, ma, sb, mb, union, sums, touched):
    """Sums of products over all subsets, with a list of those that were met; no branch in the inner loop."""
    count = 0
    for i in range(sa.shape[0]):
        s, x = sa[i], ma[i]
        for j in range(sb.shape[0]):
            goes = s | sb[j] if union else s & sb[j]
            touched[count] = goes
            count += sums[goes] == 0.0
            sums[goes] += x * mb[j]
    return count


@njit
def _by_hash(sa, ma, sb, mb, operation, keys, sums, stamps, stamp, touched, bits):
    """Sums of products in an open-addressing hash table, for large frames."""
    mask = (1 << bits) - 1
    shift = np.uint64(64 - bits)
    count = 0
    conflict = 0.0
    for i in range(sa.shape[0]):
        s, x = sa[i], ma[i]
        for j in range(sb.shape[0]):
            t = sb[j]
            value = x * mb[j]
            goes = s & t
            if goes == 0:
                conflict += value
            if operation == UNION or (goes == 0 and operation == DUBOIS_PRADE):
                goes = s | t
            elif goes == 0:
                continue
            at = np.int64((np.uint64(goes) * GOLDEN) >> shift)
            while stamps[at] == stamp and keys[at] != goes:
                at = (at + 1) & mask
            if stamps[at] == stamp:
                sums[at] += value
            else:
                stamps[at] = stamp
                keys[at] = goes
                sums[at] = value
                touched[count] = at
                count += 1
    return count, conflict


@njit
def one_pair(sa, ma, sb, mb, operation, bits, keep_empty, normalise, out_s, out_m):
    """`pairs` for a single case, without the batch's bookkeeping; returns count, conflict and total."""
    f, g = sa.shape[0], sb.shape[0]
    count = 0
    conflict = 0.0
    total = 0.0
    if bits <= SCRATCH_BITS and operation != DUBOIS_PRADE:
        size = 1 << bits
        sums = np.zeros(size)
        _by_scan(sa, ma, sb, mb, operation == UNION, sums)
        conflict = 0.0 if operation == UNION else sums[0]
        for k in range(0 if operation == UNION else 1, size):
            value = sums[k]
            if value != 0.0:
                out_s[count] = k
                out_m[count] = value
                total += value
                count += 1
    else:
        slots_bits = 3
        while (1 << slots_bits) < 2 * f * g:
            slots_bits += 1
        slots = 1 << slots_bits
        stamps = np.zeros(slots, np.int32)
        keys = np.empty(slots, np.int64)
        sums = np.empty(slots)
        touched = np.empty(f * g, np.int64)
        met, conflict = _by_hash(sa, ma, sb, mb, operation, keys, sums, stamps, 1, touched, slots_bits)
        if operation == UNION:
            conflict = 0.0
        for k in range(met):
            value = sums[touched[k]]
            if value > 0.0:
                out_s[count] = keys[touched[k]]
                out_m[count] = value
                total += value
                count += 1
    if normalise and total > 0.0:
        for k in range(count):
            out_m[k] /= total
    if keep_empty and conflict > 0.0:
        out_s[count] = 0
        out_m[count] = conflict
        count += 1
    return count, conflict, total


@njit
def pairs(
    sets_a, masses_a, sets_b, masses_b, rows, operation, bits, keep_empty, normalise, out_sets, out_masses
):
    """Products of all pairs of focal sets, summed by where they go.

    That is the intersection, the union, or Dubois and Prade's choice; ``bits`` is the number of hypotheses.
    Returns the number of sets, the conflict, and the mass off the empty set, of each row.
    """
    f, g = sets_a.shape[1], sets_b.shape[1]
    size = 1 << min(bits, 62)
    small = bits <= SCRATCH_BITS and operation != DUBOIS_PRADE
    scan = small and f * g >= size // 4
    slots_bits = 3
    while not small and (1 << slots_bits) < 2 * f * g:
        slots_bits += 1
    slots = size if small else 1 << slots_bits
    keys = np.empty(1 if small else slots, np.int64)
    stamps = np.zeros(1 if small else slots, np.int32)
    sums = np.zeros(slots)
    touched = np.empty(1 if scan else f * g + 1, np.int64)
    counts = np.empty(rows, np.int64)
    conflicts = np.zeros(rows, np.float64)
    totals = np.empty(rows, np.float64)
    step_sa, step_a = int(sets_a.shape[0] > 1), int(masses_a.shape[0] > 1)
    step_sb, step_b = int(sets_b.shape[0] > 1), int(masses_b.shape[0] > 1)
    for row in range(rows):
        sa, ma = sets_a[row * step_sa], masses_a[row * step_a]
        sb, mb = sets_b[row * step_sb], masses_b[row * step_b]
        out_s, out_m = out_sets[row], out_masses[row]
        count = 0
        conflict = 0.0
        total = 0.0
        if scan:
            _by_scan(sa, ma, sb, mb, operation == UNION, sums)
            conflict = 0.0 if operation == UNION else sums[0]
            sums[0] = 0.0
            for k in range(size):
                value = sums[k]
                if value != 0.0:
                    out_s[count] = k
                    out_m[count] = value
                    total += value
                    count += 1
                    sums[k] = 0.0
        else:
            if small:
                met = _by_list(sa, ma, sb, mb, operation == UNION, sums, touched)
            else:
                met, conflict = _by_hash(
                    sa, ma, sb, mb, operation, keys, sums, stamps, row + 1, touched, slots_bits
                )
            for k in range(met):
                at = touched[k]
                value = sums[at]
                sums[at] = 0.0
                if small and at == 0:
                    conflict = value
                elif value > 0.0:
                    out_s[count] = at if small else keys[at]
                    out_m[count] = value
                    total += value
                    count += 1
        if normalise and total > 0.0:
            for k in range(count):
                out_m[k] /= total
        if keep_empty and conflict > 0.0 and operation != UNION:
            out_s[count] = 0
            out_m[count] = conflict
            count += 1
        counts[row] = count
        conflicts[row] = 0.0 if operation == UNION else conflict
        totals[row] = total
    return counts, conflicts, totals


@njit
def proportional(sets_a, masses_a, sets_b, masses_b, rows, out_sets, out_masses):
    """PCR5: products of sets that meet go to their intersection, the others back to the two sets.

    Places in the output are found by a hash table over the intersections and the sets themselves.
    """
    f, g = sets_a.shape[1], sets_b.shape[1]
    bits = 4
    while (1 << bits) < 2 * (f * g + f + g):
        bits += 1
    mask = (1 << bits) - 1
    shift = np.uint64(64 - bits)
    keys = np.empty(1 << bits, np.int64)
    stamps = np.zeros(1 << bits, np.int32)
    place = np.empty(1 << bits, np.int64)
    counts = np.empty(rows, np.int64)
    conflicts = np.zeros(rows, np.float64)
    step_sa, step_a = int(sets_a.shape[0] > 1), int(masses_a.shape[0] > 1)
    step_sb, step_b = int(sets_b.shape[0] > 1), int(masses_b.shape[0] > 1)
    for row in range(rows):
        stamp = row + 1
        count = 0
        for i in range(f):
            x = masses_a[row * step_a, i]
            s = sets_a[row * step_sa, i]
            for j in range(g):
                y = masses_b[row * step_b, j]
                if x * y == 0.0:
                    continue
                t = sets_b[row * step_sb, j]
                parts = 1 if s & t != 0 else 2
                if parts == 2:
                    conflicts[row] += x * y
                for part in range(parts):
                    if parts == 1:
                        goes, value = s & t, x * y
                    elif part == 0:
                        goes, value = s, x * y * (x / (x + y))
                    else:
                        goes, value = t, x * y * (y / (x + y))
                    at = np.int64((np.uint64(goes) * GOLDEN) >> shift)
                    while stamps[at] == stamp and keys[at] != goes:
                        at = (at + 1) & mask
                    if stamps[at] != stamp:
                        stamps[at] = stamp
                        keys[at] = goes
                        place[at] = count
                        out_sets[row, count] = goes
                        out_masses[row, count] = 0.0
                        count += 1
                    out_masses[row, place[at]] += value
        counts[row] = count
    return counts, conflicts


@njit
def products_by_slot(masses_a, masses_b, rows, slots, out):
    """Products of two batches whose focal sets are shared: ``slots[i, j]`` says where a pair goes."""
    step_a, step_b = int(masses_a.shape[0] > 1), int(masses_b.shape[0] > 1)
    for row in range(rows):
        for i in range(slots.shape[0]):
            x = masses_a[row * step_a, i]
            for j in range(slots.shape[1]):
                out[row, slots[i, j]] += x * masses_b[row * step_b, j]


@njit
def zeta_up(v):
    """Sum over subsets, in place, of one array over all subsets (Kennes 1992); two levels in each sweep."""
    size = v.shape[0]
    half = 1
    while 4 * half <= size:
        for start in range(0, size, 4 * half):
            for k in range(start, start + half):
                a, b, c, d = v[k], v[k + half], v[k + 2 * half], v[k + 3 * half]
                v[k + half] = a + b
                v[k + 2 * half] = a + c
                v[k + 3 * half] = a + b + c + d
        half *= 4
    if 2 * half <= size:
        for k in range(half):
            v[k + half] += v[k]


@njit
def zeta_down(v):
    """Sum over supersets, in place."""
    size = v.shape[0]
    half = 1
    while 4 * half <= size:
        for start in range(0, size, 4 * half):
            for k in range(start, start + half):
                a, b, c, d = v[k], v[k + half], v[k + 2 * half], v[k + 3 * half]
                v[k] = a + b + c + d
                v[k + half] = b + d
                v[k + 2 * half] = c + d
        half *= 4
    if 2 * half <= size:
        for k in range(half):
            v[k] += v[k + half]


@njit
def moebius_up(v):
    """Inverse of `zeta_up`, in place."""
    size = v.shape[0]
    half = 1
    while 4 * half <= size:
        for start in range(0, size, 4 * half):
            for k in range(start, start + half):
                a, b, c, d = v[k], v[k + half], v[k + 2 * half], v[k + 3 * half]
                v[k + half] = b - a
                v[k + 2 * half] = c - a
                v[k + 3 * half] = (d - c) - (b - a)
        half *= 4
    if 2 * half <= size:
        for k in range(half):
            v[k + half] -= v[k]


@njit
def moebius_down(v):
    """Inverse of `zeta_down`, in place."""
    size = v.shape[0]
    half = 1
    while 4 * half <= size:
        for start in range(0, size, 4 * half):
            for k in range(start, start + half):
                a, b, c, d = v[k], v[k + half], v[k + 2 * half], v[k + 3 * half]
                v[k] = (a - b) - (c - d)
                v[k + half] = b - d
                v[k + 2 * half] = c - d
        half *= 4
    if 2 * half <= size:
        for k in range(half):
            v[k] -= v[k + half]


@njit
def _focal(masses, places):
    """Places of the positive masses of an array over all subsets."""
    count = 0
    for k in range(masses.shape[0]):
        if masses[k] > 0.0:
            places[count] = k
            count += 1
    return count


@njit
def dense_product(masses_a, masses_b, rows, bits, upward, keep_empty, normalise, out, conflicts, totals):
    """Conjunctive (or, ``upward``, disjunctive) combination of arrays over all subsets.

    By transforms, or by pairs where few enough sets carry mass: that is faster then, and exact.
    """
    size = masses_a.shape[1]
    other = np.empty(size)
    places_a, places_b = np.empty(size, np.int64), np.empty(size, np.int64)
    step_a, step_b = int(masses_a.shape[0] > 1), int(masses_b.shape[0] > 1)
    for row in range(rows):
        mine, a, b = out[row], masses_a[row * step_a], masses_b[row * step_b]
        f, g = _focal(a, places_a), _focal(b, places_b)
        if f * g <= bits * size:
            mine[:] = 0.0
            for i in range(f):
                s = places_a[i]
                x = a[s]
                for j in range(g):
                    t = places_b[j]
                    mine[s | t if upward else s & t] += x * b[t]
        else:
            mine[:] = a
            other[:] = b
            scale = 1.0
            if upward:
                zeta_up(mine)
                zeta_up(other)
                for k in range(size):
                    mine[k] *= other[k]
                moebius_up(mine)
            else:
                zeta_down(mine)
                zeta_down(other)
                scale = 0.0
                for k in range(size):
                    mine[k] *= other[k]
                for k in range(bits):  # no mass off the empty set is larger than a hypothesis' commonality
                    scale = max(scale, mine[1 << k])
                moebius_down(mine)
            for k in range(size):  # masses are sums of products: what is below rounding is a residue
                mine[k] = mine[k] if mine[k] > 1e-16 * scale else 0.0
        conflicts[row] = 0.0 if upward else mine[0]
        if not keep_empty and not upward:
            mine[0] = 0.0
        total = 0.0
        for k in range(0 if upward else 1, size):
            total += mine[k]
        totals[row] = total
        if normalise and total > 0.0:
            scale = 1.0 / total
            for k in range(size):
                mine[k] *= scale


@njit
def dense_proportional(masses_a, masses_b, rows, out):
    """Add the PCR5 shares of all disjoint pairs to arrays over all subsets."""
    size = masses_a.shape[1]
    step_a, step_b = int(masses_a.shape[0] > 1), int(masses_b.shape[0] > 1)
    for row in range(rows):
        mine, a, b = out[row], masses_a[row * step_a], masses_b[row * step_b]
        for s in range(1, size - 1):
            x = a[s]
            if x == 0.0:
                continue
            rest = size - 1 - s
            kept = 0.0
            t = rest
            while t > 0:
                y = b[t]
                share = x * y / (x + y)
                kept += share
                mine[t] += y * share
                t = (t - 1) & rest
            mine[s] += x * kept
