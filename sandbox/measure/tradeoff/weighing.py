"""Weighing: a scene's engines and settings, tried, timed and held against the best known truth.

Which settings are tried, in which order, and how far off each is depends on the scene and on the counted work that is
allowed, never on the clock, unless a time limit is given. Times are of this machine; where two are too close to tell
apart, counted work decides which is the cheaper.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from pydantic import ValidationError

from sandbox.engines.registry import ENGINES, engine_named
from sandbox.measure.bounded_run import working
from sandbox.measure.compare.errors import usual_tolerance
from sandbox.measure.compare.truth import Truth, seek_truth
from sandbox.measure.forecast.forecasts import warnings
from sandbox.measure.forecast.passages import largest_safe_dt
from sandbox.measure.forecast.warning import ROUNDING, Warning
from sandbox.measure.recorder import require_memory
from sandbox.measure.seeds import is_random, seeded
from sandbox.measure.told import Told, nobody
from sandbox.measure.tradeoff.aim import AUDITED, Aim, aim_at, metric_named, require_aim
from sandbox.measure.tradeoff.cost import Cost, costs
from sandbox.measure.tradeoff.front import outdone
from sandbox.measure.tradeoff.judge import Judge, zoom_of
from sandbox.measure.tradeoff.picking import (
    FRESH,
    LONGER,
    Again,
    cheapest,
    closest,
    nearest_to_budget,
    nearest_to_tolerance,
)
from sandbox.measure.tradeoff.point import Point
from sandbox.measure.tradeoff.proposals import Proposal, proposals
from sandbox.measure.tradeoff.search import SLOW, Search
from sandbox.measure.tradeoff.split import Split, split
from sandbox.measure.tradeoff.trial import Trial, tried
from sandbox.measure.tradeoff.variant import Space, Variant
from sandbox.measure.tradeoff.weighed import Pick, Tradeoff, front_of
from sandbox.measure.versions import machine, versions
from sandbox.scene.description.world import Settings
from sandbox.scene.files.load import as_scene
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

EFFORT = 10.0
"""Counted work that the search may do where nothing else is asked for, about seconds; truth and timing come on top."""
REPEATS = 5
POINTS = 120
NEAR = 0.5
"""What costs more than the inverse of this share of a point of its engine that is as right is not timed apart."""
AGAIN = 0.5
"""The share of the effort that timing again may take."""
FEWEST = 2
"""Repeats at least, where more were asked for: the first may be slow for another reason than its settings."""
SEEDS = 2**63
"""They go on at 0."""


def tradeoff(
    scene: Scene | str | Path,
    engines: Sequence[str] | None = None,
    *,
    metric: str | None = None,
    tolerance: float | None = None,
    budget: float | None = None,
    fps: float = 60.0,
    seeds: int = 1,
    zoom: float | None = None,
    effort: float = EFFORT,
    time_limit: float | None = None,
    repeats: int = REPEATS,
    most: int = POINTS,
    truth: Truth | str | None = None,
    runs: Mapping[str, Trajectory] = MappingProxyType({}),
    told: Told | None = None,
    **settings: Any,
) -> Tradeoff:
    """Measure the error and the cost of engines and settings for a scene, and find the Pareto front.

    The error is measured against the best known truth, the cost in computing time per simulated second. The settings
    that are tried depend on the scene and on `effort`, not on the speed of the machine, unless `time_limit` is given.

    Args:
        scene: the scene, or its name or path, as `load` takes it.
        engines: names of the engines, or one name; default: all. An engine that cannot run the scene gets a
            point with the reason.
        metric: metric of the error (`metrics.METRICS`); default: the largest distance from the truth if the truth is
            trusted to the end, otherwise an invariant of the scene.
        tolerance: largest accepted error, in the unit of the metric; default: 1 % of the smallest radius, 1 px, 1 %, or
            no missed contact.
        budget: computing time per frame, ms, for which the most accurate setting is sought.
        fps: frames per second of the budget. A recommended setting has at least this step rate, or the step rate of the
            scene if that is lower.
        seeds: number of seeds, from the scene's own upwards; each error is the largest over the seeds.
        zoom: px/m, for errors in pixels; default: the motion fills a window of 1280 × 720.
        effort: counted work of the search, about seconds of computing. The same settings are tried on every machine.
            The default settings of each engine are tried even with a small effort.
        time_limit: time after which no more settings are tried, s; the tried settings then depend on the machine.
        repeats: number of timings of settings near the front.
        most: largest number of settings that are tried.
        truth: truth of this scene and its frames, as accurate as the tolerance requires, or the reason why there is
            none, if already known.
        runs: runs of this scene with its own settings by engine, if already made.
        told: progress callback, called with a description of each stage.
        settings: changes to the scene's `[solver]`, such as `dt=0.001`.

    Raises:
        UnknownEngineError: no engine has one of the names.
        UnknownMetricError: no metric has that name.
        TooLargeError: the frames would not fit into memory.
        ValueError: an argument is out of range.
        pydantic.ValidationError: a setting is invalid.
    """
    scene = as_scene(scene)
    engines = [engines] if isinstance(engines, str) else engines
    names = tuple(dict.fromkeys(ENGINES if engines is None else engines))
    for name in names:
        engine_named(name)
    _require_sense(seeds, zoom, effort, time_limit, repeats, most)
    require_aim(metric, tolerance, budget, fps)
    base = scene.solver.replace(**settings) if settings else scene.solver
    require_memory(scene, base, 4 * len(scene.bodies))
    say = told or nobody
    deadline = math.inf if time_limit is None else working() + time_limit

    say("the truth")
    known, fresh = _seeds(scene, seeds)
    close = _closeness(scene, metric, tolerance)
    judges = _judges(scene, base, close, known, zoom, truth)
    if metric is not None and metric_named(metric).unit == "px" and tolerance and tolerance / judges[0].zoom < close:
        close = tolerance / judges[0].zoom
        judges = _judges(scene, base, close, known, judges[0].zoom)
    aim = aim_at(judges[0], metric, tolerance, budget, fps)._replace(step=max(base.dt, LONGER / fps))
    space = Space(scene, base, tuple(name for name in names if not _refusal(scene, name, base)), 1.0 / fps)
    hurry = None if aim.hurry is None else aim.hurry * scene.world.duration
    search = Search(
        space, judges, aim.metric.name, aim.tolerance, hurry, effort, most, say, deadline, _own_runs(runs, space, aim)
    )
    trials = search.run()

    def weighed(repeats: int, fresh: tuple[int, ...]) -> Tradeoff:
        """Time and answer; with no repeats, answer with the times of the runs that were scored."""
        say("timing")
        points = [*_timed(trials, space, aim, repeats, effort), *_refused(scene, names, base)]
        trial_of = {id(point): trial for point, trial in zip(points, trials, strict=False)}  # the refused have none
        again = _again(space, trial_of, aim, lambda: _judges(scene, base, close, fresh, judges[0].zoom), effort)
        say("checking the recommended setting with other seeds")
        within, best = cheapest(points, aim, fresh, again), closest(points, aim, fresh, again)
        splits: list[Split] = []
        cheaper: list[Proposal] = []
        if repeats and working() < deadline:
            say("splitting the error into its sources, and trying simpler models")
            splits = _splits(judges[0], space, effort, deadline)
            cheaper = _proposals(judges, aim, within.point if within else None, space, effort, deadline)
        return Tradeoff(
            scene=scene,
            best=judges[0].truth,
            doubt=judges[0].doubt,
            metric=aim.metric,
            metric_reason=aim.reason,
            zoom=judges[0].zoom,
            points=tuple(points),
            pareto=tuple(front_of(points)),
            splits=tuple(splits),
            proposals=tuple(cheaper),
            tolerance=aim.tolerance,
            budget=budget,
            fps=fps,
            within_tolerance=_checked(scene, within),
            within_budget=_checked(scene, best),
            cheapest_by_engine={
                name: _checked(scene, cheapest([p for p in points if p.engine == name], aim, fresh, again))
                for name in space.engines
            },
            nearest_to_tolerance=None if within else _checked(scene, nearest_to_tolerance(points, aim)),
            nearest_to_budget=None if best or budget is None else _checked(scene, nearest_to_budget(points, aim)),
            seeds=known,
            untried=len(search.untried - set(search.trials)),
            effort=effort,
            spent=search.spent,
            out_of_time=working() >= deadline,
            machine=machine(),
            versions=versions(),
            max_dt=aim.step,
            interrupted=not repeats,
        )

    if not search.interrupted:
        try:
            return weighed(repeats, fresh)
        except KeyboardInterrupt:
            say("interrupted")
    return weighed(0, ())


def _require_sense(
    seeds: int, zoom: float | None, effort: float, time_limit: float | None, repeats: int, most: int
) -> None:
    for what, value in (("seeds", seeds), ("repeats", repeats), ("most", most)):
        if value < 1:
            raise ValueError(f"{what} is {value}; it must be at least 1")
    for what, figure in (("zoom", zoom), ("effort", effort), ("time limit", time_limit)):
        if figure is not None and not 0.0 < figure < math.inf:
            raise ValueError(f"{what} is {figure:g}; it must be positive and finite")


def _seeds(scene: Scene, count: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the seeds that are tried, the scene's own first, and as fresh ones those behind them."""
    if not is_random(scene):
        return (scene.world.seed,), ()
    found = tuple((scene.world.seed + k) % SEEDS for k in range(count + FRESH))
    return found[:count], found[count:]


