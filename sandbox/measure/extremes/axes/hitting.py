"""Hitting: two balls head on, of unequal masses and sizes, and far from the origin."""

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.measure.extremes.axis import Axis, Pair, Side
from sandbox.measure.extremes.case import Case, Document, Parameters
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

SPEED, GAP, DT = 1.0, 0.3, 0.01  # m/s, m, s


def _head_on(p: Parameters) -> Document:
    radius = 1.0 / p["size_ratio"]
    return {
        "world": {"duration": 1.5},
        "solver": {"dt": DT},
        "ball": [
            {"position": [p["offset"], p["offset"]], "velocity": [SPEED, 0.0], "radius": 1.0, "mass": p["mass_ratio"],
             "restitution": 1.0},
            {"position": [p["offset"] + 1.0 + GAP + radius, p["offset"]], "radius": radius, "mass": 1.0,
             "restitution": 1.0},
        ],
    }  # fmt: skip


def _after(scene: Scene) -> FloatArray:
    """Return the velocities after the impact, v₁′ = (m₁ − m₂)v/M and v₂′ = 2m₁v/M."""
    first, second = scene.bodies.mass.tolist()
    share: float = SPEED / (first + second)
    return np.asarray([(first - second) * share, 2.0 * first * share])


def _velocities_off(scene: Scene, run: Trajectory) -> float:
    return float(np.abs(run.velocity[-1, :, 0] - _after(scene)).max() / SPEED)


def _places_off(scene: Scene, run: Trajectory) -> float:
    """Return how far off the balls are in the end, as a share of the larger radius."""
    way = SPEED * scene.world.duration - GAP  # what is flown after the impact, at the speed before it
    truth = np.asarray([GAP, 0.0]) + _after(scene) * way / SPEED
    moved = run.position[-1, :, 0] - run.position[0, :, 0]
    return float(np.abs(moved - truth).max() / scene.bodies.radius.max())


HEAD_ON = Case(
    "head on",
    "a ball hits another at rest, head on, e = 1",
    {"mass_ratio": 1.0, "size_ratio": 1.0, "offset": 0.0},
    _head_on,
    frozenset({"energy", "momentum", "overlap"}),
    _velocities_off,
    "the speed before",
    useless=0.1,
)
FAR = Case(
    "far out",
    "a ball hits another at rest, far from the origin",
    {"mass_ratio": 1.0, "size_ratio": 1.0, "offset": 0.0},
    _head_on,
    frozenset({"energy", "momentum", "overlap"}),
    _places_off,
    "the radius",
    useless=0.1,
)

RATIOS = (1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6)
OFFSETS = (0.0, 1e3, 1e6, 1e9, 1e12, 1e15)

AXES = (
    Axis("size_ratio", "of two balls that meet", "", HEAD_ON, "size_ratio", RATIOS, (1.0, 1e3, 1e6)),
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
        FAR,
        "offset",
        OFFSETS,
        (0.0, 1e9, 1e15),
        kind="rounding",
        blamed=frozenset({"truth", "overlap", "bounded", "energy", "momentum"}),
    ),
)
PAIRS = (
    Pair(HEAD_ON, Side("mass_ratio", (1e-6, 1e-3, 1.0, 1e3, 1e6)), Side("size_ratio", (1.0, 10.0, 1e3, 1e6))),
    Pair(FAR, Side("offset", (0.0, 1e6, 1e9, 1e12)), Side("size_ratio", (1.0, 10.0, 1e3, 1e6))),
)
