"""Main loop of the window without a display: events posted before a frame take effect in that frame."""

import math
import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pygame
import pytest
from PIL import Image

from sandbox.action import SetParameter, Spawn
from sandbox.window.app import App
from sandbox.window.app_state import AppState, Messages
from sandbox.window.display import NoDisplayError, open_screen
from sandbox.window.input.keymap import Command
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.recorded import RecordedView
from sandbox.window.playback.snapshot import OVERLAYS
from sandbox.window.render.palette import SKY, WARNING, RgbColour
from sandbox.window.ui.status import hud_status
from tests.toml_text import toml
from tests.window.pressing import FOCUS_LOST, key, key_up, move, press, release

pytestmark = pytest.mark.fail_slow(60)  # a window or a film

SIZE = (900, 600)
PICTURE = pygame.Rect(0, 165, 630, 235)
"""Region that neither text, nor the panel, nor the timeline covers, px."""
HUD = pygame.Rect(10, 10, 360, 150)
DT = 0.01  # s
ROOM = (
    'title = "Room"\n'
    + toml("world", duration=5.0)
    + toml("solver", dt=0.01)
    + toml("wall", points=[[-2.0, -1.5], [2.0, -1.5], [2.0, 1.5], [-2.0, 1.5]], closed=True)
    + toml("ball", name="a", position=[-1.0, 0.0], radius=0.4)
)
PLAY_KEYS = toml(
    "emitter", name="spark", position=[1.0, 0.0], count=3, velocity_min=[-1, -1], velocity_max=[1, 1], radius=0.05
) + toml("play", arrows="a", arrow_step=0.25, relaunch="spark")
BALL_START, TARGET = (-1.0, 0.0), (1.2, 0.2)

OpenWindow = Callable[[str], App]


@pytest.fixture
def printed() -> list[str]:
    """Lines that the window prints."""
    return []


@pytest.fixture
def open_window(tmp_path: Path, printed: list[str], monkeypatch: pytest.MonkeyPatch) -> Iterator[OpenWindow]:
    """Return a function that opens a window on a scene. No step budget: slow machines skip no steps."""
    monkeypatch.setattr("sandbox.window.playback.live.MIN_STEP_BUDGET", math.inf)
    monkeypatch.setattr("sandbox.window.playback.live.MAX_STEP_BUDGET", math.inf)
    windows: list[App] = []

    def open_on(text: str) -> App:
        path = tmp_path / "room.toml"
        path.write_text(text, encoding="utf-8")
        window = App(AppState(), size=SIZE, folder=tmp_path, say=printed.append)
        windows.append(window)
        assert window.app_state.open(path)
        pygame.event.clear()  # events of opening the window
        return window

    yield open_on
    for window in windows:
        window.close()


@pytest.fixture
def window(open_window: OpenWindow) -> App:
    """Return a window that shows a ball at rest."""
    return open_window(ROOM)


def run_frame(window: App, *events: pygame.event.Event, elapsed: float = 0.0) -> None:
    """Post events, and run one frame of the window."""
    for event in events:
        pygame.event.post(event)
    window.run_frame(elapsed)


def live(window: App) -> LiveView:
    assert window.app_state.live is not None
    return window.app_state.live


def pixels_of(
    surface: pygame.Surface, colour: RgbColour, box: pygame.Rect
) -> "np.ndarray[tuple[int, int], np.dtype[np.intp]]":
    """Return the pixels of a colour in a region, (P, 2)."""
    part = pygame.surfarray.array3d(surface.subsurface(box)).astype(np.int16)
    found = (np.abs(part - np.asarray(colour)) <= 6).all(axis=2)
    return np.asarray(np.argwhere(found) + np.asarray(box.topleft))


def drawn_ball(window: App) -> tuple[float, float]:
    x, y = (pixels_of(window.context.surface, SKY, PICTURE).mean(axis=0) + 0.5).tolist()
    return x, y


def on_screen(window: App, point: tuple[float, float]) -> tuple[float, float]:
    x, y = window.context.camera.to_screen(np.asarray(point)).tolist()
    return x, y


def shows_paused(window: App) -> bool:
    """Return whether the state display shows PAUSED in red."""
    return len(pixels_of(window.context.surface, WARNING, HUD)) > 60


