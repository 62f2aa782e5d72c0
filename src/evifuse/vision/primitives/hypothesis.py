"""What a primitive says about outlines: a proposal per outline, and one of them in full."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.fit import FittedEdge, FittedEdges

__all__ = ["Geometry", "Hypothesis", "Proposals"]

Geometry: TypeAlias = dict[str, list[list[list[float]]] | list[list[float]] | list[float] | float]
"""Where a primitive lies, by name, in px and radians: `corners`, or `centre`, `axes` and `angle_rad`."""


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A primitive that an outline might show.

    Parameters
    ----------
    kind : str
        Member of the shape frame.
    belief : float
        Belief in it, in [0, 1].
    geometry : Geometry
        Where it lies, px and radians.
    shape : ndarray of float64, shape (K, 2)
        Its own outline as a polygon, px.
    deviation : float
        How far the outline strays from it, px.
    curved : bool
        Whether it is an arc rather than a polygon.
    edges : tuple of FittedEdge
        Fitted edges it is made of; empty for curved primitives.
    terms : dict of str to float
        Factors of the belief by name, each in [0, 1].
    """

    kind: str
    belief: float
    geometry: Geometry
    shape: NDArray[np.float64]
    deviation: float
    curved: bool = False
    edges: tuple[FittedEdge, ...] = ()
    terms: dict[str, float] = field(default_factory=dict[str, float])


@dataclass(frozen=True, eq=False)
class Proposals:
    """One primitive proposed for each of many outlines.

    Parameters
    ----------
    kind : str
        Member of the shape frame.
    family : str
        Shape that it shares with other primitives: a square is a quadrilateral too.
    proposed : ndarray of bool, shape (B,)
        Where the primitive could be formed at all.
    belief : ndarray of float64, shape (B,)
        Belief in it, in [0, 1]; means nothing where it is not proposed.
    shape : ndarray of float64, shape (B, K, 2)
        Its outline as a polygon, px.
    deviation : ndarray of float64, shape (B,)
        How far each outline strays from it, px.
    odds : ndarray of float64, shape (B,)
        Logarithm of its odds against other shapes, up to a constant of the outline.
    terms : mapping of str to ndarray of float64, shape (B,)
        Factors of the belief by name, each in [0, 1].
    geometry : callable
        From the number of an outline to where the primitive lies.
    edges : FittedEdges or None
        Fitted sides, shape (B, K); None for a curved primitive.
    """

    kind: str
    family: str
    proposed: NDArray[np.bool_]
    belief: NDArray[np.float64]
    shape: NDArray[np.float64]
    deviation: NDArray[np.float64]
    odds: NDArray[np.float64]
    terms: Mapping[str, NDArray[np.float64]]
    geometry: Callable[[int], Geometry]
    edges: FittedEdges | None = None

    @property
    def curved(self) -> bool:
        """Whether it is an arc rather than a polygon."""
        return self.edges is None

    def hypothesis(self, i: int) -> Hypothesis:
        """The proposal for one outline in full.

        Parameters
        ----------
        i : int
            Number of the outline.

        Returns
        -------
        Hypothesis
            With plain numbers.
        """
        return Hypothesis(
            kind=self.kind,
            belief=float(self.belief[i]),
            geometry=self.geometry(i),
            shape=self.shape[i],
            deviation=float(self.deviation[i]),
            curved=self.curved,
            edges=() if self.edges is None else self.edges.listed(i),
            terms={name: float(v[i]) for name, v in self.terms.items()},
        )
