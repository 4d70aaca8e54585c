"""Random scenes of 51 kinds for the calibration of forecasts: common set-ups with random sizes and speeds.

A kind is a function of a random generator that returns a scene document; its name seeds the generator. The scenes are
independent of the matrix of `sandbox extremes`. Some are longer than a trial run of `sandbox check`.
"""

import math
import zlib
from collections.abc import Callable
from typing import Any

import numpy as np

Document = dict[str, Any]
Random = np.random.Generator

G = 9.81
KINDS: dict[str, Callable[[Random], Document]] = {}


def kind(build: Callable[[Random], Document]) -> Callable[[Random], Document]:
    """Register a kind of scene under the name of its function."""
    KINDS[build.__name__] = build
    return build


def document(name: str, seed: int) -> Document:
    """Return the scene document of a kind and a seed, which never changes."""
    random = np.random.default_rng([seed, zlib.crc32(name.encode())])
    scene = KINDS[name](random)
    scene.setdefault("world", {})["seed"] = seed
    scene.setdefault("solver", {}).setdefault("dt", steps(random))
    return scene


def log(random: Random, low: float, high: float) -> float:
    """Draw a number whose logarithm is uniform."""
    return float(np.exp(random.uniform(math.log(low), math.log(high))))


def steps(random: Random) -> float:
    """Draw a step that is common in games and studies, s."""
    return float(random.choice([1 / 30, 1 / 60, 1 / 60, 1 / 100, 1 / 120, 1 / 240, 1 / 500]))


def world(duration: float, gravity: float = G, **more: Any) -> Document:
    return {"gravity": [0.0, -gravity], "duration": duration, **more}


def ground(**more: Any) -> Document:
    return {"name": "ground", "point": [0.0, 0.0], "normal": [0.0, 1.0], "friction": 0.6, **more}


def upright(x: float, thickness: float, **more: Any) -> Document:
    return {"name": "wall", "points": [[x, -5.0], [x, 5.0]], "thickness": thickness, "restitution": 0.5, **more}


def ball(x: float, y: float, radius: float, **more: Any) -> Document:
    return {"position": [x, y], "radius": radius, **more}


def bodies(random: Random) -> Document:
    """Draw restitution and friction."""
    return {"restitution": float(random.uniform(0.0, 0.9)), "friction": float(random.uniform(0.0, 0.8))}


# Falls


@kind
def fall_onto_plane(random: Random) -> Document:
    radius = log(random, 0.02, 0.5)
    return {"world": world(2.0), "plane": [ground()], "ball": [ball(0, log(random, 1, 60), radius, **bodies(random))]}


@kind
def fall_onto_floor(random: Random) -> Document:
    floor = {"name": "floor", "points": [[-9.0, 0.0], [9.0, 0.0]], "thickness": float(random.choice([0.0, 0.05, 0.2]))}
    height, radius = log(random, 0.5, 40), log(random, 0.02, 0.4)
    return {"world": world(3.0), "wall": [floor], "ball": [ball(0, height, radius, **bodies(random))]}


@kind
def fall_onto_box(random: Random) -> Document:
    slab = {"name": "slab", "position": [0, 0], "size": [8, log(random, 0.02, 0.3)], "fixed": True}
    falling = {"position": [0, log(random, 1, 20)], "size": [log(random, 0.1, 0.6)] * 2, **bodies(random)}
    return {"world": world(2.5), "box": [slab, falling]}


@kind
def long_fall(random: Random) -> Document:
    floor = {"name": "floor", "points": [[-9.0, 0.0], [9.0, 0.0]], "thickness": 0.1}
    height = log(random, 100, 700)
    scene = {"world": world(14.0), "wall": [floor], "ball": [ball(0, height, log(random, 0.05, 0.6), restitution=0.5)]}
    return {**scene, "solver": {"dt": 1 / 500}}


@kind
def fall_in_air(random: Random) -> Document:
    floor = {"name": "floor", "points": [[-50.0, 0.0], [50.0, 0.0]], "thickness": 0.05}
    drag = {"linear_drag": log(random, 0.1, 5)} if random.random() < 0.5 else {"quadratic_drag": log(random, 0.01, 1)}
    return {"world": world(3.0, **drag), "wall": [floor], "ball": [ball(0, log(random, 2, 40), log(random, 0.03, 0.3))]}


