"""Games in the window: keys, gamepads, score panel, seeking and restart."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pygame
import pytest

from sandbox.action import Action, Impulse
from sandbox.game_names import games_with_rules
from sandbox.games.contract import Control, StepInfo
from sandbox.games.registry import rules_of
from sandbox.scene.files.load import load
from sandbox.scene.files.shipped_scenes import find, shipped
from sandbox.window.app import App
from sandbox.window.app_state import AppState
from sandbox.window.game_host import MAX_ENTRIES, DisplayHistory, GameDisplay, GameHost, ScoreDisplay
from sandbox.window.input.bindings import KeyNameError, codes_of, control_help, gamepad_help
from sandbox.window.input.gamepad import ANALOGUE_LEVELS, LAYOUTS, PLAYSTATION, XBOX, Gamepads, layout_of
from sandbox.window.playback.live import LiveView
from sandbox.window.render.palette import WARNING
from sandbox.window.sound import CUE_NOTES, Sounds, cue_notes, cue_sound
from sandbox.window.ui.score_panel import draw_score, layout_score
from sandbox.window.view_bounds import view_bounds
from tests.toy_game import TOY, Toy
from tests.window.pressing import FOCUS_LOST, key, key_up
from tests.window.windowed import open_window, run_frame

pytestmark = pytest.mark.fail_slow(60)  # a window or a film

UP, LEFT, R, P = pygame.K_UP, pygame.K_LEFT, pygame.K_r, pygame.K_p


class Buttons(Toy):
    """The toy game with two keys for a control, and a lamp that is lit at odd scores."""

    controls = (
        Control("kick", "kick it", ("up", "left shift"), "a -lefty"),
        Control("aim", "how far", ("left",), "lt", analogue=True),
    )

    def lit_lamps(self) -> frozenset[str]:
        return frozenset({"lamp"} if int(self.score) % 2 else ())


@pytest.fixture(autouse=True)
def toy_rules(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sandbox.games.landing.rules.Landing", Buttons)


@pytest.fixture
def window(tmp_path: Path) -> Iterator[App]:
    with open_window(TOY, tmp_path, (1000, 640)) as window:
        window.app_state.start_game()
        yield window


def presses_of(live: LiveView) -> list[tuple[str, float]]:
    assert live.session.game is not None
    return [(press.control, press.value) for press in live.session.game.presses]


def test_letters_and_signs_of_a_game_are_pressed_and_released_on_a_russian_keyboard(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The release is that of the same key, even if the layout has changed meanwhile."""
    controls = (Control("kick", "kick it", ("z",)), Control("aim", "how far", ("/",), analogue=True))
    monkeypatch.setattr(Buttons, "controls", controls)
    with open_window(TOY, tmp_path, (1000, 640)) as window:
        window.app_state.start_game()
        for code, name, letter, other in ((pygame.KSCAN_Z, "kick", "я", "z"), (pygame.KSCAN_SLASH, "aim", ".", "/")):
            for released in (letter, other):
                live = run_frame(window, key(ord(letter), unicode=letter, scancode=code))
                assert presses_of(live)[-1] == (name, 1.0)
                live = run_frame(window, key_up(ord(released), code))
                assert presses_of(live)[-1] == (name, 0.0)
        assert not window.app_state.paused


def host_of(window: App) -> GameHost:
    assert window.app_state.host is not None
    return window.app_state.host


def test_keys_set_controls_until_they_are_released(window: App) -> None:
    live = run_frame(window, key(UP))
    assert presses_of(live) == [("kick", 1.0)]
    run_frame(window, key(UP))  # key repeat of the keyboard
    live = run_frame(window, key_up(UP))
    assert presses_of(live) == [("kick", 1.0), ("kick", 0.0)]
    assert host_of(window).rules.score == 0.5


def test_control_is_released_with_the_last_of_its_keys(window: App) -> None:
    run_frame(window, key(UP), key(pygame.K_LSHIFT))
    live = run_frame(window, key_up(UP))
    assert presses_of(live) == [("kick", 1.0)]
    live = run_frame(window, key_up(pygame.K_LSHIFT))
    assert presses_of(live)[-1] == ("kick", 0.0)


def test_controls_are_released_when_the_window_loses_focus(window: App) -> None:
    run_frame(window, key(UP))
    assert presses_of(run_frame(window, FOCUS_LOST))[-1] == ("kick", 0.0)


