"""Nesting: deep documents are refused before a recursive reader sees them, even on a nearly full stack."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from sandbox.action import ActionError, actions_from_json
from sandbox.batch.sweep import parse_sweep
from sandbox.games.high_scores import HighScores
from sandbox.recording import FORMAT, Recording
from sandbox.scene.errors import SceneError
from sandbox.scene.files.document import MAX_DEPTH, NestingError, check_text, check_value
from sandbox.scene.files.load import from_document, loads
from sandbox.scene.files.overrides import AddressError, parse_assignment, parse_path
from sandbox.scene.files.shipped_scenes import scenes_in

pytestmark = pytest.mark.fail_slow(60)  # property tests with many examples

BALL: dict[str, Any] = {"ball": [{"position": [0, 1], "radius": 0.5}]}

TOML: dict[str, Callable[[int], str]] = {
    "arrays": lambda n: f"title = {'[' * n}{']' * n}",
    "arrays, not closed": lambda n: f"title = {'[' * n}",
    "arrays on lines": lambda n: "title = " + "[\n" * n + "]\n" * n,
    "arrays behind strings": lambda n: (
        'title = """a""""\nabout = \'\'\'b\'\'\'\' # "\n[[ball]]\nradius = ' + "['[',\n" * n
    ),
    "inline tables": lambda n: f"{'a={' * n}{'}' * n}",
    "inline tables, not closed": lambda n: "a={" * n,
    "tables in arrays": lambda n: f"a={'[{a=' * n}1{'}]' * n}",
    "dotted key": lambda n: f"{'a.' * n}a = 1",
    "quoted key": lambda n: "'a' . " * n + "a = 1",
    "key in quotes of the other kind": lambda n: '"=," . ' * n + "a = 1",
    "key within a table": lambda n: f"world = {{ {'a.' * n}a = 1 }}",
    "heading": lambda n: f"[{'a.' * n}a]\nb = 1",
    "heading of an array": lambda n: f"[[ {'a . ' * n}a ]]\nb = 1",
}

DEPTHS = (MAX_DEPTH, 1_000, 1_000_000)


def _deep(call: Callable[[], Any], frames: int) -> Any:
    """Call a function from this many stack frames further down."""
    return call() if frames == 0 else _deep(call, frames - 1)


@pytest.mark.parametrize("kind", TOML)
def test_deep_toml_is_refused_at_any_depth(kind: str) -> None:
    for depth in DEPTHS:
        text = TOML[kind](depth)
        for frames in (0, 600):
            with pytest.raises(SceneError, match="nested too deeply") as raised:
                _deep(lambda: loads(text, "a.toml"), frames)  # noqa: B023, it is called at once
            assert len(str(raised.value)) < 200
    with pytest.raises(SceneError) as raised:
        _deep(lambda: loads(TOML[kind](8), "a.toml"), 600)
    assert "nested" not in str(raised.value)


def test_depth_is_summed_over_keys_and_tables() -> None:
    key = ".".join("a" * 20)
    for text in (f"[{key}]\n{key} = 1", f"{key} = {{ {key} = 1 }}", f"{key} = {'[' * 20}{']' * 20}"):
        with pytest.raises(SceneError, match="nested too deeply"):
            loads(text)


def test_nesting_fault_has_its_line() -> None:
    for line, text in ((4, "title = 'a'\n\n[world]\ngravity = " + "[" * 99), (2, "title = 'a'\n[" + "a." * 99 + "a]")):
        with pytest.raises(SceneError) as raised:
            loads(text)
        assert raised.value.faults[0].line == line


def test_brackets_and_dots_within_strings_and_comments_do_not_count() -> None:
    signs = "[{" * 50 + "a." * 50
    for quote in ('"', "'", '"""', "'''"):
        scene = loads(
            f"# {signs}\ntitle = {quote}{signs}{quote} # {signs}\n[[ball]]\nposition = [0, 1]\nradius = 0.5\n"
        )
        assert scene.title == signs
    check_text(f'about = """\n{signs}\n, {signs}"""\n' + "a = [1.0, 2.0]\n" * 100)


@pytest.mark.parametrize(
    "text", ["'" * 10**6, '"' * 10**6, '\\"""' * 10**5, "a " * 10**6, "a," * 10**6, "." * 10**6, "[" + "a.,[]" * 10**5]
)
def test_any_text_is_checked_in_linear_time(text: str) -> None:
    check_text(text)


def test_cyclic_and_shared_values_are_checked() -> None:
    cyclic: list[Any] = []
    cyclic.append(cyclic)
    with pytest.raises(NestingError):
        check_value(cyclic)
    with pytest.raises(SceneError, match="nested too deeply"):
        from_document({**BALL, "title": cyclic})
    many: list[Any] = []
    for _ in range(MAX_DEPTH - 1):
        many = [many, many]
    check_value(many)
    with pytest.raises(NestingError):
        check_value([many])


@pytest.mark.parametrize("depth", DEPTHS)
def test_deep_settings_and_sweeps_are_refused(depth: int) -> None:
    value = "[" * depth + "]" * depth
    assert _deep(lambda: parse_assignment(f"world.gravity={value}"), 600) == ("world.gravity", value)
    assert _deep(lambda: parse_sweep(f"world.gravity={value},2"), 600) == ("world.gravity", [value, 2])
    for call in (lambda: parse_path("a." * depth + "a"), lambda: parse_path("a" + "[0]" * depth)):
        with pytest.raises(AddressError) as raised:
            _deep(call, 600)
        assert len(str(raised.value)) < 200
    nested: Any = []
    for _ in range(depth):
        nested = [nested]
    for override in (f"world.gravity={value}", ("world.gravity", nested), ("a." * depth + "a", 1)):
        with pytest.raises(SceneError):
            _deep(lambda: from_document(BALL, overrides=[override]), 600)  # noqa: B023, it is called at once
    _flatten(nested)


@pytest.mark.parametrize("depth", DEPTHS)
@pytest.mark.parametrize("brackets", [("[", "]"), ('{"a":', "}"), ("[", "")])
def test_deep_json_is_refused(depth: int, brackets: tuple[str, str], tmp_path: Path) -> None:
    start, end = brackets
    value = start * depth + ("1" if end == "}" else "") + end * depth
    recording = json.dumps({"format": FORMAT, "scene": BALL, "engine": "pymunk"})
    for text in (value, f'{recording[:-1]}, "settings": {value}}}', f'{recording[:-1]}, "actions": {value}}}'):
        with pytest.raises(SceneError) as raised:
            _deep(lambda: Recording.from_json(text), 600)  # noqa: B023, it is called at once
        assert len(str(raised.value)) < 200
    with pytest.raises(ActionError):
        _deep(lambda: actions_from_json(value), 600)
    path = tmp_path / "scores.json"
    path.write_text(value)
    with pytest.raises(ValueError, match="not a high-score file"):
        HighScores(path).rank("a", 1)


def test_folder_with_a_deeply_nested_file_is_listed(tmp_path: Path) -> None:
    (tmp_path / "deep.toml").write_text(f"a = {'[' * 100_000}")
    assert len(scenes_in(str(tmp_path))) == 1


def _flatten(nested: Any) -> None:
    """Take a deep list apart: freeing it as a whole would recurse."""
    while nested:
        nested = nested.pop()
