"""Scenarios of many bodies: gases, piles, racks, chains of joints, springs."""

import math

import numpy as np

from sandbox.jsonable import JsonObject
from sandbox.measure.extremes.experiment import (
    JOINT_SETUPS,
    SPRING_SETUPS,
    Axis,
    AxisPair,
    PairSide,
    Parameters,
    Scenario,
)
from sandbox.measure.extremes.outcome import Sample
from sandbox.measure.metrics.energy import energies
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from sandbox.trajectory import Trajectory

GRAVITY = 9.81


def _box(width: float, height: float | None) -> list[JsonObject]:
    sides = [([0.0, 0.0], [0.0, 1.0]), ([0.0, 0.0], [1.0, 0.0]), ([width, 0.0], [-1.0, 0.0])]
    if height is not None:
        sides.append(([0.0, height], [0.0, -1.0]))
    return [{"point": point, "normal": normal} for point, normal in sides]


def _gas(p: Parameters) -> JsonObject:
    columns = math.ceil(math.sqrt(p["count"]))
    rows = math.ceil(p["count"] / columns)
    grid = {"name": "atom", "origin": [0.5, 0.5], "columns": columns, "rows": rows, "spacing": [1.0, 1.0]}
    return {
        "world": {"duration": 0.2, "seed": 1},
        "solver": {"dt": p["dt"]},
        "plane": _box(float(columns), float(rows)),
        "grid": [{**grid, "radius": 0.4, "velocity_jitter": 1.0, "restitution": 1.0}],
    }


def _energy_error(scene: Scene, run: Trajectory) -> float:
    total = energies(run.at([0, -1]), scene).total
    return abs(float(total[1] / total[0]) - 1.0)


def _pile(p: Parameters) -> JsonObject:
    columns = min(10, int(p["count"]))
    rows = math.ceil(p["count"] / columns)
    grid = {"name": "ball", "origin": [0.08, 0.06], "columns": columns, "rows": rows, "spacing": [0.11, 0.11]}
    return {
        "world": {"gravity": [0.0, -GRAVITY], "duration": 5.0, "seed": 1},
        "solver": {"dt": p["dt"]},
        "plane": [{**plane, "friction": 1.0} for plane in _box(0.11 * columns + 0.05, None)],
        "grid": [{**grid, "jitter": 0.004, "radius": 0.05, "mass": 0.1, "restitution": 0.1, "friction": 0.5}],
    }


def _rack(p: Parameters) -> JsonObject:
    radius = 0.0286
    rack = [[1.0 + row * math.sqrt(3.0) * radius, (2.0 * k - row) * radius] for row in range(5) for k in range(row + 1)]
    ball = {"radius": radius, "mass": 0.17, "restitution": math.sqrt(0.95)}  # restitutions multiply
    return {
        "world": {"duration": 0.3},
        "solver": {"dt": p["dt"], "iterations": p["iterations"]},
        "ball": [
            {"name": "cue", "position": [0.5, 0.001], "velocity": [10.0, 0.0], **ball},
            *({"position": position, **ball} for position in rack),
        ],
    }


GAS = Scenario(
    "gas",
    "elastic balls in a half-filled box",
    {"count": 100, "dt": 1 / 240},
    _gas,
    frozenset({"energy", "overlap"}),
    _energy_error,
    "the energy",
)
PILE = Scenario(
    "pile",
    "balls fall into a box and come to rest",
    {"count": 100, "dt": 1 / 120},
    _pile,
    frozenset({"energy", "overlap", "settles"}),
    energy_tolerance=0.1,  # the energy of a single ball is small, and a late impact changes a fraction of it
)
RACK = Scenario(
    "rack",
    "a ball breaks a rack of 15",
    {"iterations": 10, "dt": 1 / 480},
    _rack,
    frozenset({"energy", "momentum", "overlap"}),
)

CROWD_AXES = (
    Axis(
        "count", "of the balls of a gas", "balls", GAS, "count", (1, 9, 100, 1024, 10_000), (1, 9, 100), scale="whole"
    ),
    Axis(
        "pile",
        "balls that come to rest on each other",
        "balls",
        PILE,
        "count",
        (1, 10, 30, 100, 300, 1000),
        (1, 10, 100),
        scale="whole",
        kind="event_rate",
        failure_rules=frozenset({"work"}),
    ),
    Axis(
        "iterations",
        "speed of the ball that breaks a rack, 480 Hz",
        "",
        RACK,
        "iterations",
        (1000, 100, 50, 20, 10, 5, 4, 3, 2, 1),
        (100, 10, 1),
        scale="whole",
        kind="iterations",
        failure_rules=frozenset({"energy", "bounded"}),
    ),
)
CROWD_PAIRS = (
    AxisPair(RACK, PairSide("iterations", (1, 3, 5, 10, 50)), PairSide("dt", (1 / 1920, 1 / 480, 1 / 120, 1 / 60))),
    AxisPair(GAS, PairSide("count", (1, 9, 100)), PairSide("dt", (1 / 960, 1 / 240, 1 / 60, 1 / 4))),
    AxisPair(PILE, PairSide("count", (1, 10, 30, 100)), PairSide("dt", (1 / 240, 1 / 120, 1 / 60, 1 / 30))),
)


