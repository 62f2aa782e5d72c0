"""Inner loops over the samples of a site, compiled by numba on first use and cached on disk.

Nothing outside `evifuse.touch` calls them. They give what their NumPy twins in the tests give.
"""

# numba finds the types itself
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUntypedFunctionDecorator=false
# pyright: reportUnknownVariableType=false, reportUnknownMemberType=false, reportUnknownArgumentType=false

import numba
import numpy as np

from evifuse.touch._kernels_contact import largest

njit = numba.njit(cache=True, nogil=True, error_model="numpy")


@njit
def active_taxels(pressure, samples, threshold, share):
    """How many taxels (M,) tell of the contact in some samples: the square of the sum over that of squares.

    Of their pressures above the threshold, or above a share of the peak.
    """
    out = np.empty(samples.shape[0])
    for m in range(samples.shape[0]):
        row = pressure[samples[m]]
        floor, total, squares = max(threshold, share * largest(row)), 0.0, 0.0
        for j in range(row.shape[0]):
            above = max(row[j] - floor, 0.0)
            total += above
            squares += above * above
        out[m] = total * total / max(squares, 1e-300)
    return out


@njit
def patch_spread(pressure, samples, threshold, positions):
    """Mean squared distance (M,) of the pressure above a threshold from its centre; NaN counts as none."""
    out = np.empty(samples.shape[0])
    for m in range(samples.shape[0]):
        row = pressure[samples[m]]
        total = x = y = z = squares = 0.0
        for j in range(row.shape[0]):
            above = row[j] - threshold
            if above > 0.0:
                p, q, r = positions[j]
                total += above
                x, y, z = x + above * p, y + above * q, z + above * r
                squares += above * (p * p + q * q + r * r)
        total = max(total, 1e-12)
        out[m] = squares / total - (x * x + y * y + z * z) / (total * total)
    return out


@njit
def best_profile(size, total, squares, ends, powers):
    """Number of the power, reach and height of the profile (1 - r^2 / reach^2)^power that fits rings best.

    Rings as `rings` gives them; ``ends`` (E,) are the reaches that are tried, ``powers`` (P,) the exponents.
    """
    most, which, reach, height = -1.0, 0, 0.0, 0.0
    for p in range(powers.shape[0]):
        for end in ends:
            own = along = 0.0
            for k in range(size.shape[0]):
                if size[k] > 0.0:
                    left = max(1.0 - squares[k] / size[k] / (end * end), 0.0)
                    shape = 1.0
                    for _ in range(powers[p]):
                        shape *= left
                    weight = min(size[k], 200.0)
                    own += shape * shape * weight
                    along += shape * (weight * (total[k] / size[k]))
            gain = along * along / own if own > 0.0 else 0.0
            if gain > most:
                most, which, reach, height = gain, p, end, along / max(own, 1e-300)
    return which, reach, height


@njit
def depths(position, touching, centre, frame, turn, first, second, reach):
    """How deep each sample (T, 3) without contact lies below the surfaces of S sites, see `missed_sites`.

    Of centres (S, 3) and frames (S, 3, 3) with axes in columns; the surfaces turned by (cosine, sine) (S, 2)
    have curvatures ``first`` and ``second`` (S,). The site (T,) where that is least, that depth (T,), and the
    largest (T,); infinite, and minus infinite, where no site is within reach.
    """
    count = position.shape[0]
    nearest, least, most = np.zeros(count, np.int64), np.full(count, np.inf), np.full(count, -np.inf)
    for t in range(count):
        if touching[t]:
            continue
        for s in range(centre.shape[0]):
            p, q, r = (
                position[t, 0] - centre[s, 0],
                position[t, 1] - centre[s, 1],
                position[t, 2] - centre[s, 2],
            )
            x = p * frame[s, 0, 0] + q * frame[s, 1, 0] + r * frame[s, 2, 0]
            y = p * frame[s, 0, 1] + q * frame[s, 1, 1] + r * frame[s, 2, 1]
            if x * x + y * y > reach * reach:
                continue
            a, b = x * turn[s, 0] + y * turn[s, 1], y * turn[s, 0] - x * turn[s, 1]
            depth = min(0.5 * (first[s] * a * a + second[s] * b * b), 0.0)
            depth -= p * frame[s, 0, 2] + q * frame[s, 1, 2] + r * frame[s, 2, 2]
            most[t] = max(most[t], depth)
            if depth < least[t]:
                nearest[t], least[t] = s, depth
    return nearest, least, most
