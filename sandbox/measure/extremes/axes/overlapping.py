"""Overlapping: balls that start in each other, up to coincident centres."""

from sandbox.measure.extremes.axis import Axis, Pair, Side
from sandbox.measure.extremes.case import Case, Document, Parameters
from sandbox.measure.extremes.cell import Cell
from sandbox.scene.scene import Scene

RADIUS = 0.5
NUDGED = 1e-9
"""The share of its width from which on a ball has been moved."""


def _pair(p: Parameters) -> Document:
    apart = 2.0 * RADIUS * (1.0 - p["depth"])
    ball = {"radius": RADIUS, "restitution": 0.5}
    return {
        "world": {"duration": 3.0},
        "solver": {"dt": 1 / 60},
        "ball": [
            {"position": [0.0, 0.0], "mass": 1.0, **ball},
            {"position": [apart, 0.0], "mass": p["mass_ratio"], **ball},
        ],
    }


def _flying_apart(scene: Scene) -> float:
    """Return the energy of balls that part by their own width a second, J: what none of them has to begin with."""
    return 0.5 * float(scene.bodies.mass.sum()) * (2.0 * RADIUS) ** 2


def _moved(cell: Cell) -> bool:
    return cell.outcome.figures.get("moved", 0.0) > NUDGED


OVERLAP = Case(
    "overlap",
    "two overlapping balls start at rest",
    {"depth": 0.1, "mass_ratio": 1.0},
    _pair,
    frozenset({"energy", "momentum", "parted"}),
    stake=_flying_apart,
)

AXES = (
    Axis(
        "overlap",
        "initial overlap of two balls as a fraction of their diameter; 1 is coincident centres",
        "",
        OVERLAP,
        "depth",
        (0.0, 0.001, 0.01, 0.1, 0.25, 0.5, 0.75, 0.9, 0.99, 1.0),
        (0.0, 0.1, 1.0),
        scale="linear",
        kind="overlap",
        happened=_moved,
    ),
)
PAIRS = (Pair(OVERLAP, Side("depth", (0.01, 0.1, 0.5, 1.0)), Side("mass_ratio", (1e-6, 1e-3, 1.0, 1e3, 1e6))),)
