"""Documents of test pages: a scene, a trade-off and extremes, all with hostile texts."""

from dataclasses import replace
from typing import Any

from sandbox.measure.compare.ground_truth import Truth
from sandbox.measure.compare.metrics import METRICS
from sandbox.measure.extremes import Extremes, ExtremesPlan
from sandbox.measure.extremes.boundary import Boundary
from sandbox.measure.extremes.outcome import Outcome, Sample
from sandbox.measure.extremes.scenarios import AXES
from sandbox.measure.fresh_starts import FreshStarts
from sandbox.measure.preflight.diagnostic import Diagnostic
from sandbox.measure.run.runner import run
from sandbox.measure.tradeoff.configuration import Configuration, Evaluation
from sandbox.measure.tradeoff.error_budget import ErrorBudget
from sandbox.measure.tradeoff.result import Recommendation, Tradeoff
from sandbox.measure.tradeoff.simplify import Simplification
from sandbox.scene.description.world import Settings
from sandbox.scene.files.load import loads
from tests.toml_text import toml

HOSTILE = """</script><img src="x" onerror="window.harm=1">'"&amp;"""
"""Text that ends a script element and starts its own."""

SCENE = (
    toml(title='<b id="harm">Title</b>', about=f"{HOSTILE}</style><script>window.harm=1</script>")
    + toml("world", gravity=[0.0, -10.0], duration=1.0)
    + toml("solver", dt=0.01)
    + toml("plane", name=HOSTILE, point=[0.0, 0.0], normal=[0.0, 1.0])
    + toml("wall", points=[[3.0, 0.0], [3.0, 2.0]], thickness=0.1)
    + toml("post", position=[-2.0, 0.5], radius=0.2)
    + toml("ball", name=f"{HOSTILE} ball", position=[0.0, 1.5], velocity=[1.0, 0.0], radius=0.5, restitution=0.5)
)


def point(engine: str, dt: float, error: float | None, cost: float | None, **settings: Any) -> Evaluation:
    """Return a point of a trade-off."""
    resolved, work = Settings(dt=dt, **settings), {"substeps": round(1.0 / dt)}
    metrics = {"max_position": error, "energy": 0.25}
    return Evaluation(
        configuration=Configuration(engine),
        engine=engine,
        asked=resolved,
        settings=resolved,
        changes={"dt": dt},
        error=error,
        cost=cost,
        cost_median=cost,
        repeats=3,
        counted=cost,
        is_own=dt == 0.01,
        status="ok",
        reason=None,
        metrics=metrics,
        work=work,
    )


def tradeoff_of(points: tuple[Evaluation, ...], **more: Any) -> Tradeoff:
    """Return a trade-off of points; other fields are empty unless given."""
    scene = loads(SCENE, "hostile.toml")
    defaults = {
        "best": None,
        "doubt": None,
        "metric": METRICS["max_position"],
        "metric_reason": "the truth is trusted to the end",
        "zoom": 100.0,
        "pareto": (),
        "splits": (),
        "proposals": (),
        "tolerance": 0.02,
        "margin": 0.0,
        "budget": 0.5,
        "fps": 60.0,
        "within_tolerance": None,
        "within_budget": None,
        "cheapest_by_engine": {},
        "rejected": None,
        "nearest_to_tolerance": None,
        "nearest_to_budget": None,
        "starts": 30,
        "spread": 0.01,
        "end_starts": 0,
        "differing_ends": 0,
        "searched_starts": (0,),
        "untried": 0,
        "effort": 1.0,
        "spent": 0.5,
        "limit": None,
        "out_of_time": False,
        "machine": {"cpu": "a <processor>", "cores": 2},
        "versions": {"python": "3"},
    }
    return Tradeoff(scene=scene, points=points, **{**defaults, **more})


def tradeoff_document() -> dict[str, Any]:
    """Return a trade-off of three engines, with a failure and a second method."""
    points = (
        point("pymunk", 0.01, 0.1, 2.0),
        point("pymunk", 0.001, 0.01, 20.0),
        replace(point("pymunk", 0.1, None, None), status="diverged", reason=HOSTILE),
        point("reference", 0.01, 0.05, 5.0),
        point("reference", 0.01, 0.001, 8.0, integrator="velocity_verlet"),
        point("exact", 0.01, 0.0, 30.0),
    )
    risk = Diagnostic("tunnelling", f"substeps >= 20 prevents tunnelling of {HOSTILE}", {"safe_substeps": 20})
    cheapest = {
        "pymunk": Recommendation(points[1], "cheapest of pymunk", FreshStarts.of([0.004] * 29 + [0.02], 0.01), (risk,)),
        "exact": None,
    }
    scene = loads(SCENE, "hostile.toml")
    found = tradeoff_of(
        points,
        best=Truth("closed_form", "formulas", run(scene, "exact"), 1.0),
        pareto=(points[0], points[3], points[4], points[5]),
        splits=(ErrorBudget("pymunk", Settings(), 0.1, 0.01, 0.085, 0.005, 0.005, 16),),
        proposals=(Simplification("closed form", None, 0.0, 0.1, 0.05, HOSTILE),),
        within_tolerance=Recommendation(points[4], HOSTILE, None),
        cheapest_by_engine=cheapest,
        max_dt=0.005,
    )
    return found.document("scene.toml")


def extremes_document() -> dict[str, Any]:
    """Return extremes of an axis with every verdict, and one false alarm among four warnings."""
    axis, changes = AXES["dt"], {"substeps": 4}
    failed = Outcome("failed", HOSTILE, min(axis.failure_rules), predicted=("tunnelling",))
    outcomes = (
        Outcome("exact", "right"),
        Outcome("refused", HOSTILE),
        Outcome("degraded", "off", predicted=("tunnelling",)),
        failed,
        failed,
        failed,
    )
    setup = "pymunk, 4 substeps"
    samples = tuple(
        Sample(axis.name, level, "pymunk", changes, setup, outcome)
        for level, outcome in zip(axis.levels, outcomes, strict=False)
    )
    limit = Boundary(axis.name, "pymunk", changes, setup, axis.levels[2], axis.levels[3], HOSTILE)
    return Extremes(ExtremesPlan((axis,), ()), samples, (), (limit,), (), 1.0).document()