@kind
def shower(random: Random) -> Document:
    floor = {"name": "floor", "points": [[-9.0, 0.0], [9.0, 0.0]], "thickness": float(random.choice([0.02, 0.2]))}
    drops = {"count": 20, "lower": [-4, 2], "upper": [4, 2 + log(random, 2, 20)], "radius": log(random, 0.03, 0.1)}
    return {"world": world(2.5), "wall": [floor], "scatter": [{"name": "drop", **drops, "restitution": 0.3}]}


# Flights and hits


@kind
def ball_and_ball(random: Random) -> Document:
    first_radius, second_radius = log(random, 0.05, 0.5), log(random, 0.05, 0.5)
    speed = log(random, 2, 80)
    first = ball(-1.5, 0, first_radius, velocity=[speed, 0], mass=log(random, 0.1, 10), restitution=0.8)
    return {
        "world": {"duration": 1.0},
        "ball": [first, ball(1.5, 0, second_radius, mass=log(random, 0.1, 10), restitution=0.8)],
    }


@kind
def ball_beside_ball(random: Random) -> Document:
    radius, speed = log(random, 0.05, 0.4), log(random, 2, 60)
    offset = float(random.uniform(-1.8, 1.8)) * radius
    first = ball(-2, offset, radius, velocity=[speed, 0], restitution=0.9)
    return {"world": {"duration": 1.0}, "ball": [first, ball(0.7, 0, radius, velocity=[-speed, 0], restitution=0.9)]}


@kind
def bullets(random: Random) -> Document:
    balls = [
        ball(-1 - random.uniform(0, 1), y, 0.05, velocity=[log(random, 3, 120), 0], name=f"bullet {y}")
        for y in (-1, 0, 1)
    ]
    return {"world": {"duration": 1.0}, "wall": [upright(0.6, log(random, 0.005, 0.2))], "ball": balls}


@kind
def struck_into_wall(random: Random) -> Document:
    radius = log(random, 0.03, 0.2)
    row = [ball(0.3 * k, 0, radius * (0.6 if k else 1), mass=1.0 if k else log(random, 1, 30), restitution=0.95)
           for k in range(int(random.integers(2, 4)))]  # fmt: skip
    row[0] |= {"position": [-2.0, 0.0], "velocity": [log(random, 3, 40), 0.0]}
    return {"world": {"duration": 1.5}, "wall": [upright(2.0, log(random, 0.005, 0.05))], "ball": row}


@kind
def fast_ball_into_plane(random: Random) -> Document:
    radius, speed = log(random, 0.05, 0.6), log(random, 5, 150)
    fast = ball(random.uniform(-1, 1), 6, radius, velocity=[1.0, -speed], restitution=0.9)
    return {"world": {"duration": 0.6}, "plane": [ground()], "ball": [fast]}


@kind
def thrown_boxes(random: Random) -> Document:
    boxes = [
        {"position": [-3 + 1.2 * k, 2 + k], "size": [log(random, 0.1, 0.8), log(random, 0.1, 0.8)], **bodies(random),
         "velocity": [log(random, 1, 12), random.uniform(-6, 3)], "angular_velocity": random.uniform(-9, 9)}
        for k in range(3)
    ]  # fmt: skip
    return {"world": world(2.0), "plane": [ground()], "box": boxes}


@kind
def rods_at_pegs(random: Random) -> Document:
    peg = {"name": "peg", "position": [1.0, 0.1], "radius": log(random, 0.01, 0.2)}
    rod = {"position": [-1, 0], "length": log(random, 0.2, 1), "radius": log(random, 0.02, 0.1), "angle": 1.2}
    fast = {"velocity": [log(random, 2, 50), 0], "angular_velocity": random.uniform(-20, 20), "restitution": 0.5}
    return {"world": {"duration": 1.0}, "post": [peg], "capsule": [{**rod, **fast}]}


