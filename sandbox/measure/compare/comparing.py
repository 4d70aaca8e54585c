"""Comparing: one scene on several engines, each run, timed and scored."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from sandbox.engines.registry import ENGINES, engine_named
from sandbox.measure.compare.alignment import aligned
from sandbox.measure.compare.comparison import Comparison, Row
from sandbox.measure.compare.drift import energy_drift, momentum_drift
from sandbox.measure.compare.errors import Score, errors, usual_tolerance
from sandbox.measure.compare.truth import Truth, seek_truth
from sandbox.measure.compare.why import turned, verdict
from sandbox.measure.recorder import require_memory
from sandbox.measure.run import run
from sandbox.measure.told import Told, nobody
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings
from sandbox.trajectory import Trajectory

WORTH_REPEATING = 5.0
"""s: a run no longer than this is timed a second time, as the first may have read compiled code from disk."""
NEGLIGIBLE = 1e-6
"""The share of the tolerance below which an error needs no explanation."""


def compare(
    scene: Scene,
    engines: Sequence[str] | None = None,
    *,
    tolerance: float | None = None,
    why: bool = False,
    truth: Truth | None = None,
    told: Told | None = None,
    **settings: Any,
) -> Comparison:
    """Run a scene on several engines and hold each against the best known truth.

    The truth is the scene's closed form, else `exact`, else a fixed step refined until it agrees with itself, as far
    as a second method confirms it. Errors, contacts and divergence count up to `trusted_until`, drifts of energy and
    momentum over the whole run.

    Args:
        scene: what to run.
        engines: their names; by default all there are. One that cannot run the scene is a row that says why.
        tolerance: of positions, m: beyond it a run has diverged from the truth. By default 1 % of the radius of
            the smallest ball that moves, or of the half width of what is thinner.
        why: rerun each engine that is off with other settings (`why`), and say which lower the error.
        truth: of this scene, its frames and the tolerance, where it is known already.
        told: who is told what is being done.
        settings: changes to the scene's `[solver]`, such as `dt=0.001`.

    Raises:
        UnknownEngineError: no engine has one of the names.
        TooLargeError: the frames of all runs would not fit into memory together.
        ValueError: the tolerance is not positive and finite.
        pydantic.ValidationError: a setting is wrong.
    """
    names = list(dict.fromkeys(ENGINES if engines is None else engines))
    for name in names:
        engine_named(name)
    wanted = scene.solver.replace(**settings) if settings else scene.solver
    tolerance = usual_tolerance(scene) if tolerance is None else tolerance
    if not 0.0 < tolerance < math.inf:
        raise ValueError(f"a tolerance of {tolerance} m; it is positive and finite")
    # All runs are held at once: the engines', the truth, and while it is sought, two more.
    require_memory(scene, wanted, len(scene.bodies) * (len(names) + 3))

    say, doubt = told or nobody, None
    if truth is None:
        say("the truth")
        sought = seek_truth(scene, wanted, tolerance)
        truth, doubt = (sought, None) if isinstance(sought, Truth) else (None, sought)
    rows, runs = [], {}
    for name in names:
        say(name)
        found = timed(scene, name, wanted)
        row = judged(scene, name, wanted, found, truth, tolerance)
        if why and truth is not None and _is_off(row, tolerance):
            say(f"{name}: why")
            row = _explained(scene, row, wanted, truth)
        rows.append(row)
        if len(found.time):
            runs[name] = found
    return Comparison(scene, truth, tolerance, tuple(rows), runs, doubt)


def timed(scene: Scene, engine: str, settings: Settings) -> Trajectory:
    """Run an engine; a short run twice, and its shorter time counts: the first may have read compiled code."""
    first = run(scene, engine, audit=False, **settings.model_dump())
    if first.status == "refused" or first.info["seconds"] > WORTH_REPEATING:
        return first
    second = run(scene, engine, audit=False, **settings.model_dump())
    return min(first, second, key=lambda each: float(each.info["seconds"]))


def judged(
    scene: Scene, engine: str, settings: Settings, found: Trajectory, truth: Truth | None, tolerance: float
) -> Row:
    """Score a run against the truth; without one, only by what is conserved."""
    seconds = None if found.status == "refused" else float(found.info["seconds"])
    told = engine, found.status, found.reason, found.info["settings"]
    nothing = Score(None, None, None, None)
    if found.status == "refused":
        return Row(*told, nothing, None, None, None, None, None, seconds)
    if truth is None:  # what is conserved needs none
        drift = energy_drift(found, scene, None, False)
        return Row(*told, nothing, *drift, momentum_drift(found, scene), None, None, seconds)
    until, whole = truth.trusted_until, truth.trusted_until == scene.world.duration
    off = errors(found, truth.trajectory, ~scene.bodies.fixed)
    first = off.first_above(tolerance, until)
    if first is None and found.status == "diverged" and found.time[-1] <= until:
        first = float(found.time[-1])
    energy = energy_drift(found, scene, truth.trajectory, whole)
    return Row(
        *told,
        score=off.until(until),
        energy_drift=energy.share,
        energy_against=energy.against,
        momentum_drift=momentum_drift(found, scene),
        first_divergence=first,
        events=aligned(found, truth.trajectory, scene, settings.dt, tolerance, min(until, float(found.time[-1]))),
        seconds=seconds,
    )


def _is_off(row: Row, tolerance: float) -> bool:
    error = row.score.max_position
    return error is not None and error > NEGLIGIBLE * tolerance and bool(np.isfinite(error))


def _explained(scene: Scene, row: Row, settings: Settings, truth: Truth) -> Row:
    before = row.score.max_position
    assert before is not None
    tried = turned(scene, row.engine, settings, truth.trajectory, truth.trusted_until, before)
    return replace(row, why=tried, verdict=verdict(row.engine, tried, before))
