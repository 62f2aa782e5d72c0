"""Medians and quantiles of a few numbers, which NumPy's own take longer to start on than to find."""

import numpy as np
from numpy.typing import ArrayLike

__all__ = ["median_of", "quantile_of"]


def median_of(values: ArrayLike) -> float:
    """Median of numbers.

    Parameters
    ----------
    values : array_like of float
        Numbers, none of them NaN, in any shape.

    Returns
    -------
    float
        NaN of none.
    """
    from evifuse.touch._kernels_health import median

    copied = np.array(values, dtype=np.float64).ravel()
    return float(median(copied, copied.size))


def quantile_of(values: ArrayLike, share: float) -> float:
    """Quantile of numbers, linear between two of them.

    Parameters
    ----------
    values : array_like of float
        At least one number, none of them NaN, in any shape.
    share : float
        In [0, 1].

    Returns
    -------
    float
        The number that so large a share of the others doesn't exceed.
    """
    from evifuse.touch._kernels_health import quantile

    copied = np.array(values, dtype=np.float64).ravel()
    return float(quantile(copied, copied.size, share))
