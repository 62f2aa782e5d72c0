"""Learned rivalry of shapes: laws of the model, what its features depend on, and what strangers get."""

import cv2
import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from evifuse.vision import PRIMITIVES, SeenObject, sense_shapes
from evifuse.vision.candidates import accounts_of, candidates_of
from evifuse.vision.features import features_of
from evifuse.vision.geometry import resample
from evifuse.vision.link import link_chains
from evifuse.vision.primitives import Fits, Outlines, Proposals, outlines_of, pattern_proposals
from evifuse.vision.rivalry import FAMILIES, FARTHEST, KNOWN, load_rivalry, pooled

MODEL = load_rivalry()
NUMBERS = st.floats(-50, 50)


def closed(polygon: np.ndarray) -> Outlines:
    points = resample(np.asarray(polygon, np.float64), 400)
    return outlines_of([link_chains((np.concatenate([points, points[:1]]),), True)])


def features(outlines: Outlines, scale: float = 1.0) -> dict[str, np.ndarray]:
    fits = Fits(outlines)
    return features_of(fits, accounts_of(fits, np.full((len(outlines.links), 96, 2), np.nan)), scale)


def regular(corners: int, radius: float = 60.0, turn: float = 0.3) -> np.ndarray:
    t = 2 * np.pi * np.arange(corners) / corners + turn
    return 100 + radius * np.column_stack([np.cos(t), np.sin(t)])


@given(hnp.arrays(np.float64, (5, len(MODEL.features)), elements=NUMBERS))
def test_shares_are_those_of_the_formula(rows: np.ndarray) -> None:
    shares, standing = MODEL.judge(dict(zip(MODEL.features, rows.T, strict=True)))
    for row, share, stands in zip(rows, shares, standing, strict=True):
        odds, sum_of_standing = MODEL.constants.copy(), 0.0
        for k in range(len(row)):
            away = min(max((row[k] - MODEL.mean[k]) / MODEL.spread[k], -FARTHEST), FARTHEST)
            odds += away * MODEL.families[k]
            sum_of_standing += away * MODEL.standing[k]
        expected = np.exp(odds - odds.max())
        np.testing.assert_allclose(share, expected / expected.sum(), atol=1e-12)
        assert stands == pytest.approx(sum_of_standing)
        assert share.sum() == pytest.approx(1.0)


@given(
    hnp.arrays(np.float64, (6, 3), elements=st.floats(0, 1)),
    hnp.arrays(np.float64, 6, elements=NUMBERS),
    hnp.arrays(np.bool_, (6, 6)),
    st.permutations(range(6)),
)
def test_pooled_shares_lie_between_those_of_the_outlines(
    shares: np.ndarray, standing: np.ndarray, together: np.ndarray, order: list[int]
) -> None:
    together |= np.eye(6, dtype=np.bool_)
    mean = pooled(shares, standing, together)
    for own, row in zip(mean, together, strict=True):
        assert (own >= shares[row].min(axis=0) - 1e-9).all()
        assert (own <= shares[row].max(axis=0) + 1e-9).all()
    np.testing.assert_allclose(pooled(shares, standing, np.eye(6, dtype=np.bool_)), shares)
    again = pooled(shares[order], standing[order], together[:, order])
    np.testing.assert_allclose(again, mean, atol=1e-9)


def test_the_outline_that_stands_out_is_believed() -> None:
    mean = pooled(np.eye(2), np.array([0.0, np.log(3.0)]), np.ones((1, 2), np.bool_))
    np.testing.assert_allclose(mean, [[0.25, 0.75]])


def test_the_file_says_what_it_is_and_names_features_that_there_are() -> None:
    from importlib.resources import files

    text = files("evifuse.knowledge").joinpath("rivalry.yaml").read_text(encoding="utf-8")
    table = yaml.safe_load(text)
    assert "CC BY 4.0" in table["source"]
    assert "German Traffic Sign" in table["source"]
    assert tuple(table["families"]) == FAMILIES
    assert set(table["features"]) == set(features(closed(regular(5))))
    assert all(len(row) == 3 + len(FAMILIES) for row in table["features"].values())
    assert (MODEL.spread > 0).all()


