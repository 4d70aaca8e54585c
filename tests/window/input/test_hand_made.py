"""Unsaved changes by the user: confirmation before they are lost, undo, and added bodies."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pygame
import pytest

from sandbox.action import Action, ActionError, Impulse, Move, Pull, Remove, SetParameter, Spawn
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
from sandbox.window.playback.parameters import parameter_actions as parameter_actions
from sandbox.window.playback.session import Session
from tests.toml_text import toml
from tests.window.pressing import key, key_up, move, press, release
from tests.window.windowed import open_window, run_frame

pytestmark = pytest.mark.fail_slow(60)  # every shipped scene

REST = 'title = "Rest"\n' + toml("solver", dt=0.01) + toml("ball", name="a", position=[0.0, 0.0], radius=0.4)
B, R, ESCAPE = pygame.K_b, pygame.K_r, pygame.K_ESCAPE


@pytest.fixture
def window(tmp_path: Path) -> Iterator[App]:
    with open_window(REST, tmp_path) as window:
        pygame.event.clear()  # events of opening the window
        run_frame(window, move(100, 300))
        yield window


def tap(window: App, code: int, mod: int = 0) -> None:
    run_frame(window, key(code, mod), key_up(code))


def test_consecutive_actions_of_one_kind_count_as_one_change() -> None:
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
    assert count_changes(actions) == 6  # the impulse is a nudge
    assert count_changes(actions, moved_by_keys="a") == 5
    assert count_changes([]) == 0


@pytest.mark.parametrize("code", [R, ESCAPE, pygame.K_LEFTBRACKET])
def test_key_that_discards_an_added_body_asks_first(window: App, code: int) -> None:
    tap(window, B)
    live = window.app_state.live
    tap(window, code)
    assert window.app_state.question is not None
    assert window.app_state.question.startswith("1 hand-made change will be lost")
    assert window.context.exit_status is None
    assert window.app_state.live is live
    tap(window, code)
    assert window.context.exit_status == 0 or window.app_state.live is not live
    assert window.app_state.question is None


def test_close_button_asks_once(window: App) -> None:
    tap(window, B)
    run_frame(window, pygame.event.Event(pygame.QUIT))
    assert window.context.exit_status is None
    run_frame(window, pygame.event.Event(pygame.QUIT))
    assert window.context.exit_status == 0


def test_any_other_key_cancels_the_question(window: App) -> None:
    tap(window, B)
    tap(window, R)
    tap(window, pygame.K_p)
    assert window.app_state.question is None
    tap(window, R)
    assert window.app_state.question is not None


@pytest.mark.parametrize("code", [R, ESCAPE])
def test_no_question_without_unsaved_changes(window: App, code: int) -> None:
    live = window.app_state.live
    tap(window, code)
    assert window.context.exit_status == 0 or window.app_state.live is not live


def test_no_question_after_the_session_is_saved(window: App) -> None:
    tap(window, B)
    tap(window, pygame.K_s, pygame.KMOD_CTRL)
    tap(window, ESCAPE)
    assert window.context.exit_status == 0


def test_restart_keeps_parameters_without_asking_and_quit_asks(window: App) -> None:
    window.commands._store_parameter("gravity", -3.0, True)
    run_frame(window)
    live = window.app_state.live
    tap(window, R)
    assert window.app_state.live is not live
    window.commands._store_parameter("gravity", -4.0, True)
    run_frame(window)
    tap(window, ESCAPE)
    assert window.app_state.question is not None


def test_undone_restart_counts_as_unsaved_and_undo_swaps_the_sessions(window: App) -> None:
    def bodies() -> int:
        assert window.app_state.live is not None
        window.app_state.live.finish_seek()
        return len(window.app_state.live.bodies)

    tap(window, B)
    for _ in range(3):  # the third restarts a session without changes
        tap(window, R)
    tap(window, pygame.K_z, pygame.KMOD_CTRL)
    assert bodies() == 2
    assert window.app_state.count_unsaved() == 1
    tap(window, R)
    tap(window, R)
    run_frame(window, move(400, 300))
    tap(window, B)
    run_frame(window, move(250, 450))
    tap(window, B)
    assert bodies() == 3
    for expected in (2, 3, 2):
        tap(window, pygame.K_z, pygame.KMOD_CTRL)
        assert bodies() == expected


def test_undo_restores_the_future_replaced_by_a_change_at_an_earlier_time(window: App) -> None:
    for _ in range(4):
        live = run_frame(window)
    end, full_recording = live.step_number, live.session.recording()
    for _ in range(3):
        tap(window, pygame.K_COMMA)
    assert live.session.recording() == full_recording  # the recording is still complete
    tap(window, B)
    assert any("is replaced" in text for _, text in window.app_state.messages.visible())
    tap(window, pygame.K_z, pygame.KMOD_CTRL)
    assert window.app_state.live is not None
    window.app_state.live.finish_seek()
    assert window.app_state.live.step_number == end
    assert window.app_state.live.session.recording().state_hash == full_recording.state_hash


def test_picker_asks_before_it_opens_another_scene(window: App) -> None:
    tap(window, B)
    live = window.app_state.live
    tap(window, pygame.K_o, pygame.KMOD_CTRL)
    tap(window, pygame.K_RETURN)
    assert window.context.gui.scene_browser is not None
    assert window.app_state.live is live
    tap(window, pygame.K_RETURN)
    assert window.context.gui.scene_browser is None
    assert window.app_state.live is not live


@pytest.mark.parametrize("box", [False, True], ids=["ball", "box"])
@pytest.mark.parametrize("name", ["bounce", "pyramid", "rube_goldberg", "bridge"])
def test_added_bodies_overlap_no_other_bodies(name: str, box: bool) -> None:
    live, tools, rng = LiveView(Session(load(find(name)))), BodyTools(), np.random.default_rng(1)
    before = overlapping_bodies(live.scene, live.bodies, live.frame).sum()
    low, high = live.frame.position.min(axis=0) - 0.5, live.frame.position.max(axis=0) + 0.5
    for x, y in rng.uniform(low, high, (20, 2)).tolist():
        tools.add(live, (x, y), 5.0, box=box)
    assert len(live.bodies) >= 20
    assert overlapping_bodies(live.scene, live.bodies, live.frame).sum() <= before  # bodies of the file may overlap
    live.close()


def test_added_body_is_placed_at_or_near_the_mouse_or_refused_without_room() -> None:
    full = [{"position": [0.0, 0.0], "radius": 0.9}]
    live = LiveView(Session(from_document({"ball": full})))
    tools = BodyTools()
    tools.add(live, (5.0, 5.0), 1.0)
    assert live.frame.position[-1] == pytest.approx((5.0, 5.0), abs=0.0)
    tools.add(live, (0.1, 0.0), 1.0)
    assert np.hypot(*live.frame.position[-1]) >= 1.8
    live.close()
    ground = LiveView(Session(from_document({"plane": [{"point": [0, 0], "normal": [0, 1]}]})))
    with pytest.raises(ActionError, match="no room"):
        tools.add(ground, (0.0, -100.0), 40.0)  # a ball of 1 m, 100 m below the ground
    ground.close()


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(("key", "value"), [("restitution", 0.25), ("friction", 0.75)])
def test_parameter_sets_restitution_and_friction_of_an_added_body(engine: str, key: str, value: float) -> None:
    scene = from_document(
        {
            "world": {"gravity": [0, -10.0]},
            "plane": [{"point": [0, 0], "normal": [0, 1]}],
            "ball": [{"name": "a", "position": [0, 2], "radius": 0.5, "restitution": 1.0}],
        }
    )
    live = LiveView(Session(scene, engine))
    BodyTools().add(live, (5.0, 2.0), 1.0)
    parameter = next(each for each in SessionParameters().of(live, scene, 1) if each.key == key)
    assert parameter.enabled
    for action in parameter_actions(live, key, value, 1):
        live.apply(action)
    assert next(each for each in SessionParameters().of(live, scene, 1) if each.key == key).value == value
    assert next(each for each in SessionParameters().of(live, scene, 0) if each.key == key).value == (
        key == "restitution"
    )
    live.session.advance(100)  # 1 s: the bodies have fallen 1.5 m, to 5.5 m/s, and rebounded
    if key == "restitution":
        up = live.session.frame.velocity[:, 1]
        assert up[1] < 0.5 * up[0]  # the other one keeps its restitution
    recording = live.session.recording()
    assert rerun(recording, audit=False).info["state_hash"] == recording.state_hash
    live.close()


@pytest.mark.parametrize(
    ("path", "value"),
    [("ball.spawned-1.restitution", 1.5), ("box.spawned-1.friction", 0.5), ("ball.none.friction", 0.5)],
)
def test_invalid_parameter_of_a_spawned_body_is_refused(path: str, value: float) -> None:
    session = Session(from_document({"ball": [{"name": "a", "position": [0, 2], "radius": 0.5}]}))
    session.apply(Spawn(time=0.0, ball=Ball(position=(5.0, 0.0), radius=1.0, name="spawned-1")))
    before = session.frame.state_hash()
    with pytest.raises(ActionError):
        session.apply(SetParameter(time=0.0, path=path, value=value))
    assert session.frame.state_hash() == before
    assert len(session.actions) == 1
    session.close()


def pull(body: str, x: float | None) -> Pull:
    return Pull(time=0.0, body=body, target=None if x is None else (x, 0.0))


@pytest.mark.parametrize(
    ("actions", "count"),
    [
        ([pull("a", 0.0)], 1),
        ([pull("a", 0.0), pull("a", 1.0), pull("a", None)], 1),
        ([pull("a", 0.0), pull("a", None), pull("a", 0.0), pull("a", None)], 2),
        ([pull("a", 0.0), pull("a", None), pull("b", 0.0)], 2),
        ([pull("a", None)], 0),
    ],
)
def test_each_pull_from_grip_to_release_is_one_change(actions: list[Action], count: int) -> None:
    assert count_changes(actions) == count


def test_restart_after_a_pull_asks_and_can_be_undone(window: App) -> None:
    x, y = window.context.camera.to_screen(np.asarray((0.0, 0.0))).tolist()
    run_frame(window, move(x, y), press(x, y))
    for by in (10, 40, 80):
        run_frame(window, move(x + by, y, held=True))
    run_frame(window, release(x + 80, y))
    live = window.app_state.live
    assert live is not None
    moved = live.frame.state_hash()
    tap(window, pygame.K_p)
    moved = live.session.recording().state_hash
    tap(window, R)
    assert window.app_state.question is not None
    assert window.app_state.question.startswith("1 hand-made change")
    tap(window, R)
    assert window.app_state.live is not live
    tap(window, pygame.K_z, pygame.KMOD_CTRL)
    assert window.app_state.live is not None
    window.app_state.live.finish_seek()
    assert window.app_state.live.session.recording().state_hash == moved


def test_question_of_a_restart_names_the_settings_that_stay(window: App) -> None:
    window.commands._store_parameter("gravity", -3.0, True)
    run_frame(window)
    tap(window, B)
    tap(window, R)
    assert window.app_state.question is not None
    assert window.app_state.question.startswith("1 hand-made change will be lost (1 setting stays)")
    tap(window, ESCAPE)
    assert window.app_state.question is not None
    assert window.app_state.question.startswith("2 hand-made changes will be lost:")
