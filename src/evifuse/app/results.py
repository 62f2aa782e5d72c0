"""The columns that the classification of a file writes."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.app.arrow import pyarrow
from evifuse.app.rows import MassRows
from evifuse.belief._portable import FORMAT
from evifuse.conductivity import KnowledgeBase, Reading

__all__ = ["RESULTS", "knowledge_hash", "output_schema", "result_columns"]

RESULTS = ("decision", "conductivities", "masses")
"""Their names, after the columns that are carried over."""


def knowledge_hash(knowledge: KnowledgeBase) -> str:
    """SHA-256 of all that a knowledge base says: frame, attributes, classes and prototypes.

    Parameters
    ----------
    knowledge : KnowledgeBase
        Its title, source and reading do not count.

    Returns
    -------
    str
        64 hexadecimal digits.
    """
    lists = knowledge.frame.attributes
    content = {
        "frame": knowledge.frame.hypotheses,
        "attributes": None if lists is None else [sorted(own) for own in lists],
        "classes": [
            [a.label, [[name, x.focal_sets.tolist(), x.masses.tolist()] for name, x in a.prototypes.items()]]
            for a in knowledge.aggregates
        ],
    }
    return hashlib.sha256(json.dumps(content).encode()).hexdigest()


def output_schema(rows: MassRows, knowledge: KnowledgeBase, reading: Reading) -> Any:
    """Carried columns, then the results, and what they were made with.

    The header makes ``masses`` readable by `evifuse.belief.from_parquet`, as mass functions over the classes.

    Parameters
    ----------
    rows : MassRows
        The input.
    knowledge : KnowledgeBase
        The C classes.
    reading : Reading
        How the formulas are read.

    Returns
    -------
    pyarrow.Schema
        Without times and places, so that equal work gives equal bytes.
    """
    pa = pyarrow()
    count = len(knowledge.classes)
    width = 1 if count == 1 else count + 1
    header = {
        "format": FORMAT,
        "frame": list(knowledge.classes),
        "attributes": None,
        "layout": "singletons",
        "shape": [*rows.shape, width],
        "open_world": False,
    }
    made_with = {
        "knowledge": knowledge.name,
        "sha256": knowledge_hash(knowledge),
        "reading": asdict(reading),
    }
    kinds = (
        pa.dictionary(pa.int32(), pa.string()),
        pa.list_(pa.float64(), count),
        pa.list_(pa.float64(), width),
    )
    results = [pa.field(name, kind) for name, kind in zip(RESULTS, kinds, strict=True)]
    metadata = {"evifuse": json.dumps(header), "evifuse.classify": json.dumps(made_with)}
    return pa.schema([*rows.carried, *results], metadata=metadata)


def result_columns(
    classes: Sequence[str], conductivities: NDArray[np.float64], belief: NDArray[np.float64]
) -> list[Any]:
    """Decision, conductivities and belief of a batch of n rows as Arrow arrays.

    Parameters
    ----------
    classes : sequence of str
        The C labels.
    conductivities : ndarray of float64, shape (n, C)
        Quickest if it lies in memory by columns.
    belief : ndarray of float64, shape (n, C + 1) or (n, 1)
        Masses of the classes and their frame.

    Returns
    -------
    list of pyarrow.Array
        In the order of ``RESULTS``; the decision is null where nothing conducts.
    """
    pa = pyarrow()
    highest = conductivities[:, 0]
    best = np.zeros(len(highest), dtype=np.int32)
    for k in range(1, conductivities.shape[1]):
        column = conductivities[:, k]
        best[column > highest] = k  # the first of equals stays
        highest = np.maximum(highest, column)
    decision = pa.DictionaryArray.from_arrays(pa.array(best, mask=~(highest > 0)), pa.array(list(classes)))
    return [decision, _lists(conductivities), _lists(belief)]


def _lists(values: NDArray[np.float64]) -> Any:
    pa = pyarrow()
    return pa.FixedSizeListArray.from_arrays(pa.array(np.ascontiguousarray(values).ravel()), values.shape[1])