@pytest.mark.parametrize("corners", [3, 4, 6, 40])
def test_features_do_not_depend_on_place_size_or_which_way_round(corners: int) -> None:
    polygon = regular(corners) * [1.0, 0.8]
    outlines = closed(polygon)
    plain = features(outlines)
    assert all(np.isfinite(v).all() for v in plain.values())
    turned = features(closed(polygon @ np.array([[0.6, 0.8], [-0.8, 0.6]]) + 40.0))
    reverse = features(closed(polygon[::-1]))
    for name, value in plain.items():
        assert reverse[name] == pytest.approx(value, abs=0.15), name
        assert turned[name] == pytest.approx(value, abs=0.15), name
    smaller = features(outlines, scale=2.0)
    assert smaller.pop("width") == pytest.approx(plain["width"] - np.log(2.0))
    assert all((smaller[name] == plain[name]).all() for name in smaller)


@given(hnp.arrays(np.float64, (12, 2), elements=st.floats(0, 200)))
def test_features_of_any_outline_are_finite(corners: np.ndarray) -> None:
    if np.ptp(corners, axis=0).min() < 20:
        corners = corners + regular(12)
    assert all(np.isfinite(v).all() for v in features(closed(corners)).values())


@pytest.mark.parametrize(("corners", "family"), [(3, "triangle"), (4, "quadrilateral"), (60, "ellipse")])
def test_regular_outlines_are_what_they_are(corners: int, family: str) -> None:
    shares, _ = MODEL.judge(features(closed(regular(corners))))
    assert FAMILIES[int(shares[0].argmax())] == family
    assert shares[0].max() > 0.8


def drawn(polygon: np.ndarray) -> SeenObject:
    image = np.full((240, 240), 230, np.uint8)
    whole = [np.round(polygon).astype(np.int32)]
    cv2.polylines(image, whole, True, 40, 5, cv2.LINE_AA)
    return sense_shapes(image)[0]


def doubt(seen: SeenObject) -> float:
    return seen.evidence.as_dict()["frame"]


def test_strangers_keep_more_on_the_frame_than_any_primitive() -> None:
    known = [regular(3), regular(4), regular(60), regular(60) * [1.4, 0.8]]
    house = np.array([[60, 190], [60, 110], [115, 50], [170, 110], [170, 190]])
    strangers = [regular(5), regular(6), regular(8), house]
    most = max(doubt(drawn(p)) for p in known)
    assert most < 0.3
    assert all(doubt(drawn(p)) > max(0.5, most) for p in strangers)


def test_smooth_noise_is_met_with_ignorance() -> None:
    rng = np.random.default_rng(5)
    doubts: list[float] = []
    for blur in (2.0, 4.0, 8.0):
        smooth = cv2.GaussianBlur(rng.normal(0, 1, (240, 320)), (0, 0), blur)
        image = np.clip(128 + 40 * smooth / smooth.std(), 0, 255).astype(np.uint8)
        doubts += [doubt(s) for s in sense_shapes(image)]
    assert np.median(doubts) > 0.8


def test_a_new_family_takes_from_the_stranger_only() -> None:
    def five_sided(fits: Fits) -> Proposals:
        five = fits.polygon(5)
        return pattern_proposals("pentagon", five, np.ones(len(five.found)))

    for corners in (5, 60):
        outlines = closed(regular(corners))
        strokes = np.full((1, 96, 2), np.nan)
        plain = candidates_of(outlines, 1.0, strokes)
        more = candidates_of(outlines, 1.0, strokes, {**PRIMITIVES, "pentagon": five_sided})
        for family in KNOWN:
            np.testing.assert_array_equal(plain.shares[family], more.shares[family])
        stranger = plain.own[0, FAMILIES.index("stranger")]
        assert more.shares["pentagon"][0] <= stranger + 1e-12
        if corners == 5:
            assert more.shares["pentagon"][0] > 0.5 * stranger


def test_members_share_what_their_family_has() -> None:
    seen = candidates_of(closed(regular(4)), 1.0, np.full((1, 96, 2), np.nan))
    four = [h for h in seen.hypotheses(0) if h.kind in ("rectangle", "square")]
    assert sum(h.belief for h in four) == pytest.approx(seen.shares["quadrilateral"][0])
    assert all({"share", "part", "pattern"} <= set(h.terms) for h in four)
