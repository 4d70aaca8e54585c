"""Proposals: cheaper models of the same scene, each run and measured before it is told of.

A formula needs no engine; an exact engine needs no step; and a scene that demands less physics costs less, if what is
left out has changed nothing that anybody would see.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from time import perf_counter
from typing import Any

from sandbox.engines.registry import ENGINES
from sandbox.measure.compare.closed import solved
from sandbox.measure.compare.patience import TookTooLongError, patient_run
from sandbox.measure.tradeoff.cost import Cost, costs, seconds_of
from sandbox.measure.tradeoff.judge import Judge
from sandbox.measure.tradeoff.metrics import METRICS
from sandbox.scene.document import to_document
from sandbox.scene.faults import SceneError
from sandbox.scene.file import from_document
from sandbox.scene.meetings import meetings
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings

CHEAPER = 0.9
"""What a proposal may cost at most, as a share of what it stands in for: less is within the noise."""

Simplification = tuple[str, Callable[[dict[str, Any]], None]]


@dataclass(frozen=True)
class Proposal:
    """A cheaper model that keeps to the tolerance."""

    what: str
    engine: str | None
    """None for a formula"""
    error: float
    """by the metric asked for, against the truth of the scene as it is"""
    cost: float
    """ms per simulated second"""
    ratio: float
    """of that to the setting it would stand in for, timed in turns"""
    sentence: str

    def document(self) -> dict[str, Any]:
        """Return it as a JSON object."""
        own = {"what": self.what, "engine": self.engine, "error": self.error}
        return {**own, "cost_ms_per_second": self.cost, "ratio": self.ratio, "sentence": self.sentence}


def proposals(
    judge: Judge, metric: str, tolerance: float, engine: str, settings: Settings, patience: float, repeats: int = 3
) -> list[Proposal]:
    """Return the cheaper models that stay within the tolerance, the cheapest first.

    Args:
        judge: gives scene and truth.
        metric: what the error is counted in.
        tolerance: in its unit.
        engine: whose setting they would stand in for.
        settings: these, choices left to the engine still open.
        patience: s that one run may take.
        repeats: how often each is timed.
    """
    found = [*_formula(judge, metric, tolerance, engine, settings, repeats)]
    for what, scene in _simpler(judge):
        error = _error(judge, metric, scene, engine, settings, patience)
        if error is None or error > tolerance:
            continue
        own, its = _timed(judge.scene, scene, engine, settings, repeats)
        if own is not None and its is not None and its.least <= CHEAPER * own.least:
            found.append(_proposal(what, engine, error, its.least, its.least / own.least, metric))
    return sorted(found, key=lambda each: each.ratio)


def _formula(
    judge: Judge, metric: str, tolerance: float, engine: str, settings: Settings, repeats: int
) -> Iterator[Proposal]:
    """Propose the closed form, where the scene has one for all of it."""
    scene = judge.scene
    if judge.truth is None or judge.truth.kind != "closed_form":
        return
    took = []
    for _ in range(repeats):
        began = perf_counter()
        form = solved(scene, settings)
        took.append(perf_counter() - began)
    own = [seconds_of(scene, engine, settings) for _ in range(repeats)]
    if form is None or None in own:
        return
    error = METRICS[metric].measure(form, judge)
    if error is not None and error <= tolerance:
        least, base = min(took), min(each for each in own if each is not None)
        if least <= CHEAPER * base:
            what = "no engine: the scene has a closed form"
            yield _proposal(what, None, error, 1e3 * least / scene.world.duration, least / base, metric)


def _error(judge: Judge, metric: str, scene: Scene, engine: str, settings: Settings, patience: float) -> float | None:
    if ENGINES[engine].missing(scene, settings):
        return None
    try:
        run = patient_run(scene, engine, settings, patience, audit=True)
    except TookTooLongError:
        return None
    return METRICS[metric].measure(run, judge) if run.status == "ok" else None


def _timed(
    scene: Scene, other: Scene, engine: str, settings: Settings, repeats: int
) -> tuple[Cost | None, Cost | None]:
    """Time two scenes in turns."""
    pairs = [
        (costs(scene, [(engine, settings)], 1, 0.0)[0], costs(other, [(engine, settings)], 1, 0.0)[0])
        for _ in range(repeats)
    ]
    sides = []
    for side in zip(*pairs, strict=True):
        took = [each.least for each in side if each is not None]
        sides.append(Cost(min(took), sorted(took)[len(took) // 2], len(took)) if len(took) == repeats else None)
    return sides[0], sides[1]


def _simpler(judge: Judge) -> Iterator[tuple[str, Scene]]:
    """Yield scenes that demand less, and what was left out; none that lays its bodies out otherwise."""
    scene = judge.scene
    for what, change in _simplifications(judge):
        document = to_document(scene)
        change(document)
        try:
            simpler = from_document(document)
        except SceneError:
            continue
        if simpler.bodies.position.tobytes() == scene.bodies.position.tobytes():
            yield what, simpler


def _simplifications(judge: Judge) -> Iterator[Simplification]:
    scene, world = judge.scene, judge.scene.world
    meet = meetings(scene)
    met = judge.truth.trajectory.contact_pair if judge.truth is not None and judge.until == world.duration else None
    if met is not None and meet.touches.any():
        if not len(met):
            yield 'nothing meets anything: collides = "none" for all that moves', _collides(scene, "none")
        elif meet.mutual and not (met >= 0).all(axis=1).any():
            yield 'no two bodies meet: collides = "fixed" for all that moves', _collides(scene, "fixed")
    if world.linear_drag or world.quadratic_drag:
        yield "no drag", _without_drag
    if any(each.friction for each in (*scene.materials, *scene.pairs, *scene.movers, *scene.fixed)):
        yield "no friction", _without_friction


def _collides(scene: Scene, word: str) -> Callable[[dict[str, Any]], None]:
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


def _proposal(what: str, engine: str | None, error: float, cost: float, ratio: float, metric: str) -> Proposal:
    unit = METRICS[metric].unit
    size = f"{error:.2g} {unit}".strip()
    sentence = f"{what}: {size} off, at {ratio:.2g} of the cost ({cost:.3g} ms a simulated second)"
    return Proposal(what, engine, error, cost, ratio, sentence)
