"""Scenes built from public classes: arguments are checked where they are given, relations where the scene is used."""

import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import sandbox

BALL: dict[str, Any] = {"position": [0.0, 1.0], "radius": 0.1}
BALL_A = sandbox.Ball(name="a", **BALL)


def faults_at(make: Callable[[], object]) -> list[str]:
    """Return the paths of the faults of a part; its message has no address of pydantic."""
    with pytest.raises(sandbox.PartError) as caught:
        make()
    assert isinstance(caught.value, ValueError)
    assert "http" not in str(caught.value)
    assert "pydantic" not in str(caught.value)
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)
    return [fault.path for fault in caught.value.faults]


@pytest.mark.parametrize(
    ("kind", "values", "paths"),
    [
        ("Ball", {**BALL, "radius": -1}, ["radius"]),
        ("Ball", {"radius": -1}, ["position", "radius"]),
        ("Ball", {**BALL, "position": (1.0, float("nan"))}, ["position[1]"]),
        ("Ball", {**BALL, "raduis": 1.0}, ["raduis"]),
        ("Ball", {**BALL, "velocity": (1e13, 0.0)}, ["velocity"]),
        ("Ball", {**BALL, "colour": "red"}, ["colour"]),
        ("Rod", {}, ["between"]),
        ("Scene", {"balls": [1]}, ["balls[0]"]),
        ("Scene", {"balls": [{**BALL, "radius": "x"}]}, ["balls[0].radius"]),
        ("Scene", {"joints": [1]}, ["joints[0]"]),
        ("Scene", {"joints": [{"kind": "glue"}]}, ["joints[0]"]),
        ("Wall", {"points": [[0, 0], [1, 0]], "kick": 3}, ["kick"]),
        ("Stroke", {"aim": "x", "speed": 1.0}, ["aim"]),
        ("Impulse", {"body": "a", "impulse": [1.0, 0.0]}, ["time"]),
        ("Spawn", {"time": 0.0}, [""]),
        ("Settings", {"dt": -1}, ["solver.dt"]),
        ("Settings", {"dtt": 1}, ["solver.dtt"]),
    ],
)
def test_invalid_argument_is_refused_with_its_path(kind: str, values: dict[str, Any], paths: list[str]) -> None:
    assert faults_at(lambda: getattr(sandbox, kind)(**values)) == paths


def test_unknown_argument_is_refused_with_a_suggestion() -> None:
    with pytest.raises(sandbox.PartError, match=r"Ball: raduis: .* 'radius'"):
        sandbox.Ball(**BALL, raduis=1.0)  # type: ignore[call-arg]


def test_settings_raise_their_own_error_however_they_are_given() -> None:
    for change in (lambda: sandbox.Settings(dt=-1.0), lambda: sandbox.run("bounce", dt=-1.0)):
        with pytest.raises(sandbox.SettingsError, match=r"solver\.dt"):
            change()


@pytest.mark.parametrize(
    "positions",
    [{3.0, 1.0}, frozenset((3.0, 1.0)), {3.0: 0, 1.0: 0}, {3.0: 0, 1.0: 0}.keys()],
    ids=["set", "frozenset", "dict", "keys"],
)
def test_values_without_an_order_are_no_vector(positions: Any) -> None:
    assert faults_at(lambda: sandbox.Ball(position=positions, radius=0.1)) == ["position"]


def test_a_single_part_is_no_list_of_parts() -> None:
    single: Any = sandbox.Ball(position=(0.0, 1.0), radius=0.1)
    assert faults_at(lambda: sandbox.Scene(balls=single)) == ["balls"]


def test_message_on_a_float_for_a_whole_number_shows_the_float() -> None:
    with pytest.raises(sandbox.SettingsError, match=r"must be a whole number, is 3\.0"):
        sandbox.Settings(substeps=3.0)  # type: ignore[arg-type]  # no whole number


def test_scalars_and_arrays_of_numpy_are_accepted() -> None:
    settings = sandbox.Settings(
        iterations=np.int64(5), substeps=np.uint8(2), half_kick=np.bool_(True), dt=np.float64(0.02)
    )  # type: ignore[arg-type]
    assert settings == sandbox.Settings(iterations=5, substeps=2, half_kick=True, dt=0.02)
    assert type(settings.iterations) is int
    ball = sandbox.Ball(position=np.array([0, 1]), radius=np.int32(1), mass=np.float32(0.5))  # type: ignore[arg-type]
    assert ball == sandbox.Ball(position=(0.0, 1.0), radius=1.0, mass=0.5)
    assert sandbox.run("bounce", iterations=np.int64(3)).info["settings"]["iterations"] == 3


@pytest.mark.parametrize("value", [np.float64(5.0), np.bool_(True), True, np.array([5])])
def test_other_types_of_numpy_are_no_whole_number(value: Any) -> None:
    assert faults_at(lambda: sandbox.Settings(iterations=value)) == ["solver.iterations"]


FAULTY = {
    "material": (sandbox.Scene(balls=[sandbox.Ball(**BALL, material="ice")]), "ball[0].material"),
    "body": (sandbox.Scene(balls=[BALL_A], joints=[sandbox.Rod(between=["a", "b"])]), "joint[0].between[1]"),
    "normal": (sandbox.Scene(balls=[BALL_A], planes=[sandbox.Plane(point=[0, 0], normal=[0, 0])]), "plane[0].normal"),
    "names": (sandbox.Scene(balls=[BALL_A, BALL_A]), "ball.a.name"),
}


@pytest.mark.parametrize(("scene", "path"), FAULTY.values(), ids=list(FAULTY))
@pytest.mark.parametrize(
    "use",
    [sandbox.run, sandbox.start, lambda scene: sandbox.compare(scene, ["pymunk"]), sandbox.tradeoff],
    ids=["run", "start", "compare", "tradeoff"],
)
def test_faults_between_parts_are_those_of_the_file(
    scene: sandbox.Scene, path: str, use: Callable[[sandbox.Scene], object]
) -> None:
    with pytest.raises(sandbox.SceneError) as caught:
        use(scene)
    with pytest.raises(sandbox.SceneError) as of_file:
        sandbox.loads(sandbox.dumps(scene))
    messages = {(fault.path, fault.message) for fault in caught.value.faults}
    assert path in {each[0] for each in messages}
    assert messages == {(fault.path, fault.message) for fault in of_file.value.faults}


def test_changed_copy_of_a_loaded_scene_is_checked() -> None:
    scene = sandbox.load("bounce")
    assert sandbox.run(scene, dt=0.1).status == "ok"
    with pytest.raises(sandbox.SceneError, match="unique"):
        sandbox.run(scene.model_copy(update={"balls": scene.balls * 2}))


def test_scene_that_was_checked_equals_one_that_was_not() -> None:
    scene = sandbox.Scene(balls=[BALL_A], world=sandbox.World(duration=0.1))
    assert sandbox.run(scene).status == "ok"
    assert scene == sandbox.Scene(balls=[BALL_A], world=sandbox.World(duration=0.1))
    assert sandbox.loads(sandbox.dumps(scene)) == scene
