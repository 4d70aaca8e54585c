"""Falling: the step, restitution and gravity of balls that drop."""

import numpy as np

from sandbox.measure.closed_form import bounces
from sandbox.measure.extremes.axis import Axis, Pair, Side
from sandbox.measure.extremes.case import Case, Document, Parameters
from sandbox.measure.extremes.setup import PIERCING
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

RADIUS, HEIGHT, G = 0.1, 1.0, 9.81  # m, m, m/s²
FALL, THICKNESS = 0.2, 0.05  # m, onto the thin floor
COUNT = 6
"""Balls of the drop: each from a height of its own, and so with its own phase of the step when it arrives."""
GAIN = 0.1
"""A bounce a tenth higher than the drop is one that anybody sees."""


def _drop(p: Parameters) -> Document:
    return {
        "world": {"gravity": [0.0, -G], "duration": 0.35},
        "solver": {"dt": p["dt"]},
        "wall": [{"points": [[-1.0, 0.0], [COUNT, 0.0]], "thickness": THICKNESS}],
        "ball": [
            {
                "position": [float(k), 0.5 * THICKNESS + RADIUS + FALL + 0.02 * k],
                "radius": RADIUS,
                "restitution": p["restitution"],
                "collides": "fixed",
            }
            for k in range(COUNT)
        ],
    }


def _bounce(p: Parameters) -> Document:
    ball = {"position": [0.0, RADIUS + HEIGHT], "radius": RADIUS, "restitution": p["restitution"]}
    return {
        "world": {"gravity": [0.0, -p["gravity"]], "duration": 2.0},
        "solver": {"dt": p["dt"]},
        "plane": [{"point": [0.0, 0.0], "normal": [0.0, 1.0]}],
        "ball": [ball],
    }


def _off(scene: Scene, run: Trajectory) -> float:
    """Return how far off the heights are in the end, by the formula of bouncing, as a share of 1 m."""
    level = RADIUS + (0.5 * THICKNESS if scene.walls else 0.0)
    pull = -scene.world.gravity[1]
    worst = 0.0
    for k, y in enumerate(scene.bodies.position[:, 1].tolist()):
        restitution = scene.elements[scene.bodies.element[k]].restitution or 0.0
        height, _ = bounces(run.time[-1:], y - level, float(scene.bodies.velocity[k, 1]), pull, restitution)
        worst = max(worst, abs(float(run.position[-1, k, 1]) - level - float(height[0])) / HEIGHT)
    return worst


def _fallen(scene: Scene) -> float:
    return float((scene.bodies.mass * G * (scene.bodies.position[:, 1] - 0.5 * THICKNESS - RADIUS)).sum())


def _below(scene: Scene, run: Trajectory) -> str | None:
    below = np.flatnonzero((run.position[..., 1] < 0.0).any(axis=0))
    return f"{len(below)} of {len(scene.bodies)} balls fell through the floor" if len(below) else None


DROP = Case(
    "drop",
    "6 balls fall 20 to 30 cm onto a floor 5 cm thick",
    {"dt": 1 / 120, "restitution": 0.5},
    _drop,
    frozenset({"through", "energy", "overlap"}),
    _off,
    "a metre",
    gain=GAIN,
    stake=_fallen,
    through=_below,
)
BOUNCE = Case(
    "bounce",
    "a ball falls 1 m onto a plane",
    {"dt": 1 / 120, "restitution": 0.8, "gravity": G},
    _bounce,
    frozenset({"energy", "overlap"}),
    _off,
    "the drop",
    gain=GAIN,
)

STEPS = (1e-5, 1 / 960, 1 / 480, 1 / 240, 1 / 120, 1 / 60, 1 / 30, 1 / 15, 0.1, 1.0)
RESTITUTIONS = (0.0, 0.25, 0.5, 0.75, 0.9, 0.99, 1.0)
GRAVITIES = (0.0, 1.0, G, 100.0, 1e3, 1e4)

AXES = (
    Axis(
        "dt",
        "time step of a frame, balls falling onto a thin floor",
        "s",
        DROP,
        "dt",
        STEPS,
        (1 / 240, 1 / 30, 0.1),
        setups=PIERCING,
        kind="tunnelling",
        blamed=frozenset({"through", "bounded"}),
    ),
    Axis(
        "restitution", "of a ball on a plane", "", BOUNCE, "restitution", RESTITUTIONS, (0.0, 0.5, 1.0), scale="linear"
    ),
    Axis("gravity", "that a ball bounces under", "m/s²", BOUNCE, "gravity", GRAVITIES, (0.0, G, 1e4)),
)
PAIRS = (
    Pair(BOUNCE, Side("gravity", (1.0, 10.0, 100.0, 1e3, 1e4)), Side("dt", (1e-3, 1 / 240, 1 / 60, 0.1))),
    Pair(BOUNCE, Side("restitution", (0.0, 0.5, 0.9, 1.0)), Side("gravity", (0.0, 9.81, 100.0, 1e4))),
)