def _closeness(scene: Scene, metric: str | None, tolerance: float | None) -> float:
    """Return how far off a truth may be, m."""
    close = usual_tolerance(scene)
    if tolerance is not None and tolerance > 0.0 and (metric is None or metric_named(metric).unit == "m"):
        close = min(close, tolerance)
    return close


def _judges(
    scene: Scene,
    base: Settings,
    close: float,
    seeds: Sequence[int],
    zoom: float | None,
    known: Truth | str | None = None,
) -> list[Judge]:
    """Return a judge for each seed; the truth of the scene's own may be known."""
    found: list[Judge] = []
    for seed in seeds:
        same = seed == scene.world.seed
        own = scene if same else seeded(scene, seed)
        sought = known if same and known is not None else seek_truth(own, base, close)
        truth, doubt = (sought, None) if isinstance(sought, Truth) else (None, sought)
        zoom = zoom_of(own, truth) if zoom is None else zoom  # the first one's for all: pixels are pixels
        found.append(Judge(own, truth, zoom, doubt))
    return found


def _refusal(scene: Scene, engine: str, base: Settings) -> str | None:
    """Return why an engine cannot run a scene, whatever the settings; None where it can."""
    if not ENGINES[engine].missing(scene, base):
        return None
    missing = ENGINES[engine].missing(scene, base.common())
    return "; ".join(missing) if missing else None


