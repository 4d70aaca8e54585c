"""Answers of the lessons: in boxes that fold on each page, and not in the site for students."""

import json
from pathlib import Path

import pytest
from answers import remove_boxes
from docutils import nodes

LESSONS = sorted(
    path
    for path in (Path(__file__).parents[2] / "docs" / "lessons").iterdir()
    if path.stem not in ("index", "school-path")
)


def section(*parts: str) -> nodes.section:
    """Return a section of raw HTML, where a part is a tag, and of paragraphs."""
    return nodes.section(
        "",
        *(nodes.raw("", part, format="html") if part.startswith("<") else nodes.paragraph("", part) for part in parts),
    )


def test_box_is_removed_with_its_contents() -> None:
    page = section("question", "<details>\n<summary>Answers</summary>", "42", "</details>", "<p>", "reading")
    remove_boxes(page)
    assert [part.astext() for part in page] == ["question", "<p>", "reading"]


def test_box_that_is_not_closed_is_refused() -> None:
    with pytest.raises(ValueError, match="not closed"):
        remove_boxes(section("question", "<details>", "42"))


@pytest.mark.parametrize("page", LESSONS, ids=lambda page: page.name)
def test_lesson_has_a_box_of_answers_after_its_questions(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    if page.suffix == ".ipynb":
        text = "\n".join("".join(cell["source"]) for cell in json.loads(text)["cells"])
    questions = text.partition("\n## Questions\n")[2]
    # Markdown within HTML needs blank lines
    assert questions.count("\n\n<details>\n<summary>Answers</summary>\n\n1. ") == 1
    assert questions.count("\n\n</details>\n\n") == 1
