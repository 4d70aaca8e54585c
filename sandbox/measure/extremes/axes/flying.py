"""Flying: a bullet at a wall, and the way that it flies in one step."""

import numpy as np

from sandbox.measure.extremes.axis import Axis, Pair, Side
from sandbox.measure.extremes.case import Case, Document, Parameters
from sandbox.measure.extremes.setup import PIERCING
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

RADIUS, THICKNESS, DT = 0.05, 0.1, 0.01  # m, m, s
REACH = RADIUS + 0.5 * THICKNESS
"""m before the middle of the wall, where a bullet's centre is when it touches"""
JUST_OFF = 1e-9
"""The share of the reach by which the bullet does not yet touch as it starts: the worst phase there is. It passes once
v·h exceeds r + w/2, whatever the number of substeps."""
STEPS = 20


def _bullet(p: Parameters) -> Document:
    speed = p["speed"] * REACH / DT
    return {
        "world": {"duration": STEPS * DT},
        "solver": {"dt": DT, "substeps": p["substeps"]},
        "wall": [{"points": [[p["offset"], -1.0], [p["offset"], 1.0]], "thickness": THICKNESS, "restitution": 1.0}],
        "ball": [
            {
                "position": [p["offset"] - REACH * (1.0 + JUST_OFF), 0.0],
                "velocity": [speed, 0.0],
                "radius": RADIUS,
                "collides": "fixed",
            }
        ],
    }


def _off(scene: Scene, run: Trajectory) -> float:
    """Return how far off the bullet is in the end, as a share of the way it went."""
    start, speed = scene.bodies.position[:, 0], scene.bodies.velocity[:, 0]
    face = scene.walls[0].points[0][0] - REACH
    straight = start + speed * scene.world.duration
    return float((np.abs(run.position[-1, :, 0] - np.where(straight > face, 2.0 * face - straight, straight))
                  / (speed * scene.world.duration)).max())  # fmt: skip


def _behind(scene: Scene, run: Trajectory) -> str | None:
    behind = bool((run.position[..., 0] > scene.walls[0].points[0][0]).any())
    return "the bullet passed the wall" if behind else None


BULLET = Case(
    "bullet",
    "a bullet hits a wall; a step ends as close to the wall as possible without contact",
    {"speed": 0.5, "offset": 0.0, "substeps": 1},
    _bullet,
    frozenset({"through", "energy", "overlap"}),
    _off,
    "the distance flown",
    through=_behind,
)

SPEEDS = (0.5, 0.99, 1.01, 2.0, 10.0, 100.0)

AXES = (
    Axis(
        "speed",
        "v·dt/(r + w/2): travel of a bullet per step, relative to the contact distance",
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