def _refused(scene: Scene, names: Sequence[str], base: Settings) -> list[Point]:
    reasons = ((name, _refusal(scene, name, base)) for name in names)
    nothing: dict[str, float | None] = {}
    return [
        Point(name, base, base, {}, "refused", reason, nothing, None, None, None, 0, None, True, {})
        for name, reason in reasons
        if reason is not None
    ]


def _own_runs(runs: Mapping[str, Trajectory], space: Space, aim: Aim) -> dict[str, Trajectory]:
    """Return the runs that are what an engine's own settings in this search would give, as far as the metric asks."""
    found: dict[str, Trajectory] = {}
    for name in space.engines:
        run = runs.get(name)
        if run is None or (aim.metric.name in AUDITED and not run.info["audited"]):
            continue
        own = ENGINES[name].resolve(space.scene, space.own(name)).model_dump(mode="json")
        if run.info["settings"] == own and run.info["seed"] == space.scene.world.seed:
            found[name] = run
    return found


def _timed(trials: Sequence[Trial], space: Space, aim: Aim, repeats: int, effort: float) -> list[Point]:
    """Time what is near the front of its engine again and again; of what is far, the run that was recorded says enough.

    The scene's own settings are always timed.
    """
    own = set(space.starts())
    near: list[Trial] = []
    for engine in space.engines:
        ok = [trial for trial in trials if trial.status == "ok" and trial.variant.engine == engine]
        seen = [(trial.cost, trial.error(aim.metric.name)) for trial in ok]
        near += [t for t in ok if t.variant in own or not outdone(t.cost, t.error(aim.metric.name), seen, NEAR)]
    ways = [(trial.variant.engine, space.settings(trial.variant)) for trial in near]
    once = sum(trial.cost for trial in near)
    times = min(repeats, max(FEWEST, int(AGAIN * effort / once) if once else repeats))
    found = dict(zip(near, costs(space.scene, ways, times), strict=True)) if repeats else {}
    duration = space.scene.world.duration
    rough = {t: Cost.of([t.seconds], duration)._replace(repeats=0) for t in trials if t.status == "ok"}
    return [_point(trial, space, aim, {**rough, **found}.get(trial), trial.variant in own) for trial in trials]


