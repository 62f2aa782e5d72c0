"""Where to write labels on a picture so that none covers another (our own)."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

__all__ = ["place_labels"]

GAP = 2.0
"""Between labels, and between a label and what it names."""

RINGS = 8
"""Label heights that a label may be away from what it names."""


def place_labels(
    boxes: NDArray[np.float64], sizes: Sequence[tuple[float, float]], area: tuple[float, float]
) -> list[tuple[float, float] | None]:
    """Places for labels, the first ones first.

    A label goes above its box, else below, beside or inside it, else a few lines further up or down, and
    nowhere if all of that is taken.

    Parameters
    ----------
    boxes : ndarray of float64, shape (N, 4)
        Left, top, width, height of what is named.
    sizes : sequence of tuple of float
        Width and height of each label.
    area : tuple of float
        Width and height of the picture, which labels don't leave.

    Returns
    -------
    list of tuple of float or None
        Left and top of each label; None where there is no room.

    Examples
    --------
    >>> place_labels(np.array([[50.0, 50.0, 20.0, 20.0]] * 2), [(30.0, 10.0)] * 2, (200.0, 200.0))
    [(50.0, 38.0), (50.0, 72.0)]
    """
    taken = np.empty((0, 4))
    places: list[tuple[float, float] | None] = []
    for box, (width, height) in zip(boxes, sizes, strict=True):
        chosen = None
        for x, y in _candidates(box, width, height):
            if x < 0 or y < 0 or x + width > area[0] or y + height > area[1]:
                continue
            if not _covered(taken, x, y, width, height):
                chosen = (float(x), float(y))
                taken = np.vstack([taken, [x, y, x + width, y + height]])
                break
        places.append(chosen)
    return places


def _candidates(box: NDArray[np.float64], width: float, height: float) -> Iterator[tuple[float, float]]:
    x, y, w, h = box
    above, below, right = y - height - GAP, y + h + GAP, x + w - width
    yield from ((x, above), (x, below), (right, above), (right, below))
    yield from ((x + w + GAP, y), (x - width - GAP, y))
    yield from ((x + GAP, y + GAP), (x + (w - width) / 2, y + (h - height) / 2))
    for ring in range(1, RINGS + 1):
        step = ring * (height + GAP)
        for left in (x, right, x + w + GAP, x - width - GAP):
            yield from ((left, above - step), (left, below + step))


def _covered(taken: NDArray[np.float64], x: float, y: float, width: float, height: float) -> bool:
    """Whether a label would come too near to one that is there."""
    apart = (
        (taken[:, 0] >= x + width + GAP)
        | (taken[:, 2] <= x - GAP)
        | (taken[:, 1] >= y + height + GAP)
        | (taken[:, 3] <= y - GAP)
    )
    return bool((~apart).any())
