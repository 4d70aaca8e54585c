"""The window's loop without a display: what is posted before a turn is seen at the end of that same turn."""

import math
import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pygame
import pytest

from sandbox.action import SetParameter, Spawn
from sandbox.window.app import App
from sandbox.window.app_state import AppState, Messages
from sandbox.window.display import NoDisplayError, open_screen
from sandbox.window.input.keymap import Command
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.recorded import RecordedView
from sandbox.window.render.palette import SKY, WARNING, RgbColour
from sandbox.window.ui.status import hud_status
from tests.window.pressing import FOCUS_LOST, key, key_up, move, press, release

pytestmark = pytest.mark.full  # a window or a film

SIZE = (900, 600)
PICTURE = pygame.Rect(0, 165, 630, 235)
"""What neither words, nor the panel, nor the timeline cover."""
HUD = pygame.Rect(10, 10, 360, 150)
DT = 0.01  # s
ROOM = """
title = "Room"
[world]
duration = 5.0
[solver]
dt = 0.01
[[wall]]
points = [[-2.0, -1.5], [2.0, -1.5], [2.0, 1.5], [-2.0, 1.5]]
closed = true
[[ball]]
name = "a"
position = [-1.0, 0.0]
radius = 0.4
"""
CLAIMS = """
[[emitter]]
name = "spark"
position = [1.0, 0.0]
count = 3
velocity_min = [-1.0, -1.0]
velocity_max = [1.0, 1.0]
radius = 0.05
[play]
arrows = "a"
arrow_step = 0.25
relaunch = "spark"
"""
BALL, THERE = (-1.0, 0.0), (1.2, 0.2)

Open = Callable[[str], App]


@pytest.fixture
def said() -> list[str]:
    """What the window prints."""
    return []


@pytest.fixture
def opened(tmp_path: Path, said: list[str], monkeypatch: pytest.MonkeyPatch) -> Iterator[Open]:
    """Open a window on a scene. However slow the machine is, no picture gives up steps for it."""
    monkeypatch.setattr("sandbox.window.playback.live.MIN_STEP_BUDGET", math.inf)
    monkeypatch.setattr("sandbox.window.playback.live.MAX_STEP_BUDGET", math.inf)
    windows: list[App] = []

    def open_on(text: str) -> App:
        path = tmp_path / "room.toml"
        path.write_text(text, encoding="utf-8")
        window = App(AppState(), size=SIZE, folder=tmp_path, say=said.append)
        windows.append(window)
        assert window.app_state.open(path)
        pygame.event.clear()  # those of its opening
        return window

    yield open_on
    for window in windows:
        window.close()


@pytest.fixture
def window(opened: Open) -> App:
    """A window on a ball at rest."""
    return opened(ROOM)


def turn(window: App, *events: pygame.event.Event, elapsed: float = 0.0) -> None:
    """Post events, and let the window make one turn."""
    for event in events:
        pygame.event.post(event)
    window.run_frame(elapsed)


def live(window: App) -> LiveView:
    assert window.app_state.live is not None
    return window.app_state.live


def places(
    surface: pygame.Surface, colour: RgbColour, box: pygame.Rect
) -> "np.ndarray[tuple[int, int], np.dtype[np.intp]]":
    """Return the pixels of a colour in a region, (P, 2)."""
    part = pygame.surfarray.array3d(surface.subsurface(box)).astype(np.int16)
    found = (np.abs(part - np.asarray(colour)) <= 6).all(axis=2)
    return np.asarray(np.argwhere(found) + np.asarray(box.topleft))


def ball_seen(window: App) -> tuple[float, float]:
    x, y = (places(window.context.surface, SKY, PICTURE).mean(axis=0) + 0.5).tolist()
    return x, y


def on_screen(window: App, place: tuple[float, float]) -> tuple[float, float]:
    x, y = window.context.camera.to_screen(np.asarray(place)).tolist()
    return x, y


def paused(window: App) -> bool:
    """Tell whether PAUSED stands there in red."""
    return len(places(window.context.surface, WARNING, HUD)) > 60


