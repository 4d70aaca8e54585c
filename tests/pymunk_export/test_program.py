"""Standalone pymunk programs: same states as the engine bit for bit, reasons of refusals, and safe source."""

import ast
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pymunk
import pytest
from hypothesis import given, reject
from hypothesis import strategies as st

from sandbox.arrays import FloatArray
from sandbox.engines.common.colliders import wall_segments
from sandbox.engines.pymunk_adapter.colliders import SHUFFLED_FROM
from sandbox.engines.registry import start
from sandbox.engines.sensors import SceneSensors
from sandbox.pymunk_capture.space_capture import from_pymunk
from sandbox.pymunk_export import ProgramError, obstacles, program_text, with_divided_walls
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import from_document, load, loads
from sandbox.scene.files.shipped_scenes import find
from tests.engines.stepping import advance
from tests.laws.test_paths import PATHS, passenger, platform
from tests.laws.test_paths import scene_of as scene_with_paths
from tests.pymunk_capture.test_space_capture import (
    balls,
    joints,
    kinematic,
    limited_joints,
    mixed,
    moving_surfaces,
    pyramid,
    sleeping,
)
from tests.samples import each_shipped_scene
from tests.strategies import OUTLINES, numbers, pairs

pytestmark = pytest.mark.fail_slow(60)  # runs programs in new processes

SUBSTEPS = 300

REFUSED = {
    "artillery/duel": {"world.linear_drag", "wall"},
    "billiards/9-ball": {"surface"},
    "games/rube_goldberg": {"joint", "wall"},
    "particles/sparks": {"world.linear_drag", "emitter"},
    "pinball/full": {"drive", "zone", "wall", "material"},
    "tutorial/spaceship": {"thrust"},
}
"""Paths of the reasons why a shipped scene is refused."""


def executed(scene: Scene) -> dict[str, Any]:
    """Return the names that the program of a scene defines."""
    names: dict[str, Any] = {"__name__": "game"}
    exec(compile(program_text(scene), "game.py", "exec"), names)
    return names


def state_of(body: Any) -> FloatArray:
    return np.array([*body.position, *body.velocity, body.angle, body.angular_velocity])


