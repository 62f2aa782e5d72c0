"""`evifuse readings` as a user meets it: tables, JSON, the files it takes and those it refuses."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from evifuse.app import readings as command
from evifuse.app.main import main
from evifuse.app.published import named_readings, published_examples
from evifuse.app.reproduce import reproduce
from evifuse.belief import MassFunction
from evifuse.belief.files import to_parquet
from evifuse.conductivity import READINGS, Reading
from evifuse.conductivity.sweep import OUR_CHOICES, PRINT_CHOICES, grid, try_reading
from evifuse.knowledge import built_in_text, load_knowledge

pyarrow = pytest.importorskip("pyarrow")
from pyarrow import parquet  # noqa: E402

Run = Callable[..., tuple[int, str, str]]
SHAPE = load_knowledge("shape").frame
LEANS = {"rectangular": 0, "triangular": 2, "elliptical": 3}


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    def call(*arguments: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as stopped:
            main(["readings", *map(str, arguments)])
        out, err = capsys.readouterr()
        assert isinstance(stopped.value.code, int)
        return stopped.value.code, out, err

    return call


def write(path: Path, labels: list[Any] | None, count: int = 60, column: str = "label") -> Path:
    """Evidence that leans to a primitive of each class in turn."""
    rng = np.random.default_rng(0)
    lean = np.full((count, 5), 0.5)
    lean[np.arange(count), [list(LEANS.values())[i % 3] for i in range(count)]] += 2.0
    masses = np.stack([rng.dirichlet(row) for row in lean])
    evidence = MassFunction(SHAPE, ["rectangle", "square", "triangle", "ellipse", SHAPE], masses)
    to_parquet(evidence, path)
    if labels is not None:
        table = parquet.read_table(path)
        parquet.write_table(table.append_column(column, pyarrow.array(labels)), path)
    return path


def right_labels(count: int = 60) -> list[str]:
    return [list(LEANS)[i % 3] for i in range(count)]


@pytest.fixture
def small_grids(monkeypatch: pytest.MonkeyPatch) -> None:
    """A sweep of a few readings, so that it is over soon."""
    monkeypatch.setattr(
        command, "PRINT_CHOICES", {"similarity_offset": (0.0, 0.25, 0.5), "ties": ("mean", "first")}
    )
    monkeypatch.setattr(command, "OUR_CHOICES", {"pooling": ("sum", "max"), "projection": (True, False)})


def test_published_figures_and_pure_cases(run: Run) -> None:
    code, out, err = run("--json")
    assert (code, err) == (0, "")
    found = json.loads(out)
    assert [f["published"] for f in found["figures"]] == [0.48, 1.46, 0.0, 1.30, 0.0, 0.0]
    computed = {f.name: f.computed for f in reproduce()}
    sound = found["readings"]["sound"]
    assert sound["computed"] == pytest.approx([computed[f["name"]] for f in found["figures"]])
    assert sound["largest_gap"] == pytest.approx(
        max(abs(c - f["published"]) for c, f in zip(sound["computed"], found["figures"], strict=True))
    )
    assert sound["ranking"]
    assert not found["readings"]["printed"]["ranking"]
    assert "sweep" not in found
    rows = {(r["knowledge"], r["reading"]): r for r in found["recognised"]}
    assert len(rows) == 4 * len(named_readings())
    assert rows["shape", "working"]["pure"] == [66, 66]
    assert rows["curvature", "working"]["pure"] == [77, 77]
    assert rows["chapter-shape", "sound"]["pure"][0] < 66
    assert rows["shape", "working"]["prototypes"] == [8, 8]


def test_the_tables_show_the_same(run: Run) -> None:
    code, out, _ = run()
    assert code == 0
    lines = out.splitlines()
    published = next(line.split() for line in lines if line.startswith("published"))
    assert published[1:] == ["0.48", "1.46", "0.00", "1.30", "0.00", "0.00"]
    sound = next(line.split() for line in lines if line.startswith("sound"))
    assert sound[1:3] == ["0.91", "1.62"]
    assert sound[-1] == "yes"
    assert max(len(line.rstrip()) for line in lines) <= 160


def test_a_knowledge_base_of_ones_own(run: Run, tmp_path: Path) -> None:
    own = tmp_path / "mine.yaml"
    own.write_text(
        re.sub(r"reading:\n(  .*\n)+", "reading: {pooling: mean, log_base: 2}\n", built_in_text("shape"))
    )
    code, out, _ = run("--knowledge", own, "--json")
    assert code == 0
    found = json.loads(out)
    assert found["readings"]["own"]["differs"] == "log_base=2, pooling=mean"
    assert {r["knowledge"] for r in found["recognised"]} == {str(own)}
    other = tmp_path / "animals.yaml"
    other.write_text(
        "frame: {d: dog, c: cat}\nclasses:\n  pet: {one: {d: 0.6, frame: 0.4}}\n  none: {two: {c: 1.0}}\n"
    )
    code, out, _ = run("--knowledge", other)
    assert code == 0
    assert "Pure cases" not in out
    assert "decided for their own class" in out


@pytest.mark.usefixtures("small_grids")
def test_a_sweep_counts_what_it_tried(run: Run) -> None:
    code, out, _ = run("--sweep", "--json")
    assert code == 0
    printed, ours = json.loads(out)["sweep"]
    assert (printed["tried"], ours["tried"]) == (6, 4)
    examples = published_examples()
    tried = [try_reading(r, examples) for r in grid(command.PRINT_CHOICES)]
    assert printed["ranking"] == sum(o.ranked for o in tried)
    assert printed["undefined"] == sum(not np.isfinite(o.gap) for o in tried)
    gaps = [o["largest_gap"] for o in printed["nearest"] if o["largest_gap"] is not None]
    assert gaps == sorted(gaps)
    assert gaps[0] == pytest.approx(min(o.gap for o in tried))
    code, out, _ = run("--sweep")
    assert "6 readings" in out
    assert f"{printed['ranking']} give the published ranking" in out


def test_labelled_evidence_says_which_reading_to_take(run: Run, tmp_path: Path) -> None:
    file = write(tmp_path / "e.parquet", right_labels())
    code, out, err = run("--knowledge", "shape", "--evidence", file, "--json")
    assert (code, err) == (0, "")
    found = json.loads(out)
    assert found["choosing"] + found["held_out"] == 60
    judged = {j["name"]: j for j in found["judged"]}
    chosen = found["chosen"]
    assert judged[chosen]["chosen_on"] == max(j["chosen_on"] for j in found["judged"])
    assert judged["working"]["accuracy"] > 0.7 > judged["sound"]["accuracy"]
    low, high = judged["working"]["interval"]
    assert 0 < low < judged["working"]["accuracy"] < high <= 1
    assert found["diagnosis"]["cases"] == 60
    assert found["diagnosis"]["reading"]["pooling"] == named_readings()[chosen].pooling
    code, again, _ = run("--knowledge", "shape", "--evidence", file, "--json")
    assert again == out
    code, other, _ = run("--knowledge", "shape", "--evidence", file, "--seed", 5, "--json")
    assert json.loads(other)["judged"] != found["judged"]
    code, text, _ = run("--knowledge", "shape", "--evidence", file)
    assert f"Take {chosen}:" in text
    assert f"Prototypes under {chosen}, 60 inputs" in text


@pytest.mark.usefixtures("small_grids")
def test_a_sweep_of_labelled_evidence(run: Run, tmp_path: Path) -> None:
    file = write(tmp_path / "e.parquet", right_labels())
    code, out, _ = run("--knowledge", "shape", "--evidence", file, "--sweep", "--json")
    assert code == 0
    found = json.loads(out)
    assert found["swept"] > 3
    assert 0 < sum(j["swept"] for j in found["judged"]) <= 10
    differs = [j["differs"] for j in found["judged"]]
    assert len(set(differs)) == len(differs)


def test_groups_stay_together(run: Run, tmp_path: Path) -> None:
    file = write(tmp_path / "e.parquet", right_labels())
    table = parquet.read_table(file)
    drawn_by = pyarrow.array(["anna"] * 15 + ["ben"] * 20 + ["cleo"] * 25)
    parquet.write_table(table.append_column("group", drawn_by), file)
    code, out, _ = run("--knowledge", "shape", "--evidence", file, "--json")
    found = json.loads(out)
    assert (code, found["groups"]) == (0, 3)
    assert sorted((found["choosing"], found["held_out"])) in ([25, 35], [20, 40], [15, 45])
    assert "3 whole groups" in run("--knowledge", "shape", "--evidence", file)[1]


def test_labels_of_other_kinds_are_read(run: Run, tmp_path: Path) -> None:
    labels = pyarrow.array(right_labels()).dictionary_encode()
    assert run("--knowledge", "shape", "--evidence", write(tmp_path / "d.parquet", labels))[0] == 0


@pytest.mark.parametrize(
    ("labels", "message"),
    [
        (None, "there is no column 'label'"),
        ([*right_labels(59), None], "row 59 of 'label' is empty"),
        (["round"] * 60, "label 'round' is not a class of the knowledge base"),
        ([1] * 60, "label '1' is not a class"),
    ],
)
def test_labels_that_can_not_be_used(
    run: Run, tmp_path: Path, labels: list[Any] | None, message: str
) -> None:
    file = write(tmp_path / "e.parquet", labels)
    code, out, err = run("--knowledge", "shape", "--evidence", file)
    assert (code, out) == (2, "")
    assert err.startswith(f"evifuse: {file}: ")
    assert message in err
    assert err.count("\n") == 1


def test_files_and_options_that_can_not_be_used(run: Run, tmp_path: Path) -> None:
    file = write(tmp_path / "e.parquet", right_labels())
    broken = tmp_path / "broken.parquet"
    broken.write_bytes(file.read_bytes()[:100])
    few = write(tmp_path / "few.parquet", right_labels(3), count=3)
    for arguments, message in (
        (["--evidence", file], "--evidence needs --knowledge"),
        (["--knowledge", "nothing"], "no such file"),
        (["--knowledge", "shape", "--evidence", tmp_path / "gone.parquet"], "No such file"),
        (["--knowledge", "shape", "--evidence", broken], "not Parquet"),
        (["--knowledge", "shape", "--evidence", few], "4 at least"),
        (["--knowledge", "curvature", "--evidence", file], "is not a class"),
    ):
        code, out, err = run(*arguments)
        assert (code, out) == (2, ""), arguments
        assert message in err
        assert err.count("\n") == 1


def test_the_examples_are_the_printed_ones() -> None:
    shape, curvature = published_examples()
    assert shape.evidence.as_dict() == {"frame": 0.51, "triangle": 0.2, "rectangle": 0.19, "square": 0.1}
    assert curvature.evidence.as_dict() == {"H": 0.37, "C+": 0.28, "C-": 0.25, "P": 0.1}
    assert shape.published == {"rectangular": 0.48, "triangular": 1.46, "elliptical": 0.0}
    assert curvature.published == {"quasiplanar": 1.3, "curved": 0.0, "occluded": 0.0}
    assert set(READINGS) <= set(named_readings())


def test_the_documentation_shows_what_is_printed(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (Path(__file__).parents[2] / "docs" / "readings.md").read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    draw, diagnosis = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    exec(compile(draw, "readings.md", "exec"), {})
    assert (tmp_path / "branch.png").stat().st_size > 10_000
    exec(compile(diagnosis, "readings.md", "exec"), {})
    shown = [block.splitlines() for block in re.findall(r"```text\n(.*?)```", text, re.DOTALL)]
    assert shown[0] == capsys.readouterr().out.splitlines()
    _, out, _ = run()
    assert shown[1] == [line.rstrip() for line in out.splitlines()]


def test_every_field_of_a_reading_is_documented() -> None:
    text = (Path(__file__).parents[2] / "docs" / "readings.md").read_text(encoding="utf-8")
    for name in Reading.__dataclass_fields__:
        assert f"| `{name}` |" in text, name


@pytest.mark.slow
def test_no_reading_of_the_grids_gives_the_published_figures() -> None:
    examples = published_examples()
    tried = [try_reading(r, examples) for r in grid(PRINT_CHOICES) + grid(OUR_CHOICES)]
    assert min(o.gap for o in tried) > 0.01
    assert sum(o.ranked for o in tried) > 1000
