"""Standing: boxes on boxes, heavy ones on light ones, towers."""

from sandbox.measure.extremes.axis import Axis, Pair, Side
from sandbox.measure.extremes.case import Case, Document, Parameters
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

FRICTION, G = 0.5, 9.81
LIGHT, HEAVY = 0.5, 1.0  # m, sides
BOX = 1.0  # m, side of those of a tower

FLOOR = {"point": [0.0, 0.0], "normal": [0.0, 1.0], "friction": 1.0}


def _two(p: Parameters) -> Document:
    boxes = [
        {"position": [0.0, 0.5 * LIGHT], "size": [LIGHT, LIGHT], "mass": 1.0, "friction": FRICTION},
        {"position": [0.0, LIGHT + 0.5 * HEAVY], "size": [HEAVY, HEAVY], "mass": p["mass_ratio"], "friction": FRICTION},
    ]
    return {
        "world": {"gravity": [0.0, -G], "duration": 5.0},
        "solver": {"dt": p["dt"], "iterations": p["iterations"]},
        "plane": [FLOOR],
        "box": boxes,
    }


def _tower(p: Parameters) -> Document:
    stack = {"base": [0.0, 0.0], "size": [BOX, BOX], "columns": 1, "rows": p["rows"], "friction": FRICTION}
    return {
        "world": {"gravity": [0.0, -G], "duration": 5.0},
        "solver": {"dt": p["dt"], "iterations": p["iterations"]},
        "plane": [FLOOR],
        "stack": [{"name": "box", **stack}],
    }


def _displaced(scene: Scene, run: Trajectory) -> float:
    """Return how far the body that moved most is from its place in the end, as a share of its width."""
    away = run.position[-1] - scene.bodies.position
    return float(((away**2).sum(axis=1) ** 0.5 / (2.0 * scene.bodies.thin)).max())


STANDS = frozenset({"energy", "overlap", "stands", "settles"})

TWO = Case(
    "two boxes",
    "a box stands on another",
    {"mass_ratio": 1.0, "dt": 1 / 60, "iterations": 10},
    _two,
    STANDS,
    _displaced,
    "the width",
)
TOWER = Case(
    "tower",
    "boxes of 1 m stand on each other",
    {"rows": 10, "dt": 1 / 120, "iterations": 20},
    _tower,
    STANDS,
    _displaced,
    "the width",
)

RATIOS = (1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6)
ITERATIONS = (1000, 200, 100, 50, 20, 10, 5, 2, 1)
FALLS = frozenset({"bounded", "energy", "stands", "settles"})

AXES = (
    Axis(
        "heavy_on_light",
        "mass ratio of two boxes, 60 Hz, 10 iterations",
        "",
        TWO,
        "mass_ratio",
        RATIOS,
        (1.0, 100.0, 1e6),
        kind="mass_ratio",
        blamed=FALLS,
    ),
    Axis(
        "light_on_heavy",
        "mass of the upper box relative to that of the lower",
        "",
        TWO,
        "mass_ratio",
        tuple(1.0 / ratio for ratio in RATIOS),
        (1.0, 0.01, 1e-6),
        kind="mass_ratio",
        blamed=FALLS,
    ),
    Axis(
        "stack",
        "boxes in a tower, 120 Hz, 20 iterations",
        "boxes",
        TOWER,
        "rows",
        (2, 5, 10, 20, 50, 100),
        (2, 10, 20),
        scale="whole",
        kind="stack",
        blamed=FALLS,
    ),
    Axis(
        "tower_iterations",
        "iterations for a stable tower of 10 boxes, 120 Hz",
        "",
        TOWER,
        "iterations",
        ITERATIONS,
        (100, 10, 1),
        scale="whole",
        kind="stack",
        blamed=FALLS,
    ),
)
PAIRS = (
    Pair(TWO, Side("mass_ratio", (1.0, 10.0, 100.0, 1e3)), Side("iterations", (5, 10, 20, 100))),
    Pair(TWO, Side("mass_ratio", (1.0, 10.0, 100.0, 1e3)), Side("dt", (1 / 480, 1 / 240, 1 / 120, 1 / 60))),
    Pair(TOWER, Side("rows", (2, 5, 10, 20)), Side("iterations", (5, 10, 20, 100))),
    Pair(TOWER, Side("rows", (2, 5, 10, 20)), Side("dt", (1 / 480, 1 / 240, 1 / 120, 1 / 60))),
)