@kind
def late_bullet(random: Random) -> Document:
    speed, distance = log(random, 5, 60), 30.0
    balls = [ball(-distance, 0, log(random, 0.04, 0.2), velocity=[speed, 0])]
    scene = {
        "world": {"duration": distance / speed + 1.0},
        "wall": [upright(0.3, log(random, 0.01, 0.1))],
        "ball": balls,
    }
    return {**scene, "solver": {"dt": float(random.choice([1 / 240, 1 / 500, 1 / 1000]))}}


# Crowds


@kind
def bouncy_balls(random: Random) -> Document:
    count = int(random.integers(3, 8))
    balls = [
        ball(0.35 * k - 1, 1 + 0.4 * (k % 3), 0.15, restitution=float(random.uniform(0.5, 0.95))) for k in range(count)
    ]
    walls = [{"point": [side, 0], "normal": [-side, 0]} for side in (-1.4, 1.8)]
    return {"world": world(3.0), "plane": [ground(), *walls], "ball": balls}


@kind
def column_of_balls(random: Random) -> Document:
    radius, count = log(random, 0.05, 0.3), int(random.integers(2, 6))
    walls = [{"point": [side * radius * 1.05, 0], "normal": [-side, 0]} for side in (-1, 1)]
    friction, e = float(random.choice([0.0, 0.4])), float(random.uniform(0, 0.7))
    balls = [ball(0.0, radius * (1.02 + 2.05 * k), radius, restitution=e, friction=friction) for k in range(count)]
    return {"world": world(2.0), "plane": [ground(), *walls], "ball": balls}


