"""What is hand-made is not lost without being asked, and can be brought back."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pygame
import pytest

from sandbox.action import Action, ActionError, Impulse, Move, Remove, SetParameter, Spawn
from sandbox.engines.registry import ENGINES
from sandbox.measure.run.sessions import rerun
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document, load
from sandbox.scene.files.shipped_scenes import find
from sandbox.window.app import App
from sandbox.window.hit_test import overlapping_bodies
from sandbox.window.input.body_tools import BodyTools, count_changes
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.parameters import SessionParameters
from sandbox.window.playback.parameters import turned as turned_knob
from sandbox.window.playback.session import Session
from tests.window.pressing import key, key_up, move
from tests.window.windowed import turned, window_on

pytestmark = pytest.mark.full  # every shipped scene

REST = """
title = "Rest"
[solver]
dt = 0.01
[[ball]]
name = "a"
position = [0.0, 0.0]
radius = 0.4
"""
B, R, ESCAPE = pygame.K_b, pygame.K_r, pygame.K_ESCAPE


@pytest.fixture
def window(tmp_path: Path) -> Iterator[App]:
    with window_on(REST, tmp_path) as opened:
        pygame.event.clear()  # those of its opening
        turned(opened, move(100, 300))
        yield opened


def strike(window: App, code: int, mod: int = 0) -> None:
    turned(window, key(code, mod), key_up(code))


def test_changes_are_counted_as_a_person_would() -> None:
    spawn = Spawn(time=0.0, ball=Ball(position=(0.0, 0.0), radius=1.0))
    drag = [Move(time=0.0, body="a", position=(float(k), 0.0)) for k in range(5)]
    actions: list[Action] = [
        spawn,
        spawn,
        *drag,
        Impulse(time=0.0, body="a", impulse=(1.0, 0.0)),
        SetParameter(time=0.0, path="world.gravity", value=[0.0, -1.0]),
        SetParameter(time=0.0, path="world.gravity", value=[0.0, -2.0]),
        Remove(time=0.0, body="a"),
    ]
    assert count_changes(actions) == 5
    assert count_changes(actions, moved_by_keys="a") == 4
    assert count_changes([]) == 0


@pytest.mark.parametrize("code", [R, ESCAPE, pygame.K_LEFTBRACKET])
def test_key_that_would_lose_a_body_asks_first(window: App, code: int) -> None:
    strike(window, B)
    live = window.app_state.live
    strike(window, code)
    assert window.app_state.question is not None
    assert window.app_state.question.startswith("1 hand-made change will be lost")
    assert window.context.exit_status is None
    assert window.app_state.live is live
    strike(window, code)
    assert window.context.exit_status == 0 or window.app_state.live is not live
    assert window.app_state.question is None


def test_cross_asks_once(window: App) -> None:
    strike(window, B)
    turned(window, pygame.event.Event(pygame.QUIT))
    assert window.context.exit_status is None
    turned(window, pygame.event.Event(pygame.QUIT))
    assert window.context.exit_status == 0


def test_any_other_key_takes_the_question_back(window: App) -> None:
    strike(window, B)
    strike(window, R)
    strike(window, pygame.K_p)
    assert window.app_state.question is None
    strike(window, R)
    assert window.app_state.question is not None


@pytest.mark.parametrize("code", [R, ESCAPE])
def test_nothing_is_asked_where_nothing_is_lost(window: App, code: int) -> None:
    live = window.app_state.live
    strike(window, code)
    assert window.context.exit_status == 0 or window.app_state.live is not live


def test_nothing_is_asked_once_the_session_is_saved(window: App) -> None:
    strike(window, B)
    strike(window, pygame.K_s, pygame.KMOD_CTRL)
    strike(window, ESCAPE)
    assert window.context.exit_status == 0


def test_restart_keeps_values_and_so_does_not_ask_for_them(window: App) -> None:
    window.commands._store_parameter("gravity", -3.0, True)
    turned(window)
    live = window.app_state.live
    strike(window, R)
    assert window.app_state.live is not live
    window.commands._store_parameter("gravity", -4.0, True)
    turned(window)
    strike(window, ESCAPE)
    assert window.app_state.question is not None


def test_undo_brings_back_what_a_restart_has_lost(window: App) -> None:
    strike(window, B)
    strike(window, R)
    strike(window, R)
    assert window.app_state.live is not None
    assert len(window.app_state.live.bodies) == 1
    strike(window, pygame.K_z, pygame.KMOD_CTRL)
    window.app_state.live.finish_seek()
    assert len(window.app_state.live.bodies) == 2


def test_what_undo_brings_back_is_unsaved_and_undo_exchanges_the_two(window: App) -> None:
    def bodies() -> int:
        assert window.app_state.live is not None
        window.app_state.live.finish_seek()
        return len(window.app_state.live.bodies)

    strike(window, B)
    for _ in range(3):  # the third restarts what has nothing to lose
        strike(window, R)
    strike(window, pygame.K_z, pygame.KMOD_CTRL)
    assert bodies() == 2
    assert window.app_state.count_unsaved() == 1
    strike(window, R)
    strike(window, R)
    turned(window, move(400, 300))
    strike(window, B)
    turned(window, move(250, 450))
    strike(window, B)
    assert bodies() == 3
    for expected in (2, 3, 2):
        strike(window, pygame.K_z, pygame.KMOD_CTRL)
        assert bodies() == expected


def test_undo_brings_back_what_was_replaced_at_an_earlier_moment(window: App) -> None:
    for _ in range(4):
        live = turned(window)
    end, whole = live.step_number, live.session.recording()
    for _ in range(3):
        strike(window, pygame.K_COMMA)
    assert live.session.recording() == whole  # closing now keeps all of it
    strike(window, B)
    assert any("is replaced" in text for _, text in window.app_state.messages.visible())
    strike(window, pygame.K_z, pygame.KMOD_CTRL)
    assert window.app_state.live is not None
    window.app_state.live.finish_seek()
    assert window.app_state.live.step_number == end
    assert window.app_state.live.session.recording().state_hash == whole.state_hash


def test_picker_asks_before_another_scene_takes_the_place(window: App) -> None:
    strike(window, B)
    live = window.app_state.live
    strike(window, pygame.K_o, pygame.KMOD_CTRL)
    strike(window, pygame.K_RETURN)
    assert window.context.gui.scene_browser is not None
    assert window.app_state.live is live
    strike(window, pygame.K_RETURN)
    assert window.context.gui.scene_browser is None
    assert window.app_state.live is not live


@pytest.mark.parametrize("box", [False, True], ids=["ball", "box"])
@pytest.mark.parametrize("name", ["bounce", "pyramid", "rube_goldberg", "bridge"])
def test_new_bodies_overlap_nothing_wherever_they_are_put(name: str, box: bool) -> None:
    live, hands, rng = LiveView(Session(load(find(name)))), BodyTools(), np.random.default_rng(1)
    before = overlapping_bodies(live.scene, live.bodies, live.frame).sum()
    low, high = live.frame.position.min(axis=0) - 0.5, live.frame.position.max(axis=0) + 0.5
    for x, y in rng.uniform(low, high, (20, 2)).tolist():
        hands.add(live, (x, y), 5.0, box=box)
    assert len(live.bodies) >= 20
    assert overlapping_bodies(live.scene, live.bodies, live.frame).sum() <= before  # those of the file may
    live.close()


def test_new_body_goes_where_it_is_pointed_if_there_is_room_and_is_refused_in_a_full_place() -> None:
    full = [{"position": [0.0, 0.0], "radius": 0.9}]
    live = LiveView(Session(from_document({"ball": full})))
    hands = BodyTools()
    hands.add(live, (5.0, 5.0), 1.0)
    assert live.frame.position[-1] == pytest.approx((5.0, 5.0), abs=0.0)
    hands.add(live, (0.1, 0.0), 1.0)
    assert np.hypot(*live.frame.position[-1]) >= 1.8
    live.close()
    ground = LiveView(Session(from_document({"plane": [{"point": [0, 0], "normal": [0, 1]}]})))
    with pytest.raises(ActionError, match="no room"):
        hands.add(ground, (0.0, -100.0), 40.0)  # a ball of 1 m, 100 m below the ground
    ground.close()


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(("key", "value"), [("restitution", 0.25), ("friction", 0.75)])
def test_knob_sets_the_surface_of_a_body_added_by_hand(engine: str, key: str, value: float) -> None:
    scene = from_document(
        {
            "world": {"gravity": [0, -10.0]},
            "plane": [{"point": [0, 0], "normal": [0, 1]}],
            "ball": [{"name": "a", "position": [0, 2], "radius": 0.5, "restitution": 1.0}],
        }
    )
    live = LiveView(Session(scene, engine))
    BodyTools().add(live, (5.0, 2.0), 1.0)
    knob = next(each for each in SessionParameters().of(live, scene, 1) if each.key == key)
    assert knob.enabled
    for action in turned_knob(live, key, value, 1):
        live.apply(action)
    assert next(each for each in SessionParameters().of(live, scene, 1) if each.key == key).value == value
    assert next(each for each in SessionParameters().of(live, scene, 0) if each.key == key).value == (
        key == "restitution"
    )
    live.session.advance(100)  # 1 s: it has fallen 1.5 m at 5.5 m/s, and come up again
    if key == "restitution":
        up = live.session.frame.velocity[:, 1]
        assert up[1] < 0.5 * up[0]  # the other one keeps its own
    recording = live.session.recording()
    assert rerun(recording, audit=False).info["state_hash"] == recording.state_hash
    live.close()


@pytest.mark.parametrize(
    ("path", "value"),
    [("ball.spawned-1.restitution", 1.5), ("box.spawned-1.friction", 0.5), ("ball.none.friction", 0.5)],
)
def test_surface_of_a_spawned_body_is_checked(path: str, value: float) -> None:
    session = Session(from_document({"ball": [{"name": "a", "position": [0, 2], "radius": 0.5}]}))
    session.apply(Spawn(time=0.0, ball=Ball(position=(5.0, 0.0), radius=1.0, name="spawned-1")))
    before = session.frame.state_hash()
    with pytest.raises(ActionError):
        session.apply(SetParameter(time=0.0, path=path, value=value))
    assert session.frame.state_hash() == before
    assert len(session.actions) == 1
    session.close()
