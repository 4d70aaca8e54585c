"""Crowding: gases, piles, and the break of a rack."""

import math

from sandbox.measure.energy import energies
from sandbox.measure.extremes.axis import Axis, Pair, Side
from sandbox.measure.extremes.case import Case, Document, Parameters
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

G = 9.81


def _box(width: float, height: float | None) -> list[Document]:
    sides = [([0.0, 0.0], [0.0, 1.0]), ([0.0, 0.0], [1.0, 0.0]), ([width, 0.0], [-1.0, 0.0])]
    if height is not None:
        sides.append(([0.0, height], [0.0, -1.0]))
    return [{"point": point, "normal": normal} for point, normal in sides]


def _gas(p: Parameters) -> Document:
    columns = math.ceil(math.sqrt(p["count"]))
    rows = math.ceil(p["count"] / columns)
    grid = {"name": "atom", "origin": [0.5, 0.5], "columns": columns, "rows": rows, "spacing": [1.0, 1.0]}
    return {
        "world": {"duration": 0.2, "seed": 1},
        "solver": {"dt": p["dt"]},
        "plane": _box(float(columns), float(rows)),
        "grid": [{**grid, "radius": 0.4, "velocity_jitter": 1.0, "restitution": 1.0}],
    }


def _energy_off(scene: Scene, run: Trajectory) -> float:
    total = energies(run.at([0, -1]), scene).total
    return abs(float(total[1] / total[0]) - 1.0)


def _pile(p: Parameters) -> Document:
    columns = min(10, int(p["count"]))
    rows = math.ceil(p["count"] / columns)
    grid = {"name": "ball", "origin": [0.08, 0.06], "columns": columns, "rows": rows, "spacing": [0.11, 0.11]}
    return {
        "world": {"gravity": [0.0, -G], "duration": 5.0, "seed": 1},
        "solver": {"dt": p["dt"]},
        "plane": [{**plane, "friction": 1.0} for plane in _box(0.11 * columns + 0.05, None)],
        "grid": [{**grid, "jitter": 0.004, "radius": 0.05, "mass": 0.1, "restitution": 0.1, "friction": 0.5}],
    }


def _rack(p: Parameters) -> Document:
    radius = 0.0286
    rows = [[1.0 + row * math.sqrt(3.0) * radius, (2.0 * k - row) * radius] for row in range(5) for k in range(row + 1)]
    ball = {"radius": radius, "mass": 0.17, "restitution": math.sqrt(0.95)}  # they multiply
    return {
        "world": {"duration": 0.3},
        "solver": {"dt": p["dt"], "iterations": p["iterations"]},
        "ball": [
            {"name": "cue", "position": [0.5, 0.001], "velocity": [10.0, 0.0], **ball},
            *({"position": place, **ball} for place in rows),
        ],
    }


GAS = Case(
    "gas",
    "elastic balls in a half-filled box",
    {"count": 100, "dt": 1 / 240},
    _gas,
    frozenset({"energy", "overlap"}),
    _energy_off,
    "the energy",
)
PILE = Case(
    "pile",
    "balls fall into a box and come to rest",
    {"count": 100, "dt": 1 / 120},
    _pile,
    frozenset({"energy", "overlap", "settles"}),
    gain=0.1,  # a single ball has little at stake, and a late impact is a share of it
)
RACK = Case(
    "rack",
    "a ball breaks a rack of 15",
    {"iterations": 10, "dt": 1 / 480},
    _rack,
    frozenset({"energy", "momentum", "overlap"}),
)

AXES = (
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
        blamed=frozenset({"work"}),
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
        blamed=frozenset({"energy", "bounded"}),
    ),
)
PAIRS = (
    Pair(RACK, Side("iterations", (1, 3, 5, 10, 50)), Side("dt", (1 / 1920, 1 / 480, 1 / 120, 1 / 60))),
    Pair(GAS, Side("count", (1, 9, 100)), Side("dt", (1 / 960, 1 / 240, 1 / 60, 1 / 4))),
    Pair(PILE, Side("count", (1, 10, 30, 100)), Side("dt", (1 / 240, 1 / 120, 1 / 60, 1 / 30))),
)
