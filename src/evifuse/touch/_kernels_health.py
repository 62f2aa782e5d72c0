"""Inner loops over the readings of each taxel, compiled by numba on first use and cached on disk.

Nothing outside `evifuse.touch` calls them. They give what NumPy's functions of the same names give.
"""

# numba finds the types itself
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUntypedFunctionDecorator=false
# pyright: reportUnknownVariableType=false, reportUnknownMemberType=false, reportUnknownArgumentType=false

import numba
import numpy as np

njit = numba.njit(cache=True, nogil=True, error_model="numpy")


@njit
def select(values, count, k):
    """The k-th smallest (from 0) of the first values (count,), reordered: none before it is larger."""
    low, high = 0, count - 1
    while low < high:
        middle = (low + high) // 2
        if values[middle] < values[low]:
            values[middle], values[low] = values[low], values[middle]
        if values[high] < values[low]:
            values[high], values[low] = values[low], values[high]
        if values[high] < values[middle]:
            values[high], values[middle] = values[middle], values[high]
        pivot = values[middle]
        i, j = low, high
        while i <= j:
            while values[i] < pivot:
                i += 1
            while pivot < values[j]:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if k <= j:
            high = j
        elif k >= i:
            low = i
        else:
            break
    return values[k]


@njit
def median(values, count):
    """Median of the first values (count,), which are reordered; NaN of none."""
    if count == 0:
        return np.nan
    upper = select(values, count, count // 2)
    if count % 2:
        return upper
    lower = values[0]
    for i in range(1, count // 2):
        lower = max(lower, values[i])
    return 0.5 * (lower + upper)


@njit
def quantile(values, count, share):
    """Quantile, linear between two of the first values (count,), which are reordered."""
    place = share * (count - 1)
    k = int(place)
    lower = select(values, count, k)
    if k + 1 >= count:
        return lower
    upper = values[k + 1]
    for i in range(k + 2, count):
        upper = min(upper, values[i])
    return lower + (place - k) * (upper - lower)


@njit
def taxel_statistics(columns, every):
    """Median, median distance from it, largest rise and largest distance of each taxel's readings (N, S).

    The medians are those of every so many of the readings.
    """
    taxels, samples = columns.shape
    quiet, spread, rise, reach = np.empty(taxels), np.empty(taxels), np.empty(taxels), np.empty(taxels)
    count = (samples + every - 1) // every
    buffer = np.empty(count)
    for j in range(taxels):
        for s in range(count):
            buffer[s] = columns[j, s * every]
        middle = median(buffer, count)
        lowest, highest = np.inf, -np.inf
        for s in range(samples):
            lowest, highest = min(lowest, columns[j, s]), max(highest, columns[j, s])
        for s in range(count):
            buffer[s] = abs(buffer[s] - middle)
        quiet[j], rise[j], spread[j] = middle, highest - middle, median(buffer, count)
        reach[j] = max(rise[j], middle - lowest)
    return quiet, spread, rise, reach


@njit
def contrasts(sample, quiet):
    """How far the largest rise above quiet readings (N,) stands out of the median one, per sample (S, N)."""
    samples, taxels = sample.shape
    out, buffer = np.empty(samples), np.empty(taxels)
    for s in range(samples):
        highest = -np.inf
        for j in range(taxels):
            buffer[j] = sample[s, j] - quiet[j]
            highest = max(highest, buffer[j])
        out[s] = highest - median(buffer, taxels)
    return out


@njit
def baseline_moves(sample, quiet, windows, free, quiet_times, pauses):
    """How far the mean of each taxel (N,) moves between windows, over the samples (S, N) without contact."""
    samples, taxels = sample.shape
    contrast = np.empty(samples)
    for s in range(samples):
        highest, total = -np.inf, 0.0
        for j in range(taxels):
            rise = sample[s, j] - quiet[j]
            highest = max(highest, rise)
            total += rise
        contrast[s] = highest - total / taxels
    buffer = contrast.copy()
    quietest, loudest = quantile(buffer, samples, 0.05), quantile(buffer, samples, 0.95)
    lowest, highest, mean = np.full(taxels, np.inf), np.full(taxels, -np.inf), np.zeros(taxels)
    if quietest > pauses * loudest:
        return mean
    most = max(free * loudest, quiet_times * quietest)
    count = 0
    for s in range(samples):
        if contrast[s] < most:
            count += 1
            mean += sample[s]
        if s + 1 == samples or (windows * (s + 1)) // samples > (windows * s) // samples:
            if count > 1:
                for j in range(taxels):
                    lowest[j] = min(lowest[j], mean[j] / count)
                    highest[j] = max(highest[j], mean[j] / count)
            count = 0
            mean[:] = 0.0
    for j in range(taxels):
        mean[j] = max(highest[j] - lowest[j], 0.0)
    return mean


@njit
def window_levels(sample, rows, starts):
    """Median (W, N) of the samples (S, N) in each window of rows (R,), and of the distances from it (W,)."""
    windows, taxels = len(starts) - 1, sample.shape[1]
    level, scatter = np.empty((windows, taxels)), np.empty(windows)
    longest = 0
    for w in range(windows):
        longest = max(longest, starts[w + 1] - starts[w])
    buffer, apart = np.empty(longest), np.empty(longest * taxels)
    for w in range(windows):
        count = starts[w + 1] - starts[w]
        for j in range(taxels):
            for i in range(count):
                buffer[i] = sample[rows[starts[w] + i], j]
            level[w, j] = median(buffer, count)
            for i in range(count):
                apart[j * count + i] = abs(buffer[i] - level[w, j])
        scatter[w] = median(apart, count * taxels)
    return level, scatter


@njit
def answers(columns, quiet, ends, taxel, first, second, least):
    """What taxels answer with (G,) when others load them, what is asked of them (G,), and how often (G,).

    The pairs (P,) of a taxel follow each other; `ends` (G + 1,) says where those of each begin. It is asked
    for the largest of the lesser readings of its pairs, above the quiet ones, where that exceeds the least.
    """
    groups, samples = len(ends) - 1, columns.shape[1]
    answer, asked = np.zeros(groups), np.zeros(groups)
    often = np.zeros(groups, np.int64)
    expected = np.empty(samples)
    for g in range(groups):
        expected[:] = -np.inf
        for p in range(ends[g], ends[g + 1]):
            a, b = first[p], second[p]
            quiet_a, quiet_b = quiet[a], quiet[b]
            for s in range(samples):
                lesser = min(columns[a, s] - quiet_a, columns[b, s] - quiet_b)
                expected[s] = max(expected[s], lesser)
        j = taxel[ends[g]]
        for s in range(samples):
            if expected[s] > least:
                answer[g] += columns[j, s] - quiet[j]
                asked[g] += expected[s]
                often[g] += 1
    return answer, asked, often
