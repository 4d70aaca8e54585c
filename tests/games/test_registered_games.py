"""Games of other packages, registered by an entry point: named in scene files, played, and refused when broken."""

import importlib.metadata
import json
from pathlib import Path

import pytest

from sandbox.cli.main import call
from sandbox.game_names import GAMES, GROUP, game_names, games_with_rules
from sandbox.games.landing.rules import Landing
from sandbox.games.registry import has_rules, is_real_time, rules_of
from sandbox.measure.run.sessions import play_out
from sandbox.scene.errors import SceneError
from sandbox.scene.files.json_schema import schema
from sandbox.scene.files.load import dumps, load, loads
from tests.toml_text import toml

SCENE = toml(
    title="Count",
    world={"gravity": [0.0, -9.81], "duration": 1.0},
    play={"game": "count-bounces"},
    plane=[{"name": "floor", "point": [0.0, 0.0], "normal": [0.0, 1.0]}],
) + toml("ball", name="ball", position=[0.0, 0.5], radius=0.1, restitution=0.8)

RULES_OF_COUNT = """
from sandbox.game_spec import GameSpec
from sandbox.games.contract import Control

class Count:
    real_time = True
    controls = (Control("kick", "up", ("up",)),)

    def __init__(self, scene, bodies):
        self.score, self.game_over, self._touched = 0, None, set()

    def on_input(self, control, value):
        return ()

    def on_step(self, info):
        self._touched |= {contact.time for contact in info.contacts}
        self.score = len(self._touched)
        return ()

    def display_lines(self):
        return (("bounces", str(self.score)),)

    def sounds(self):
        return ()

TABLED = GameSpec(names=("tabled",), rules="bounce_counter:Count", tables={"tabled": "bounce_counter:Count"})
"""


@pytest.fixture
def scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Scene file whose game is registered by an installed package."""
    (tmp_path / "bounce_counter.py").write_text(RULES_OF_COUNT)
    info = tmp_path / "bounce_counter-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: bounce-counter\nVersion: 1.0\n")
    entries = {"count-bounces": "Count", "broken": "Missing", "tabled": "TABLED", "landing": "Count"}
    lines = [f"[{GROUP}]", *(f"{name} = bounce_counter:{part}" for name, part in entries.items())]
    (info / "entry_points.txt").write_text("\n".join(lines))
    monkeypatch.syspath_prepend(tmp_path)
    file = tmp_path / "count.toml"
    file.write_text(SCENE)
    return file


def test_scene_can_name_a_game_of_another_package(scene: Path) -> None:
    loaded = load(scene)
    assert loaded.play.game == "count-bounces"
    assert loads(dumps(loaded)) == loaded
    assert has_rules(loaded)
    assert is_real_time("count-bounces")
    assert game_names() == (*GAMES, "broken", "count-bounces", "tabled")
    assert "count-bounces" in schema()["$defs"]["Play"]["properties"]["game"]["enum"]


def test_game_of_another_package_is_played(scene: Path, capfd: pytest.CaptureFixture[str]) -> None:
    game = play_out(load(scene), "none")
    assert game.score > 0
    assert call(["run", str(scene), "--player", "none", "--json"]) == 0
    (row,) = json.loads(capfd.readouterr().out)["runs"]
    assert (row["score"], row["player"]) == (game.score, "none")
    assert call(["check", str(scene)]) == 0


def test_game_that_cannot_be_imported_is_reported_with_its_line(scene: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene.write_text(SCENE.replace("count-bounces", "broken"))
    assert call(["check", str(scene)]) == 2
    err = capfd.readouterr().err
    assert err.startswith(f"{scene}:3: play.game: the game 'broken' cannot be imported from bounce_counter:Missing: ")


def test_game_with_a_scene_table_is_refused_with_its_line(scene: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene.write_text(SCENE.replace("count-bounces", "tabled"))
    assert call(["check", str(scene)]) == 2
    err = capfd.readouterr().err
    assert err.startswith(f"{scene}:3: play.game: the game 'tabled' cannot be imported from bounce_counter:TABLED: ")
    assert "[tabled]" in err


def test_builtin_game_has_priority_over_a_registered_game_of_the_same_name(scene: Path) -> None:
    assert type(rules_of(load("landing"))) is Landing


def test_unknown_game_is_refused_with_all_names(scene: Path) -> None:
    with pytest.raises(SceneError) as caught:
        loads(SCENE.replace("count-bounces", "count"))
    (fault,) = caught.value.faults
    assert (fault.line, fault.path) == (3, "play.game")
    names, remedy = fault.message.split(", is ")
    assert names.endswith("'curling', 'landing', 'broken', 'count-bounces' or 'tabled'")
    assert remedy == '"count"; if another package has this game, install it'


def test_unknown_game_is_refused_with_the_builtin_names() -> None:
    with pytest.raises(SceneError) as caught:
        loads(SCENE.replace("count-bounces", "pinbal"))
    assert caught.value.faults[0].message == (
        "must be one of '8-ball', '9-ball', 'three-cushion', 'straight-rail', 'snooker', 'free', 'pinball', "
        "'artillery', 'curling' or 'landing', is \"pinbal\"; did you mean 'pinball'?"
    )


def test_games_of_this_package_are_found_without_entry_points(monkeypatch: pytest.MonkeyPatch) -> None:
    def forbidden(**_: str) -> None:
        raise AssertionError("entry points are read")

    monkeypatch.setattr(importlib.metadata, "entry_points", forbidden)
    assert has_rules(load("landing"))
    for name in ("billiards/9-ball", "tutorial/bounce"):
        scene = load(name)
        assert not has_rules(scene)
        assert rules_of(scene) is None


def test_every_game_with_rules_is_named() -> None:
    assert set(games_with_rules()) < set(GAMES)
