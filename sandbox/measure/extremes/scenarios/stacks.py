"""Scenarios of contact: stacked boxes, overlapping balls, a sliding disc."""

from sandbox.jsonable import JsonObject
from sandbox.measure.extremes.experiment import Axis, AxisPair, PairSide, Parameters, Scenario
from sandbox.measure.extremes.outcome import Sample
from sandbox.scene.compile.scene import Scene
from sandbox.trajectory import Trajectory

FRICTION, G = 0.5, 9.81
SMALL_SIDE, LARGE_SIDE = 0.5, 1.0  # m, sides
TOWER_SIDE = 1.0  # m, side of a box of a tower

FLOOR = {"point": [0.0, 0.0], "normal": [0.0, 1.0], "friction": 1.0}


def _two(p: Parameters) -> JsonObject:
    boxes = [
        {"position": [0.0, 0.5 * SMALL_SIDE], "size": [SMALL_SIDE, SMALL_SIDE], "mass": 1.0, "friction": FRICTION},
        {
            "position": [0.0, SMALL_SIDE + 0.5 * LARGE_SIDE],
            "size": [LARGE_SIDE, LARGE_SIDE],
            "mass": p["mass_ratio"],
            "friction": FRICTION,
        },
    ]
    return {
        "world": {"gravity": [0.0, -G], "duration": 5.0},
        "solver": {"dt": p["dt"], "iterations": p["iterations"]},
        "plane": [FLOOR],
        "box": boxes,
    }


def _tower(p: Parameters) -> JsonObject:
    stack = {
        "base": [0.0, 0.0],
        "size": [TOWER_SIDE, TOWER_SIDE],
        "columns": 1,
        "rows": p["rows"],
        "friction": FRICTION,
    }
    return {
        "world": {"gravity": [0.0, -G], "duration": 5.0},
        "solver": {"dt": p["dt"], "iterations": p["iterations"]},
        "plane": [FLOOR],
        "stack": [{"name": "box", **stack}],
    }


def _displacement_error(scene: Scene, run: Trajectory) -> float:
    """Return the largest final displacement of a body as a fraction of its width."""
    away = run.position[-1] - scene.bodies.position
    return float(((away**2).sum(axis=1) ** 0.5 / (2.0 * scene.bodies.thin)).max())


STACK_RULES = frozenset({"energy", "overlap", "stands", "settles"})

TWO = Scenario(
    "two boxes",
    "a box stands on another",
    {"mass_ratio": 1.0, "dt": 1 / 60, "iterations": 10},
    _two,
    STACK_RULES,
    _displacement_error,
    "the width",
)
TOWER = Scenario(
    "tower",
    "boxes of 1 m stand on each other",
    {"rows": 10, "dt": 1 / 120, "iterations": 20},
    _tower,
    STACK_RULES,
    _displacement_error,
    "the width",
)

RATIOS = (1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6)
ITERATIONS = (1000, 200, 100, 50, 20, 10, 5, 2, 1)
FALL_RULES = frozenset({"bounded", "energy", "stands", "settles"})

STACK_AXES = (
    Axis(
        "heavy_on_light",
        "mass ratio of two boxes, 60 Hz, 10 iterations",
        "",
        TWO,
        "mass_ratio",
        RATIOS,
        (1.0, 100.0, 1e6),
        kind="mass_ratio",
        failure_rules=FALL_RULES,
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
        failure_rules=FALL_RULES,
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
        failure_rules=FALL_RULES,
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
        failure_rules=FALL_RULES,
    ),
)
STACK_PAIRS = (
    AxisPair(TWO, PairSide("mass_ratio", (1.0, 10.0, 100.0, 1e3)), PairSide("iterations", (5, 10, 20, 100))),
    AxisPair(TWO, PairSide("mass_ratio", (1.0, 10.0, 100.0, 1e3)), PairSide("dt", (1 / 480, 1 / 240, 1 / 120, 1 / 60))),
    AxisPair(TOWER, PairSide("rows", (2, 5, 10, 20)), PairSide("iterations", (5, 10, 20, 100))),
    AxisPair(TOWER, PairSide("rows", (2, 5, 10, 20)), PairSide("dt", (1 / 480, 1 / 240, 1 / 120, 1 / 60))),
)