def test_key_takes_effect_in_the_picture_of_the_same_frame(window: App) -> None:
    run_frame(window)
    assert not shows_paused(window)
    run_frame(window, key(pygame.K_p), key_up(pygame.K_p))
    assert shows_paused(window)
    assert pygame.display.get_surface() is window.context.surface
    run_frame(window, key(pygame.K_SPACE), key_up(pygame.K_SPACE))
    assert not shows_paused(window)


def test_ball_moved_while_paused_is_drawn_there_in_the_same_frame(window: App) -> None:
    window.app_state.paused = True
    run_frame(window)
    start, target = on_screen(window, BALL_START), on_screen(window, TARGET)
    assert drawn_ball(window) == pytest.approx(start, abs=1.0)  # a pixel
    run_frame(window, press(*start), move(*target, held=True))
    assert drawn_ball(window) == pytest.approx(target, abs=4.0)  # text of the picked ball covers some pixels
    run_frame(window, release(*target))
    assert drawn_ball(window) == pytest.approx(target, abs=4.0)  # as above
    assert live(window).step_number == 0


def test_pull_moves_the_ball_in_the_same_frame_until_the_focus_is_lost(window: App) -> None:
    run_frame(window)
    before = live(window).frame.position[0, 0]
    run_frame(
        window, press(*on_screen(window, BALL_START)), move(*on_screen(window, TARGET), held=True), elapsed=2 * DT
    )
    assert live(window).frame.position[0, 0] > before
    assert [action.kind for action in live(window).session.actions] == ["pull", "pull"]
    assert window.app_state.body_tools.is_holding
    run_frame(window, FOCUS_LOST)  # ends it
    assert not window.app_state.body_tools.is_holding
    assert getattr(live(window).session.actions[-1], "target", 0) is None


@pytest.mark.parametrize("stopped", [True, False])
def test_click_with_small_mouse_motion_only_picks(window: App, stopped: bool) -> None:
    run_frame(window, elapsed=3 * DT)
    window.app_state.paused = stopped
    end, (x, y) = live(window).end_time, on_screen(window, BALL_START)
    run_frame(window, press(x, y), move(x + 1, y + 1, held=True), elapsed=DT)
    run_frame(window, move(x + 3, y, held=True), release(x + 3, y), elapsed=DT)
    run_frame(window, move(x + 90, y), elapsed=DT)
    assert window.app_state.body_tools.picked == 0
    assert not window.app_state.body_tools.is_holding
    assert live(window).session.actions == ()
    assert live(window).end_time >= end


def test_drag_keeps_the_grabbed_point_of_the_body(window: App) -> None:
    window.app_state.paused = True
    (x, y), (right, down) = on_screen(window, BALL_START), on_screen(window, TARGET)
    run_frame(window, press(x + 10, y), move(x + 13, y, held=True))
    run_frame(window, move(right + 10, down, held=True))
    assert live(window).frame.position[0] == pytest.approx(
        TARGET, abs=1.5 / window.context.camera.scale
    )  # rounding to pixels


def test_mouse_motions_of_one_frame_are_one_action(window: App) -> None:
    window.app_state.paused = True
    (x, y), (right, down) = on_screen(window, BALL_START), on_screen(window, TARGET)
    run_frame(window, press(x, y), *(move(x + k, y, held=True) for k in range(1, 60)), move(right, down, held=True))
    assert [action.kind for action in live(window).session.actions] == ["move"]
    run_frame(window, move(x, y, held=True), move(x + 50, y, held=True), release(x + 50, y), move(x, y))
    assert [action.kind for action in live(window).session.actions] == ["move", "move"]
    assert live(window).frame.position[0, 0] == pytest.approx(
        BALL_START[0] + 50 / window.context.camera.scale, abs=0.02
    )  # 2 pixels


def test_changes_of_a_parameter_are_one_action_before_the_next_command(window: App) -> None:
    run_frame(window)
    change = window.context.gui.panel.on_change
    for value in (1.0, 2.0, -4.0):
        change("gravity", value, False)
    window.commands.run(Command.PAUSE)
    run_frame(window)
    (action,) = live(window).session.actions
    assert isinstance(action, SetParameter)
    assert action.value == [0.0, -4.0]


