"""Product frames: evidence about several questions at once, and what it says about each of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product as combinations_of
from math import prod

from evifuse.belief.frame import MAX_HYPOTHESES, Frame
from evifuse.belief.mass import MassFunction
from evifuse.belief.remap import MultivaluedMapping, carry
from evifuse.errors import FrameError

__all__ = ["ProductFrame", "marginalise", "product_frame", "vacuous_extension"]


@dataclass(frozen=True)
class ProductFrame:
    """The frame of all combinations of the hypotheses of some factors.

    Parameters
    ----------
    factors : tuple of Frame
        One frame for each question.
    frame : Frame
        Their combinations, named like ``red, round``; the last factor varies fastest.
    """

    factors: tuple[Frame, ...]
    frame: Frame

    def projection(self, factors: "Factors") -> MultivaluedMapping:
        """What each combination says about some factors.

        Parameters
        ----------
        factors : int or sequence of int
            Positions of the factors to keep.

        Returns
        -------
        MultivaluedMapping
            From the product to the factor, or to the product of the factors.

        Raises
        ------
        FrameError
            If there is no such factor, or one is named twice.
        """
        kept = self._positions(factors)
        target = self.part(factors)
        names = [", ".join(names) for names in self._names(kept)]
        return MultivaluedMapping(self.frame, target, dict(zip(self.frame.hypotheses, names, strict=True)))

    def part(self, factors: "Factors") -> Frame:
        """The frame of some of the factors.

        Parameters
        ----------
        factors : int or sequence of int
            Their positions.

        Returns
        -------
        Frame
            The factor, or the product of the factors.

        Raises
        ------
        FrameError
            If there is no such factor, or one is named twice.
        """
        kept = self._positions(factors)
        if len(kept) == 1:
            return self.factors[kept[0]]
        return product_frame(*(self.factors[i] for i in kept)).frame

    def _positions(self, factors: "Factors") -> tuple[int, ...]:
        kept = (factors,) if isinstance(factors, int) else tuple(factors)
        if not kept or len(set(kept)) != len(kept) or not all(0 <= i < len(self.factors) for i in kept):
            raise FrameError(
                f"factors {list(kept)} are not different positions among {len(self.factors)} factors"
            )
        return kept

    def _names(self, kept: tuple[int, ...]) -> list[tuple[str, ...]]:
        """Names of the kept factors' hypotheses in each combination."""
        every = combinations_of(*(f.hypotheses for f in self.factors))
        return [tuple(names[i] for i in kept) for names in every]


Factors = int | Sequence[int]
"""One factor of a product, or several, by position."""


def product_frame(*factors: Frame) -> ProductFrame:
    """The product of frames: one hypothesis for every combination of theirs (Shafer 1976).

    Parameters
    ----------
    *factors : Frame
        Two or more frames, with at most 62 combinations in all.

    Returns
    -------
    ProductFrame
        The combinations, and which factor each of their parts comes from.

    Raises
    ------
    FrameError
        If there are fewer than two factors, too many combinations, or two of them get the same name.

    Examples
    --------
    >>> both = product_frame(Frame(["red", "blue"]), Frame(["round", "square"]))
    >>> str(both.frame)
    '{red, round, red, square, blue, round, blue, square}'
    >>> m = vacuous_extension(MassFunction.of(both.factors[0], {"red": 1.0}), both, 0)
    >>> m
    MassFunction(red, round|red, square: 1)
    >>> marginalise(m, both, 1)
    MassFunction(frame: 1)
    """
    if len(factors) < 2:
        raise FrameError(f"a product needs at least two frames, not {len(factors)}")
    size = prod(map(len, factors))
    if size > MAX_HYPOTHESES:
        sizes = " x ".join(str(len(f)) for f in factors)
        raise FrameError(
            f"a product of {sizes} hypotheses has {size} combinations: the limit is {MAX_HYPOTHESES}"
        )
    names = [", ".join(names) for names in combinations_of(*(f.hypotheses for f in factors))]
    return ProductFrame(factors, Frame(names))


def vacuous_extension(m: MassFunction, product: ProductFrame, factors: Factors) -> MassFunction:
    """Evidence about some factors, said over the product: nothing is known about the others (Shafer 1976).

    Parameters
    ----------
    m : MassFunction
        Masses over the factor, or over the product of the factors, batch shape ``(...)``.
    product : ProductFrame
        The larger frame.
    factors : int or sequence of int
        Which of its factors ``m`` is about.

    Returns
    -------
    MassFunction
        Over the product: every focal set becomes a cylinder.

    Raises
    ------
    FrameError
        If there is no such factor, or ``m`` is over another frame.
    """
    return carry(m, product.projection(factors).inverse)


def marginalise(m: MassFunction, product: ProductFrame, keep: Factors) -> MassFunction:
    """What evidence over a product says about some factors: every focal set is projected (Shafer 1976).

    Parameters
    ----------
    m : MassFunction
        Masses over the product, batch shape ``(...)``.
    product : ProductFrame
        The product.
    keep : int or sequence of int
        Which of its factors to keep.

    Returns
    -------
    MassFunction
        Over the factor, or over the product of the factors.

    Raises
    ------
    FrameError
        If there is no such factor, or ``m`` is over another frame.
    """
    return carry(m, product.projection(keep))