@kind
def heap(random: Random) -> Document:
    count, radius = int(random.integers(4, 14)), 0.1
    walls = [{"point": [side, 0], "normal": [-side, 0]} for side in (-0.5, 0.5)]
    friction, e = float(random.choice([0.0, 0.3])), float(random.uniform(0, 0.6))
    balls = [
        ball(
            -0.3 + 0.22 * (k % 3) + 0.03 * (k // 3 % 2),
            0.12 + 0.25 * (k // 3),
            radius,
            restitution=e,
            friction=friction,
        )
        for k in range(count)
    ]
    return {"world": world(2.5), "plane": [ground(), *walls], "ball": balls}


@kind
def gas_in_thin_box(random: Random) -> Document:
    box = {"name": "box", "points": [[-2, -2], [2, -2], [2, 2], [-2, 2]], "closed": True, "restitution": 1.0}
    atoms = {"count": 15, "lower": [-1.5, -1.5], "upper": [1.5, 1.5], "radius": log(random, 0.04, 0.15)}
    gas = {"name": "atom", **atoms, "velocity_jitter": log(random, 1, 20), "restitution": 1.0}
    return {"world": {"duration": 2.0}, "wall": [{**box, "thickness": log(random, 0.01, 0.2)}], "scatter": [gas]}


@kind
def rack_break(random: Random) -> Document:
    radius, gap = 0.05, float(random.choice([0.0, 1e-3]))
    pitch = 2 * radius + gap
    rack = [ball(pitch * math.sqrt(0.75) * row, (k - row / 2) * pitch, radius, restitution=0.95)
            for row in range(int(random.integers(2, 5))) for k in range(row + 1)]  # fmt: skip
    cue = ball(-1.0, 0.003, radius, velocity=[log(random, 2, 15), 0], restitution=0.95, name="cue")
    rails = [{"name": "rail", "points": [[-2, -1], [2, -1], [2, 1], [-2, 1]], "closed": True, "thickness": 0.04,
              "restitution": 0.8}]  # fmt: skip
    return {"world": {"duration": 2.0}, "wall": rails, "ball": [cue, *rack]}


@kind
def cradle(random: Random) -> Document:
    count, radius, length = int(random.integers(3, 6)), 0.1, 1.0
    balls, rods = [], []
    for k in range(count):
        angle = -log(random, 0.2, 1.2) if k == 0 else 0.0
        top = [0.2005 * k, 0.0]
        balls.append(
            ball(top[0] + length * math.sin(angle), -length * math.cos(angle), radius, name=f"b{k}", restitution=1.0)
        )
        rods.append({"kind": "rod", "between": [f"b{k}"], "anchors": [[0, 0], top]})
    return {"world": world(3.0), "ball": balls, "joint": rods}


@kind
def pegs(random: Random) -> Document:
    posts = [{"position": [0.5 * (k % 4) + 0.25 * (k // 4 % 2), -0.45 * (k // 4)], "radius": 0.05} for k in range(16)]
    balls = [ball(0.3 + 0.4 * k, 1 + log(random, 0.2, 5), 0.06, **bodies(random)) for k in range(3)]
    return {"world": world(2.5), "post": posts, "plane": [{"point": [0, -2.5], "normal": [0, 1]}], "ball": balls}


# Stacks


@kind
def heavy_on_light(random: Random) -> Document:
    light, heavy = log(random, 0.2, 1), log(random, 0.3, 1)
    ratio = log(random, 3, 1000)
    lower = {"name": "light", "position": [0, light / 2], "size": [light] * 2, "mass": 1.0, "friction": 0.5}
    upper = {"name": "heavy", "position": [0, light + heavy / 2], "size": [heavy] * 2, "mass": ratio, "friction": 0.5}
    return {
        "world": world(3.0),
        "plane": [ground()],
        "box": [lower, upper],
        "solver": {"dt": steps(random), "iterations": int(random.choice([5, 10, 20]))},
    }


@kind
def tower(random: Random) -> Document:
    size = [log(random, 0.2, 1.0), log(random, 0.2, 1.0)]
    stack = {
        "name": "box",
        "base": [0, 0],
        "size": size,
        "columns": 1,
        "rows": int(random.integers(3, 14)),
        "friction": 0.6,
    }
    return {
        "world": world(4.0),
        "plane": [ground()],
        "stack": [stack],
        "solver": {"dt": steps(random), "iterations": int(random.choice([5, 10, 20, 40]))},
    }


@kind
def pyramid(random: Random) -> Document:
    rows = int(random.integers(3, 8))
    stack = {
        "name": "box",
        "base": [0, 0],
        "size": [0.5, 0.5],
        "columns": rows,
        "rows": rows,
        "fewer": 1,
        "friction": 0.6,
    }
    return {
        "world": world(3.0),
        "plane": [ground()],
        "stack": [stack],
        "solver": {"dt": steps(random), "iterations": int(random.choice([2, 5, 10]))},
    }


@kind
def struck_tower(random: Random) -> Document:
    stack = {
        "name": "box",
        "base": [0, 0],
        "size": [0.5, 0.5],
        "columns": 1,
        "rows": int(random.integers(3, 8)),
        "friction": 0.6,
    }
    shot = ball(-3, 1.2, 0.15, velocity=[log(random, 3, 40), 0], mass=log(random, 0.3, 5), name="shot")
    return {"world": world(2.0), "plane": [ground()], "stack": [stack], "ball": [shot]}


@kind
def long_tower(random: Random) -> Document:
    stack = {
        "name": "box",
        "base": [0, 0],
        "size": [1, 1],
        "columns": 1,
        "rows": int(random.integers(6, 14)),
        "friction": 0.6,
    }
    return {
        "world": world(10.0),
        "plane": [ground()],
        "stack": [stack],
        "solver": {"dt": 1 / 960, "iterations": int(random.choice([1, 2, 5, 10]))},
    }


# Forces


@kind
def sun(random: Random) -> Document:
    star = {"name": "star", "position": [0, 0], "radius": log(random, 0.05, 0.3)}
    planets = [ball(1 + k, 0.2 * k, 0.05, velocity=[0, log(random, 0.1, 3)], collides="all") for k in range(2)]
    return {"world": {"duration": 3.0}, "post": [star], "ball": planets,
            "attraction": [{"toward": [0, 0], "strength": log(random, 1, 200)}]}  # fmt: skip


@kind
def soft_sun(random: Random) -> Document:
    comet = ball(-2, 0.5, log(random, 0.03, 0.2), velocity=[0, random.uniform(-1, 1)])
    pull = {"toward": [0, 0], "strength": log(random, 1, 300), "softening": log(random, 0.05, 0.5)}
    return {
        "world": {"duration": 3.0},
        "wall": [upright(0.3, log(random, 0.01, 0.1))],
        "ball": [comet],
        "attraction": [pull],
    }


@kind
def thrust_into_wall(random: Random) -> Document:
    ship = {"name": "ship", "position": [-3, 0], "size": [log(random, 0.1, 0.5), 0.2], "mass": log(random, 0.2, 5)}
    push = {"body": "ship", "force": [log(random, 3, 300), 0], "end": float(random.uniform(0.2, 2))}
    return {"world": {"duration": 2.0}, "wall": [upright(1.0, log(random, 0.01, 0.2))], "box": [ship], "thrust": [push]}


@kind
def wind(random: Random) -> Document:
    balls = [ball(-3, k, log(random, 0.05, 0.2)) for k in range(3)]
    air = {"duration": 2.0, "linear_drag": log(random, 0.3, 10), "wind": [log(random, 2, 60), 0]}
    return {"world": air, "wall": [upright(1.0, log(random, 0.01, 0.1))], "ball": balls}


@kind
def spring_shot(random: Random) -> Document:
    shot = ball(-2, 0, log(random, 0.05, 0.2), name="shot", mass=log(random, 0.2, 2))
    spring = {
        "kind": "spring",
        "between": ["shot"],
        "anchors": [[0, 0], [0, 0]],
        "rest_length": 0.2,
        "stiffness": log(random, 10, 3000),
    }
    return {
        "world": {"duration": 1.5},
        "wall": [upright(-0.6, log(random, 0.01, 0.1))],
        "ball": [shot],
        "joint": [spring],
    }


@kind
def stiff_spring(random: Random) -> Document:
    bob = ball(1.1, 0, 0.1, name="bob", mass=log(random, 0.1, 10), collides="none")
    spring = {"kind": "spring", "between": ["bob"], "anchors": [[0, 0], [0, 0]], "rest_length": 1.0,
              "stiffness": log(random, 100, 1e6), "damping": float(random.choice([0.0, 0.5]))}  # fmt: skip
    return {"world": {"duration": 2.0}, "ball": [bob], "joint": [spring]}


@kind
def damper(random: Random) -> Document:
    bob = ball(1.2, 0, 0.1, name="bob", velocity=[1, 0], collides="none", mass=log(random, 0.1, 3))
    spring = {"kind": "spring", "between": ["bob"], "anchors": [[0, 0], [0, 0]], "rest_length": 1.0,
              "stiffness": log(random, 1, 100), "damping": log(random, 1, 1000)}  # fmt: skip
    return {"world": {"duration": 2.0}, "ball": [bob], "joint": [spring]}


@kind
def spring_chain(random: Random) -> Document:
    rope = {"name": "s", "kind": "springs", "start": [0, 0], "end": [2, 0], "links": int(random.integers(4, 15)),
            "radius": 0.03, "mass": 0.1, "stiffness": log(random, 50, 1e5), "collides": "none"}  # fmt: skip
    return {"world": world(2.0), "rope": [rope]}


# Joints


@kind
def pendulum(random: Random) -> Document:
    angle, length = float(random.uniform(0.2, 3)), log(random, 0.3, 3)
    bob = ball(length * math.sin(angle), -length * math.cos(angle), 0.1, name="bob")
    rod = {"kind": "rod", "between": ["bob"], "anchors": [[0, 0], [0, 0]]}
    return {"world": world(3.0), "ball": [bob], "joint": [rod]}


@kind
def double_pendulum(random: Random) -> Document:
    first_angle, second_angle = (float(each) for each in random.uniform(-3, 3, 2))
    first = [math.sin(first_angle), -math.cos(first_angle)]
    second = [first[0] + math.sin(second_angle), first[1] - math.cos(second_angle)]
    balls = [
        ball(first[0], first[1], 0.1, name="a", collides="none"),
        ball(second[0], second[1], 0.1, name="b", mass=log(random, 0.1, 50), collides="none"),
    ]
    rods = [{"kind": "rod", "between": ["a"], "anchors": [[0, 0], [0, 0]]}, {"kind": "rod", "between": ["a", "b"]}]
    return {"world": world(3.0), "ball": balls, "joint": rods}


@kind
def hanging_chain(random: Random) -> Document:
    return _chain(random, int(random.integers(5, 40)), 1.0)


@kind
def loaded_chain(random: Random) -> Document:
    return _chain(random, int(random.integers(2, 10)), log(random, 5, 1000))


def _chain(random: Random, count: int, load: float) -> Document:
    balls = [
        ball(0, -0.2 * (k + 1), 0.05, name=f"n{k}", collides="none", mass=load if k == count - 1 else 1.0)
        for k in range(count)
    ]
    rods: list[Document] = [{"kind": "rod", "between": [f"n{k - 1}", f"n{k}"] if k else ["n0"]} for k in range(count)]
    rods[0]["anchors"] = [[0, 0], [0, 0]]
    return {
        "world": world(2.0),
        "ball": balls,
        "joint": rods,
        "solver": {"dt": steps(random), "iterations": int(random.choice([2, 5, 10, 30]))},
    }


@kind
def plank_bridge(random: Random) -> Document:
    rope = {"name": "plank", "kind": "planks", "start": [-2, 0], "end": [2, 0], "links": int(random.integers(4, 14)),
            "radius": 0.05, "mass": 0.5, "length": 4.3}  # fmt: skip
    return {"world": world(2.5), "rope": [rope], "ball": [ball(0.1, 1.0, 0.2, mass=log(random, 0.5, 50), name="load")]}


@kind
def motor(random: Random) -> Document:
    arm = {"name": "arm", "position": [0, 0], "size": [1.6, 0.1], "mass": 2.0}
    pivot = {"kind": "pivot", "between": ["arm"], "at": [0, 0]}
    drive = {"kind": "motor", "between": ["arm"], "rate": log(random, 2, 60), "max_torque": log(random, 5, 200)}
    corners = [[-2, -2], [2, -2], [2, 3], [-2, 3]]
    cage = {"name": "cage", "points": corners, "closed": True, "thickness": 0.05}
    loose = ball(0.5, 1.5, log(random, 0.05, 0.2))
    return {"world": world(1.5), "box": [arm], "joint": [pivot, drive], "ball": [loose], "wall": [cage]}


@kind
def ragdoll(random: Random) -> Document:
    doll = {
        "name": "doll",
        "position": [0, log(random, 0.2, 8)],
        "velocity": [random.uniform(-4, 4), 0],
        "friction": 0.5,
    }
    stairs = {
        "name": "stairs",
        "points": [[-3, 0.4], [0.5, 0.4], [0.5, 0], [5, 0]],
        "thickness": float(random.choice([0.05, 0.2])),
    }
    return {"world": world(2.0), "wall": [stairs], "plane": [{"point": [0, -1], "normal": [0, 1]}], "ragdoll": [doll],
            "solver": {"dt": steps(random), "iterations": int(random.choice([10, 30]))}}  # fmt: skip


# Slopes


@kind
def ball_on_ramp(random: Random) -> Document:
    top = log(random, 0.5, 8)
    ramp = {"name": "ramp", "points": [[0, top], [6, 0], [12, 0]], "thickness": 0.1, "friction": 0.5}
    return {"world": world(3.0), "wall": [ramp], "ball": [ball(0.5, top + 0.4, log(random, 0.05, 0.25), friction=0.5)]}


@kind
def box_on_ramp(random: Random) -> Document:
    tilt, size = float(random.uniform(0.1, 0.9)), log(random, 0.2, 0.8)
    slope = {
        "name": "slope",
        "point": [0, 0],
        "normal": [math.sin(tilt), math.cos(tilt)],
        "friction": float(random.uniform(0, 1)),
    }
    position = [math.sin(tilt) * size / 2, math.cos(tilt) * size / 2]
    crate = {"position": position, "size": [size, size], "angle": -tilt, "friction": 1.0}
    return {"world": world(2.5), "plane": [slope], "box": [crate]}


# Features that no forecast was fitted to


@kind
def kinematic_paddle(random: Random) -> Document:
    length, spin = log(random, 0.5, 2), log(random, 1, 40)
    paddle = {"name": "paddle", "position": [0, 0], "size": [length, log(random, 0.03, 0.2)], "kinematic": True}
    loose = [ball(x, 2.0 + abs(x), log(random, 0.05, 0.2), restitution=0.5) for x in (-0.4, 0.3)]
    return {"world": world(2.0), "box": [{**paddle, "angular_velocity": spin}], "ball": loose}


@kind
def kinematic_platform(random: Random) -> Document:
    speed = log(random, 0.5, 20) * float(random.choice([-1, 1]))
    platform = {"name": "platform", "position": [-speed, 1], "size": [3, log(random, 0.02, 0.2)], "kinematic": True}
    crates = [{"position": [0.3 * k, 2.0 + 0.5 * k], "size": [0.25, 0.25], **bodies(random)} for k in range(2)]
    return {"world": world(2.0), "box": [{**platform, "velocity": [speed, 0]}, *crates], "plane": [ground()]}


@kind
def sleeping_tower(random: Random) -> Document:
    scene = tower(random)
    return {**scene, "solver": {**scene.get("solver", {}), "dt": steps(random), "sleeping": True}}


@kind
def sleepers_struck(random: Random) -> Document:
    crates = [{"name": f"crate {k}", "position": [0, 0.25 + 0.5 * k], "size": [0.5, 0.5]} for k in range(3)]
    shot = ball(-8.0, 0.6, log(random, 0.05, 0.2), velocity=[log(random, 5, 60), 2.0], mass=log(random, 0.1, 5))
    solver = {"dt": steps(random), "sleeping": True}
    return {"world": world(3.0), "plane": [ground()], "box": crates, "ball": [shot], "solver": solver}


@kind
def categories_of_bullets(random: Random) -> Document:
    wall = upright(0.6, log(random, 0.005, 0.1), categories=["wall"], mask=["heavy"])
    balls = [
        ball(-1, y, log(random, 0.03, 0.1), velocity=[log(random, 5, 100), 0], categories=[name], mask=["wall"])
        for y, name in ((-1, "heavy"), (0, "light"), (1, "heavy"))
    ]
    return {"world": {"duration": 1.0}, "wall": [wall], "ball": balls}


@kind
def limited_door(random: Random) -> Document:
    door = {"name": "door", "position": [0.5, 0], "size": [1.0, 0.08], "mass": 2.0}
    pivot = {"kind": "pivot", "between": ["door"], "at": [0, 0]}
    limit = {"kind": "rotary_limit", "between": ["door"], "least": -0.8, "most": 0.8}
    shot = ball(0.8, 3.0, log(random, 0.05, 0.2), velocity=[0, -log(random, 3, 60)], mass=log(random, 0.2, 20))
    return {"world": {"duration": 1.5}, "box": [door], "joint": [pivot, limit], "ball": [shot]}


@kind
def sliding_limit(random: Random) -> Document:
    bob = ball(0.0, -0.5, 0.1, name="bob", mass=log(random, 0.2, 20), velocity=[log(random, 1, 20), 0])
    string = {"kind": "slide", "between": ["bob"], "anchors": [[0, 0], [0, 0]], "least": 0.0, "most": 1.0}
    return {"world": world(3.0), "ball": [bob], "joint": [string]}


@kind
def conveyor(random: Random) -> Document:
    belt = {"name": "belt", "points": [[-3, 0], [3, 0]], "thickness": log(random, 0.02, 0.2), "friction": 0.8}
    crates = [
        {"position": [0.7 * k - 1, 0.5 + log(random, 0.05, 3)], "size": [0.3, 0.3], "friction": 0.8} for k in (0, 1)
    ]
    floor = {"point": [0, -1], "normal": [0, 1]}
    return {
        "world": world(2.5),
        "wall": [{**belt, "surface_speed": log(random, 0.2, 10)}],
        "box": crates,
        "plane": [floor],
    }
