"""Minimal documents of every kind of table of a scene, for bodies named `a` and `b`."""

import copy
from typing import Any

from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import from_document

Document = dict[str, Any]


def _ball(name: str, x: float, **more: Any) -> Document:
    return {"name": name, "position": [x, 3.0], "radius": 0.5, **more}


def _box(name: str, x: float, **more: Any) -> Document:
    return {"name": name, "position": [x, 3.0], "size": [1.0, 1.0], **more}


BODIES: dict[str, Document] = {
    "none": {},
    "one": {"ball": [_ball("a", 0.0)]},
    "one fixed": {"ball": [_ball("a", 0.0, fixed=True)]},
    "all fixed": {"ball": [_ball("a", 0.0, fixed=True)], "box": [_box("b", 2.0, fixed=True)]},
    "one of two fixed": {"ball": [_ball("a", 0.0)], "box": [_box("b", 2.0, fixed=True)]},
    "two": {"ball": [_ball("a", 0.0), _ball("b", 2.0)]},
    "alone": {"ball": [_ball("a", 0.0, collides="none"), _ball("b", 2.0, collides="none")]},
}
"""Bodies that a feature refers to; some may be missing."""

_HINGE: Document = {"name": "d", "body": "a", "pivot": [0.2, 3.0], "stops": [0.0, 1.0]}
_PLUNGER: Document = {"name": "d", "kind": "plunger", "body": "a", "direction": [0, 1], "travel": 1.0, "speed": 1.0}
_ROPE: Document = {"name": "g", "start": [0.0, 6.0], "end": [2.0, 6.0]}
_EMITTER: Document = {"name": "g", "position": [0, 5], "count": 3, "velocity_min": [-1, -1], "velocity_max": [1, 1]}
_WALL: Document = {"name": "w", "points": [[-5.0, 2.4], [5.0, 2.4]]}
_FLOOR: Document = {"sliding_friction": 0.2, "rolling_friction": 0.01}
_NO_GRAVITY: Document = {"world": {"gravity": [0.0, 0.0]}}

JOINTS: dict[str, Document] = {
    "rod": {"length": 2.0},
    "pivot": {"anchors": [[1.0, 0.0], [-1.0, 0.0]]},
    "slide": {"least": 0.5, "most": 4.0},
    "groove": {"groove": [[0, 0], [1, 0]]},
    "rotary_limit": {"least": -1, "most": 1},
    "motor": {"rate": 1.0},
    "gear": {"ratio": 2.0},
    "spring": {"stiffness": 10.0, "damping": 1.0},
    "rotary_spring": {"stiffness": 10.0},
    "pulley": {"wheels": [[0.0, 6.0], [2.0, 6.0]]},
    "ratchet": {"ratchet": 0.5},
    "weld": {},
    "prismatic": {"axis": [1.0, 0.0], "travel": [-1.0, 1.0], "rate": 0.5, "max_force": 50.0},
    "wheel": {"axis": [0.0, 1.0], "travel": [-1.0, 1.0], "stiffness": 100.0, "damping": 1.0, "rate": 1.0},
}


def _joint(kind: str, *between: str) -> Document:
    anchored = {"anchors": [[0.0, 0.0], [0.0, 1.0]]} if kind in ("rod", "slide", "spring") else {}
    return {"name": "j", "kind": kind, "between": [*between], **anchored, **JOINTS[kind]}


