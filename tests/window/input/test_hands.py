"""Hands: what pointing, dragging and keys do to bodies, on a running session and on a stored run."""

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


def grasp(hands: BodyTools, live: LiveView, place: tuple[float, float], reach: float, paused: bool) -> bool:
    """Pick the body at a place and take hold of it, as a drag does."""
    found = hands.pick(live, place, reach)
    hands.grab(live, paused)
    return found


def passed(live: LiveView, steps: int) -> LiveView:
    for _ in range(steps):
        live.step()
    return live


@pytest.mark.parametrize("engine", ["pymunk", "reference", "exact"])
def test_body_dragged_while_paused_is_exactly_under_the_hand(engine: str) -> None:
    show, hands = passed(live(engine), 3), BodyTools()
    assert grasp(hands, show, (0.25, -0.125), 0.0, paused=True)
    assert (hands.picked, hands.is_holding) == (0, True)
    for place in ((1.25, 0.875), (-3.0, 2.0), (0.5, 0.5)):
        hands.drag(show, place)
        assert show.frame.position[0].tolist() == [place[0] - 0.25, place[1] + 0.125]
    assert hands.spring_line(show) is None
    hands.release(show)
    assert not hands.is_holding
    assert [type(action) for action in show.session.actions] == [Move] * 3
    assert passed(show, 5).frame.position[0].tolist() == [0.25, 0.625]


@pytest.mark.parametrize("paused", [True, False])
def test_driven_body_is_left_to_its_key(paused: bool) -> None:
    drive = {"kind": "stroke", "body": "a", "pivot": [0, 0], "stops": [0.0, 1.0], "rate": 1.0}
    show, hands = live(drive=[drive]), BodyTools()
    with pytest.raises(ActionError, match=r"^a cannot be dragged; its key moves it"):
        grasp(hands, show, (0.25, 0.0), 0.0, paused)
    assert not hands.is_holding
    hands.drag(show, (1.0, 1.0))
    assert show.session.actions == ()


def test_fixed_body_can_be_moved_while_paused_and_not_pulled() -> None:
    show, hands = live(), BodyTools()
    assert grasp(hands, show, (5.0, 0.0), 0.0, paused=True)
    hands.drag(show, (5.0, 3.0))
    hands.release(show)
    assert show.frame.position[1].tolist() == [5.0, 3.0]
    assert grasp(hands, show, (5.0, 3.0), 0.0, paused=False)
    assert hands.picked == 1
    assert not hands.is_holding
    hands.drag(show, (0.0, 9.0))
    hands.release(show)
    assert passed(show, 5).frame.position[1].tolist() == [5.0, 3.0]


@pytest.mark.parametrize("paused", [True, False])
def test_body_that_went_on_is_held_where_it_was_looked_at(paused: bool) -> None:
    """It flies and turns between the press and the first motion of the mouse."""
    show, hands = live(), BodyTools()
    show.apply(Impulse(time=0.0, body="a", impulse=(8.0, 0.0)))
    grasp(hands, show, (0.0, 0.25), 0.0, paused=False)
    hands.drag(show, (9.0, 3.0))
    passed(show, 40)
    hands.release(show)
    (x, y), angle = show.frame.position[0].tolist(), float(show.frame.angle[0])
    before = len(show.session.actions)
    assert hands.pick(show, (x + 0.25, y), 0.0)
    assert (len(show.session.actions), hands.is_holding) == (before, False)
    passed(show, 20)
    hands.grab(show, paused)
    hands.drag(show, (5.0, 5.0))
    turned = float(show.frame.angle[0]) - angle
    assert abs(turned) > 1e-3  # else this says nothing
    spot = 0.25 * np.cos(turned), 0.25 * np.sin(turned)
    if paused:
        assert show.frame.position[0] == pytest.approx((5.0 - spot[0], 5.0 - spot[1]), rel=1e-12)  # some roundings
    else:
        there = show.frame.position[0] + spot
        assert (hands.spring_line(show) or ((0.0, 0.0), None))[0] == pytest.approx(there, rel=1e-12)  # some roundings


def test_pulled_body_comes_under_the_hand_and_flies_on_when_let_go() -> None:
    show, hands = live(), BodyTools()
    grasp(hands, show, (0.0, 0.25), 0.0, paused=False)
    assert hands.is_holding
    hands.drag(show, (2.0, 0.25))
    passed(show, 4)
    held, hand = hands.spring_line(show) or ((0.0, 0.0), (0.0, 0.0))
    assert hand == (2.0, 0.25)
    assert 0.0 < held[0] < 2.0
    passed(show, 1500)
    held, hand = hands.spring_line(show) or ((0.0, 0.0), (0.0, 0.0))
    assert held == pytest.approx((2.0, 0.25), abs=0.02)  # it goes on turning about the hand
    hands.release(show)
    assert hands.spring_line(show) is None
    velocity = show.frame.velocity[0].tolist()
    assert passed(show, 5).frame.velocity[0].tolist() == velocity
    kinds = [type(action) for action in show.session.actions]
    assert kinds == [Pull] * 3
    assert show.session.actions[-1] == Pull(time=show.session.actions[-1].time, body="a")


def test_nothing_is_grasped_where_there_is_nothing() -> None:
    show, hands = live(), BodyTools()
    hands.picked = 2
    assert not grasp(hands, show, (0.0, 9.0), 0.1, paused=False)
    assert hands.picked is None
    hands.drag(show, (1.0, 1.0))
    hands.release(show)
    hands.grab(show, paused=True)
    assert not hands.is_holding
    for deed in (hands.remove, hands.nudge):
        with pytest.raises(ActionError, match="select a body first: click it"):
            deed(show)
    assert show.session.actions == ()


