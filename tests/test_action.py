"""Actions: validation, JSON, order in time."""

import copy
import json
import math
import pickle
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from sandbox.action import (
    Action,
    ActionError,
    Force,
    Impulse,
    Move,
    Remove,
    SetParameter,
    Spawn,
    actions_from_json,
    actions_to_json,
    check_speed,
    in_order,
    is_settable,
)
from sandbox.scene.description.discs import Ball
from tests.strategies import names, numbers

GOOD: list[dict[str, Any]] = [
    {"kind": "impulse", "time": 0, "body": "a", "impulse": [1, 2]},
    {"kind": "force", "time": 1, "body": "a", "force": [0.0, 0.0], "torque": 3.0},
    {"kind": "move", "time": 2.5, "body": "a", "position": [1, 2], "velocity": [3, 4]},
    {"kind": "spawn", "time": 3, "ball": {"position": [0, 0], "radius": 1, "name": "new"}},
    {"kind": "remove", "time": 3, "body": "a"},
    {"kind": "set", "time": 4, "path": "world.gravity", "value": [0.0, 1.0]},
]


def actions() -> st.SearchStrategy[tuple[Action, ...]]:
    """Valid actions of every kind."""
    time, amount = numbers(0, 1e9), numbers(-1e42, 1e42)
    pair, velocity = st.tuples(amount, amount), st.tuples(numbers(-7e11, 7e11), numbers(-7e11, 7e11))
    position = st.tuples(numbers(-1e16, 1e16), numbers(-1e16, 1e16))
    value = st.floats(allow_nan=False, allow_infinity=False) | st.integers() | st.booleans() | st.text() | st.none()
    ball = st.builds(Ball, position=position, velocity=velocity, radius=numbers(1e-9, 1e9), name=st.none() | names())
    kinds: list[st.SearchStrategy[Action]] = [
        st.builds(Impulse, time=time, body=names(), impulse=pair, angular=amount),
        st.builds(Force, time=time, body=names(), force=pair, torque=amount),
        st.builds(Move, time=time, body=names(), position=position, velocity=st.none() | velocity),
        st.builds(Spawn, time=time, ball=ball),
        st.builds(Remove, time=time, body=names()),
        st.builds(SetParameter, time=time, path=names(), value=value | st.lists(st.floats(-9, 9))),
    ]
    return st.lists(st.one_of(kinds), max_size=6).map(tuple)


def read(*documents: dict[str, Any]) -> tuple[Action, ...]:
    return actions_from_json(json.dumps(documents))


def test_every_kind_of_action_is_read_from_json() -> None:
    kinds = [type(action) for action in read(*GOOD)]
    assert kinds == [Impulse, Force, Move, Spawn, Remove, SetParameter]
    assert read(GOOD[0]) == (Impulse(time=0.0, body="a", impulse=(1.0, 2.0), angular=0.0),)


@given(actions())
def test_actions_written_and_read_again_are_equal(given_actions: tuple[Action, ...]) -> None:
    assert actions_from_json(json.dumps(actions_to_json(given_actions))) == given_actions


def test_set_parameter_keeps_the_type_of_its_value() -> None:
    for value in (1, 1.5, True, False, "x", [1.0, 2.0], None):
        action = read({"kind": "set", "time": 0, "path": "p", "value": value})[0]
        assert isinstance(action, SetParameter)
        assert action.value == value
        assert type(action.value) is type(value)


@pytest.mark.parametrize("good", GOOD)
@pytest.mark.parametrize(
    "change",
    [
        {"time": -1e-9}, {"time": 1.1e9}, {"time": True}, {"time": "0"}, {"time": math.nan}, {"time": math.inf},
        {"time": None},
        {"kind": "kick"}, {"kind": None}, {"zzz": 1}, {"kind": ["set"]},
    ],
)  # fmt: skip
def test_action_with_a_wrong_value_is_refused(good: dict[str, Any], change: dict[str, Any]) -> None:
    with pytest.raises(ActionError):
        read({**good, **change})


@pytest.mark.parametrize("good", GOOD)
def test_action_without_a_required_field_is_refused(good: dict[str, Any]) -> None:
    for key in good.keys() - {"velocity", "torque"}:
        with pytest.raises(ActionError):
            read({other: value for other, value in good.items() if other != key})