@pytest.mark.parametrize("code", [pygame.K_o, pygame.K_F1])
def test_held_body_and_buttons_are_released_when_picker_or_help_opens(window: App, code: int) -> None:
    run_frame(
        window, press(*on_screen(window, BALL_START)), move(*on_screen(window, TARGET), held=True), press(5, 300, 3)
    )
    assert window.app_state.body_tools.is_holding
    run_frame(window, key(code, pygame.KMOD_CTRL if code == pygame.K_o else 0))
    assert not window.app_state.body_tools.is_holding
    assert getattr(live(window).session.actions[-1], "target", 0) is None
    home = window.context.camera
    run_frame(window, key(pygame.K_ESCAPE), key_up(pygame.K_ESCAPE))
    run_frame(window, move(400, 400))
    run_frame(window, pygame.event.Event(pygame.MOUSEMOTION, pos=(450, 400), rel=(50, 0), buttons=(0, 0, 0)))
    assert window.context.camera == home


def test_picker_help_and_panel_keys_are_ignored_while_scrubbing(window: App) -> None:
    run_frame(window, elapsed=0.08)
    run_frame(window)
    bar = window.context.surface.get_height() - window.context.gui.bottom_margin // 2
    run_frame(window, press(200, bar))
    step = live(window).step_number
    assert step < 8
    run_frame(window, key(pygame.K_o, pygame.KMOD_CTRL), key(pygame.K_F1), key(pygame.K_TAB))
    assert (window.context.gui.scene_browser, window.context.gui.help.open, window.context.gui.panel.visible) == (
        None,
        False,
        True,
    )
    run_frame(window, release(200, bar))
    while live(window).busy is not None:
        run_frame(window)
    assert live(window).session.step_number == step  # the session has moved to the scrubbed step
    run_frame(window, move(500, bar), move(250, 300))
    assert live(window).step_number == step


def test_button_release_is_handled_while_scrubbing(window: App) -> None:
    run_frame(window, elapsed=0.05)
    bar = window.context.surface.get_height() - window.context.gui.bottom_margin // 2
    run_frame(window, press(300, 300, 2), press(200, bar), release(200, bar, 2), release(200, bar))
    home = window.context.camera
    run_frame(window, pygame.event.Event(pygame.MOUSEMOTION, pos=(320, 300), rel=(20, 0), buttons=(0, 0, 0)))
    assert window.context.camera == home


def test_keys_of_a_scene_are_announced_once_and_only_arrows_repeat(open_window: OpenWindow) -> None:
    window = open_window(ROOM + PLAY_KEYS)
    run_frame(window)
    announced = [text for _, text in window.app_state.messages.visible()]
    assert announced == ["Arrows: move a by 0.25 m", "Space: relaunch spark"]
    window.app_state.messages = Messages()
    run_frame(window, key(pygame.K_SPACE), key(pygame.K_SPACE), key(pygame.K_SPACE))
    assert [action.kind for action in live(window).session.actions] == ["launch"]
    run_frame(window, key_up(pygame.K_SPACE), key(pygame.K_SPACE), *(key(pygame.K_UP) for _ in range(3)))
    assert [action.kind for action in live(window).session.actions] == ["launch"] * 2 + ["move"] * 3
    run_frame(window, key(pygame.K_r))
    assert not window.app_state.messages.visible()


@pytest.mark.parametrize("code", [pygame.K_n, pygame.K_DELETE])
def test_key_for_a_picked_body_without_one_shows_a_warning(window: App, code: int) -> None:
    run_frame(window, key(code))
    assert window.app_state.messages.visible() == (("warning", "select a body first: click it"),)


def test_fault_list_is_closed_by_a_click_on_it_or_by_escape(window: App) -> None:
    for event in (press(*window.context.surface.get_rect().move(-130, 0).center), key(pygame.K_ESCAPE)):
        window.app_state.faults = ("room.toml:3: ball: wrong",)
        run_frame(window)
        run_frame(window, press(5, 300), release(5, 300))
        assert window.app_state.faults
        run_frame(window, event, release(5, 300))
        assert not window.app_state.faults
        assert window.context.exit_status is None
    run_frame(window, key_up(pygame.K_ESCAPE), key(pygame.K_ESCAPE))
    assert window.context.exit_status == 0


def test_end_of_the_session_is_shown_until_scrubbed_back(window: App) -> None:
    run_frame(window, elapsed=0.05)
    session = live(window).session
    session.ended = "at 0.05 s: it broke"
    assert hud_status(window.app_state, (), 60.0, None).ended == session.ended
    live(window).scrub(0.0)
    assert hud_status(window.app_state, (), 60.0, None).ended is None


