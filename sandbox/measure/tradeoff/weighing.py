"""Weighing: a scene's engines and settings, tried, timed and held against the best known truth."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from sandbox.engines.registry import ENGINES, engine_named
from sandbox.measure.compare.comparing import usual_tolerance
from sandbox.measure.compare.truth import Truth, truth_of
from sandbox.measure.recorder import require_memory
from sandbox.measure.seeds import is_random, seeded
from sandbox.measure.told import Told, nobody
from sandbox.measure.tradeoff.aim import Aim, aim_at, metric_named, require_aim
from sandbox.measure.tradeoff.cost import Cost, costs
from sandbox.measure.tradeoff.front import outdone, pareto
from sandbox.measure.tradeoff.judge import Judge, zoom_of
from sandbox.measure.tradeoff.picking import FRESH, LONGER, Again, cheapest, closest
from sandbox.measure.tradeoff.point import Point
from sandbox.measure.tradeoff.proposals import Proposal, proposals
from sandbox.measure.tradeoff.search import SLOW, Search
from sandbox.measure.tradeoff.split import Split, split
from sandbox.measure.tradeoff.trial import Trial, tried
from sandbox.measure.tradeoff.variant import Space, Variant
from sandbox.measure.tradeoff.weighed import Tradeoff
from sandbox.measure.versions import machine, versions
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings

PATIENCE = 60.0
"""s that the search may take where nothing else is said; truth and timing come on top."""
REPEATS = 5
POINTS = 120
NEAR = 0.5
"""What takes more than the inverse of this share of a point that is as right is not timed apart."""
AGAIN = 0.5
"""The share of the patience that timing again may take."""
SEEDS = 2**63
"""They go on at 0."""


def tradeoff(
    scene: Scene,
    engines: Sequence[str] | None = None,
    *,
    metric: str | None = None,
    tolerance: float | None = None,
    budget: float | None = None,
    fps: float = 60.0,
    seeds: int = 1,
    zoom: float | None = None,
    patience: float = PATIENCE,
    repeats: int = REPEATS,
    most: int = POINTS,
    truth: Truth | None = None,
    told: Told | None = None,
    **settings: Any,
) -> Tradeoff:
    """Weigh a scene's settings: error against the best known truth, and cost, over engines and choices.

    Args:
        scene: what to run.
        engines: their names; by default all there are. One that cannot run the scene is a point that says why.
        metric: what the error is counted in (`metrics.METRICS`); by default the largest distance from the truth
            where that is trusted to the end, else an invariant of the scene.
        tolerance: in the metric's unit; by default 1 % of the smallest radius, 1 px, 1 %, or none missed.
        budget: ms a frame, for the best that it buys.
        fps: frames a second of the budget; what is recommended steps as often, or as often as the scene does.
        seeds: how many, from the scene's own on; errors are the worst of them.
        zoom: px/m, for errors in pixels; by default all that happens fills a window of 1280 × 720.
        patience: s that the search may take.
        repeats: how often what is near the front is timed.
        most: how many settings are tried.
        truth: of this scene and its frames, as close as the tolerance asks for, where it is known already.
        told: who is told what is being done.
        settings: changes to the scene's `[solver]`, such as `dt=0.001`.

    Raises:
        UnknownEngineError: no engine has one of the names.
        UnknownMetricError: no metric has that name.
        TooLargeError: the frames would not fit into memory.
        ValueError: a figure is out of range.
        pydantic.ValidationError: a setting is wrong.
    """
    names = tuple(dict.fromkeys(ENGINES if engines is None else engines))
    for name in names:
        engine_named(name)
    _require_sense(seeds, zoom, patience, repeats, most)
    require_aim(metric, tolerance, budget, fps)
    base = scene.solver.replace(**settings) if settings else scene.solver
    require_memory(scene, base, 4 * len(scene.bodies))
    say = told or nobody

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
    search = Search(space, judges, aim.metric.name, aim.tolerance, hurry, patience, most, say)
    trials = search.run()

    def weighed(repeats: int, fresh: tuple[int, ...]) -> Tradeoff:
        """Time and answer; with no repeats what is known is told at once."""
        say("timing")
        points = [*_timed(trials, space, aim, repeats, patience), *_refused(scene, names, base)]
        trial_of = {id(point): trial for point, trial in zip(points, trials, strict=False)}  # the refused have none
        again = _again(space, trial_of, aim, lambda: _judges(scene, base, close, fresh, judges[0].zoom), patience)
        say("held to its word")
        within = cheapest(points, aim, fresh, again)
        splits: list[Split] = []
        cheaper: list[Proposal] = []
        if repeats:
            say("where the error comes from, and what a cheaper model would do")
            splits = _splits(judges[0], space, patience)
            cheaper = _proposals(judges, aim, within.point if within else None, space, patience)
        return Tradeoff(
            scene,
            judges[0].truth,
            aim.metric,
            judges[0].zoom,
            tuple(points),
            tuple(pareto([p for p in points if p.usable], lambda p: p.cost or 0.0, lambda p: p.error or 0.0)),
            tuple(splits),
            tuple(cheaper),
            aim.tolerance,
            budget,
            fps,
            within,
            closest(points, aim, fresh, again),
            known,
            len(search.untried - set(search.trials)),
            machine(),
            versions(),
            interrupted=not repeats,
        )

    if not search.interrupted:
        try:
            return weighed(repeats, fresh)
        except KeyboardInterrupt:
            say("interrupted")
    return weighed(0, ())


def _require_sense(seeds: int, zoom: float | None, patience: float, repeats: int, most: int) -> None:
    for what, value in (("seeds", seeds), ("repeats", repeats), ("most", most)):
        if value < 1:
            raise ValueError(f"{what} of {value}; at least 1")
    for what, figure in (("zoom", zoom), ("patience", patience)):
        if figure is not None and not 0.0 < figure < math.inf:
            raise ValueError(f"a {what} of {figure:g}; it is positive and finite")


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
    known: Truth | None = None,
) -> list[Judge]:
    """Return a judge for each seed; the truth of the scene's own may be known."""
    found: list[Judge] = []
    for seed in seeds:
        same = seed == scene.world.seed
        own = scene if same else seeded(scene, seed)
        truth = known if same and known is not None else truth_of(own, base, close)
        zoom = zoom_of(own, truth) if zoom is None else zoom  # the first one's for all: pixels are pixels
        found.append(Judge(own, truth, zoom))
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
        Point(name, base, base, {}, "refused", reason, nothing, None, None, None, 0, {})
        for name, reason in reasons
        if reason is not None
    ]


