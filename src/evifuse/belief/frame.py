"""The frame of discernment: what could be the case, by name."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

from evifuse.errors import FrameError

__all__ = ["MAX_HYPOTHESES", "Frame", "Subset"]

MAX_HYPOTHESES = 62
"""A focal set is a bitmask in a signed 64-bit integer, with room for comparisons."""


@dataclass(frozen=True)
class Frame:
    """A finite set of exclusive, exhaustive hypotheses, in a fixed order.

    Two frames with the same hypotheses in the same order are equal, whoever built them.

    Parameters
    ----------
    hypotheses : iterable of str
        The names, 1 to 62 of them, all different. Hypothesis ``i`` is bit ``1 << i`` of a focal set.
    attributes : mapping of str to iterable of str, optional
        Attribute list of each hypothesis, used by the similarity of the chapter (appendix A.2). Without it a
        hypothesis is its own only attribute.

    Raises
    ------
    FrameError
        If there are no or too many hypotheses, a name is empty or repeated, or an attribute list is given for
        a name that is not in the frame.

    Examples
    --------
    >>> frame = Frame(["rectangle", "square", "triangle"])
    >>> frame.mask("square"), frame.mask(["rectangle", "square"]), frame.mask(frame)
    (2, 3, 7)
    >>> frame.names(3)
    ('rectangle', 'square')
    """

    hypotheses: tuple[str, ...]
    attributes: tuple[frozenset[str], ...] | None = None
    _index: Mapping[str, int] = field(default_factory=dict[str, int], init=False, repr=False, compare=False)

    def __init__(
        self, hypotheses: Iterable[str], attributes: Mapping[str, Iterable[str]] | None = None
    ) -> None:
        if isinstance(hypotheses, str):
            raise FrameError(f"a frame needs a list of names, not the one string {hypotheses!r}")
        names = tuple(hypotheses)
        if not 1 <= len(names) <= MAX_HYPOTHESES:
            raise FrameError(f"a frame has 1 to {MAX_HYPOTHESES} hypotheses, not {len(names)}")
        for name in names:
            if not isinstance(name, str) or not name:  # pyright: ignore[reportUnnecessaryIsInstance]
                raise FrameError(f"a hypothesis is a non-empty string, not {name!r}")
        index = {name: i for i, name in enumerate(names)}
        if len(index) != len(names):
            repeated = next(name for name in names if names.count(name) > 1)
            raise FrameError(f"hypothesis {repeated!r} is in the frame more than once")
        lists = None
        if attributes is not None:
            for name in attributes:
                if name not in index:
                    raise FrameError(
                        f"attributes are given for {name!r}, which is not in {self._list(names)}"
                    )
            for name, values in attributes.items():
                if isinstance(values, str):
                    raise FrameError(f"attributes of {name!r} must be a list of strings, not one string")
            lists = tuple(frozenset(attributes.get(name, (name,))) for name in names)
        object.__setattr__(self, "hypotheses", names)
        object.__setattr__(self, "attributes", lists)
        object.__setattr__(self, "_index", index)

    @staticmethod
    def _list(names: Iterable[str]) -> str:
        return "{" + ", ".join(names) + "}"

    def __len__(self) -> int:
        return len(self.hypotheses)

    def __str__(self) -> str:
        return self._list(self.hypotheses)

    @property
    def full(self) -> int:
        """Bitmask of the whole frame: total ignorance when it carries all mass."""
        return (1 << len(self.hypotheses)) - 1

    def mask(self, subset: "Subset") -> int:
        """Bitmask of a subset.

        Parameters
        ----------
        subset : str, iterable of str, int or Frame
            One hypothesis by name, several by name, a bitmask, or the frame itself.

        Returns
        -------
        int
            Bitmask; bit ``i`` stands for ``hypotheses[i]``.

        Raises
        ------
        FrameError
            If a name is not in the frame, a bitmask has bits outside it, or another frame is given.
        """
        if isinstance(subset, str):
            return 1 << self._position(subset)
        if isinstance(subset, Frame):
            if subset.hypotheses != self.hypotheses:
                raise FrameError(f"the set is the frame {subset}, but the masses are over {self}")
            return self.full
        if isinstance(subset, int):
            if subset < 0 or subset > self.full:
                raise FrameError(f"bitmask {subset:#x} has bits outside the {len(self)} hypotheses of {self}")
            return subset
        mask = 0
        for name in subset:
            mask |= 1 << self._position(name)
        return mask

    def _position(self, name: str) -> int:
        try:
            return self._index[name]
        except (KeyError, TypeError):
            raise FrameError(f"unknown hypothesis {name!r}: the frame is {self}") from None

    def names(self, mask: int) -> tuple[str, ...]:
        """Names of the hypotheses in a bitmask, in the frame's order.

        Parameters
        ----------
        mask : int
            Bitmask of a subset of the frame.

        Returns
        -------
        tuple of str
            Names of its members; empty for the empty set.
        """
        return tuple(name for i, name in enumerate(self.hypotheses) if mask >> i & 1)

    def label(self, mask: int) -> str:
        """Text for a focal set: one name, names joined by ``|``, or ``frame``.

        Parameters
        ----------
        mask : int
            Bitmask of a subset of the frame.

        Returns
        -------
        str
            The label, as used for the keys of JSON output.
        """
        if mask == self.full and len(self) > 1:
            return "frame"
        return "|".join(self.names(mask)) or "∅"


Subset: TypeAlias = str | Iterable[str] | int | Frame
"""A subset of a frame: a name, names, a bitmask, or the frame itself."""
