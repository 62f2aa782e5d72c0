"""The logical curvature sensor: a recording of a rolled finger in, belief over curvature primitives out."""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from evifuse.belief import MassFunction, on_frame
from evifuse.conductivity import Classification, CompiledClassifier, KnowledgeBase, classify
from evifuse.conductivity import compile as compile_knowledge
from evifuse.errors import KnowledgeError
from evifuse.knowledge import load_knowledge
from evifuse.recordings.recording import TouchRecording
from evifuse.touch.as_sphere import as_sphere, guided
from evifuse.touch.coarse import with_spacing_error
from evifuse.touch.contact import ContactTrack, contact_track
from evifuse.touch.curvature import (
    NARROWEST_RAD,
    RollCurvature,
    ShapeOperator,
    along,
    measure_roll,
    spread_rad,
)
from evifuse.touch.edges import Edge, beside_edges, contradicted, find_edge
from evifuse.touch.evidence import evidence_from_sites, site_evidence
from evifuse.touch.felt import FeltSite, FeltSurface, LocalCurvature, OneDirection
from evifuse.touch.fingersurface import SphereSurface, surface_of
from evifuse.touch.joint import turned_by_joint
from evifuse.touch.mended import mended
from evifuse.touch.missing import missed_sites
from evifuse.touch.primitives import curvature_threshold_per_m, primitive_beliefs
from evifuse.touch.reliance import contact_quality, reliance, resolution
from evifuse.touch.site_shape import site_shape
from evifuse.touch.sites import ContactSite, find_sites
from evifuse.touch.smearing import chapter_belief, check_belief_model, resolved_belief, smearing_discount

__all__ = ["sense_curvature"]

CONTACT_POINTS = 128
"""How many contact points of a roll the smearing is averaged over, about."""
MUCH_SLIP = 0.1
"""A roll that slips by more than this share of its turn is reported."""


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
    recording, repairs = mended(recording)
    radius = recording.fingertip.radius_m
    gamma = curvature_threshold_per_m(radius)
    guide, track = guided(recording, contact_track(recording))
    touched = find_sites(guide, track)
    turned = turned_by_joint(recording, track, touched)
    if turned is not None:
        recording = turned
        guide, track = guided(turned, contact_track(turned))
        touched = find_sites(guide, track)
    ball = isinstance(surface_of(recording.fingertip), SphereSurface)
    recording, track, touched = as_sphere(recording, guide, track, touched)
    measured = [[measure_roll(recording, track, site, roll) for roll in site.rolls] for site in touched]
    if not ball:  # how far another finger would have to turn depends on where it touches
        measured = [[replace(roll, slip=float("nan")) for roll in found] for found in measured]
    rolls = [[roll for roll in found if np.isfinite(roll.curvature_per_m)] for found in measured]
    shapes = [site_shape(recording, track, site) for site in touched]
    if model == "resolved":
        rolls = [
            [along(roll, s) if s else with_spacing_error(recording, track, site, roll) for roll in found]
            for found, s, site in zip(rolls, shapes, touched, strict=True)
        ]
    missed = missed_sites(recording, track.touching, touched, shapes)
    edges = [find_edge(recording, track, site) for site in touched]
    edges = [
        None if edge is None or contradicted(edge, shape, radius) else edge
        for edge, shape in zip(edges, shapes, strict=True)
    ]
    if model == "chapter":
        local = _local_by_the_chapter(recording, track, rolls)
        masses = _masses_by_the_chapter(local, len(touched), gamma)
    else:
        relied = [
            0.0 if edge or (beside and not shape) else _relied_on(recording, track, found, shape, gamma)
            for found, shape, edge, beside in zip(
                rolls, shapes, edges, beside_edges(touched, edges, radius), strict=True
            )
        ]
        local = _local(rolls, relied, gamma)
        masses = [site_evidence(*of, gamma) for of in zip(shapes, rolls, relied, strict=True)]
    evidence = evidence_from_sites(masses, [site.belief for site in missed])
    sites = tuple(
        FeltSite(
            site.centre_m - radius * site.normal,
            site.normal,
            True,
            shape if edge is None else None,
            evidence_from_sites([own], []),
            edge,
            _only(found) if edge is None and shape is None else None,
        )
        for site, shape, own, edge, found in zip(touched, shapes, masses, edges, rolls, strict=True)
    ) + tuple(
        FeltSite(site.position_m, site.normal, False, None, evidence_from_sites([], [site.belief]))
        for site in missed
    )
    classification = _classified(evidence, knowledge)
    warnings = _warnings(recording, touched, rolls, shapes, edges)
    if turned is not None:
        said = f"{recording.name}: the pose leaves out the joint's turn; it is taken from the joint angle"
        warnings = (said, *warnings)
    warnings = (*repairs, *warnings)
    return FeltSurface(local, sites, evidence, classification, gamma, warnings)


def _classified(evidence: MassFunction, knowledge: KnowledgeBase) -> Classification:
    """The evidence's classes, as `classify` gives them, with what doesn't depend on the masses kept."""
    known = on_frame(evidence.to("shared"), knowledge.frame)
    try:
        compiled = _compiled(knowledge, tuple(known.focal_sets.tolist()))
    except KnowledgeError:  # a reading that has no matrices
        return classify(evidence, knowledge)
    return compiled.classify(known.masses)


