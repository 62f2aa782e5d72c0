import pytest

from evifuse.app.reproduce import _figures, reproduce


def test_every_published_figure_is_there() -> None:
    figures = reproduce()
    assert len(figures) == 28
    assert len({f.name for f in figures}) == len(figures)
    assert all(f.why and "\n" not in f.why for f in figures)


def test_a_figure_reproduces_only_if_it_equals_the_print_to_the_digit() -> None:
    for f in reproduce():
        equal = round(f.computed + 1e-12, 2) == f.published
        assert (f.status == "reproduces") == equal, f


def test_what_reproduces_and_what_does_not() -> None:
    status = {f.name: f.status for f in reproduce()}
    counts = {s: list(status.values()).count(s) for s in set(status.values())}
    assert counts == {"reproduces": 18, "ranking reproduces": 6, "does not follow from the print": 4}
    for name in ("rectangle", "square", "triangle", "frame"):
        assert status[f"3.4 belief of shape primitives: {name}"] == "reproduces"
    assert status["5.2 curvature from shape: quasiplanar"] == "does not follow from the print"
    assert status["Table 5 belief of curvature primitives: P"] == "reproduces"


def test_the_status_follows_the_figures() -> None:
    wrong = _figures("x", {"a": 0.5, "b": 0.1}, {"a": 0.2, "b": 0.3}, "how", "because")
    assert [f.status for f in wrong] == ["does not follow from the print"] * 2
    ranked = _figures("x", {"a": 0.5, "b": 0.1}, {"a": 0.7, "b": 0.1}, "how", "because")
    assert [(f.status, f.why) for f in ranked] == [("ranking reproduces", "because"), ("reproduces", "how")]
    assert ranked[0].computed == pytest.approx(0.7)
