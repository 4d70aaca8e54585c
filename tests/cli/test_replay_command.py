"""`sandbox replay`: the view of a stored run or a session, without a window."""

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
from tests.cli.calling import DROP

pytestmark = pytest.mark.fail_slow(60)  # child processes and command lines that run long

SCENE = loads(DROP)
KICK = Impulse(time=0.1, body="a", impulse=(1.0, 0.0))


@pytest.fixture(autouse=True)
def unlimited_step_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    """Remove the time limits of stepping, so that no test depends on the speed of the machine."""
    for name in ("MIN_STEP_BUDGET", "MAX_STEP_BUDGET"):
        monkeypatch.setattr(live_module, name, 1e9)


def live(view: object) -> LiveView:
    assert isinstance(view, LiveView)
    return view


@pytest.mark.parametrize("engine", ENGINES)
def test_stored_run_is_computed_again_with_its_own_settings(engine: str) -> None:
    source = run(SCENE, "pymunk", dt=0.004, substeps=1, iterations=7, slop=0.02)
    settings = live(_shown(source, engine)).settings
    assert (settings.dt, settings.iterations) == (0.004, 7)
    if engine != "exact":  # the exact engine leaves no overlap
        integrator = "semi_implicit_euler" if engine == "box2d" else "explicit_euler"
        assert (settings.slop, settings.integrator) == (0.02, integrator)


def test_stored_penalty_run_is_computed_again_on_its_engine_and_another() -> None:
    source = run(SCENE, "reference", response="penalty", stiffness=1e5, dt=0.001)
    assert source.status == "ok"
    again = live(_shown(source, "reference"))
    assert again.settings.model_dump(mode="json") == source.info["settings"]
    other = live(_shown(source, "pymunk")).settings
    assert (other.dt, other.stiffness, other.response) == (0.001, None, "impulse")


def test_restart_replays_the_recorded_actions() -> None:
    session = Session(SCENE, actions=(KICK,))
    session.advance(30, None)
    source = session.recording()
    state, first = AppState(source.engine), live(_shown(source, None))
    state.show(first, None, first.scene, again=lambda: _shown(source, None))
    state.paused = True
    for _ in range(2):
        state.restart()
        again = live(state.view)
        assert (again.step_number, state.paused) == (0, True)
        again.session.advance(30, None)
        assert again.session.recording() == source
    state.restart()
    state.paused = False
    live(state.view).clock.speed = 1.0
    for _ in range(60):
        state.update(0.02)
    assert state.paused  # at the end of the recording
    assert live(state.view).session.time == pytest.approx(source.duration)


def test_restart_keeps_the_stored_ghost() -> None:
    source = run(SCENE, "pymunk", actions=(KICK,))
    state, first = AppState(), live(_shown(source, "reference"))
    state.show(first, None, first.scene, again=lambda: _shown(source, "reference"))
    state.restart()
    again = live(state.view)
    assert again is not first
    assert again.diagnostics.has_ghost
    again.session.advance(20, None)
    assert [action.kind for action in again.session.actions] == ["impulse"]


def test_rerun_and_replayed_session_have_the_same_hash() -> None:
    session = live(_shown(Recording(SCENE, "pymunk", SCENE.solver, (KICK,), 0.5), None)).session
    session.advance(50, None)
    assert session.recording().state_hash == rerun(session.recording()).info["state_hash"]
