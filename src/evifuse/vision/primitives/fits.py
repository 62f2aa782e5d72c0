"""The shapes that several primitives share, each fitted once to all outlines."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from evifuse.vision.primitives.ellipses import FittedEllipses, fit_ellipses
from evifuse.vision.primitives.outline import Outlines
from evifuse.vision.primitives.polygon import FittedPolygons, fit_polygons
from evifuse.vision.reduce import reduce_polygons

__all__ = ["Fits"]


@dataclass(frozen=True, eq=False)
class Fits:
    """Outlines and what was fitted to them, when first asked for.

    Parameters
    ----------
    outlines : Outlines
        What is seen.
    """

    outlines: Outlines

    @cached_property
    def ellipse(self) -> FittedEllipses:
        """An ellipse for each outline."""
        return fit_ellipses(self.outlines)

    @cached_property
    def quadrilateral(self) -> FittedPolygons:
        """Four sides for each outline."""
        return fit_polygons(self.outlines, self._reduced[4])

    @cached_property
    def triangle(self) -> FittedPolygons:
        """Three sides for each outline."""
        return fit_polygons(self.outlines, self._reduced[3])

    @cached_property
    def _reduced(self) -> dict[int, NDArray[np.float64]]:
        return reduce_polygons(self.outlines.hull, self.outlines.corners, (4, 3))
