"""Section 5.2: what the shape of an outline says about the curvature of the surface."""

from collections.abc import Mapping

import numpy as np

from evifuse.conductivity import KnowledgeBase

__all__ = ["NO_CONTACT", "SHAPE_CLASS", "curvature_from_shape"]

SHAPE_CLASS = {
    "rectangle": "rectangular",
    "square": "rectangular",
    "triangle": "triangular",
    "ellipse": "elliptical",
    "circle": "elliptical",
    "bracket": "elliptical",
}
"""Which class of shape features each shape primitive belongs to (section 3.3)."""

NO_CONTACT = "N"
"""The curvature primitive of a site where a surface was expected and none was met."""


def curvature_from_shape(
    shape: Mapping[str, float], knowledge: KnowledgeBase, no_contact: float = 0.0
) -> dict[str, float]:
    """Conductivity of shape features into each class of curvature features (section 5.2).

    A focal set is activated by the product of the conductivities of the classes of its shape labels, a class
    by the maximum over its focal sets. The frame itself and focal sets without a shape label are left out. A
    focal set with N is also multiplied by the evidence for no contact.

    Parameters
    ----------
    shape : mapping of str to float
        Conductivity into ``rectangular``, ``triangular`` and ``elliptical``; absent classes count 0.
    knowledge : KnowledgeBase
        Classes of curvature features whose focal sets name shape primitives (table 4).
    no_contact : float
        Belief in N from touch, in [0, 1]; 0 with contact everywhere or without touch.

    Returns
    -------
    dict of str to float
        Conductivity by class of curvature features.

    Examples
    --------
    >>> from evifuse.knowledge import load_knowledge
    >>> table_4 = load_knowledge("chapter-curvature")
    >>> found = curvature_from_shape({"rectangular": 0.48, "triangular": 1.46, "elliptical": 0.0}, table_4)
    >>> {label: round(value, 2) for label, value in found.items()}
    {'quasiplanar': 0.7, 'curved': 0.7, 'occluded': 0.0}
    """
    out: dict[str, float] = {}
    for aggregate in knowledge.aggregates:
        activations = [0.0]
        for prototype in aggregate.prototypes.values():
            for mask in prototype.focal_sets.tolist():
                labels = knowledge.frame.names(mask)
                classes = sorted({SHAPE_CLASS[label] for label in labels if label in SHAPE_CLASS})
                if mask == knowledge.frame.full or not classes:
                    continue
                activation = float(np.prod([shape.get(c, 0.0) for c in classes]))
                activations.append(activation * (no_contact if NO_CONTACT in labels else 1.0))
        out[aggregate.label] = max(activations)
    return out