def _timed(trials: Sequence[Trial], space: Space, aim: Aim, repeats: int, patience: float) -> list[Point]:
    """Time what is near the front again and again, if at all; of what is far, the run that was recorded says enough."""
    ok = [trial for trial in trials if trial.status == "ok"]
    seen = [(trial.seconds, trial.error(aim.metric.name)) for trial in ok]
    near = [trial for trial in ok if not outdone(trial.seconds, trial.error(aim.metric.name), seen, NEAR)]
    ways = [(trial.variant.engine, space.settings(trial.variant)) for trial in near]
    found = dict(zip(near, costs(space.scene, ways, repeats, AGAIN * patience), strict=True)) if repeats else {}
    rough = {trial: Cost.of([trial.seconds], space.scene.world.duration)._replace(repeats=0) for trial in ok}
    return [_point(trial, space, aim, {**rough, **found}.get(trial)) for trial in trials]


def _point(trial: Trial, space: Space, aim: Aim, cost: Cost | None) -> Point:
    error = trial.metrics.get(aim.metric.name) if trial.status == "ok" else None
    asked = space.settings(trial.variant)
    return Point(
        trial.variant.engine,
        asked,
        trial.settings,
        changes(space.base, asked),
        trial.status,
        trial.reason,
        trial.metrics,
        error,
        None if cost is None else cost.least,
        None if cost is None else cost.median,
        0 if cost is None else cost.repeats,
        trial.work,
    )


def changes(base: Settings, chosen: Settings) -> dict[str, Any]:
    """Return what settings change of others, but for which frames are kept; None for what they leave open again."""
    before, after = base.model_dump(), chosen.model_dump()
    return {key: value for key, value in after.items() if value != before[key] and key != "record_every"}


def _again(
    space: Space, trial_of: Mapping[int, Trial], aim: Aim, judging: Callable[[], list[Judge]], patience: float
) -> Again:
    """Return who runs a point on fresh seeds; who judges is asked for when there is one."""
    made: list[Judge] = []
    known: dict[Variant, float] = {}

    def again(point: Point) -> float:
        made[:] = made or judging()
        variant = trial_of[id(point)].variant
        if variant not in known:
            known[variant] = tried(variant, space, made, SLOW * patience * len(made)).error(aim.metric.name)
        return known[variant]

    return again


def _splits(judge: Judge, space: Space, patience: float) -> list[Split]:
    found = (split(judge, name, space.own(name), SLOW * patience) for name in space.engines if name != "exact")
    return [each for each in found if each is not None]


def _proposals(judges: Sequence[Judge], aim: Aim, pick: Point | None, space: Space, patience: float) -> list[Proposal]:
    """Propose cheaper models than the pick's; where there is none, than the first engine's with its own settings."""
    if not space.engines:
        return []
    engine = space.engines[0] if pick is None else pick.engine
    chosen = space.own(engine) if pick is None else pick.asked
    return proposals(judges, aim.metric.name, aim.tolerance, engine, chosen, SLOW * patience)
