"""The integral behind the masses of primitives, compiled by numba on first use and cached on disk.

Nothing outside `evifuse.touch.resolved` calls it. It gives what its NumPy twin in the tests gives.
"""

# numba finds the types itself
# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUntypedFunctionDecorator=false
# pyright: reportUnknownVariableType=false, reportUnknownMemberType=false, reportUnknownArgumentType=false

import numba
import numpy as np

njit = numba.njit(cache=True, nogil=True, error_model="numpy")


@njit
def normal_below(value):
    """Probability that a normal variable is below a value, to 1e-7 (Abramowitz and Stegun 7.1.26)."""
    z = min(abs(value) / np.sqrt(2.0), 6.0)
    t = 1 / (1 + 0.3275911 * z)
    series = ((((1.061405429 * t - 1.453152027) * t + 1.421413741) * t - 0.284496736) * t + 0.254829592) * t
    half = 0.5 * (1 - series * np.exp(-z * z))
    return 0.5 + half if value >= 0 else 0.5 - half


@njit
def primitive_shares(nodes, deviation, axes, slope, centre, left, gamma):
    """Probabilities of P, C-, C+, H, E- and E+, over nodes (M, 2) of a standard bivariate normal.

    ``deviation`` (2,) along ``axes`` (2, 2) is that of d and e about ``centre`` (3,) = h, d, e; h moves by
    ``slope`` (2,) with them, and has a deviation of ``left`` besides.
    """
    planar = down = up = hyperbolic = dome = bowl = 0.0
    for m in range(nodes.shape[0]):
        a, b = nodes[m, 0] * deviation[0], nodes[m, 1] * deviation[1]
        d, e = centre[1] + a * axes[0, 0] + b * axes[0, 1], centre[2] + a * axes[1, 0] + b * axes[1, 1]
        h, r = centre[0] + a * slope[0] + b * slope[1], np.sqrt(d * d + e * e)
        inner = abs(gamma - r)
        first, third = normal_below((-gamma - r - h) / left), normal_below((gamma + r - h) / left)
        mirrored, second = normal_below((-inner - h) / left), normal_below((inner - h) / left)
        if r > gamma:
            hyperbolic += second - mirrored
        else:
            planar += second - mirrored
        down += mirrored - first
        up += third - second
        dome += first
        bowl += 1 - third
    count = nodes.shape[0]
    return planar / count, down / count, up / count, hyperbolic / count, dome / count, bowl / count
