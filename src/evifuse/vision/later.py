"""Sequences that are made when they are first looked at."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar, overload

__all__ = ["Later"]

T = TypeVar("T")


class Later(Sequence[T]):
    """A sequence whose items are made when it is first looked at, and kept.

    It pickles and compares like the tuple of its items.

    Parameters
    ----------
    make : callable
        Gives the items; called once at most.
    """

    def __init__(self, make: Callable[[], Iterable[T]]) -> None:
        self._make: Callable[[], Iterable[T]] | None = make
        self._items: tuple[T, ...] = ()

    def _made(self) -> tuple[T, ...]:
        if self._make is not None:
            self._items, self._make = tuple(self._make()), None
        return self._items

    @overload
    def __getitem__(self, index: int) -> T: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[T, ...]: ...
    def __getitem__(self, index: int | slice) -> T | tuple[T, ...]:
        """One item, or some of them."""
        return self._made()[index]

    def __len__(self) -> int:
        """How many items there are."""
        return len(self._made())

    def __eq__(self, other: object) -> bool:
        """Whether the items are those of another sequence."""
        return isinstance(other, Sequence) and self._made() == tuple(other)  # pyright: ignore[reportUnknownArgumentType]

    def __hash__(self) -> int:
        """That of the tuple."""
        return hash(self._made())

    def __reduce__(self) -> tuple[Any, ...]:
        """As the tuple."""
        return tuple, (self._made(),)

    def __repr__(self) -> str:
        """As the tuple."""
        return repr(self._made())
