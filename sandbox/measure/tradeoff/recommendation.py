"""Recommendation: the evaluation that satisfies an objective, or the nearest one if none does."""

from collections.abc import Callable, Sequence

from sandbox.engines.pymunk_adapter.engine import is_space_default, space_attributes
from sandbox.formatting import format_quantity
from sandbox.measure.fresh_starts import FreshStarts
from sandbox.measure.tradeoff.configuration import Evaluation
from sandbox.measure.tradeoff.objective import Objective
from sandbox.measure.tradeoff.result import Recommendation
from sandbox.scene.description.world import Settings

FRAME_TOLERANCE = 1.01
"""A step may be this many times longer than a frame, such as 0.0167 s at 60 fps."""

NOISE_FACTOR = 1.5
"""Times within this factor count as equal, and counted work, which has no noise, decides. The minimum of 5 repeats in
turns varied by 2 to 7 % in 8 measurements of 8 settings on a machine at a load of 5; the rest allows for more load."""

EQUAL_WORK_FACTOR = 1.05
"""Counted works within this factor of the least count as equal, and the setting with fewer changes is taken: the
weights of the counters are no more accurate than that."""

Screen = Callable[[Evaluation], bool]
"""Runs a configuration from other starts, and returns whether enough of them are within the tolerance."""
Confirm = Callable[[Evaluation], FreshStarts | None]
"""Runs a configuration from other starts; None if there are none."""


def recommend_cheapest(
    points: Sequence[Evaluation], objective: Objective, screen: Screen, confirm: Confirm
) -> Recommendation | None:
    """Return the cheapest evaluation that is within the tolerance also from other starts; None if there is none.

    Evaluations with objections are left out.

    Args:
        points: the evaluations.
        objective: metric, tolerance and budget.
        screen: returns whether a configuration is within the tolerance in enough of the starts that decide.
        confirm: returns its errors from starts that did not decide.
    """
    candidates = [p for p in _eligible(points, objective) if p.error is not None and p.meets(objective.max_error)]
    for point in by_cost(candidates):
        if screen(point):
            found = confirm(point)
            return Recommendation(point, describe(point, objective, found), found)
    return None


def recommend_most_accurate(
    points: Sequence[Evaluation], objective: Objective, screen: Screen, confirm: Confirm
) -> Recommendation | None:
    """Return the evaluation with the smallest error, without objections, whose frames are within the budget, or None.

    Of equal errors it is the one with the least counted work.

    Args:
        points: the evaluations.
        objective: metric, tolerance and budget.
        screen: returns whether a configuration is acceptable from other starts.
        confirm: returns its errors from starts that did not decide.
    """
    if objective.budget is None:
        return None
    candidates = [
        p for p in _eligible(points, objective) if not p.objections and p.frame_time(objective.fps) <= objective.budget
    ]
    for point in sorted(candidates, key=lambda each: (each.error or 0.0, _counted_cost(each))):
        if screen(point):
            found = confirm(point)
            return Recommendation(point, describe(point, objective, found), found)
    return None


def cheapest_rejected(
    points: Sequence[Evaluation], objective: Objective, chosen: Recommendation | None
) -> Recommendation | None:
    """Return the cheapest evaluation within the tolerance that has objections, if none or a dearer one was chosen."""
    within = [p for p in _eligible(points, objective) if p.ranking_error <= objective.max_error]
    first = next(iter(by_cost(within)), None)
    if first is None or not first.objections or (chosen is not None and first is chosen.point):
        return None
    return Recommendation(first, describe(first, objective, None), None)


def nearest_to_tolerance(points: Sequence[Evaluation], objective: Objective) -> Recommendation | None:
    """Return the evaluation with the smallest error, of equals the one with the fewest changes; None without any.

    One without objections comes first.
    """
    candidates = _eligible(points, objective)
    point = min(
        candidates, key=lambda p: (bool(p.objections), p.error or 0.0, len(p.changes), _counted_cost(p)), default=None
    )
    return None if point is None else Recommendation(point, describe(point, objective, None), None)


def nearest_to_budget(points: Sequence[Evaluation], objective: Objective) -> Recommendation | None:
    """Return the evaluation whose most expensive frame takes the least time; None without any."""
    point = min(_eligible(points, objective), key=lambda p: p.frame_time(objective.fps), default=None)
    return None if point is None else Recommendation(point, describe(point, objective, None), None)


def by_cost(points: Sequence[Evaluation]) -> list[Evaluation]:
    """Return evaluations from the cheapest on: by time, and by counted work where times are within the noise.

    Evaluations that were timed separately come first: the costs of the others are estimates.
    """
    timed = [p for p in points if p.repeats]
    engines = [
        _by_work_and_time([p for p in timed if p.engine == name]) for name in dict.fromkeys(p.engine for p in timed)
    ]
    found = []
    while engines:
        lowest = min(group[0].cost or 0.0 for group in engines)
        candidates = [group for group in engines if (group[0].cost or 0.0) <= NOISE_FACTOR * lowest]
        found.append(min(candidates, key=lambda group: _counted_cost(group[0])).pop(0))
        engines = [group for group in engines if group]
    return [*found, *sorted((p for p in points if not p.repeats), key=_counted_cost)]


