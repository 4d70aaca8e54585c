"""Comparing: run one scene on several engines, or with several values, and time and score each run."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from sandbox.engines.registry import ENGINES, USUAL, able, engine_named
from sandbox.interrupt import uninterrupted
from sandbox.measure.compare.alignment import aligned
from sandbox.measure.compare.comparison import Comparison, Row
from sandbox.measure.compare.drift import energy_drift, momentum_drift
from sandbox.measure.compare.errors import Score, errors, usual_tolerance
from sandbox.measure.compare.sweep import (
    Sweep,
    Variant,
    physics_of,
    set_text,
    short_key,
    truth_settings,
    variants_of,
)
from sandbox.measure.compare.truth import Truth, seek_truth
from sandbox.measure.compare.why import turned, verdict
from sandbox.measure.recorder import require_memory
from sandbox.measure.run import run
from sandbox.measure.told import Told, nobody
from sandbox.scene.description.world import Settings
from sandbox.scene.files.load import as_scene
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

WORTH_REPEATING = 5.0
"""s: a run no longer than this is timed a second time, as the first may have read compiled code from disk."""
NEGLIGIBLE = 1e-6
"""The share of the tolerance below which an error needs no explanation."""


def compare(
    scene: Scene | str | Path,
    engines: Sequence[str] | None = None,
    *,
    sweep: Sweep | None = None,
    tolerance: float | None = None,
    why: bool = False,
    truth: Truth | None = None,
    told: Told | None = None,
    **settings: Any,
) -> Comparison:
    """Run a scene on several engines, or with several values of a setting, and score each run against the truth.

    The truth is the closed form of the scene, if it has one. Otherwise it is `exact`, or a fixed step refined until it
    converges, up to the time to which a second method confirms it. Errors, contacts and divergence are measured up to
    `trusted_until`, drifts of energy and momentum over the whole run.

        sandbox.compare(scene, sweep={"solver.integrator": ["explicit_euler", "velocity_verlet", "rk4"]})

    Args:
        scene: the scene, or its name or path, as `load` takes it.
        engines: names of the engines, or one name; default: all. An engine that cannot run the scene gets a
            row with the reason. With a sweep, the default is the engines that can run every value.
        sweep: values by key, such as `{"solver.dt": [0.01, 0.001]}`. Each value is a row; several keys give each
            combination of their values.
        tolerance: position error beyond which a run has diverged from the truth, m; default: 1 % of the smallest radius
            or half width of the moving bodies.
        why: rerun each engine whose error is not negligible with other settings, and report the changes that lower the
            error.
        truth: truth of this scene, with its frames and the tolerance, if already known; not with a sweep.
        told: progress callback, called with a description of each stage.
        settings: changes to the scene's `[solver]`, such as `dt=0.001`.

    Returns:
        One row for each engine and combination of values; after Ctrl-C the finished rows, if there are any.

    Raises:
        UnknownEngineError: no engine has one of the names.
        TooLargeError: the frames of all runs would not fit into memory together.
        ValueError: the tolerance is not positive and finite; or a sweep is empty, too large, or has a key that
            `settings` sets too.
        SceneError: a swept key or value is invalid.
        pydantic.ValidationError: a setting is invalid.
    """
    scene = as_scene(scene)
    both = [key for key in sweep or () if short_key(key) in settings]
    if both:
        raise ValueError(f"{', '.join(both)}: is swept and set; leave one out")
    if sweep and truth is not None:
        raise ValueError("truth: is of one scene and one set of frames; leave it out with a sweep")
    wanted = scene.solver.replace(**settings) if settings else scene.solver
    scene_as_set = scene.model_copy(update={"solver": wanted}) if settings and sweep else scene
    variants = variants_of(scene_as_set, sweep) if sweep else [Variant(scene)]
    return compare_variants(
        variants, engines, tolerance=tolerance, why=why, truth=truth, told=told, **({} if sweep else settings)
    )


def compare_variants(
    variants: Sequence[Variant],
    engines: Sequence[str] | None = None,
    *,
    tolerance: float | None = None,
    why: bool = False,
    truth: Truth | None = None,
    told: Told | None = None,
    **settings: Any,
) -> Comparison:
    """Run the variants of a scene on engines, and score each run against the truth of its variant.

    Args:
        variants: at least one variant; if there are several, `set` of each has its swept values.
        engines: names of the engines; defaults as in `compare`.
        tolerance: tolerance of positions, m.
        why: explain the errors.
        truth: truth of the first variant.
        told: progress callback, called with a description of each stage.
        settings: changes to `[solver]`.

    Raises:
        UnknownEngineError: no engine has one of the names.
        TooLargeError: the frames of all runs would not fit into memory together.
        ValueError: the tolerance is not positive and finite.
        pydantic.ValidationError: a setting is invalid.
    """
    engines = [engines] if isinstance(engines, str) else engines
    for name in engines or ():
        engine_named(name)
    first = variants[0].scene
    wanted = [each.scene.solver.replace(**settings) if settings else each.scene.solver for each in variants]
    plan = list(zip(variants, wanted, _engines_of(variants, wanted, engines), strict=True))
    if tolerance is None:
        tolerance = min(usual_tolerance(each.scene) for each in variants)
    if not 0.0 < tolerance < math.inf:
        raise ValueError(f"a tolerance of {tolerance} m; it must be positive and finite")
    count = sum(len(names) for _, _, names in plan)
    for variant, own, _ in plan:
        # All runs are held at once: the engines', the truths, and while one is sought, two more.
        require_memory(variant.scene, own, len(variant.scene.bodies) * (count + len(variants) + 2))

    say = told or nobody
    truths: dict[tuple[str, float, int], Truth | str] = {}
    if truth is not None:
        truths[_frames_of(first, wanted[0])] = truth
    rows, runs, row_truths, interrupted = list[Row](), dict[str, Trajectory](), dict[str, Truth | None](), False
    try:
        for variant, own, names in plan:
            key = _frames_of(variant.scene, own)
            if key not in truths:
                say("the truth")
                truths[key] = seek_truth(variant.scene, truth_settings(own, wanted), tolerance)
            sought = truths[key]
            best = sought if isinstance(sought, Truth) else None
            for name in names:
                say(", ".join(filter(None, (name, set_text(variant.set)))))
                found = timed(variant.scene, name, own)
                row = replace(judged(variant.scene, name, own, found, best, tolerance), set=variant.set)
                if why and best is not None and _is_off(row, tolerance):
                    say(f"{row.name}: why")
                    row = _explained(variant.scene, row, own, best)
                with uninterrupted():
                    rows.append(row)
                    row_truths[row.name] = best
                    if len(found.time):
                        runs[row.name] = found
    except KeyboardInterrupt:
        if not rows:
            raise
        interrupted = len(rows) < count
    answer = truths[_frames_of(first, wanted[0])]
    best, doubt = (answer, None) if isinstance(answer, Truth) else (None, answer)
    return Comparison(
        first,
        best,
        tolerance,
        tuple(rows),
        runs,
        doubt,
        interrupted,
        truths=row_truths,
        same_scene=len(variants) == 1 or len({physics_of(each.scene) for each in variants}) == 1,
    )


def _engines_of(
    variants: Sequence[Variant], wanted: Sequence[Settings], engines: Sequence[str] | None
) -> list[list[str]]:
    """Return the engines that run each variant.

    Those that are named; else, of a sweep, those that can run every variant, or where none can, those that can run
    the one; else all.
    """
    if engines is not None:
        return [list(dict.fromkeys(engines))] * len(variants)
    if not variants[0].set:
        return [list(ENGINES)] * len(variants)
    each = [able(variant.scene, own) for variant, own in zip(variants, wanted, strict=True)]
    common = [name for name in ENGINES if all(name in names for names in each)]
    return [common or list(names) or [USUAL] for names in each]


def _frames_of(scene: Scene, settings: Settings) -> tuple[str, float, int]:
    """Return what a truth depends on: the scene, and the times of its frames."""
    return physics_of(scene), settings.dt, settings.record_every


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