@pytest.mark.parametrize(
    ("kind", "change"),
    [
        (0, {"impulse": [1]}), (0, {"impulse": [1, 2, 3]}), (0, {"impulse": [1e43, 0]}), (0, {"impulse": ["1", 0]}),
        (0, {"impulse": [math.nan, 0]}), (0, {"angular": True}), (0, {"body": ""}), (0, {"body": "a\nb"}),
        (0, {"body": 1}),
        (0, {"body": "x" * 201}), (1, {"force": [0, -1e43]}), (1, {"torque": math.inf}), (2, {"position": [1.1e16, 0]}),
        (2, {"velocity": [1e12, 1e12]}), (2, {"velocity": [math.nan, 0]}), (3, {"ball": {"radius": 1}}),
        (3, {"ball": {"position": [0, 0], "radius": -1}}), (3, {"ball": {"position": [0, 0], "radius": 1, "x": 1}}),
        (3, {"ball": None}), (4, {"body": None}), (5, {"path": ""}), (5, {"value": {}}), (5, {"value": math.nan}),
        (5, {"value": [math.inf]}), (5, {"value": ["1"]}),
    ],
)  # fmt: skip
def test_action_with_a_field_out_of_bounds_is_refused(kind: int, change: dict[str, Any]) -> None:
    with pytest.raises(ActionError):
        read({**GOOD[kind], **change})


@pytest.mark.parametrize(
    "text", ["", "null", "{}", "3", "[3]", "[[]]", "[{}]", "[", '"x"', "[" * 100_000, '[{"kind": "\\ud800"}]', "[nan]"]
)
def test_text_that_is_not_an_array_of_actions_is_refused(text: str) -> None:
    with pytest.raises(ActionError):
        actions_from_json(text)


def test_error_has_one_line_with_the_path_of_each_fault() -> None:
    with pytest.raises(ActionError) as caught:
        read({**GOOD[0], "time": -1}, GOOD[1], {**GOOD[4], "body": 3})
    first, second = str(caught.value).splitlines()
    assert first.startswith("0.impulse.time: ")
    assert second.startswith("2.remove.body: ")


def test_actions_are_sorted_by_time_stably() -> None:
    one, two, three = (Remove(time=t, body=b) for t, b in ((1.0, "x"), (0.0, "y"), (1.0, "a")))
    assert in_order((one, two, three)) == (two, one, three)
    assert in_order(()) == ()


@pytest.mark.parametrize(
    ("path", "can"),
    [
        ("world.gravity", True), ("world.wind", True), ("world.linear_drag", True), ("world.quadratic_drag", True),
        ("material.rubber.friction", True), ("ball.cue.restitution", True), ("pair.0.restitution", True),
        ("world.seed", False), ("world.duration", False), ("solver.dt", False), ("ball.cue.mass", False), ("", False),
        ("world", False), ("world.gravity.1", False), ("frictions", False), ("joint[0].rate", True),
        ("joint.engine.max_torque", True), ("joint.engine.strength", False), ("drive.engine.rate", False),
    ],
)  # fmt: skip
def test_only_air_gravity_motors_and_surface_coefficients_are_settable(path: str, can: bool) -> None:
    assert is_settable(path) is can


def test_speed_above_the_limit_or_not_finite_is_refused() -> None:
    check_speed(1e12, "a")
    for speed in (math.nextafter(1e12, math.inf), math.inf, math.nan):
        with pytest.raises(ActionError, match="out of range"):
            check_speed(speed, "a")


def test_actions_are_frozen() -> None:
    with pytest.raises(ValidationError, match="frozen"):
        Remove(time=0.0, body="a").time = 1.0  # type: ignore[misc] # the point of the test


def test_faults_of_a_value_of_several_types_name_the_types() -> None:
    with pytest.raises(ActionError) as caught:
        actions_from_json('[{"kind": "set", "time": 0, "path": "ball.a.restitution", "value": {}}]')
    kinds = [line.partition(":")[0].removeprefix("0.set.value.") for line in str(caught.value).splitlines()]
    assert kinds == ["float", "int", "bool", "str", "list[float]"]


@given(actions(), numbers(0.0, 1e6))
def test_action_at_another_time_equals_one_that_was_created_so(some: tuple[Action, ...], time: float) -> None:
    for action in some:
        moved = action.at(time)
        assert moved == type(action).model_validate({**dict(action), "time": time})
        assert moved.model_fields_set == action.model_fields_set | {"time"}
        assert pickle.loads(pickle.dumps(moved)) == moved == copy.deepcopy(moved) == moved.model_copy()
        assert action.time == time or moved != action  # the original keeps its time
