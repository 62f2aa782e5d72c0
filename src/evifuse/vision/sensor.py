"""The logical shape sensor: a picture in, a belief function over shape primitives out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evifuse.belief import Frame, MassFunction, on_frame
from evifuse.conductivity import Classification, CompiledClassifier, KnowledgeBase, classify, compile  # noqa: A004
from evifuse.errors import KnowledgeError
from evifuse.knowledge import load_knowledge
from evifuse.recordings.images import as_image
from evifuse.vision.candidates import Candidates, candidates_of
from evifuse.vision.detect import Detector
from evifuse.vision.evidence import shape_evidences
from evifuse.vision.exact import exact_hypotheses, with_rough_ends
from evifuse.vision.fit import FittedEdge
from evifuse.vision.group import group_objects
from evifuse.vision.later import Later
from evifuse.vision.link import LinkList
from evifuse.vision.outlines import find_outlines
from evifuse.vision.primitives import PRIMITIVES, SHAPE_FRAME, Hypothesis, Primitive, outlines_of
from evifuse.vision.rivalry import Rivalry
from evifuse.vision.sides import split_at_corners
from evifuse.vision.strokes import strokes_of
from evifuse.vision.view import View, from_above
from evifuse.vision.working import WorkingPicture, working_picture

__all__ = ["SeenObject", "sense_shapes"]

LEAST_BELIEF = 0.01
"""Outlines that support no primitive to this degree are not reported as objects (our own)."""

FRAME = 0.015
"""An outline so near to all borders of a picture, as a share of its sides, may be its frame (our own)."""

SHORTEST_PX = 24
"""Chains of fewer points show no shape, working px (our own)."""


@dataclass(frozen=True, eq=False)
class SeenObject:
    """One object of a picture, with the trace of how it was seen.

    Parameters
    ----------
    box : tuple of int
        Bounds x, y, width, height, px, inside the picture.
    fitted_edges : sequence of FittedEdge
        Fitted edges of its outline.
    primitives : sequence of Hypothesis
        Primitives it might show, most believed first. They and the edges get their exact places in the
        picture when those of any object are first looked at; what is believed is known before.
    evidence : MassFunction
        Over the shape frame.
    classification : Classification
        Conductivity of the evidence into the classes of shape features.
    """

    box: tuple[int, int, int, int]
    fitted_edges: Sequence[FittedEdge]
    primitives: Sequence[Hypothesis]
    evidence: MassFunction
    classification: Classification

    def to_json(self) -> dict[str, Any]:
        """The object as values that JSON knows.

        Returns
        -------
        dict
            Keys `box`, `fitted_edges`, `primitives`, `belief`, `conductivity`, `feature`, `decision`.
        """
        frame = self.evidence.frame
        masses = self.evidence.as_dict()
        return {
            "box": list(self.box),
            "fitted_edges": [
                {
                    "start": e.start.tolist(),
                    "end": e.end.tolist(),
                    "belief": e.belief,
                    "start_covariance_px2": e.start_covariance_px2.tolist(),
                    "end_covariance_px2": e.end_covariance_px2.tolist(),
                }
                for e in self.fitted_edges
            ],
            "primitives": [{"kind": h.kind, "belief": h.belief, **h.geometry} for h in self.primitives],
            "belief": {k: masses.get(k, 0.0) for k in (*frame.hypotheses, "frame")},
            "conductivity": dict(self.classification.conductivity),
            "feature": self.classification.belief.as_dict(),
            "decision": self.classification.decision,
        }


def sense_shapes(
    image: ArrayLike,
    knowledge: KnowledgeBase | None = None,
    detector: Detector | None = None,
    primitives: Mapping[str, Primitive] = PRIMITIVES,
    view: View | None = None,
    rivalry: Rivalry | None = None,
) -> tuple[SeenObject, ...]:
    """See the objects of a picture and what shapes they have.

    Parameters
    ----------
    image : array_like
        Picture, as for `evifuse.recordings.images.as_image`.
    knowledge : KnowledgeBase, optional
        Classes of shape features; the built-in ones without it.
    detector : Detector, optional
        Edge detector; `EdgeDrawing` without it.
    primitives : mapping of str to callable, optional
        What proposes each primitive, by name: ``{**PRIMITIVES, "pentagon": propose}`` adds one. The
        knowledge base must know all the names.
    view : View, optional
        Camera matrix and plane. With it the shapes are judged as they lie on the plane: a square is believed
        a square however obliquely it is seen. Without it, belief falls the more oblique the view is.
    rivalry : Rivalry, optional
        Learned weights of what tells shapes apart; those of the package without it.

    Returns
    -------
    tuple of SeenObject
        Most prominent first (belief and size both count); empty if nothing is seen.

    Raises
    ------
    ImageError
        If it is not a picture.
    FrameError
        If the knowledge base does not know a primitive.
    """
    picture = _without_equal_colours(as_image(image))
    kb = load_knowledge("shape") if knowledge is None else knowledge
    working = working_picture(picture)
    candidates = find_candidates(working, detector, primitives, view, rivalry)
    if candidates is None:
        return ()
    boxes = candidates.boxes
    bounds = working.point(boxes.reshape(-1, 2, 2)).reshape(-1, 4)
    last = candidates.prominence - 1e6 * _is_frame(bounds, (picture.shape[1], picture.shape[0]))
    candidates = replace(candidates, prominence=last)
    chosen, members = group_objects(boxes, candidates.scores, candidates.support, last, LEAST_BELIEF)
    if not chosen:
        return ()
    candidates = candidates.grouped(chosen, members)
    frame = SHAPE_FRAME if primitives is PRIMITIVES else Frame(primitives)
    evidence = shape_evidences(candidates.beliefs[:, chosen].T, frame)
    together = _classified(evidence, kb)
    shared = isinstance(image, np.ndarray) and np.may_share_memory(picture, image)
    trace = _Trace(picture.copy() if shared else picture, working, candidates, tuple(chosen))
    return tuple(
        SeenObject(
            box=box,
            fitted_edges=Later(partial(trace.edges, k)),
            primitives=Later(partial(trace.of, k)),
            evidence=evidence[k],
            classification=_one_of(together, k),
        )
        for k, box in enumerate(_pixel_boxes(bounds[chosen], (picture.shape[1], picture.shape[0])))
    )


def _without_equal_colours(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """A grey picture stored in colours is grey: it is seen the same, and sooner."""
    if picture.ndim == 2 or (picture[::7, ::7] != picture[::7, ::7, :1]).any():
        return picture
    return np.ascontiguousarray(picture[..., 0]) if (picture == picture[..., :1]).all() else picture


@dataclass(frozen=True, eq=False)
class _Trace:
    """How the objects of a picture were seen; made for all of them when it is first asked for."""

    picture: NDArray[np.uint8]
    working: WorkingPicture
    candidates: Candidates
    chosen: tuple[int, ...]

    @cached_property
    def hypotheses(self) -> list[tuple[Hypothesis, ...]]:
        """What each object might show, in its exact place in the picture."""
        rough = [tuple(map(self.working.hypothesis, self.candidates.hypotheses(i))) for i in self.chosen]
        return exact_hypotheses(rough, self.picture, self.working.scale)

    def of(self, k: int) -> tuple[Hypothesis, ...]:
        """What one object might show."""
        return self.hypotheses[k]

    def edges(self, k: int) -> tuple[FittedEdge, ...]:
        """Fitted edges of one object."""
        links = self.candidates.outlines.links[self.chosen[k]]
        return self.hypotheses[k][0].edges or _edges_between_corners(links, self.working)


def _classified(evidence: MassFunction, knowledge: KnowledgeBase) -> Classification:
    """Conductivity of all evidence of a picture, by a compiled knowledge base if it can be compiled."""
    same = on_frame(evidence, knowledge.frame)
    try:
        fast = _compiled(knowledge, tuple(same.focal_sets.tolist()))
    except KnowledgeError:  # sets infinitely far apart
        return classify(same, knowledge)
    return fast.classify(same.masses)


@lru_cache(maxsize=16)
def _compiled(knowledge: KnowledgeBase, focal_sets: tuple[int, ...]) -> CompiledClassifier:
    return compile(knowledge, np.array(focal_sets, np.int64))


def _one_of(together: Classification, i: int) -> Classification:
    """One classification of a batch."""
    return replace(
        together,
        conductivities=together.conductivities[i],
        belief=together.belief[i],
        interaction_dimensions=together.interaction_dimensions[i],
        projected_dimensions=together.projected_dimensions[i],
        prototype_conductivities=together.prototype_conductivities[i],
        branches=together.branches[i],
    )


def find_candidates(
    working: WorkingPicture,
    detector: Detector | None = None,
    primitives: Mapping[str, Primitive] = PRIMITIVES,
    view: View | None = None,
    rivalry: Rivalry | None = None,
) -> Candidates | None:
    """Every outline of a picture with the primitives it might show.

    Parameters
    ----------
    working : WorkingPicture
        Picture.
    detector : Detector, optional
        Edge detector; `EdgeDrawing` without it.
    primitives : mapping of str to callable
        What proposes each primitive.
    view : View, optional
        Camera and plane; the outlines are judged as they lie on it.
    rivalry : Rivalry, optional
        Learned weights; those of the package without it.

    Returns
    -------
    Candidates or None
        In working coordinates, px; None if there is no outline.
    """
    chains = [c for c in working.edges(detector) if len(c) >= SHORTEST_PX]
    links = find_outlines(chains)
    if not links:
        return None
    outlines = outlines_of(links)
    strokes = strokes_of(chains, outlines)
    if view is None:
        return candidates_of(outlines, working.scale, strokes, primitives, rivalry)
    above = from_above(outlines, strokes, view, working)
    return above.back(candidates_of(above.outlines, working.scale, above.strokes, primitives, rivalry))


def _edges_between_corners(links: LinkList, working: WorkingPicture) -> tuple[FittedEdge, ...]:
    """Fitted edges of an outline that is no polygon."""
    return tuple(with_rough_ends(e, working.scale) for e in working.fitted(split_at_corners(links)))


def _is_frame(bounds: NDArray[np.float64], size: tuple[int, int]) -> NDArray[np.bool_]:
    """Whether outlines run along all borders of the picture, shape (N,): seldom an object."""
    low, high = bounds[:, :2] / size, bounds[:, 2:] / size
    return np.all((low < FRAME) & (high > 1 - FRAME), axis=1)


def _pixel_boxes(bounds: NDArray[np.float64], size: tuple[int, int]) -> list[tuple[int, int, int, int]]:
    """Whole pixels x, y, width, height inside the picture, of bounds x0, y0, x1, y1, shape (N, 4)."""
    width, height = size
    inside = np.clip(np.rint(bounds), 0, np.array([width, height, width, height]) - 1).astype(int)
    return [(x0, y0, x1 - x0 + 1, y1 - y0 + 1) for x0, y0, x1, y1 in inside.tolist()]
