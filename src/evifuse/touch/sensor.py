"""The logical curvature sensor: a recording of a rolled finger in, belief over curvature primitives out."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evifuse.belief.mass import MassFunction
from evifuse.conductivity import Classification, KnowledgeBase, classify
from evifuse.knowledge import load_knowledge
from evifuse.recordings.recording import TouchRecording
from evifuse.touch.contact import ContactTrack, contact_track
from evifuse.touch.curvature import RollCurvature, ShapeOperator, measure_roll, shape_operator
from evifuse.touch.missing import MissedSite, missed_sites
from evifuse.touch.primitives import (
    NO_CONTACT,
    PRIMITIVES,
    curvature_threshold_per_m,
    evidence_from_sites,
    primitive_beliefs,
    site_evidence,
)
from evifuse.touch.rolling import ContactSite, find_sites
from evifuse.touch.smearing import chapter_belief, check_belief_model, resolved_belief, smearing_discount

__all__ = ["FeltSite", "FeltSurface", "LocalCurvature", "sense_curvature"]

CONTACT_POINTS = 128
"""How many contact points of a roll the smearing is averaged over, about."""
MUCH_SLIP = 0.1
"""A roll that slips by more than this share of its turn is reported."""


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
    slip : float
        Share of the joint's turn that was not rolled.
    """

    site: int
    direction_rad: float
    curvature_per_m: float
    standard_error_per_m: float
    belief: float
    slip: float


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
        Principal curvatures; None without contact, or if the finger rolled in fewer than two directions.
    """

    position_m: NDArray[np.float64]
    normal: NDArray[np.float64]
    contact: bool
    shape: ShapeOperator | None

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

    def to_json(self) -> dict[str, Any]:
        """Plain values, as the command line prints them.

        Returns
        -------
        dict
            ``local_curvatures``, ``sites``, ``belief``, ``conductivity``, ``decision`` and ``warnings``; SI
            units, curvatures concave up positive, ``k1_per_m`` and ``k2_per_m`` null where they are not
            known.
        """
        belief = dict.fromkeys((*PRIMITIVES, NO_CONTACT), 0.0) | self.evidence.as_dict()
        belief["frame"] = belief.pop("frame", 0.0)
        return {
            "local_curvatures": [
                {
                    "site": local.site,
                    "direction_rad": local.direction_rad,
                    "curvature_per_m": local.curvature_per_m,
                    "belief": local.belief,
                    "standard_error_per_m": local.standard_error_per_m,
                    "slip": local.slip,
                }
                for local in self.local_curvatures
            ],
            "sites": [_site_json(site) for site in self.sites],
            "belief": belief,
            "conductivity": self.classification.conductivity,
            "decision": self.classification.decision,
            "warnings": list(self.warnings),
        }


def sense_curvature(
    recording: TouchRecording, knowledge: KnowledgeBase | None = None, belief: str = "resolved"
) -> FeltSurface:
    """Feel a surface: local curvatures, sites, evidence over the primitives, and its class.

    Parameters
    ----------
    recording : TouchRecording
        A finger rolled over a surface, T samples of N taxels.
    knowledge : KnowledgeBase, optional
        Classes of curvature features; the built-in ``curvature`` by default.
    belief : {"resolved", "chapter"}
        How a local curvature is believed, and how beliefs become evidence. ``chapter``: section 4.1.4 and the
        averages of table 5. ``resolved`` (our own): see `resolved_belief` and `site_evidence`.

    Returns
    -------
    FeltSurface
        Never fails on a valid recording: without contact the evidence is N, without rolls it is ignorance.

    Raises
    ------
    UsageError
        If there is no such belief model.
    """
    model = check_belief_model(belief)
    knowledge = load_knowledge("curvature") if knowledge is None else knowledge
    radius = recording.fingertip.radius_m
    gamma = curvature_threshold_per_m(radius)
    track = contact_track(recording)
    touched = find_sites(recording, track)
    rolls = [[measure_roll(recording, track, site, roll) for roll in site.rolls] for site in touched]
    shapes = [shape_operator(found, radius) for found in rolls]
    missed = missed_sites(recording, track.touching, touched, shapes)
    local = tuple(
        _local(recording, track, model, gamma, index, roll)
        for index, found in enumerate(rolls)
        for roll in found
    )
    evidence = _evidence(model, local, shapes, missed, gamma)
    sites = tuple(
        FeltSite(site.centre_m - radius * site.normal, site.normal, True, shape)
        for site, shape in zip(touched, shapes, strict=True)
    ) + tuple(FeltSite(site.position_m, site.normal, False, None) for site in missed)
    classification = classify(evidence, knowledge)
    warnings = _warnings(recording, touched, rolls, shapes)
    return FeltSurface(local, sites, evidence, classification, gamma, warnings)


def _local(
    recording: TouchRecording,
    track: ContactTrack,
    model: str,
    gamma_per_m: float,
    site: int,
    roll: RollCurvature,
) -> LocalCurvature:
    tip = recording.fingertip
    samples = roll.samples[:: max(1, len(roll.samples) // CONTACT_POINTS)]
    discount = smearing_discount(
        tip, track.direction[samples], recording.pressure_pa[samples], track.threshold_pa
    )
    k, error = roll.curvature_per_m, roll.standard_error_per_m
    if model == "chapter":
        belief = chapter_belief(discount, k - 1 / tip.radius_m, tip.radius_m)
    else:
        belief = resolved_belief(discount, k, error, gamma_per_m)
    return LocalCurvature(site, roll.direction_rad, k, error, belief, roll.slip)


def _evidence(
    model: str,
    local: tuple[LocalCurvature, ...],
    shapes: list[ShapeOperator | None],
    missed: list[MissedSite],
    gamma_per_m: float,
) -> MassFunction:
    curvatures = [c.curvature_per_m for c in local]
    beliefs = [c.belief for c in local]
    sites = [c.site for c in local]
    if model == "chapter":
        means = primitive_beliefs(curvatures, beliefs, sites=sites, gamma_per_m=gamma_per_m)
        scale = max(sum(means.values()), 1.0)
        touched = [{(p,): b / scale for p, b in means.items()}] * len(shapes)
    else:
        touched = [
            site_evidence(
                shape,
                [k for k, site in zip(curvatures, sites, strict=True) if site == index],
                [b for b, site in zip(beliefs, sites, strict=True) if site == index],
                gamma_per_m,
            )
            for index, shape in enumerate(shapes)
        ]
    return evidence_from_sites(touched, [site.belief for site in missed])


def _warnings(
    recording: TouchRecording,
    touched: list[ContactSite],
    rolls: list[list[RollCurvature]],
    shapes: list[ShapeOperator | None],
) -> tuple[str, ...]:
    said: list[str] = []
    name = recording.name
    if not touched:
        said.append(f"{name}: the finger met nothing at all; check that it reached the surface")
    for index, (found, shape) in enumerate(zip(rolls, shapes, strict=True)):
        if not found:
            said.append(f"{name}: site {index} was touched but not rolled over; roll the finger further")
        elif shape is None:
            said.append(
                f"{name}: site {index} was rolled over in one direction only; two or more give k1 and k2"
            )
        worst = max((abs(roll.slip) for roll in found), default=0.0)
        if worst > MUCH_SLIP:
            said.append(
                f"{name}: at site {index} the joint's turn and the finger's way differ by {worst:.0%} (slip)"
            )
    return tuple(said)


def _site_json(site: FeltSite) -> dict[str, Any]:
    shape = site.shape
    return {
        "k1_per_m": site.k1_per_m,
        "k2_per_m": site.k2_per_m,
        "contact": site.contact,
        "position_m": site.position_m.tolist(),
        "normal": site.normal.tolist(),
        "k1_direction_rad": None if shape is None else shape.k1_direction_rad,
        "k1_standard_error_per_m": None if shape is None else shape.k1_error_per_m,
        "k2_standard_error_per_m": None if shape is None else shape.k2_error_per_m,
    }