def _by_work_and_time(points: Sequence[Evaluation]) -> list[Evaluation]:
    """Return the evaluations of one engine from the cheapest on."""
    by_time = sorted(points, key=lambda each: each.cost or 0.0)
    comparable = [p for p in by_time if (p.cost or 0.0) <= NOISE_FACTOR * (by_time[0].cost or 0.0)]
    return [*_by_work(comparable), *by_time[len(comparable) :]]


def _by_work(points: Sequence[Evaluation]) -> list[Evaluation]:
    """Return evaluations by counted work; those with about the least work by their changes and error."""
    ordered = sorted(points, key=_counted_cost)
    equal = [p for p in ordered if _counted_cost(p) <= EQUAL_WORK_FACTOR * _counted_cost(ordered[0])]
    return [*sorted(equal, key=lambda p: (len(p.changes), p.error or 0.0)), *ordered[len(equal) :]]


def _eligible(points: Sequence[Evaluation], objective: Objective) -> list[Evaluation]:
    return [p for p in points if p.is_usable and p.settings.dt <= objective.max_dt]


def _counted_cost(point: Evaluation) -> float:
    return point.counted or 0.0


def describe(point: Evaluation, objective: Objective, confirmation: FreshStarts | None) -> str:
    """Describe a setting: engine and changes, error, cost per simulated second and per frame, odds from other starts.

    Example: `pymunk with dt = 0.01, substeps = 4: max_position 310 µm, 12 ms per simulated second (1.2 % of real time),
    0.2 ms per frame of the budget of 4 ms; held in 29 of 30 fresh starts (95 % interval 83 to 99 %)`.
    """
    assert point.error is not None and point.cost is not None
    unit = objective.metric.unit
    error = f"{objective.metric.name} {format_quantity(point.error, unit)}{', the truth itself' * point.is_truth}"
    if objective.metric.name == "passes" and point.error > 0.0:
        error += f", 1 in {1.0 / point.error:.3g} contacts missed"
    if objective.metric.name == "joint_error" and (distance := point.metrics.get("joint_distance")) is not None:
        error += f" of a length, {format_quantity(distance, 'm')}"
    confirmed = "" if confirmation is None else f"; {confirmation}"
    percent = point.cost / 10.0
    is_long = point.settings.dt > FRAME_TOLERANCE / objective.fps
    note = f"; a step is longer than a frame at {objective.fps:g} fps: interpolate for drawing" if is_long else ""
    cost = f"{point.cost:.3g} ms per simulated second ({percent:.2g} % of real time), {_frame_text(point, objective)}"
    return f"{label(point)}: {error}, {cost}{confirmed}{note}"


def _frame_text(point: Evaluation, objective: Objective) -> str:
    """Return the time of the most expensive frame, compared with the budget if there is one."""
    time = point.frame_time(objective.fps)
    text = f"{time:.3g} ms per frame"
    if objective.budget is None:
        return f"{text} at {objective.fps:g} fps"
    return f"{text}{' of' if time <= objective.budget else ', more than'} the budget of {objective.budget:g} ms"


def label(point: Evaluation) -> str:
    """Return an engine and the changes of its settings: `reference with integrator = rk4`."""
    changes = ", ".join(f"{key} = {format_value(value)}" for key, value in point.changes.items() if value is not None)
    dropped = ", ".join(key for key, value in point.changes.items() if value is None)
    parts = [f"{word} {text}" for word, text in (("with", changes), ("without", dropped)) if text]
    return " ".join([point.engine, *parts]) if parts else f"{point.engine} with the settings of the scene"


def format_value(value: object) -> str:
    """Return the value of a setting as in a scene file, with at most 6 digits."""
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def pymunk_lines(settings: Settings, dt: str | None = None) -> list[str]:
    """Return lines of Python that give a `pymunk.Space` named `space` the resolved settings of the pymunk engine.

    Attributes that have pymunk's defaults are left out, and so is what the engine does to bodies and shapes, such as
    drag and moments of inertia.

    Args:
        settings: the settings.
        dt: expression of the step, such as `1 / 60`; default: its value.
    """
    attributes = space_attributes(settings).items()
    lines = [f"space.{name} = {value!r}" for name, value in attributes if not is_space_default(name, value)]
    lines.append(f"dt = {dt or repr(settings.dt)}")
    count = settings.substeps
    if settings.half_kick:
        lines += [
            "for body in space.bodies:  # once, before the first step; bodies added later need it too",
            "    if body.body_type == pymunk.Body.DYNAMIC:",
            f"        body.velocity += space.gravity * dt / {2 * count}",
        ]
    if count == 1:
        return [*lines, "space.step(dt)  # every frame"]
    return [*lines, f"for _ in range({count}):  # every frame", f"    space.step(dt / {count})"]