def differing(scene: Scene, substeps: int = SUBSTEPS) -> list[str]:
    """Return the bodies whose final states on the engine and in the program differ in a bit."""
    program = executed(scene)
    space, bodies = program["make_space"]()
    names = scene.bodies.names
    assert sorted(bodies) == sorted(names)
    simulation = start(scene, "pymunk")
    for _ in range(-(-substeps // scene.solver.substeps)):
        simulation.step()
        program["step"](space)
    frame = simulation.frame()
    states = np.column_stack((frame.position, frame.velocity, frame.angle, frame.angular_velocity))
    found = []
    for name, state, is_present in zip(names, states, frame.present.tolist(), strict=True):
        body = bodies[name]
        same = state_of(body).tobytes() == state.tobytes() if is_present else body.space is None
        found += [] if same else [name]
    simulation.close()
    return found


@pytest.mark.parametrize("name", ["benchmark/pile", "benchmark/pyramid", "joints/ragdoll_stairs"])
def test_program_of_a_damped_scene_has_the_states_of_the_engine(name: str) -> None:
    scene = load(find(name), ["world.damping=0.9"])
    assert executed(scene)["make_space"]()[0].damping == 0.9
    assert differing(scene) == []


@pytest.mark.parametrize("name", each_shipped_scene())
def test_shipped_scene_has_the_states_of_the_engine_or_is_refused(name: str) -> None:
    scene = load(find(name))
    refused = {each.path for each in obstacles(scene)}
    if not refused:
        assert name not in REFUSED
        assert differing(scene) == []
        return
    assert REFUSED.get(name, refused) == refused
    with pytest.raises(ProgramError) as error:
        program_text(scene)
    assert {each.path for each in error.value.obstacles} == refused


@pytest.mark.parametrize("name", each_shipped_scene())
def test_shipped_scene_with_divided_walls_has_its_states_or_is_refused_for_other_reasons(name: str) -> None:
    scene = load(find(name))
    divided, names = with_divided_walls(scene)
    assert bool(names) == any("divide it into walls" in each.message for each in obstacles(scene))
    assert not any("divide it into walls" in each.message for each in obstacles(divided))
    if not names:
        assert divided is scene
    elif not obstacles(divided):
        assert differing(divided) == []


BASE: dict[str, Any] = {
    "world": {"gravity": [0.0, -9.81]},
    "solver": {"dt": 0.01, "substeps": 2},
    "plane": [{"name": "ground", "point": [0.0, 0.0], "normal": [0.1, 1.0], "restitution": 0.5, "friction": 0.6}],
}

CONTENTS: dict[str, dict[str, Any]] = {
    "constant thrusts": {
        "box": [{"name": "ship", "position": [0.0, 3.0], "size": [1.0, 0.5], "angle": 0.3}],
        "thrust": [
            {"body": "ship", "force": [1.0, 12.0], "point": [0.2, -0.25]}, {"body": "ship", "force": [0.0, 3.0]},
        ],
    },
    "thrust on a body without contacts": {
        "ball": [{"name": "ghost", "position": [0.0, 3.0], "radius": 0.5, "collides": "none"}],
        "thrust": [{"body": "ghost", "force": [2.0, 9.0]}],
    },
    "gravity scales and speed limits": {
        "ball": [
            {"name": "balloon", "position": [0.0, 1.0], "radius": 0.3, "mass": 0.7, "gravity_scale": -0.3},
            {"name": "rock", "position": [1.0, 3.0], "radius": 0.3, "gravity_scale": 1.7, "max_speed": 3.1},
            {"name": "ghost", "position": [2.0, 3.0], "radius": 0.3, "gravity_scale": 0.3, "collides": "none"},
            {"name": "top", "position": [3.0, 0.5], "radius": 0.3, "angular_velocity": 9, "max_angular_velocity": 4.3},
        ],
        "box": [{"name": "ship", "position": [-2.0, 3.0], "size": [1.0, 0.5], "gravity_scale": 0.7, "angle": 0.2}],
        "thrust": [{"body": "ship", "force": [1.0, 12.0], "point": [0.2, -0.25]}],
    },
    "gravity scales with sleep": {
        "ball": [
            {"name": "rock", "position": [1.0, 3.0], "radius": 0.3, "gravity_scale": 1.7},
            {"name": "ghost", "position": [2.0, 3.0], "radius": 0.3, "gravity_scale": 0.3, "collides": "none"},
            {"name": "leaf", "position": [3.0, 0.7], "radius": 0.3, "gravity_scale": 0.4},
        ],
        "plane": [{"name": "level", "point": [0.0, 0.0], "normal": [0.0, 1.0], "friction": 0.6}],
        "solver": {"dt": 0.01, "substeps": 2, "sleeping": True, "sleep_time": 0.3},
    },
    "bounds": {
        "grid": [
            {
                "origin": [0.0, 2.0], "columns": 5, "rows": 2, "spacing": [1.0, 1.0], "radius": 0.3,
                "velocity_jitter": 5.0,
            },
        ],
        "world": {"gravity": [0.0, -9.81], "bounds": [[-3.0, -9.0], [4.0, 9.0]]},
    },
    "pairs without factors": {
        "material": [{"name": "a", "restitution": 0.3}, {"name": "b", "restitution": 0.4}],
        "pair": [
            {"between": ["a", "b"], "restitution": 0.9, "friction": 0.2}, {"between": ["a", "a"], "restitution": 0.1},
            {"between": ["b", "b"], "restitution": 0.2},
        ],
        "grid": [
            {
                "origin": [0.0, 1.0], "columns": 4, "rows": 2, "spacing": [0.61, 0.7], "radius": 0.3, "material": "a",
                "jitter": 0.1,
            },
            {
                "origin": [0.1, 4.0], "columns": 4, "rows": 2, "spacing": [0.61, 0.7], "radius": 0.3, "material": "b",
                "jitter": 0.1,
            },
        ],
    },
    "moving surface": {
        "wall": [{"points": [[-5.0, 2.0], [5.0, 2.0]], "thickness": 0.2, "friction": 0.7, "surface_speed": 2.0}],
        "box": [{"position": [0.0, 2.5], "size": [0.5, 0.5], "friction": 0.8}],
        "ball": [{"position": [2.0, 2.6], "radius": 0.5, "friction": 0.9}],
    },
    "surface velocities": {
        "wall": [
            {"points": [[-5.0, 2.0], [5.0, 2.0]], "thickness": 0.2, "friction": 0.7, "surface_velocity": [2.0, 0.0]},
            {"points": [[-5.0, 0.0], [5.0, 0.0]], "friction": 0.7, "surface_speed": 1.0},
        ],
        "box": [{"position": [0.0, 2.5], "size": [0.5, 0.5], "friction": 0.8}],
        "ball": [
            {"position": [2.0, 2.6], "radius": 0.5, "friction": 0.9, "surface_velocity": [-1.0, 0.5]},
            {"position": [3.0, 0.6], "radius": 0.5, "friction": 0.9, "surface_velocity": [-1.0, 0.5]},
        ],
    },
    "layers": {
        "wall": [{"points": [[-5.0, 2.0], [5.0, 1.0]], "layers": ["ramp"]}],
        "post": [{"position": [1.0, 1.0], "radius": 0.3, "layers": ["ground", "ramp"], "restitution": 0.8}],
        "ball": [
            {"position": [-2.0, 3.0], "radius": 0.5, "layer": "ramp"},
            {"position": [0.9, 3.0], "radius": 0.5, "friction": 1.0},
            {"position": [0.5, 3.0], "radius": 0.5, "layer": "ramp"},
        ],
    },
    "polylines and an opening": {
        "wall": [
            {
                "name": "fence", "points": [[-3.0, 4.0], [-1.0, 1.0], [1.0, 1.0], [3.0, 4.0]], "thickness": 0.1,
                "restitution": 0.7,
            },
            {"points": [[0.0, 0.0], [2.0, 0.0], [1.0, 0.5]], "closed": True},
        ],
        "post": [{"position": [0.0, 3.0], "radius": 1.0, "solid": False}],
        "grid": [
            {"origin": [-1.5, 5.0], "columns": 6, "rows": 3, "spacing": [0.5, 0.5], "radius": 0.2, "jitter": 0.5},
        ],
    },
    "kinematic bodies": {
        "box": [
            {
                "name": "mill", "position": [0.0, 1.5], "size": [3.0, 0.3], "kinematic": True,
                "angular_velocity": 1.5, "restitution": 0.5,
            },
            {
                "name": "lift that nothing can touch", "position": [-2.0, 0.0], "size": [0.5, 0.5], "kinematic": True,
                "velocity": [0.0, 0.3], "collides": "none",
            },
        ],
        "grid": [{"origin": [-1.5, 3.0], "columns": 6, "rows": 3, "spacing": [0.5, 0.5], "radius": 0.2}],
    },
    "fixed bodies that nothing can touch": {
        "ball": [
            {
                "position": [0.0, 5.0], "radius": 0.5, "collides": "none", "velocity": [1.0, 0.0],
                "angular_velocity": 3.0,
            },
        ],
        "box": [{"position": [4.0, 4.0], "size": [1.0, 1.0], "fixed": True, "angle": 0.5}],
    },
}  # fmt: skip


@pytest.mark.parametrize("name", CONTENTS)
def test_program_has_the_states_of_the_engine(name: str) -> None:
    scene = from_document(BASE | CONTENTS[name])
    assert differing(scene, 600) == []
    if name == "bounds":  # some bodies must have left, or nothing was tested
        simulation = start(scene, "pymunk")
        advance(simulation, 300)
        assert not simulation.frame().present.all()


POINTS = st.lists(st.tuples(st.integers(-4, 4), st.integers(-3, 1)), min_size=3, max_size=6, unique=True)
WALLS = st.lists(
    st.tuples(POINTS, st.booleans(), st.sampled_from((None, "w 1", "w", "wall-1"))), min_size=1, max_size=3
)


@given(WALLS)
def test_bent_walls_that_boxes_can_touch_are_divided_into_the_segments_of_the_engine(
    walls: list[tuple[list[tuple[int, int]], bool, str | None]],
) -> None:
    names = set[str | None]()
    document: dict[str, Any] = {"wall": [], **CRATES}
    for points, is_closed, name in walls:
        named = {} if name is None or name in names else {"name": name}
        names.add(name)
        document["wall"].append({**named, "points": points, "closed": is_closed, "thickness": 0.1, "friction": 0.3})
    try:
        scene = from_document(BASE | document)
    except SceneError:  # two corners in one place, a wall through a box, or names that clash
        reject()
    divided, bent = with_divided_walls(scene)
    assert bent == scene.fixed_names[1:]
    assert len(set(divided.fixed_names)) == len(divided.fixed_names)
    segments = [(part.a, part.b) for wall in scene.walls for part in wall_segments(wall)]
    assert [wall.points for wall in divided.walls] == segments
    assert {(wall.thickness, wall.friction, wall.closed) for wall in divided.walls} == {(0.1, 0.3, False)}
    assert obstacles(scene) and not obstacles(divided)
    assert differing(divided, 60) == []


CRATES: dict[str, Any] = {
    "box": [{"name": f"crate {k}", "position": [k, 4.0], "size": [0.6, 0.6], "friction": 0.3} for k in (-2, 0, 2)],
    "grid": [{"origin": [-3.0, 6.0], "columns": 5, "rows": 1, "spacing": [1.5, 1.0], "radius": 0.2}],
}


def test_wall_that_only_balls_touch_is_not_divided() -> None:
    bowl = {"name": "bowl", "points": [[-3.0, 3.0], [0.0, 0.0], [3.0, 3.0]]}
    away = {"box": [{"position": [0.0, 9.0], "size": [1.0, 1.0], "collides": "none"}]}
    scene = from_document(BASE | {"wall": [bowl], "grid": CRATES["grid"]} | away)
    assert with_divided_walls(scene) == (scene, ())
    assert differing(scene) == []


def test_many_shapes_are_added_in_the_order_of_the_engine() -> None:
    count = SHUFFLED_FROM + 10
    posts = [{"position": [0.5 * k, 0.0], "radius": 0.1} for k in range(count)]
    grid = {"origin": [0.0, 1.0], "columns": count, "rows": 1, "spacing": [0.3, 0.3], "radius": 0.14, "jitter": 0.3}
    ghost = {"position": [0.0, 9.0], "radius": 0.1, "collides": "none"}
    scene = from_document({"world": {"gravity": [0.0, -9.81]}, "post": posts, "grid": [grid], "ball": [ghost]})
    assert differing(scene, 40) == []


@st.composite
def _documents(draw: st.DrawFn) -> dict[str, Any]:
    """Small scenes of all shapes, joints, materials and pairs, close enough to collide."""
    position, size, coefficient = pairs(-2, 2), numbers(0.1, 1), numbers(0, 1)
    materials = draw(st.lists(st.sampled_from(["a", "b", 'c"']), unique=True, max_size=3))
    surface: dict[str, Any] = {"restitution": coefficient, "friction": coefficient}
    if materials:
        surface["material"] = st.sampled_from(materials)
    moving = {"velocity": pairs(-3, 3), "angular_velocity": numbers(-3, 3), "mass": numbers(0.1, 10)}
    state = {"angle": numbers(-4, 4), "collides": st.sampled_from(["all", "fixed", "none"]), **surface}
    state["layer"] = st.sampled_from(["ground", "upper"])
    shapes: dict[str, dict[str, Any]] = {
        "ball": {"radius": size},
        "box": {"size": st.lists(size, min_size=2, max_size=2)},
        "capsule": {"length": size, "radius": size},
        "polygon": {"points": st.sampled_from(OUTLINES)},
    }
    document: dict[str, Any] = {"material": [{"name": name, "restitution": draw(coefficient)} for name in materials]}
    if materials:
        sides = st.lists(st.sampled_from(materials), min_size=2, max_size=2)
        document["pair"] = [
            {"between": two, "restitution": draw(coefficient), "friction": draw(coefficient)}
            for two in draw(st.lists(sides, max_size=2, unique_by=frozenset))
        ]
    for kind, keys in shapes.items():
        either = st.fixed_dictionaries({"position": position, **keys}, optional={**state, **moving})
        fixed = st.fixed_dictionaries({"position": position, **keys, "fixed": st.just(True)}, optional=state)
        document[kind] = draw(st.lists(either | fixed, max_size=2))
    parts = {
        kind: st.lists(st.fixed_dictionaries(keys, optional={"position": pairs(-1, 1)}), min_size=1, max_size=2)
        for kind, keys in shapes.items()
    }
    others = {kind: those for kind, those in parts.items() if kind != "box"}
    compound = st.fixed_dictionaries(
        {"position": position, "box": parts["box"]}, optional={**others, **state, **moving}
    )
    document["body"] = draw(st.lists(compound, max_size=1))
    names = []
    for kind in (*shapes, "body"):
        for k, each in enumerate(document[kind]):
            each["name"] = f"{kind} '{k}"
            names += [] if each.get("fixed") else [each["name"]]
    if names:
        document["joint"] = draw(st.lists(_joints(names), max_size=3))
    plane = {"point": [0.0, -2.5], "normal": draw(pairs(-1, 1).filter(lambda n: abs(n[0]) + abs(n[1]) > 0.1))}
    walls = st.fixed_dictionaries({"points": st.just([[-3.0, -2.0], [3.0, -2.2]])}, optional=surface)
    document |= {
        "plane": [plane | draw(st.fixed_dictionaries({}, optional=surface))],
        "wall": draw(st.lists(walls, max_size=1)),
    }
    document["world"] = {"gravity": draw(pairs(-10, 10))}
    document["solver"] = {"dt": 0.02, "substeps": draw(st.integers(1, 3)), "iterations": draw(st.integers(1, 20))}
    return {kind: value for kind, value in document.items() if value}


@st.composite
def _joints(draw: st.DrawFn, names: list[str]) -> dict[str, Any]:
    point, figure = pairs(-1, 1), numbers(0.1, 10)
    kinds: dict[str, dict[str, Any]] = {
        "rod": {"length": figure, "anchors": st.just([[5.0, 5.0], [0.1, -0.1]])},
        "pivot": {"at": point},
        "slide": {"most": figure},
        "groove": {"groove": st.just([[0, 0], [1, 2]]), "anchor": point},
        "rotary_limit": {"least": numbers(-3, 0), "most": numbers(0, 3)},
        "motor": {"rate": numbers(-10, 10), "max_torque": figure},
        "gear": {"ratio": figure},
        "spring": {"stiffness": figure, "damping": figure, "rest_length": figure, "pulls_only": st.booleans()},
        "rotary_spring": {"stiffness": figure, "rest_angle": numbers(-3, 3)},
        "ratchet": {"ratchet": figure, "phase": numbers(-3, 3)},
        "weld": {"at": point},
        "prismatic": {"axis": st.just([1, 2]), "travel": st.just([-1, 1]), "rate": numbers(-3, 3), "max_force": figure},
        "wheel": {"axis": st.just([1, 2]), "travel": st.just([-1, 1]), "stiffness": figure, "rate": numbers(-3, 3)},
    }
    compound = ("weld", "prismatic", "wheel")
    kind = draw(st.sampled_from(list(kinds)))
    between = st.lists(st.sampled_from(names), min_size=1, max_size=2, unique=True)
    optional: dict[str, Any] = {"collide": st.booleans()}
    if kind not in ("motor", *compound):
        optional["max_force"] = numbers(0, 100)
    if kind not in ("motor", "spring", "rotary_spring", *compound):
        optional |= {"max_bias": numbers(0, 3), "bias": numbers(0, 1)}
    joint = st.fixed_dictionaries({"between": between, **kinds[kind]}, optional=optional)
    return {"kind": kind, **draw(joint)}


@pytest.mark.parametrize("make", [balls, pyramid, mixed, moving_surfaces, sleeping, joints, limited_joints, kinematic])
def test_space_scene_program_space_round_trip(make: Callable[[], pymunk.Space]) -> None:
    """A captured space, its scene as a program, and the space that the program makes: the same bits, and scene."""
    space = make()
    captured = from_pymunk(space, dt=1 / 60, duration=1.0)
    program = executed(captured)
    copy, bodies = program["make_space"]()
    again = from_pymunk(copy, dt=1 / 60, duration=1.0, names={body: name for name, body in bodies.items()})
    assert again.solver == captured.solver
    assert sorted(again.bodies.names) == sorted(captured.bodies.names)
    for _ in range(SUBSTEPS):
        space.step(1 / 60)
        program["step"](copy)
    moving = [[body for body in each.bodies if body.body_type != pymunk.Body.STATIC] for each in (space, copy)]
    ends = [sorted(state_of(body).tobytes() for body in each) for each in moving]
    assert ends[0] == ends[1]


@given(_documents())
def test_random_scenes_have_the_states_of_the_engine(document: dict[str, Any]) -> None:
    scene = from_document(document)
    assert obstacles(scene) == []
    assert differing(scene, 60) == []


HOSTILE = (
    '"""',
    "'''",
    "a\"b'c\\",
    "{name}",
    "{0} {} {{",
    "%s %(x)s",
    "naïve ünïcödé 球",
    "\u202eevil\u2066",
    "#",
    "']; import os; os.abort() #",
    '"]; import os; os.abort() #',
    "-*- coding: utf-7 -*-",
    "\\N{DIGIT ONE}",
    "\\",
    "INFINITY",
    "MATERIAL_1",
    " ",
)


SENSING = """
[world]
gravity = [0.0, -9.81]
[[plane]]
name = "ground"
point = [0.0, 0.0]
normal = [0.0, 1.0]
categories = ["ground"]
[[polygon]]
name = "cart"
position = [0.0, 1.0]
velocity = [2.0, 0.0]
points = [[-0.6, -0.3], [0.6, -0.3], [0.5, 0.2], [-0.6, 0.3]]
restitution = 0.7
categories = ["cart"]
[[ball]]
name = "ball"
position = [1.5, 2.0]
radius = 0.3
restitution = 0.8
categories = ["ball"]
[[sensor]]
name = "wheels"
body = "cart"
points = [[-0.6, -0.3], [0.6, -0.3]]
thickness = 0.15
detects = ["ground"]
[[sensor]]
name = "ahead"
body = "cart"
points = [[0.6, 0.0], [2.0, -0.6], [1.5, 0.0], [2.0, 0.8]]
[[sensor]]
name = "gate"
position = [1.8, 0.6]
radius = 0.5
detects = ["ball"]
"""


def test_program_has_the_states_and_the_sensors_of_the_scene() -> None:
    scene = loads(SENSING)
    assert differing(scene) == []
    program = executed(scene)
    space, bodies = program["make_space"]()
    sensors, simulation = program["make_sensors"](space, bodies), start(scene, "pymunk")
    names, seen = {body: name for name, body in bodies.items()}, dict.fromkeys(sensors, 0)
    evaluated = SceneSensors(scene, scene.bodies)
    for _ in range(300):
        simulation.step()
        program["step"](space)
        for number, (name, shapes) in enumerate(sensors.items()):
            found = {names.get(body, "ground") for body in program["sensed"](space, shapes)}
            indices = evaluated.detected(number, simulation.frame()).tolist()
            assert found == {scene.bodies.names[k] if k >= 0 else scene.fixed_names[-1 - k] for k in indices}
            seen[name] += bool(found)
    assert all(10 < count < 290 for count in seen.values()), seen


def test_body_that_a_program_leaves_out_of_the_space_is_no_target_of_a_sensor() -> None:
    scene = loads("[[ball]]\nposition = [0, 0]\nradius = 1\n[[sensor]]\nposition = [0, 0]\nradius = 1")
    assert [(each.path, "'ball-1'" in each.message) for each in obstacles(scene)] == [("sensor", True)]


def test_hostile_names_are_only_data() -> None:
    line = '\n"""\r\x0cimport os\n\u2028import os\n' + "\\".join(HOSTILE)[:150]
    balls = [
        {"name": name, "position": [2.0 * k, 1.0], "radius": 0.5 + 0.01 * (k % 3), "collides": ("all", "none")[k % 2]}
        for k, name in enumerate(HOSTILE)
    ]
    walls = [{"name": f"wall {name}", "points": [[0.0, 0.0], [1.0, -1.0 - k]]} for k, name in enumerate(HOSTILE)]
    joints = [
        {"kind": "pivot", "name": f"joint {name}", "between": [name], "at": [0.0, 0.1 * k]}
        for k, name in enumerate(HOSTILE)
    ]
    scene = from_document(
        {"title": line, "about": line, "ball": balls, "wall": walls, "joint": joints, "world": {"gravity": [0.0, -1.0]}}
    )
    text = program_text(scene, step_reason=line, warnings=[line])
    assert text.isprintable() or set(filter(lambda letter: not letter.isprintable(), text)) == {"\n"}
    assert imports_of(text) == {"pymunk", "pygame", "pymunk.pygame_util"}
    assert "abort" not in {node.attr for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Attribute)}
    assert differing(scene, 50) == []


def imports_of(text: str) -> set[str]:
    """Return the modules that a program imports."""
    found = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            found |= {each.name for each in node.names}
        assert not isinstance(node, ast.ImportFrom)
    return found


def test_pygame_is_imported_by_main_only() -> None:
    text = program_text(from_document(BASE | CONTENTS["layers"]))
    top = {each.name for node in ast.parse(text).body if isinstance(node, ast.Import) for each in node.names}
    assert top == {"pymunk"}
    assert imports_of(text) == {"pymunk", "pygame", "pymunk.pygame_util"}


def test_generator_becomes_data_and_a_loop() -> None:
    grid = {"origin": [0.0, 1.0], "columns": 40, "rows": 25, "spacing": [1.0, 1.0], "radius": 0.3}
    text = program_text(from_document({"world": {"gravity": [0.0, -9.81]}, "grid": [grid]}))
    statements = sum(isinstance(node, ast.stmt) for node in ast.walk(ast.parse(text)))
    assert statements < 150


@pytest.mark.parametrize("name", [*CONTENTS, "ragdoll_stairs", "chain_of_20"])
def test_programs_are_clean(name: str, tmp_path: Path) -> None:
    scene = from_document(BASE | CONTENTS[name]) if name in CONTENTS else load(find(name))
    path = tmp_path / "game.py"
    path.write_text(program_text(scene), encoding="utf-8")
    checked = subprocess.run(
        [sys.executable, "-m", "ruff", "check", "--isolated", str(path)], capture_output=True, text=True, check=False
    )
    assert checked.returncode == 0, checked.stdout


@pytest.mark.parametrize("name", ["fixed bodies that nothing can touch", "layers"])
def test_window_draws_three_frames(name: str, tmp_path: Path) -> None:
    hidden = {"capsule": [{"position": [0.0, 2.0], "length": 1.0, "radius": 0.1, "collides": "none"}]}
    path = tmp_path / "game.py"
    path.write_text(program_text(from_document(BASE | CONTENTS[name] | hidden)), encoding="utf-8")
    environment = {**os.environ, "SDL_VIDEODRIVER": "dummy", "SDL_AUDIODRIVER": "dummy"}
    command = [sys.executable, "-c", "import game; game.main(frames=3); print('done')"]
    child = subprocess.run(
        command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120, check=False
    )
    assert child.returncode == 0, child.stderr
    assert child.stdout.splitlines()[-1] == "done"


def test_all_reasons_are_given_at_once() -> None:
    document = {
        "world": {"gravity": [0.0, -9.81], "linear_drag": 0.1},
        "solver": {"dt": 0.01, "substeps": 2, "half_kick": True},
        "wall": [
            {"name": "corner", "points": [[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]]},
            {"name": "gate", "points": [[5.0, 0.0], [5.0, 1.0]], "one_way": True},
        ],
        "box": [{"name": "crate", "position": [0.0, 3.0], "size": [1.0, 1.0]}],
        "attraction": [{"toward": [0.0, 0.0], "strength": 1.0}],
        "thrust": [{"name": "late", "body": "crate", "force": [1.0, 0.0], "begin": 1.0}],
        "zone": [{"position": [0.0, 0.0], "radius": 1.0, "holds": True}],
    }
    found = obstacles(from_document(document))
    paths = {"", "world.linear_drag", "solver.half_kick", "attraction", "thrust", "zone", "wall"}
    assert {each.path for each in found} == paths
    messages = " ".join(each.message for each in found)
    assert all(name in messages for name in ("'corner'", "'gate'", "'late'"))


@pytest.mark.parametrize("substeps", [1, 3])
def test_bodies_on_paths_and_their_passengers_have_the_states_of_the_engine(substeps: int) -> None:
    boxes = [platform(path, name=name, position=[0.0, 10.0 * k]) for k, (name, path) in enumerate(PATHS.items())]
    carried = [passenger(name=f"passenger-{k}", position=[0.3, 10.0 * k + 0.15]) for k in range(len(boxes))]
    scene = scene_with_paths(*boxes, *carried, dt=1 / 60, solver={"substeps": substeps})
    assert not differing(scene, 900)


@pytest.mark.parametrize("key", ["linear_damping", "rolling_resistance"])
def test_keys_of_bodies_that_need_the_engine_are_refused_by_name(key: str) -> None:
    ball = {"position": [0.0, 0.5], "radius": 0.5, key: 0.1}
    (found,) = obstacles(from_document(BASE | {"ball": [ball]}))
    assert key in found.message


def test_events_are_refused() -> None:
    ball = {"name": "a", "position": [0.0, 0.5], "radius": 0.5}
    event = {"kind": "impulse", "time": 5.0, "body": "a", "impulse": [1.0, 0.0]}
    (found,) = obstacles(from_document(BASE | {"ball": [ball], "event": [event]}))
    assert found.path == "event"