def test_each_step_key_makes_one_step_within_one_frame(window: App) -> None:
    strokes = [event for _ in range(5) for event in (key(pygame.K_o), key_up(pygame.K_o))]
    run_frame(window, *strokes, elapsed=1.0)
    assert live(window).step_number == 5
    assert window.app_state.paused


def test_picture_after_a_step_shows_that_step(open_window: OpenWindow) -> None:
    window = open_window(ROOM + "velocity = [20.0, 0.0]\n")
    window.app_state.paused = True
    run_frame(window)
    for step_number in (1, 2, 3):
        run_frame(window, key(pygame.K_PERIOD, unicode="."), key_up(pygame.K_PERIOD))
        assert live(window).step_number == step_number
        point = on_screen(window, (-1.0 + 20.0 * DT * step_number, 0.0))
        assert drawn_ball(window) == pytest.approx(point, abs=1.0)  # a pixel; a step is 28
    run_frame(window, key(pygame.K_COMMA, unicode=","), key_up(pygame.K_COMMA))
    while live(window).busy is not None:
        run_frame(window)
    assert drawn_ball(window) == pytest.approx(on_screen(window, (-1.0 + 20.0 * DT * 2, 0.0)), abs=1.0)  # a pixel


def test_picture_of_a_pause_shows_the_current_state(open_window: OpenWindow) -> None:
    window = open_window(ROOM + "velocity = [20.0, 0.0]\n")
    run_frame(window, elapsed=2.5 * DT)
    run_frame(window, key(pygame.K_p), key_up(pygame.K_p), elapsed=0.4 * DT)
    x, y = live(window).frame.position[0].tolist()
    assert drawn_ball(window) == pytest.approx(on_screen(window, (x, y)), abs=1.0)  # a pixel; a step is 28


def test_panned_camera_survives_restart_and_home_resets_it(window: App) -> None:
    home = window.context.camera
    run_frame(
        window,
        press(300, 300, 3),
        pygame.event.Event(pygame.MOUSEMOTION, pos=(340, 330), rel=(40, 30), buttons=(0, 0, 1)),
    )
    run_frame(window, release(340, 330, 3))
    moved = window.context.camera
    assert moved == home.panned((40, 30))
    run_frame(window, key(pygame.K_r), key_up(pygame.K_r))
    assert window.context.camera == moved
    run_frame(window, key(pygame.K_HOME), key_up(pygame.K_HOME))
    assert window.context.camera == home


def test_home_shows_bodies_out_of_view_and_again_the_initial_view(open_window: OpenWindow) -> None:
    away = open_window(ROOM.replace("radius = 0.4", "radius = 0.4\nvelocity = [0.0, 50.0]\ncollides = 'none'"))
    home = away.context.camera
    run_frame(away, elapsed=0.1)
    for _ in range(30):
        run_frame(away, elapsed=0.1)
    assert not len(pixels_of(away.context.surface, SKY, PICTURE))
    run_frame(away, key(pygame.K_HOME), key_up(pygame.K_HOME))
    assert len(pixels_of(away.context.surface, SKY, PICTURE))
    run_frame(away, key(pygame.K_HOME), key_up(pygame.K_HOME))
    assert away.context.camera == home


def test_ball_is_added_at_the_mouse_or_else_at_the_centre(window: App) -> None:
    mouse = (1.2, 1.0)  # beside the first ball
    for point, events in ((window.context.camera.centre, ()), (mouse, (move(*on_screen(window, mouse)),))):
        run_frame(window, *events, key(pygame.K_b, unicode="b"), key_up(pygame.K_b))
        spawn = live(window).session.actions[-1]
        assert isinstance(spawn, Spawn)
        assert spawn.ball.position == pytest.approx(point, abs=1.0 / window.context.camera.scale)  # a pixel


def test_resized_window_is_redrawn_at_any_size(window: App) -> None:
    for size in ((200, 150), (1, 1), (1500, 400), SIZE):
        pygame.display.set_mode(size, pygame.RESIZABLE)
        run_frame(window, pygame.event.Event(pygame.VIDEORESIZE, size=size, w=size[0], h=size[1]))
        assert window.context.surface.get_size() == window.context.camera.size == size
    assert drawn_ball(window) == pytest.approx(on_screen(window, BALL_START), abs=1.0)  # a pixel


def test_written_files_are_reported_in_the_window_and_on_the_terminal(
    window: App, printed: list[str], tmp_path: Path
) -> None:
    run_frame(window)
    run_frame(window, key(pygame.K_p, pygame.KMOD_CTRL), key_up(pygame.K_p))
    path = tmp_path / "sandbox-room-1.png"
    assert printed == [f"screenshot: {path}"]
    assert ("info", printed[0]) in window.app_state.messages.visible()
    assert pygame.image.load(path).get_size() == SIZE


