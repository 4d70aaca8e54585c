"""When time stands still though nobody paused: help, the picker, another window, a game before its start, compiling."""

import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pygame
import pytest

from sandbox.engines.common.compile_clock import COMPILE_CLOCK
from sandbox.scene.files.shipped_scenes import find
from sandbox.window.app import App
from sandbox.window.app_state import AppState
from sandbox.window.worker import Worker
from tests.window.pressing import FOCUS_LOST, key, key_up, press
from tests.window.windowed import turned, window_on

pytestmark = pytest.mark.full  # a window or a film

MOVING = """
title = "Moving"
[solver]
dt = 0.01
[[ball]]
name = "a"
position = [0.0, 0.0]
velocity = [0.1, 0.0]
radius = 0.4
"""
FOCUS_GAINED = pygame.event.Event(pygame.WINDOWFOCUSGAINED)


@pytest.fixture
def window(tmp_path: Path) -> Iterator[App]:
    with window_on(MOVING, tmp_path) as opened:
        pygame.event.clear()  # those of its opening
        yield opened


@pytest.fixture
def game(tmp_path: Path) -> Iterator[Callable[[str], App]]:
    """Opens a shipped scene."""
    opened: list[App] = []

    def play(name: str) -> App:
        stage = AppState()
        window = App(stage, size=(640, 480), folder=tmp_path, say=lambda _: None)
        opened.append(window)
        assert stage.open(find(name))
        pygame.event.clear()
        return window

    yield play
    for each in opened:
        each.close()


def steps(window: App) -> int:
    """Let the window make three turns; return how many steps were made."""
    assert window.app_state.view is not None
    before = window.app_state.view.step_number
    for _ in range(3):
        turned(window)
    return window.app_state.view.step_number - before


@pytest.mark.parametrize("paused", [False, True])
@pytest.mark.parametrize(
    ("hides", "shows"),
    [
        (key(pygame.K_F1), key(pygame.K_ESCAPE)),
        (key(pygame.K_o, pygame.KMOD_CTRL), key(pygame.K_ESCAPE)),
        (FOCUS_LOST, FOCUS_GAINED),
    ],
    ids=["help", "picker", "focus"],
)
def test_time_stands_still_behind_what_hides_the_scene(
    window: App, hides: pygame.event.Event, shows: pygame.event.Event, paused: bool
) -> None:
    window.app_state.paused = paused
    assert (steps(window) > 0) is not paused
    turned(window, hides)
    assert steps(window) == 0
    turned(window, shows)
    assert (steps(window) > 0) is not paused
    assert window.context.exit_status is None


@pytest.mark.parametrize("name", ["landing", "pinball/classic"])
def test_real_time_game_waits_for_space(game: Callable[[str], App], name: str) -> None:
    window = game(name)
    assert steps(window) == 0
    turned(window, key(pygame.K_UP), key(pygame.K_LSHIFT), key_up(pygame.K_UP), key_up(pygame.K_LSHIFT))
    live = turned(window, key(pygame.K_SPACE), key_up(pygame.K_SPACE))
    assert steps(window) > 0
    assert live.session.game is not None
    assert live.session.game.presses == ()  # neither those before the start, nor the one that starts
    turned(window, key(pygame.K_r), key_up(pygame.K_r))
    assert steps(window) > 0  # who asks for another game is ready


@pytest.mark.parametrize("name", ["duel", "bounce"])
def test_other_scenes_run_at_once(game: Callable[[str], App], name: str) -> None:
    assert steps(game(name)) > 0


def test_step_begins_a_game_paused(game: Callable[[str], App]) -> None:
    window = game("landing")
    live = turned(window, key(pygame.K_o), key_up(pygame.K_o))
    assert live.step_number == 1
    assert window.app_state.paused
    assert not window.app_state.waits_for_start


def compile_for(window: App, *meanwhile: pygame.event.Event) -> None:
    """Let the next job of the stage compile until so many events have been taken out of the queue."""

    def job() -> None:
        COMPILE_CLOCK.begin("sandbox.test")
        for event in meanwhile:
            pygame.event.post(event)
        while pygame.event.peek([event.type for event in meanwhile]) and window.context.exit_status is None:
            threading.Event().wait(0.01)
        COMPILE_CLOCK.end()

    window.app_state.compute(job)


def test_presses_while_compiling_are_dropped_and_releases_are_not(window: App) -> None:
    turned(window)
    compile_for(window, key(pygame.K_p), press(100, 100), key_up(pygame.K_q))
    kept = {event.type for event in pygame.event.get()}
    assert pygame.KEYUP in kept
    assert not kept & {pygame.KEYDOWN, pygame.MOUSEBUTTONDOWN}
    assert window.context.exit_status is None
    assert not window.app_state.paused


@pytest.mark.parametrize("event", [key(pygame.K_ESCAPE), pygame.event.Event(pygame.QUIT)], ids=["escape", "cross"])
def test_window_closes_while_something_compiles(window: App, event: pygame.event.Event) -> None:
    turned(window)
    compile_for(window, event)
    assert window.context.exit_status == 0


def test_scene_is_seen_while_its_session_is_being_started(window: App, tmp_path: Path) -> None:
    seen: list[int] = []
    drawn = window.context.gui.draw_wait

    def look(surface: pygame.Surface, what: str) -> None:
        seen.append(len({surface.get_at((x, 240))[:3] for x in range(0, 360, 4)}))
        drawn(surface, what)

    window.context.gui.draw_wait = look  # type: ignore[method-assign]
    other = tmp_path / "other.toml"
    other.write_text(MOVING.replace("Moving", "Other"), encoding="utf-8")
    begin = window.app_state.compute

    def compute(job: Callable[[], object]) -> object:
        def slow() -> object:
            COMPILE_CLOCK.begin("sandbox.test")
            while not seen:
                threading.Event().wait(0.01)
            COMPILE_CLOCK.end()
            return job()

        return begin(slow)

    window.app_state.compute = compute  # type: ignore[assignment]
    window.app_state.open_other(other)
    assert seen[0] > 2  # a ball over the ground, not one colour
    assert window.app_state.view is not None
    assert window.app_state.view.scene.title == "Other"


def test_worker_raises_what_its_job_raises_and_goes_on() -> None:
    worker = Worker(lambda done: None)

    def fail() -> None:
        raise LookupError("no")

    with pytest.raises(LookupError, match="no"):
        worker.compute(fail)
    assert worker.compute(lambda: worker.compute(threading.current_thread)) is not threading.current_thread()
    worker.close()
