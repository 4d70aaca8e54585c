"""Proposals: cheaper models of the same scene, each run and measured before it is told of.

A formula needs no engine; an exact engine needs no step; and a scene that demands less physics costs less, if what is
left out has changed nothing that anybody would see.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from sandbox.arrays import IntArray
from sandbox.engines.registry import ENGINES
from sandbox.measure.bounded_run import TookTooLongError, bounded_run, working
from sandbox.measure.compare.closed import solved
from sandbox.measure.tradeoff.cost import seconds_of, warm_up
from sandbox.measure.tradeoff.figure import figure
from sandbox.measure.tradeoff.judge import Judge
from sandbox.measure.tradeoff.metrics import METRICS
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.description.world import Settings
from sandbox.scene.errors import SceneError
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import from_document
from sandbox.scene.scene import Scene

CHEAPER = 0.9
"""What a proposal may cost at most, as a share of what it stands in for: less is within the noise."""

Change = Callable[[dict[str, Any]], None]


class Simplification(NamedTuple):
    """Part of the physics that may be left out."""

    what: str
    """short description of the simpler model"""
    advice: str
    """the same as a clause"""
    change: Change
    """removes it from the document of a scene"""


@dataclass(frozen=True)
class Proposal:
    """Cheaper model of a scene whose error is within the tolerance."""

    what: str
    """description of the model"""
    engine: str | None
    """name of the engine; None for a formula"""
    error: float
    """value of the chosen metric against the truth of the unchanged scene"""
    cost: float
    """ms per simulated second"""
    ratio: float
    """cost / cost of the setting that it replaces, timed in turns"""
    sentence: str

    def document(self) -> dict[str, Any]:
        """Return the proposal as a JSON object."""
        own = {"what": self.what, "engine": self.engine, "error": self.error}
        return {**own, "cost_ms_per_second": self.cost, "ratio": self.ratio, "sentence": self.sentence}


def proposals(
    judges: Sequence[Judge],
    metric: str,
    tolerance: float,
    engine: str,
    settings: Settings,
    limit: float,
    deadline: float = math.inf,
    repeats: int = 3,
) -> list[Proposal]:
    """Return the cheaper models that stay within the tolerance, the cheapest first.

    Args:
        judges: of the scene, and of the same with other seeds: a model has to do well on all.
        metric: what the error is counted in.
        tolerance: in its unit.
        engine: whose setting they would stand in for.
        settings: these, choices left to the engine still open.
        limit: counted cost that one run may have, s.
        deadline: by the clock of `working`, s.
        repeats: how often each is timed.
    """
    found = [*_formula(judges, metric, tolerance, engine, settings, repeats)]
    for what, advice, change in _simplifications(judges):
        error, simpler = 0.0, None
        for judge in judges:
            changed = _changed(judge.scene, change)
            off = None if changed is None else _error(judge, metric, changed, engine, settings, limit, deadline)
            error = max(error, math.inf if off is None else off)
            if not error <= tolerance:
                break
            simpler = simpler or changed
        if simpler is not None and error <= tolerance:
            own, its = _timed(judges[0].scene, simpler, engine, settings, repeats)
            if own is not None and its is not None and its <= CHEAPER * own:
                found.append(_proposal(what, advice, engine, error, its, own, judges[0].scene, metric))
    return sorted(found, key=lambda each: each.ratio)


def _formula(
    judges: Sequence[Judge],
    metric: str,
    tolerance: float,
    engine: str,
    settings: Settings,
    repeats: int,
) -> Iterator[Proposal]:
    """Propose the closed form, where the scene has one for all of it."""
    if any(judge.truth is None or judge.truth.kind != "closed_form" for judge in judges):
        return
    scene, took, forms = judges[0].scene, [], [solved(judge.scene, settings) for judge in judges]
    errors = [None if f is None else METRICS[metric].measure(f, j) for f, j in zip(forms, judges, strict=True)]
    worst = max(math.inf if each is None or math.isnan(each) else each for each in errors)
    own, _ = _timed(scene, None, engine, settings, repeats)
    if worst > tolerance or own is None:
        return
    for _ in range(repeats):
        began = working()
        solved(scene, settings)
        took.append(working() - began)
    if min(took) <= CHEAPER * own:
        what = "no simulation: the scene has a closed-form solution"
        advice = (
            "as long as no input changes the motion, it can also be computed from a formula, without an engine (the "
            "scene has a closed-form solution)"
        )
        yield _proposal(what, advice, None, worst, min(took), own, scene, metric)


def _error(
    judge: Judge, metric: str, scene: Scene, engine: str, settings: Settings, limit: float, deadline: float
) -> float | None:
    if ENGINES[engine].missing(scene, settings):
        return None
    try:
        run, _ = bounded_run(scene, engine, settings, limit, deadline)
    except TookTooLongError:
        return None
    return METRICS[metric].measure(run, judge) if run.status == "ok" else None


def _timed(
    scene: Scene, other: Scene | None, engine: str, settings: Settings, repeats: int
) -> tuple[float | None, float | None]:
    """Return the least time that each of two scenes takes in turns, s; None where one does not get to its end."""
    both = [each for each in (scene, other) if each is not None]
    taken: list[list[float]] = [[] for _ in both]
    for each in both:
        warm_up(each, engine, settings)
    for _ in range(repeats):
        for each, times in zip(both, taken, strict=True):
            seconds = seconds_of(each, engine, settings)
            if seconds is None:
                return None, None
            times.append(seconds)
    return min(taken[0]), min(taken[-1]) if other is not None else None


def _changed(scene: Scene, change: Change) -> Scene | None:
    """Return a scene that demands less; None where that is no sound scene, or lays its bodies out otherwise."""
    document = to_document(scene)
    change(document)
    try:
        simpler = from_document(document)
    except SceneError:
        return None
    return simpler if simpler.bodies.position.tobytes() == scene.bodies.position.tobytes() else None


def _simplifications(judges: Sequence[Judge]) -> Iterator[Simplification]:
    """Yield what could be left out, by what the truths of all seeds and the scene say."""
    scene = judges[0].scene
    world, meet = scene.world, contact_matrix(scene)
    met = _met(judges)
    if met is not None and meet.touches.any():
        if not len(met):
            yield Simplification(
                'no collisions occur: collides = "none" for all moving bodies',
                'the scene can also be simulated without collisions (collides = "none" for all moving bodies), '
                "because none occur",
                _collides(scene, "none"),
            )
        elif meet.mutual and not (met >= 0).all(axis=1).any():
            yield Simplification(
                'no two bodies collide: collides = "fixed" for all moving bodies',
                'the scene can also be simulated without collisions between bodies (collides = "fixed" for all moving '
                "bodies), because none occur",
                _collides(scene, "fixed"),
            )
    if world.linear_drag or world.quadratic_drag:
        yield Simplification("no drag", "the scene can also be simulated without drag", _without_drag)
    if any(each.friction for each in (*scene.materials, *scene.pairs, *scene.body_sources, *scene.fixed)):
        yield Simplification("no friction", "the scene can also be simulated without friction", _without_friction)


def _met(judges: Sequence[Judge]) -> IntArray | None:
    """Return the pairs that meet in any of the truths, (C, 2); None where one is not trusted to its end."""
    found = []
    for judge in judges:
        if judge.truth is None or judge.until < judge.scene.world.duration:
            return None
        found.append(judge.truth.trajectory.contact_pair)
    return np.concatenate(found)


def _collides(scene: Scene, word: str) -> Change:
    def change(document: dict[str, Any]) -> None:
        for heading in scene.kinds:
            for element in document.get(heading, ()):
                if not element.get("fixed"):
                    element["collides"] = word

    return change


def _without_drag(document: dict[str, Any]) -> None:
    for key in ("linear_drag", "quadratic_drag", "wind"):
        document["world"].pop(key, None)


def _without_friction(document: dict[str, Any]) -> None:
    for elements in document.values():
        for element in elements if isinstance(elements, list) else ():
            if isinstance(element, dict) and "friction" in element:
                element["friction"] = 0.0


def _proposal(
    what: str, advice: str, engine: str | None, error: float, took: float, instead: float, scene: Scene, metric: str
) -> Proposal:
    cost, ratio = 1e3 * took / scene.world.duration, took / instead
    sentence = (
        f"{advice}: {metric} {figure(error, METRICS[metric].unit)}, {cost:.3g} ms per simulated second,"
        f" {ratio:.2g} times the cost of simulating the scene as it is"
    )
    return Proposal(what, engine, error, cost, ratio, sentence)