def test_window_of_a_stored_run_warns_about_unavailable_commands(open_window: OpenWindow, tmp_path: Path) -> None:
    import sandbox
    from sandbox.window.playback.recorded import RecordedRun

    window = open_window(ROOM)
    view = RecordedView(RecordedRun(sandbox.run(sandbox.load(tmp_path / "room.toml"))))
    window.app_state.show(view, None, view.scene)
    view.scrub(view.end_time)
    assert hud_status(window.app_state, (), 60.0, None).ended == "end of the run"
    view.scrub(view.start_time)
    assert hud_status(window.app_state, (), 60.0, None).ended is None
    for code in (pygame.K_e, pygame.K_g, pygame.K_t, pygame.K_b, pygame.K_n, pygame.K_DELETE):
        run_frame(window, key(code), key_up(code))
        assert window.app_state.messages.visible()[-1][0] == "warning"
    assert window.app_state.view is view


def test_quit_event_and_escape_end_the_loop(window: App) -> None:
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    assert window.run() == 0
    window.context.exit_status = None
    pygame.event.post(key(pygame.K_ESCAPE))
    assert window.run() == 0


@pytest.mark.parametrize(("signal_number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 0)])
def test_signal_ends_the_loop_and_previous_handlers_are_restored(
    window: App, signal_number: signal.Signals, status: int
) -> None:
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    draw = window.draw

    def draw_and_interrupt() -> None:
        draw()
        signal.raise_signal(signal_number)

    window.draw = draw_and_interrupt  # type: ignore[method-assign]  # the signal arrives while a picture is drawn
    assert window.run() == status
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == before


def test_missing_display_raises_an_error(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    pygame.quit()
    monkeypatch.setitem(os.environ, "SDL_VIDEODRIVER", "none-such")
    with pytest.raises(NoDisplayError, match="cannot open a window"):
        open_screen(None, "none")
    assert not pygame.display.get_init()
    assert capfd.readouterr().err == ""


def test_wait_message_can_be_drawn_while_the_surface_is_locked(window: App) -> None:
    """A drawing kernel may be compiled while it holds the pixels, which the message needs too."""
    window.run_frame(0.0)
    before = pygame.surfarray.array3d(window.context.surface)
    lock = memoryview(window.context.surface.get_buffer())  # type: ignore[arg-type]  # a buffer, which its stub omits
    assert window.context.surface.get_locked()
    window.context.gui.draw_wait(window.context.surface, "compiling")
    lock.release()
    locked = pygame.surfarray.array3d(window.context.surface)
    window.context.gui.draw_wait(window.context.surface, "compiling")
    assert (locked != before).any()
    assert (pygame.surfarray.array3d(window.context.surface) == locked).all()


def test_digit_keys_toggle_every_overlay(open_window: OpenWindow) -> None:
    window = open_window(ROOM + "velocity = [1.0, 0.5]\n" + PLAY_KEYS)
    run_frame(window, elapsed=0.05)
    window.app_state.paused = True
    for code, name in zip("1234567890", OVERLAYS, strict=True):
        before = set(window.context.gui.overlays)
        for expected in (before ^ {name}, before):
            run_frame(window, key(ord(code), unicode=code), key_up(ord(code)))
            assert set(window.context.gui.overlays) == expected


def test_film_is_recorded_until_it_is_stopped_or_the_window_closes(
    open_window: OpenWindow, printed: list[str], tmp_path: Path
) -> None:
    window = open_window(ROOM + "velocity = [1.0, 0.5]\n")
    for number in (1, 2):
        run_frame(window, key(pygame.K_r, pygame.KMOD_CTRL), key_up(pygame.K_r))
        for _ in range(4):
            run_frame(window, elapsed=0.05)
        if number == 1:
            run_frame(window, key(pygame.K_r, pygame.KMOD_CTRL), key_up(pygame.K_r))
        else:
            window.close()
        film = tmp_path / f"sandbox-room-{number}.gif"
        assert printed[-1] == f"recorded: {film}"
        with Image.open(film) as image:
            assert image.size == window.context.gui.area.size
            assert getattr(image, "n_frames", 1) > 1
    assert not list(tmp_path.glob(".*.tmp"))
