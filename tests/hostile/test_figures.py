"""Invalid numbers: each is refused with a reason, before it reaches an engine, from every input."""

import pytest

from tests.hostile.ordeal import INTERPRETER_FLAGS, run_isolated

pytestmark = pytest.mark.fail_slow(60)  # fuzzing and inputs at the ends of their ranges

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

NUMBERS = [
    "ball.0.mass", "ball.0.radius", "ball.0.restitution", "ball.0.friction", "ball.0.position.0", "ball.0.velocity.1",
    "ball.0.angle", "ball.0.angular_velocity", "ball.1.density", "material.0.restitution", "material.0.friction",
    "pair.0.restitution", "pair.0.friction", "plane.0.point.0", "plane.0.normal.1", "wall.0.thickness",
    "wall.0.points.0.0", "post.0.radius", "world.gravity.1", "world.wind.0", "world.linear_drag",
    "world.quadratic_drag", "world.duration",
]  # fmt: skip
SETTINGS = ["dt", "substeps", "iterations", "slop", "bias", "persistence", "record_every"]
POSSIBLE = {"-1", "-tiny", "0"}
"""Values that are valid for some numbers; `scene/test_bounds.py` has the bounds of each."""


def check_outcomes(found: dict[str, dict[str, str]], failure: str) -> None:
    """Check that each number was run or refused, and that the values that no number may have were refused."""
    for path, outcomes in found.items():
        for value, outcome in outcomes.items():
            assert outcome == failure or (outcome == "done" and value in POSSIBLE), (path, value)


@INTERPRETER_FLAGS
def test_invalid_number_in_a_scene_is_a_fault_and_a_valid_one_runs(flags: tuple[str, ...]) -> None:
    paths = [*NUMBERS, *(f"solver.{key}" for key in SETTINGS)]
    code = f"""
def attempt(path, value):
    whole = put(path, value)
    run(from_document(whole))
report({{path: {{name: outcome(attempt, path, value) for name, value in VALUES.items()}} for path in {paths}}})
"""
    check_outcomes(run_isolated(SCENE + code, flags), "SceneError")


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
def test_invalid_setting_of_a_run_is_a_settings_error(flags: tuple[str, ...]) -> None:
    code = f"""
scene = from_document(document())
report({{
    key: {{name: outcome(run, scene, **{{key: value}}) for name, value in VALUES.items()}} for key in {SETTINGS}
}})
"""
    check_outcomes(run_isolated(SCENE + code, flags), "SettingsError")


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
        wrong = {name: "PartError" if name in ("nan", "inf", "-inf") else "ActionError" for name in outcomes}
        assert outcomes == wrong | {"0": "done"}, path
    assert set(others.values()) == {"ActionError"}, others
    assert places == ["ActionError"] * 14
    assert finite
