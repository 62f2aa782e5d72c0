import copy
import pickle

import pytest

from evifuse.belief import MAX_HYPOTHESES, Frame
from evifuse.errors import FrameError, InputError


def test_equal_frames_are_equal_whoever_built_them() -> None:
    a, b = Frame(["x", "y"]), Frame(name for name in "xy")
    assert a == b
    assert hash(a) == hash(b)
    assert a != Frame(["y", "x"])
    assert pickle.loads(pickle.dumps(a)) == copy.deepcopy(a) == b


def test_masks_and_names_go_both_ways() -> None:
    frame = Frame(["x", "y", "z"])
    for mask in range(1, 8):
        assert frame.mask(frame.names(mask)) == mask
        assert frame.mask(mask) == mask
    assert frame.label(5) == "x|z"
    assert frame.label(7) == "frame"
    assert frame.label(0) == "∅"
    assert Frame(["only"]).label(1) == "only"
    assert str(frame) == "{x, y, z}"


@pytest.mark.parametrize(
    ("make", "names"),
    [
        (lambda: Frame("xyz"), "'xyz'"),
        (lambda: Frame([]), "not 0"),
        (lambda: Frame([str(i) for i in range(MAX_HYPOTHESES + 1)]), "not 63"),
        (lambda: Frame(["x", "y", "x"]), "'x'"),
        (lambda: Frame(["x", ""]), "''"),
        (lambda: Frame(["x", 3]), "3"),  # type: ignore[list-item]
        (lambda: Frame(["x"], {"z": ["a"]}), "'z'"),
        (lambda: Frame(["x"], {"x": "ab"}), "'x'"),
        (lambda: Frame(["x"]).mask("w"), "'w'"),
        (lambda: Frame(["x", "y"]).mask(["x", "w"]), "'w'"),
        (lambda: Frame(["x", "y"]).mask(4), "0x4"),
        (lambda: Frame(["x", "y"]).mask(-1), "-0x1"),
        (lambda: Frame(["x", "y"]).mask(Frame(["x"])), "{x}"),
    ],
)
def test_errors_name_the_offender(make, names: str) -> None:
    with pytest.raises(FrameError) as caught:
        make()
    assert names in str(caught.value)
    assert "\n" not in str(caught.value)
    assert isinstance(caught.value, InputError)


def test_the_largest_frame_works() -> None:
    frame = Frame([f"h{i}" for i in range(MAX_HYPOTHESES)])
    assert frame.full == 2**MAX_HYPOTHESES - 1
    assert frame.mask(f"h{MAX_HYPOTHESES - 1}") == 2 ** (MAX_HYPOTHESES - 1)
