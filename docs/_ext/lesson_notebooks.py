"""Sphinx extension: each lesson as a notebook to download, made from its page, which may be a notebook itself.

The texts become text cells, Python blocks code cells, and each command of a console block a cell `!sandbox …`; outputs
are left out, because the notebook computes them. A hidden replay (see `generated.py`) becomes two cells in which `dt`
or another key is changed: a comparison with a slider, and a live scene. The answers are left out; a cell checks them.

Write the notebooks without building the site:

    python docs/_ext/lesson_notebooks.py FOLDER
"""

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import nbformat
from generated import BLOCK
from hidden_directives import FENCE
from markdown_it import MarkdownIt
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

from sandbox.lessons import exercises

LESSONS = Path(__file__).parents[1] / "lessons"
ANSWERS = re.compile(r"^(?:<details[^>]*>.*?^</details>|:::\{dropdown\} Answers.*?^:::)\s*?$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"<!-- (?:faulty )?file: (\S+) -->")
WINDOWS = ("sandbox play", "sandbox replay", "sandbox serve")
"""Commands that open a window or wait: they stay text."""
SETUP = "import sandbox\nfrom sandbox.lessons import check"
NEEDS = 'Needs the sandbox with `pip install -e ".[fast,box2d,notebook]"`, and JupyterLab, marimo or VS Code.'


def notebook_of(name: str, text: str) -> nbformat.NotebookNode:
    """Return a lesson as a notebook.

    Args:
        name: name of the lesson, such as `ball`.
        text: its page.
    """
    cells = [*_cells(FENCE.sub("", ANSWERS.sub("", text))), *_checks(name)]
    title = next(k for k, cell in enumerate(cells) if cell.cell_type == "markdown")
    cells[title + 1 : title + 1] = [new_markdown_cell(NEEDS), new_code_cell(SETUP)]
    return _notebook(name, cells)


def student_notebook(name: str, text: str) -> nbformat.NotebookNode:
    """Return a lesson that is written as a notebook, without its answers and outputs.

    Args:
        name: name of the lesson, such as `pendulum`.
        text: its notebook, JSON.
    """
    cells: list[nbformat.NotebookNode] = []
    for cell in nbformat.reads(text, 4).cells:
        is_text = cell.cell_type == "markdown"
        cells.extend(_text_cell(ANSWERS.sub("", cell.source)) if is_text else [new_code_cell(cell.source)])
    return _notebook(name, cells)


def _notebook(name: str, cells: list[nbformat.NotebookNode]) -> nbformat.NotebookNode:
    for k, cell in enumerate(cells):
        cell.id = f"{name}-{k}"  # the same in every build
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    return new_notebook(cells=cells, metadata={"kernelspec": kernel})


def _cells(text: str) -> Iterator[nbformat.NotebookNode]:
    """Yield the cells of a page, in its order."""
    lines, begin, after_python = text.splitlines(), 0, False
    for token in MarkdownIt().parse(text):
        if token.level or token.map is None or (token.type != "fence" and not _is_replay(token)):
            after_python = after_python and token.type == "fence"
            continue
        first, last = token.map
        language = token.info.strip()
        previous = "\n".join(lines[begin:first])
        if token.type != "fence":
            code = list(_replay_cells(token.content))
        elif language == "text" and after_python:
            code = []  # the output of the cell before
        else:
            code = [new_code_cell(source) for source in _sources(language, token.content, previous)]
            if not code:
                after_python = False
                continue
        yield from _text_cell(previous)
        yield from code
        begin, after_python = last, language == "python"
    yield from _text_cell("\n".join(lines[begin:]))


def _is_replay(token: Any) -> bool:
    return token.type == "html_block" and "<!-- generated: replay " in token.content


def _text_cell(text: str) -> Iterator[nbformat.NotebookNode]:
    """Yield a text cell without comments and pictures; links to other pages, which lie elsewhere, become plain text."""
    text = re.sub(r"<!--.*?-->\n?|!\[[^\]]*\]\([^)]*\)\n*", "", text, flags=re.DOTALL)
    text = re.sub(r"\[([^\]]+)\]\((?!https?:|#)[^)\s]+\)", r"\1", text).strip()
    if text:
        yield new_markdown_cell(text)


def _sources(language: str, content: str, previous: str) -> Iterator[str]:
    """Yield the source of the code cells of a block; none if it is to be read only."""
    written = FILE.search(previous.splitlines()[-1]) if previous.strip() else None
    if language == "python":
        yield content.rstrip()
    elif language == "toml" and written is not None:
        yield f"%%writefile {written[1]}\n{content.rstrip()}"
    elif language in ("console", "sh"):
        content = re.sub(r" *\\\n *", " ", content)  # a command that continues in the next line
        commands = [
            line.removeprefix("$ ") for line in content.splitlines() if language == "sh" or line.startswith("$ ")
        ]
        if not any(command.startswith(WINDOWS) for command in commands):
            yield from (f"!{re.sub(r'[ ]+# exits with .*', '', command)}" for command in commands)


def _replay_cells(comment: str) -> Iterator[nbformat.NotebookNode]:
    """Yield the cells for a hidden replay."""
    match = BLOCK.search(comment)
    assert match is not None
    _, scene, swept, *words = match["hidden"].split()
    key, values = swept.split("=")
    engines = tuple(word for word in words if "=" not in word)
    changes = [word for word in words if "=" in word]
    loaded = f"sandbox.load({scene!r}, {changes})" if changes else repr(scene)
    yield new_markdown_cell(f"Move the slider of `{key}` below the picture, and play. Try values of your own.")
    yield new_code_cell(
        f"sandbox.compare(\n    {loaded},\n    {engines},\n    sweep={{{key!r}: [{values.replace(',', ', ')}]}},\n)"
    )
    yield new_markdown_cell("The same scene, live: drag the bodies, and change the keys while it runs.")
    yield new_code_cell(f"sandbox.live({loaded}, {engines[0]!r}, sliders=[{key!r}])")


def _checks(name: str) -> Iterator[nbformat.NotebookNode]:
    """Yield a cell for each question whose answer can be checked."""
    for label, exercise in exercises().items():
        if label.rpartition("-")[0] == name:
            unit = f", in {exercise.unit}" if exercise.unit else ""
            yield new_markdown_cell(f"**Question {label.rpartition('-')[2]}{unit}.** {exercise.question}")
            yield new_code_cell(f"answer = 0.0  # your number\ncheck({label!r}, answer)")


def lesson_pages() -> Iterator[Path]:
    """Yield the lessons that are pages of text with something to run."""
    for path in sorted(LESSONS.glob("*.md")):
        if path.stem not in ("index", "school-path"):
            yield path


def write_notebooks(folder: Path) -> None:
    """Write the notebook of each lesson into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for page in lesson_pages():
        nbformat.write(notebook_of(page.stem, page.read_text(encoding="utf-8")), folder / f"{page.stem}.ipynb")
    for page in LESSONS.glob("*.ipynb"):
        nbformat.write(student_notebook(page.stem, page.read_text(encoding="utf-8")), folder / page.name)


def setup(app: Any) -> dict[str, bool]:
    """Register with Sphinx."""
    app.connect("source-read", _add_link)
    app.connect("build-finished", _write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _add_link(_: Any, page: str, source: list[str]) -> None:
    """Put a link to the notebook below the title."""
    folder, _, name = page.rpartition("/")
    if folder != "lessons":
        return
    link = f'<p class="notebook"><a href="{name}.ipynb" download>This lesson as a notebook</a></p>'
    if LESSONS / f"{name}.md" in lesson_pages():
        source[0] = _with_link(source[0], link)
    elif (LESSONS / f"{name}.ipynb").exists():
        notebook = nbformat.reads(source[0], 4)
        notebook.cells[0].source = _with_link(notebook.cells[0].source, link)
        source[0] = nbformat.writes(notebook)


def _with_link(text: str, link: str) -> str:
    title, _, rest = text.partition("\n")
    return f"{title}\n\n```{{raw}} html\n{link}\n```\n{rest}"


def _write(app: Any, failure: Exception | None) -> None:
    if failure is None and app.builder.format == "html":
        write_notebooks(Path(app.outdir) / "lessons")


if __name__ == "__main__":
    write_notebooks(Path(sys.argv[1]))
