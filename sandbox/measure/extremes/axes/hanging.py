"""Hanging: chains of joints, and a mass on a spring."""

import math

import numpy as np

from sandbox.measure.extremes.axis import Axis, Pair, Side
from sandbox.measure.extremes.case import Case, Document, Parameters
from sandbox.measure.extremes.cell import Cell
from sandbox.measure.extremes.setup import JOINTED, SWINGING
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

G, LINK = 9.81, 0.1
AMPLITUDE, REST, H = 0.1, 10.0, 0.01  # m, m, s
SWINGS = 200
"""Steps of a swing: what grows has grown by then."""


def _chain(p: Parameters) -> Document:
    rope = {"name": "chain", "start": [0.0, 0.0], "end": [0.0, -LINK * p["links"]], "links": p["links"]}
    return {
        "world": {"gravity": [0.0, -G], "duration": 3.0},
        "solver": {"dt": p["dt"], "iterations": p["iterations"]},
        "rope": [{**rope, "fix": ["start"], "radius": 0.02, "mass": 0.1}],
    }


def _displaced(scene: Scene, run: Trajectory) -> float:
    """Return how far the link that moved most is from its place in the end, as a share of its length."""
    return float(np.hypot(*(run.position[-1] - scene.bodies.position).T).max()) / LINK


def _swing(p: Parameters) -> Document:
    ball = {"name": "mass", "position": [REST + AMPLITUDE, 0.0], "radius": 0.1, "collides": "none"}
    spring = {"name": "spring", "kind": "spring", "between": ["mass"], "rest_length": REST}
    return {
        "world": {"duration": SWINGS * H},
        "solver": {"dt": H},
        "ball": [ball],
        "joint": [{**spring, "stiffness": (p["omega_h"] / H) ** 2}],
    }


def _stored(scene: Scene) -> float:
    return 0.5 * float(scene.links.figures[0, 1]) * AMPLITUDE**2


def _phase(scene: Scene, run: Trajectory) -> float:
    omega = math.sqrt(float(scene.links.figures[0, 1]))
    truth = REST + AMPLITUDE * math.cos(omega * scene.world.duration)
    return abs(float(run.position[-1, 0, 0]) - truth) / AMPLITUDE


def _band(scene: Scene, settings: Settings, engine: str) -> float:
    """Return the share by which the energy of a swing may rise: of symplectic schemes to 1/(1 − ωh/2), while ωh < 2.

    A rise beyond it, or any of another scheme, is a swing that grows. pymunk's springs are symplectic, whatever it
    calls its way of moving.
    """
    z = math.sqrt(float(scene.links.figures[0, 1])) * settings.h
    grows = engine != "pymunk" and settings.integrator in ("rk4", "explicit_euler")
    return 0.01 if grows or z >= 2.0 else 1.01 / (1.0 - 0.5 * z) - 1.0


CHAIN = Case(
    "chain",
    "a chain hangs at rest from one end",
    {"links": 20, "dt": 1 / 240, "iterations": 10},
    _chain,
    frozenset({"joints", "energy"}),
    _displaced,
    "a link",
)
SWING = Case(
    "swing",
    "a mass oscillates on a spring",
    {"omega_h": 0.1},
    _swing,
    frozenset({"energy"}),
    _phase,
    "the amplitude",
    gain=_band,
    stake=_stored,
)

USELESS = 1.0
"""The share of its energy that a swing may gain, and lose again, before it is of no use."""


def _grew(cell: Cell) -> bool:
    failed = cell.verdict == "failed" and cell.rule in ("bounded", "energy")
    return failed or cell.outcome.figures.get("gained", 0.0) > USELESS


TORN = frozenset({"bounded", "joints", "energy"})

AXES = (
    Axis(
        "stiffness",
        "ω·dt of a mass on a spring",
        "",
        SWING,
        "omega_h",
        (0.1, 0.5, 1.0, 1.5, 1.99, 2.01, 3.0, 10.0),
        (0.1, 1.99, 2.01),
        setups=SWINGING,
        kind="spring",
        happened=_grew,
    ),
    Axis(
        "chain",
        "links of a hanging chain, 240 Hz, 10 iterations",
        "links",
        CHAIN,
        "links",
        (5, 10, 20, 50, 100),
        (5, 20, 100),
        scale="whole",
        setups=JOINTED,
        kind="chain",
        blamed=TORN,
    ),
)
PAIRS = (
    Pair(CHAIN, Side("links", (5, 10, 20, 50)), Side("iterations", (2, 10, 50, 200)), JOINTED),
    Pair(CHAIN, Side("links", (5, 10, 20, 50)), Side("dt", (1 / 960, 1 / 240, 1 / 120, 1 / 60)), JOINTED),
)
