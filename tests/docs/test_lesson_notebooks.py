"""Lessons as notebooks: they hold the code of the page, not its answers, and they run."""

import os
import sys
from pathlib import Path
from typing import Any

import pytest

from sandbox.lessons import exercises
from tests.docs.examples import examples

pytestmark = pytest.mark.fail_slow(120)  # starts kernels of notebooks

lesson_notebooks = pytest.importorskip("lesson_notebooks", exc_type=ImportError)
PAGES = list(lesson_notebooks.lesson_pages())
IDS = [page.stem for page in PAGES]


def notebook_of(page: Path) -> Any:
    return lesson_notebooks.notebook_of(page.stem, page.read_text(encoding="utf-8"))


def code_of(page: Path) -> list[str]:
    return [cell.source for cell in notebook_of(page).cells if cell.cell_type == "code"]


@pytest.mark.parametrize("page", PAGES, ids=IDS)
def test_notebook_has_the_code_and_commands_of_the_page(page: Path) -> None:
    text = lesson_notebooks.ANSWERS.sub("", page.read_text(encoding="utf-8"))
    sources = code_of(page)
    for example in examples(page):
        if example.text not in text:
            continue  # within the answers
        if example.language == "python":
            assert example.text.rstrip() in sources, example.location
        elif example.language == "console" and "sandbox play" not in example.text:
            for line in example.text.splitlines():
                if line.startswith("$ "):
                    assert f"!{line[2:].partition('  # exits')[0]}" in sources, example.location


@pytest.mark.parametrize("page", PAGES, ids=IDS)
def test_notebook_has_no_answers_but_checks_them(page: Path) -> None:
    text = "\n".join(cell.source for cell in notebook_of(page).cells)
    assert "Answers" not in text
    assert "<!--" not in text
    for name in exercises():
        if name.rpartition("-")[0] == page.stem:
            assert f"check('{name}', answer)" in text


def test_every_lesson_is_written_without_answers_and_outputs(tmp_path: Path) -> None:
    lesson_notebooks.write_notebooks(tmp_path)
    lessons = {path.stem for path in lesson_notebooks.LESSONS.iterdir()} - {"index", "school-path"}
    assert {path.stem for path in tmp_path.iterdir()} == lessons
    for path in tmp_path.iterdir():
        notebook = lesson_notebooks.nbformat.read(path, 4)
        lesson_notebooks.nbformat.validate(notebook)
        assert not any("Answers" in cell.source or cell.get("outputs") for cell in notebook.cells), path.stem
    pendulum = (tmp_path / "pendulum.ipynb").read_text(encoding="utf-8")
    assert "## Questions" in pendulum and "def pendulum(t, x, u)" in pendulum


def test_command_of_two_lines_is_one_cell() -> None:
    page = (
        "# Title\n\n```console\n$ sandbox run ball \\\n    --engine pymunk\nball\n```\n\n```sh\nsandbox \\\n  info\n```"
    )
    cells = [cell.source for cell in lesson_notebooks.notebook_of("ball", page).cells if cell.source.startswith("!")]
    assert cells == ["!sandbox run ball --engine pymunk", "!sandbox info"]


@pytest.mark.timeout(600)  # starts a kernel, and compiles on a new machine
@pytest.mark.parametrize(
    "page",
    [pytest.param(page, id=page.stem, marks=[] if page.stem == "ball" else pytest.mark.nightly) for page in PAGES],
)
def test_notebook_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from nbclient import NotebookClient

    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    resources = {"metadata": {"path": str(tmp_path)}}
    ran = NotebookClient(notebook_of(page), timeout=500, kernel_name="python3", resources=resources).execute()
    kinds = {kind for cell in ran.cells for output in cell.get("outputs", ()) for kind in output.get("data", ())}
    if any("sandbox.live(" in cell.source for cell in ran.cells):
        assert {"text/html", "application/vnd.jupyter.widget-view+json"} <= kinds
    printed = "".join(output.get("text", "") for cell in ran.cells for output in cell.get("outputs", ()))
    assert "Usage: sandbox" not in printed and "not found" not in printed
