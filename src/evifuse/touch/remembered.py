"""What depends on a fingertip alone is worked out once, not for every recording and roll."""

from collections.abc import Callable
from functools import lru_cache, wraps
from typing import Any, Concatenate, ParamSpec, TypeVar

import numpy as np

from evifuse.recordings.recording import Fingertip

__all__ = ["per_fingertip"]

KEPT = 128
"""Results that are remembered; the one that was not asked for the longest is forgotten first."""

P = ParamSpec("P")
R = TypeVar("R")


class _Content:
    """A fingertip that equals another one with the same numbers, also after its arrays were changed."""

    __slots__ = ("_hash", "_numbers", "tip")

    def __init__(self, tip: Fingertip) -> None:
        self.tip = tip
        self._numbers = (tip.radius_m, tip.positions_m.tobytes(), tip.normals.tobytes())
        self._hash = hash(self._numbers)

    def __hash__(self) -> int:
        return self._hash

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Content) and self._numbers == other._numbers


def per_fingertip(
    function: Callable[Concatenate[Fingertip, P], R],
) -> Callable[Concatenate[Fingertip, P], R]:
    """Remember what a function of a fingertip, and of plain numbers, has given.

    Parameters
    ----------
    function : callable
        Its first argument is a fingertip, all others are hashable. It gives the same for the same numbers.

    Returns
    -------
    callable
        The same function. Arrays that it gives are shared, and so can't be written to.
    """

    @lru_cache(maxsize=KEPT)
    def kept(content: _Content, *arguments: Any, **options: Any) -> Any:
        found: Any = function(content.tip, *arguments, **options)
        for part in found if isinstance(found, tuple) else (found,):  # pyright: ignore[reportUnknownVariableType]
            if isinstance(part, np.ndarray):
                part.flags.writeable = False
        return found

    @wraps(function)
    def remembered(fingertip: Fingertip, /, *arguments: P.args, **options: P.kwargs) -> R:
        return kept(_Content(fingertip), *arguments, **options)

    return remembered
