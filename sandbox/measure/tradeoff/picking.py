"""Picking: the point that answers a question, and the nearest one where none does."""

from collections.abc import Callable, Sequence

from sandbox.measure.tradeoff.aim import Aim
from sandbox.measure.tradeoff.figure import figure
from sandbox.measure.tradeoff.point import Point
from sandbox.measure.tradeoff.weighed import Pick
from sandbox.scene.description.world import Settings

FRESH = 3
"""Seeds that a pick is run on again."""

LONGER = 1.01
"""So many times a frame a step may last, such as 0.0167 s at 60 a second, and nobody sees."""

NOISE = 1.5
"""Times of engines within this factor of the least count as equal, and counted work decides. The least of 5 repeats in
turns varied by 2 to 7 % in 8 measurements of 8 settings on a machine at a load of 5; the rest is room for more load."""

FAR = 4.0
"""Times the least of its engine: up to there counted work decides, which no noise changes; beyond, the time. Counted
works are within a factor of 2.5 of the time (`bounded_run.SECONDS`)."""

ALIKE = 1.05
"""Counted works within this factor of the least count as equal too, and the setting that changes less is taken: the
weights of the counters are no better than that."""

Again = Callable[[Point], float]
"""Runs a point with other seeds and returns the worst error, infinite where a run fails."""


def cheapest(points: Sequence[Point], aim: Aim, fresh: Sequence[int], again: Again) -> Pick | None:
    """Return the cheapest point within the tolerance that keeps to it with other seeds too; None where none does."""
    able = [p for p in _recommendable(points, aim) if p.error is not None and p.error <= aim.tolerance]
    for point in by_cost(able):
        error = again(point) if fresh else None
        if error is None or error <= aim.tolerance:
            return Pick(point, told(point, aim, error), tuple(fresh), error)
    return None


def by_cost(points: Sequence[Point]) -> list[Point]:
    """Return points from the cheapest on: of one engine by counted work, of several by time, where noise allows that.

    Points that were timed apart come first; the times of the others include keeping and auditing their frames.
    """
    timed = [p for p in points if p.repeats]
    engines = [_ordered([p for p in timed if p.engine == name]) for name in dict.fromkeys(p.engine for p in timed)]
    found = []
    while engines:
        least = min(own[0].cost or 0.0 for own in engines)
        close = [own for own in engines if (own[0].cost or 0.0) <= NOISE * least]
        found.append(min(close, key=lambda own: _counted(own[0])).pop(0))
        engines = [own for own in engines if own]
    return [*found, *sorted((p for p in points if not p.repeats), key=_counted)]


def _ordered(points: Sequence[Point]) -> list[Point]:
    """Return the points of one engine from the cheapest on."""
    timed = sorted(points, key=lambda each: each.cost or 0.0)
    near = [p for p in timed if (p.cost or 0.0) <= FAR * (timed[0].cost or 0.0)]
    return [*_by_work(near), *timed[len(near) :]]


def _by_work(points: Sequence[Point]) -> list[Point]:
    """Return points by counted work; first those that are alike in it, by what they change and their error."""
    ordered = sorted(points, key=_counted)
    alike = [p for p in ordered if _counted(p) <= ALIKE * _counted(ordered[0])]
    return [*sorted(alike, key=lambda p: (len(p.changes), p.error or 0.0)), *ordered[len(alike) :]]


def closest(points: Sequence[Point], aim: Aim, fresh: Sequence[int], again: Again) -> Pick | None:
    """Return the point of the least error whose every frame is within the budget, the cheapest of equals; or None."""
    if aim.budget is None:
        return None
    able = [p for p in _recommendable(points, aim) if p.frame(aim.fps) <= aim.budget]
    point = min(able, key=lambda each: (each.error or 0.0, _counted(each)), default=None)
    if point is None:
        return None
    error = again(point) if fresh else None
    return Pick(point, told(point, aim, error), tuple(fresh), error)


