"""Body tools: picking, dragging, nudging, adding and removing bodies of a session."""

from typing import Any

import numpy as np
import pytest

from sandbox.action import ActionError, Impulse, Move, Pull, Remove, Spawn
from sandbox.scene.files.load import from_document
from sandbox.window.hit_test import overlapping_bodies
from sandbox.window.input.body_tools import BodyTools
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.session import Session

DOCUMENT: dict[str, Any] = {
    "material": [{"name": "rubber", "restitution": 0.5, "friction": 0.25}],
    "ball": [
        {"name": "a", "position": [0, 0], "radius": 0.5, "mass": 2.0, "material": "rubber"},
        {"name": "post", "position": [5, 0], "radius": 0.5, "fixed": True},
        {"name": "small", "position": [9, 0], "radius": 0.01, "density": 3.0, "collides": "fixed"},
    ],
}


def live(engine: str = "pymunk", **more: Any) -> LiveView:
    return LiveView(Session(from_document({**DOCUMENT, **more}), engine))


def pick_and_grab(tools: BodyTools, live: LiveView, point: tuple[float, float], reach: float, paused: bool) -> bool:
    """Pick the body at a point and grab it, as a drag does."""
    found = tools.pick(live, point, reach)
    tools.grab(live, paused)
    return found


def step_times(live: LiveView, steps: int) -> LiveView:
    for _ in range(steps):
        live.step()
    return live


@pytest.mark.parametrize("engine", ["pymunk", "reference", "exact"])
def test_body_dragged_while_paused_stays_exactly_under_the_mouse(engine: str) -> None:
    view, tools = step_times(live(engine), 3), BodyTools()
    assert pick_and_grab(tools, view, (0.25, -0.125), 0.0, paused=True)
    assert (tools.picked, tools.is_holding) == (0, True)
    for point in ((1.25, 0.875), (-3.0, 2.0), (0.5, 0.5)):
        tools.drag(view, point)
        assert view.frame.position[0].tolist() == [point[0] - 0.25, point[1] + 0.125]
    assert tools.spring_line(view) is None
    tools.release(view)
    assert not tools.is_holding
    assert [type(action) for action in view.session.actions] == [Move] * 3
    assert step_times(view, 5).frame.position[0].tolist() == [0.25, 0.625]


@pytest.mark.parametrize("paused", [True, False])
def test_driven_body_cannot_be_dragged(paused: bool) -> None:
    drive = {"kind": "stroke", "body": "a", "pivot": [0, 0], "stops": [0.0, 1.0], "rate": 1.0}
    view, tools = live(drive=[drive]), BodyTools()
    with pytest.raises(ActionError, match=r"^a cannot be dragged; its key moves it"):
        pick_and_grab(tools, view, (0.25, 0.0), 0.0, paused)
    assert not tools.is_holding
    tools.drag(view, (1.0, 1.0))
    assert view.session.actions == ()


def test_fixed_body_can_be_moved_while_paused_and_not_pulled() -> None:
    view, tools = live(), BodyTools()
    assert pick_and_grab(tools, view, (5.0, 0.0), 0.0, paused=True)
    tools.drag(view, (5.0, 3.0))
    tools.release(view)
    assert view.frame.position[1].tolist() == [5.0, 3.0]
    assert pick_and_grab(tools, view, (5.0, 3.0), 0.0, paused=False)
    assert tools.picked == 1
    assert not tools.is_holding
    tools.drag(view, (0.0, 9.0))
    tools.release(view)
    assert step_times(view, 5).frame.position[1].tolist() == [5.0, 3.0]