FEATURES: dict[str, Document] = {
    "nothing": {},
    "attraction to a place": {"attraction": [{"toward": [0.0, 5.0], "strength": 1.0}]},
    "attraction to a body": {"attraction": [{"toward": "a", "strength": 1.0}]},
    "attractions": {"attraction": [{"toward": "a", "strength": 1.0}, {"toward": [1, 1], "strength": 1.0}]},
    "thrust": {"thrust": [{"name": "t", "body": "a", "force": [1.0, 0.0]}]},
    "thrusts": {
        "thrust": [
            {"name": "t", "body": "a", "force": [1.0, 0.0], "key": "up"},
            {"name": "u", "body": "b", "force": [1.0, 0.0], "point": [0.1, 0.1]},
        ]
    },
    "tyres": {
        "tyre": [
            {"name": "y", "body": "a", "grip": 3.0, "point": [0.2, 0.0], "drive": 2.0, "steer": 0.3},
            {
                "name": "z",
                "body": "a",
                "grip": 2.0,
                "point": [-0.2, 0.1],
                "slip": 0.1,
                "rolling_drag": 0.5,
                "brake": 2.0,
            },
        ]
    },
    "plane": {"plane": [{"point": [0, 0], "normal": [0, 1]}]},
    "wall": {"wall": [{**_WALL, "points": [[-5, 1], [0, 0.5], [5, 1]], "restitution": 0.5}]},
    "kicking wall": {"wall": [{**_WALL, "kick": {"speed": 2.0}}]},
    "moving wall": {"wall": [{**_WALL, "surface_speed": 1.0, "friction": 0.5}]},
    "drifting wall": {"wall": [{**_WALL, "surface_velocity": [1.0, -2.0], "friction": 0.5}]},
    "one-way wall": {"wall": [{**_WALL, "one_way": True}]},
    "open wall": {"wall": [{**_WALL, "solid": False}]},
    "categories": {"wall": [{**_WALL, "categories": ["curtain"]}], "ball": [_ball("c", -2.0, mask=["stage"])]},
    "groups": {"ball": [_ball("c", -2.0, group="crowd"), _ball("d", -2.5, group="crowd")], "wall": [_WALL]},
    "kinematic body": {"box": [{**_box("c", 0.0), "position": [0.0, 1.5], "kinematic": True, "velocity": [0.5, 0.5]}]},
    "path": {
        "box": [
            {
                **_box("c", 0.0),
                "position": [0.0, 1.5],
                "kinematic": True,
                "path": {
                    "points": [[0, 0], [0.5, 0.5]],
                    "angles": [0, 0.3],
                    "period": 0.7,
                    "easing": "smooth",
                    "start": -0.1,
                },
            }
        ]
    },
    "one-way body": {"box": [{**_box("c", 0.0), "position": [0.0, 1.7], "fixed": True, "one_way": [0.0, -1.0]}]},
    "post": {"post": [{"position": [0.0, 1.0], "radius": 0.2}]},
    "zone": {"zone": [{"position": [0.0, 2.5], "radius": 2.0}]},
    "sensors": {
        "sensor": [
            {"name": "s", "position": [0.0, 2.5], "radius": 1.0},
            {"body": "a", "points": [[-0.4, -0.5], [0.4, -0.5]], "thickness": 0.1},
        ]
    },
    "holding zone": {"zone": [{"position": [0.0, 2.9], "radius": 1.0, "holds": True, "gravity": [1.0, 1.0]}]},
    "liquid": {
        "zone": [
            {
                "points": [[-4.0, 0.0], [4.0, 0.0], [4.0, 3.0], [-4.0, 3.0]],
                "liquid": {"density": 2.0, "linear_drag": 1.0, "quadratic_drag": 0.5, "current": [0.5, 0.0]},
            }
        ]
    },
    "layers": {
        "zone": [{"position": [0, 2.9], "radius": 1.0, "to_layer": "ramp"}],
        "wall": [{**_WALL, "layers": ["ramp"]}],
    },
    "bounds": {"world": {"bounds": [[-9.0, 2.9], [9.0, 9.0]]}},
    "lift": {"ball": [_ball("c", -2.0, lift=0.1, angular_velocity=3.0, velocity=[1.0, 0.0])]},
    "gravity scale": {"ball": [_ball("c", -2.0, gravity_scale=-0.5)]},
    "damped body": {"ball": [_ball("c", -2.0, linear_damping=0.5, angular_damping=2.0, angular_velocity=3.0)]},
    "limited body": {"ball": [_ball("c", -2.0, max_speed=0.5, max_angular_velocity=1.0, angular_velocity=3.0)]},
    "rolling resistance": {"wall": [{**_WALL, "friction": 0.5, "rolling_resistance": 0.1}]},
    "air": {"world": {"linear_drag": 0.5, "quadratic_drag": 0.5, "wind": [1.0, 0.0]}},
    "damping": {"world": {"damping": 0.5}},
    "materials": {
        "material": [{"name": "m", "restitution": 0.5}, {"name": "n"}],
        "pair": [{"between": ["m", "n"], "friction": 0.5}],
        "plane": [{"point": [0, 0], "normal": [0, 1], "material": "m"}],
    },
    "floor": {**_NO_GRAVITY, "surface": _FLOOR, "wall": [{**_WALL, "height": 0.6}]},
    "shot": {**_NO_GRAVITY, "surface": _FLOOR, "shot": [{"ball": "a", "speed": 1.0, "aim": 0.1}]},
    "pockets": {**_NO_GRAVITY, "surface": _FLOOR, "pocket": [{"position": [0.1, 3.0], "radius": 0.9}]},
    "pucks": {**_NO_GRAVITY, "surface": {"sliding_friction": 0.2, "bodies": "pucks", "curl": 0.5}},
    "grid": {"grid": [{"name": "g", "origin": [-3, 5], "columns": 2, "spacing": [1, 1], "radius": 0.2}]},
    "scatter": {"scatter": [{"name": "g", "lower": [-3, 5], "upper": [0, 8], "count": 2, "radius": 0.2}]},
    "emitter": {"emitter": [{**_EMITTER, "lifetime": 0.35, "lifetime_jitter": 0.1}]},
    "attracted emitter": {"emitter": [_EMITTER], "attraction": [{"toward": "a", "strength": 1.0}]},
    "stack": {"stack": [{"name": "g", "base": [-4.0, 0.0], "columns": 1, "rows": 2, "size": [1.0, 1.0]}]},
    "rope": {"rope": [{**_ROPE, "links": 1}]},
    "tied rope": {"rope": [{**_ROPE, "links": 1, "tie": {"start": "a", "end": "b"}}]},
    "tied springs": {
        "rope": [{**_ROPE, "links": 1, "kind": "springs", "stiffness": 9.0, "tie": {"start": "a", "end": "b"}}]
    },
    "tied planks": {"rope": [{**_ROPE, "links": 1, "kind": "planks", "tie": {"start": "a"}}]},
    "cloth": {
        "cloth": [
            {
                "name": "g",
                "corner": [0, 9],
                "columns": 2,
                "rows": 2,
                "spacing": [0.5, 0.5],
                "stiffness": 9.0,
                "bend": 1.0,
            }
        ]
    },
    "ragdoll": {"ragdoll": [{"name": "g", "position": [-3.0, 3.0], "height": 1.8}]},
    "torque drive": {"drive": [{**_HINGE, "kind": "torque", "torque": 1.0}]},
    "stroke drive": {"drive": [{**_HINGE, "kind": "stroke", "rate": 1.0}]},
    "plunger drive": {"drive": [_PLUNGER]},
    "driven in a zone": {"drive": [_PLUNGER], "zone": [{"position": [0.0, 2.9], "radius": 1.0, "holds": True}]},
    "rope tied to a drive": {"drive": [_PLUNGER], "rope": [{**_ROPE, "links": 1, "tie": {"start": "a"}}]},
    "springs tied to a drive": {
        "drive": [_PLUNGER],
        "rope": [{**_ROPE, "links": 2, "kind": "springs", "stiffness": 9.0, "tie": {"start": "a", "end": "b"}}],
    },
    "jointed in a zone": {
        "joint": [{"kind": "spring", "between": ["a", "b"], "stiffness": 1.0}],
        "zone": [{"position": [0.0, 2.9], "radius": 1.0, "holds": True}],
    },
    "events": {
        "event": [
            {"kind": "explosion", "time": 0.1, "position": [0.5, 2.0], "radius": 3.0, "impulse": 1.0},
            {"kind": "spawn", "time": 0.1, "ball": _ball("c", -3.0)},
            {"kind": "set", "time": 0.2, "path": "world.gravity", "value": [0.0, -1.0]},
        ]
    },
    "elastic band": {"joint": [{**_joint("spring", "a"), "rest_length": 2.0, "pulls_only": True}]},
    **{f"{kind} to the world": {"joint": [_joint(kind, "a")]} for kind in JOINTS if kind != "pulley"},
    **{f"{kind} between two": {"joint": [_joint(kind, "a", "b")]} for kind in JOINTS},
    "friction of the ground": {
        "joint": [
            {"kind": "pivot", "between": ["a"], "anchors": [[0, 0], [0, 0]], "max_bias": 0, "max_force": 5.0},
            {"kind": "gear", "between": ["a"], "ratio": 1.0, "max_bias": 0, "max_force": 0.5},
        ]
    },
    "pivot with a bias": {"joint": [{**_joint("pivot", "a", "b"), "bias": 0.5}]},
    "pivot to a driven body": {
        "drive": [_HINGE | {"kind": "stroke", "rate": 1.0}],
        "joint": [_joint("pivot", "a", "b")],
    },
    **{f"weak {kind}": {"joint": [{**_joint(kind, "a", "b"), "strength": 1e-9}]} for kind in JOINTS},
}


def document(bodies: str, feature: str) -> Document:
    """Return a scene with some bodies, by their name in `BODIES`, and a feature."""
    scene: Document = {"title": "t", "world": {"gravity": [0.0, -9.81]}, "solver": {"dt": 0.01}}
    for part in (BODIES[bodies], FEATURES[feature]):
        for key, value in copy.deepcopy(part).items():
            scene[key] = (
                {**scene[key], **value}
                if key == "world"
                else [*scene.get(key, []), *value]
                if isinstance(value, list)
                else value
            )
    return scene


def scene_with(feature: str) -> Scene:
    """Return a scene with a feature and the first bodies that it can have: two, of which one may be fixed, or one."""
    for bodies in ("two", "one of two fixed", "one"):
        try:
            return from_document(document(bodies, feature))
        except SceneError:  # the feature refers to a body in another way
            continue
    raise AssertionError(f"no bodies for {feature!r}")
