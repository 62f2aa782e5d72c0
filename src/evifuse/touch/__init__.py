"""The logical curvature sensor: a rolled finger in, belief over curvature primitives out (section 4)."""

from evifuse.touch.contact import ContactTrack, contact_track
from evifuse.touch.curvature import RollCurvature, ShapeOperator, measure_roll, shape_operator
from evifuse.touch.edges import Edge, find_edge
from evifuse.touch.evidence import evidence_from_sites, site_evidence
from evifuse.touch.felt import FeltSite, FeltSurface, LocalCurvature
from evifuse.touch.fingersurface import FingerSurface, surface_of
from evifuse.touch.fingertip import spherical_fingertip, taxel_areas, taxel_coverage, taxel_pitch_m
from evifuse.touch.health import FingertipHealth, health
from evifuse.touch.layouts import load_fingertip
from evifuse.touch.leak import point_spread_m
from evifuse.touch.mended import mended
from evifuse.touch.missing import MissedSite, missed_sites
from evifuse.touch.online import CurvatureTracker, TrackedSite, Tracking
from evifuse.touch.primitives import (
    CURVATURE_FRAME,
    NO_CONTACT,
    PRIMITIVES,
    curvature_threshold_per_m,
    primitive_beliefs,
    table_3_marks,
)
from evifuse.touch.reliance import contact_quality, reliance
from evifuse.touch.resolved import primitive_probabilities
from evifuse.touch.sensor import sense_curvature
from evifuse.touch.site_shape import site_shape
from evifuse.touch.sites import ContactSite, find_sites
from evifuse.touch.smearing import (
    BELIEF_MODELS,
    chapter_belief,
    class_probabilities,
    resolved_belief,
    smearing_discount,
)

__all__ = [
    "BELIEF_MODELS",
    "CURVATURE_FRAME",
    "NO_CONTACT",
    "PRIMITIVES",
    "ContactSite",
    "ContactTrack",
    "CurvatureTracker",
    "Edge",
    "FeltSite",
    "FeltSurface",
    "FingerSurface",
    "FingertipHealth",
    "LocalCurvature",
    "MissedSite",
    "RollCurvature",
    "ShapeOperator",
    "TrackedSite",
    "Tracking",
    "chapter_belief",
    "class_probabilities",
    "contact_quality",
    "contact_track",
    "curvature_threshold_per_m",
    "evidence_from_sites",
    "find_edge",
    "find_sites",
    "health",
    "load_fingertip",
    "measure_roll",
    "mended",
    "missed_sites",
    "point_spread_m",
    "primitive_beliefs",
    "primitive_probabilities",
    "reliance",
    "resolved_belief",
    "sense_curvature",
    "shape_operator",
    "site_evidence",
    "site_shape",
    "smearing_discount",
    "spherical_fingertip",
    "surface_of",
    "table_3_marks",
    "taxel_areas",
    "taxel_coverage",
    "taxel_pitch_m",
]