@pytest.mark.parametrize(("number", "place", "speed"), [(0, (0.0, 0.0), 1.0), (2, (9.0, 0.0), 0.1)])
def test_nudge_adds_exactly_its_impulse(number: int, place: tuple[float, float], speed: float) -> None:
    """1 m/s, or ten radii a second of a small body."""
    show, hands = live(), BodyTools()
    grasp(hands, show, place, 0.0, paused=True)
    for k in (1, 2):
        hands.nudge(show)
        velocity = show.frame.velocity[number]
        assert velocity == pytest.approx([0.6 * speed * k, 0.8 * speed * k], rel=1e-15)  # a rounding or two
    mass = float(show.bodies.mass[number])
    action = show.session.actions[0]
    assert isinstance(action, Impulse)
    assert action.impulse == (0.6 * mass * speed, 0.8 * mass * speed)


def test_new_ball_is_like_the_picked_one_or_like_the_first() -> None:
    show, hands = live(), BodyTools()
    hands.add(show, (0.0, 9.0), 10.0)
    hands.picked = 2
    hands.add(show, (3.0, 9.0), 10.0)
    first, second = (action.ball for action in show.session.actions if isinstance(action, Spawn))
    assert (first.radius, first.mass, first.material, first.collides) == (0.5, 2.0, "rubber", "all")
    assert (second.radius, second.density, second.material, second.collides) == (0.01, 3.0, None, "fixed")
    assert show.frame.position[3:].tolist() == [[0.0, 9.0], [3.0, 9.0]]
    assert show.bodies.mass[3] == 2.0
    hands.picked = 3
    hands.add(show, (6.0, 9.0), 10.0)
    assert show.bodies.radius[5] == 0.5
    assert len(set(show.bodies.names)) == 6


def test_new_ball_of_an_empty_scene_suits_the_view() -> None:
    show = LiveView(Session(from_document({"title": "t"})))
    BodyTools().add(show, (1.0, 2.0), 20.0)
    assert show.bodies.radius.tolist() == [0.5]
    BodyTools().add(show, (5.0, 2.0), 0.0)  # the smallest radius there may be, or that of the first
    assert len(show.bodies) == 2


def test_new_ball_that_would_overlap_is_put_beside_so_that_exact_takes_it() -> None:
    show, hands = live("exact"), BodyTools()
    hands.add(show, (0.2, 0.0), 10.0)
    assert len(show.bodies) == 4
    assert not overlapping_bodies(show.scene, show.bodies, show.frame)[-1]


def test_removed_body_is_gone_and_no_longer_picked_or_held() -> None:
    show, hands = live(), BodyTools()
    grasp(hands, show, (0.0, 0.0), 0.0, paused=False)
    passed(show, 2)
    hands.remove(show)
    assert not show.frame.present[0]
    assert (hands.picked, hands.is_holding) == (None, False)
    hands.drag(show, (1.0, 1.0))
    hands.release(show)
    assert isinstance(show.session.actions[-1], Remove)
    passed(show, 2)


def test_body_that_was_removed_elsewhere_can_be_let_go() -> None:
    show, hands = live(), BodyTools()
    grasp(hands, show, (0.0, 0.0), 0.0, paused=False)
    show.apply(Remove(time=0.0, body="a"))
    assert hands.spring_line(show) is None
    with pytest.raises(ActionError, match="has been removed"):
        hands.drag(show, (1.0, 1.0))
    hands.release(show)
    passed(show, 2)


def test_picked_body_that_has_not_come_yet_is_none() -> None:
    """The session goes back to before it was added."""
    show, hands = passed(live(), 3), BodyTools()
    hands.add(show, (0.0, 9.0), 10.0)
    hands.picked = 3
    assert hands.picked_index(show) == 3
    show.seek(1)
    while show.busy is not None:
        show.update(0.0, paused=True)
    assert len(show.bodies) == 3
    assert hands.picked_index(show) is None
    for deed in (hands.remove, hands.nudge):
        with pytest.raises(ActionError, match="select a body first: click it"):
            deed(show)
    assert show.session.actions == ()
    hands.add(show, (0.0, 9.0), 10.0)
    assert show.bodies.radius[3] == 0.5


def test_arrows_put_a_body_elsewhere_at_rest() -> None:
    show, hands = live(), BodyTools()
    show.apply(Impulse(time=0.0, body="a", impulse=(1.0, 0.0)))
    hands.shift(show, "a", (0.0, 0.5))
    hands.shift(show, "a", (-0.5, 0.0))
    assert show.frame.position[0].tolist() == [-0.5, 0.5]
    assert show.frame.velocity[0].tolist() == [0.0, 0.0]
    hands.shift(show, "zzz", (1.0, 1.0))
    assert len(show.session.actions) == 3


def test_names_of_any_kind_can_be_held() -> None:
    names = ["a.b", 'say "hi"', "it's", "0", "*"]
    balls = [{"name": name, "position": [3.0 * k, 0.0], "radius": 1} for k, name in enumerate(names)]
    show = LiveView(Session(from_document({"ball": balls})))
    for k in range(len(names)):
        hands = BodyTools()
        grasp(hands, show, (3.0 * k, 0.0), 0.0, paused=True)
        hands.drag(show, (3.0 * k, 5.0))
        hands.nudge(show)
    assert show.frame.position[:, 1].tolist() == [5.0] * 5
    assert np.allclose(show.frame.velocity, [0.6, 0.8], rtol=1e-15)  # a rounding
