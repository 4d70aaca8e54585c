"""Invalid numbers: each is refused with a reason, before it reaches an engine, from every input."""

from typing import Any

import pytest

from tests.hostile.ordeal import INTERPRETER_FLAGS, run_isolated

pytestmark = pytest.mark.full  # fuzzing and inputs at the ends of their ranges

SCENE = """
PAIR = [{"between": ["m", "m"], "restitution": 0.5, "friction": 0.5}]
def document():
    return {
        "world": {"gravity": [0, -9.81], "wind": [0, 0], "duration": 0.03},
        "solver": {"dt": 0.01},
        "material": [{"name": "m", "restitution": 0.5, "friction": 0.5}],
        "pair": [dict(pair) for pair in PAIR],
        "plane": [{"name": "floor", "point": [0, 0], "normal": [0, 1], "material": "m"}],
        "wall": [{"name": "wall", "points": [[5, 0], [5, 5]], "thickness": 0.1, "material": "m"}],
        "post": [{"name": "post", "position": [-5, 1], "radius": 0.5, "material": "m"}],
        "ball": [
            {"name": "a", "position": [0, 0.9], "velocity": [0, 0], "radius": 1, "material": "m"},
            {"name": "b", "position": [1.9, 1], "radius": 1, "material": "m", "mass": 2.0},
        ],
    }
def put(path, value):
    "Return the document with a value at a path of keys and indices."
    whole = document()
    *keys, last = path.split(".")
    node = whole
    for key in keys:
        node = node[int(key) if key.isdecimal() else key]
    node[int(last) if last.isdecimal() else last] = value
    return whole
VALUES = {
    "-1": -1.0, "-tiny": -5e-324, "0": 0.0, "1e300": 1e300, "nan": math.nan, "inf": math.inf, "-inf": -math.inf,
    "huge": 10**400, "text": "0.1", "true": True,
}
"""

NUMBERS = {
    "ball.0.mass": {},
    "ball.0.radius": {},
    "ball.0.restitution": {"0"},
    "ball.0.friction": {"0"},
    "ball.0.position.0": {"-1", "-tiny", "0"},
    "ball.0.velocity.1": {"-1", "-tiny", "0"},
    "ball.0.angle": {"-1", "-tiny", "0"},
    "ball.0.angular_velocity": {"-1", "-tiny", "0"},
    "ball.1.density": {},  # the mass is stated
    "material.0.restitution": {"0"},
    "material.0.friction": {"0"},
    "pair.0.restitution": {"0"},
    "pair.0.friction": {"0"},
    "plane.0.point.0": {"-1", "-tiny", "0"},
    "plane.0.normal.1": {"-1"},  # upside down, with the balls inside
    "wall.0.thickness": {"0"},
    "wall.0.points.0.0": {"-1", "-tiny", "0"},
    "post.0.radius": {},
    "world.gravity.1": {"-1", "-tiny", "0"},
    "world.wind.0": {"-1", "-tiny", "0"},
    "world.linear_drag": {"0"},
    "world.quadratic_drag": {"0"},
    "world.duration": {},
    "solver.dt": {},
    "solver.substeps": {},
    "solver.iterations": {},
    "solver.slop": {"0"},
    "solver.bias": {"0"},
    "solver.persistence": {},
    "solver.record_every": {},
}
"""Path of a number, and the names of the values that are valid there."""


def expected(valid: Any, failure: str) -> dict[str, str]:
    values = ("-1", "-tiny", "0", "1e300", "nan", "inf", "-inf", "huge", "text", "true")
    return {value: "done" if value in valid else failure for value in values}


@INTERPRETER_FLAGS
def test_invalid_number_in_a_scene_is_a_fault_and_a_valid_one_runs(flags: tuple[str, ...]) -> None:
    code = f"""
def attempt(path, value):
    whole = put(path, value)
    run(from_document(whole))
report({{path: {{name: outcome(attempt, path, value) for name, value in VALUES.items()}} for path in {list(NUMBERS)}}})
"""
    found = run_isolated(SCENE + code, flags)
    assert found == {path: expected(valid, "SceneError") for path, valid in NUMBERS.items()}


@INTERPRETER_FLAGS
def test_invalid_number_in_an_override_is_a_fault(flags: tuple[str, ...]) -> None:
    paths = ["ball.a.mass", "ball.a.friction", "plane.floor.restitution", "solver.dt", "solver.iterations"]
    code = f"""
words = ["-1", "-5e-324", "1e300", "nan", "inf", "-inf", "1" * 5000, "text", "true", "[1, 2]", "{{x = 1}}", ""]
report([
    [outcome(lambda: run(from_document(document(), overrides=[f"{{path}}={{word}}"]))) for word in words]
    for path in {paths}
])
"""
    assert run_isolated(SCENE + code, flags) == [["SceneError"] * 12] * 5


@INTERPRETER_FLAGS
def test_invalid_setting_of_a_run_is_a_validation_error(flags: tuple[str, ...]) -> None:
    keys = ["dt", "substeps", "iterations", "slop", "bias", "persistence", "record_every"]
    valid = {key: NUMBERS[f"solver.{key}"] for key in keys}
    code = f"""
scene = from_document(document())
report({{
    key: {{name: outcome(run, scene, **{{key: value}}) for name, value in VALUES.items()}} for key in {keys}
}})
"""
    assert run_isolated(SCENE + code, flags) == {key: expected(valid[key], "ValidationError") for key in keys}


