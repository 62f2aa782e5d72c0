import pytest
from hypothesis import given
from hypothesis import strategies as st

from evifuse.fusion import curvature_from_shape, total_conductivity
from evifuse.knowledge import load_knowledge, parse_knowledge

TABLE_4 = load_knowledge("chapter-curvature")
sigmas = st.fixed_dictionaries({k: st.floats(0, 2) for k in ("rectangular", "triangular", "elliptical")})


@given(sigmas)
def test_table_4_by_hand(s: dict[str, float]) -> None:
    """Section 5.2 written out for table 4: products within a focal set, maximum over focal sets."""
    r, t, e = s["rectangular"], s["triangular"], s["elliptical"]
    found = curvature_from_shape(s, TABLE_4)
    assert found["quasiplanar"] == pytest.approx(max(r, r * t))
    assert found["curved"] == pytest.approx(max(r * t, e))
    assert found["occluded"] == 0


@given(sigmas, st.floats(0, 1))
def test_focal_sets_with_n_need_no_contact(s: dict[str, float], n: float) -> None:
    found = curvature_from_shape(s, TABLE_4, no_contact=n)
    expected = n * max(s["rectangular"] * s["triangular"], s["elliptical"])
    assert found["occluded"] == pytest.approx(expected)
    assert found["curved"] == curvature_from_shape(s, TABLE_4)["curved"]


def test_frame_and_sets_without_a_shape_are_left_out() -> None:
    text = "frame: {R: rectangle, P: P}\nclasses: {a: {A: {P: 0.5, frame: 0.5}}, b: {B: {R P: 1}}}"
    text = text.replace("R P: 1", "R: 1")
    found = curvature_from_shape({"rectangular": 0.5}, parse_knowledge(text))
    assert found == {"a": 0.0, "b": 0.5}


def test_sum_over_any_number_of_senses() -> None:
    assert total_conductivity({"a": 1.0}, {"a": 0.5, "b": 2.0}, {"b": 0.5}) == {"a": 1.5, "b": 2.5}
    assert total_conductivity() == {}
