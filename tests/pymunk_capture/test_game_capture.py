"""Recordings of games that use pymunk: replays end in the state of the game, bit for bit."""

import contextlib
import itertools
import json
import os
import random
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Protocol

import pymunk
import pytest

import sandbox
from sandbox.engines.registry import ENGINES
from sandbox.measure.run.replay_check import checked_recording
from sandbox.measure.run.runner import run
from sandbox.measure.run.sessions import read_session, rerun
from sandbox.pymunk_capture.game_capture import GameCapture, capture
from sandbox.recording import Recording
from tests.pymunk_capture.test_space_capture import DT, balls, space_with_walls

pytestmark = pytest.mark.fail_slow(60)  # many runs of seconds

STEPS = 200


def disc(space: pymunk.Space, x: float, y: float, radius: float = 10.0) -> pymunk.Body:
    body = pymunk.Body(2, 100)
    body.position = x, y
    circle = pymunk.Circle(body, radius)
    circle.friction, circle.elasticity = 0.5, 0.3
    space.add(body, circle)
    return body


class Game(Protocol):
    """A game with one space."""

    space: pymunk.Space

    def update(self, k: int) -> None:
        """Act before step k."""


class Platformer:
    """A game that acts on its space in every way that a recording has."""

    def __init__(self) -> None:
        self.space, self.rng = space_with_walls(), random.Random(5)
        self.player = disc(self.space, 0, 40)
        self.others = [disc(self.space, 40 * k - 100, 60 + 30 * k) for k in range(5)]

    def update(self, k: int) -> None:
        """Act before step k."""
        if k % 30 == 10:
            self.player.velocity = self.rng.uniform(-200, 200), 400  # jump
        if k % 17 == 3:
            self.others[1].apply_impulse_at_local_point((self.rng.uniform(-50, 50), 300), (1.0, 2.0))
        if 50 <= k < 90:
            self.player.apply_force_at_world_point((800, 0), self.player.position)
        if k == 60:
            self.others[0].position = -50, 300
            self.others[0].angular_velocity = 4.0
        if k == 80:
            self.space.gravity = 100, -700
        if k % 40 == 25:
            self.others.append(disc(self.space, self.rng.uniform(-200, 200), 400, 8))
        if k == 120:
            gone = self.others.pop(2)
            self.space.remove(gone, *gone.shapes)


def play(game: Game, steps: int = STEPS) -> GameCapture:
    with capture() as captured:
        for k in range(steps):
            game.update(k)
            game.space.step(DT)
    return captured


def end_of(recording: Recording, engine: str = "pymunk") -> dict[str, list[float]]:
    """Return the state of each body at the end of a replay, by its name."""
    found = run(recording.whole_scene, engine, actions=recording.actions)
    return {
        str(name): [*found.position[-1, k], *found.velocity[-1, k], found.angle[-1, k], found.angular_velocity[-1, k]]
        for k, name in enumerate(found.names.tolist())
    }


def assert_replayed(captured: GameCapture) -> int:
    """Assert that a replay ends in the state of the game, bit for bit; return the number of moving bodies."""
    ends = end_of(captured.recording)
    moving = [each for each in captured.spaces[0].names.items() if each[0].body_type != pymunk.Body.STATIC]
    for body, name in moving:
        assert ends[name] == [*body.position, *body.velocity, body.angle, body.angular_velocity], name
    return len(moving)


def test_replay_of_a_game_ends_in_its_state_bit_for_bit() -> None:
    captured = play(Platformer())
    assert not captured.omitted and not captured.inexact
    kinds = {action.kind for action in captured.recording.actions}
    assert kinds == {"move", "force", "set", "spawn", "remove"}
    assert_replayed(captured)
    assert captured.recording.duration == pytest.approx(STEPS * DT)


