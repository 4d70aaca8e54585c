"""Flying: bullets at a wall, and the way that they fly in one step."""

import numpy as np

from sandbox.measure.extremes.axis import Axis, Pair, Side
from sandbox.measure.extremes.case import Case, Document, Parameters
from sandbox.measure.extremes.setup import PIERCING
from sandbox.scene.model import Scene
from sandbox.trajectory import Trajectory

RADIUS, THICKNESS, DT = 0.05, 0.1, 0.01  # m, m, s
REACH = RADIUS + 0.5 * THICKNESS
"""m before the middle of the wall, where a bullet's centre is when it touches"""
COUNT = 8
"""Bullets, each with its own phase of the step."""
JUST_OFF = 1e-9
"""The share of the reach by which the first bullet does not yet touch: the worst phase there is. It passes once
v·h exceeds r + w/2, whatever the number of substeps."""
STEPS = 20


def _bullets(p: Parameters) -> Document:
    speed = p["speed"] * REACH / DT
    return {
        "world": {"duration": STEPS * DT},
        "solver": {"dt": DT, "substeps": p["substeps"]},
        "wall": [
            {"points": [[p["offset"], -1.0], [p["offset"], COUNT]], "thickness": THICKNESS, "restitution": 1.0}
        ],
        "ball": [
            {
                "position": [p["offset"] - REACH * (1.0 + JUST_OFF) - speed * DT * k / COUNT, float(k)],
                "velocity": [speed, 0.0],
                "radius": RADIUS,
                "collides": "fixed",
            }
            for k in range(COUNT)
        ],
    }


def _off(scene: Scene, run: Trajectory) -> float:
    """Return how far off the bullets are in the end, as a share of the way they went."""
    start, speed = scene.bodies.position[:, 0], scene.bodies.velocity[:, 0]
    face = scene.walls[0].points[0][0] - REACH
    straight = start + speed * scene.world.duration
    return float((np.abs(run.position[-1, :, 0] - np.where(straight > face, 2.0 * face - straight, straight))
                  / (speed * scene.world.duration)).max())  # fmt: skip


def _behind(scene: Scene, run: Trajectory) -> str | None:
    behind = np.flatnonzero((run.position[..., 0] > scene.walls[0].points[0][0]).any(axis=0))
    return f"{len(behind)} of {len(scene.bodies)} bullets passed the wall" if len(behind) else None


BULLET = Case(
    "bullet",
    "8 bullets fly at a wall",
    {"speed": 0.5, "offset": 0.0, "substeps": 1},
    _bullets,
    frozenset({"through", "energy", "overlap"}),
    _off,
    "the way flown",
    through=_behind,
)

SPEEDS = (0.5, 0.99, 1.01, 2.0, 10.0, 100.0)

AXES = (
    Axis(
        "speed",
        "v·dt/(r + w/2): the way of a bullet in a step, against where it touches the wall",
        "",
        BULLET,
        "speed",
        SPEEDS,
        (0.99, 1.01, 10.0),
        setups=PIERCING,
        kind="tunnelling",
        blamed=frozenset({"through", "bounded"}),
    ),
)
PAIRS = (
    Pair(BULLET, Side("speed", (0.5, 1.5, 3.0, 10.0, 100.0)), Side("substeps", (1, 2, 4, 16)), PIERCING),
    Pair(BULLET, Side("speed", (0.5, 0.99, 1.01, 10.0)), Side("offset", (0.0, 1e6, 1e12, 1e15))),
)
