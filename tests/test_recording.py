"""Recordings: scene and actions as one JSON document."""

import dataclasses
import json
import math
from pathlib import Path
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sandbox.action import Impulse
from sandbox.recording import RecordedGame, Recording, ReplayCheck
from sandbox.scene.description.world import Settings
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import loads
from tests import strategies
from tests.test_action import actions

RECORDING = Recording(
    scene=loads('[[ball]]\nname = "a"\nposition = [0, 0]\nradius = 1\n'),
    engine="pymunk",
    settings=Settings(dt=0.001, slop=0.1),
    actions=(Impulse(time=0.5, body="a", impulse=(1.0, 2.0)),),
    duration=1.5,
    state_hash="00ff",
    game=RecordedGame(
        ("a joint",), ("a rounding",), {"a": (0.5, None, 0.0, -1.0, 2.0, 3.0)}, "ff00", ReplayCheck(False, 3, "a", 0.5)
    ),
)


def document() -> dict[str, Any]:
    return dict(json.loads(RECORDING.to_json()))


def fault_paths(text: str) -> list[str]:
    with pytest.raises(SceneError) as caught:
        Recording.from_json(text, "r.json")
    for fault in caught.value.faults:
        assert fault.file == "r.json"
        assert fault.message
    return [fault.path for fault in caught.value.faults]


def test_recording_round_trips_through_json() -> None:
    assert Recording.from_json(RECORDING.to_json()) == RECORDING


@pytest.mark.fail_slow(60)  # takes over half a second
@given(strategies.scenes(), actions(), st.floats(0, 1e9), st.none() | st.text(max_size=9))
def test_any_recording_round_trips_through_json(scene, applied, duration, state_hash):
    recording = Recording(scene, "reference", scene.solver, applied, duration, state_hash)
    text = recording.to_json()
    assert Recording.from_json(text) == recording
    assert Recording.from_json(text).to_json() == text


def test_recording_is_read_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "r.json"
    path.write_text(RECORDING.to_json(), encoding="utf-8")
    assert Recording.load(path) == RECORDING


def test_unreadable_file_is_a_fault_with_its_path(tmp_path: Path) -> None:
    binary = tmp_path / "b.json"
    binary.write_bytes(b"\xff\xfe\x00")
    for path in (tmp_path / "none.json", tmp_path, binary):
        with pytest.raises(SceneError) as caught:
            Recording.load(path)
        assert [fault.file for fault in caught.value.faults] == [str(path)]


@pytest.mark.parametrize(
    "text",
    ["", "null", "[]", "3", "{", "{}", '{"format": 2}', "[" * 100_000, "1" * 5000, '{"format": "1"}', "nan", "\x00"],
)
def test_text_that_is_not_a_recording_is_a_fault(text: str) -> None:
    assert fault_paths(text) == [""]


@pytest.mark.parametrize("game", [{}, {"omitted": ["a"]}, {"inexact": []}, {"replay": {"is_equal": True}}, None])
def test_keys_of_a_recorded_game_may_be_missing(game: dict[str, Any] | None) -> None:
    """Recordings of earlier versions have no program, and later ones may have more keys."""
    found = Recording.from_json(json.dumps({**document(), "game": game})).game
    assert (found is None) == (game is None)
    if found is not None and game is not None:
        assert [*found.omitted] == game.get("omitted", [])
    without = document()
    del without["game"]
    assert Recording.from_json(json.dumps(without)) == dataclasses.replace(RECORDING, game=None)


@pytest.mark.parametrize("key", ["format", "scene", "engine", "settings", "actions", "duration"])
def test_recording_without_a_required_key_is_a_fault(key: str) -> None:
    without = document()
    del without[key]
    assert fault_paths(json.dumps(without)) == [""]


@pytest.mark.parametrize(
    ("change", "path"),
    [
        ({"scene": 3}, ""), ({"engine": 3}, ""), ({"engine": None}, ""), ({"settings": []}, ""), ({"actions": {}}, ""),
        ({"duration": "1"}, ""), ({"duration": True}, ""), ({"duration": -1.0}, ""), ({"duration": math.nan}, ""),
        ({"game": 3}, ""), ({"game": []}, ""), ({"game": {"omitted": "a joint"}}, ""), ({"game": {"replay": {}}}, ""),
        ({"game": {"replay": {"is_equal": 1}}}, ""), ({"game": {"end": {"a": [True]}}}, ""),
        ({"game": {"end": {"\ud800": 1}}}, ""),
        ({"duration": math.inf}, ""), ({"duration": 10**400}, ""), ({"state_hash": 3}, ""), ({"state_hash": []}, ""),
        ({"settings": {"dt": -1}}, "settings.dt"), ({"settings": {"zzz": -1}}, "settings.zzz"),
        ({"settings": {"\ud800": 1}}, "settings"), ({"actions": [3]}, "actions"), ({"actions": ["\ud800"]}, "actions"),
        ({"scene": {"ball": [{"position": [0, 0], "radius": -1}]}}, "ball[0].radius"),
        ({"scene": {"ball": [{"position": [0, 0], "radius": 1, "material": "x"}]}}, "ball[0].material"),
        ({"scene": {"title": "\ud800"}}, ""), ({"scene": {"balls": [{"x": 1}]}}, "balls"),
    ],
)  # fmt: skip
def test_recording_with_a_wrong_value_is_a_fault_at_its_path(change: dict[str, Any], path: str) -> None:
    assert fault_paths(json.dumps({**document(), **change})) == [path]


@given(st.sampled_from(sorted(document())), strategies.junk())
@example("settings", {"": 1})
@example("scene", {})
def test_any_value_gives_a_recording_or_a_scene_error(key: str, value: Any) -> None:
    text = json.dumps({**document(), key: value}, default=str)
    try:
        assert isinstance(Recording.from_json(text), Recording)
    except SceneError as error:
        assert error.faults


def test_recording_beyond_the_limit_is_read_once_the_limit_is_raised(tmp_path: Path, monkeypatch) -> None:
    path = tmp_path / "session.json"
    RECORDING.save(path)
    monkeypatch.setenv("SANDBOX_MAX_SESSION_SIZE", "100B")
    with pytest.raises(SceneError, match="set SANDBOX_MAX_SESSION_SIZE=1MiB to allow it"):
        Recording.load(path)
    monkeypatch.setenv("SANDBOX_MAX_SESSION_SIZE", "1MiB")
    assert Recording.load(path) == RECORDING


def test_recording_is_frozen() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        RECORDING.engine = "box2d"  # type: ignore[misc] # the point of the test