def _point(trial: Trial, space: Space, aim: Aim, cost: Cost | None, is_own: bool) -> Point:
    error = trial.metrics.get(aim.metric.name) if trial.status == "ok" else None
    asked = space.settings(trial.variant)
    return Point(
        engine=trial.variant.engine,
        asked=asked,
        settings=trial.settings,
        changes=changes(space.base, asked),
        status=trial.status,
        reason=trial.reason,
        metrics=trial.metrics,
        error=error,
        cost=None if cost is None else cost.least,
        cost_median=None if cost is None else cost.median,
        repeats=0 if cost is None else cost.repeats,
        counted=1e3 * trial.cost / space.scene.world.duration,
        is_own=is_own,
        work=trial.work,
    )


def changes(base: Settings, chosen: Settings) -> dict[str, Any]:
    """Return what settings change of others, but for which frames are kept; None for what they leave open again."""
    before, after = base.model_dump(), chosen.model_dump()
    return {key: value for key, value in after.items() if value != before[key] and key != "record_every"}


def _again(
    space: Space, trial_of: Mapping[int, Trial], aim: Aim, judging: Callable[[], list[Judge]], effort: float
) -> Again:
    """Return a function that runs a point on fresh seeds, whose truths are sought at its first call."""
    made: list[Judge] = []
    known: dict[Variant, float] = {}

    def again(point: Point) -> float:
        made[:] = made or judging()
        variant = trial_of[id(point)].variant
        if variant not in known:
            known[variant] = tried(variant, space, made, SLOW * effort).error(aim.metric.name)
        return known[variant]

    return again


def _checked(scene: Scene, pick: Pick | None) -> Pick | None:
    """Return a pick with the warnings of the forecasts for its setting."""
    if pick is None:
        return None
    return replace(pick, warnings=tuple(setting_warnings(scene, pick.point.engine, pick.point.asked)))


def setting_warnings(scene: Scene, engine: str, settings: Settings) -> list[Warning]:
    """Return what the forecasts predict for a setting, without a trial run.

    Warnings of tunnelling also state the number of substeps from which on no body can tunnel at the dt of the setting.
    """
    found = warnings(scene, settings, engine)
    limits = [float(each.figures["safe_dt"]) for each in found if each.kind == "tunnelling"]
    if not limits:
        return found
    safe = largest_safe_dt(scene, settings)
    # Unknown where something may add any speed; then the speeds that the warnings state decide.
    what = "prevents tunnelling at these speeds" if safe is None else "prevents tunnelling"
    safe = min(limits) if safe is None else safe
    ratio = settings.substeps * settings.dt / safe if safe > 0.0 else math.inf
    try:
        needed = settings.replace(substeps=math.ceil(ratio * (1.0 - ROUNDING))).substeps
    except (OverflowError, ValidationError):  # more than a setting may have
        return found
    remedy = f"; at dt = {settings.dt:.4g} s, substeps >= {needed} {what}"
    return [
        replace(each, message=each.message + remedy, figures={**each.figures, "safe_substeps": needed})
        if each.kind == "tunnelling"
        else each
        for each in found
    ]


def _splits(judge: Judge, space: Space, effort: float, deadline: float) -> list[Split]:
    found = (split(judge, name, space.own(name), SLOW * effort, deadline) for name in space.engines if name != "exact")
    return [each for each in found if each is not None]


def _proposals(
    judges: Sequence[Judge], aim: Aim, pick: Point | None, space: Space, effort: float, deadline: float
) -> list[Proposal]:
    """Propose cheaper models than the pick's; where there is none, than the first engine's with its own settings."""
    if not space.engines:
        return []
    engine = space.engines[0] if pick is None else pick.engine
    chosen = space.own(engine) if pick is None else pick.asked
    return proposals(judges, aim.metric.name, aim.tolerance, engine, chosen, SLOW * effort, deadline)
