"""Inputs of pygame on a tape: its queue of events is compared with that of SDL, which is the oracle."""

import os
import tomllib
from collections.abc import Iterator
from pathlib import Path

os.environ["SDL_VIDEODRIVER"] = "dummy"

import pygame
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.rehearsal.input_script import InputScript, ScriptedDevice, load_script
from sandbox.rehearsal.pygame_inputs import KEYS, EventQueue, PressedKeys, scan_code
from sandbox.rehearsal.tape import RecordingTape
from sandbox.scene.errors import SceneError


@pytest.fixture(autouse=True)
def display() -> Iterator[None]:
    """Open a window of the driver without a screen."""
    pygame.init()
    pygame.display.set_mode((50, 50))
    pygame.event.clear()
    yield
    pygame.event.set_blocked(None)
    pygame.event.set_allowed(None)
    pygame.event.clear()


TYPES = (pygame.KEYDOWN, pygame.KEYUP, pygame.MOUSEMOTION, pygame.USEREVENT)
types = st.sampled_from(TYPES)
some_types = st.one_of(st.none(), types, st.lists(types, min_size=1, max_size=3))
CALLS = st.one_of(
    st.tuples(st.just("post"), types),
    st.tuples(st.just("get"), some_types),
    st.tuples(st.just("exclude"), st.lists(types, min_size=1, max_size=2)),
    st.tuples(st.just("poll"), st.none()),
    st.tuples(st.just("peek"), st.one_of(types, st.lists(types, min_size=1, max_size=3))),
    st.tuples(st.just("clear"), some_types),
    st.tuples(st.just("pump"), st.none()),
    st.tuples(st.just("wait"), st.none()),
)


class NoEvents(ScriptedDevice):
    """Device without events of its own."""

    def __init__(self) -> None:
        super().__init__(InputScript(frames=10))

    def wait(self, milliseconds: int) -> int:
        """Wait no time at all, and say that it has passed."""
        return milliseconds


@settings(max_examples=200)
@given(st.lists(CALLS, max_size=30), st.lists(types, max_size=2))
def test_queue_is_that_of_pygame(calls: list[tuple[str, object]], blocked: list[int]) -> None:
    pygame.event.set_allowed(None)
    pygame.event.clear()
    if blocked:
        pygame.event.set_blocked(blocked)
    queue = EventQueue(RecordingTape(lambda: 0.0), NoEvents(), lambda _: None)
    for number, (name, argument) in enumerate(calls):
        answers = []
        for owner in (pygame.event, queue):
            match name:
                case "post":
                    found = owner.post(pygame.event.Event(argument, {"number": number}))
                case "get":
                    found = [(each.type, each.dict.get("number")) for each in owner.get(argument)]
                case "exclude":
                    found = [(each.type, each.dict.get("number")) for each in owner.get(exclude=argument)]
                case "poll":
                    event = owner.poll()
                    found = event.type, event.dict.get("number")
                case "wait":
                    event = owner.wait(1)
                    found = event.type, event.dict.get("number")
                case "peek":
                    found = bool(owner.peek(argument))
                case "clear":
                    found = owner.clear(argument)
                case _:
                    found = owner.pump()
            answers.append(found)
        assert answers[0] == answers[1], (name, argument)


def test_keys_are_where_pygame_looks_for_them() -> None:
    """`ScancodeWrapper` of pygame finds each key of its keyboard at the scan code that stands here."""
    for name, key in KEYS.items():
        if scan_code(key) and scan_code(key) < 512 and not name.startswith("ac_"):
            flags = [False] * 512
            flags[scan_code(key)] = True
            assert pygame.key.ScancodeWrapper(flags)[key], name


def test_pressed_keys_answer_as_those_of_pygame() -> None:
    keys = PressedKeys(frozenset({pygame.K_a, pygame.K_LEFT}))
    assert keys[pygame.K_a] and keys[pygame.K_LEFT] and not keys[pygame.K_b]
    assert len(keys) == len(pygame.key.get_pressed())
    assert sum(keys) == 2


def script(text: str) -> ScriptedDevice:
    """Return the device of a script."""
    return ScriptedDevice(InputScript.model_validate(tomllib.loads(text)))


def test_script_presses_keys_and_moves_the_mouse_in_their_frames() -> None:
    device = script('frames = 4\nfps = 50\ninput = [{ frame = 1, press = "lshift" }]')
    assert device.events() == []
    device.end_frame()
    (event,) = device.events()
    assert (event.type, event.key) == (pygame.KEYDOWN, pygame.K_LSHIFT)
    assert device.modifiers() == pygame.KMOD_LSHIFT
    assert device.keys() == [pygame.K_LSHIFT]
    for _ in range(3):
        device.end_frame()
    assert [each.type for each in device.events()] == [pygame.QUIT]
    assert device.now() == pytest.approx(4 / 50, abs=1e-3)  # the frames, and 10 µs for each reading


def test_timers_of_a_script_follow_its_clock() -> None:
    device = script("frames = 100\nfps = 100")
    device.set_timer(pygame.USEREVENT, 25, 0)
    device.set_timer(pygame.USEREVENT + 1, 30, 2)
    seen = []
    for frame in range(12):
        seen += [(frame, each.type - pygame.USEREVENT) for each in device.events()]
        if frame == 8:
            device.set_timer(pygame.USEREVENT, 0, 0)
        device.end_frame()
    assert seen == [(3, 0), (3, 1), (5, 0), (6, 1), (8, 0)]


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("frames = 0", "frames"),
        ("fps = 60", "frames"),
        ('frames = 3\n[[input]]\nframe = 1\npress = "spcae"', "no key"),
        ("frames = 3\n[[input]]\nframe = 1", "needs one of"),
        ('frames = 3\n[[input]]\nframe = 1\npress = "a"\nmouse = [1, 2]', "needs one of"),
        ("frames = 3\nframe = 1", "frame"),
        ("frames = [", "cannot be read"),
    ],
)
def test_faulty_scripts_are_named(text: str, word: str, tmp_path: Path) -> None:
    path = tmp_path / "play.toml"
    path.write_text(text)
    with pytest.raises(SceneError, match=word):
        load_script(path)