@pytest.mark.parametrize("paused", [True, False])
def test_body_that_moves_after_the_press_is_grabbed_at_the_pressed_point(paused: bool) -> None:
    """The body moves and rotates between the press and the first motion of the mouse."""
    view, tools = live(), BodyTools()
    view.apply(Impulse(time=0.0, body="a", impulse=(8.0, 0.0)))
    pick_and_grab(tools, view, (0.0, 0.25), 0.0, paused=False)
    tools.drag(view, (9.0, 3.0))
    step_times(view, 40)
    tools.release(view)
    (x, y), angle = view.frame.position[0].tolist(), float(view.frame.angle[0])
    before = len(view.session.actions)
    assert tools.pick(view, (x + 0.25, y), 0.0)
    assert (len(view.session.actions), tools.is_holding) == (before, False)
    step_times(view, 20)
    tools.grab(view, paused)
    tools.drag(view, (5.0, 5.0))
    turned = float(view.frame.angle[0]) - angle
    assert abs(turned) > 1e-3  # otherwise the test checks nothing
    offset = 0.25 * np.cos(turned), 0.25 * np.sin(turned)
    if paused:
        assert view.frame.position[0] == pytest.approx((5.0 - offset[0], 5.0 - offset[1]), rel=1e-12)  # some roundings
    else:
        grabbed_point = view.frame.position[0] + offset
        held = (tools.spring_line(view) or ((0.0, 0.0), None))[0]
        assert held == pytest.approx(grabbed_point, rel=1e-12)  # some roundings


@pytest.mark.fail_slow(60)  # takes over half a second
def test_pulled_body_reaches_the_mouse_and_keeps_its_velocity_when_released() -> None:
    view, tools = live(), BodyTools()
    pick_and_grab(tools, view, (0.0, 0.25), 0.0, paused=False)
    assert tools.is_holding
    tools.drag(view, (2.0, 0.25))
    step_times(view, 4)
    held, mouse = tools.spring_line(view) or ((0.0, 0.0), (0.0, 0.0))
    assert mouse == (2.0, 0.25)
    assert 0.0 < held[0] < 2.0
    step_times(view, 1500)
    held, mouse = tools.spring_line(view) or ((0.0, 0.0), (0.0, 0.0))
    assert held == pytest.approx((2.0, 0.25), abs=0.02)  # it keeps rotating about the mouse
    tools.release(view)
    assert tools.spring_line(view) is None
    velocity = view.frame.velocity[0].tolist()
    assert step_times(view, 5).frame.velocity[0].tolist() == velocity
    kinds = [type(action) for action in view.session.actions]
    assert kinds == [Pull] * 3
    assert view.session.actions[-1] == Pull(time=view.session.actions[-1].time, body="a")


def test_press_on_empty_space_picks_and_grabs_no_body() -> None:
    view, tools = live(), BodyTools()
    tools.picked = 2
    assert not pick_and_grab(tools, view, (0.0, 9.0), 0.1, paused=False)
    assert tools.picked is None
    tools.drag(view, (1.0, 1.0))
    tools.release(view)
    tools.grab(view, paused=True)
    assert not tools.is_holding
    for tool in (tools.remove, tools.nudge):
        with pytest.raises(ActionError, match="select a body first: click it"):
            tool(view)
    assert view.session.actions == ()


@pytest.mark.parametrize(("index", "point", "speed"), [(0, (0.0, 0.0), 1.0), (2, (9.0, 0.0), 0.1)])
def test_nudge_adds_exactly_its_impulse(index: int, point: tuple[float, float], speed: float) -> None:
    """The change of speed is 1 m/s, or ten radii per second for a small body."""
    view, tools = live(), BodyTools()
    pick_and_grab(tools, view, point, 0.0, paused=True)
    for k in (1, 2):
        tools.nudge(view)
        velocity = view.frame.velocity[index]
        assert velocity == pytest.approx([0.6 * speed * k, 0.8 * speed * k], rel=1e-15)  # a rounding or two
    mass = float(view.bodies.mass[index])
    action = view.session.actions[0]
    assert isinstance(action, Impulse)
    assert action.impulse == (0.6 * mass * speed, 0.8 * mass * speed)


def test_added_ball_copies_the_picked_or_the_first_ball() -> None:
    view, tools = live(), BodyTools()
    tools.add(view, (0.0, 9.0), 10.0)
    tools.picked = 2
    tools.add(view, (3.0, 9.0), 10.0)
    first, second = (action.ball for action in view.session.actions if isinstance(action, Spawn))
    assert (first.radius, first.mass, first.material, first.collides) == (0.5, 2.0, "rubber", "all")
    assert (second.radius, second.density, second.material, second.collides) == (0.01, 3.0, None, "fixed")
    assert view.frame.position[3:].tolist() == [[0.0, 9.0], [3.0, 9.0]]
    assert view.bodies.mass[3] == 2.0
    tools.picked = 3
    tools.add(view, (6.0, 9.0), 10.0)
    assert view.bodies.radius[5] == 0.5
    assert len(set(view.bodies.names)) == 6