def test_help_lists_the_keys_of_the_controls(window: App) -> None:
    bindings = window.app_state.key_bindings
    assert bindings.help_rows == (("Up or Left Shift", "kick it"), ("Left", "how far"))
    assert bindings.gamepad_rows == (("A, stick up", "kick it"), ("LT", "how far"), ("start", "pause / resume"))
    assert {UP, LEFT, pygame.K_LSHIFT} <= bindings.pressed.keys()


def test_help_distinguishes_d_pad_and_stick_of_a_gamepad() -> None:
    assert gamepad_help((Control("go", "go", ("left",), "y left +leftx up"),))[0] == (
        "Y, D-pad left, stick right, D-pad up",
        "go",
    )


def test_restart_starts_a_new_game(window: App) -> None:
    run_frame(window, key(UP), elapsed=0.3)
    old = host_of(window)
    live = run_frame(window, key(R), elapsed=0.0)
    assert host_of(window) is not old
    assert live.session.step_number == 0
    assert host_of(window).rules.score == 0
    live = run_frame(window, key_up(UP))  # the key was pressed in the previous game
    assert presses_of(live) == []
    run_frame(window, key(UP), elapsed=0.3)
    live = run_frame(window, key(pygame.K_l, mod=pygame.KMOD_CTRL), elapsed=0.0)  # reloads the file
    assert (host_of(window).rules.score, presses_of(live)) == (0, [])


def test_seeking_restores_the_score(window: App) -> None:
    for _ in range(30):
        live = run_frame(window)
    scores = [host_of(window).rules.score]
    assert scores[0] >= 1
    live.seek(5)
    live.finish_seek()
    assert host_of(window).rules.score == 0
    assert host_of(window).cues() == ()  # no new events
    live.seek(150)
    live.finish_seek()
    assert host_of(window).rules.score == scores[0]


def test_scrubbing_shows_the_score_and_lamps_of_that_time(window: App) -> None:
    displays = {}
    for _ in range(30):
        live = run_frame(window)
        displays[live.frame.time] = host_of(window).shown()
    assert len({(shown.board.score, shown.lit) for shown in displays.values()}) > 2
    for time, shown in displays.items():
        live.scrub(time)
        assert host_of(window).shown() == shown
    assert host_of(window).rules.score == float(shown.board.score)  # scrubbing does not change the game
    live.commit_scrub()
    live.finish_seek()
    assert host_of(window).shown() == shown


