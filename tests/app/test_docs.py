"""Python code in the docs runs as it stands, block after block of one page.

Pages with prompts are run as doctests beside the tests of what they are about.
"""

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
PAGES = {
    page.name: blocks
    for page in sorted(DOCS.glob("*.md"))
    if (blocks := re.findall(r"```python\n(?!>>>)(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL))
}


@pytest.mark.parametrize("page", PAGES)
def test_python_blocks_run(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for number, code in enumerate(PAGES[page]):
        exec(compile(code, f"{page}, block {number + 1}", "exec"), names)


def test_pages_with_code_are_found() -> None:
    assert {"compiled.md", "readings.md"} <= set(PAGES)
