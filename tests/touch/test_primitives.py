import pytest

from evifuse.errors import UsageError
from evifuse.touch import primitive_beliefs, table_3_marks

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
