"""Generated blocks of the reference: all can be generated, and together they are complete."""

import re
from pathlib import Path

import pytest

from sandbox.game_names import game_specs, games_with_rules
from sandbox.run_file import SHAPES
from sandbox.scene.files.json_schema import schema
from sandbox.trajectory import Trajectory

pytestmark = pytest.mark.fail_slow(60)  # child processes and pages

DOCS = Path(__file__).parents[2] / "docs"
PAGES = sorted(page for page in DOCS.rglob("*.md") if "```{generated}" in page.read_text(encoding="utf-8"))

generated = pytest.importorskip("generated", exc_type=ImportError)


def page_of(name: str) -> str:
    return str(generated.expand((DOCS / "reference" / name).read_text(encoding="utf-8")))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_block_of_a_page_is_generated(page: Path) -> None:
    assert "{generated}" not in generated.expand(page.read_text(encoding="utf-8"))


def test_unknown_generator_raises() -> None:
    with pytest.raises(ValueError, match="no generator 'scenes'"):
        generated.expand("```{generated} scenes\n```")


def test_every_table_of_a_scene_has_a_heading_and_every_key_a_row() -> None:
    page = page_of("scene-file.md")
    for name, node in schema()["properties"].items():
        if name not in ("title", "about"):
            brackets = f"[[{name}]]" if node.get("type") == "array" else f"[{name}]"
            assert f"\n### `{brackets}`\n" in page, name
    for name, definition in schema()["$defs"].items():
        for key in definition.get("properties", {}):
            assert f"| `{key}`{{#key-" in page, f"{name}.{key}"


def test_anchors_are_unique() -> None:
    for name in ("scene-file.md", "python.md"):
        anchors = re.findall(r"\{#([^}]+)\}", page_of(name)) + re.findall(r"^\((\S+)\)=$", page_of(name), re.MULTILINE)
        assert len(anchors) == len(set(anchors))


def test_numbers_with_a_dimension_have_a_unit() -> None:
    rows = [line.split("|") for line in page_of("scene-file.md").splitlines() if "{#key-world-" in line]
    units = {row[1].split("`")[1]: row[3].strip() for row in rows}
    assert units["gravity"] == "m/s²"
    assert units["linear_drag"] == "1/s"
    assert units["duration"] == "s"


def test_every_game_has_a_section_of_keys() -> None:
    page = page_of("window-keys.md")
    for game in games_with_rules():
        assert f"\n### {game.capitalize()}\n" in page


def test_every_stored_array_has_a_shape() -> None:
    assert set(SHAPES) == set(Trajectory.__dataclass_fields__)


def test_keys_named_in_lessons_and_tutorial_are_in_the_table_of_keys() -> None:
    table = set(re.findall(r"`([^`]+)`", page_of("window-keys.md")))
    texts = {
        page: page.read_text(encoding="utf-8") for page in (*DOCS.glob("lessons/*.md"), *DOCS.glob("tutorial/1*.md"))
    }
    for page, text in texts.items():
        named = re.findall(r"`([^`\n ]+)`,? (?:pauses|makes one step|goes one step|shows the|lists)", text)
        named += re.findall(r"[Pp]ress `?([A-Z]|F\d+)`?\b", text)
        named += re.findall(r"^\| `([^`]+)` \| (?:pause|one step)", text, re.MULTILINE)
        assert "space bar" not in text, page.name
        for key in named:
            assert key in table, (page.name, key)
    assert "`P` pauses" in texts[DOCS / "lessons" / "index.md"]


def test_every_environment_has_tables_of_its_actions_and_observations() -> None:
    page = page_of("environments.md")
    source = (DOCS / "reference" / "environments.md").read_text(encoding="utf-8")
    for each in (each for spec in game_specs() for each in spec.environments):
        assert f"| `{each.id}` |" in page
        assert f"```{{generated}} environment-arguments {each.name}\n" in source
        assert f"```{{generated}} environment {each.name}\n" in source


def test_table_of_an_environment_has_every_number_with_its_bounds() -> None:
    table = generated.generate("environment Curling")
    assert "| 0 + 7k | red-1 … yellow-8: x | −40.23 | 5.486 | m |" in table
    assert "| 112 | broom | −2.3 | 2.3 | m |" in table
    rows = [line.split("|")[1].strip() for line in table.partition("Observation space")[2].splitlines() if "|" in line]
    assert rows[2:] == [*(f"{k} + 7k" for k in range(7)), *map(str, range(16 * 7, 123))]
    assert "| 32–64 | height 0 … height 32 | 0 | ∞ | m |" in generated.generate("environment ArtilleryDuel")
    assert "| 7 | fuel | 0 | 1 |  |" in generated.generate("environment Landing")
