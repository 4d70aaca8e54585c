"""Demands: the physical features that a scene needs, and why."""

from typing import Any

import pytest
from hypothesis import given

from sandbox.scene.compile.demands import Demand, Item, bill, demands, unmodelled
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import from_document
from tests import strategies

BALL: dict[str, Any] = {"position": [0.0, 0.0], "radius": 1.0}
ROCK: dict[str, Any] = {**BALL, "fixed": True}
GHOST: dict[str, Any] = {**BALL, "collides": "none"}
PLANE: dict[str, Any] = {"point": [0, 0], "normal": [0, 1]}
BOUNCY: dict[str, Any] = {**BALL, "restitution": 0.75}
FALLOFF: dict[str, Any] = {"restitution_falloff": 0.5}
ROUGH: dict[str, Any] = {**PLANE, "friction": 1}
BELT: dict[str, Any] = {**PLANE, "surface_speed": 1}
WALL: dict[str, Any] = {"points": [[0, 0], [1, 0]]}
POST: dict[str, Any] = {"position": [0, 0], "radius": 1}
SPARKS: dict[str, Any] = {"position": [0, 0], "count": 3, "velocity_min": [0, 0], "velocity_max": [1, 1], "lifetime": 2}
BOX: dict[str, Any] = {"position": [0, 0], "size": [1, 1]}
NAMED: dict[str, Any] = {**BALL, "name": "a"}
NAMED_BOX = {"name": "a", "position": [0, 0], "size": [1, 1]}
PLUNGER = {"kind": "plunger", "body": "a", "direction": [0, 1], "travel": 1, "speed": 1}
STROKE = {"kind": "stroke", "body": "a", "pivot": [0, 0], "stops": [0, 1], "rate": 1}
OTHER: dict[str, Any] = {**BALL, "name": "b", "position": [3, 0]}
PULLEY = {"kind": "pulley", "between": ["a", "b"], "wheels": [[0, 2], [3, 2]]}
MOTOR = {"kind": "motor", "between": ["a"], "rate": 1}
OFF: dict[str, Any] = {"kind": "rod", "between": ["a"], "anchors": [[0, 1], [5, 5]]}
JOINTED: dict[Demand, dict[str, Any]] = {
    Demand.RODS: {"kind": "rod", "anchors": [[0, 0], [5, 5]]},
    Demand.PIVOTS: {"kind": "pivot", "at": [0, 0]},
    Demand.SLIDES: {"kind": "slide", "most": 3},
    Demand.GROOVES: {"kind": "groove", "groove": [[0, 0], [1, 0]]},
    Demand.ROTARY_LIMITS: {"kind": "rotary_limit", "least": 0, "most": 1},
    Demand.MOTORS: {"kind": "motor", "rate": 1},
    Demand.GEARS: {"kind": "gear", "ratio": 2},
    Demand.SPRINGS: {"kind": "spring", "stiffness": 1},
    Demand.ROTARY_SPRINGS: {"kind": "rotary_spring", "stiffness": 1},
    Demand.RATCHETS: {"kind": "ratchet", "ratchet": 1},
    Demand.BANDS: {"kind": "spring", "stiffness": 1, "pulls_only": True},
    Demand.WELDS: {"kind": "weld"},
    Demand.PRISMATICS: {"kind": "prismatic", "axis": [1, 0], "travel": [-1, 1]},
    Demand.WHEELS: {"kind": "wheel", "axis": [1, 0], "travel": [-1, 1], "stiffness": 1},
    Demand.MAX_FORCE: {"kind": "pivot", "at": [0, 0], "max_force": 1},
    Demand.MAX_BIAS: {"kind": "pivot", "at": [0, 0], "max_bias": 0},
    Demand.JOINT_BIAS: {"kind": "pivot", "at": [0, 0], "bias": 0},
}

