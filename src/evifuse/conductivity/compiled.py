"""A knowledge base compiled for known focal sets: the same conductivities as `classify`, much faster.

`classify` reads like appendix A and stays the reference; here the same numbers are matrix products and
element-wise steps, on NumPy, PyTorch or JAX arrays.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evifuse.belief import Frame, MassFunction
from evifuse.belief.frame import Subset
from evifuse.conductivity._batch import run
from evifuse.conductivity._matrices import Parts
from evifuse.conductivity.aggregate import AggregateProperties, KnowledgeBase
from evifuse.conductivity.classify import Classification, concluded, prepared
from evifuse.conductivity.entropy import similarity
from evifuse.conductivity.reading import Reading
from evifuse.errors import KnowledgeError

__all__ = ["CompiledClassifier", "compile"]


def compile(  # noqa: A001
    knowledge: KnowledgeBase,
    focal_sets: Iterable[Subset] | NDArray[np.integer[Any]],
    reading: Reading | None = None,
) -> "CompiledClassifier":
    """Compile a knowledge base for evidence whose focal sets are known.

    Parameters
    ----------
    knowledge : KnowledgeBase
        The classes and their P prototypes.
    focal_sets : iterable of subset, or array_like of int, shape (F,)
        Focal sets of the evidence to come, subsets of the knowledge base's frame; any of them may carry no
        mass. `evifuse.belief.on_frame` brings evidence over a smaller frame to the larger one.
    reading : Reading, optional
        How the formulas are read; the knowledge base's own by default.

    Returns
    -------
    CompiledClassifier
        Takes batches of masses on these focal sets.

    Raises
    ------
    FrameError
        If a focal set is not a subset of the frame or is listed twice.
    KnowledgeError
        If the reading leaves two sets infinitely far apart (a similarity offset of 0 with disjoint sets).

    Examples
    --------
    >>> from evifuse.knowledge import load_knowledge
    >>> base = load_knowledge("shape")
    >>> fast = compile(base, ["rectangle", ("square", "rectangle"), base.frame])
    >>> fast.classes[int(fast.conductivities([0.5, 0.2, 0.3]).argmax())]
    'rectangular'
    """
    reading = reading or knowledge.reading
    sets = focal_sets if isinstance(focal_sets, np.ndarray) else list(focal_sets)
    like = MassFunction(knowledge.frame, sets, np.full(len(sets), 1.0 / max(len(sets), 1)))
    properties, prototypes, inner = prepared(knowledge, reading)
    met = like.focal_sets
    if reading.commitment is not None:  # the rest of a nominal commitment is on the frame
        met = np.append(met[met != knowledge.frame.full], np.int64(knowledge.frame.full))
    labels = [label for label, _, _ in prototypes]
    parts = Parts(
        knowledge.frame,
        tuple(x for _, _, x in prototypes),
        reading,
        met,
        like.focal_sets == knowledge.frame.full,
        np.array(inner)[:, None],
        np.array([properties[label].dimension for label in labels])[:, None],
        np.array([properties[label].capacity for label in labels])[:, None],
        np.array([[of == label for of in labels] for label in knowledge.classes]),
    )
    _check_near(parts)
    names = tuple((label, name) for label, name, _ in prototypes)
    return CompiledClassifier(
        knowledge.frame, like.focal_sets, knowledge.classes, names, reading, dict(properties), parts
    )


@dataclass(frozen=True, eq=False)
class CompiledClassifier:
    """A knowledge base made ready for evidence on F known focal sets. Made by `compile`.

    Masses may be NumPy, PyTorch or JAX arrays (or plain lists), on any device; results are of the same kind,
    and as exact as their type of float. They must be valid: not negative, summing to 1.

    Parameters
    ----------
    frame : Frame
        Frame of the evidence and of the prototypes.
    focal_sets : ndarray of int64, shape (F,)
        Focal sets of the evidence, in the order of its masses.
    classes : tuple of str
        The C class labels.
    prototypes : tuple of (str, str)
        Class and name of each of the P prototypes.
    reading : Reading
        How the formulas are read.
    properties : mapping of str to AggregateProperties
        Dimension and capacity of each class.
    parts : Parts
        The matrices.
    """

    frame: Frame
    focal_sets: NDArray[np.int64]
    classes: tuple[str, ...]
    prototypes: tuple[tuple[str, str], ...]
    reading: Reading
    properties: dict[str, AggregateProperties]
    parts: Parts = field(repr=False)

    def conductivities(self, masses: Any) -> Any:
        """Conductivity of each case into each class (A.8), as `classify` gives it.

        Parameters
        ----------
        masses : array of float, shape (..., F)
            Masses on the focal sets.

        Returns
        -------
        array of float, shape (..., C)
            Of the same kind as ``masses``.

        Raises
        ------
        MassError
            If the masses have another shape, are negative or not numbers, or do not sum to 1.
        """
        return run(self.parts, masses, "conductivities")

    def belief(self, masses: Any) -> Any:
        """Conductivities normalised into masses over the classes and their frame (3.4 and 5.3).

        Parameters
        ----------
        masses : array of float, shape (..., F)
            Masses on the focal sets.

        Returns
        -------
        array of float, shape (..., C + 1)
            Mass of each class and, last, of the frame. A single class is its own frame: shape (..., 1).

        Raises
        ------
        MassError
            If the masses have another shape, are negative or not numbers, or do not sum to 1.
        """
        return run(self.parts, masses, "belief")

    def prototype_conductivities(self, masses: Any) -> Any:
        """Conductivity of each case into each prototype, before they are pooled by class (A.8).

        Parameters
        ----------
        masses : array of float, shape (..., F)
            Masses on the focal sets.

        Returns
        -------
        array of float, shape (..., P)
            Of the same kind as ``masses``.

        Raises
        ------
        MassError
            If the masses have another shape, are negative or not numbers, or do not sum to 1.
        """
        alone = replace(self.parts, members=np.eye(len(self.prototypes), dtype=np.bool_))
        return run(alone, masses, "conductivities")

    def interaction_dimensions(self, masses: Any) -> Any:
        """``dim(Y; X_i)`` of each case with each prototype (A.5), raised to the reading's sharpness.

        Parameters
        ----------
        masses : array of float, shape (..., F)
            Masses on the focal sets.

        Returns
        -------
        array of float, shape (..., P)
            Of the same kind as ``masses``.

        Raises
        ------
        MassError
            If the masses have another shape, are negative or not numbers, or do not sum to 1.
        """
        return run(self.parts, masses, "dimensions")

    def classify(self, masses: ArrayLike) -> Classification:
        """Conductivities of NumPy masses with all that led to them, as `evifuse.conductivity.classify`.

        Parameters
        ----------
        masses : array_like of float, shape (..., F)
            Masses on the focal sets.

        Returns
        -------
        Classification
            Conductivities, belief and reasons.

        Raises
        ------
        MassError
            If the masses have another shape, are negative or not numbers, or do not sum to 1.
        """
        values = np.asarray(masses, dtype=np.float64)
        dims = self.interaction_dimensions(values)
        committed = 1.0 - values[..., self.focal_sets == self.frame.full].sum(axis=-1)
        return concluded(dims, committed, self.classes, self.prototypes, self.properties, self.reading)

    def divergences(self, masses: Any) -> Any:
        """``div(Y; X_i)`` of each case with each prototype (A.6), for the masses as they meet it.

        Parameters
        ----------
        masses : array of float, shape (..., F)
            Masses on the focal sets.

        Returns
        -------
        array of float, shape (..., P)
            Of the same kind as ``masses``.

        Raises
        ------
        MassError
            If the masses have another shape, are negative or not numbers, or do not sum to 1.
        """
        return run(self.parts, masses, "divergences")


def _check_near(parts: Parts) -> None:
    """Refuse a reading that leaves sets infinitely far apart: that has no matrices."""
    for sets in (parts.met, *(x.focal_sets for x in parts.prototypes)):
        if similarity(parts.frame, parts.met, sets, parts.reading).min() == 0:
            raise KnowledgeError(
                "reading: similarity_offset 0 leaves disjoint focal sets infinitely far apart, which can't "
                "be compiled; give it a positive offset"
            )