@INTERPRETER_FLAGS
def test_unknown_or_unsupported_setting_or_engine_is_refused(flags: tuple[str, ...]) -> None:
    code = """
scene = from_document(document())
report([
    outcome(run, scene, zzz=1), outcome(run, scene, detection="psychic"), outcome(run, scene, engine="zzz"),
    run(scene, detection="swept").status, run(scene, broad_phase="grid").status, run(scene, response="penalty").status,
])
"""
    names = ["ValidationError", "ValidationError", "UnknownEngineError", "refused", "refused", "refused"]
    assert run_isolated(SCENE + code, flags) == names


@INTERPRETER_FLAGS
def test_invalid_parameter_of_a_running_simulation_is_refused_and_changes_nothing(flags: tuple[str, ...]) -> None:
    paths = ["material.m.restitution", "material.m.friction", "ball.a.friction", "pair.0.restitution"]
    code = f"""
simulation = start(from_document(document()))
steps(simulation, 2)
def attempt(path, value):
    before = simulation.state_hash()
    try:
        simulation.apply(SetParameter(time=0, path=path, value=value))
    finally:
        if simulation.state_hash() != before:
            sys.exit("the state has changed")
found = {{
    path: {{name: outcome(attempt, path, value) for name, value in VALUES.items() if name != "huge"}}
    for path in {paths}
}}
others = {{
    f"{{path}} {{value}}": outcome(attempt, path, value)
    for path in ("world.gravity", "world.wind", "world.linear_drag", "world.quadratic_drag")
    for value in (-1.0, [0.0], [0.0, 1e13], [1e300, 0.0], "x", None, True, [0.0, 0.0, 0.0])
}}
places = [
    outcome(attempt, path, 0.5)
    for path in ("restitution", "ball.restitution", "ball.zzz.restitution", "ball.9.friction", "world.friction",
                 "world.gravity.friction", "title.friction", "ball.a.position.friction", "ball.a.mass", "solver.dt",
                 ".restitution", "'.restitution", "ball..friction", "ball.a.name.friction")
]
steps(simulation, 20)
report([found, others, places, is_finite(simulation)])
"""
    found, others, places, finite = run_isolated(SCENE + code, flags)
    for path, outcomes in found.items():
        wanted = expected({"0"}, "ActionError")
        assert outcomes == {
            name: ("ValidationError" if name in ("nan", "inf", "-inf") else wanted[name]) for name in outcomes
        }, path
    assert set(others.values()) == {"ActionError"}, others
    assert places == ["ActionError"] * 14
    assert finite


@INTERPRETER_FLAGS
@pytest.mark.parametrize("kind", ["impulse", "force", "move", "spawn"])
def test_invalid_number_in_an_action_is_a_validation_error(kind: str, flags: tuple[str, ...]) -> None:
    code = f"""
wrong = [math.nan, math.inf, -math.inf, 1e300, "1", True]
def attempt(value):
    simulation = start(from_document(document()))
    match {kind!r}:
        case "impulse":
            simulation.apply(Impulse(time=0, body="a", impulse=(value, 0.0)))
        case "force":
            simulation.apply(Force(time=0, body="a", force=(0.0, 0.0), torque=value))
        case "move":
            simulation.apply(Move(time=0, body="a", position=(0.0, value)))
        case "spawn":
            simulation.apply(Spawn(time=0, ball=Ball(position=(0.0, 9.0), radius=1.0, mass=value)))
report([outcome(attempt, value) for value in wrong])
"""
    assert run_isolated(SCENE + code, flags) == ["ValidationError"] * 6


@INTERPRETER_FLAGS
def test_run_of_too_many_steps_is_refused(flags: tuple[str, ...]) -> None:
    code = """
whole = document()
whole["world"]["duration"] = 1e9
whole["solver"]["dt"] = 10
scene = from_document(whole)
report([
    outcome(run, scene, dt=1e-9, record_every=10**9), outcome(run, scene, substeps=1000, record_every=10**9),
    outcome(from_document, whole, overrides=["solver.dt=1e-3"]),
])
"""
    assert run_isolated(SCENE + code, flags) == ["TooLargeError", "TooLargeError", "SceneError"]


@INTERPRETER_FLAGS
def test_malformed_documents_are_faults(flags: tuple[str, ...]) -> None:
    code = """
deep = []
for _ in range(3000):
    deep = [deep]
documents = [
    {"ball": deep}, {"ball": 3}, {"ball": [3]}, {"ball": {}}, {"ball": [{}]}, {"ball": [None]}, {"balls": []},
    {"world": []}, {"solver": None}, {"material": [{"name": "\\ud800"}]}, {"x": 1}, {"ball": [{"position": [0, 0]}]},
    {"ball": [{"position": [0, 0, 0], "radius": 1}]}, {"ball": [{"position": "00", "radius": 1}]},
]
texts = ["", "\\0", "[[ball]]", "x = [", "ball = 1", "[" * 100_000, "x." * 100_000 + "y = 1", "x = " + "9" * 10_000]
report([outcome(from_document, each) for each in documents] + [outcome(loads, each) for each in texts])
"""
    assert run_isolated(code, flags) == ["SceneError"] * 22
