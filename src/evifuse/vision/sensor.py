"""The logical shape sensor: a picture in, a belief function over shape primitives out."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from evifuse.belief import MassFunction
from evifuse.conductivity import Classification, KnowledgeBase, classify
from evifuse.knowledge import load_knowledge
from evifuse.recordings.images import as_image
from evifuse.vision.detect import Detector, EdgeDrawing
from evifuse.vision.evidence import shape_evidence
from evifuse.vision.fit import FittedEdge, split_at_corners
from evifuse.vision.group import Candidate, group_objects
from evifuse.vision.link import link_chain
from evifuse.vision.primitives import PRIMITIVES, Hypothesis, Outline, outline_of

__all__ = ["SeenObject", "sense_shapes"]

LEAST_BELIEF = 0.15
"""Outlines that support no primitive to this degree are not reported as objects (our own)."""

WORKING_SIDE_PX = 240
"""Pictures with a shorter side are enlarged up to four times for edge detection (our own)."""

WORKING_PIXELS = 4_000_000
"""Pictures with more pixels are reduced for edge detection (our own)."""


@dataclass(frozen=True, eq=False)
class SeenObject:
    """One object of a picture, with the trace of how it was seen.

    Parameters
    ----------
    box : tuple of int
        Bounds x, y, width, height, px, inside the picture.
    fitted_edges : tuple of FittedEdge
        Fitted edges of its outline.
    primitives : tuple of Hypothesis
        Primitives it might show, most believed first.
    evidence : MassFunction
        Over the shape frame.
    classification : Classification
        Conductivity of the evidence into the classes of shape features.
    """

    box: tuple[int, int, int, int]
    fitted_edges: tuple[FittedEdge, ...]
    primitives: tuple[Hypothesis, ...]
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
                {"start": e.start.tolist(), "end": e.end.tolist(), "belief": e.belief}
                for e in self.fitted_edges
            ],
            "primitives": [{"kind": h.kind, "belief": h.belief, **h.geometry} for h in self.primitives],
            "belief": {k: masses.get(k, 0.0) for k in (*frame.hypotheses, "frame")},
            "conductivity": dict(self.classification.conductivity),
            "feature": self.classification.belief.as_dict(),
            "decision": self.classification.decision,
        }


def sense_shapes(
    image: ArrayLike, knowledge: KnowledgeBase | None = None, detector: Detector | None = None
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

    Returns
    -------
    tuple of SeenObject
        Most believed first; empty if nothing is seen.

    Raises
    ------
    ImageError
        If it is not a picture.
    """
    picture = as_image(image)
    kb = load_knowledge("shape") if knowledge is None else knowledge
    candidates = find_candidates(picture, EdgeDrawing() if detector is None else detector)
    chosen = group_objects(candidates, LEAST_BELIEF)
    return tuple(_seen(c, kb, picture.shape[1], picture.shape[0]) for c in chosen)


def find_candidates(picture: NDArray[np.uint8], detector: Detector) -> list[Candidate]:
    """Every outline of a picture with the primitives it might show.

    Parameters
    ----------
    picture : ndarray of uint8, shape (H, W) or (H, W, 3)
        Grey or BGR.
    detector : Detector
        Edge detector.

    Returns
    -------
    list of Candidate
        In picture coordinates, px.
    """
    import cv2

    grey = picture if picture.ndim == 2 else cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
    height, width = grey.shape
    scale = float(np.clip(WORKING_SIDE_PX / min(height, width), 1.0, 4.0))
    scale = min(scale, float(np.sqrt(WORKING_PIXELS / (height * width))))
    if scale != 1:
        how = cv2.INTER_LINEAR if scale > 1 else cv2.INTER_AREA
        grey = cv2.resize(grey, (round(width * scale), round(height * scale)), interpolation=how)
    pad = 8
    grey = cv2.copyMakeBorder(grey, pad, pad, pad, pad, cv2.BORDER_REPLICATE)
    chains = detector(np.ascontiguousarray(grey, dtype=np.uint8))
    found: list[Candidate] = []
    for chain in chains:
        if len(chain) < 24:
            continue
        outline = outline_of(link_chain(chain))
        if outline is not None:
            found.append(_candidate(outline))
    return found


def _candidate(outline: Outline) -> Candidate:
    proposals = (propose(outline) for propose in PRIMITIVES.values())
    hypotheses = tuple(sorted((h for h in proposals if h is not None), key=lambda h: -h.belief))
    return Candidate(outline, hypotheses, hypotheses[0].belief if hypotheses else 0.0)


def _seen(candidate: Candidate, kb: KnowledgeBase, width: int, height: int) -> SeenObject:
    hypotheses = candidate.hypotheses
    evidence = shape_evidence({h.kind: h.belief for h in hypotheses})
    edges = hypotheses[0].edges or split_at_corners(candidate.outline.links)
    low = np.clip(np.floor(candidate.box[:2]), 0, [width - 1, height - 1]).astype(int)
    high = np.clip(np.ceil(candidate.box[2:]) + 1, low + 1, [width, height]).astype(int)
    box = (int(low[0]), int(low[1]), int(high[0] - low[0]), int(high[1] - low[1]))
    return SeenObject(box, edges, hypotheses, evidence, classify(evidence, kb))
