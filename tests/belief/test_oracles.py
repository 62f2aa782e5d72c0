"""Agreement with other libraries on random mass functions. They are for development only."""

import numpy as np
import pytest
from hypothesis import given, settings

from evifuse.belief import MassFunction, conjunctive, dempster, discount, disjunctive, pcr5, pignistic
from tests.belief.strategies import dense, pairs

few = settings(max_examples=25, deadline=None)


def doubtful(two: tuple[MassFunction, MassFunction]) -> list[MassFunction]:
    return [discount(m, reliability=0.95) for m in two]


@few
@given(pairs())
def test_evtools(two: tuple[MassFunction, MassFunction]) -> None:
    evtools = pytest.importorskip("evtools")
    rules = pytest.importorskip("evtools.combinations")
    a, b = doubtful(two)
    names = list(a.frame.hypotheses)
    theirs = [evtools.DSVector.from_dense(names, dense(m)) for m in (a, b)]
    np.testing.assert_allclose(rules.crc(*theirs).dense, dense(conjunctive(a, b).mass), atol=1e-12)
    np.testing.assert_allclose(rules.drc(*theirs).dense, dense(disjunctive(a, b).mass), atol=1e-12)
    np.testing.assert_allclose(rules.dempster(*theirs).dense, dense(dempster(a, b).mass), atol=1e-9)
    np.testing.assert_allclose(theirs[0].to_betp(), pignistic(a), atol=1e-9)


@few
@given(pairs())
def test_py_dempster_shafer(two: tuple[MassFunction, MassFunction]) -> None:
    pyds = pytest.importorskip("pyds")
    a, b = doubtful(two)

    def theirs(m: MassFunction) -> object:
        sets = zip(m.focal_sets.tolist(), m.masses.tolist(), strict=True)
        return pyds.MassFunction({m.frame.names(s): v for s, v in sets if v > 0})

    def ours(found: object) -> np.ndarray:
        out = np.zeros(a.frame.full + 1)
        for subset, value in found.items():  # type: ignore[attr-defined]
            out[a.frame.mask(subset)] = value
        return out

    x, y = theirs(a), theirs(b)
    joint = x.combine_conjunctive(y)  # type: ignore[attr-defined]
    np.testing.assert_allclose(ours(joint), dense(dempster(a, b).mass), atol=1e-12)
    either = x.combine_disjunctive(y)  # type: ignore[attr-defined]
    np.testing.assert_allclose(ours(either), dense(disjunctive(a, b).mass), atol=1e-12)


@few
@given(pairs((2,)))
def test_torchbelief(two: tuple[MassFunction, MassFunction]) -> None:
    torch = pytest.importorskip("torch")
    torchbelief = pytest.importorskip("torchbelief")
    a, b = doubtful(two)
    frame = torchbelief.Frame(len(a.frame))
    x, y = (torch.from_numpy(dense(m)) for m in (a, b))
    np.testing.assert_allclose(torchbelief.dempster(x, y, frame)[0], dense(dempster(a, b).mass), atol=1e-9)
    np.testing.assert_allclose(torchbelief.pcr5(x, y, frame)[0], dense(pcr5(a, b).mass), atol=1e-9)
    np.testing.assert_allclose(torchbelief.disjunctive(x, y, frame), dense(disjunctive(a, b).mass), atol=1e-9)
