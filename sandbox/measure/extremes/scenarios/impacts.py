"""Scenarios of impacts: drops and bounces, a bullet at a wall, head-on collisions."""

import math

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.jsonable import JsonObject
from sandbox.measure.analytic import bounces
from sandbox.measure.extremes.experiment import DETECTION_SETUPS, Axis, AxisPair, PairSide, Parameters, Scenario
from sandbox.scene.compile.scene import Scene
from sandbox.trajectory import Trajectory

DROP_RADIUS, HEIGHT, G = 0.1, 1.0, 9.81  # m, m, m/s²
FALL_HEIGHT, FLOOR_THICKNESS = 0.2, 0.05  # m, onto the thin floor
COUNT = 6
"""Number of balls of the drop: each falls from another height, so that the impact is at another phase of the step."""
MAX_BOUNCE_GAIN = 0.1
"""A bounce higher than the drop by a tenth is visible."""


def _drop(p: Parameters) -> JsonObject:
    return {
        "world": {"gravity": [0.0, -G], "duration": 0.35},
        "solver": {"dt": p["dt"]},
        "wall": [{"points": [[-1.0, 0.0], [COUNT, 0.0]], "thickness": FLOOR_THICKNESS}],
        "ball": [
            {
                "position": [float(k), 0.5 * FLOOR_THICKNESS + DROP_RADIUS + FALL_HEIGHT + 0.02 * k],
                "radius": DROP_RADIUS,
                "restitution": p["restitution"],
                "collides": "fixed",
            }
            for k in range(COUNT)
        ],
    }


def _bounce(p: Parameters) -> JsonObject:
    ball = {"position": [0.0, DROP_RADIUS + HEIGHT], "radius": DROP_RADIUS, "restitution": p["restitution"]}
    return {
        "world": {"gravity": [0.0, -p["gravity"]], "duration": 2.0},
        "solver": {"dt": p["dt"]},
        "plane": [{"point": [0.0, 0.0], "normal": [0.0, 1.0]}],
        "ball": [ball],
    }


def _height_error(scene: Scene, run: Trajectory) -> float:
    """Return the error of the final heights against the formula of bouncing, as a fraction of 1 m."""
    level = DROP_RADIUS + (0.5 * FLOOR_THICKNESS if scene.walls else 0.0)
    gravity = -scene.world.gravity[1]
    worst = 0.0
    for k, y in enumerate(scene.bodies.position[:, 1].tolist()):
        restitution = scene.elements[scene.bodies.element[k]].restitution or 0.0
        height, _ = bounces(run.time[-1:], y - level, float(scene.bodies.velocity[k, 1]), gravity, restitution)
        worst = max(worst, abs(float(run.position[-1, k, 1]) - level - float(height[0])) / HEIGHT)
    return worst


def _fall_energy(scene: Scene) -> float:
    height = scene.bodies.position[:, 1] - 0.5 * FLOOR_THICKNESS - DROP_RADIUS
    return float((scene.bodies.mass * (G * height + 0.5 * (scene.bodies.velocity**2).sum(axis=1))).sum())


def _fell_through(scene: Scene, run: Trajectory) -> str | None:
    below = np.flatnonzero((run.position[..., 1] < 0.0).any(axis=0))
    return f"{len(below)} of {len(scene.bodies)} balls fell through the floor" if len(below) else None


DROP = Scenario(
    "drop",
    "6 balls fall 20 to 30 cm onto a floor 5 cm thick",
    {"dt": 1 / 120, "restitution": 0.5},
    _drop,
    frozenset({"through", "energy", "overlap"}),
    _height_error,
    "a metre",
    energy_tolerance=MAX_BOUNCE_GAIN,
    energy_scale=_fall_energy,
    through=_fell_through,
)
BOUNCE = Scenario(
    "bounce",
    "a ball falls 1 m onto a plane",
    {"dt": 1 / 120, "restitution": 0.8, "gravity": G},
    _bounce,
    frozenset({"energy", "overlap"}),
    _height_error,
    "the drop",
    energy_tolerance=MAX_BOUNCE_GAIN,
)

TIME_STEPS = (1e-5, 1 / 960, 1 / 480, 1 / 240, 1 / 120, 1 / 60, 1 / 30, 1 / 15, 0.1, 1.0)
RESTITUTIONS = (0.0, 0.25, 0.5, 0.75, 0.9, 0.99, 1.0)
GRAVITIES = (0.0, 1.0, G, 100.0, 1e3, 1e4)