def test_added_ball_of_an_empty_scene_is_scaled_to_the_view() -> None:
    view = LiveView(Session(from_document({"title": "t"})))
    BodyTools().add(view, (1.0, 2.0), 20.0)
    assert view.bodies.radius.tolist() == [0.5]
    BodyTools().add(view, (5.0, 2.0), 0.0)  # the smallest valid radius, or that of the first
    assert len(view.bodies) == 2


@pytest.mark.fail_slow(60)  # compiles kernels of `exact`
def test_added_ball_is_shifted_to_avoid_overlap_on_the_exact_engine() -> None:
    view, tools = live("exact"), BodyTools()
    tools.add(view, (0.2, 0.0), 10.0)
    assert len(view.bodies) == 4
    assert not overlapping_bodies(view.scene, view.bodies, view.frame)[-1]


def test_removed_body_is_absent_and_no_longer_picked_or_held() -> None:
    view, tools = live(), BodyTools()
    pick_and_grab(tools, view, (0.0, 0.0), 0.0, paused=False)
    step_times(view, 2)
    tools.remove(view)
    assert not view.frame.present[0]
    assert (tools.picked, tools.is_holding) == (None, False)
    tools.drag(view, (1.0, 1.0))
    tools.release(view)
    assert isinstance(view.session.actions[-1], Remove)
    step_times(view, 2)


def test_held_body_removed_by_another_action_can_be_released() -> None:
    view, tools = live(), BodyTools()
    pick_and_grab(tools, view, (0.0, 0.0), 0.0, paused=False)
    view.apply(Remove(time=0.0, body="a"))
    assert tools.spring_line(view) is None
    with pytest.raises(ActionError, match="has been removed"):
        tools.drag(view, (1.0, 1.0))
    tools.release(view)
    step_times(view, 2)


def test_picked_body_is_none_after_seeking_to_before_its_spawn() -> None:
    """The session seeks to a time before the body was added."""
    view, tools = step_times(live(), 3), BodyTools()
    tools.add(view, (0.0, 9.0), 10.0)
    tools.picked = 3
    assert tools.picked_index(view) == 3
    view.seek(1)
    while view.busy is not None:
        view.update(0.0, paused=True)
    assert len(view.bodies) == 3
    assert tools.picked_index(view) is None
    for tool in (tools.remove, tools.nudge):
        with pytest.raises(ActionError, match="select a body first: click it"):
            tool(view)
    assert view.session.actions == ()
    tools.add(view, (0.0, 9.0), 10.0)
    assert view.bodies.radius[3] == 0.5


def test_shift_moves_a_body_and_stops_it() -> None:
    view, tools = live(), BodyTools()
    view.apply(Impulse(time=0.0, body="a", impulse=(1.0, 0.0)))
    tools.shift(view, "a", (0.0, 0.5))
    tools.shift(view, "a", (-0.5, 0.0))
    assert view.frame.position[0].tolist() == [-0.5, 0.5]
    assert view.frame.velocity[0].tolist() == [0.0, 0.0]
    tools.shift(view, "zzz", (1.0, 1.0))
    assert len(view.session.actions) == 3


def test_bodies_with_any_name_can_be_dragged_and_nudged() -> None:
    names = ["a.b", 'say "hi"', "it's", "0", "*"]
    balls = [{"name": name, "position": [3.0 * k, 0.0], "radius": 1} for k, name in enumerate(names)]
    view = LiveView(Session(from_document({"ball": balls})))
    for k in range(len(names)):
        tools = BodyTools()
        pick_and_grab(tools, view, (3.0 * k, 0.0), 0.0, paused=True)
        tools.drag(view, (3.0 * k, 5.0))
        tools.nudge(view)
    assert view.frame.position[:, 1].tolist() == [5.0] * 5
    assert np.allclose(view.frame.velocity, [0.6, 0.8], rtol=1e-15)  # a rounding
