"""`evifuse train` as a user meets it: what it prints and writes, the files it takes and those it refuses."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from evifuse.app.main import main
from evifuse.belief import Frame, MassFunction
from evifuse.belief.files import to_csv, to_json, to_parquet
from evifuse.conductivity import TRAINED_READINGS, classify
from evifuse.knowledge import load_knowledge

pyarrow = pytest.importorskip("pyarrow")
from pyarrow import parquet  # noqa: E402

Run = Callable[..., tuple[int, str, str]]
FRAME = Frame(["round", "flat", "long"])
LABELS = ["ball"] * 20 + ["tile"] * 15 + ["rod"] * 10


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    def call(*arguments: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as stopped:
            main(["train", *map(str, arguments)])
        out, err = capsys.readouterr()
        assert isinstance(stopped.value.code, int)
        return stopped.value.code, out, err

    return call


def seen() -> MassFunction:
    """Evidence that leans to what each label is."""
    rng = np.random.default_rng(3)
    lean = np.ones((len(LABELS), 4))
    lean[np.arange(len(LABELS)), [{"ball": 0, "tile": 1, "rod": 2}[label] for label in LABELS]] = 6.0
    masses = np.stack([rng.dirichlet(row) for row in lean])
    return MassFunction(FRAME, ["round", "flat", "long", FRAME], masses)


def with_label_column(path: Path) -> Path:
    to_parquet(seen(), path)
    parquet.write_table(parquet.read_table(path).append_column("label", pyarrow.array(LABELS)), path)
    return path


def test_it_prints_prototypes_and_figures_and_writes_what_conducts(run: Run, tmp_path: Path) -> None:
    out = tmp_path / "tools.yaml"
    code, printed, err = run(with_label_column(tmp_path / "seen.parquet"), "-o", out)
    assert (code, err) == (0, "")
    for text in ("ball_1", "tile_1", "rod_1", "log loss", "chosen", f"Wrote {out}", "layers-16", "smooth"):
        assert text in printed
    base = load_knowledge(out)
    assert base.name == "tools"
    assert set(base.classes) == {"ball", "tile", "rod"}
    found = classify(seen(), base)
    right = np.array(base.classes)[found.decisions] == np.array(LABELS)
    assert right.mean() > 0.9
    assert run(tmp_path / "seen.parquet", "-o", tmp_path / "again.yaml")[0] == 0
    text = out.read_text()
    assert (tmp_path / "again.yaml").read_text() == text.replace("title: tools", "title: again")


@pytest.mark.parametrize("header", [True, False])
@pytest.mark.parametrize("write", [to_csv, to_json, to_parquet])
def test_labels_in_a_file_of_their_own(
    run: Run, tmp_path: Path, write: Callable[[MassFunction, Path], None], header: bool
) -> None:
    kind = write.__name__.removeprefix("to_")
    write(seen(), tmp_path / f"seen.{kind}")
    (tmp_path / "labels.csv").write_text("\n".join(["label"] * header + LABELS) + "\n")
    files = (tmp_path / f"seen.{kind}", "--labels", tmp_path / "labels.csv", "-o", tmp_path / "kb.yaml")
    code, printed, _ = run(*files, "--json", "--reading", "layers-32", "--max-prototypes", 1, "--seed", 7)
    assert code == 0
    told = json.loads(printed)
    assert told["cases"] == {"ball": 20, "rod": 10, "tile": 15}
    assert {name: len(p) for name, p in told["prototypes"].items()} == {"ball": 1, "rod": 1, "tile": 1}
    assert [t["reading"] for t in told["trials"]] == ["layers-32"]
    base = load_knowledge(tmp_path / "kb.yaml")
    assert base.reading == TRAINED_READINGS["layers-32"]
    assert base.aggregates[0].prototypes["ball_1"].as_dict() == told["prototypes"]["ball"]["ball_1"]
    assert "seed 7" in base.source


def test_nothing_to_hold_out_is_said(run: Run, tmp_path: Path) -> None:
    to_json(seen()[[0, 20, 35]], tmp_path / "few.json")
    (tmp_path / "labels.txt").write_text("ball\ntile\nrod\n")
    code, printed, _ = run(
        tmp_path / "few.json", "--labels", tmp_path / "labels.txt", "-o", tmp_path / "kb.yaml"
    )
    assert code == 0
    assert "Nothing could be held out" in printed


@pytest.mark.parametrize(
    ("files", "options", "says"),
    [
        ("seen.txt", (), "evidence is a file *.parquet, *.csv, *.json"),
        ("seen.json", (), "give --labels"),
        ("bare.parquet", (), "no column 'label'"),
        ("missing.parquet", (), "can't be read"),
        ("seen.json", ("--labels", "nowhere.txt"), "nowhere.txt: can't be read"),
        ("seen.json", ("--labels", "short.txt"), "2 labels for the 45 cases"),
        ("seen.json", ("--labels", "gap.txt"), "gap.txt:3: there is no label"),
        ("seen.json", ("--labels", "binary.txt"), "not UTF-8"),
        ("one.json", ("--labels", "one.txt"), "one.json: training needs evidence of batch shape (N,)"),
        ("seen.parquet", ("--reading", "loud"), "--reading 'loud': there are sound, printed, working"),
        ("seen.parquet", ("--max-prototypes", "0"), "max_prototypes must be 1 or more"),
        ("seen.parquet", ("-o", "kb.txt"), "name it kb.yaml"),
        ("seen.parquet", ("-o", "nowhere/kb.yaml"), "create it first"),
    ],
)
def test_refusals_are_one_line(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, files: str, options: tuple[str, ...], says: str
) -> None:
    monkeypatch.chdir(tmp_path)
    with_label_column(Path("seen.parquet"))
    to_parquet(seen(), "bare.parquet")
    to_json(seen(), "seen.json")
    to_json(seen()[0], "one.json")
    Path("one.txt").write_text("ball\n")
    Path("short.txt").write_text("ball\ntile\n")
    Path("gap.txt").write_text("\n".join([*LABELS[:2], "", *LABELS[3:]]) + "\n")
    Path("binary.txt").write_bytes(b"\xff\xfe")
    out = () if "-o" in options else ("-o", "kb.yaml")
    code, printed, err = run(files, *options, *out)
    assert (code, printed) == (2, "")
    assert says in err
    assert err.count("\n") == 1
    assert not Path("kb.yaml").exists()