def test_key_is_seen_in_the_picture_of_the_same_turn(window: App) -> None:
    turn(window)
    assert not paused(window)
    turn(window, key(pygame.K_p), key_up(pygame.K_p))
    assert paused(window)
    assert pygame.display.get_surface() is window.context.surface
    turn(window, key(pygame.K_SPACE), key_up(pygame.K_SPACE))
    assert not paused(window)


def test_ball_moved_while_paused_is_seen_there_in_the_same_turn(window: App) -> None:
    window.app_state.paused = True
    turn(window)
    here, there = on_screen(window, BALL), on_screen(window, THERE)
    assert ball_seen(window) == pytest.approx(here, abs=1.0)  # a pixel
    turn(window, press(*here), move(*there, held=True))
    assert ball_seen(window) == pytest.approx(there, abs=4.0)  # what is told of the picked ball covers some pixels
    turn(window, release(*there))
    assert ball_seen(window) == pytest.approx(there, abs=4.0)  # as above
    assert live(window).step_number == 0


def test_pull_moves_the_ball_in_the_same_turn(window: App) -> None:
    turn(window)
    before = live(window).frame.position[0, 0]
    turn(window, press(*on_screen(window, BALL)), move(*on_screen(window, THERE), held=True), elapsed=2 * DT)
    assert live(window).frame.position[0, 0] > before
    assert [action.kind for action in live(window).session.actions] == ["pull", "pull"]


def test_pull_ends_when_the_window_loses_the_keyboard(window: App) -> None:
    turn(window, press(*on_screen(window, BALL)), move(*on_screen(window, THERE), held=True), elapsed=DT)
    assert window.app_state.body_tools.is_holding
    turn(window, FOCUS_LOST)
    assert not window.app_state.body_tools.is_holding
    assert getattr(live(window).session.actions[-1], "target", 0) is None


@pytest.mark.parametrize("stopped", [True, False])
def test_click_with_a_trembling_hand_only_picks(window: App, stopped: bool) -> None:
    turn(window, elapsed=3 * DT)
    window.app_state.paused = stopped
    end, (x, y) = live(window).end_time, on_screen(window, BALL)
    turn(window, press(x, y), move(x + 1, y + 1, held=True), elapsed=DT)
    turn(window, move(x + 3, y, held=True), release(x + 3, y), elapsed=DT)
    turn(window, move(x + 90, y), elapsed=DT)
    assert window.app_state.body_tools.picked == 0
    assert not window.app_state.body_tools.is_holding
    assert live(window).session.actions == ()
    assert live(window).end_time >= end


def test_drag_takes_the_body_where_it_was_pressed(window: App) -> None:
    window.app_state.paused = True
    (x, y), (right, down) = on_screen(window, BALL), on_screen(window, THERE)
    turn(window, press(x + 10, y), move(x + 13, y, held=True))
    turn(window, move(right + 10, down, held=True))
    assert live(window).frame.position[0] == pytest.approx(
        THERE, abs=1.5 / window.context.camera.scale
    )  # rounding to pixels


def test_many_motions_of_a_turn_are_one_action(window: App) -> None:
    window.app_state.paused = True
    (x, y), (right, down) = on_screen(window, BALL), on_screen(window, THERE)
    turn(window, press(x, y), *(move(x + k, y, held=True) for k in range(1, 60)), move(right, down, held=True))
    assert [action.kind for action in live(window).session.actions] == ["move"]
    turn(window, move(x, y, held=True), move(x + 50, y, held=True), release(x + 50, y), move(x, y))
    assert [action.kind for action in live(window).session.actions] == ["move", "move"]
    assert live(window).frame.position[0, 0] == pytest.approx(
        BALL[0] + 50 / window.context.camera.scale, abs=0.02
    )  # 2 pixels


def test_many_motions_of_a_knob_are_one_action_before_the_next_command(window: App) -> None:
    turn(window)
    change = window.context.gui.panel.on_change
    for value in (1.0, 2.0, -4.0):
        change("gravity", value, False)
    window.commands.run(Command.PAUSE)
    turn(window)
    (action,) = live(window).session.actions
    assert isinstance(action, SetParameter)
    assert action.value == [0.0, -4.0]


