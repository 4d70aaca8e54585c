"""Time stops without a pause: behind help and picker, without focus, before the start of a game, while compiling."""

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
from tests.toml_text import toml
from tests.window.pressing import FOCUS_LOST, key, key_up, press
from tests.window.windowed import open_window, run_frame

pytestmark = pytest.mark.fail_slow(60)  # a window or a film

MOVING = (
    'title = "Moving"\n'
    + toml("solver", dt=0.01)
    + toml("ball", name="a", position=[0.0, 0.0], velocity=[0.1, 0.0], radius=0.4)
)
FOCUS_GAINED = pygame.event.Event(pygame.WINDOWFOCUSGAINED)


@pytest.fixture
def window(tmp_path: Path) -> Iterator[App]:
    with open_window(MOVING, tmp_path) as window:
        pygame.event.clear()  # events of opening the window
        yield window


@pytest.fixture
def game(tmp_path: Path) -> Iterator[Callable[[str], App]]:
    """Return a function that opens a shipped scene."""
    windows: list[App] = []

    def play(name: str) -> App:
        state = AppState()
        window = App(state, size=(640, 480), folder=tmp_path, say=lambda _: None)
        windows.append(window)
        assert state.open(find(name))
        pygame.event.clear()
        return window

    yield play
    for window in windows:
        window.close()


def steps(window: App) -> int:
    """Run three frames, and return the number of steps that they made."""
    assert window.app_state.view is not None
    before = window.app_state.view.step_number
    for _ in range(3):
        run_frame(window)
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
def test_time_stops_while_help_picker_or_focus_loss_hides_the_scene(
    window: App, hides: pygame.event.Event, shows: pygame.event.Event, paused: bool
) -> None:
    window.app_state.paused = paused
    assert (steps(window) > 0) is not paused
    run_frame(window, hides)
    assert steps(window) == 0
    run_frame(window, shows)
    assert (steps(window) > 0) is not paused
    assert window.context.exit_status is None


@pytest.mark.parametrize("name", ["landing", "pinball/classic"])
def test_real_time_game_waits_for_space(game: Callable[[str], App], name: str) -> None:
    window = game(name)
    assert steps(window) == 0
    run_frame(window, key(pygame.K_UP), key(pygame.K_LSHIFT), key_up(pygame.K_UP), key_up(pygame.K_LSHIFT))
    live = run_frame(window, key(pygame.K_SPACE), key_up(pygame.K_SPACE))
    assert steps(window) > 0
    assert live.session.game is not None
    assert live.session.game.presses == ()  # neither presses before the start, nor the one that starts
    run_frame(window, key(pygame.K_r), key_up(pygame.K_r))
    assert steps(window) > 0  # a restarted game does not wait


@pytest.mark.parametrize("name", ["duel", "bounce"])
def test_other_scenes_start_at_once(game: Callable[[str], App], name: str) -> None:
    assert steps(game(name)) > 0


def test_single_step_starts_a_game_paused(game: Callable[[str], App]) -> None:
    window = game("landing")
    live = run_frame(window, key(pygame.K_o), key_up(pygame.K_o))
    assert live.step_number == 1
    assert window.app_state.paused
    assert not window.app_state.waits_for_start


def compile_for(window: App, *events: pygame.event.Event) -> None:
    """Run a job that compiles until these events have been taken out of the queue."""

    def job() -> None:
        COMPILE_CLOCK.begin("sandbox.test")
        for event in events:
            pygame.event.post(event)
        while pygame.event.peek([event.type for event in events]) and window.context.exit_status is None:
            threading.Event().wait(0.01)
        COMPILE_CLOCK.end()

    window.app_state.compute(job)


def test_presses_while_compiling_are_dropped_and_releases_are_kept(window: App) -> None:
    run_frame(window)
    compile_for(window, key(pygame.K_p), press(100, 100), key_up(pygame.K_q))
    kept = {event.type for event in pygame.event.get()}
    assert pygame.KEYUP in kept
    assert not kept & {pygame.KEYDOWN, pygame.MOUSEBUTTONDOWN}
    assert window.context.exit_status is None
    assert not window.app_state.paused


@pytest.mark.parametrize("event", [key(pygame.K_ESCAPE), pygame.event.Event(pygame.QUIT)], ids=["escape", "cross"])
def test_window_can_be_closed_while_compiling(window: App, event: pygame.event.Event) -> None:
    run_frame(window)
    compile_for(window, event)
    assert window.context.exit_status == 0


def test_scene_is_drawn_while_its_session_starts(window: App, tmp_path: Path) -> None:
    colour_counts: list[int] = []
    draw_wait = window.context.gui.draw_wait

    def count_colours(surface: pygame.Surface, what: str) -> None:
        colour_counts.append(len({surface.get_at((x, 240))[:3] for x in range(0, 360, 4)}))
        draw_wait(surface, what)

    window.context.gui.draw_wait = count_colours  # type: ignore[method-assign]
    other = tmp_path / "other.toml"
    other.write_text(MOVING.replace("Moving", "Other"), encoding="utf-8")
    compute_in_worker = window.app_state.compute

    def compute(job: Callable[[], object]) -> object:
        def slow() -> object:
            COMPILE_CLOCK.begin("sandbox.test")
            while not colour_counts:
                threading.Event().wait(0.01)
            COMPILE_CLOCK.end()
            return job()

        return compute_in_worker(slow)

    window.app_state.compute = compute  # type: ignore[assignment]
    window.app_state.open_other(other)
    assert colour_counts[0] > 2  # the ball on the background, not a single colour
    assert window.app_state.view is not None
    assert window.app_state.view.scene.title == "Other"


def test_worker_reraises_exceptions_of_a_job_and_stays_usable() -> None:
    worker = Worker(lambda done: None)

    def fail() -> None:
        raise LookupError("no")

    with pytest.raises(LookupError, match="no"):
        worker.compute(fail)
    assert worker.compute(lambda: worker.compute(threading.current_thread)) is not threading.current_thread()
    worker.close()


@pytest.mark.parametrize("opens", ["picker", "editor"])
def test_text_typed_while_compiling_is_kept(window: App, opens: str) -> None:
    run_frame(window, key(pygame.K_o if opens == "picker" else pygame.K_e, pygame.KMOD_CTRL))
    compile_for(window, key(pygame.K_b, unicode="b"), key(pygame.K_o, unicode="o"))
    assert [event.unicode for event in pygame.event.get(pygame.KEYDOWN)] == ["b", "o"]


def test_letters_typed_while_a_preview_compiles_filter_the_picker(window: App, monkeypatch: pytest.MonkeyPatch) -> None:
    run_frame(window, key(pygame.K_o, pygame.KMOD_CTRL))
    browser = window.context.gui.scene_browser
    assert browser is not None
    draw = browser.draw

    def compile_and_draw(*args: object) -> None:
        COMPILE_CLOCK.begin("sandbox.test")
        COMPILE_CLOCK.end()
        monkeypatch.setattr(COMPILE_CLOCK, "seconds", COMPILE_CLOCK.seconds + 1.0)
        pygame.event.post(key(pygame.K_b, unicode="b"))
        draw(*args)

    monkeypatch.setattr(browser, "draw", compile_and_draw)
    for _ in range(3):
        window.run_frame(0.05)
    assert browser.typed == "bb"  # of the two pictures before
