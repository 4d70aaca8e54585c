"""Worker process: limits of time and memory, and its tasks, one JSON line for each request and each answer.

    python -m sandbox.measure.extremes.worker MEMORY_MIB

It writes {"ready": true} after all imports, {"compiling": true} when kernels are compiled, so that an answer takes
longer, and one outcome for each task. It ends at the end of its standard input.
"""

import json
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from time import perf_counter
from typing import Any, TextIO

from sandbox.engines.registry import engine_named
from sandbox.jsonable import JsonObject
from sandbox.measure.extremes.checks import RunUnderTest, classify
from sandbox.measure.extremes.orientation import orientation, rotated, rotated_run
from sandbox.measure.extremes.outcome import Outcome, Task
from sandbox.measure.extremes.scenarios import SCENARIOS
from sandbox.measure.preflight import warnings
from sandbox.measure.run.bounded_run import counted_cost
from sandbox.measure.run.recorder import TooLargeError
from sandbox.measure.run.runner import run
from sandbox.measure.starts import Starts
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import from_document
from sandbox.worker_process import limit_cpu_time, limit_memory, private_stdout

MAX_FRAMES = 2_000
"""Recorded frames of a run; of a longer run only every n-th frame is recorded."""

COMPILE_CPU_TIME = 300.0
"""s of processor time that a task may have beyond its limit, because it may compile kernels."""

Answer = Callable[[Mapping[str, Any]], JsonObject]


def main() -> None:
    """Run the tasks on standard input."""
    import sandbox.engines.common.kernel
    import sandbox.measure.extremes.worker  # noqa: F401, imported before the worker reports that it is ready

    serve(_evaluate_document, int(sys.argv[1]))


def serve(answer: Answer, memory: int) -> None:
    """Answer one task after the other.

    Args:
        answer: returns the document of an outcome for that of a task.
        memory: memory limit of the process, MiB.
    """
    limit_memory(memory)
    output = private_stdout()
    output.write('{"ready": true}\n')
    _report_compiling(output)
    for line in sys.stdin:
        request = json.loads(line)
        limit_cpu_time(request["seconds"] + COMPILE_CPU_TIME)
        try:
            document = answer(request["task"])
        except MemoryError:
            document = {"verdict": "failed", "reason": "out of memory", "rule": "process"}
        output.write(json.dumps(document) + "\n")


def _evaluate_document(document: Mapping[str, Any]) -> JsonObject:
    from dataclasses import asdict

    return asdict(evaluate_task(Task.from_json(document)))


def evaluate_task(task: Task) -> Outcome:
    """Run a task and return its outcome.

    A scene, setting or run that the scene format, the settings or the engine refuse is `refused`. The start of the
    scene is run twice: if the second run does not end in the same state, bit for bit, the rule `repeat` is broken.
    Other starts are run once, without the preflight checks, which look at the scene. Some are run rotated as a whole
    (`orientation`), and their runs are rotated back.
    """
    scenario = SCENARIOS[task.case]
    began = perf_counter()
    try:
        scene = from_document(scenario.document(task.parameters), "the scene", task.overrides)
        settings = _settings(scene, task)
    except SceneError as error:
        first = error.faults[0]
        return Outcome("refused", f"invalid scene: {first.path}: {first.message}")
    predicted: tuple[str, ...] = ()
    if task.start:
        scene = Starts(scene, task.spread).start(task.start)
    else:
        predicted = tuple(dict.fromkeys(each.kind for each in warnings(scene, settings, task.engine)))
    angle = orientation(scene, task.start)
    placed = rotated(scene, angle) if angle else scene
    engine = engine_named(task.engine)
    missing = engine.missing(placed, settings)
    if missing:
        return Outcome("refused", "; ".join(missing), predicted=predicted, solver=settings.model_dump(mode="json"))
    resolved, cost = engine.resolve(placed, settings), None
    solver = resolved.model_dump(mode="json")
    try:
        first_run = run(placed, task.engine, audit=False, **settings.model_dump())
        cost = counted_cost(placed, task.engine, resolved, first_run.info["steps"], first_run.info["work"])
        first_run = rotated_run(first_run, scene, -angle) if angle else first_run
        outcome = classify(RunUnderTest(scenario, scene, resolved, first_run))
        if outcome.verdict != "failed" and not task.start:
            second_run = run(scene, task.engine, audit=False, **settings.model_dump())
            if second_run.info["state_hash"] != first_run.info["state_hash"]:
                outcome = Outcome("failed", "a repeated run ended in a different state", "repeat")
    except TooLargeError as error:
        return Outcome("refused", str(error), predicted=predicted, solver=solver)
    except MemoryError:
        outcome = Outcome("failed", "out of memory", "process")
    seconds = perf_counter() - began
    return replace(outcome, predicted=predicted, solver=solver, seconds=seconds, cost=cost)


def _settings(scene: Scene, task: Task) -> Settings:
    """Return the scene's settings with the task's changes and a bounded number of recorded frames."""
    settings = scene.solver.replace(**task.changes)
    frames = scene.world.duration / settings.dt
    return settings.replace(record_every=max(1, int(frames // MAX_FRAMES)))


def _report_compiling(output: TextIO) -> None:
    from sandbox.engines.common.compile_clock import COMPILE_CLOCK

    COMPILE_CLOCK.on_begin = lambda _: print('{"compiling": true}', file=output)


if __name__ == "__main__":
    main()