class Shaker(Platformer):
    """A game that sets positions of bodies in a crowd, which pymunk's tree of shapes learns in the next step."""

    def __init__(self) -> None:
        super().__init__()
        self.others += [disc(self.space, 21 * (k % 8) - 80, 30 + 21 * (k // 8)) for k in range(40)]

    def update(self, k: int) -> None:
        if k % 7 == 3:
            body = self.rng.choice(self.others)
            body.position = self.rng.uniform(-80, 80), self.rng.uniform(60, 200)


def test_positions_that_a_game_sets_keep_the_order_of_contacts() -> None:
    captured = play(Shaker())
    assert_replayed(captured)


def test_changes_of_damping_are_actions() -> None:
    space = balls()
    with capture() as captured:
        for k in range(120):
            if k in (20, 60, 90):
                space.damping = {20: 0.3, 60: 0.8, 90: 1.0}[k]
            space.step(DT)
    assert not captured.omitted and not captured.inexact
    assert [action.path for action in captured.recording.actions] == ["world.damping"] * 3
    assert_replayed(captured)


def test_damping_that_a_scene_cannot_have_is_named() -> None:
    space = balls()
    with capture() as captured:
        for _ in range(3):
            space.step(DT)
            space.damping = 0.0
    assert captured.omitted == ("space.damping = 0, which the game sets; `world.damping` is above 0 and at most 1",)
    assert not captured.recording.actions


def test_stored_recording_is_that_of_the_game(tmp_path: Path) -> None:
    captured = play(Platformer(), 60)
    recording = Recording.load(captured.recording.save(tmp_path / "game.json"))
    assert recording.actions == captured.recording.actions
    assert end_of(recording) == end_of(captured.recording)


def test_game_is_not_disturbed() -> None:
    one, other = Platformer(), Platformer()
    play(one)
    for k in range(STEPS):
        other.update(k)
        other.space.step(DT)
    assert [tuple(b.position) for b in one.space.bodies] == [tuple(b.position) for b in other.space.bodies]
    assert not hasattr(pymunk.Space.step, "__wrapped__") and pymunk.Space.step.__name__ == "step"


def test_step_is_restored_after_an_error() -> None:
    step = pymunk.Space.step
    with pytest.raises(RuntimeError, match="of the game"), capture() as captured:
        balls().step(DT)
        raise RuntimeError("of the game")
    assert pymunk.Space.step is step
    assert captured.recording.duration == DT


def test_longest_space_is_the_recording_and_no_space_is_an_error() -> None:
    with sandbox.capture() as captured:
        with pytest.raises(ValueError, match="no pymunk space"):
            captured.recording  # noqa: B018
        menu, level = space_with_walls(), balls()
        for _ in range(3):
            menu.step(DT)
        for _ in range(5):
            level.step(DT)
    assert len(captured.spaces) == 2
    assert len(captured.recording.scene.bodies) == 40


class PaddleGame:
    """A game that moves kinematic bodies: a paddle and a platform by their velocities, a door by its positions."""

    def __init__(self) -> None:
        self.space = space_with_walls()
        self.balls = [disc(self.space, 60 * k - 150, 100 + 40 * k) for k in range(6)]
        self.paddle = self._bar((-200, 30), (80, 10))
        self.platform = self._bar((100, 120), (120, 10))
        self.door = self._bar((0, 300), (10, 60))
        self.platform.velocity = 60, 0

    def _bar(self, position: tuple[float, float], size: tuple[float, float]) -> pymunk.Body:
        body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        body.position = position
        bar = pymunk.Poly.create_box(body, size)
        bar.friction, bar.elasticity = 0.7, 0.9
        self.space.add(body, bar)
        return body

    def update(self, k: int) -> None:
        """Act before step k."""
        if abs(self.platform.position.x - 100) > 40:
            self.platform.velocity = 60.0 if self.platform.position.x < 100 else -60.0, 0
        if k % 25 == 5:
            self.paddle.velocity = 0, 300
            self.paddle.angular_velocity = 3.0
        if k % 25 == 10:
            self.paddle.velocity = 20, -300
            self.paddle.angular_velocity = -3.0
        if k % 25 == 15:
            self.paddle.velocity, self.paddle.angular_velocity = (0, 0), 0.0
        self.door.position = 0, 300 - 2 * (k % 100)
        if k == 100:
            self._bar((-100, 250), (60, 10)).angular_velocity = 2.0


def test_replay_of_a_game_with_kinematic_bodies_ends_in_its_state_bit_for_bit() -> None:
    captured = play(PaddleGame())
    assert not captured.omitted and not captured.inexact
    assert {action.kind for action in captured.recording.actions} == {"move", "spawn"}
    assert assert_replayed(captured) == 10


def test_hand_that_is_not_in_the_space_is_moved_by_the_game() -> None:
    """Games drag bodies by a joint to a kinematic body outside the space, which only they move."""
    space = space_with_walls()
    ball, hand = disc(space, 0, 100), pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    hand.position = 0, 150
    space.add(pymunk.PivotJoint(hand, ball, (0, 0), (0, 5)))
    with capture() as captured:
        for k in range(60):
            hand.position = 2 * k, 150
            space.step(DT)
    assert not captured.omitted
    (watched,) = captured.spaces
    assert end_of(captured.recording)[watched.names[ball]][:2] == [*ball.position]


def test_bricks_that_the_game_removes_are_removed() -> None:
    """A static body of its own is a body of the scene; the ball then falls through the place of the brick."""
    space = space_with_walls()
    ball = disc(space, 0, 100)
    brick = pymunk.Body(body_type=pymunk.Body.STATIC)
    brick.position = 0, 60
    space.add(brick, pymunk.Poly.create_box(brick, (40, 10)))
    with capture() as captured:
        for k in range(60):
            if k == 30:
                space.remove(brick, *brick.shapes)
            space.step(DT)
    assert not captured.omitted
    assert [action.kind for action in captured.recording.actions] == ["remove"]
    (watched,) = captured.spaces
    assert end_of(captured.recording)[watched.names[ball]][:2] == [*ball.position]


def _change_nothing(_: pymunk.Space) -> None:
    pass


def _first(space: pymunk.Space) -> pymunk.Body:
    return next(iter(space.bodies))


CHANGES: dict[str, tuple[Callable[[pymunk.Space], object], str]] = {
    "joint added": (lambda s: s.add(pymunk.PinJoint(s.static_body, _first(s))), "joints that the game adds"),
    "motor whose bodies collide": (
        lambda s: setattr(next(iter(s.constraints)), "collide_bodies", False),
        "joints that the game changes",
    ),
    "iterations": (lambda s: setattr(s, "iterations", 20), "settings and callbacks"),
    "callback": (lambda s: s.on_collision(1, 2, begin=lambda *_: None), "settings and callbacks"),
    "mass": (lambda s: setattr(_first(s), "mass", 9.0), "masses, moments and functions"),
    "elasticity": (lambda s: setattr(next(iter(_first(s).shapes)), "elasticity", 1.5), "elasticities above 1"),
    "filter": (lambda s: setattr(next(iter(_first(s).shapes)), "filter", pymunk.ShapeFilter(mask=1)), "filters of"),
    "wall moved": (lambda s: setattr(s.static_body, "position", (1.0, 0.0)), "walls and posts that the game moves"),
    "shape added": (lambda s: s.add(pymunk.Circle(_first(s), 3)), "shapes that the game adds"),
    "wall added": (lambda s: s.add(pymunk.Segment(s.static_body, (0, 9), (9, 9), 1)), "shapes that the game adds"),
    "wall removed": (lambda s: s.remove(next(iter(s.shapes))), "shapes that the game adds to bodies or removes"),
}


@pytest.mark.parametrize("name", CHANGES)
def test_what_actions_cannot_state_is_named(name: str) -> None:
    change, message = CHANGES[name]
    for act, is_named in ((_change_nothing, False), (change, True)):
        space = space_with_walls()
        space.add(pymunk.SimpleMotor(disc(space, 0, 40), disc(space, 50, 40), 1.0))
        with capture() as captured:
            space.step(DT)
            act(space)
            space.step(DT)
        assert (message in "\n".join(captured.omitted)) == is_named


def falling(dts: Sequence[float]) -> tuple[GameCapture, pymunk.Body]:
    """Return the recording of a game with one ball whose steps are given, and the ball."""
    space = pymunk.Space()
    space.gravity = 0, -10
    ball = disc(space, 0, 100, 1.0)
    with capture() as captured:
        for k, dt in enumerate(dts):
            if k == len(dts) // 2:
                ball.velocity = 3, ball.velocity.y
            space.step(dt)
    return captured, ball


FRAME = 1 / 60


@pytest.mark.parametrize(
    ("dts", "median"),
    [
        ([0.5] + [FRAME] * 120, FRAME),  # a game that loads pictures in its first frame
        ([FRAME] * 60 + [0.25] + [FRAME] * 60, FRAME),
        ([0.016, 0.017] * 60 + [0.016], 0.016),  # measured by a clock in ms
        ([0.001] + [FRAME] * 100 + [0.1] * 3, FRAME),
        ([0.25, 0.5], 0.25),
    ],
)
def test_recording_of_a_varying_step_has_the_median_and_lasts_as_long_as_the_game(dts, median):
    captured, ball = falling(dts)
    recording = captured.recording
    assert recording.settings.dt == recording.scene.solver.dt == median
    assert recording.duration == pytest.approx(sum(dts), abs=0.5 * median)
    assert recording.actions[0].time == pytest.approx(sum(dts[: len(dts) // 2]), abs=1e-12)
    (remark,) = captured.omitted
    assert f"from {1e3 * min(dts):.4g} to {1e3 * max(dts):.4g} ms" in remark
    # Free flight by steps of h falls short by g·t·h/2 of the exact path; long steps of the game account for the rest.
    error = 10 * sum(dts) * max(dts)
    assert end_of(recording)["body-1"][1] == pytest.approx(ball.position.y, abs=error)


@pytest.mark.parametrize("zeros", [(0,), (0, 1, 2), (5,), (0, 7, 19)])
def test_steps_of_length_0_are_no_steps(zeros: tuple[int, ...]) -> None:
    dts = [0.0 if k in zeros else FRAME for k in range(20)]
    captured, _ = falling(dts)
    assert not captured.omitted
    assert captured.steps == 20 - len(zeros)
    assert captured.recording.duration == (20 - len(zeros)) * FRAME
    assert_replayed(captured)


def test_step_out_of_the_range_of_scenes_is_an_error_of_the_recording() -> None:
    captured, _ = falling([-FRAME] * 5)
    with pytest.raises(sandbox.CaptureError, match=r"solver\.dt"):
        captured.recording  # noqa: B018


class Victim(Platformer):
    """A game whose callbacks act on a body that hits the ground: in a phase of the collision, at once or after it."""

    def __init__(self, phase: str, act: Callable[[pymunk.Space, pymunk.Body], None], is_deferred: bool) -> None:
        super().__init__()
        self.victim, self.hits = disc(self.space, 150, 60), 0
        (shape,) = self.victim.shapes
        shape.collision_type = 7

        def hit(arbiter: pymunk.Arbiter, space: pymunk.Space, data: object) -> None:
            self.hits += 1
            if self.hits == 3 or (phase in ("begin", "separate") and self.hits == 1):
                if is_deferred:
                    space.add_post_step_callback(lambda space, _: act(space, self.victim), "hit")
                else:
                    act(space, self.victim)

        phases: dict[str, Any] = {phase: hit}
        self.space.on_collision(7, None, **phases)


def kill(space: pymunk.Space, body: pymunk.Body) -> None:
    space.remove(body, *body.shapes)


def clone(space: pymunk.Space, body: pymunk.Body) -> None:
    disc(space, -180, 200)


def respawn(space: pymunk.Space, body: pymunk.Body) -> None:
    body.position, body.velocity, body.angular_velocity = (0, 250), (30, 100), 2.0


def jump(space: pymunk.Space, body: pymunk.Body) -> None:
    body.velocity = 50, 400


def push(space: pymunk.Space, body: pymunk.Body) -> None:
    body.apply_impulse_at_local_point((100, 500), (1, 2))


def invert(space: pymunk.Space, body: pymunk.Body) -> None:
    space.gravity = 50, -300


def ice(space: pymunk.Space, body: pymunk.Body) -> None:
    for shape in body.shapes:
        shape.friction = 0.01


@pytest.mark.parametrize("is_deferred", [False, True])
@pytest.mark.parametrize("phase", ["begin", "pre_solve", "post_solve", "separate"])
@pytest.mark.parametrize("act", [kill, clone, respawn, jump, push, invert, ice])
def test_acts_of_callbacks_are_replayed(act, phase, is_deferred):
    """What a callback does in the middle of a step is an action after it, which may come too late for that step."""
    if (phase, act) == ("separate", ice):
        act = kill  # the disc is gone from the ground
    game = Victim(phase, act, is_deferred)
    captured = play(game, 80)
    assert game.hits
    recording = captured.recording
    if is_deferred or phase == "post_solve" or act in (kill, clone):
        assert_replayed(captured)
    victim = captured.spaces[0].names.get(game.victim)
    assert (victim is None) == (act is kill)
    assert len(end_of(recording)) == len(game.space.bodies) + sum(each.kind == "remove" for each in recording.actions)


@pytest.mark.parametrize("act", [kill, respawn, clone])
def test_acts_of_callbacks_in_the_last_step_are_replayed(act: Callable[[pymunk.Space, pymunk.Body], None]) -> None:
    """A game may end with the step in which the player dies."""
    game = Victim("post_solve", act, is_deferred=True)
    with capture() as captured:
        while game.hits < 3:
            game.space.step(DT)
    recording = captured.recording
    assert recording.actions[-1].time == recording.duration
    assert_replayed(captured)
    assert checked_recording(captured).game.replay.is_equal


def _rope(space: pymunk.Space) -> pymunk.Constraint:
    joint = pymunk.SlideJoint(space.static_body, _first(space), (0, 0), (0, 0), 0, 50)
    space.add(joint)
    return joint


@pytest.mark.parametrize("in_callback", [False, True])
@pytest.mark.parametrize("verb", ["adds", "removes"])
def test_joints_that_a_game_or_a_callback_adds_or_removes_are_named(verb: str, in_callback: bool) -> None:
    space = space_with_walls()
    disc(space, 0, 14)
    joint = None if verb == "adds" else _rope(space)

    def act(*_: object) -> None:
        if verb == "adds" and not space.constraints:
            _rope(space)
        if joint is not None and joint in space.constraints:
            space.remove(joint)

    if in_callback:
        space.on_collision(post_solve=act)
    with capture() as captured:
        for k in range(30):
            if k == 10 and not in_callback:
                act()
            space.step(DT)
    (remark,) = (each for each in captured.omitted if each.startswith("joints"))
    assert remark.startswith(f"joints that the game {verb} while it runs: SlideJoint")
    assert checked_recording(captured).game.replay.is_equal


def test_bodies_of_a_joint_that_a_game_adds_for_a_while_are_those_of_the_game() -> None:
    """A drag by the mouse: a joint to a body that is not in the space."""
    space = space_with_walls()
    bird, hand = disc(space, 0, 100), pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    joint = pymunk.PivotJoint(hand, bird, (0, 0), (0, 0))
    joint.max_force = 5000
    other = disc(space, 80, 200)
    with capture() as captured:
        for k in range(60):
            if k == 10:
                hand.position = bird.position
                space.add(joint)
            if 10 <= k < 40:
                hand.position += (3, 2)
            if k == 40:
                space.remove(joint)
                bird.apply_impulse_at_local_point((300, 100))
            space.step(DT)
    assert [each.split(":")[0] for each in captured.omitted] == ["joints that the game adds while it runs"]
    recording = checked_recording(captured)
    assert recording.game is not None and recording.game.replay is not None
    assert recording.game.replay.is_equal
    (watched,) = captured.spaces
    moved = {each.body for each in recording.actions if isinstance(each, sandbox.Move)}
    assert moved == {watched.names[bird]} != {watched.names[other]}


TYPES = {"static": pymunk.Body.STATIC, "dynamic": pymunk.Body.DYNAMIC, "kinematic": pymunk.Body.KINEMATIC}


@pytest.mark.parametrize(("before", "after"), [*itertools.permutations(TYPES, 2)])
def test_body_whose_type_a_game_changes_moves_as_in_the_game(before: str, after: str) -> None:
    space = space_with_walls()
    body = pymunk.Body(2, 100, body_type=TYPES[before])
    body.position = 0, 200
    space.add(body, pymunk.Circle(body, 10))
    with capture() as captured:
        for k in range(60):
            if k == 20:
                body.body_type = TYPES[after]
                if after != "static":
                    body.velocity = 10, 20
                if after == "dynamic":
                    body.mass, body.moment = 2, 100
            space.step(DT)
    position = rerun(checked_recording(captured), audit=False).position
    (watched,) = captured.spaces
    states = [dict(zip(each.names, each.states[:, :2], strict=True)) for each in captured.log.steps]
    found = position[1:, captured.recording.scene.bodies.number_of[watched.names[body]]]
    of_game = [each[watched.names[body]] for each in states]
    # The frame after a step precedes the actions at its end, so that a body that cannot move by itself is a step late.
    late = 1 if before == "static" else 0
    assert found[22:59].tolist() == [each.tolist() for each in of_game[22 - late : 59 - late]]


def test_joints_of_a_body_that_is_removed_are_not_left_out() -> None:
    space = space_with_walls()
    one, other = disc(space, 0, 100), disc(space, 30, 100)
    rod = pymunk.PinJoint(one, other)
    space.add(rod)
    with capture() as captured:
        for k in range(60):
            if k == 20:
                space.remove(rod, one, *one.shapes)
            space.step(DT)
    assert not captured.omitted
    (watched,) = captured.spaces
    assert end_of(captured.recording)[watched.names[other]][:2] == [*other.position]


def _speed_limit(body: pymunk.Body, gravity: tuple[float, float], damping: float, dt: float) -> None:
    pymunk.Body.update_velocity(body, gravity, damping, dt)
    if body.velocity.length > 80:
        body.velocity *= 80 / body.velocity.length


def _drift(body: pymunk.Body, dt: float) -> None:
    pymunk.Body.update_position(body, dt)
    body.position += (0.1, 0.0)


@pytest.mark.parametrize(("name", "function"), [("velocity_func", _speed_limit), ("position_func", _drift)])
def test_functions_of_bodies_have_their_effect_as_moves(name: str, function: Callable[..., None]) -> None:
    """Without contacts, a replay of the motion is exact."""
    space = space_with_walls()
    ball = disc(space, 0, 300)
    setattr(ball, name, function)
    with capture() as captured:
        for _ in range(60):
            space.step(DT)
    assert "the velocity or position function of" in captured.omitted[0]
    assert_replayed(captured)


def test_sleeping_body_with_a_function_is_not_woken_by_its_replay() -> None:
    space = space_with_walls()
    space.sleep_time_threshold, space.idle_speed_threshold = 0.3, 30.0
    ball = disc(space, 0, 14)
    ball.velocity_func = _speed_limit
    with capture() as captured:
        for _ in range(120):
            space.step(DT)
    assert ball.is_sleeping
    moves = [action.time for action in captured.recording.actions if action.kind == "move"]
    assert moves and max(moves) < 1.5
    # Each action starts the time anew after which a body falls asleep, so that it lies as in the game up to the slop.
    assert end_of(captured.recording)["body-1"][1] == pytest.approx(ball.position.y, abs=space.collision_slop)


TYPES = {"dynamic": pymunk.Body.DYNAMIC, "kinematic": pymunk.Body.KINEMATIC, "static": pymunk.Body.STATIC}


@pytest.mark.parametrize(
    ("before", "has_joint"),  # pymunk has no joint of two bodies that nothing can push
    [("dynamic", False), ("dynamic", True), ("kinematic", False), ("static", False)],
)
@pytest.mark.parametrize("after", TYPES)
def test_changes_of_a_type_do_not_end_the_game(before: str, after: str, has_joint: bool) -> None:
    """A joint of a body that turns static may give pymunk's velocities values that are not finite."""
    space = space_with_walls()
    body, other = disc(space, 0, 100), disc(space, 40, 100)
    body.body_type = TYPES[before]
    if has_joint:
        space.add(pymunk.PivotJoint(body, other, (20, 100)), pymunk.PivotJoint(space.static_body, body, (0, 100)))
    with capture() as captured:
        for k in range(60):
            if k == 20:
                body.body_type = TYPES[after]
                if after == "dynamic":
                    body.mass, body.moment = 2, 100
            if k == 30:
                body.velocity, body.position = (10, 10), (5, 120)
            body.apply_force_at_local_point((100, 0))
            space.step(DT)
    assert captured.steps == 60
    is_named = any(f"from {before} to {after}" in each for each in captured.omitted)
    assert is_named == (before != after)
    assert run(captured.recording.whole_scene, "pymunk", actions=captured.recording.actions).status == "ok"


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 1e30])
@pytest.mark.parametrize("key", ["position", "velocity", "angle", "angular_velocity", "force", "gravity"])
def test_values_that_a_scene_cannot_have_are_remarks(key: str, value: float) -> None:
    space = space_with_walls()
    ball = disc(space, 0, 100)
    with capture() as captured:
        space.step(DT)
        owner: Any = space if key == "gravity" else ball
        setattr(owner, key, value if key.startswith("ang") else (value, 0.0))
        with contextlib.suppress(AssertionError):  # of pymunk, about some
            space.step(DT)
        space.gravity = 0, 0
        space.step(DT)
    assert captured.omitted or (value == 1e30 and key in ("force", "gravity"))  # a scene can have these
    assert captured.recording.duration > 0.0


def test_settings_of_the_recording_are_those_of_the_space() -> None:
    space = balls()
    space.collision_slop, space.iterations = 0.3, 17
    with capture() as captured:
        space.step(DT)
    settings = captured.recording.settings
    assert (settings.slop, settings.iterations, settings.dt) == (space.collision_slop, 17, DT)
    assert ENGINES["pymunk"].missing(captured.recording.scene, settings) == ()


def test_stored_recording_is_replayed_on_another_engine(tmp_path: Path) -> None:
    """Until the first contacts, which come after 0.2 s, both engines compute the same flight; then they may differ."""
    captured = play(Platformer(), 60)
    path = captured.recording.save(tmp_path / "game.json")
    ours, theirs = (rerun(read_session(path), engine) for engine in ("pymunk", "reference"))
    assert (ours.status, theirs.status) == ("ok", "ok")
    assert len(ours.time) == len(theirs.time) == 61
    assert theirs.position[:12] == pytest.approx(ours.position[:12], abs=1e-9, nan_ok=True)  # of later bodies


class Tuner(Platformer):
    """A game that turns bodies, and changes coefficients of discs, of parts of a body, and of a wall."""

    def __init__(self) -> None:
        super().__init__()
        self.plank = pymunk.Body(3, 700)
        self.plank.position = 0, 150
        self.space.add(self.plank, pymunk.Circle(self.plank, 8, (30, 0)), pymunk.Poly.create_box(self.plank, (60, 10)))
        self.floor = next(iter(self.space.shapes))

    def update(self, k: int) -> None:
        super().update(k)
        (shape,) = self.player.shapes
        if k % 25 == 5:
            self.plank.angle += 1.2
            self.player.angle = 0.1 * k
        if 30 <= k < 90:  # as a player who runs
            shape.surface_velocity = (2 * k - 100, 0)
        if k == 40:
            shape.friction, self.floor.friction = 2.0, 0.3
        if k in (70, 110):
            for part in self.plank.shapes:
                part.elasticity, part.friction = 0.005 * k * part.area / 600, 0.9
        if k == 150:
            self.floor.surface_velocity = 50, 0
            for part in self.others[-1].shapes:
                part.friction = 0.05


def test_angles_and_coefficients_that_a_game_sets_are_replayed() -> None:
    captured = play(Tuner())
    assert not captured.omitted and not captured.inexact
    assert_replayed(captured)


def test_coefficients_of_a_body_that_was_removed_and_added_again_are_named() -> None:
    """The parts of an added body have no paths, and those of the removed one have no effect."""
    space = space_with_walls()
    plank = pymunk.Body(3, 700)
    plank.position = 0, 150
    part = pymunk.Poly.create_box(plank, (60, 10))
    space.add(plank, part)
    with capture() as captured:
        space.step(DT)
        space.remove(plank, part)
        space.step(DT)
        space.add(plank, part)
        space.step(DT)
        part.friction = 0.9
        space.step(DT)
    assert [action.kind for action in captured.recording.actions] == ["remove", "spawn"]
    assert captured.omitted == ("coefficients of shapes of bodies that the game adds and then changes",)


class Car(Platformer):
    """A game with a car, whose player sets the rates and torques of its motors."""

    def __init__(self) -> None:
        super().__init__()
        self.chassis = pymunk.Body(5, 2000)
        self.chassis.position = 60, 60
        self.space.add(self.chassis, pymunk.Poly.create_box(self.chassis, (60, 16)))
        self.motors = []
        for side in (-1, 1):
            tyre = disc(self.space, 60 + 25 * side, 45, 11)
            for shape in tyre.shapes:
                shape.friction = 1.5
            motor = pymunk.SimpleMotor(self.chassis, tyre, 0.0)
            motor.max_force = 20_000
            axle = pymunk.PivotJoint(self.chassis, tyre, tuple(tyre.position))
            axle.collide_bodies = motor.collide_bodies = False
            self.space.add(axle, motor)
            self.motors.append(motor)

    def update(self, k: int) -> None:
        super().update(k)
        if k % 20 == 7:
            for motor in self.motors:
                motor.rate = 8.0 if k % 40 == 7 else -5.0
        if k == 90:
            self.motors[0].max_force = float("inf")
        if k == 150:
            self.motors[0].max_force = 500.0


def test_motors_that_a_game_sets_are_replayed() -> None:
    captured = play(Car())
    assert not captured.omitted
    assert {a.path for a in captured.recording.actions if a.kind == "set" and a.path.startswith("joint")} == {
        "joint[1].rate", "joint[1].max_torque", "joint[3].rate",
    }  # fmt: skip
    assert_replayed(captured)


class Sleeper:
    """A game whose bodies fall asleep, and are woken in every way that a recording has."""

    def __init__(self, calls: bool) -> None:
        self.space, self.calls = space_with_walls(), calls
        self.space.sleep_time_threshold, self.space.idle_speed_threshold = 0.3, 30.0
        self.row = [disc(self.space, 25 * k - 200, 14) for k in range(8)]

    def update(self, k: int) -> None:
        if k == 60:
            self.row[3].velocity = 0, 200
        if k == 100:
            self.row[0].apply_impulse_at_local_point((10, 500))
        if k == 130:
            disc(self.space, 100, 300)
        if k == 140:
            self.space.gravity = 0, -800
        if 160 <= k < 180:
            self.row[5].apply_force_at_local_point((500, 0))
        if k == 190 and self.calls:
            self.row[7].activate()


@pytest.mark.parametrize("calls", [False, True])
def test_replay_of_a_game_whose_bodies_fall_asleep(calls: bool) -> None:
    game = Sleeper(calls)
    captured = play(game)
    slept = [body.is_sleeping for body in game.row]
    assert any(slept) and not all(slept)
    assert captured.omitted == (("bodies that the game wakes or puts to sleep by a call",) if calls else ())
    assert pymunk.Body.activate.__qualname__ == "Body.activate"  # replaced only within the block
    if not calls:
        assert_replayed(captured)


RECORDED_EXAMPLES = (
    *("arrows", "balls_and_lines", "basic_test", "bouncing_balls", "breakout", "collisions", "constraints"),
    *("contact_with_friction", "flipper", "platformer", "playground", "point_query", "slide_and_pinjoint", "tank"),
)
"""Examples that pymunk ships, played with simulated clicks, drags and keys"""


@pytest.mark.fail_slow(60)  # child processes
@pytest.mark.parametrize(
    "name",
    [pytest.param(each, marks=[] if each == "playground" else [pytest.mark.nightly]) for each in RECORDED_EXAMPLES],
)
def test_examples_of_pymunk_are_recorded_and_replayed(name: str, tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    command = [sys.executable, "-W", "ignore", "-m", "tests.pymunk_capture.record_example", name, "150"]
    done = subprocess.run(
        command, env=environment, capture_output=True, text=True, cwd=tmp_path, timeout=120, check=False
    )
    assert "RESULT" in done.stdout, done.stderr[-2000:]
    found = json.loads(done.stdout.split("RESULT")[1])
    assert found["steps"] == 150
    assert found["omitted"] or found["inexact"] or found["replayed"]
    if name in ("bouncing_balls", "playground", "slide_and_pinjoint"):
        assert found["actions"] and not found["omitted"] and not found["inexact"]
