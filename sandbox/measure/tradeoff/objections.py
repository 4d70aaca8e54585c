"""Objections: reasons not to recommend a setting although its error is within the tolerance.

An error is that of one start, up to the time until which the truth is trusted. So a setting is not recommended either
if its run missed contacts or pulled joints apart by more than the tolerance, if it needs more iterations or shorter
substeps than the formulas of `sandbox check` state, or if their odds exceed `MAX_ODDS`.

The formulas bound the speeds of bodies from above, often by far. Here a body is no faster than `SPEED_MARGIN` times the
fastest one of the measured run.
"""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.formatting import format_fraction, format_percent, format_plural, format_quantity
from sandbox.measure.compare.metrics import Metric
from sandbox.measure.preflight.checks import warnings
from sandbox.measure.preflight.diagnostic import Diagnostic
from sandbox.measure.preflight.tunnelling import ANOTHER, ANOTHER_BODY
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings

MAX_ODDS = 0.05
"""Largest odds of a missed contact or zone at which a setting is recommended."""
SPEED_MARGIN = 1.1
"""Factor by which a body may be faster from another start than in the measured run."""
MAX_JOINT_ERROR = 0.01
"""Largest error of a joint as a fraction of its length, if the tolerance is neither a length nor a fraction."""

SPEED_KINDS = frozenset({"tunnelling", "depth", "entry"})
"""Kinds of diagnostics that depend on the speed of a body."""
SETTING_KINDS = SPEED_KINDS | {"iterations", "kick_threshold", "mass_ratio", "stack", "spring", "orbit", "chain"}
"""Kinds of diagnostics that another setting can avoid; the others are properties of the scene."""


class ErrorLimits(NamedTuple):
    """Largest accepted error of a setting."""

    metric: Metric
    tolerance: float
    """in the unit of the metric"""
    zoom: float
    """px/m"""


def find_objections(
    scene: Scene,
    engine: str,
    settings: Settings,
    metrics: Mapping[str, float | None],
    fastest: FloatArray,
    limits: ErrorLimits,
) -> tuple[str, ...]:
    """Return the objections to a setting whose run reached the end of the scene.

    Args:
        scene: the scene.
        engine: name of the engine.
        settings: the setting.
        metrics: values of all metrics of the run.
        fastest: (N,) m/s, largest speed of each body in the run.
        limits: metric, tolerance and scale.
    """
    return (*_observed(metrics, limits), *_forecast(scene, engine, settings, fastest))


def _observed(metrics: Mapping[str, float | None], limits: ErrorLimits) -> Iterator[str]:
    """Yield what the run itself shows."""
    if missed := metrics.get("missed_contacts"):
        yield format_plural(round(missed), "missed contact")
    unit, tolerance = limits.metric.unit, limits.tolerance
    if unit in ("m", "px"):
        distance, limit = metrics.get("joint_distance"), tolerance if unit == "m" else tolerance / limits.zoom
        if distance is not None and distance > limit:
            yield f"a joint is off by {format_quantity(distance, 'm')}"
        return
    fraction, limit = metrics.get("joint_error"), tolerance if unit == "" and tolerance else MAX_JOINT_ERROR
    if fraction is not None and fraction > limit:
        yield f"a joint is off by {format_fraction(fraction)} of its length"


def _forecast(scene: Scene, engine: str, settings: Settings, fastest: FloatArray) -> Iterator[str]:
    """Yield the diagnostics of the formulas that another setting avoids, at the speeds of the run."""
    for each in warnings(scene, settings, engine):
        if each.kind not in SETTING_KINDS:
            continue
        if each.kind not in SPEED_KINDS:
            yield each.message
            continue
        exceeded = _exceeded(each, settings, fastest)
        if each.kind == "depth" and exceeded > 1.0:
            yield each.message
        elif (odds := 1.0 - 1.0 / max(exceeded, 1.0)) > MAX_ODDS:
            verb = "misses" if each.kind == "entry" else "tunnels through"
            yield f"odds up to {format_percent(odds)} that {each.details['ball']!r} {verb} {_name(each)}"


def _exceeded(found: Diagnostic, settings: Settings, fastest: FloatArray) -> float:
    """Return the factor by which a setting's dt exceeds the safe one, at a speed that bodies had in the run."""
    safe, predicted = float(found.details["safe_dt"]), float(found.details["speed"])
    speeds = np.sort(np.nan_to_num(fastest))[::-1]
    mutual = found.details["thing"] in (ANOTHER, ANOTHER_BODY)
    measured = SPEED_MARGIN * float(speeds[: 2 if mutual else 1].sum())
    return settings.dt / safe * min(measured / predicted, 1.0) if safe > 0.0 else 1.0


def _name(found: Diagnostic) -> str:
    thing = str(found.details["thing"])
    return thing if thing in (ANOTHER, ANOTHER_BODY) else repr(thing)
