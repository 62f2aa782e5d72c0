import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evifuse.belief import belief
from evifuse.errors import UsageError
from evifuse.touch import (
    CURVATURE_FRAME,
    PRIMITIVES,
    ShapeOperator,
    evidence_from_sites,
    primitive_beliefs,
    site_evidence,
    table_3_marks,
)

CURVATURES = [0.2, 0.1, 0.8, 0.1, 0.0, 1.0, 0.2, -1.0]
BELIEFS = [0.15, 0.07, 0.56, 0.08, 0.00, 0.67, 0.20, 0.67]
SITES = [1, 1, 1, 1, 2, 2, 2, 2]
MARKS = [
    "P C+", "P C+", "C+", "P C+",
    "P C- C+ H", "C+ H", "P C- C+", "C- H",
]  # fmt: skip


def test_table_5_averages_the_printed_marks():
    means = primitive_beliefs(CURVATURES, BELIEFS, [row.split() for row in MARKS])
    assert means["P"] == pytest.approx(0.10)
    assert means["C-"] == pytest.approx(0.29)
    assert means["C+"] == pytest.approx(0.247, abs=5e-4)
    assert means["H"] == pytest.approx(0.447, abs=5e-4)
    assert means["E-"] == means["E+"] == 0.0


def test_table_3_gives_all_printed_marks_but_one():
    marks = table_3_marks(CURVATURES, SITES, gamma_per_m=0.2)
    printed = [set(row.split()) for row in MARKS]
    differing = [(i, set(row) ^ other) for i, (row, other) in enumerate(zip(marks, printed, strict=True))]
    assert [d for d in differing if d[1]] == [(6, {"H"})]


def test_a_mark_that_is_no_primitive_is_named():
    with pytest.raises(UsageError, match="'S' is not a curvature primitive"):
        primitive_beliefs([0.1], [0.5], [["S"]])
    with pytest.raises(UsageError, match="1 curvatures, 2 beliefs"):
        primitive_beliefs([0.1], [0.5, 0.5], [["P"]])


TRUE = {"P": (0, 0), "C-": (0, -40), "C+": (40, 0), "H": (40, -40), "E-": (-40, -40), "E+": (40, 40)}


@pytest.mark.parametrize(("primitive", "k"), TRUE.items())
def test_sharp_principal_curvatures_give_their_primitive_alone(primitive, k):
    angles = np.arange(4) * np.pi / 4
    local = [k[0] * np.cos(a) ** 2 + k[1] * np.sin(a) ** 2 for a in angles]
    masses = site_evidence(ShapeOperator(*k, 0.2, 0.2, 0.0), local, [0.8] * 4, 5.0)
    assert masses[(primitive,)] == pytest.approx(0.8)
    assert sum(masses.values()) == pytest.approx(0.8)


def test_a_curvature_at_the_threshold_is_shared_between_two_primitives():
    masses = site_evidence(ShapeOperator(0.0, -5.0, 0.2, 0.2, 0.0), [0.0], [1.0], 5.0)
    assert masses[("P",)] == pytest.approx(0.5, abs=1e-6)
    assert masses[("C-",)] == pytest.approx(0.5, abs=1e-6)


def test_one_direction_supports_the_set_of_primitives_that_have_it():
    assert site_evidence(None, [-30.0], [0.7], 5.0) == {("C-", "H", "E-"): 0.7}
    assert site_evidence(None, [0.0], [0.7], 5.0) == {("P", "C-", "C+", "H"): 0.7}


@given(
    k=st.tuples(st.floats(-99, 99), st.floats(-99, 99)),
    errors=st.tuples(st.floats(0, 99), st.floats(0, 99)),
    local=st.lists(st.tuples(st.floats(-99, 99), st.floats(0, 1)), min_size=1, max_size=6),
    missed=st.lists(st.floats(0, 1), max_size=3),
    known=st.booleans(),
)
def test_evidence_is_a_mass_function_whatever_was_felt(k, errors, local, missed, known):
    shape = ShapeOperator(max(k), min(k), *errors, 0.0) if known else None
    masses = site_evidence(shape, [c for c, _ in local], [b for _, b in local], 5.0)
    assert sum(masses.values()) <= 1 + 1e-12
    evidence = evidence_from_sites([masses], missed)
    assert evidence.masses.sum() == pytest.approx(1.0)
    assert float(belief(evidence, "N")) == pytest.approx(sum(missed) / (1 + len(missed)))


def test_sites_weigh_the_same_and_no_sites_are_ignorance():
    evidence = evidence_from_sites([{("P",): 0.9}, {}], [1.0, 1.0])
    assert evidence.as_dict() == pytest.approx({"N": 0.5, "P": 0.225, "frame": 0.275})
    assert evidence_from_sites([], []).as_dict() == {"frame": 1.0}
    assert CURVATURE_FRAME.hypotheses == (*PRIMITIVES, "N")
