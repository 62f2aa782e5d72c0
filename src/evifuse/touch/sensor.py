"""The logical curvature sensor: a recording of a rolled finger in, belief over curvature primitives out."""

from evifuse.belief.mass import MassFunction
from evifuse.conductivity import KnowledgeBase, classify
from evifuse.knowledge import load_knowledge
from evifuse.recordings.recording import TouchRecording
from evifuse.touch.contact import ContactTrack, contact_track
from evifuse.touch.curvature import RollCurvature, ShapeOperator, measure_roll, shape_operator
from evifuse.touch.felt import FeltSite, FeltSurface, LocalCurvature
from evifuse.touch.joint import turned_by_joint
from evifuse.touch.missing import MissedSite, missed_sites
from evifuse.touch.primitives import (
    curvature_threshold_per_m,
    evidence_from_sites,
    primitive_beliefs,
    site_evidence,
)
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
    radius = recording.fingertip.radius_m
    gamma = curvature_threshold_per_m(radius)
    track = contact_track(recording)
    touched = find_sites(recording, track)
    turned = turned_by_joint(recording, track, touched)
    if turned is not None:
        recording, track = turned, contact_track(turned)
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
    if turned is not None:
        said = f"{recording.name}: the pose leaves out the joint's turn; it is taken from the joint angle"
        warnings = (said, *warnings)
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
    return LocalCurvature(site, roll.direction_rad, k, error, belief, roll.joint_curvature_per_m, roll.slip)


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
