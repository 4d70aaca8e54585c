"""`sandbox replay`: what is put on for a stored run or a session, without a window."""

from pathlib import Path

import pytest

from sandbox.action import Impulse
from sandbox.cli.window import _shown
from sandbox.engines.registry import ENGINES
from sandbox.measure.run.runner import run
from sandbox.measure.run.sessions import rerun
from sandbox.recording import Recording
from sandbox.scene.files.load import loads
from sandbox.window.app_state import AppState
from sandbox.window.playback import live as live_module
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.session import Session
from tests.cli.calling import DROP, lines_of, written

pytestmark = pytest.mark.full  # child processes and command lines that run long

SCENE = loads(DROP)
KICK = Impulse(time=0.1, body="a", impulse=(1.0, 0.0))


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """No test depends on how fast the machine is."""
    for name in ("MIN_STEP_BUDGET", "MAX_STEP_BUDGET"):
        monkeypatch.setattr(live_module, name, 1e9)


def live(show: object) -> LiveView:
    assert isinstance(show, LiveView)
    return show


@pytest.mark.parametrize("engine", ENGINES)
def test_stored_run_is_computed_again_with_its_own_settings(engine: str) -> None:
    source = run(SCENE, "pymunk", dt=0.004, substeps=1, iterations=7, slop=0.02)
    settings = live(_shown(source, engine)).settings
    assert (settings.dt, settings.iterations) == (0.004, 7)
    if engine != "exact":  # which leaves no overlap
        assert (settings.slop, settings.integrator) == (0.02, "explicit_euler")


def test_stored_run_of_springs_is_computed_again_on_its_own_engine_and_another() -> None:
    source = run(SCENE, "reference", response="penalty", stiffness=1e5, dt=0.001)
    assert source.status == "ok"
    again = live(_shown(source, "reference"))
    assert again.settings.model_dump(mode="json") == source.info["settings"]
    other = live(_shown(source, "pymunk")).settings
    assert (other.dt, other.stiffness, other.response) == (0.001, None, "impulse")


def test_restart_of_a_replay_plays_what_was_recorded_again() -> None:
    session = Session(SCENE, actions=(KICK,))
    session.advance(30, None)
    source = session.recording()
    stage, first = AppState(source.engine), live(_shown(source, None))
    stage.show(first, None, first.scene, again=lambda: _shown(source, None))
    stage.paused = True
    for _ in range(2):
        stage.restart()
        again = live(stage.view)
        assert (again.step_number, stage.paused) == (0, True)
        again.session.advance(30, None)
        assert again.session.recording() == source
    stage.restart()
    stage.paused = False
    for _ in range(60):
        stage.update(0.02)
    assert stage.paused  # at the end of what was recorded
    assert live(stage.view).session.time == pytest.approx(source.duration)


def test_restart_keeps_the_stored_ghost() -> None:
    source = run(SCENE, "pymunk", actions=(KICK,))
    stage, first = AppState(), live(_shown(source, "reference"))
    stage.show(first, None, first.scene, again=lambda: _shown(source, "reference"))
    stage.restart()
    again = live(stage.view)
    assert again is not first
    assert again.diagnostics.has_ghost
    again.session.advance(20, None)
    assert [action.kind for action in again.session.actions] == ["impulse"]


def test_scene_and_session_name_each_others_command(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene, session = written(tmp_path), tmp_path / "s.json"
    Recording(SCENE, "pymunk", SCENE.solver, (), 0.5).save(session)
    status, out, err = lines_of(capfd, "replay", scene)
    assert (status, out, len(err)) == (2, [], 1)
    assert f"`sandbox play {scene}`" in err[0]
    status, out, err = lines_of(capfd, "play", str(session))
    assert (status, out, len(err)) == (2, [], 1)
    assert f"`sandbox replay {session}`" in err[0]


def test_rerun_and_the_replayed_session_end_alike() -> None:
    session = live(_shown(Recording(SCENE, "pymunk", SCENE.solver, (KICK,), 0.5), None)).session
    session.advance(50, None)
    assert session.recording().state_hash == rerun(session.recording()).info["state_hash"]