def nearest_to_tolerance(points: Sequence[Point], aim: Aim) -> Pick | None:
    """Return the point of the least error, of equals the one that changes least; None where no point has figures."""
    able = _recommendable(points, aim)
    point = min(able, key=lambda each: (each.error or 0.0, len(each.changes), _counted(each)), default=None)
    return None if point is None else Pick(point, told(point, aim, None), (), None)


def nearest_to_budget(points: Sequence[Point], aim: Aim) -> Pick | None:
    """Return the point whose dearest frame takes the least time; None where no point has both figures."""
    point = min(_recommendable(points, aim), key=lambda each: each.frame(aim.fps), default=None)
    if point is None:
        return None
    return Pick(point, told(point, aim, None), (), None)


def _recommendable(points: Sequence[Point], aim: Aim) -> list[Point]:
    return [p for p in points if p.usable and p.settings.dt <= aim.step]


def _counted(point: Point) -> float:
    return point.counted or 0.0


def told(point: Point, aim: Aim, fresh: float | None) -> str:
    """Describe a setting: engine and changes, error, cost per simulated second and per frame.

    Example: `pymunk with dt = 0.01, substeps = 4: max_position 310 µm, 12 ms per simulated second (1.2 % of real time),
    0.2 ms per frame of the budget of 4 ms`.
    """
    assert point.error is not None and point.cost is not None
    unit = aim.metric.unit
    off = f"{aim.metric.name} {figure(point.error, unit)}"
    if aim.metric.name == "passes" and point.error > 0.0:
        off += f", 1 in {1.0 / point.error:.3g} contacts missed"
    again = "" if fresh is None else f", {figure(fresh, unit)} with other seeds"
    share = point.cost / 10.0
    long = point.settings.dt > LONGER / aim.fps
    steps = f"; a step is longer than a frame at {aim.fps:g} fps: interpolate for drawing" if long else ""
    cost = f"{point.cost:.3g} ms per simulated second ({share:.2g} % of real time), {_frame_time(point, aim)}"
    return f"{called(point)}: {off}{again}, {cost}{steps}"


def _frame_time(point: Point, aim: Aim) -> str:
    """Return the time of the most expensive frame, compared with the budget if there is one."""
    time = f"{point.frame(aim.fps):.3g} ms per frame"
    if aim.budget is None:
        return f"{time} at {aim.fps:g} fps"
    return f"{time}{' of' if point.frame(aim.fps) <= aim.budget else ', more than'} the budget of {aim.budget:g} ms"


def called(point: Point) -> str:
    """Name an engine and what its settings change: `reference with integrator = rk4`."""
    changes = ", ".join(f"{key} = {shown(value)}" for key, value in point.changes.items() if value is not None)
    dropped = ", ".join(key for key, value in point.changes.items() if value is None)
    parts = [f"{word} {what}" for word, what in (("with", changes), ("without", dropped)) if what]
    return " ".join([point.engine, *parts]) if parts else f"{point.engine} with the settings of the scene"


def shown(value: object) -> str:
    """Write a setting's value as a scene file has it, with no more than 6 digits."""
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def pymunk_lines(settings: Settings) -> list[str]:
    """Return the lines of Python that give a `pymunk.Space` the settings of the pymunk engine, all choices filled in.

    They leave out what the engine does to bodies and shapes, such as drag and moments of inertia.
    """
    lines = [
        f"space.iterations = {settings.iterations}",
        f"space.collision_slop = {settings.slop!r}",
        f"space.collision_bias = {settings.bias!r}",
        f"space.collision_persistence = {settings.persistence}",
    ]
    if settings.half_kick:
        half = f"{settings.dt!r} / {2 * settings.substeps}"
        lines.append(f"body.velocity += space.gravity * {half}  # every dynamic body, once before the first step")
    if settings.substeps == 1:
        return [*lines, f"space.step({settings.dt!r})"]
    return [*lines, f"for _ in range({settings.substeps}):", f"    space.step({settings.dt!r} / {settings.substeps})"]
