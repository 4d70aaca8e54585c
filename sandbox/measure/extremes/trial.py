"""Trials: one task run, judged, and held against what was forecast, in this process."""

from dataclasses import replace
from time import perf_counter

from pydantic import ValidationError

from sandbox.engines.registry import engine_named
from sandbox.measure.extremes.axes import CASES
from sandbox.measure.extremes.cell import Outcome, Task
from sandbox.measure.extremes.judge import judge
from sandbox.measure.extremes.rules import Evidence
from sandbox.measure.forecast import warnings
from sandbox.measure.recorder import TooLargeError
from sandbox.measure.run import run
from sandbox.scene.description.world import Settings
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import from_document
from sandbox.scene.scene import Scene

MOST_FRAMES = 2_000
"""Kept of a run: of more, only every n-th."""


def attempt(task: Task) -> Outcome:
    """Run a task twice, and return the verdict.

    What the scene format, the settings or the engine refuse by name is `refused`. The same run again must end in the
    same state, bit for bit, or it has broken the rule `repeat`.
    """
    case = CASES[task.case]
    began = perf_counter()
    try:
        scene = from_document(case.document(task.parameters), "the scene", task.overrides)
        settings = _settings(scene, task)
    except SceneError as error:
        return Outcome("refused", f"invalid scene: {error.faults[0].message}")
    except ValidationError as error:
        first = error.errors()[0]
        return Outcome("refused", f"invalid scene: {'.'.join(map(str, first['loc']))}: {first['msg']}")
    predicted = tuple(dict.fromkeys(warning.kind for warning in warnings(scene, settings, task.engine)))
    engine = engine_named(task.engine)
    missing = engine.missing(scene, settings)
    if missing:
        return Outcome("refused", "; ".join(missing), predicted=predicted, solver=settings.model_dump(mode="json"))
    resolved = engine.resolve(scene, settings)
    solver = resolved.model_dump(mode="json")
    try:
        done = run(scene, task.engine, audit=False, **settings.model_dump())
        outcome = judge(Evidence(case, scene, resolved, done))
        if outcome.verdict != "failed":
            again = run(scene, task.engine, audit=False, **settings.model_dump())
            if again.info["state_hash"] != done.info["state_hash"]:
                outcome = Outcome("failed", "a repeated run ended in a different state", "repeat")
    except TooLargeError as error:
        return Outcome("refused", str(error), predicted=predicted, solver=solver)
    except MemoryError:
        outcome = Outcome("failed", "out of memory", "process")
    return replace(outcome, predicted=predicted, solver=solver, seconds=perf_counter() - began)


def _settings(scene: Scene, task: Task) -> Settings:
    """Return the scene's settings with the task's changes, keeping only as many frames as are of use."""
    settings = scene.solver.replace(**task.changes)
    frames = scene.world.duration / settings.dt
    return settings.replace(record_every=max(1, int(frames // MOST_FRAMES)))