FALL_AXES = (
    Axis(
        "dt",
        "time step, balls falling onto a thin floor",
        "s",
        DROP,
        "dt",
        TIME_STEPS,
        (1 / 240, 1 / 30, 0.1),
        setups=DETECTION_SETUPS,
        kind="tunnelling",
        failure_rules=frozenset({"through", "bounded"}),
        scales_with_dt=True,
    ),
    Axis(
        "restitution", "of a ball on a plane", "", BOUNCE, "restitution", RESTITUTIONS, (0.0, 0.5, 1.0), scale="linear"
    ),
    Axis("gravity", "of a bouncing ball", "m/s²", BOUNCE, "gravity", GRAVITIES, (0.0, G, 1e4)),
)
FALL_PAIRS = (
    AxisPair(BOUNCE, PairSide("gravity", (1.0, 10.0, 100.0, 1e3, 1e4)), PairSide("dt", (1e-3, 1 / 240, 1 / 60, 0.1))),
    AxisPair(BOUNCE, PairSide("restitution", (0.0, 0.5, 0.9, 1.0)), PairSide("gravity", (0.0, 9.81, 100.0, 1e4))),
)


BULLET_RADIUS, WALL_THICKNESS, BULLET_DT = 0.05, 0.1, 0.01  # m, m, s
REACH = BULLET_RADIUS + 0.5 * WALL_THICKNESS
"""m, distance of the bullet's centre from the middle of the wall at contact."""
START_OFFSET = 1e-9
"""Distance from contact after the first step of the bullet, as a fraction of the reach: the worst phase. It passes once
v·h exceeds r + w/2, whatever the number of substeps.
"""
STEPS = 20


def _bullet(p: Parameters) -> JsonObject:
    speed = p["speed"] * REACH / BULLET_DT
    return {
        "world": {"duration": STEPS * BULLET_DT},
        "solver": {"dt": BULLET_DT, "substeps": p["substeps"]},
        "wall": [
            {"points": [[p["offset"], -1.0], [p["offset"], 1.0]], "thickness": WALL_THICKNESS, "restitution": 1.0}
        ],
        "ball": [
            {
                "position": [p["offset"] - REACH * (1.0 + START_OFFSET) - speed * BULLET_DT, 0.0],
                "velocity": [speed, 0.0],
                "radius": BULLET_RADIUS,
                "collides": "fixed",
            }
        ],
    }


def _bullet_error(scene: Scene, run: Trajectory) -> float:
    """Return the error of the bullet's final position as a fraction of its distance flown."""
    start, speed = scene.bodies.position[:, 0], scene.bodies.velocity[:, 0]
    face = scene.walls[0].points[0][0] - REACH
    straight = start + speed * scene.world.duration
    return float((np.abs(run.position[-1, :, 0] - np.where(straight > face, 2.0 * face - straight, straight))
                  / (speed * scene.world.duration)).max())  # fmt: skip


def _passed_wall(scene: Scene, run: Trajectory) -> str | None:
    behind = bool((run.position[..., 0] > scene.walls[0].points[0][0]).any())
    return "the bullet passed the wall" if behind else None


BULLET = Scenario(
    "bullet",
    "a bullet hits a wall; a step ends as close to the wall as possible without contact",
    {"speed": 0.5, "offset": 0.0, "substeps": 1},
    _bullet,
    frozenset({"through", "energy", "overlap"}),
    _bullet_error,
    "the distance flown",
    through=_passed_wall,
)

SPEEDS = (0.5, 0.99, 1.01, 2.0, 10.0, 100.0)

BULLET_AXES = (
    Axis(
        "speed",
        "v·dt/(r + w/2): travel of a bullet per step, relative to the contact distance",
        "",
        BULLET,
        "speed",
        SPEEDS,
        (0.99, 1.01, 10.0),
        setups=DETECTION_SETUPS,
        kind="tunnelling",
        failure_rules=frozenset({"through", "bounded"}),
        scales_with_dt=True,
    ),
)
BULLET_PAIRS = (
    AxisPair(
        BULLET, PairSide("speed", (0.5, 1.5, 3.0, 10.0, 100.0)), PairSide("substeps", (1, 2, 4, 16)), DETECTION_SETUPS
    ),
    AxisPair(BULLET, PairSide("speed", (0.5, 0.99, 1.01, 10.0)), PairSide("offset", (0.0, 1e6, 1e12, 1e15))),
)


SPEED, GAP, HEAD_ON_DT = 1.0, 0.3, 0.01  # m/s, m, s


