"""Resource limits: their environment variables, their messages, and the table in the documentation."""

from pathlib import Path

import pytest

from sandbox import resource_limits, run
from sandbox.action import Move
from sandbox.cli.main import call
from sandbox.engines.registry import ENGINES
from sandbox.resource_limits import LIMITS, MEMORY, PAIRS, LimitValueError
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import from_document, load, too_large

DOCS = Path(__file__).parents[1] / "docs"


@pytest.mark.parametrize(
    ("text", "value"),
    [("80GiB", 80 * 2**30), ("1.5 gib", 3 * 2**29), ("2_000MB", 2 * 10**9), ("4096", 4096), ("", MEMORY.default)],
)
def test_memory_limit_is_read_in_bytes_or_with_a_unit(text: str, value: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SANDBOX_MAX_MEMORY", text)
    assert MEMORY.value == value


@pytest.mark.parametrize(("text", "value"), [("2_000_000", 2_000_000), ("5e9", 5 * 10**9), ("1e99", 2**62)])
def test_count_limit_is_read_as_a_number(text: str, value: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SANDBOX_MAX_PAIRS", text)
    assert PAIRS.value == value


@pytest.mark.parametrize("text", ["much", "-1", "16GiB", "nan", "1" * 4000, "٣"])
def test_message_of_a_wrong_value_names_the_variable_and_is_short(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SANDBOX_MAX_PAIRS", text)
    with pytest.raises(LimitValueError, match="SANDBOX_MAX_PAIRS") as error:
        resource_limits.check_environment()
    assert len(str(error.value)) < 200


def test_wrong_value_of_a_variable_exits_with_status_2(monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    monkeypatch.setenv("SANDBOX_MAX_MEMORY", "plenty")
    assert call(["scenes"]) == 2
    assert capsys.readouterr().err.startswith("sandbox: the environment variable SANDBOX_MAX_MEMORY is 'plenty'")


@pytest.mark.parametrize("limit", LIMITS, ids=lambda limit: limit.variable)
def test_value_that_a_message_recommends_is_sufficient(limit, monkeypatch: pytest.MonkeyPatch) -> None:
    for needed in (limit.default + 1, 3.7 * limit.default, 123_456_789_012_345):
        message = limit.refusal("it takes", needed)
        value = message.split(f"{limit.variable}=")[1].split()[0]
        with monkeypatch.context() as patch:
            patch.setenv(limit.variable, value)
            assert limit.refusal("it takes", needed) is None
    assert limit.refusal("it takes", limit.default) is None


def test_no_value_is_recommended_beyond_the_largest_one() -> None:
    assert "set SANDBOX" not in str(PAIRS.refusal("it takes", 1e30))


def test_scene_file_beyond_the_limit_is_read_once_the_limit_is_raised(tmp_path: Path, monkeypatch) -> None:
    path = tmp_path / "scene.toml"
    path.write_text("[[ball]]\nposition = [0, 0]\nradius = 1\n" + "#" * 2**20)
    monkeypatch.setenv("SANDBOX_MAX_FILE_SIZE", "1MiB")
    with pytest.raises(SceneError, match="set SANDBOX_MAX_FILE_SIZE=2MiB to allow it"):
        load(path)
    monkeypatch.setenv("SANDBOX_MAX_FILE_SIZE", "2MiB")
    assert len(load(path).balls) == 1


def test_file_size_limit_allows_50_000_balls_with_all_keys() -> None:
    ball = '[[ball]]\nname = "ball-12345"\nposition = [12.345678, 12.345678]\nvelocity = [0.123456, -1.234567]\n'
    ball += "radius = 0.5\nmass = 1.25\nrestitution = 0.9\nfriction = 0.3\n"
    assert too_large(50_000 * len(ball)) is None


@pytest.mark.parametrize(
    ("engine", "variable", "more"),
    [
        ("exact", "SANDBOX_MAX_MEMORY", {"surface": {"sliding_friction": 0.2}}),
        ("exact", "SANDBOX_MAX_PAIRS", {}),
        ("pymunk", "SANDBOX_MAX_STEP_WORK", {}),
        ("pymunk", "SANDBOX_MAX_SPACE_SIZE", {}),
        ("pymunk", "SANDBOX_MAX_PAIRS", {"attraction": [{"toward": [0, 9], "strength": 1}]}),
        ("reference", "SANDBOX_MAX_STEP_WORK", {}),
        ("reference", "SANDBOX_MAX_PAIRS", {"attraction": [{"toward": [0, 9], "strength": 1}]}),
    ],
)
def test_engine_names_the_limit_that_a_scene_exceeds(engine, variable, more, monkeypatch):
    grid = {"origin": [0, 0], "columns": 4, "spacing": [3, 3], "radius": 1}
    scene = from_document({"grid": [grid], **more})
    assert ENGINES[engine].missing(scene, scene.solver) == ()
    monkeypatch.setenv(variable, "1")
    (reason,) = ENGINES[engine].missing(scene, scene.solver)
    assert f"set {variable}=" in reason


def test_step_with_more_contacts_than_the_limit_ends_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = from_document({"grid": [{"name": "g", "origin": [0, 0], "columns": 20, "spacing": [3, 0], "radius": 1}]})
    monkeypatch.setenv("SANDBOX_MAX_STEP_WORK", "1000")  # as many passes over the bodies are less
    moves = [Move(time=0, body=f"g-{k + 1}", position=(0.0, 0.0)) for k in range(20)]
    ended = run(scene, "reference", actions=moves)
    assert ended.status == "failed"
    assert "set SANDBOX_MAX_STEP_WORK=" in ended.reason


def test_memory_error_exits_with_status_1_and_one_line(monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    def exhausted(*_: object, **__: object) -> None:
        raise MemoryError

    monkeypatch.setattr("sandbox.cli.main.cli.main", exhausted)
    assert call(["scenes"]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "out of memory" in line


def test_documentation_lists_every_limit_with_its_default() -> None:
    generated = pytest.importorskip("generated", reason="the documentation's packages are not installed")
    page = generated.expand((DOCS / "reference/limits.md").read_text(encoding="utf-8"))
    rows = dict(line.split("|")[1:3] for line in page.splitlines() if line.startswith("| `SANDBOX_MAX_"))
    shown = {limit.variable: limit.shown(limit.default) for limit in LIMITS}
    assert {name.strip().strip("`"): default.strip() for name, default in rows.items()} == shown
