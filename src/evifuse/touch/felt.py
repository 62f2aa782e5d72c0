"""What touch tells: local curvatures, sites, evidence and its class, as values."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.belief.mass import MassFunction
from evifuse.conductivity import Classification
from evifuse.touch.curvature import ShapeOperator
from evifuse.touch.edges import Edge
from evifuse.touch.primitives import NO_CONTACT, PRIMITIVES

__all__ = ["FeltSite", "FeltSurface", "LocalCurvature", "OneDirection"]

LEAST = 0.05
"""A class that conducts less is no answer: what was felt fits none (our own)."""


@dataclass(frozen=True)
class LocalCurvature:
    """Curvature of a surface along one travelled direction.

    Parameters
    ----------
    site : int
        Index of the site in `FeltSurface.sites`.
    direction_rad : float
        Travelled direction at the site: angle of the contact path's tangent against the world's x axis
        projected into the site's tangent plane, counter-clockwise about the outward normal, in [0, pi).
    curvature_per_m : float
        Normal curvature, 1/m, concave up positive.
    standard_error_per_m : float
        Its standard error, 1/m.
    belief : float
        Belief that is given to it, in [0, 1].
    joint_curvature_per_m : float
        The chapter's own estimate, from the joint angle and the contact path with nothing known about slip,
        1/m; NaN without a joint angle.
    slip : float
        Share of the joint's turn that was not rolled; NaN without a joint angle.
    """

    site: int
    direction_rad: float
    curvature_per_m: float
    standard_error_per_m: float
    belief: float
    joint_curvature_per_m: float
    slip: float


@dataclass(frozen=True)
class OneDirection:
    """What is known where the finger rolled in one direction only.

    Parameters
    ----------
    direction_rad : float
        Direction along which the curvature is known, as in `LocalCurvature`.
    curvature_per_m : float
        Normal curvature along it, 1/m, concave up positive.
    standard_error_per_m : float
        Its standard error, 1/m.
    """

    direction_rad: float
    curvature_per_m: float
    standard_error_per_m: float

    @property
    def across_rad(self) -> float:
        """Direction along which the curvature can't be known, in [0, pi)."""
        return (self.direction_rad + 0.5 * np.pi) % np.pi

    def __str__(self) -> str:
        along, across = (round(np.rad2deg(angle)) % 180 for angle in (self.direction_rad, self.across_rad))
        return (
            f"along {along} degrees: the curvature along it is {self.curvature_per_m:.1f} ± "
            f"{1.96 * self.standard_error_per_m:.1f} 1/m, the one across it, along {across} degrees, "
            "can't be known"
        )


@dataclass(frozen=True)
class FeltSite:
    """A site that was explored.

    Parameters
    ----------
    position_m : ndarray of float64, shape (3,)
        Point of the surface, or of the surface that was expected and not met, world frame, metres.
    normal : ndarray of float64, shape (3,)
        Outward unit normal there, world frame.
    contact : bool
        Whether a surface was met.
    shape : ShapeOperator or None
        Principal curvatures; None without contact, on an edge, or if the finger rolled in fewer than two
        directions.
    evidence : MassFunction
        What this site alone says, over `CURVATURE_FRAME`.
    edge : Edge or None
        The edge or corner that was felt instead of a curvature.
    only : OneDirection or None
        What is known if the finger rolled in one direction only.
    """

    position_m: NDArray[np.float64]
    normal: NDArray[np.float64]
    contact: bool
    shape: ShapeOperator | None
    evidence: MassFunction
    edge: Edge | None = None
    only: OneDirection | None = None

    @property
    def k1_per_m(self) -> float | None:
        """Larger principal curvature, 1/m, concave up positive; None where it is not known."""
        return None if self.shape is None else self.shape.k1_per_m

    @property
    def k2_per_m(self) -> float | None:
        """Smaller principal curvature, 1/m, concave up positive; None where it is not known."""
        return None if self.shape is None else self.shape.k2_per_m


@dataclass(frozen=True)
class FeltSurface:
    """What a rolled finger tells about a surface, with the trace of how.

    Parameters
    ----------
    local_curvatures : tuple of LocalCurvature
        One per roll, site by site.
    sites : tuple of FeltSite
        The touched sites in order of time, then the missed ones.
    evidence : MassFunction
        Over `CURVATURE_FRAME`.
    classification : Classification
        Conductivity of the evidence into quasiplanar, curved and occluded.
    gamma_per_m : float
        Threshold between flat and curved that was used, 1/m.
    warnings : tuple of str
        What the estimate lacks, one line each.
    """

    local_curvatures: tuple[LocalCurvature, ...]
    sites: tuple[FeltSite, ...]
    evidence: MassFunction
    classification: Classification
    gamma_per_m: float
    warnings: tuple[str, ...]

    @property
    def decision(self) -> str | None:
        """The class that conducts most; None where none conducts a twentieth."""
        most = max(self.classification.conductivity.values(), default=0.0)
        return self.classification.decision if most >= LEAST else None

    def to_json(self) -> dict[str, Any]:
        """Plain values, as the command line prints them.

        Returns
        -------
        dict
            ``local_curvatures``, ``sites``, ``belief``, ``conductivity``, ``decision`` and ``warnings``; SI
            units, curvatures concave up positive, ``k1_per_m`` and ``k2_per_m`` null where they are not
            known.
        """
        return {
            "local_curvatures": [
                {
                    "site": local.site,
                    "direction_rad": local.direction_rad,
                    "curvature_per_m": local.curvature_per_m,
                    "belief": local.belief,
                    "standard_error_per_m": local.standard_error_per_m,
                    "joint_curvature_per_m": _number(local.joint_curvature_per_m),
                    "slip": _number(local.slip),
                }
                for local in self.local_curvatures
            ],
            "sites": [_site_json(site) for site in self.sites],
            "belief": _belief_json(self.evidence),
            "conductivity": self.classification.conductivity,
            "decision": self.decision,
            "warnings": list(self.warnings),
        }


def _number(value: float) -> float | None:
    """None instead of NaN, which JSON has not."""
    return value if np.isfinite(value) else None


def _belief_json(evidence: MassFunction) -> dict[str, float]:
    belief = dict.fromkeys((*PRIMITIVES, NO_CONTACT), 0.0) | evidence.as_dict()
    belief["frame"] = belief.pop("frame", 0.0)
    return belief


def _site_json(site: FeltSite) -> dict[str, Any]:
    shape, only = site.shape, site.only
    return {
        "k1_per_m": site.k1_per_m,
        "k2_per_m": site.k2_per_m,
        "contact": site.contact,
        "position_m": site.position_m.tolist(),
        "normal": site.normal.tolist(),
        "k1_direction_rad": None if shape is None else shape.k1_direction_rad,
        "k1_standard_error_per_m": None if shape is None else shape.k1_error_per_m,
        "k2_standard_error_per_m": None if shape is None else shape.k2_error_per_m,
        "known_direction_rad": None if only is None else only.direction_rad,
        "known_curvature_per_m": None if only is None else only.curvature_per_m,
        "known_standard_error_per_m": None if only is None else only.standard_error_per_m,
        "unknown_direction_rad": None if only is None else only.across_rad,
        "belief": _belief_json(site.evidence),
        "edge": None if site.edge is None else asdict(site.edge),
    }
