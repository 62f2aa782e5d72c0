"""The numbered examples run and print what their texts promise."""

import runpy
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("[0-9]*.py"))
PROMISES = {
    "01_belief.py": ["rectangle: bel 0.60, pl 1.00"],
    "02_conductivity.py": ["decision:     triangular", "elliptical/E_2: weak"],
    "03_fusion.py": ["truth:      curved", "decision:   curved"],
    "04_classifiers.py": ["discounted and fused: 0.8", "source 2 of 3 is broken"],
    "05_training.py": ["lower is broken: conductivity  0.4", "read back the same: True"],
    "06_pentagon.py": ["pentagonal {'pentagon': 0.", "elliptical {'ellipse': 0."],
    "07_detector.py": [") rectangular {", ") elliptical {", ") triangular {"],
    "08_fingertip.py": ["radii there 6.4 and 14.4 mm", "their neighbours do: dead", "k2 = -50 +-"],
}


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.name)
def test_example(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    runpy.run_path(str(path), run_name="__main__")
    printed = capsys.readouterr().out
    for promise in PROMISES[path.name]:
        assert promise in printed


def test_a_primitive_takes_thirty_lines() -> None:
    """As the example and the documentation say: lines of code, without blank ones and the text at the top."""
    text = next(p for p in EXAMPLES if p.name == "06_pentagon.py").read_text(encoding="utf-8")
    code = text.split('"""', 2)[2]
    assert len([line for line in code.splitlines() if line.strip()]) <= 30


def test_there_are_three_at_least() -> None:
    assert len(EXAMPLES) >= 3
