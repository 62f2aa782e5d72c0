"""Inner loops of the rules for many sources, compiled by numba on first use and cached on disk."""

# numba finds the types itself
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUntypedFunctionDecorator=false

import math

import numpy as np

from evifuse.belief._kernels import GOLDEN, njit

__all__ = ["scaled_intersections", "shares_of_conflict"]

FORGOTTEN = -1000
"""Powers of two so far below the largest term of a sum don't change it."""


@njit
def scaled_intersections(
    sets_a, parts_a, powers_a, sets_b, parts_b, powers_b, out_sets, out_parts, out_powers
):
    """Products of all pairs of focal sets, summed by intersection; a mass is ``part * 2**power``.

    So none is too small for a number. Sums are kept in a hash table, each relative to the power of its
    largest term. Returns the number of sets of each row; the empty set is one of them.
    """
    rows, f = sets_a.shape
    g = sets_b.shape[1]
    bits = 3
    while (1 << bits) < 2 * min(f * g, out_sets.shape[1]) + 2:
        bits += 1
    mask = (1 << bits) - 1
    shift = np.uint64(64 - bits)
    keys = np.empty(1 << bits, np.int64)
    stamps = np.zeros(1 << bits, np.int32)
    place = np.empty(1 << bits, np.int64)
    counts = np.empty(rows, np.int64)
    for row in range(rows):
        stamp = row + 1
        count = 0
        parts, powers = out_parts[row], out_powers[row]
        for i in range(f):
            if parts_a[row, i] == 0.0:
                continue
            for j in range(g):
                value = parts_a[row, i] * parts_b[row, j]
                if value == 0.0:
                    continue
                power = powers_a[row, i] + powers_b[row, j]
                goes = sets_a[row, i] & sets_b[row, j]
                at = np.int64((np.uint64(goes) * GOLDEN) >> shift)
                while stamps[at] == stamp and keys[at] != goes:
                    at = (at + 1) & mask
                if stamps[at] != stamp:
                    stamps[at] = stamp
                    keys[at] = goes
                    place[at] = count
                    out_sets[row, count] = goes
                    parts[count] = value
                    powers[count] = power
                    count += 1
                    continue
                k = place[at]
                apart = power - powers[k]
                if apart > 0:
                    parts[k] = parts[k] * 2.0 ** max(-apart, FORGOTTEN) + value
                    powers[k] = power
                else:
                    parts[k] += value * 2.0 ** max(apart, FORGOTTEN)
        for k in range(count):
            part, power = math.frexp(parts[k])
            parts[k] = part
            powers[k] += power
        counts[row] = count
    return counts


@njit
def shares_of_conflict(sets, masses, out):
    """PCR6: what each focal set of each source gets back of the products that contradict each other.

    ``sets`` and ``masses`` have shape (R, M, F); all ways to take one focal set of each source are visited,
    like the digits of a counter, with the product, the sum and the intersection so far kept for each digit.
    """
    rows, sources, width = sets.shape
    digit = np.zeros(sources, np.int64)
    product = np.ones(sources + 1)
    total = np.zeros(sources + 1)
    common = np.empty(sources + 1, np.int64)
    common[0] = -1
    for row in range(rows):
        level = 0
        digit[0] = 0
        while level >= 0:
            if digit[level] == width:
                level -= 1
                if level >= 0:
                    digit[level] += 1
                continue
            mass = masses[row, level, digit[level]]
            if mass == 0.0:
                digit[level] += 1
                continue
            product[level + 1] = product[level] * mass
            total[level + 1] = total[level] + mass
            common[level + 1] = common[level] & sets[row, level, digit[level]]
            if level + 1 < sources:
                level += 1
                digit[level] = 0
                continue
            if common[sources] == 0:
                share = product[sources] / total[sources]
                for i in range(sources):
                    out[row, i, digit[i]] += share * masses[row, i, digit[i]]
            digit[level] += 1