@lru_cache(maxsize=64)
def _compiled(knowledge: KnowledgeBase, focal_sets: tuple[int, ...]) -> CompiledClassifier:
    """The knowledge base made ready for evidence on these focal sets."""
    return compile_knowledge(knowledge, np.array(focal_sets, dtype=np.int64))


def _relied_on(
    recording: TouchRecording,
    track: ContactTrack,
    rolls: list[RollCurvature],
    shape: ShapeOperator | None,
    gamma_per_m: float,
) -> float:
    """How far the estimate of a site is relied on."""
    if not rolls:
        return 0.0
    samples = np.concatenate([roll.samples for roll in rolls])
    slips = [roll.slip for roll in rolls if np.isfinite(roll.slip)]  # none without a joint angle
    terms = contact_quality(recording, track, samples, float(np.median(slips)) if slips else 0.0)
    return reliance(terms | {"unresolved": resolution(shape, rolls, gamma_per_m)})


def _only(rolls: list[RollCurvature]) -> OneDirection | None:
    """What rolls in one direction say together: their mean, weighted by their errors."""
    if not rolls or spread_rad([roll.direction_rad for roll in rolls]) >= NARROWEST_RAD:
        return None
    weight = np.array([max(roll.standard_error_per_m, 1e-9) ** -2 for roll in rolls])
    curvature = float(weight @ np.array([roll.curvature_per_m for roll in rolls]) / weight.sum())
    doubled = weight @ np.exp(2j * np.array([roll.direction_rad for roll in rolls]))  # lines have no sense
    return OneDirection(float(0.5 * np.angle(doubled) % np.pi), curvature, float(weight.sum() ** -0.5))


def _local(
    rolls: list[list[RollCurvature]], relied: list[float], gamma_per_m: float
) -> tuple[LocalCurvature, ...]:
    return tuple(
        _as_local(
            index,
            roll,
            resolved_belief(share, roll.curvature_per_m, roll.standard_error_per_m, gamma_per_m),
        )
        for index, (found, share) in enumerate(zip(rolls, relied, strict=True))
        for roll in found
    )


def _local_by_the_chapter(
    recording: TouchRecording, track: ContactTrack, rolls: list[list[RollCurvature]]
) -> tuple[LocalCurvature, ...]:
    tip = recording.fingertip
    local: list[LocalCurvature] = []
    for index, found in enumerate(rolls):
        for roll in found:
            some = roll.samples[:: max(1, len(roll.samples) // CONTACT_POINTS)]
            discount = smearing_discount(
                tip, track.direction[some], recording.pressure_pa[some], track.threshold_pa
            )
            cone = roll.curvature_per_m - 1 / tip.radius_m
            local.append(_as_local(index, roll, chapter_belief(discount, cone, tip.radius_m)))
    return tuple(local)


def _as_local(site: int, roll: RollCurvature, belief: float) -> LocalCurvature:
    k, error = roll.curvature_per_m, roll.standard_error_per_m
    return LocalCurvature(site, roll.direction_rad, k, error, belief, roll.joint_curvature_per_m, roll.slip)


def _masses_by_the_chapter(
    local: tuple[LocalCurvature, ...], sites: int, gamma_per_m: float
) -> list[dict[tuple[str, ...], float]]:
    """The averages of table 5, over all sites: each site gets the same."""
    means = primitive_beliefs(
        [c.curvature_per_m for c in local],
        [c.belief for c in local],
        sites=[c.site for c in local],
        gamma_per_m=gamma_per_m,
    )
    scale = max(sum(means.values()), 1.0)
    return [{(p,): b / scale for p, b in means.items()}] * sites


def _warnings(
    recording: TouchRecording,
    touched: list[ContactSite],
    rolls: list[list[RollCurvature]],
    shapes: list[ShapeOperator | None],
    edges: list[Edge | None],
) -> tuple[str, ...]:
    said: list[str] = list(recording.notes)
    name = recording.name
    if not touched:
        said.append(f"{name}: the finger met nothing at all; check that it reached the surface")
    for index, (found, shape, edge) in enumerate(zip(rolls, shapes, edges, strict=True)):
        if edge is not None:
            said.append(f"{name}: site {index} is {edge}; it has no curvature")
            continue
        if not found:
            said.append(f"{name}: site {index} was touched but not rolled over; roll the finger further")
        elif shape is None:
            only = _only(found)
            what = "in several directions, but k1 and k2 could not be fitted: roll it again"
            if only is not None:
                what = f"in one direction only, {only}: roll across it too"
            said.append(f"{name}: site {index} was rolled over {what}")
        worst = max((abs(roll.slip) for roll in found if np.isfinite(roll.slip)), default=0.0)
        if worst > MUCH_SLIP:
            said.append(
                f"{name}: at site {index} the joint's turn and the finger's way differ by {worst:.0%} (slip)"
            )
    return tuple(said)
