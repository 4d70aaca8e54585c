"""Games with rules in the window: keys, gamepads, the panel, going back, starting again."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pygame
import pytest

from sandbox.action import Action, Impulse
from sandbox.games import registry
from sandbox.games.contract import Control, StepInfo
from sandbox.games.registry import RULES, rules_of
from sandbox.measure.run.sessions import rerun
from sandbox.recording import Recording
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
from tests.window.windowed import turned, window_on

pytestmark = pytest.mark.full  # a window or a film

UP, LEFT, R, P = pygame.K_UP, pygame.K_LEFT, pygame.K_r, pygame.K_p


class Buttons(Toy):
    """The toy with two keys for a control, and a lamp that is lit by every second point."""

    controls = (
        Control("kick", "kick it", ("up", "left shift"), "a -lefty"),
        Control("aim", "how far", ("left",), "lt", analogue=True),
    )

    def lit_lamps(self) -> frozenset[str]:
        return frozenset({"lamp"} if int(self.score) % 2 else ())


@pytest.fixture(autouse=True)
def toy_rules(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(registry.RULES, "landing", Buttons)


@pytest.fixture
def window(tmp_path: Path) -> Iterator[App]:
    with window_on(TOY, tmp_path, (1000, 640)) as opened:
        opened.app_state.start_game()
        yield opened


def presses_of(live: LiveView) -> list[tuple[str, float]]:
    assert live.session.game is not None
    return [(press.control, press.value) for press in live.session.game.presses]


def host_of(window: App) -> GameHost:
    assert window.app_state.host is not None
    return window.app_state.host


def test_keys_set_controls_until_they_are_let_go(window: App) -> None:
    live = turned(window, key(UP))
    assert presses_of(live) == [("kick", 1.0)]
    turned(window, key(UP))  # the keyboard repeats what is held
    live = turned(window, key_up(UP))
    assert presses_of(live) == [("kick", 1.0), ("kick", 0.0)]
    assert host_of(window).rules.score == 0.5


def test_control_is_let_go_with_the_last_of_its_keys(window: App) -> None:
    turned(window, key(UP), key(pygame.K_LSHIFT))
    live = turned(window, key_up(UP))
    assert presses_of(live) == [("kick", 1.0)]
    live = turned(window, key_up(pygame.K_LSHIFT))
    assert presses_of(live)[-1] == ("kick", 0.0)


def test_who_looks_elsewhere_lets_go(window: App) -> None:
    turned(window, key(UP))
    assert presses_of(turned(window, FOCUS_LOST))[-1] == ("kick", 0.0)


def test_help_lists_controls_and_scene_keys_are_theirs(window: App) -> None:
    bindings = window.app_state.key_bindings
    assert bindings.help_rows == (("Up or Left Shift", "kick it"), ("Left", "how far"))
    assert bindings.gamepad_rows == (("A, stick up", "kick it"), ("LT", "how far"), ("start", "pause / resume"))
    assert {UP, LEFT, pygame.K_LSHIFT} <= bindings.pressed.keys()


def test_help_tells_the_cross_of_a_gamepad_from_its_stick() -> None:
    assert gamepad_help((Control("go", "go", ("left",), "y left +leftx up"),))[0] == (
        "Y, D-pad left, stick right, D-pad up",
        "go",
    )


def test_restart_is_a_new_game(window: App) -> None:
    turned(window, key(UP), elapsed=0.3)
    old = host_of(window)
    live = turned(window, key(R), elapsed=0.0)
    assert host_of(window) is not old
    assert live.session.step_number == 0
    assert host_of(window).rules.score == 0
    live = turned(window, key_up(UP))  # held since the game before: it is none of this one's
    assert presses_of(live) == []


def test_reload_is_a_new_game(window: App) -> None:
    turned(window, key(UP), elapsed=0.3)
    live = turned(window, key(pygame.K_l, mod=pygame.KMOD_CTRL), elapsed=0.0)
    assert (host_of(window).rules.score, presses_of(live)) == (0, [])


def test_going_back_brings_the_score_of_then(window: App) -> None:
    for _ in range(30):
        live = turned(window)
    scores = [host_of(window).rules.score]
    assert scores[0] >= 1
    live.seek(5)
    live.finish_seek()
    assert host_of(window).rules.score == 0
    assert host_of(window).cues() == ()  # nothing new happened
    live.seek(150)
    live.finish_seek()
    assert host_of(window).rules.score == scores[0]


def test_looking_back_shows_the_score_and_lamps_of_then(window: App) -> None:
    seen = {}
    for _ in range(30):
        live = turned(window)
        seen[live.frame.time] = host_of(window).shown()
    assert len({(shown.board.score, shown.lit) for shown in seen.values()}) > 2
    for time, shown in seen.items():
        live.scrub(time)
        assert host_of(window).shown() == shown
    assert host_of(window).rules.score == float(shown.board.score)  # the game itself stays where it is
    live.commit_scrub()
    live.finish_seek()
    assert host_of(window).shown() == shown


def test_past_of_another_way_is_forgotten() -> None:
    def shown(score: str) -> GameDisplay:
        return GameDisplay(ScoreDisplay(score, (), None), frozenset())

    past = DisplayHistory()
    assert past.at(1.0) is None
    for time in range(10):
        past.add(float(time), float(time), shown(str(time // 2)))
    assert [past.at(time) for time in (-1.0, 4.0, 5.5, 99.0)] == [shown(score) for score in ("0", "2", "2", "4")]
    past.add(5.0, 9.0, shown("2"))  # seen again
    assert past.at(9.0) == shown("4")
    past.add(5.0, 5.0, shown("three"))  # played on from there
    assert [past.at(time) for time in (4.9, 5.0, 9.0)] == [shown("2"), shown("three"), shown("three")]


def test_past_of_a_long_game_is_thinned_where_it_is_long_ago() -> None:
    past = DisplayHistory()
    for time in range(3 * MAX_ENTRIES):
        past.add(float(time), float(time), GameDisplay(ScoreDisplay(str(time), (), None), frozenset()))
    found = [int(then.board.score) for time in range(3 * MAX_ENTRIES) if (then := past.at(float(time)))]
    assert len(set(found)) <= MAX_ENTRIES
    assert found[-100:] == list(range(3 * MAX_ENTRIES - 100, 3 * MAX_ENTRIES))
    assert found == sorted(found)
    assert found[0] == 0


def test_what_was_held_later_is_let_go_of_on_another_way(window: App) -> None:
    turned(window, key(LEFT), elapsed=0.2)
    held = turned(window, elapsed=0.2).session.step_number
    live = turned(window, key_up(LEFT), elapsed=0.2)
    live.seek(held // 2)
    live.finish_seek()
    live = turned(window, key(UP), key_up(UP))
    assert presses_of(live) == [("aim", 1.0), ("kick", 1.0), ("aim", 0.0), ("kick", 0.0)]


def test_pause_and_steps_keep_the_game(window: App) -> None:
    turned(window, key(P))
    live = turned(window, key(UP), key_up(UP), elapsed=0.5)
    step = live.session.step_number
    turned(window, key(pygame.K_PERIOD, unicode="."))
    assert live.session.step_number == step + 1
    assert presses_of(live) == [("kick", 1.0), ("kick", 0.0)]
    assert host_of(window).rules.score == 0.5


def test_engine_changes_and_the_game_goes_on(window: App) -> None:
    turned(window, key(UP), key_up(UP), elapsed=0.3)
    assert window.app_state.switch_engine("reference")
    live = turned(window, key(UP), key_up(UP), elapsed=0.3)
    assert host_of(window).rules.score == 1.0
    recording = live.session.recording()
    run = rerun(recording, audit=False)
    assert (run.info["state_hash"], run.info["game"]["score"]) == (recording.state_hash, recording.score)
    assert run.info["game"]["otherwise"] is None


def test_session_that_is_saved_replays(window: App, tmp_path: Path) -> None:
    turned(window, key(LEFT), elapsed=0.3)
    turned(window, key(UP), key_up(UP), elapsed=0.3)
    turned(window, key(pygame.K_s, mod=pygame.KMOD_CTRL), elapsed=0.0)
    (file,) = tmp_path.glob("*.json")
    recording = Recording.load(file)
    assert len(recording.presses) == 3
    run = rerun(recording, audit=False)
    assert (run.info["state_hash"], run.info["game"]["score"]) == (recording.state_hash, recording.score)


def test_panel_is_drawn_and_tells_the_end(window: App) -> None:
    turned(window)
    host = host_of(window)
    assert host.shown().board == ScoreDisplay("0.0", (("bounces", "0"), ("aim", "0.50")), None)
    going = pygame.surfarray.array3d(window.context.surface)
    rules = host.rules
    assert isinstance(rules, Toy)
    rules.game_over = "enough"
    turned(window, elapsed=0.0)
    over = pygame.surfarray.array3d(window.context.surface)
    red = (np.abs(over.astype(int) - WARNING).sum(axis=2) < 20) & (going != over).any(axis=2)
    assert red.any()  # the mark before the words
    assert presses_of(turned(window, key(UP))) == []  # nobody plays any more


def lies_clear(window: App) -> bool:
    """Tell whether the whole scene is seen beside the score panel and the state of things."""
    assert window.app_state.view is not None
    corners = window.context.camera.to_screen(np.asarray(view_bounds(window.app_state.view.scene)))
    (left, top), (right, bottom) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    field = pygame.Rect(round(left), round(top), int(right - left), int(bottom - top))
    return (
        window.context.gui.area.contains(field)
        and field.collidelist(window.context.gui.permanent_plates(window.app_state)) < 0
    )


@pytest.mark.parametrize("size", [(1280, 800), (1000, 300), (640, 480)])  # the last has the score at the bottom
def test_scene_lies_clear_of_the_score_panel(window: App, size: tuple[int, int]) -> None:
    turned(window)
    assert lies_clear(window)
    window.context.resize(pygame.Surface(size))
    assert lies_clear(window)
    before = window.context.camera
    window.context.refit_if_covered()
    assert window.context.camera == before  # nothing has grown


def test_scene_makes_room_as_the_panel_grows_unless_somebody_moved_it(window: App) -> None:
    turned(window)
    rules, before = host_of(window).rules, window.context.camera
    assert isinstance(rules, Toy)
    rules.game_over = "enough, after a long time"
    turned(window, elapsed=0.0)
    assert window.context.camera != before
    assert lies_clear(window)
    rules.game_over = None
    turned(window, elapsed=0.0)
    window.context.is_fitted, window.context.camera = False, before
    rules.game_over = "enough"
    turned(window, elapsed=0.0)
    assert window.context.camera == before


@pytest.mark.parametrize("size", [(1280, 800), (900, 300), (420, 300), (200, 150), (60, 40)])
@pytest.mark.parametrize("over", [None, "a long story of how it came to this end, and what was to be learnt of it"])
def test_panel_stays_in_what_is_free(size: tuple[int, int], over: str | None) -> None:
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


class Pad:
    def __init__(self, number: int, name: str) -> None:
        self._number, self._name = number, name

    def get_name(self) -> str:
        return self._name

    def get_instance_id(self) -> int:
        return self._number


def joy(kind: int, number: int = 7, **more: Any) -> pygame.event.Event:
    return pygame.event.Event(kind, instance_id=number, **more)


@pytest.fixture
def plugged(window: App) -> Callable[[str], None]:
    """Plug a gamepad in, as the hardware would."""

    def plug(name: str) -> None:
        window._gamepads._open_device = lambda _: Pad(7, name)
        turned(window, pygame.event.Event(pygame.JOYDEVICEADDED, device_index=0), elapsed=0.0)

    return plug


def test_gamepad_plays(window: App, plugged: Callable[[str], None]) -> None:
    plugged("Xbox 360 Controller")
    assert ("info", "gamepad connected: Xbox 360 Controller") in window.app_state.messages.visible()
    window.draw()
    assert window.context.gui.has_gamepad
    live = turned(window, joy(pygame.JOYBUTTONDOWN, button=0))
    live = turned(window, joy(pygame.JOYBUTTONUP, button=0))
    assert presses_of(live) == [("kick", 1.0), ("kick", 0.0)]
    live = turned(window, joy(pygame.JOYAXISMOTION, axis=2, value=0.0))  # the trigger, half-way
    assert presses_of(live)[-1] == ("aim", 0.5)
    live = turned(window, joy(pygame.JOYAXISMOTION, axis=2, value=0.001))  # no rung of its own
    assert len(presses_of(live)) == 3
    live = turned(window, joy(pygame.JOYAXISMOTION, axis=1, value=-0.3), joy(pygame.JOYAXISMOTION, axis=0, value=1.0))
    assert len(presses_of(live)) == 3  # less than half-way is no kick, and nothing is to the right
    live = turned(window, joy(pygame.JOYAXISMOTION, axis=1, value=-0.9))
    assert presses_of(live)[-1] == ("kick", 1.0)


def test_gamepad_that_is_pulled_out_lets_go(window: App, plugged: Callable[[str], None]) -> None:
    plugged("DualSense Wireless Controller")
    turned(window, joy(pygame.JOYBUTTONDOWN, button=0))
    live = turned(window, joy(pygame.JOYDEVICEREMOVED))
    assert presses_of(live) == [("kick", 1.0), ("kick", 0.0)]
    assert presses_of(turned(window, joy(pygame.JOYBUTTONDOWN, button=0)))[2:] == []  # it is gone
    plugged("DualSense Wireless Controller")  # and comes again
    assert presses_of(turned(window, joy(pygame.JOYBUTTONDOWN, button=0)))[2:] == [("kick", 1.0)]


@pytest.mark.parametrize(("name", "start"), [("Xbox Series X Controller", 7), ("PS4 Controller", 6)])
def test_start_pauses(window: App, plugged: Callable[[str], None], name: str, start: int) -> None:
    plugged(name)
    turned(window, joy(pygame.JOYBUTTONDOWN, button=start))
    assert window.app_state.paused
    turned(window, joy(pygame.JOYBUTTONUP, button=start), joy(pygame.JOYBUTTONDOWN, button=start))
    assert not window.app_state.paused


def test_hats_and_crosses_are_the_same() -> None:
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


def test_unknown_gamepads_are_laid_out_like_the_most_common() -> None:
    assert layout_of("Some Pad") is XBOX
    assert layout_of("Sony Interactive Entertainment DualSense") is PLAYSTATION
    for layout in {id(each): each for each in (*LAYOUTS.values(), XBOX)}.values():
        words = [*layout.buttons.values(), *layout.triggers.values(), *layout.sticks.values()]
        assert len(set(words)) == len(words)
        assert layout.start not in layout.buttons


def test_gamepads_that_cannot_be_had_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails() -> None:
        raise pygame.error("no joysticks here")

    heard: list[str] = []
    monkeypatch.setattr(pygame.joystick, "init", fails)
    Gamepads(heard.append).start()
    assert heard == ["no gamepads: no joysticks here"]


def test_keys_are_called_by_their_names() -> None:
    assert codes_of("left shift") == (pygame.K_LSHIFT,)
    assert codes_of("/") == (pygame.K_SLASH,)
    assert pygame.K_RETURN in codes_of("enter")
    for name in ("p", "o", "f1", "escape", "Z", "", "lefft"):
        with pytest.raises(KeyNameError):
            codes_of(name)


@pytest.mark.parametrize("path", [scene.path for scene in shipped()], ids=lambda path: path.stem)
def test_controls_of_every_shipped_game_can_be_reached(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()  # the game itself, not the toy
    scene = load(path)
    rules = rules_of(scene) if scene.play.game in RULES else None
    if rules is None:
        return
    codes = [code for control in rules.controls for key in control.keys for code in codes_of(key)]
    assert len(set(codes)) == len(codes)  # no key of two controls
    assert len({control.name for control in rules.controls}) == len(rules.controls)
    assert all(control.keys or control.pad for control in rules.controls)
    words = {word for layout in (XBOX, PLAYSTATION) for word in (*layout.buttons.values(), *layout.triggers.values())}
    words |= {f"{sign}{stick}" for stick in XBOX.sticks.values() for sign in "+-"} | {"left", "right", "up", "down"}
    assert {word for control in rules.controls for word in (control.pad or "").split()} <= words
    assert all(about for _, about in control_help(rules.controls))


def test_cues_are_heard_once_sound_is_asked_for(window: App, monkeypatch: pytest.MonkeyPatch) -> None:
    heard: list[str] = []
    monkeypatch.setattr(Sounds, "cue", lambda _, name: heard.append(name))
    for _ in range(30):
        turned(window)
    assert heard == ["bounce"] * int(host_of(window).rules.score)


def test_cues_have_sounds_of_their_own() -> None:
    sounds = Sounds()
    assert not sounds.cue("win")  # off until asked for
    assert sounds.enable()
    assert sounds.cue("win")
    sounds.disable()
    assert cue_notes("bumper") == cue_notes("bumper")
    assert len({cue_notes(f"cue {k}") for k in range(40)}) > 15
    for cue in (*CUE_NOTES, "bumper", ""):
        samples = cue_sound(cue)
        assert samples.dtype == np.int16
        assert 1000 < np.abs(samples).max() <= 0.8 * 32767 + 1
        assert np.abs(samples[-16:]).max() < 400  # it ends in silence


def test_scene_that_its_game_does_not_fit_is_shown_without(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()
    file = tmp_path / "toy.toml"
    file.write_text(TOY)  # landing needs a ship
    stage = AppState()
    assert stage.open(file)
    assert stage.host is None
    assert stage.live is not None
    level, text = stage.messages.visible()[-1]
    assert (level, text.partition(",")[0]) == ("warning", "landing needs a body 'ship'")
    stage.close()


@pytest.mark.parametrize("name", ["duel", "curling", "pinball/full", "8-ball"])
def test_game_announces_its_hint(name: str) -> None:
    opened = App(AppState(), size=(900, 600), say=lambda _: None)
    opened.app_state.open(find(name))
    opened.run_frame(0.02)
    (text,) = (text for _, text in opened.app_state.messages.visible())
    assert text.endswith("F1: all keys")
    opened.close()


def test_game_without_a_hint_announces_its_first_keys(window: App) -> None:
    window.context.gui.on_scene_changed(False)
    window.draw()
    texts = [text for _, text in window.app_state.messages.visible()]
    assert texts[-2:] == ["Up or Left Shift: kick it", "Left: how far"]


class Patient(Buttons):
    """The toy in a world where time stops unless the ball has just been kicked."""

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
    monkeypatch.setitem(registry.RULES, "landing", Patient)
    with window_on(TOY, tmp_path) as window:
        window.app_state.start_game()
        for _ in range(5):
            live = turned(window)
        assert live.session.time == 0.0
        assert host_of(window).waiting
        turned(window, key(UP))
        for _ in range(10):
            live = turned(window)
        # The rules see the kick after its step, of 0.01 s; then 20 steps follow, which end within a picture.
        assert live.session.time == pytest.approx(0.21, abs=1e-9)  # the sum of steps
        assert live.clock.real_speed == live.clock.speed  # the wait does not count as slowness
        live.step()
        assert live.session.time == pytest.approx(0.22, abs=1e-9)  # steps by hand are made all the same
        live.apply(Impulse(time=0.0, body="a", impulse=(0.0, 1.0)))  # an action of the player, without a control
        for _ in range(10):
            live = turned(window)
        assert live.session.time == pytest.approx(0.43, abs=1e-9)
        session = live.session.recording()
        live.seek(5)
        live.finish_seek()
        assert not host_of(window).waiting  # what was played is shown again
        for _ in range(20):
            live = turned(window)
        assert live.session.time == pytest.approx(0.43, abs=1e-9)
        assert live.session.recording() == session
