"""Which shape an outline shows, and which outline shows an object: learned weights that a person can read."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path

import numpy as np
import yaml
from numpy.typing import NDArray

__all__ = ["FAMILIES", "FARTHEST", "KNOWN", "STRANGER", "Rivalry", "load_rivalry", "pooled"]

KNOWN = ("triangle", "quadrilateral", "ellipse")
"""Families of shapes that primitives belong to."""

STRANGER = "stranger"
"""A shape of another family: an octagon, a heart."""

FAMILIES = (*KNOWN, STRANGER, "texture")
"""What stands against each other; a texture has outlines, but no shape."""

FARTHEST = 3.0
"""A feature counts as no more than so many spreads from its mean (our own)."""


@dataclass(frozen=True, eq=False)
class Rivalry:
    """A linear model of outlines (our own): a multinomial logistic one of shapes, and a conditional one.

    The first says which family of shapes an outline shows. The second, in the manner of McFadden (1974), says
    how likely each outline of an object is the one to be believed. Both are learned at once, so that the
    shares of the families, averaged over the outlines of an object, make what was drawn most likely.

    Parameters
    ----------
    features : tuple of str
        Names of F features, see `features_of`.
    mean, spread : ndarray of float64, shape (F,)
        Of each feature, in its own unit.
    standing : ndarray of float64, shape (F,)
        What a spread of each feature adds to the standing of an outline among others.
    families : ndarray of float64, shape (F, 5)
        What it adds to the logarithm of the odds of each family, in the order of `FAMILIES`.
    constants : ndarray of float64, shape (5,)
        Logarithm of the odds of each family before anything is seen.
    """

    features: tuple[str, ...]
    mean: NDArray[np.float64]
    spread: NDArray[np.float64]
    standing: NDArray[np.float64]
    families: NDArray[np.float64]
    constants: NDArray[np.float64]

    def judge(
        self, features: Mapping[str, NDArray[np.float64]]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Judge outlines, each for itself.

        Parameters
        ----------
        features : mapping of str to ndarray of float64, shape (B,)
            At least those of the model.

        Returns
        -------
        shares : ndarray of float64, shape (B, 5)
            Probability of each family; they sum to 1.
        standing : ndarray of float64, shape (B,)
            Logarithm of the odds of each outline among those of the same object, up to a constant.
        """
        columns = np.stack([features[name] for name in self.features], axis=1)
        away = np.clip((columns - self.mean) / self.spread, -FARTHEST, FARTHEST)
        odds = away @ self.families + self.constants
        weight = np.exp(odds - odds.max(axis=1, keepdims=True))
        return weight / weight.sum(axis=1, keepdims=True), away @ self.standing


def pooled(
    shares: NDArray[np.float64], standing: NDArray[np.float64], together: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Average the shares over the outlines of each object, weighted by the odds of their standing.

    Parameters
    ----------
    shares : ndarray of float64, shape (B, K)
        Of each outline for itself.
    standing : ndarray of float64, shape (B,)
        Logarithm of the odds of each outline, up to a constant.
    together : ndarray of bool, shape (N, B)
        Which outlines show the same object, at least one of each object.

    Returns
    -------
    ndarray of float64, shape (N, K)
        Of each object.
    """
    odds = np.where(together, standing, -np.inf)
    weight = np.exp(odds - odds.max(axis=1, keepdims=True))
    return weight @ shares / weight.sum(axis=1, keepdims=True)


@cache
def load_rivalry(file: Path | None = None) -> Rivalry:
    """A model from its file.

    Parameters
    ----------
    file : Path, optional
        As `benchmarks/train_shapes.py` writes it; `knowledge/rivalry.yaml` of the package without it.

    Returns
    -------
    Rivalry
        What the file says; it is read once.
    """
    source = files("evifuse.knowledge").joinpath("rivalry.yaml") if file is None else file
    text = source.read_text(encoding="utf-8")
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    table = yaml.load(text, Loader=loader)
    rows = np.array(list(table["features"].values()), np.float64)
    return Rivalry(
        features=tuple(table["features"]),
        mean=rows[:, 0],
        spread=rows[:, 1],
        standing=rows[:, 2],
        families=rows[:, 3:],
        constants=np.array(table["constants"], np.float64),
    )
