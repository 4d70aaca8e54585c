"""Session files: faults are reported with file and key, and a session may be empty."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from sandbox.cli.main import call
from sandbox.measure.run.sessions import rerun
from sandbox.recording import Recording
from sandbox.scene.files.load import load
from sandbox.scene.files.shipped_scenes import find
from sandbox.window.playback.session import Session

pytestmark = pytest.mark.fail_slow(60)  # fuzzing and inputs at the ends of their ranges

Document = dict[str, Any]


def document() -> Document:
    """Return the document of a session file."""
    scene = load(find("bounce"))
    return dict(json.loads(Recording(scene, "pymunk", scene.solver, (), 0.1).to_json()))


def switch(**fields: Any) -> Callable[[Document], None]:
    """Return a function that adds a switch action to a session."""
    return lambda document: document["actions"].append({"kind": "switch", "time": 0.05, **fields})


def change(key: str, value: Any) -> Callable[[Document], None]:
    """Return a function that changes a value of a session."""
    return lambda document: document.__setitem__(key, value)


WRONG = {
    "unknown engine": (change("engine", "box2d" * 10**5), "engine: "),
    "switch to no engine": (switch(engine=""), "actions: 0.switch.engine"),
    "switch to an unknown engine": (switch(engine="box3d"), "actions[0].engine"),
    "switch to an unknown setting": (switch(settings={"self": 1}), "actions[0].settings.self"),
    "switch to a wrong setting": (switch(settings={"dt": -1}), "actions[0].settings.dt"),
    "unknown choice": (change("settings", {"integrator": "x" * 10**6}), "settings.integrator"),
    "kind of action": (change("actions", [{"kind": "z" * 10**6, "time": 0}]), "actions: 0"),
    "press": (change("presses", [["x" * 10**6, 1, 2]]), "`presses`"),
    "format": (change("format", "y" * 10**6), "format"),
    "scene": (change("scene", {"world": {"duration": "x" * 10**6}}), "world.duration"),
}


@pytest.mark.parametrize(("mutate", "key"), WRONG.values(), ids=WRONG)
@pytest.mark.parametrize("command", [("run",), ("export", "--to", "x.csv"), ("replay",)], ids=lambda words: words[0])
def test_invalid_session_is_reported_with_file_and_key(mutate, key, command, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    wrong = document()
    mutate(wrong)
    Path("s.json").write_text(json.dumps(wrong))
    assert call([*command, "s.json"]) == 2
    out, err = capfd.readouterr()
    assert (out, len(err.splitlines())) == ("", 1)
    assert err.startswith("s.json: ")
    assert key in err
    assert len(err) < 1000


@pytest.mark.parametrize("command", ["play", "match", "miss", "shots"])
def test_session_instead_of_a_scene_is_refused(command: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "s.json"
    file.write_text(json.dumps(document()))
    assert call([command, str(file)]) == 2
    assert "a recorded session, not a scene" in capfd.readouterr().err


@pytest.mark.parametrize("duration", [10.0, 0.0])
def test_session_without_steps_is_run_stored_and_exported(duration, tmp_path, capfd):
    session = Session(load(find("bounce"))).recording()
    assert session.duration == 0.0
    file = tmp_path / "s.json"
    session.save(file)
    written = json.loads(file.read_text())
    written["scene"].setdefault("world", {})["duration"] = duration
    file.write_text(json.dumps(written))
    assert rerun(Recording.load(file)).info["state_hash"] == session.state_hash
    for _ in range(2):  # computed, then loaded from the stored file
        assert call(["run", str(file), "--out", str(tmp_path / "runs"), "--json"]) == 0
        (row,) = json.loads(capfd.readouterr().out)["runs"]
        assert (row["status"], row["steps"], row["replayed"]) == ("ok", 0, True)
    (stored,) = (tmp_path / "runs").glob("*.npz")
    for source in (file, stored):
        assert call(["export", str(source), "--to", str(tmp_path / "x.csv"), "--to", str(tmp_path / "x.png")]) == 0
    assert call(["run", str(file), "--set", "world.duration=0.02", "--json"]) == 0
    assert json.loads(capfd.readouterr().out.splitlines()[-1])["runs"][0]["steps"] > 0