OVERLAP_RADIUS = 0.5
MOVED_FRACTION = 1e-9
"""Displacement, as a fraction of its width, beyond which a ball has moved."""


def _pair(p: Parameters) -> JsonObject:
    apart = 2.0 * OVERLAP_RADIUS * (1.0 - p["depth"])
    ball = {"radius": OVERLAP_RADIUS, "restitution": 0.5}
    return {
        "world": {"duration": 3.0},
        "solver": {"dt": 1 / 60},
        "ball": [
            {"position": [0.0, 0.0], "mass": 1.0, **ball},
            {"position": [apart, 0.0], "mass": p["mass_ratio"], **ball},
        ],
    }


def _separation_energy(scene: Scene) -> float:
    """Return the energy of balls that separate by their own width per second, J: their initial energy is 0."""
    return 0.5 * float(scene.bodies.mass.sum()) * (2.0 * OVERLAP_RADIUS) ** 2


def _moved(sample: Sample) -> bool:
    return sample.outcome.figures.get("moved", 0.0) > MOVED_FRACTION


OVERLAP = Scenario(
    "overlap",
    "two overlapping balls start at rest",
    {"depth": 0.1, "mass_ratio": 1.0},
    _pair,
    frozenset({"energy", "momentum", "parted"}),
    energy_scale=_separation_energy,
)

OVERLAP_AXES = (
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
        occurred_if=_moved,
    ),
)
OVERLAP_PAIRS = (
    AxisPair(OVERLAP, PairSide("depth", (0.01, 0.1, 0.5, 1.0)), PairSide("mass_ratio", (1e-6, 1e-3, 1.0, 1e3, 1e6))),
)


SPEED, SLIDE_RADIUS, GRAVITY = 5.0, 0.1, 9.81


def _slide(p: Parameters) -> JsonObject:
    ball = {
        "position": [0.0, SLIDE_RADIUS],
        "velocity": [SPEED, 0.0],
        "radius": SLIDE_RADIUS,
        "friction": p["friction"],
    }
    return {
        "world": {"gravity": [0.0, -p["gravity"]], "duration": 1.0},
        "solver": {"dt": p["dt"]},
        "plane": [{"point": [0.0, 0.0], "normal": [0.0, 1.0], "friction": 1.0}],
        "ball": [ball],
    }


def _distance_error(scene: Scene, run: Trajectory) -> float:
    """Return the error of the disc's final position as a fraction of the distance.

    It slides for v/(3μg) with the deceleration μg, and then rolls at two thirds of its speed.
    """
    deceleration = (scene.balls[0].friction or 0.0) * -scene.world.gravity[1]
    time, (start, speed) = scene.world.duration, (scene.bodies.position[0, 0], scene.bodies.velocity[0, 0])
    slid = min(time, speed / (3.0 * deceleration)) if deceleration > 0.0 else time
    distance = speed * slid - 0.5 * deceleration * slid**2 + (speed - deceleration * slid) * (time - slid)
    return abs(float(run.position[-1, 0, 0] - start - distance)) / float(distance)


SLIDE = Scenario(
    "slide",
    "a disc slides on a floor until it rolls",
    {"friction": 0.5, "gravity": GRAVITY, "dt": 1 / 120},
    _slide,
    frozenset({"energy", "overlap"}),
    _distance_error,
    "the distance",
    fail_above=0.1,
)

SLIDE_AXES = (
    Axis(
        "friction",
        "of a disc that slides until it rolls",
        "",
        SLIDE,
        "friction",
        (0.0, 0.25, 0.5, 1.0, 10.0, 1000.0),
        (0.0, 0.5, 10.0),
    ),
)
SLIDE_PAIRS = (
    AxisPair(SLIDE, PairSide("friction", (0.0, 0.5, 1.0, 10.0)), PairSide("dt", (1e-3, 1 / 240, 1 / 60, 0.1))),
)
