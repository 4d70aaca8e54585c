"""Model simplifications: cheaper models of the same scene, each run and measured before it is proposed.

A closed form needs no engine, and a scene that demands less physics costs less. A simplification is proposed if its
error against the truth of the unchanged scene stays within the tolerance.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from sandbox.arrays import IntArray
from sandbox.engines.common.compile_clock import clock_without_compilation
from sandbox.engines.registry import ENGINES
from sandbox.formatting import format_quantity
from sandbox.jsonable import in_json
from sandbox.measure.analytic.trajectory import solved_run
from sandbox.measure.compare.metrics import EvaluationContext, Metric
from sandbox.measure.run.bounded_run import RunTimeoutError, bounded_run
from sandbox.measure.tradeoff.timing import (
    MIN_TURNS,
    CostRatio,
    TimedRun,
    Timing,
    run_seconds,
    take_turns,
    time_in_turns,
    warm_up,
)
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from sandbox.scene.errors import SceneError
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import from_document

MAX_COST_RATIO = 0.9
"""Largest cost of a simplification relative to the setting that it replaces: a smaller saving is within the noise."""

SettingChange = Callable[[dict[str, Any]], None]


class ModelChange(NamedTuple):
    """Part of the physics that may be left out."""

    what: str
    """short description of the simpler model"""
    advice: str
    """the same as a clause"""
    change: SettingChange
    """removes it from the document of a scene"""


@dataclass(frozen=True)
class Simplification:
    """Cheaper model of a scene whose error is within the tolerance."""

    what: str
    """description of the model"""
    engine: str | None
    """name of the engine; None for a formula"""
    error: float
    """value of the chosen metric against the truth of the unchanged scene"""
    cost: float = field(metadata=in_json(key="cost_ms_per_second"))
    """ms per simulated second"""
    ratio: float
    """cost relative to the setting that it replaces, timed in turns"""
    sentence: str
    """description of the model, its error and its cost"""
    interval: tuple[float, float] | None = None
    """95 % confidence interval of the ratio; None with fewer than `MIN_TURNS` turns"""


@dataclass(frozen=True)
class ReplacedSetting:
    """Setting that a simplification replaces, and the conditions that the simplification has to satisfy."""

    engine: str
    settings: Settings
    """choices left to the engine are None"""
    metric: Metric
    tolerance: float
    """largest accepted error, in the unit of the metric"""
    limit: float
    """counted cost that one run may have, s"""
    deadline: float = math.inf
    """time of `clock_without_compilation` after which a run is stopped, s"""
    repeats: int = MIN_TURNS
    """number of timings"""


def model_simplifications(contexts: Sequence[EvaluationContext], replaced: ReplacedSetting) -> list[Simplification]:
    """Return the cheaper models whose error is within the tolerance, the cheapest first.

    Args:
        contexts: contexts of the scene from different starts: a model has to satisfy the tolerance from each.
        replaced: the setting that the models replace.
    """
    found = [*_closed_form(contexts, replaced)]
    for change in _applicable_changes(contexts):
        error, simpler = 0.0, None
        for context in contexts:
            changed = _changed(context.scene, change.change)
            measured = None if changed is None else _error(context, changed, replaced)
            error = max(error, math.inf if measured is None else measured)
            if not error <= replaced.tolerance:
                break
            simpler = simpler or changed
        if simpler is None or not error <= replaced.tolerance:
            continue
        scenes = contexts[0].scene, simpler
        before, after = time_in_turns(
            [TimedRun(s, replaced.engine, replaced.settings) for s in scenes], replaced.repeats
        )
        if before is not None and after is not None and _is_cheaper(after, before):
            found.append(_simplification(change.what, change.advice, replaced.engine, error, after, before, replaced))
    return sorted(found, key=lambda each: each.ratio)


def _closed_form(contexts: Sequence[EvaluationContext], replaced: ReplacedSetting) -> Iterator[Simplification]:
    """Yield the closed form of the whole scene, if it has one."""
    if any(context.truth is None or context.truth.kind != "closed_form" for context in contexts):
        return
    scene, settings, metric = contexts[0].scene, replaced.settings, replaced.metric
    runs = [solved_run(context.scene, settings) for context in contexts]
    errors = [None if r is None else metric.measure(r, context) for r, context in zip(runs, contexts, strict=True)]
    worst = max(math.inf if each is None or math.isnan(each) else each for each in errors)
    if worst > replaced.tolerance:
        return

    def solution_seconds() -> float:
        began = clock_without_compilation()
        solved_run(scene, settings)
        return clock_without_compilation() - began

    warm_up(scene, replaced.engine, settings)
    simulated, solved = take_turns(
        [lambda: run_seconds(scene, replaced.engine, settings), solution_seconds], replaced.repeats
    )
    if not simulated:
        return
    before, after = (Timing.of(each, scene.world.duration) for each in (simulated, solved))
    if _is_cheaper(after, before):
        what = "no simulation: the scene has a closed-form solution"
        advice = (
            "as long as no input changes the motion, it can also be computed from a formula, without an engine (the "
            "scene has a closed-form solution)"
        )
        yield _simplification(what, advice, None, worst, after, before, replaced)


def _is_cheaper(after: Timing, before: Timing) -> bool:
    return before.least > 0.0 and after.least <= MAX_COST_RATIO * before.least


def _error(context: EvaluationContext, scene: Scene, replaced: ReplacedSetting) -> float | None:
    """Return the error of a changed scene against the truth of the unchanged one; None if it cannot be measured."""
    if ENGINES[replaced.engine].missing(scene, replaced.settings):
        return None
    try:
        run, _ = bounded_run(scene, replaced.engine, replaced.settings, replaced.limit, replaced.deadline)
    except RunTimeoutError:
        return None
    return replaced.metric.measure(run, context) if run.status == "ok" else None


def _simplification(
    what: str,
    advice: str,
    engine: str | None,
    error: float,
    after: Timing,
    before: Timing,
    replaced: ReplacedSetting,
) -> Simplification:
    relative = CostRatio.of(after.turns, before.turns)
    assert relative is not None, "both were timed, in the same turns"
    sentence = (
        f"{advice}: {replaced.metric.name} {format_quantity(error, replaced.metric.unit)}, {after.least:.3g} ms per "
        f"simulated second, {relative} times the cost of simulating the scene as it is"
    )
    return Simplification(what, engine, error, after.least, relative.ratio, sentence, relative.interval)


def _changed(scene: Scene, change: SettingChange) -> Scene | None:
    """Return a changed scene; None if it is invalid or its bodies have other positions."""
    document = to_document(scene)
    change(document)
    try:
        simpler = from_document(document)
    except SceneError:
        return None
    return simpler if simpler.bodies.position.tobytes() == scene.bodies.position.tobytes() else None


def _applicable_changes(contexts: Sequence[EvaluationContext]) -> Iterator[ModelChange]:
    """Yield the changes that the scene and the truths of all starts allow."""
    scene = contexts[0].scene
    world, matrix = scene.world, contact_matrix(scene)
    pairs = _contact_pairs(contexts)
    if pairs is not None and matrix.touches.any():
        if not len(pairs) and not scene.sensors:  # sensors do not detect bodies that collide with nothing
            yield ModelChange(
                'no collisions occur: collides = "none" for all moving bodies',
                'the scene can also be simulated without collisions (collides = "none" for all moving bodies), '
                "because none occur",
                _set_collides(scene, "none"),
            )
        elif matrix.mutual and not (pairs >= 0).all(axis=1).any():
            yield ModelChange(
                'no two bodies collide: collides = "fixed" for all moving bodies',
                'the scene can also be simulated without collisions between bodies (collides = "fixed" for all moving '
                "bodies), because none occur",
                _set_collides(scene, "fixed"),
            )
    if world.has_drag:
        yield ModelChange("no drag", "the scene can also be simulated without drag", _remove_drag)
    if scene.bodies.lift.any():
        yield ModelChange("no lift", "the scene can also be simulated without lift", _set_to_zero("lift"))
    for key in ("linear_damping", "angular_damping"):
        if getattr(scene.bodies, key).any():
            yield ModelChange(f"no {key}", f"the scene can also be simulated without {key}", _set_to_zero(key))
    if world.has_damping:
        yield ModelChange("no damping", "the scene can also be simulated without damping", _remove_damping)
    if any(each.friction for each in (*scene.materials, *scene.pairs, *scene.body_sources, *scene.fixed)):
        yield ModelChange("no friction", "the scene can also be simulated without friction", _set_to_zero("friction"))


def _contact_pairs(contexts: Sequence[EvaluationContext]) -> IntArray | None:
    """Return the pairs in contact in any of the truths, (C, 2); None if a truth is not trusted to its end."""
    found = []
    for context in contexts:
        if context.truth is None or context.until < context.scene.world.duration:
            return None
        found.append(context.truth.trajectory.contact_pair)
    return np.concatenate(found)


def _set_collides(scene: Scene, value: str) -> SettingChange:
    def change(document: dict[str, Any]) -> None:
        for heading in scene.kinds:
            for element in document.get(heading, ()):
                if not element.get("fixed"):
                    element["collides"] = value

    return change


def _remove_drag(document: dict[str, Any]) -> None:
    for key in ("linear_drag", "quadratic_drag", "wind"):
        document["world"].pop(key, None)


def _remove_damping(document: dict[str, Any]) -> None:
    document["world"].pop("damping", None)


def _set_to_zero(key: str) -> SettingChange:
    """Return a change that sets a key of every element that has it to 0."""

    def change(document: dict[str, Any]) -> None:
        for elements in document.values():
            for element in elements if isinstance(elements, list) else ():
                if isinstance(element, dict) and key in element:
                    element[key] = 0.0

    return change
