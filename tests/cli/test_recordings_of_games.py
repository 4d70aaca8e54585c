"""Recordings of games as arguments of commands: remarks, scenes, pixels, `export`, and `run` in Python."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pymunk
import pytest

import sandbox
from sandbox.cli.main import call
from sandbox.cli.recordings import MAX_REMARKS, report_remarks
from sandbox.measure.run.replay_check import checked_recording
from sandbox.measure.run.sessions import recorded_scene, rerun
from sandbox.pymunk_capture.game_capture import capture
from sandbox.recording import Recording
from tests.cli.calling import json_of

pytestmark = pytest.mark.fail_slow(60)  # many command lines
DT = 1 / 60
LEFT_OUT = "space.damping = 2, which the game sets; `world.damping` is above 0 and at most 1"


def record(radius: float, act: Callable[[pymunk.Space, pymunk.Body], object] | None) -> Recording:
    """Return the checked recording of a game with two falling discs, of which one is pushed, and an act on it."""
    space = pymunk.Space()
    space.gravity = 0, -90 * radius
    ground = pymunk.Segment(space.static_body, (-50 * radius, 0), (50 * radius, 0), radius)
    ground.friction = 0.5
    space.add(ground)
    discs = []
    for k in range(2):
        body = pymunk.Body(1, 0.5 * radius**2)
        body.position = 6 * k * radius, 8 * radius
        circle = pymunk.Circle(body, radius)
        circle.friction, circle.elasticity = 0.5, 0.3
        space.add(body, circle)
        discs.append(body)
    with capture() as captured:
        for k in range(40):
            if k == 10:
                discs[0].velocity = radius, 0
            if k == 15 and act is not None:
                act(space, discs[1])
            space.step(DT)
    return checked_recording(captured)


def speed_up(space: pymunk.Space, _: pymunk.Body) -> None:
    space.damping = 2.0


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the recordings of a game with damping that is left out, in pixels, and of a complete one in m."""
    monkeypatch.chdir(tmp_path)
    record(10.0, speed_up).save("fast.json")
    record(0.5, None).save("fall.json")
    Path("pages").mkdir()
    return tmp_path


QUICK = ("--effort", "0.2", "--repeats", "1")
COMMANDS = {
    "run": (),
    "check": ("--no-trial",),
    "compare": ("--engine", "pymunk,reference", "--out", "pages"),
    "advise": (*QUICK, "--out", "pages/report.html"),
    "tradeoff": (*QUICK, "--points", "3", "--engine", "pymunk", "--metric", "drift", "--out", "pages"),
    "export": ("--to", "out.csv"),
    "report": ("--effort", "0", "--engine", "pymunk", "--out", "pages/report.html"),
}


def remarks_in(document: dict[str, Any], name: str) -> list[str]:
    """Return the remarks on a recording: in the document, by its name, or in the document of its scene."""
    (holder,) = document.get("scenes", (document,))
    found = holder.get("remarks") or []
    return found[name] if isinstance(found, dict) else found


@pytest.mark.parametrize("command", COMMANDS)
def test_commands_repeat_what_a_recording_lacks(command: str, folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    options = COMMANDS[command]
    status, document, lines = json_of(capfd, command, "fast.json", *options)
    assert status in (0, 1)  # of advise and tradeoff: nothing within the tolerance
    remarks = remarks_in(document, "fast.json")
    assert f"left out: {LEFT_OUT}" in remarks
    assert any("the replay departs from the game at step 16 (body-1)" in each for each in remarks)
    for each in remarks:
        assert f"fast.json: {each}" in lines
    if "--out" in options:
        assert f"Recording: left out: {LEFT_OUT}" in Path("pages/report.html").read_text(encoding="utf-8")
    is_scene = command in ("check", "compare", "tradeoff", "report")
    assert any("without its 1 action" in each for each in remarks) == is_scene

    if command != "advise":  # which takes 10 s
        call([command, "fast.json", *options, "--quiet"])
        assert f"fast.json: left out: {LEFT_OUT}" in capfd.readouterr().err

    _, document, lines = json_of(capfd, command, "fall.json", *options)
    remarks = remarks_in(document, "fall.json")
    assert is_scene == bool(remarks)
    assert not any("left out" in each or "departs" in each for each in (*remarks, *lines))


def test_replay_repeats_what_a_recording_lacks(folder, monkeypatch, capfd):
    monkeypatch.setattr("sandbox.cli.window.run_window", lambda *_, **__: 0)
    assert call(["replay", "fast.json"]) == 0
    assert f"fast.json: left out: {LEFT_OUT}" in capfd.readouterr().err
    assert call(["replay", "fall.json"]) == 0
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("count", [0, 1, MAX_REMARKS, MAX_REMARKS + 1, 90])
def test_long_lists_of_remarks_are_cut(count: int, capsys: pytest.CaptureFixture[str]) -> None:
    report_remarks("a.json", [f"remark {k}" for k in range(count)])
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) <= MAX_REMARKS + 1
    if count:
        assert (lines[0], lines[-1]) == ("a.json: remark 0", f"a.json: remark {count - 1}")