def test_display_history_discards_entries_of_a_replaced_future() -> None:
    def shown(score: str) -> GameDisplay:
        return GameDisplay(ScoreDisplay(score, (), None), frozenset())

    history = DisplayHistory()
    assert history.at(1.0) is None
    for time in range(10):
        history.add(float(time), float(time), shown(str(time // 2)))
    assert [history.at(time) for time in (-1.0, 4.0, 5.5, 99.0)] == [shown(score) for score in ("0", "2", "2", "4")]
    history.add(5.0, 9.0, shown("2"))  # replayed
    assert history.at(9.0) == shown("4")
    history.add(5.0, 5.0, shown("three"))  # played on differently from there
    assert [history.at(time) for time in (4.9, 5.0, 9.0)] == [shown("2"), shown("three"), shown("three")]


def test_display_history_of_a_long_game_thins_old_entries() -> None:
    history = DisplayHistory()
    for time in range(3 * MAX_ENTRIES):
        history.add(float(time), float(time), GameDisplay(ScoreDisplay(str(time), (), None), frozenset()))
    found = [int(display.board.score) for time in range(3 * MAX_ENTRIES) if (display := history.at(float(time)))]
    assert len(set(found)) <= MAX_ENTRIES
    assert found[-100:] == list(range(3 * MAX_ENTRIES - 100, 3 * MAX_ENTRIES))
    assert found == sorted(found)
    assert found[0] == 0


def test_control_held_after_the_seek_time_is_released_when_play_continues(window: App) -> None:
    run_frame(window, key(LEFT), elapsed=0.2)
    held = run_frame(window, elapsed=0.2).session.step_number
    live = run_frame(window, key_up(LEFT), elapsed=0.2)
    live.seek(held // 2)
    live.finish_seek()
    live = run_frame(window, key(UP), key_up(UP))
    assert presses_of(live) == [("aim", 1.0), ("kick", 1.0), ("aim", 0.0), ("kick", 0.0)]


def test_pause_and_steps_keep_the_game(window: App) -> None:
    run_frame(window, key(P))
    live = run_frame(window, key(UP), key_up(UP), elapsed=0.5)
    step = live.session.step_number
    run_frame(window, key(pygame.K_PERIOD, unicode="."))
    assert live.session.step_number == step + 1
    assert presses_of(live) == [("kick", 1.0), ("kick", 0.0)]
    assert host_of(window).rules.score == 0.5


def test_score_panel_is_drawn_and_marks_the_end_of_the_game(window: App) -> None:
    run_frame(window)
    host = host_of(window)
    assert host.shown().board == ScoreDisplay("0.0", (("bounces", "0"), ("aim", "0.50")), None)
    before_end = pygame.surfarray.array3d(window.context.surface)
    rules = host.rules
    assert isinstance(rules, Toy)
    rules.game_over = "enough"
    run_frame(window, elapsed=0.0)
    after_end = pygame.surfarray.array3d(window.context.surface)
    red = (np.abs(after_end.astype(int) - WARNING).sum(axis=2) < 20) & (before_end != after_end).any(axis=2)
    assert red.any()  # the mark before the text
    assert presses_of(run_frame(window, key(UP))) == []  # the game is over


def is_uncovered(window: App) -> bool:
    """Return whether score panel and state display cover no part of the scene."""
    assert window.app_state.view is not None
    corners = window.context.camera.to_screen(np.asarray(view_bounds(window.app_state.view.scene)))
    (left, top), (right, bottom) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    field = pygame.Rect(round(left), round(top), int(right - left), int(bottom - top))
    return (
        window.context.gui.area.contains(field)
        and field.collidelist(window.context.gui.permanent_plates(window.app_state)) < 0
    )


@pytest.mark.parametrize("size", [(1280, 800), (1000, 300), (640, 480)])  # the last has the score at the bottom
def test_scene_is_not_covered_by_the_score_panel(window: App, size: tuple[int, int]) -> None:
    run_frame(window)
    assert is_uncovered(window)
    window.context.resize(pygame.Surface(size))
    assert is_uncovered(window)
    before = window.context.camera
    window.context.refit_if_covered()
    assert window.context.camera == before  # the panel has not grown


def test_camera_refits_as_the_panel_grows_unless_the_user_moved_it(window: App) -> None:
    run_frame(window)
    rules, before = host_of(window).rules, window.context.camera
    assert isinstance(rules, Toy)
    rules.game_over = "enough, after a long time"
    run_frame(window, elapsed=0.0)
    assert window.context.camera != before
    assert is_uncovered(window)
    rules.game_over = None
    run_frame(window, elapsed=0.0)
    window.context.is_fitted, window.context.camera = False, before
    rules.game_over = "enough"
    run_frame(window, elapsed=0.0)
    assert window.context.camera == before


@pytest.mark.parametrize("size", [(1280, 800), (900, 300), (420, 300), (200, 150), (60, 40)])
@pytest.mark.parametrize("over", [None, "a long story of how it came to this end, and what was to be learnt of it"])
def test_score_panel_stays_within_the_free_area(size: tuple[int, int], over: str | None) -> None:
    pygame.font.init()
    surface = pygame.Surface(size)
    lines = tuple((f"label {k}", f"{10**k} m/s") for k in range(8))
    free = surface.get_rect()
    board = ScoreDisplay("1,234,567", lines, over)
    layout = layout_score(board, free, 100, 1.0)
    draw_score(surface, layout)
    rect = layout.rect
    assert rect.width <= size[0]
    if min(size) > 200:
        assert free.contains(rect)


class FakePad:
    def __init__(self, instance_id: int, name: str) -> None:
        self._instance_id, self._name = instance_id, name

    def get_name(self) -> str:
        return self._name

    def get_instance_id(self) -> int:
        return self._instance_id


def joy(kind: int, instance_id: int = 7, **more: Any) -> pygame.event.Event:
    return pygame.event.Event(kind, instance_id=instance_id, **more)


@pytest.fixture
def plug_in(window: App) -> Callable[[str], None]:
    """Return a function that connects a gamepad by the event of the hardware."""

    def plug(name: str) -> None:
        window._gamepads._open_device = lambda _: FakePad(7, name)
        run_frame(window, pygame.event.Event(pygame.JOYDEVICEADDED, device_index=0), elapsed=0.0)

    return plug


def test_gamepad_buttons_triggers_and_sticks_set_controls(window: App, plug_in: Callable[[str], None]) -> None:
    plug_in("Xbox 360 Controller")
    assert ("info", "gamepad connected: Xbox 360 Controller") in window.app_state.messages.visible()
    window.draw()
    assert window.context.gui.has_gamepad
    live = run_frame(window, joy(pygame.JOYBUTTONDOWN, button=0))
    live = run_frame(window, joy(pygame.JOYBUTTONUP, button=0))
    assert presses_of(live) == [("kick", 1.0), ("kick", 0.0)]
    live = run_frame(window, joy(pygame.JOYAXISMOTION, axis=2, value=0.0))  # the trigger, half-way
    assert presses_of(live)[-1] == ("aim", 0.5)
    live = run_frame(window, joy(pygame.JOYAXISMOTION, axis=2, value=0.001))  # below the resolution of analogue levels
    assert len(presses_of(live)) == 3
    live = run_frame(
        window, joy(pygame.JOYAXISMOTION, axis=1, value=-0.3), joy(pygame.JOYAXISMOTION, axis=0, value=1.0)
    )
    assert len(presses_of(live)) == 3  # less than half-way is no kick, and no control is bound to the right
    live = run_frame(window, joy(pygame.JOYAXISMOTION, axis=1, value=-0.9))
    assert presses_of(live)[-1] == ("kick", 1.0)


def test_disconnected_gamepad_releases_its_controls(window: App, plug_in: Callable[[str], None]) -> None:
    plug_in("DualSense Wireless Controller")
    run_frame(window, joy(pygame.JOYBUTTONDOWN, button=0))
    live = run_frame(window, joy(pygame.JOYDEVICEREMOVED))
    assert presses_of(live) == [("kick", 1.0), ("kick", 0.0)]
    assert presses_of(run_frame(window, joy(pygame.JOYBUTTONDOWN, button=0)))[2:] == []  # disconnected
    plug_in("DualSense Wireless Controller")  # reconnected
    assert presses_of(run_frame(window, joy(pygame.JOYBUTTONDOWN, button=0)))[2:] == [("kick", 1.0)]


@pytest.mark.parametrize(("name", "start"), [("Xbox Series X Controller", 7), ("PS4 Controller", 6)])
def test_start_button_pauses_and_resumes(window: App, plug_in: Callable[[str], None], name: str, start: int) -> None:
    plug_in(name)
    run_frame(window, joy(pygame.JOYBUTTONDOWN, button=start))
    assert window.app_state.paused
    run_frame(window, joy(pygame.JOYBUTTONUP, button=start), joy(pygame.JOYBUTTONDOWN, button=start))
    assert not window.app_state.paused


def test_hat_and_d_pad_buttons_give_the_same_directions() -> None:
    from sandbox.window.input.gamepad import _words

    assert _words(joy(pygame.JOYHATMOTION, hat=0, value=(-1, 1)), XBOX) == {
        "left": 1.0,
        "right": 0.0,
        "down": 0.0,
        "up": 1.0,
    }
    assert _words(joy(pygame.JOYBUTTONDOWN, button=13), PLAYSTATION) == {"left": 1.0}
    assert _words(joy(pygame.JOYBUTTONDOWN, button=99), PLAYSTATION) == {}
    half = _words(joy(pygame.JOYAXISMOTION, axis=0, value=0.6), XBOX)
    assert half == {"-leftx": 0.0, "+leftx": pytest.approx(0.5, abs=0.5 / ANALOGUE_LEVELS)}  # (0.6 − 0.2) / 0.8
    assert _words(joy(pygame.JOYAXISMOTION, axis=0, value=0.1), XBOX) == {"-leftx": 0.0, "+leftx": 0.0}


def test_unknown_gamepads_use_the_xbox_layout() -> None:
    assert layout_of("Some Pad") is XBOX
    assert layout_of("Sony Interactive Entertainment DualSense") is PLAYSTATION
    for layout in {id(each): each for each in (*LAYOUTS.values(), XBOX)}.values():
        words = [*layout.buttons.values(), *layout.triggers.values(), *layout.sticks.values()]
        assert len(set(words)) == len(words)
        assert layout.start not in layout.buttons


def test_missing_gamepad_support_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails() -> None:
        raise pygame.error("no joysticks here")

    messages: list[str] = []
    monkeypatch.setattr(pygame.joystick, "init", fails)
    Gamepads(messages.append).start()
    assert messages == ["no gamepads: no joysticks here"]


def test_codes_of_key_names() -> None:
    assert codes_of("left shift") == (pygame.K_LSHIFT,)
    assert codes_of("/") == (pygame.K_SLASH,)
    assert pygame.K_RETURN in codes_of("enter")
    for name in ("p", "o", "f1", "escape", "Z", "", "lefft"):
        with pytest.raises(KeyNameError):
            codes_of(name)


def test_controls_of_every_shipped_game_have_valid_keys_and_buttons(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()  # the real games, not the toy
    words = {word for layout in (XBOX, PLAYSTATION) for word in (*layout.buttons.values(), *layout.triggers.values())}
    words |= {f"{sign}{stick}" for stick in XBOX.sticks.values() for sign in "+-"} | {"left", "right", "up", "down"}
    scenes = [load(each.path) for each in shipped()]
    games = {scene.play.game: scene for scene in scenes if scene.play.game in games_with_rules()}
    assert {"artillery", "curling", "landing", "pinball"} <= set(games)
    for name, scene in games.items():
        controls = rules_of(scene).controls
        codes = [code for control in controls for key in control.keys for code in codes_of(key)]
        assert len(set(codes)) == len(codes), name  # no key has two controls
        assert len({control.name for control in controls}) == len(controls), name
        assert all(control.keys or control.pad for control in controls), name
        assert {word for control in controls for word in (control.pad or "").split()} <= words, name
        assert all(about for _, about in control_help(controls)), name


def test_cues_of_a_game_are_passed_to_the_sounds(window: App, monkeypatch: pytest.MonkeyPatch) -> None:
    cues: list[str] = []
    monkeypatch.setattr(Sounds, "cue", lambda _, name: cues.append(name))
    for _ in range(30):
        run_frame(window)
    assert cues == ["bounce"] * int(host_of(window).rules.score)


def test_cues_have_distinct_sounds() -> None:
    sounds = Sounds()
    assert not sounds.cue("win")  # off by default
    assert sounds.enable()
    assert sounds.cue("win")
    sounds.disable()
    assert cue_notes("bumper") == cue_notes("bumper")
    assert len({cue_notes(f"cue {k}") for k in range(40)}) > 15
    for cue in (*CUE_NOTES, "bumper", ""):
        samples = cue_sound(cue)
        assert samples.dtype == np.int16
        assert 1000 < np.abs(samples).max() <= 0.8 * 32767 + 1
        assert np.abs(samples[-16:]).max() < 400  # fades out to silence


def test_scene_that_its_game_refuses_is_opened_without_the_game(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.undo()
    file = tmp_path / "toy.toml"
    file.write_text(TOY)  # landing needs a ship
    state = AppState()
    assert state.open(file)
    assert state.host is None
    assert state.live is not None
    level, text = state.messages.visible()[-1]
    assert (level, text.partition(",")[0]) == ("warning", "landing needs a body 'ship'")
    state.close()


@pytest.mark.parametrize("name", ["duel", "curling", "pinball/full", "8-ball"])
def test_game_announces_its_hint(name: str) -> None:
    window = App(AppState(), size=(900, 600), say=lambda _: None)
    window.app_state.open(find(name))
    window.run_frame(0.02)
    (text,) = (text for _, text in window.app_state.messages.visible())
    assert text.endswith("F1: all keys")
    window.close()


def test_game_without_a_hint_announces_its_first_keys(window: App) -> None:
    window.context.gui.on_scene_changed(False)
    window.draw()
    texts = [text for _, text in window.app_state.messages.visible()]
    assert texts[-2:] == ["Up or Left Shift: kick it", "Left: how far"]


class WaitingToy(Buttons):
    """The toy game with rules that wait, and so stop time, unless the ball has just been kicked."""

    until = 0.0

    def on_step(self, info: StepInfo) -> Sequence[Action]:
        self.now = info.time
        if info.actions:
            self.until = info.time + 0.195  # s, between two steps
        return super().on_step(info)

    @property
    def waiting(self) -> bool:
        return self.now >= self.until


def test_time_stops_while_the_rules_wait_for_the_player(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("sandbox.games.landing.rules.Landing", WaitingToy)
    with open_window(TOY, tmp_path) as window:
        window.app_state.start_game()
        for _ in range(5):
            live = run_frame(window)
        assert live.session.time == 0.0
        assert host_of(window).waiting
        run_frame(window, key(UP))
        for _ in range(10):
            live = run_frame(window)
        # The rules see the kick after its step of 0.01 s; 20 steps follow, which end within a frame.
        assert live.session.time == pytest.approx(0.21, abs=1e-9)  # the sum of steps
        assert live.clock.real_speed == live.clock.speed  # the wait does not count as slowness
        live.step()
        assert live.session.time == pytest.approx(0.22, abs=1e-9)  # single steps still work
        live.apply(Impulse(time=0.0, body="a", impulse=(0.0, 1.0)))  # an action of the player, without a control
        for _ in range(10):
            live = run_frame(window)
        assert live.session.time == pytest.approx(0.43, abs=1e-9)
        session = live.session.recording()
        live.seek(5)
        live.finish_seek()
        assert not host_of(window).waiting  # recorded play is replayed
        for _ in range(20):
            live = run_frame(window)
        assert live.session.time == pytest.approx(0.43, abs=1e-9)
        assert live.session.recording() == session
