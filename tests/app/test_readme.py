"""What the README shows works as it stands."""

import re
import shlex
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from evifuse.app.main import main
from tests.conftest import PHOTOS

README = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


@pytest.fixture
def beside(tmp_path: Path, scene_file: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the files that the README speaks of."""
    shutil.copy(PHOTOS / "desk.jpg", tmp_path / "photo.jpg")
    shutil.copy(scene_file("sphere"), tmp_path / "finger.mcap")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("code", blocks("python"), ids=["fuse", "belief", "train"])
@pytest.mark.usefixtures("beside")
def test_python(code: str, capsys: pytest.CaptureFixture[str]) -> None:
    exec(compile(code, "README.md", "exec"), {})
    assert capsys.readouterr().out.strip()


def test_shell(beside: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = [line.split("#")[0].strip() for line in blocks("sh")[1].splitlines()]
    assert len(lines) == 5
    for line in lines:
        command = shlex.split(line.split(">")[0])
        assert command[0] == "evifuse"
        with pytest.raises(SystemExit) as stopped:
            main(command[1:])
        assert stopped.value.code == 0, line
        assert capsys.readouterr().out.strip()
    assert {"saddle.mcap", "saddle.png"} <= {p.name for p in beside.iterdir()}