@pytest.mark.parametrize("code", [pygame.K_o, pygame.K_F1])
def test_all_that_is_held_is_let_go_before_something_hides_it(window: App, code: int) -> None:
    turn(window, press(*on_screen(window, BALL)), move(*on_screen(window, THERE), held=True), press(5, 300, 3))
    assert window.app_state.body_tools.is_holding
    turn(window, key(code, pygame.KMOD_CTRL if code == pygame.K_o else 0))
    assert not window.app_state.body_tools.is_holding
    assert getattr(live(window).session.actions[-1], "target", 0) is None
    home = window.context.camera
    turn(window, key(pygame.K_ESCAPE), key_up(pygame.K_ESCAPE))
    turn(window, move(400, 400))
    turn(window, pygame.event.Event(pygame.MOUSEMOTION, pos=(450, 400), rel=(50, 0), buttons=(0, 0, 0)))
    assert window.context.camera == home


def test_nothing_hides_the_timeline_while_it_is_held(window: App) -> None:
    turn(window, elapsed=0.08)
    turn(window)
    bar = window.context.surface.get_height() - window.context.gui.bottom_margin // 2
    turn(window, press(200, bar))
    step = live(window).step_number
    assert step < 8
    turn(window, key(pygame.K_o, pygame.KMOD_CTRL), key(pygame.K_F1), key(pygame.K_TAB))
    assert (window.context.gui.scene_browser, window.context.gui.help.open, window.context.gui.panel.visible) == (
        None,
        False,
        True,
    )
    turn(window, release(200, bar))
    while live(window).busy is not None:
        turn(window)
    assert live(window).session.step_number == step  # it has gone where it was looked at
    turn(window, move(500, bar), move(250, 300))
    assert live(window).step_number == step


def test_release_reaches_the_mouse_while_the_timeline_is_held(window: App) -> None:
    turn(window, elapsed=0.05)
    bar = window.context.surface.get_height() - window.context.gui.bottom_margin // 2
    turn(window, press(300, 300, 2), press(200, bar), release(200, bar, 2), release(200, bar))
    home = window.context.camera
    turn(window, pygame.event.Event(pygame.MOUSEMOTION, pos=(320, 300), rel=(20, 0), buttons=(0, 0, 0)))
    assert window.context.camera == home


def test_claimed_keys_are_told_once_and_only_arrows_repeat(opened: Open) -> None:
    window = opened(ROOM + CLAIMS)
    turn(window)
    told = [text for _, text in window.app_state.messages.visible()]
    assert told == ["Arrows: move a by 0.25 m", "Space: relaunch spark"]
    window.app_state.messages = Messages()
    turn(window, key(pygame.K_SPACE), key(pygame.K_SPACE), key(pygame.K_SPACE))
    assert [action.kind for action in live(window).session.actions] == ["launch"]
    turn(window, key_up(pygame.K_SPACE), key(pygame.K_SPACE), *(key(pygame.K_UP) for _ in range(3)))
    assert [action.kind for action in live(window).session.actions] == ["launch"] * 2 + ["move"] * 3
    turn(window, key(pygame.K_r))
    assert not window.app_state.messages.visible()


@pytest.mark.parametrize("code", [pygame.K_n, pygame.K_DELETE])
def test_key_for_a_picked_body_says_that_none_is(window: App, code: int) -> None:
    turn(window, key(code))
    assert window.app_state.messages.visible() == (("warning", "select a body first: click it"),)


def test_faults_are_closed_by_a_click_on_them_or_by_escape(window: App) -> None:
    for event in (press(*window.context.surface.get_rect().move(-130, 0).center), key(pygame.K_ESCAPE)):
        window.app_state.faults = ("room.toml:3: ball: wrong",)
        turn(window)
        turn(window, press(5, 300), release(5, 300))
        assert window.app_state.faults
        turn(window, event, release(5, 300))
        assert not window.app_state.faults
        assert window.context.exit_status is None
    turn(window, key_up(pygame.K_ESCAPE), key(pygame.K_ESCAPE))
    assert window.context.exit_status == 0


def test_end_is_told_until_one_goes_back(window: App) -> None:
    turn(window, elapsed=0.05)
    session = live(window).session
    session.ended = "at 0.05 s: it broke"
    assert hud_status(window.app_state, (), 60.0, None).ended == session.ended
    live(window).scrub(0.0)
    assert hud_status(window.app_state, (), 60.0, None).ended is None


