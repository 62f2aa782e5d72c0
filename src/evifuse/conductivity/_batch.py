"""Batches of masses through a compiled knowledge base: which way they go."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.belief.mass import TOLERANCE
from evifuse.conductivity._arrays import Batch, Wanted, bad_row, spans
from evifuse.conductivity._matrices import Parts
from evifuse.errors import MassError

__all__ = ["run"]

LARGE = 1 << 17
"""Masses from which on the kernel repays loading it."""

WIDEST = 12
"""Focal sets up to which the kernel counts every pattern of zeros."""

BLOCK = 1 << 15
"""Cases that are sorted by their pattern of zeros together."""

DEVICE_BLOCK = 1 << 20
"""Cases that go together on an accelerator."""

Array = NDArray[np.float64]


def run(parts: Parts, masses: Any, wanted: Wanted) -> Any:
    """Conductivities, beliefs, dimensions or divergences of a batch.

    Parameters
    ----------
    parts : Parts
        The compiled knowledge base.
    masses : array of float, shape (..., F)
        Masses on its focal sets; lists become NumPy arrays.
    wanted : {"conductivities", "belief", "dimensions", "divergences"}
        What to return.

    Returns
    -------
    array of float, shape (..., C), (..., C + 1), (..., P) or (..., P)
        Of the same kind, on the same device.

    Raises
    ------
    MassError
        If the masses have another shape, are negative or not numbers, or do not sum to 1.
    """
    from array_api_compat import array_namespace, device, is_array_api_obj

    values: Any = masses if is_array_api_obj(masses) else np.asarray(masses, dtype=np.float64)
    xp: Any = array_namespace(values)
    if not values.ndim or values.shape[-1] != len(parts.whole):
        raise MassError(
            f"{len(parts.whole)} focal sets need masses of shape (..., {len(parts.whole)}), "
            f"not {tuple(values.shape)}"
        )
    if not xp.isdtype(values.dtype, "real floating"):
        values = xp.astype(values, xp.float64)
    shared = _as_numpy(values) if len(parts.met) <= WIDEST else None
    if shared is not None:
        found = _large(parts, shared, wanted)
        return found if isinstance(values, np.ndarray) else xp.from_dlpack(found)
    batch = Batch(parts, xp, values.dtype, device(values), wanted)
    flat = xp.reshape(values, (-1, values.shape[-1]))
    size = BLOCK if batch.on_processor else DEVICE_BLOCK
    pieces = spans(flat.shape[0], size)
    out = [batch.block(flat[at:end, :], at) for at, end in pieces]
    joined = out[0] if len(out) == 1 else xp.concat(out, axis=0)
    return xp.reshape(joined, (*values.shape[:-1], joined.shape[-1]))


def _as_numpy(values: Any) -> NDArray[Any] | None:
    """The same memory as a NumPy array, if the batch is large and the kernel may have it."""
    if math.prod(values.shape) < LARGE:
        return None
    if isinstance(values, np.ndarray):
        return values
    try:
        shared = np.from_dlpack(values)
    except (BufferError, RuntimeError, TypeError, ValueError):  # on an accelerator, or with a gradient
        return None
    return shared if shared.dtype == np.float64 else None


def _large(parts: Parts, masses: NDArray[Any], wanted: Wanted) -> Array:
    """The same in machine code, by pattern of zeros."""
    from evifuse.conductivity import _kernel

    reading, count = parts.reading, len(parts.met)
    flat = np.ascontiguousarray(masses.reshape(-1, masses.shape[-1]), dtype=np.float64)
    if (bad := _kernel.bad_row(flat, TOLERANCE)) >= 0:
        raise bad_row(bad, flat[bad])
    sizes = parts.members.sum(axis=1).astype(np.float64)
    columns = {"conductivities": len(sizes), "belief": len(sizes) + (len(sizes) > 1)}
    out = np.empty((len(flat), columns.get(wanted, len(parts.inner))))
    whole = int(np.flatnonzero(parts.whole)[0]) if parts.whole.any() else -1
    commitment = -1.0 if reading.commitment is None else reading.commitment
    given = np.flatnonzero(~parts.whole) if reading.commitment is not None else np.arange(count)
    places = np.append(given, -1)[:count]  # of the met focal sets in the masses; the rest has none
    mode = ("conductivities", "belief", "dimensions", "divergences").index(wanted)
    pooling = ("sum", "mean", "max").index(reading.pooling)
    for start in range(0, len(flat), BLOCK):
        block, results = flat[start : start + BLOCK], out[start : start + BLOCK]
        order, counts = _kernel.ordered(block, whole, commitment, reading.negligible, 1 << count)
        ends = np.cumsum(counts)
        for code in np.flatnonzero(counts).tolist():
            pattern = tuple(bool(code >> i & 1) for i in range(count))
            made = parts.matrices(pattern)
            _kernel.tiles(
                block,
                order[ends[code] - counts[code] : ends[code]],
                results,
                mode,
                whole,
                commitment,
                places[np.array(pattern)],
                made.tied,
                made.weights.reshape(len(made.weights), 3, -1),
                made.constants.ravel(),
                made.between,
                parts.inner.ravel(),
                parts.top.ravel(),
                parts.capacity.ravel(),
                parts.members.argmax(axis=0),
                sizes,
                reading.projection,
                reading.smoothing,
                pooling,
                reading.sharpness,
                reading.keep_ignorance,
            )
    return out.reshape(*masses.shape[:-1], out.shape[1])
