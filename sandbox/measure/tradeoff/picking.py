"""Picking: the point that answers a question, held to its word on seeds that it was not chosen by."""

from collections.abc import Callable, Sequence

from sandbox.measure.tradeoff.aim import Aim
from sandbox.measure.tradeoff.figure import figure
from sandbox.measure.tradeoff.point import Point
from sandbox.measure.tradeoff.weighed import Pick

FRESH = 3
"""Seeds that a pick is run on again."""

LONGER = 1.01
"""So many times a frame a step may last, such as 0.0167 s at 60 a second, and nobody sees."""

Again = Callable[[Point], float]
"""Runs a point on fresh seeds and returns the worst error, infinite where a run fails."""


def cheapest(points: Sequence[Point], aim: Aim, fresh: Sequence[int], again: Again) -> Pick | None:
    """Return the cheapest point within the tolerance that keeps to it on fresh seeds too; None where none does."""
    able = [p for p in points if p.usable and p.settings.dt <= aim.step]
    able = [p for p in able if p.error is not None and p.error <= aim.tolerance]
    for point in sorted(able, key=lambda each: each.cost or 0.0):
        error = again(point) if fresh else None
        if error is None or error <= aim.tolerance:
            return Pick(point, told(point, aim, error), tuple(fresh), error)
    return None


def closest(points: Sequence[Point], aim: Aim, fresh: Sequence[int], again: Again) -> Pick | None:
    """Return the point of the least error whose every frame is within the budget, the cheapest of equals; or None."""
    if aim.budget is None:
        return None
    able = [p for p in points if p.usable and p.settings.dt <= aim.step and p.frame(aim.fps) <= aim.budget]
    point = min(able, key=lambda each: (each.error or 0.0, each.cost or 0.0), default=None)
    if point is None:
        return None
    error = again(point) if fresh else None
    return Pick(point, told(point, aim, error), tuple(fresh), error)


def told(point: Point, aim: Aim, fresh: float | None) -> str:
    """Say what a point is and what it gives: `pymunk with dt = 0.01, substeps = 4: 0.31 mm off at 2.1 ms …`."""
    assert point.error is not None and point.cost is not None
    unit = aim.metric.unit
    off = f"{aim.metric.name} {figure(point.error, unit)}"
    if aim.metric.name == "passes" and point.error > 0.0:
        off += f", 1 in {1.0 / point.error:.3g} passes unseen"
    again = "" if fresh is None else f", {figure(fresh, unit)} on fresh seeds"
    share = point.cost / 10.0
    long = point.settings.dt > LONGER / aim.fps
    steps = f"; a step lasts longer than a frame at {aim.fps:g} a second: draw in between" if long else ""
    return f"{called(point)}: {off}{again}, {point.cost:.3g} ms a simulated second ({share:.2g} % of real time){steps}"


def called(point: Point) -> str:
    """Name an engine and what its settings change: `reference with integrator = rk4`."""
    changes = ", ".join(f"{key} = {shown(value)}" for key, value in point.changes.items() if value is not None)
    dropped = ", ".join(key for key, value in point.changes.items() if value is None)
    parts = [f"{word} {what}" for word, what in (("with", changes), ("without", dropped)) if what]
    return " ".join([point.engine, *parts]) if parts else f"{point.engine} as the scene has it"


def shown(value: object) -> str:
    """Write a setting's value as a scene file has it, with no more than 6 digits."""
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.6g}" if isinstance(value, float) else str(value)
