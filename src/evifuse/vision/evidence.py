"""From the beliefs of primitives to one mass function over the shape frame."""

from collections.abc import Mapping
from typing import SupportsFloat

import numpy as np
from numpy.typing import NDArray

from evifuse.belief import Frame, MassFunction
from evifuse.vision.primitives import SHAPE_FRAME

__all__ = ["shape_evidence", "shape_evidences"]


def shape_evidence(beliefs: Mapping[str, SupportsFloat], frame: Frame = SHAPE_FRAME) -> MassFunction:
    """Mass function over the shape primitives (section 3.3).

    Each primitive has its belief as mass and the frame has the balance, as in the printed example.
    Beliefs that sum to more than 1 - a circle is an ellipse too - can't all stand: they are scaled
    together so that the frame keeps ``prod(1 - b)``, the doubt that is left if every primitive were a
    separate witness (our own).

    Parameters
    ----------
    beliefs : mapping of str to float
        Belief in [0, 1] by primitive; a primitive that is not named has 0.
    frame : Frame, optional
        The primitives, if they are not the built-in ones.

    Returns
    -------
    MassFunction
        Over the frame; its focal sets are all primitives and the frame.

    Examples
    --------
    >>> shape_evidence({"rectangle": 0.19, "square": 0.10, "triangle": 0.20}).as_dict(digits=2)
    {'frame': 0.51, 'triangle': 0.2, 'rectangle': 0.19, 'square': 0.1}
    """
    for name in beliefs:
        frame.mask(name)
    values = np.array([float(beliefs.get(name, 0.0)) for name in frame.hypotheses], dtype=np.float64)
    return shape_evidences(values, frame)


def shape_evidences(beliefs: NDArray[np.float64], frame: Frame = SHAPE_FRAME) -> MassFunction:
    """As `shape_evidence`, for many objects at once.

    Parameters
    ----------
    beliefs : ndarray of float64, shape (..., P)
        Belief in each primitive, in the order of the frame, in [0, 1].
    frame : Frame, optional
        The P primitives, if they are not the built-in ones.

    Returns
    -------
    MassFunction
        Batch shape ``(...)``; the focal sets are all primitives and the frame.
    """
    total = beliefs.sum(axis=-1, keepdims=True)
    doubt = (1 - beliefs).prod(axis=-1, keepdims=True)
    masses = beliefs * np.where(total > 1, (1 - doubt) / np.maximum(total, 1.0), 1.0)
    rest = np.maximum(0.0, 1.0 - masses.sum(axis=-1, keepdims=True))
    return MassFunction(frame, [*frame.hypotheses, frame], np.concatenate([masses, rest], axis=-1))