def test_press_and_release_within_one_turn_pull_nothing(window: App) -> None:
    here = on_screen(window, BALL)
    turn(window, press(*here), release(*here), elapsed=DT)
    assert not window.app_state.body_tools.is_holding
    assert window.app_state.body_tools.picked == 0
    assert live(window).session.actions == ()


@pytest.mark.parametrize("pictures", [1, 3, 7])
def test_steps_follow_from_time_and_not_from_pictures(window: App, pictures: int) -> None:
    for _ in range(pictures):
        turn(window, elapsed=0.07 / pictures)
    # 0.07 / 3 three times may fall short of 7 steps by rounding
    assert live(window).step_number in ((7,) if pictures == 1 else (6, 7))


def test_time_the_machine_lost_is_not_caught_up_with(window: App) -> None:
    turn(window, elapsed=1000.0)
    assert live(window).step_number == round(0.1 / DT)


def test_step_keys_make_one_step_each_however_many_come_in_a_turn(window: App) -> None:
    strokes = [event for _ in range(5) for event in (key(pygame.K_o), key_up(pygame.K_o))]
    turn(window, *strokes, elapsed=1.0)
    assert live(window).step_number == 5
    assert window.app_state.paused


def test_picture_of_a_step_is_that_step(opened: Open) -> None:
    window = opened(ROOM + "velocity = [20.0, 0.0]\n")
    window.app_state.paused = True
    turn(window)
    for number in (1, 2, 3):
        turn(window, key(pygame.K_PERIOD, unicode="."), key_up(pygame.K_PERIOD))
        assert live(window).step_number == number
        place = on_screen(window, (-1.0 + 20.0 * DT * number, 0.0))
        assert ball_seen(window) == pytest.approx(place, abs=1.0)  # a pixel; a step is 28
    turn(window, key(pygame.K_COMMA, unicode=","), key_up(pygame.K_COMMA))
    while live(window).busy is not None:
        turn(window)
    assert ball_seen(window) == pytest.approx(on_screen(window, (-1.0 + 20.0 * DT * 2, 0.0)), abs=1.0)  # a pixel


def test_picture_of_a_pause_is_the_state_that_is_told(opened: Open) -> None:
    window = opened(ROOM + "velocity = [20.0, 0.0]\n")
    turn(window, elapsed=2.5 * DT)
    turn(window, key(pygame.K_p), key_up(pygame.K_p), elapsed=0.4 * DT)
    x, y = live(window).frame.position[0].tolist()
    assert ball_seen(window) == pytest.approx(on_screen(window, (x, y)), abs=1.0)  # a pixel; a step is 28


def test_held_key_pauses_once(window: App) -> None:
    turn(window, key(pygame.K_p))
    for _ in range(4):
        turn(window, key(pygame.K_p))
    assert window.app_state.paused
    turn(window, key_up(pygame.K_p), key(pygame.K_p))
    assert not window.app_state.paused


def test_camera_stays_where_it_was_put_and_home_brings_it_back(window: App) -> None:
    home = window.context.camera
    turn(
        window,
        press(300, 300, 3),
        pygame.event.Event(pygame.MOUSEMOTION, pos=(340, 330), rel=(40, 30), buttons=(0, 0, 1)),
    )
    turn(window, release(340, 330, 3))
    moved = window.context.camera
    assert moved == home.panned((40, 30))
    turn(window, key(pygame.K_r), key_up(pygame.K_r))
    assert window.context.camera == moved
    turn(window, key(pygame.K_HOME), key_up(pygame.K_HOME))
    assert window.context.camera == home


def test_home_once_more_finds_the_bodies_where_they_are_now(opened: Open) -> None:
    away = opened(ROOM.replace("radius = 0.4", "radius = 0.4\nvelocity = [0.0, 50.0]\ncollides = 'none'"))
    home = away.context.camera
    turn(away, elapsed=0.1)
    for _ in range(30):
        turn(away, elapsed=0.1)
    assert not len(places(away.context.surface, SKY, PICTURE))
    turn(away, key(pygame.K_HOME), key_up(pygame.K_HOME))
    assert len(places(away.context.surface, SKY, PICTURE))
    turn(away, key(pygame.K_HOME), key_up(pygame.K_HOME))
    assert away.context.camera == home


