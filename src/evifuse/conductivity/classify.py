"""Appendix A.8: the conductivity of evidence into each class of a knowledge base, with the reasons."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from evifuse.belief import Frame, MassFunction, on_frame
from evifuse.conductivity.aggregate import AggregateProperties, KnowledgeBase, aggregate_properties
from evifuse.conductivity.entropy import divergence, inner_entropy, projection, ratio
from evifuse.conductivity.reading import Reading
from evifuse.errors import MassError

__all__ = ["BRANCHES", "Classification", "PrototypeExplanation", "classify", "normalised_belief"]

BRANCHES = ("strong", "weak", "blocked")
"""A.8 iii: seen in full; A.8 iv: seen in projection; or not seen at all."""

NOTHING = 1e-12
"""Evidence that commits no more than this is total ignorance: scaled up it would be rounding errors."""

BRANCH_TOLERANCE = 1e-12
"""A dimension this little above the branch point is still on the strong branch."""


@dataclass(frozen=True)
class PrototypeExplanation:
    """Why a prototype conducts as it does.

    Parameters
    ----------
    label : str
        Class of the prototype.
    prototype : str
        Name of the prototype.
    branch : {"strong", "weak", "blocked"}
        Which case of A.8 it took.
    interaction_dimension : float
        ``dim(Y; X_i)``.
    aggregate_dimension : float
        ``dim(Gamma)``, the branch point.
    projected_dimension : float
        ``dim(Y; X_i) cap(Gamma)``, used on the weak branch.
    conductivity : float
        ``sigma_i``.
    margin : float
        Distance of the interaction dimension from the branch point: how close the other branch was, where
        conductivity jumps.
    """

    label: str
    prototype: str
    branch: str
    interaction_dimension: float
    aggregate_dimension: float
    projected_dimension: float
    conductivity: float
    margin: float


@dataclass(frozen=True)
class Classification:
    """Conductivity of evidence into every class, and all that led to it.

    Parameters
    ----------
    classes : tuple of str
        The C class labels.
    conductivities : ndarray of float64, shape (..., C)
        Conductivity into each class.
    belief : MassFunction
        Conductivities normalised into a belief function over the classes (sections 3.4 and 5.3).
    prototypes : tuple of (str, str)
        Class and name of each of the P prototypes.
    interaction_dimensions : ndarray of float64, shape (..., P)
        ``dim(Y; X_i)``.
    projected_dimensions : ndarray of float64, shape (..., P)
        ``dim(Y; X_i) cap(Gamma)``.
    prototype_conductivities : ndarray of float64, shape (..., P)
        ``sigma_i``.
    branches : ndarray of int8, shape (..., P)
        Index into ``BRANCHES``.
    properties : mapping of str to AggregateProperties
        Dimension and capacity of each class.
    """

    classes: tuple[str, ...]
    conductivities: NDArray[np.float64]
    belief: MassFunction
    prototypes: tuple[tuple[str, str], ...]
    interaction_dimensions: NDArray[np.float64]
    projected_dimensions: NDArray[np.float64]
    prototype_conductivities: NDArray[np.float64]
    branches: NDArray[np.int8]
    properties: dict[str, AggregateProperties]

    @property
    def conductivity(self) -> dict[str, float]:
        """Conductivity by class, of a single classification."""
        self._single()
        return dict(zip(self.classes, self.conductivities.tolist(), strict=True))

    @property
    def decision(self) -> str | None:
        """Class with the highest conductivity; None if nothing conducts at all."""
        self._single()
        if not self.conductivities.max() > 0:
            return None
        return self.classes[int(self.conductivities.argmax())]

    @property
    def decisions(self) -> NDArray[np.int64]:
        """Index of the class with the highest conductivity, shape ``(...)``; -1 where nothing conducts."""
        return np.where(self.conductivities.max(axis=-1) > 0, self.conductivities.argmax(axis=-1), -1)

    def explain(self) -> Iterator[PrototypeExplanation]:
        """One explanation per prototype, of a single classification.

        Yields
        ------
        PrototypeExplanation
            In the order of the knowledge base.
        """
        self._single()
        for i, (label, name) in enumerate(self.prototypes):
            interaction, top = float(self.interaction_dimensions[i]), self.properties[label].dimension
            yield PrototypeExplanation(
                label,
                name,
                BRANCHES[self.branches[i]],
                interaction,
                top,
                float(self.projected_dimensions[i]),
                float(self.prototype_conductivities[i]),
                abs(interaction - top),
            )

    def _single(self) -> None:
        if self.conductivities.ndim != 1:
            shape = self.conductivities.shape[:-1]
            raise MassError(f"a batch of shape {shape} has no single answer; use the arrays instead")


def normalised_belief(
    classes: Sequence[str], conductivities: NDArray[np.float64], ignorance: NDArray[np.float64] | float = 0.0
) -> MassFunction:
    """Conductivities as a belief function over the classes (sections 3.4 and 5.3).

    Parameters
    ----------
    classes : sequence of str
        The C labels.
    conductivities : ndarray of float64, shape (..., C)
        None negative.
    ignorance : float or ndarray, shape (...)
        Mass to keep on the frame (our own; the chapter keeps none).

    Returns
    -------
    MassFunction
        Focal sets: each class, and the frame, which takes everything where nothing conducts.
    """
    frame = Frame(classes)
    total = conductivities.sum(axis=-1, keepdims=True)
    known = np.where(total > 0, 1.0 - np.asarray(ignorance, dtype=np.float64)[..., None], 0.0)
    shares = known * conductivities / np.where(total > 0, total, 1.0)
    if len(frame) == 1:
        return MassFunction.trusted(frame, np.array([1], dtype=np.int64), np.ones(shares.shape))
    sets = np.array([1 << i for i in range(len(frame))] + [frame.full], dtype=np.int64)
    rest = np.maximum(0.0, 1.0 - shares.sum(axis=-1, keepdims=True))
    rest[np.abs(rest) < 1e-15] = 0.0
    return MassFunction.trusted(frame, sets, np.concatenate([shares, rest], axis=-1))


def classify(
    evidence: MassFunction, knowledge: KnowledgeBase, reading: Reading | None = None
) -> Classification:
    """Conductivity of evidence into each class of a knowledge base (A.8).

    Parameters
    ----------
    evidence : MassFunction
        Over the knowledge base's frame or some of its hypotheses, batch shape ``(...)``. Ignorance stays
        ignorance.
    knowledge : KnowledgeBase
        The classes and their prototypes.
    reading : Reading, optional
        How the formulas are read; the knowledge base's own by default.

    Returns
    -------
    Classification
        Conductivities, belief and reasons.

    Raises
    ------
    FrameError
        If the evidence is about a hypothesis that the knowledge base's frame lacks.
    """
    reading = reading or knowledge.reading
    y = on_frame(evidence.to("shared"), knowledge.frame)
    properties, prototypes, inner = prepared(knowledge, reading)
    committed = 1.0 - y.masses[..., y.focal_sets == y.frame.full].sum(axis=-1)
    met = y if reading.commitment is None else at_commitment(y, reading.commitment, reading.negligible)
    dims = _interactions(met, [x for _, _, x in prototypes], inner, reading) ** reading.sharpness
    names = tuple((label, name) for label, name, _ in prototypes)
    return concluded(dims, committed, knowledge.classes, names, properties, reading)


def concluded(
    dims: NDArray[np.float64],
    committed: NDArray[np.float64],
    classes: tuple[str, ...],
    prototypes: tuple[tuple[str, str], ...],
    properties: Mapping[str, AggregateProperties],
    reading: Reading,
) -> Classification:
    """The conductivities that interaction dimensions make (A.8).

    Parameters
    ----------
    dims : ndarray of float64, shape (..., P)
        ``dim(Y; X_i)``, raised to the reading's sharpness.
    committed : ndarray of float64, shape (...)
        Mass of the evidence that is not on the frame.
    classes : tuple of str
        The C class labels.
    prototypes : tuple of (str, str)
        Class and name of each of the P prototypes.
    properties : mapping of str to AggregateProperties
        Dimension and capacity of each class.
    reading : Reading
        How the formulas are read.

    Returns
    -------
    Classification
        Conductivities, belief and reasons.
    """
    top = np.array([properties[label].dimension for label, _ in prototypes])
    cap = np.array([properties[label].capacity for label, _ in prototypes])
    seen = projection(dims, cap)
    branches = np.zeros(dims.shape, dtype=np.int8)
    if reading.projection:
        branches = np.where(dims <= top + BRANCH_TOLERANCE, 0, np.where(seen <= top, 1, 2)).astype(np.int8)
    if reading.projection and reading.smoothing > 0:
        sigma = _smooth(dims, seen, top, reading.smoothing)
    else:
        sigma = np.choose(branches, [dims, seen, np.zeros_like(dims)])
    if reading.commitment is not None:
        sigma = sigma * committed[..., None]
    pool = {"sum": np.sum, "mean": np.mean, "max": np.max}[reading.pooling]
    labels = np.array([label for label, _ in prototypes])
    total = np.stack([pool(sigma[..., labels == label], axis=-1) for label in classes], axis=-1)
    belief = normalised_belief(classes, total, 1.0 - committed if reading.keep_ignorance else 0.0)
    return Classification(classes, total, belief, prototypes, dims, seen, sigma, branches, dict(properties))


def _smooth(
    dims: NDArray[np.float64], seen: NDArray[np.float64], top: NDArray[np.float64], width: float
) -> NDArray[np.float64]:
    """A.8 iii and iv without the jumps: each branch fades out above the branch point (our own)."""

    def left(x: NDArray[np.float64]) -> NDArray[np.float64]:
        t = np.clip((x - top) / width, 0.0, 1.0)
        return 1.0 - t * t * (3.0 - 2.0 * t)

    strong = left(dims)
    seen = np.minimum(seen, top + width)  # beyond, nothing is left: a capacity may be infinite
    return strong * dims + (1.0 - strong) * left(seen) * seen


Prototypes = list[tuple[str, str, MassFunction]]


@lru_cache(maxsize=64)
def prepared(
    knowledge: KnowledgeBase, reading: Reading
) -> tuple[dict[str, AggregateProperties], Prototypes, list[float]]:
    """What does not depend on the evidence.

    Parameters
    ----------
    knowledge : KnowledgeBase
        The classes and their prototypes.
    reading : Reading
        How the formulas are read.

    Returns
    -------
    properties : mapping of str to AggregateProperties
        Dimension and capacity of each class.
    prototypes : list of (str, str, MassFunction)
        Class, name and masses of each prototype.
    inner : list of float
        Their inner entropies.
    """
    properties = {a.label: aggregate_properties(a, reading) for a in knowledge.aggregates}
    prototypes = [(a.label, name, x) for a in knowledge.aggregates for name, x in a.prototypes.items()]
    return properties, prototypes, [float(inner_entropy(x, reading)) for _, _, x in prototypes]


def at_commitment(y: MassFunction, nominal: float, negligible: float) -> MassFunction:
    """The evidence with a nominal mass off the frame, without crumbs; ignorance where nothing is (our own).

    Parameters
    ----------
    y : MassFunction
        F focal sets in the layout ``shared``, batch shape ``(...)``.
    nominal : float
        Mass off the frame, in (0, 1).
    negligible : float
        Sets with less than this share of what is committed are left out.

    Returns
    -------
    MassFunction
        The same sets in the same order, the frame last.
    """
    off = y.focal_sets != y.frame.full
    masses = y.masses[..., off]
    committed = masses.sum(axis=-1, keepdims=True)
    masses = np.where(masses < negligible * committed, 0.0, masses)
    kept = masses.sum(axis=-1, keepdims=True)
    some = kept > NOTHING
    masses = masses * np.where(some, nominal / np.where(some, kept, 1.0), 0.0)
    rest = np.where(some, 1.0 - nominal, 1.0)
    sets = np.append(y.focal_sets[off], np.int64(y.frame.full))
    return MassFunction.trusted(y.frame, sets, np.concatenate([masses, rest], axis=-1))


def _interactions(
    y: MassFunction, prototypes: Sequence[MassFunction], inner: Sequence[float], reading: Reading
) -> NDArray[np.float64]:
    """``dim(Y; X_i)`` of a batch, in groups of equal focal sets: a set without mass is not focal."""
    flat = y.masses.reshape(-1, y.masses.shape[-1])
    patterns, group = np.unique(flat > 0, axis=0, return_inverse=True)
    out = np.empty((len(flat), len(prototypes)))
    for g, present in enumerate(patterns):
        rows = np.flatnonzero(group.ravel() == g)
        part = MassFunction.trusted(y.frame, y.focal_sets[present], flat[np.ix_(rows, present)])
        own = inner_entropy(part, reading)
        for i, x in enumerate(prototypes):
            both = own + inner[i]
            out[rows, i] = ratio(both, both + divergence(part, x, reading))
    return out.reshape(*y.batch, len(prototypes))
