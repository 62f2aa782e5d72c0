"""What every logical sensor gives: evidence over a named frame, and how a knowledge base conducts it."""

from typing import Any, Protocol

from evifuse.belief import MassFunction
from evifuse.conductivity.classify import Classification

__all__ = ["Percept"]


class Percept(Protocol):
    """Output of a logical sensor (Henderson and Shilcrat 1984): raw reading in, belief function out.

    A further sense is a new package with a function that returns one of these, and a knowledge base in YAML.
    """

    @property
    def evidence(self) -> MassFunction:
        """Masses over the sensor's primitives."""
        ...

    @property
    def classification(self) -> Classification:
        """Conductivity of the evidence into the classes of features."""
        ...

    def to_json(self) -> dict[str, Any]:
        """The percept and the trace of what was seen on the way, as plain values.

        Returns
        -------
        dict
            Ready for JSON; lengths in metres, angles in radians, places in pictures in px.
        """
        ...