def test_ball_is_added_under_the_mouse_or_before_it_came_in_the_middle(window: App) -> None:
    beside = (1.2, 1.0)  # of the first one
    for place, told in ((window.context.camera.centre, ()), (beside, (move(*on_screen(window, beside)),))):
        turn(window, *told, key(pygame.K_b, unicode="b"), key_up(pygame.K_b))
        spawn = live(window).session.actions[-1]
        assert isinstance(spawn, Spawn)
        assert spawn.ball.position == pytest.approx(place, abs=1.0 / window.context.camera.scale)  # a pixel


def test_resized_window_is_drawn_whole(window: App) -> None:
    for size in ((200, 150), (1, 1), (1500, 400), SIZE):
        pygame.display.set_mode(size, pygame.RESIZABLE)
        turn(window, pygame.event.Event(pygame.VIDEORESIZE, size=size, w=size[0], h=size[1]))
        assert window.context.surface.get_size() == window.context.camera.size == size
    assert ball_seen(window) == pytest.approx(on_screen(window, BALL), abs=1.0)  # a pixel


def test_files_are_told_in_the_window_and_on_the_terminal(window: App, said: list[str], tmp_path: Path) -> None:
    turn(window)
    turn(window, key(pygame.K_p, pygame.KMOD_CTRL), key_up(pygame.K_p))
    path = tmp_path / "sandbox-room-1.png"
    assert said == [f"screenshot: {path}"]
    assert ("info", said[0]) in window.app_state.messages.visible()
    assert pygame.image.load(path).get_size() == SIZE


def test_window_of_a_stored_run_tells_what_cannot_be_done(opened: Open, tmp_path: Path) -> None:
    import sandbox
    from sandbox.window.playback.recorded import RecordedRun

    window = opened(ROOM)
    show = RecordedView(RecordedRun(sandbox.run(sandbox.load(tmp_path / "room.toml"))))
    window.app_state.show(show, None, show.scene)
    show.scrub(show.end_time)
    assert hud_status(window.app_state, (), 60.0, None).ended == "end of the run"
    show.scrub(show.start_time)
    assert hud_status(window.app_state, (), 60.0, None).ended is None
    for code in (pygame.K_e, pygame.K_g, pygame.K_t, pygame.K_b, pygame.K_n, pygame.K_DELETE):
        turn(window, key(code), key_up(code))
        assert window.app_state.messages.visible()[-1][0] == "warning"
    assert window.app_state.view is show


def test_quit_and_escape_end_the_loop(window: App) -> None:
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    assert window.run() == 0
    window.context.exit_status = None
    pygame.event.post(key(pygame.K_ESCAPE))
    assert window.run() == 0


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 0)])
def test_signal_ends_the_loop_and_leaves_others_handlers_alone(
    window: App, number: signal.Signals, status: int
) -> None:
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    draw = window.draw

    def interrupted() -> None:
        draw()
        signal.raise_signal(number)

    window.draw = interrupted  # type: ignore[method-assign]  # a signal comes while a picture is drawn
    assert window.run() == status
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == before


def test_no_display_is_told(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    pygame.quit()
    monkeypatch.setitem(os.environ, "SDL_VIDEODRIVER", "none-such")
    with pytest.raises(NoDisplayError, match="cannot open a window"):
        open_screen(None, "none")
    assert not pygame.display.get_init()
    assert capfd.readouterr().err == ""


def test_wait_while_the_picture_is_locked(window: App) -> None:
    """A kernel that draws may have to be compiled while it holds the pixels; saying so needs them too."""
    window.run_frame(0.0)
    before = pygame.surfarray.array3d(window.context.surface)
    lock = memoryview(window.context.surface.get_buffer())  # type: ignore[arg-type]  # it is a buffer, which its stub leaves out
    assert window.context.surface.get_locked()
    window.context.gui.draw_wait(window.context.surface, "compiling")
    lock.release()
    locked = pygame.surfarray.array3d(window.context.surface)
    window.context.gui.draw_wait(window.context.surface, "compiling")
    assert (locked != before).any()
    assert (pygame.surfarray.array3d(window.context.surface) == locked).all()