def _head_on(p: Parameters) -> JsonObject:
    radius = 1.0 / p["size_ratio"]
    return {
        "world": {"duration": 1.5},
        "solver": {"dt": HEAD_ON_DT},
        "ball": [
            {"position": [p["offset"], p["offset"]], "velocity": [SPEED, 0.0], "radius": 1.0, "mass": p["mass_ratio"],
             "restitution": 1.0},
            {"position": [p["offset"] + 1.0 + GAP + radius, p["offset"]], "radius": radius, "mass": 1.0,
             "restitution": 1.0},
        ],
    }  # fmt: skip


def _impact(scene: Scene) -> tuple[float, FloatArray]:
    """Return the time of the impact, s, and the velocities after it, (2, 2) m/s.

    The centres are then at the distance |d + w·t| = r₁ + r₂, and the elastic impulse 2·m₁·m₂/M·(w·n) acts along their
    line n.
    """
    bodies = scene.bodies
    (first, second), reach = bodies.mass.tolist(), float(bodies.radius.sum())
    apart, relative = np.diff(bodies.position, axis=0)[0], np.diff(bodies.velocity, axis=0)[0]
    approach = -float(apart @ relative)
    excess = (math.hypot(*apart) - reach) * (math.hypot(*apart) + reach)
    time = excess / (approach + math.sqrt(approach**2 - float(relative @ relative) * excess))
    normal = (apart + relative * time) / reach
    change = 2.0 * float(relative @ normal) / (first + second) * normal
    return time, bodies.velocity + np.array([second * change, -first * change])


def _velocity_error(scene: Scene, run: Trajectory) -> float:
    """Return the error of the final velocities as a fraction of the speed before the impact."""
    _, after = _impact(scene)
    return float(np.abs(run.velocity[-1] - after).max() / np.hypot(*scene.bodies.velocity[0]))


def _position_error(scene: Scene, run: Trajectory) -> float:
    """Return the error of the final positions as a fraction of the larger radius."""
    time, after = _impact(scene)
    truth = scene.bodies.velocity * time + after * (scene.world.duration - time)
    moved = run.position[-1] - run.position[0]
    return float(np.abs(moved - truth).max() / scene.bodies.radius.max())


HEAD_ON = Scenario(
    "head on",
    "a ball hits another at rest, head on, e = 1",
    {"mass_ratio": 1.0, "size_ratio": 1.0, "offset": 0.0},
    _head_on,
    frozenset({"energy", "momentum", "overlap"}),
    _velocity_error,
    "the speed before",
    fail_above=0.1,
)
FAR_OUT = Scenario(
    "far out",
    "a ball hits another at rest, far from the origin",
    {"mass_ratio": 1.0, "size_ratio": 1.0, "offset": 0.0},
    _head_on,
    frozenset({"energy", "momentum", "overlap"}),
    _position_error,
    "the radius",
    fail_above=0.1,
)

RATIOS = (1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6)
OFFSETS = (0.0, 1e3, 1e6, 1e9, 1e12, 1e15)

HEAD_ON_AXES = (
    Axis("size_ratio", "of two colliding balls", "", HEAD_ON, "size_ratio", RATIOS, (1.0, 1e3, 1e6)),
    Axis("heavy_hits_light", "mass ratio of two balls", "", HEAD_ON, "mass_ratio", RATIOS, (1.0, 1e3, 1e6)),
    Axis(
        "light_hits_heavy",
        "mass of the moving ball relative to that of the ball at rest",
        "",
        HEAD_ON,
        "mass_ratio",
        tuple(1.0 / ratio for ratio in RATIOS),
        (1.0, 1e-3, 1e-6),
    ),
    Axis(
        "offset",
        "distance from the origin of two colliding balls, r = 1 m",
        "m",
        FAR_OUT,
        "offset",
        OFFSETS,
        (0.0, 1e9, 1e15),
        kind="rounding",
        failure_rules=frozenset({"truth", "overlap", "bounded", "energy", "momentum"}),
    ),
)
HEAD_ON_PAIRS = (
    AxisPair(
        HEAD_ON, PairSide("mass_ratio", (1e-6, 1e-3, 1.0, 1e3, 1e6)), PairSide("size_ratio", (1.0, 10.0, 1e3, 1e6))
    ),
    AxisPair(FAR_OUT, PairSide("offset", (0.0, 1e6, 1e9, 1e12)), PairSide("size_ratio", (1.0, 10.0, 1e3, 1e6))),
)