def test_values_are_set_in_the_scene_of_a_recording(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    status, document, _ = json_of(capfd, "check", "fast.json", "--no-trial", "--set", "solver.substeps=3")
    assert (status, document["step"]) == (0, {"dt": DT, "substeps": 3})
    assert call(["check", "fast.json", "--set", "ball.none.mass=3"]) == 2
    assert "none" in capfd.readouterr().err


def test_compare_sweeps_the_settings_of_a_recording(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    sweep = ("--sweep", "solver.substeps=1,4", "--engine", "pymunk")
    _, document, _ = json_of(capfd, "compare", "fall.json", *sweep)
    assert [row["set"]["solver.substeps"] for row in document["engines"]] == [1, 4]


def test_export_writes_the_scene_of_a_recording(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert call(["export", "fast.json", "--to", "level.toml", "--to", "level.py"]) == 0
    assert "without its 1 action" in capfd.readouterr().err
    recording = Recording.load("fast.json")
    scene = sandbox.load("level.toml")
    assert scene == recorded_scene(recording)
    assert scene.world.duration == recording.duration
    assert scene.solver.dt == DT
    program: dict[str, Any] = {"__name__": "level"}
    exec(Path("level.py").read_text(), program)
    moving = [each for each in program["make_space"]()[0].bodies if each.body_type == pymunk.Body.DYNAMIC]
    assert len(moving) == 2
    assert call(["export", "fast.json", "--to", "level.toml"]) == 2
    assert "--force" in capfd.readouterr().err
    assert call(["export", "level.toml", "--to", "again.toml", "--set", "solver.iterations=20"]) == 0
    assert sandbox.load("again.toml").solver.iterations == 20
    capfd.readouterr()
    assert call(["export", "fast.json", "--to", "level.toml", "--to", "states.csv", "--force"]) == 2
    assert "export them separately" in capfd.readouterr().err


@pytest.mark.parametrize("command", ["play", "shots"])
def test_commands_that_take_no_recording_name_those_that_do(command, folder, capfd):
    assert call([command, "fast.json"]) == 2
    error = capfd.readouterr().err
    assert "sandbox replay fast.json" in error
    assert "sandbox export fast.json --to" in error


def test_tradeoff_does_not_write_into_a_recording(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    before = Path("fast.json").read_bytes()
    assert call(["tradeoff", "fast.json", "--write"]) == 2
    assert "sandbox export fast.json" in capfd.readouterr().err
    assert Path("fast.json").read_bytes() == before


@pytest.mark.parametrize(
    ("name", "options", "zoom"),
    [
        ("fast.json", (), 1.0),
        ("fast.json", ("--pixels",), 1.0),
        ("fast.json", ("--zoom", "50"), 50.0),
        ("fall.json", (), 50.0),
        ("fall.json", ("--pixels",), 1.0),
        ("fall.json", ("--zoom", "20"), 20.0),
        ("bounce", (), 50.0),
        ("bounce", ("--pixels",), 1.0),
    ],
)
def test_unit_of_length_is_guessed_for_recordings_of_games(name, options, zoom, folder, monkeypatch, capfd):
    given: dict[str, Any] = {}

    def stop(*_: object, **options: object) -> None:
        given.update(options)
        raise ValueError("enough")

    monkeypatch.setattr("sandbox.cli.advise.advise", stop)
    assert call(["advise", name, *options, "--tolerance", "2px"]) == 2
    assert (given["zoom"], given["tolerance"]) == (zoom, pytest.approx(2.0 / zoom, rel=1e-12))
    capfd.readouterr()


@pytest.mark.parametrize("zoom", [None, "50"])
def test_guessed_unit_of_length_is_stated(zoom: str | None, folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    options = () if zoom is None else ("--zoom", zoom)
    _, document, lines = json_of(capfd, "advise", "fast.json", *QUICK, *options)
    assert any("20 units wide" in each and "--zoom 50" in each for each in lines) == (zoom is None)
    assert any("pixels?" in each for each in document["notes"]) == (zoom is not None)


def test_pixels_and_zoom_exclude_each_other(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert call(["advise", "fast.json", "--pixels", "--zoom", "2"]) == 2
    assert "leave out one of them" in capfd.readouterr().err


def test_run_takes_recordings_in_python(folder: Path) -> None:
    recording = Recording.load("fast.json")
    own = sandbox.run(recording)
    assert own.info["state_hash"] == recording.state_hash == rerun(recording).info["state_hash"]
    assert (own.info["engine"], own.info["settings"]["dt"], len(own.time)) == ("pymunk", DT, 41)
    assert sandbox.run(recording, "reference").info["engine"] == "reference"
    finer = sandbox.run(recording, substeps=4)
    assert finer.info["settings"]["substeps"] == 4
    kick = sandbox.Impulse(time=0.5, body="body-1", impulse=(40.0, 0.0))
    kicked = sandbox.run(recording, actions=[kick])
    assert [each["kind"] for each in kicked.info["actions"]] == ["move", "impulse"]
    assert kicked.position[-1, 0, 0] > own.position[-1, 0, 0]
    with pytest.raises(sandbox.UnknownEngineError):
        sandbox.run(recording, "none")
    with pytest.raises(TypeError, match=r"not a Recording; a recording has its scene in `\.scene`"):
        sandbox.compare(recording)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["--to", "--force", "--steps", "--json", "--quiet", "--to=x.json"])
def test_options_after_the_game_are_its_own_and_named(name: str, folder: Path, capfd) -> None:
    game = "import sys, pymunk\nassert len(sys.argv) == 3\nspace = pymunk.Space()\nspace.step(0.1)\n"
    Path("game.py").write_text(game)
    assert call(["record", "--force", "game.py", "level", name]) == 0
    assert f"game.py: {name}: passed to the game; options of this command come before GAME.py" in capfd.readouterr().err
    assert Path("game.json").exists()
    assert call(["record", "--force", "game.py", "level", "--hard"]) == 0
    assert "passed to the game" not in capfd.readouterr().err