PATH = {"points": [[0, 0], [1, 0]], "speed": 1}
POOL = {"points": [[0, 0], [9, 0], [0, 9]], "liquid": {"density": 1}}
CASES: list[tuple[Demand, bool, dict[str, Any], str]] = [
    (Demand.TRANSLATION, True, {"ball": [BALL, BALL, ROCK]}, "2 bodies move"),
    (Demand.TRANSLATION, True, {"ball": [BALL]}, "1 body moves"),
    (Demand.TRANSLATION, False, {"ball": [ROCK]}, "nothing moves"),
    (Demand.ROTATION, True, {"ball": [{**GHOST, "angular_velocity": 1}]}, "1 body starts with a spin"),
    (Demand.ROTATION, True, {"ball": [{**BALL, "friction": 0.5}, BALL]}, "2 bodies can be turned"),
    (Demand.ROTATION, True, {"ball": [BALL], "plane": [{**PLANE, "friction": 0.5}]}, "1 body can be turned"),
    (Demand.ROTATION, False, {"ball": [BALL, BALL]}, "no body can be turned"),
    (Demand.ROTATION, False, {"ball": [{**GHOST, "friction": 0.5}] * 2}, "no body can be turned"),
    (Demand.ROTATION, False, {"ball": [{**BALL, "friction": 0}, {**BALL, "friction": 9}]}, "no body can be turned"),
    (Demand.GRAVITY, True, {"world": {"gravity": [0, -1.62]}, "ball": [BALL]}, "-1.62"),
    (Demand.GRAVITY, False, {"world": {"gravity": [0, 0]}, "ball": [BALL]}, "zero"),
    (Demand.DRAG, True, {"world": {"linear_drag": 0.5}, "ball": [BALL]}, "linear 0.5"),
    (Demand.DRAG, True, {"world": {"quadratic_drag": 0.25}, "ball": [BALL]}, "quadratic 0.25"),
    (Demand.DRAG, False, {"world": {"wind": [5, 0]}, "ball": [BALL]}, "no drag"),
    (Demand.DAMPING, True, {"world": {"damping": 0.9}, "ball": [BALL]}, "0.9"),
    (Demand.DAMPING, False, {"world": {"damping": 1.0}, "ball": [BALL]}, "no damping"),
    (Demand.LIFT, True, {"ball": [{**BALL, "lift": 0.1}]}, "1 body has lift"),
    (Demand.LIFT, False, {"ball": [BALL]}, "no body has lift"),
    (Demand.GRAVITY_SCALE, True, {"ball": [{**BALL, "gravity_scale": 0.5}]}, "1 body scales gravity"),
    (Demand.GRAVITY_SCALE, False, {"ball": [BALL]}, "no body scales gravity"),
    (Demand.BODY_DAMPING, True, {"ball": [{**BALL, "linear_damping": 1.0}]}, "1 body has damping of its own"),
    (Demand.BODY_DAMPING, True, {"ball": [{**BALL, "angular_damping": 1.0}] * 2}, "2 bodies have damping of their own"),
    (Demand.BODY_DAMPING, False, {"ball": [BALL]}, "no body has damping of its own"),
    (Demand.SPEED_LIMITS, True, {"ball": [{**BALL, "max_speed": 1.0}]}, "1 body has a speed limit"),
    (Demand.SPEED_LIMITS, True, {"ball": [{**BALL, "max_angular_velocity": 1.0}]}, "1 body has a speed limit"),
    (Demand.SPEED_LIMITS, False, {"ball": [BALL]}, "no body has a speed limit"),
    (Demand.ROLLING, True, {"ball": [{**BALL, "rolling_resistance": 0.1}], "plane": [PLANE]}, "up to 0.1"),
    (Demand.ROLLING, True, {"ball": [BALL], "plane": [{**PLANE, "rolling_resistance": 0.2}]}, "up to 0.2"),
    (Demand.ROLLING, False, {"ball": [{**BALL, "rolling_resistance": 0.1}]}, "no collisions possible"),
    (Demand.ROLLING, False, {"ball": [BALL], "plane": [PLANE]}, "0 for every contact of a ball"),
    (Demand.BALL_BALL, True, {"ball": [BALL, BALL]}, "can collide"),
    (Demand.BALL_BALL, True, {"ball": [{**BALL, "collides": "fixed"}, ROCK]}, "can collide"),
    (Demand.BALL_BALL, False, {"ball": [BALL, GHOST]}, "2 of 2 cannot collide"),
    (Demand.BALL_BALL, False, {"ball": [BALL], "plane": [PLANE]}, "no two balls can collide"),
    (Demand.BALL_PLANE, True, {"ball": [BALL], "plane": [PLANE]}, "1 plane"),
    (Demand.BALL_PLANE, False, {"ball": [GHOST], "plane": [PLANE]}, "no moving body can touch one"),
    (Demand.BALL_PLANE, False, {"ball": [ROCK], "plane": [PLANE]}, "no moving body can touch one"),
    (Demand.BALL_PLANE, False, {"ball": [BALL], "wall": [WALL]}, "no plane"),
    (Demand.BALL_SEGMENT, True, {"ball": [BALL], "wall": [WALL, WALL]}, "2 wall"),
    (Demand.BALL_SEGMENT, False, {"ball": [GHOST], "wall": [WALL]}, "no moving body can touch one"),
    (Demand.BALL_SEGMENT, False, {"ball": [BALL], "post": [POST]}, "no wall"),
    (Demand.BALL_POST, True, {"ball": [{**BALL, "collides": "fixed"}], "post": [POST]}, "1 post"),
    (Demand.BALL_POST, False, {"ball": [GHOST], "post": [POST]}, "no moving body can touch one"),
    (Demand.RESTITUTION, True, {"ball": [BOUNCY, BALL]}, "up to 0.75"),
    (Demand.RESTITUTION, False, {"ball": [BOUNCY, {**BALL, "restitution": 0}]}, "0 for every pair"),
    (Demand.RESTITUTION, False, {"ball": [BOUNCY, GHOST]}, "no collisions possible"),
    (Demand.FRICTION, True, {"ball": [{**BALL, "friction": 0.75}, {**BALL, "friction": 2}]}, "up to 1.5"),
    (Demand.FRICTION, False, {"ball": [BALL, BALL]}, "0 for every pair"),
    (Demand.FRICTION, False, {"ball": [{**GHOST, "friction": 1}], "plane": [ROUGH]}, "no collisions possible"),
    (Demand.FALLOFF, True, {"ball": [{**BOUNCY, **FALLOFF}], "post": [POST]}, "0.5 s/m"),
    (Demand.FALLOFF, False, {"ball": [{**BALL, **FALLOFF}], "post": [POST]}, "does not depend on speed"),
    (Demand.FALLOFF, False, {"ball": [{**GHOST, "restitution": 1, **FALLOFF}]}, "does not depend on"),
    (Demand.KICKS, True, {"ball": [BALL], "post": [{**POST, "kick": {"speed": 1}}]}, "1 wall or post kicks"),
    (Demand.KICKS, False, {"ball": [GHOST], "post": [{**POST, "kick": {"speed": 1}}]}, "no wall or post kicks"),
    (Demand.SURFACE_SPEED, True, {"ball": [{**BALL, "friction": 1}], "plane": [BELT]}, "1 surface"),
    (Demand.SURFACE_SPEED, False, {"ball": [BALL], "plane": [BELT]}, "no surface with friction"),
    (
        Demand.SURFACE_VELOCITY,
        True,
        {"ball": [{**BALL, "friction": 1}], "plane": [{**PLANE, "surface_velocity": [1, 0]}]},
        "1 surface moves along a vector",
    ),
    (Demand.SURFACE_VELOCITY, False, {"ball": [{**BALL, "friction": 1}], "plane": [BELT]}, "no surface with friction"),
    (Demand.ONE_WAY, True, {"ball": [BALL], "wall": [{**WALL, "one_way": True}] * 2}, "2 one-way walls"),
    (Demand.ONE_WAY, False, {"ball": [BALL], "wall": [WALL]}, "none"),
    (Demand.PASSABLE, True, {"ball": [BALL], "post": [{**POST, "solid": False}]}, "1 wall or post"),
    (Demand.PASSABLE, False, {"ball": [BALL], "post": [POST]}, "are solid"),
    (Demand.BOUNDS, True, {"world": {"bounds": [[-1, -1], [1, 1]]}, "ball": [BALL]}, "given"),
    (Demand.POLYGONS, True, {"box": [BOX], "plane": [PLANE]}, "1 body is not a ball, 1 of them can move and collide"),
    (Demand.POLYGONS, True, {"box": [{**BOX, "fixed": True}], "ball": [BALL]}, "0 of them can move and collide"),
    (Demand.POLYGONS, False, {"box": [BOX]}, "1 body is not a ball"),
    (Demand.POLYGONS, False, {"box": [{**BOX, "collides": "none"}], "plane": [PLANE]}, "1 body is not a ball"),
    (Demand.POLYGONS, False, {"ball": [BALL, BALL]}, "all bodies are balls"),
    (Demand.ROTATION, True, {"box": [BOX], "plane": [PLANE]}, "1 body can be turned"),
    (Demand.ROTATION, False, {"box": [BOX]}, "no body can be turned"),
    (Demand.ROTATION, True, {"ball": [NAMED], "joint": [OFF]}, "1 body can be turned"),
    (Demand.ROTATION, False, {"ball": [NAMED], "joint": [{**OFF, "anchors": [[0, 0], [5, 5]]}]}, "no body can be"),
    (Demand.ROTATION, False, {"ball": [NAMED], "thrust": [{"body": "a", "force": [1, 0]}]}, "no body can be turned"),
    (Demand.ROTATION, True, {"ball": [NAMED], "thrust": [{"body": "a", "force": [1, 0], "point": [0, 1]}]}, "1 body"),
    *(
        (demand, True, {"ball": [NAMED], "joint": [{"between": ["a"], **joint}] * 2}, "2")
        for demand, joint in JOINTED.items()
    ),
    (Demand.PULLEYS, True, {"ball": [NAMED, OTHER], "joint": [PULLEY] * 2}, "2"),
    # the largest torque of a motor belongs to motors
    (Demand.MAX_FORCE, False, {"ball": [NAMED], "joint": [{**MOTOR, "max_torque": 1}]}, "none"),
    (Demand.ATTRACTION, True, {"ball": [BALL], "attraction": [{"toward": [0, 0], "strength": 1}]}, "1"),
    (Demand.TYRES, True, {"ball": [NAMED], "tyre": [{"body": "a", "grip": 1}]}, "1"),
    (Demand.TYRES, False, {"ball": [NAMED]}, "none"),
    (Demand.ROTATION, True, {"ball": [NAMED], "tyre": [{"body": "a", "grip": 1}]}, "1 body"),
    (Demand.THRUST, True, {"ball": [NAMED], "thrust": [{"body": "a", "force": [1, 0]}]}, "1"),
    (Demand.DRIVES, True, {"box": [NAMED_BOX], "drive": [PLUNGER]}, "1"),
    (Demand.ROTATION, False, {"box": [{**NAMED_BOX, "collides": "none"}], "drive": [PLUNGER]}, "no body can be turned"),
    (Demand.ROTATION, True, {"box": [{**NAMED_BOX, "collides": "none"}], "drive": [STROKE]}, "1 body can be turned"),
    (Demand.LIFETIMES, True, {"emitter": [SPARKS]}, "3 bodies have a lifetime"),
    (Demand.SURFACE, True, {"surface": {"sliding_friction": 0.2}, "ball": [BALL]}, "sliding 0.2"),
    (Demand.SURFACE, False, {"surface": {}, "ball": [BALL]}, "no friction"),
    (Demand.SPIN, True, {"surface": {"sliding_friction": 0.2}, "ball": [BALL]}, "three axes"),
    (Demand.SPIN, True, {"surface": {}, "contact_models": {"ball_ball": "frictional"}, "ball": [BALL]}, "three axes"),
    (Demand.SPIN, True, {"surface": {}, "ball": [{**BALL, "spin": [1, 0, 0]}]}, "three axes"),
    (Demand.SPIN, False, {"surface": {"rolling_friction": 0.1}, "ball": [{**BALL, "spin": [0, 0, 1]}]}, "about z only"),
    (Demand.POCKETS, True, {"ball": [BALL], "pocket": [{"position": [9, 9], "radius": 1}]}, "1"),
    (Demand.PUCKS, True, {"surface": {"bodies": "pucks", "sliding_friction": 0.2}, "ball": [BALL]}, "do not roll"),
    (Demand.PUCKS, False, {"surface": {"bodies": "pucks"}, "ball": [BALL]}, "without friction"),
    (Demand.CURL, True, {"surface": {"bodies": "pucks", "sliding_friction": 0.2, "curl": 0.1}}, "κ = 0.1"),
    (Demand.CURL, False, {"surface": {"bodies": "pucks", "curl": 0.1}, "ball": [BALL]}, "no puck curls"),
    (Demand.LAYERS, True, {"ball": [{**BALL, "layer": "ramp"}]}, "ground, ramp"),
    (Demand.CATEGORIES, True, {"ball": [{**BALL, "categories": ["player"], "mask": ["enemy"]}]}, "player, enemy"),
    (Demand.KINEMATIC, True, {"ball": [{**BALL, "kinematic": True}]}, "1 body is kinematic"),
    (Demand.PATHS, True, {"ball": [{**BALL, "kinematic": True, "path": PATH}]}, "1 body moves along a path"),
    (Demand.ONE_WAY_BODIES, True, {"ball": [{**BALL, "fixed": True, "one_way": [0, 1]}]}, "1 one-way body"),
    (Demand.GROUPS, True, {"ball": [{**BALL, "group": "limbs"}]}, "limbs"),
    (Demand.LAYERS, False, {"ball": [BALL], "plane": [PLANE]}, "all bodies are in one layer"),
    (Demand.EVENTS, True, {"ball": [NAMED], "event": [{"kind": "remove", "time": 1, "body": "a"}]}, "1"),
    (Demand.ZONES, True, {"ball": [BALL], "zone": [{"position": [9, 9], "radius": 1}]}, "1"),
    (Demand.BUOYANCY, True, {"ball": [BALL], "zone": [POOL]}, "1 zone has a liquid"),
    (Demand.BUOYANCY, False, {"ball": [BALL], "zone": [{"position": [9, 9], "radius": 1}]}, "no zone has a liquid"),
    (Demand.SENSORS, True, {"ball": [BALL], "sensor": [{"position": [9, 9], "radius": 1}]}, "1"),
]


