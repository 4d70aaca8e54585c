"""Speed at which the window starts a scene: stated, or so that the scene lasts long enough to be seen."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import sandbox
from sandbox.cli.main import call
from sandbox.step_clock import SHORTEST_PLAY, FixedStepClock, speed_for
from sandbox.window.app import App
from sandbox.window.app_state import AppState
from sandbox.window.playback.recorded import RecordedRun, RecordedView
from tests.window.windowed import open_window, run_frame

SHORT = "[world]\nduration = 0.02\n[[ball]]\nname = 'a'\nposition = [0, 0]\nradius = 0.1\nvelocity = [100, 0]\n"


@pytest.mark.parametrize(
    ("duration", "speed"),
    [(0.02, 0.005), (0.3, 0.1), (0.29, 0.05), (0.6, 0.2), (1.0, 0.2), (1.5, 0.5), (2.9, 0.5), (3.0, 1.0), (1e9, 1.0)],
)
def test_speed_is_a_1_2_5_step(duration: float, speed: float) -> None:
    assert speed_for(duration) == speed


@given(st.floats(1e-8, 1e9))
def test_scene_lasts_three_seconds_and_not_needlessly_long(duration: float) -> None:
    speed = speed_for(duration)
    assert duration / speed >= SHORTEST_PLAY * (1.0 - 1e-8) or speed == 1.0
    assert duration / speed <= 2.5 * SHORTEST_PLAY * (1.0 + 1e-8) or speed == 1.0


@pytest.mark.parametrize(
    ("text", "option", "speed"),
    [
        (SHORT, None, 0.005),
        (SHORT.replace("0.02", "3.0"), None, 1.0),
        (f"[play]\nspeed = 0.03\n{SHORT}", None, 0.03),
        (f"[play]\nspeed = 0.03\n{SHORT}", 2.0, 2.0),
        (f"[play]\narrows = 'a'\n{SHORT}", None, 1.0),  # waits for the player
    ],
)
def test_scene_starts_at_its_speed(text: str, option: float | None, speed: float, tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(text)
    state = AppState(speed=option)
    for _ in range(2):  # the second time by a restart
        assert state.open(path)
        assert state.view is not None
        assert state.view.clock.speed == speed
    state.close()


def test_stored_run_starts_by_its_length() -> None:
    run = sandbox.run(sandbox.loads(SHORT))
    state = AppState()
    state.show(view := RecordedView(RecordedRun(run)), None, view.scene)
    assert view.clock.speed == 0.005
    state.close()


def test_levels_go_on_from_a_stated_speed() -> None:
    clock = FixedStepClock()
    clock.speed = 0.5
    clock.slower()
    assert clock.speed == pytest.approx(10**-0.4, rel=1e-12)  # rounding
    clock.speed = 0.03
    clock.faster()
    assert clock.speed == pytest.approx(10**-1.5, rel=1e-12)  # rounding
    clock.speed = 1e-6
    clock.slower()
    assert clock.speed == 1e-6  # below the levels of the keys
    clock.faster()
    assert clock.speed == pytest.approx(10**-5.9, rel=1e-12)  # rounding


def test_speed_slows_the_scene(tmp_path: Path) -> None:
    with open_window(SHORT, tmp_path) as window:
        for _ in range(50):
            live = run_frame(window, elapsed=0.1)
        assert live.step_number * live.settings.dt == pytest.approx(5.0 * 0.005, abs=live.settings.dt)


@pytest.mark.parametrize("value", ["0", "11", "nan", "x"])
def test_invalid_speed_is_refused(value: str, capfd: pytest.CaptureFixture[str]) -> None:
    assert call(["play", "bullet", "--speed", value]) == 2
    assert "--speed" in capfd.readouterr().err


def test_option_reaches_the_window(monkeypatch: pytest.MonkeyPatch) -> None:
    speeds = []
    monkeypatch.setattr(App, "run", lambda window: speeds.append(window.app_state.view.clock.speed) or 0)
    assert call(["play", "bullet", "--speed", "0.25"]) == 0
    assert speeds == [0.25]


def test_measured_speed_of_a_few_steps_a_second_is_steady() -> None:
    clock = FixedStepClock()
    clock.speed = 0.005
    for _ in range(60):  # a step in 0.2 s
        due = clock.steps_due(1 / 60, 0.001)
        clock.record_steps(1 / 60, due, due, 0.001)
        assert clock.real_speed == pytest.approx(0.005, rel=1e-9)  # sums of rounded terms
