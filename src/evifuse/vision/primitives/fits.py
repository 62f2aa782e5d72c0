"""The shapes that several primitives share, each fitted once to all outlines."""

from dataclasses import dataclass
from functools import cached_property

from evifuse.vision.closing import closed_across_the_gap, closed_by_itself
from evifuse.vision.primitives.agreement import MOST_TOLERANCES
from evifuse.vision.primitives.ellipses import FittedEllipses, fit_ellipses
from evifuse.vision.primitives.outline import Outlines
from evifuse.vision.primitives.polygon import FittedPolygons, fit_polygons
from evifuse.vision.sections import Divisions, straight_sections

__all__ = ["MOST_SECTIONS", "Fits"]

MOST_SECTIONS = 6
"""Every outline is divided into up to so many straight sections; into more when they are asked for."""


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
        around = self.outlines.around
        return fit_polygons(
            self.outlines,
            (closed_by_itself(self.sections[4], around), closed_across_the_gap(self.sections[3], around)),
        )

    @cached_property
    def triangle(self) -> FittedPolygons:
        """Three sides for each outline."""
        around = self.outlines.around
        return fit_polygons(
            self.outlines,
            (closed_by_itself(self.sections[3], around), closed_across_the_gap(self.sections[2], around)),
        )

    def polygon(self, corners: int) -> FittedPolygons:
        """Any number of sides for each outline, all of them seen.

        Parameters
        ----------
        corners : int
            From 3 to 8.

        Returns
        -------
        FittedPolygons
            Fitted anew at every call.
        """
        divisions = self.sections if corners <= MOST_SECTIONS else self._divided(corners)
        return fit_polygons(self.outlines, (closed_by_itself(divisions[corners], self.outlines.around),))

    @cached_property
    def sections(self) -> Divisions:
        """One to six straight sections of each outline."""
        return self._divided(MOST_SECTIONS)

    def _divided(self, most: int) -> Divisions:
        price = (MOST_TOLERANCES * self.outlines.tolerance) ** 2
        return straight_sections(self.outlines.points, price, most)