@pytest.mark.parametrize(("demand", "on", "document", "why"), CASES)
def test_demand_is_on_or_off_with_a_reason(demand: Demand, on: bool, document: dict[str, Any], why: str) -> None:
    scene = from_document(document)
    item = next(item for item in bill(scene) if item.demand is demand)
    assert item.on is on
    assert why in item.why
    assert (demand in demands(scene)) is on


def test_every_demand_is_on_in_a_case_and_off_for_a_ball_alone() -> None:
    assert {demand for demand, on, _, _ in CASES if on} == set(Demand)
    for document in ({"ball": [BALL]}, {"ball": [NAMED]}):
        assert demands(from_document(document)) == {Demand.TRANSLATION}
    assert demands(from_document({"title": "t"})) == frozenset()


@pytest.mark.fail_slow(60)  # takes over half a second
@given(strategies.scenes())
def test_bill_lists_every_demand_once_with_a_reason(scene: Scene) -> None:
    items = bill(scene)
    assert sorted(item.demand for item in items) == sorted(Demand)
    assert all(isinstance(item, Item) and item.why for item in items)
    assert demands(scene) == {item.demand for item in items if item.on}


def test_unmodelled_demands_are_listed_in_one_reason() -> None:
    scene = from_document({"world": {"gravity": [0, -9.81], "linear_drag": 0.1}, "ball": [BALL]})
    needed = demands(scene)
    assert unmodelled(scene, needed) == []
    assert unmodelled(scene, needed - {Demand.DRAG}) == ["it does not model drag"]
    modelled = needed - {Demand.DRAG, Demand.GRAVITY, Demand.TRANSLATION}
    assert unmodelled(scene, modelled) == ["it does not model drag, gravity or translation"]
