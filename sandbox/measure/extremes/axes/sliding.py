"""Sliding: a disc that slides until it rolls."""

from sandbox.measure.extremes.axis import Axis, Pair, Side
from sandbox.measure.extremes.case import Case, Document, Parameters
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

SPEED, RADIUS, G = 5.0, 0.1, 9.81


def _slide(p: Parameters) -> Document:
    ball = {"position": [0.0, RADIUS], "velocity": [SPEED, 0.0], "radius": RADIUS, "friction": p["friction"]}
    return {
        "world": {"gravity": [0.0, -p["gravity"]], "duration": 1.0},
        "solver": {"dt": p["dt"]},
        "plane": [{"point": [0.0, 0.0], "normal": [0.0, 1.0], "friction": 1.0}],
        "ball": [ball],
    }


def _off(scene: Scene, run: Trajectory) -> float:
    """Return how far off the disc is in the end, as a share of the way.

    It slides for v/(3μg), slowed by μg, and rolls on at two thirds of its speed.
    """
    rub = (scene.balls[0].friction or 0.0) * -scene.world.gravity[1]
    time = scene.world.duration
    slid = min(time, SPEED / (3.0 * rub)) if rub > 0.0 else time
    way = SPEED * slid - 0.5 * rub * slid**2 + (SPEED - rub * slid) * (time - slid)
    return abs(float(run.position[-1, 0, 0]) - way) / way


SLIDE = Case(
    "slide",
    "a disc slides on a floor until it rolls",
    {"friction": 0.5, "gravity": G, "dt": 1 / 120},
    _slide,
    frozenset({"energy", "overlap"}),
    _off,
    "the distance",
    useless=0.1,
)

AXES = (
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
PAIRS = (Pair(SLIDE, Side("friction", (0.0, 0.5, 1.0, 10.0)), Side("dt", (1e-3, 1 / 240, 1 / 60, 0.1))),)