G, LINK = 9.81, 0.1
VERTICAL_TOLERANCE = 1e-9  # m, of the links of a chain that hangs at rest: rounding is far smaller, a turn far larger
AMPLITUDE, REST, H = 0.1, 10.0, 0.01  # m, m, s
SWING_STEPS = 200
"""Steps of an oscillation: an unstable one has grown by then."""


def _chain(p: Parameters) -> JsonObject:
    rope = {"name": "chain", "start": [0.0, 0.0], "end": [0.0, -LINK * p["links"]], "links": p["links"]}
    return {
        "world": {"gravity": [0.0, -G], "duration": 3.0},
        "solver": {"dt": p["dt"], "iterations": p["iterations"]},
        "rope": [{**rope, "fix": ["start"], "radius": 0.02, "mass": 0.1}],
    }


def _displacement_error(scene: Scene, run: Trajectory) -> float:
    """Return the largest final displacement of a link as a fraction of its length; nan for a chain that swings."""
    if np.ptp(scene.bodies.position[:, 0]) > VERTICAL_TOLERANCE:
        return math.nan
    return float(np.hypot(*(run.position[-1] - scene.bodies.position).T).max()) / LINK


def _swing(p: Parameters) -> JsonObject:
    ball = {"name": "mass", "position": [REST + AMPLITUDE, 0.0], "radius": 0.1, "collides": "none"}
    spring = {"name": "spring", "kind": "spring", "between": ["mass"], "rest_length": REST}
    return {
        "world": {"duration": SWING_STEPS * H},
        "solver": {"dt": H},
        "ball": [ball],
        "joint": [{**spring, "stiffness": (p["omega_h"] / H) ** 2}],
    }


def _amplitude(scene: Scene) -> float:
    """Return the extension of the spring at the start, from which the mass is released at rest, m."""
    extent = scene.bodies.position[0] - scene.joint_arrays.anchor_a[0]
    return float(np.hypot(*extent)) - float(scene.joint_arrays.figures[0, 0])


def _spring_energy(scene: Scene) -> float:
    return 0.5 * float(scene.joint_arrays.figures[0, 1]) * _amplitude(scene) ** 2


def _phase_error(scene: Scene, run: Trajectory) -> float:
    """Return the error of the final extension of the spring as a fraction of the amplitude."""
    rest, stiffness = scene.joint_arrays.figures[0, :2].tolist()
    truth = rest + _amplitude(scene) * math.cos(math.sqrt(stiffness) * scene.world.duration)
    extent = run.position[-1, 0] - scene.joint_arrays.anchor_a[0]
    return float(abs(np.hypot(*extent) - truth)) / _amplitude(scene)


def _energy_tolerance(scene: Scene, settings: Settings, engine: str) -> float:
    """Return the fraction by which the energy of an oscillation may rise.

    The energy of symplectic schemes rises to 1/(1 − ωh/2) while ωh < 2. A larger rise, or any rise with another scheme,
    is an unstable oscillation. Springs of pymunk are symplectic with every integrator.
    """
    z = math.sqrt(float(scene.joint_arrays.figures[0, 1])) * settings.h
    grows = engine != "pymunk" and settings.integrator in ("rk4", "explicit_euler")
    return 0.01 if grows or z >= 2.0 else 1.01 / (1.0 - 0.5 * z) - 1.0


CHAIN = Scenario(
    "chain",
    "a chain hangs at rest from one end",
    {"links": 20, "dt": 1 / 240, "iterations": 10},
    _chain,
    frozenset({"joints", "energy"}),
    _displacement_error,
    "a link",
)
SWING = Scenario(
    "swing",
    "a mass oscillates on a spring",
    {"omega_h": 0.1},
    _swing,
    frozenset({"energy"}),
    _phase_error,
    "the amplitude",
    energy_tolerance=_energy_tolerance,
    energy_scale=_spring_energy,
)

MAX_SWING_GAIN = 1.0
"""Fraction of its energy that an oscillation may gain and lose again before the result is useless."""


def _energy_grew(sample: Sample) -> bool:
    failed = sample.verdict == "failed" and sample.rule in ("bounded", "energy")
    return failed or sample.outcome.figures.get("gained", 0.0) > MAX_SWING_GAIN


TEAR_RULES = frozenset({"bounded", "joints", "energy"})

JOINT_AXES = (
    Axis(
        "stiffness",
        "ω·dt of a mass on a spring",
        "",
        SWING,
        "omega_h",
        (0.1, 0.5, 1.0, 1.5, 1.99, 2.01, 3.0, 10.0),
        (0.1, 1.99, 2.01),
        setups=SPRING_SETUPS,
        kind="spring",
        occurred_if=_energy_grew,
        scales_with_dt=True,
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
        setups=JOINT_SETUPS,
        kind="chain",
        failure_rules=TEAR_RULES,
    ),
)
JOINT_PAIRS = (
    AxisPair(CHAIN, PairSide("links", (5, 10, 20, 50)), PairSide("iterations", (2, 10, 50, 200)), JOINT_SETUPS),
    AxisPair(
        CHAIN, PairSide("links", (5, 10, 20, 50)), PairSide("dt", (1 / 960, 1 / 240, 1 / 120, 1 / 60)), JOINT_SETUPS
    ),
)
