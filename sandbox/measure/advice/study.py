"""Study behind the advice for a game: forecast, present setting, search at the dt of a frame, knobs, other engines.

The search, the truth and the costs are those of `measure.tradeoff`; the settings that it tries have dt = 1/fps, so that
a game steps once a frame and substeps divide the step.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

from pydantic import ValidationError

from sandbox.action import Switch
from sandbox.engines.registry import ENGINES, able, engine_named
from sandbox.measure.advice.forecast import Risk, forecast, formula_forecast, game_notes
from sandbox.measure.advice.game_code import PYMUNK_DEFAULTS, SAME_VALUE, GameCode, game_code
from sandbox.measure.advice.result import (
    Advice,
    FallbackKind,
    Knob,
    KnobStart,
    MeasuredSetting,
    OtherEngine,
    ReplayedActions,
)
from sandbox.measure.compare.ground_truth import Truth, find_truth
from sandbox.measure.metrics.trajectory_error import default_tolerance
from sandbox.measure.run.bounded_run import bounded_run, clock_without_compilation
from sandbox.measure.run.recorder import TooLargeError, require_memory
from sandbox.measure.run.runner import run
from sandbox.measure.seeds import is_random
from sandbox.measure.tradeoff.configuration import (
    MIN_STEPS,
    Configuration,
    Evaluation,
    SearchSpace,
    evaluate,
    refused_evaluation,
)
from sandbox.measure.tradeoff.metrics import METRICS, EvaluationContext, Metric
from sandbox.measure.tradeoff.objective import DEFAULT_TOLERANCES, Objective, choose_metric
from sandbox.measure.tradeoff.recommendation import (
    FRAME_TOLERANCE,
    format_value,
    nearest_to_tolerance,
    recommend_cheapest,
    recommend_most_accurate,
)
from sandbox.measure.tradeoff.result import Tradeoff
from sandbox.measure.tradeoff.search import MIN_RUN_COST, RUN_FRACTION
from sandbox.measure.tradeoff.study import (
    DEFAULT_EFFORT,
    DEFAULT_REPEATS,
    MIN_REPEATS,
    TIMING_FRACTION,
    tradeoff,
)
from sandbox.measure.tradeoff.timing import TimedRun, time_in_turns
from sandbox.progress import Progress, ProgressCallback, ignore_progress
from sandbox.provenance import machine, versions
from sandbox.recording import Recording
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from sandbox.scene.files.load import as_scene

DEFAULT_FPS, DEFAULT_ZOOM = 60.0, 50.0
"""Frames per second, and px/m."""
MIN_FPS, MAX_FPS = 0.1, 1e6
"""Bounds of the frame rate: dt = 1/fps must be a valid setting."""
MIN_TRUSTED_FRAMES = 10
"""Frames that a truth must be trusted for at least, so that errors are those of a motion."""
SAME_STEP = 1e-9
"""Relative: a dt that differs from a frame by less is that of a frame."""
MAX_DENOMINATOR = 1_000_000
"""Of a dt as a fraction of a second."""
MAX_SHARED_FACTOR = 64
"""Frames of a truth in a frame of the game, so that its frames are also those of the present dt."""
MAX_SHARED_FRAMES = 1_000_000
"""Frames × bodies of such a truth."""
SEARCH_REPEATS = 2
"""Timings of a setting during the search; the settings of the advice are then timed again, all in turns."""


def advise(
    scene: Scene | Recording | str | Path,
    engine: str | None = None,
    *,
    fps: float = DEFAULT_FPS,
    tolerance: float | None = None,
    budget: float | None = None,
    zoom: float = DEFAULT_ZOOM,
    effort: float = DEFAULT_EFFORT,
    time_limit: float | None = None,
    repeats: int = DEFAULT_REPEATS,
    on_progress: ProgressCallback | None = None,
) -> Advice:
    """Return the settings that a game needs: forecast, measured errors and costs, the cheapest setting, its code.

    The settings that are considered have dt = 1/fps. The present setting is measured as it is. After Ctrl-C the advice
    has everything that was measured before, and `interrupted` is set.

    Args:
        scene: the scene, or its name or path, as `load` takes it; or a recording, whose scene and settings are
            advised on without the actions of the player. With these, only missed contacts are counted.
        engine: name of the present engine; default: that of the recording; for a scene pymunk, or the first engine that
            can run it.
        fps: frames per second of the game.
        tolerance: largest accepted error of a position, m; default: 1 px.
        budget: computing time per frame, ms.
        zoom: px/m, for errors on the screen.
        effort: counted work of the search, about seconds of computing, as of `tradeoff`.
        time_limit: time after which no more settings are tried, s.
        repeats: number of timings of each setting of the advice.
        on_progress: progress callback; its message describes each stage.

    Raises:
        UnknownEngineError: no engine has that name.
        TooLargeError: the frames would not fit into memory.
        ValueError: an argument is out of range, or the scene lasts fewer than four frames.
        KeyboardInterrupt: Ctrl-C was pressed before the present setting was measured.
    """
    recording = scene if isinstance(scene, Recording) else None
    played = _recorded_scene(scene) if isinstance(scene, Recording) else as_scene(scene)
    if engine is None:
        names = able(played)
        engine = recording.engine if recording else "pymunk" if "pymunk" in names or not names else names[0]
    engine_named(engine)
    tolerance = 1.0 / zoom if tolerance is None and zoom > 0.0 else tolerance
    _check(fps=fps, zoom=zoom, tolerance=tolerance, budget=budget, effort=effort, time_limit=time_limit)
    if not MIN_FPS <= fps <= MAX_FPS:
        raise ValueError(f"fps is {fps:g}; it must be {MIN_FPS:g} to {MAX_FPS:g}")
    if repeats < 1:
        raise ValueError(f"repeats is {repeats}; it must be at least 1")
    if played.world.duration * fps < MIN_STEPS * (1.0 - SAME_STEP):
        raise ValueError(f"the scene lasts {played.world.duration:g} s, fewer than {MIN_STEPS} frames at {fps:g} fps")
    assert tolerance is not None
    request = _Request(
        scene=played,
        engine=engine,
        recording=recording,
        fps=fps,
        length=tolerance,
        budget=budget,
        zoom=zoom,
        effort=effort,
        deadline=math.inf if time_limit is None else clock_without_compilation() + time_limit,
        repeats=repeats,
        on_progress=on_progress or ignore_progress,
    )
    return _advise(request)


def _check(**values: float | None) -> None:
    """Check that numbers are positive and finite.

    Raises:
        ValueError: one is not.
    """
    for name, value in values.items():
        if value is not None and not 0.0 < value < math.inf:
            raise ValueError(f"{name.replace('_', ' ')} is {value:g}; it must be positive and finite")


def _recorded_scene(recording: Recording) -> Scene:
    """Return the scene of a recording with its duration, and with its settings as `[solver]`.

    Settings that its engine chooses by itself are left out, so that other engines can run the scene.
    """
    scene, settings = recording.whole_scene, recording.settings
    common = settings.common()
    chosen = engine_named(recording.engine).resolve(scene, common)
    own = {key: value for key in Settings.model_fields if (value := getattr(settings, key)) != getattr(chosen, key)}
    return scene.model_copy(update={"solver": common.replace(**own)})


@dataclass(frozen=True)
class _Request:
    """Arguments of `advise` after their check."""

    scene: Scene
    engine: str
    recording: Recording | None
    fps: float
    length: float
    """m, largest accepted error of a position"""
    budget: float | None
    zoom: float
    effort: float
    deadline: float
    repeats: int
    on_progress: ProgressCallback

    @property
    def frame(self) -> float:
        """Duration of a frame, s."""
        return 1.0 / self.fps

    @property
    def present(self) -> Settings:
        """The present setting; it is recorded about once a frame."""
        own = self.scene.solver
        every = max(1, math.floor(self.frame / own.dt * (1.0 + SAME_STEP)))
        return own.replace(record_every=every)

    @property
    def is_in_loop(self) -> bool:
        """Whether the present dt is that of a frame."""
        return abs(self.scene.solver.dt * self.fps - 1.0) <= SAME_STEP

    @property
    def loop(self) -> Settings:
        """The present setting with the dt of a frame; without substeps, unless it has that dt already."""
        substeps = self.scene.solver.substeps if self.is_in_loop else 1
        return self.scene.solver.replace(dt=self.frame, substeps=substeps, record_every=1)


class _Score(NamedTuple):
    """Metric and tolerance of the errors, and the context that they are measured in."""

    metric: str
    tolerance: float
    """in the unit of the metric"""
    reason: str | None
    """reason why errors are no positions; None if they are"""
    invariant: str | None
    """metric that also holds beyond the predictability horizon; None if it is not needed"""
    invariant_tolerance: float | None
    """in its unit"""
    context: EvaluationContext
    """context at the frames of the game"""
    present: EvaluationContext
    """context at the frames of the present dt"""
    truth: Truth | str
    """truth at the frames of the game, or the reason why there is none"""


@dataclass
class _Measured:
    """What has been measured so far; after Ctrl-C the advice is made of it."""

    risks: list[Risk]
    notes: list[str]
    present: Evaluation
    found: Tradeoff | None = None
    recommended: Evaluation | None = None
    fallback: Evaluation | None = None
    fallback_kind: FallbackKind | None = None
    knob_start: KnobStart | None = None
    knobs: list[Evaluation] = field(default_factory=list)
    others: dict[str, Evaluation] = field(default_factory=dict)
    replays: list[ReplayedActions] = field(default_factory=list)
    untried_knobs: int = 0
    within_until: dict[tuple[str, str], float] = field(default_factory=dict)
    """s, time from which on the error exceeds the tolerance, by `_key`"""
    timed: dict[tuple[str, str], Evaluation] = field(default_factory=dict)
    """evaluations with the costs that were timed together, by `_key`"""
    interrupted: bool = False

    @property
    def start(self) -> Evaluation | None:
        """The setting that the knobs are changed from."""
        starts = {"present": self.present, "recommended": self.recommended, "fallback": self.fallback}
        return None if self.knob_start is None else starts[self.knob_start]

    def settings(self) -> list[Evaluation]:
        """Return every setting of the advice, each once."""
        found = [self.present, self.recommended, self.fallback, *self.knobs, *self.others.values()]
        return list({_key(each): each for each in found if each is not None}.values())


def _key(point: Evaluation) -> tuple[str, str]:
    """Return engine and settings of an evaluation, which are equal for equal runs."""
    return point.engine, point.asked.model_dump_json()


def _advise(request: _Request) -> Advice:
    """Measure, and return the advice; after Ctrl-C, of what was measured before."""
    scene, engine = request.scene, request.engine
    require_memory(scene, request.present, 4 * len(scene.bodies))
    request.on_progress(Progress("forecast"))
    is_able = not ENGINES[engine].missing(scene, scene.solver)
    risks = forecast(scene, scene.solver, engine, request.fps) if is_able else []
    request.on_progress(Progress("the truth"))
    score = _score(request)
    request.on_progress(Progress("the present setting"))
    measured = _Measured(risks, game_notes(scene, engine), _evaluate_present(request, score))
    try:
        _search(request, score, measured)
        if not measured.interrupted:
            _turn_knobs(request, score, measured)
            _find_excess(request, score, measured)
            _replay_actions(request, measured)
            _time_settings(request, measured)
    except KeyboardInterrupt:
        measured.interrupted = True
    return _advice(request, score, measured)


def _score(request: _Request) -> _Score:
    """Find the truth and choose the metric: positions, or an invariant if no truth is trusted for some frames."""
    scene, present, loop = request.scene, request.present, request.loop
    tolerance = min(default_tolerance(scene), request.length)
    shared = _shared_settings(request)
    truth = find_truth(scene, shared or loop, tolerance)
    own = truth if shared is not None else find_truth(scene, present, tolerance)
    context, present_context = (_context(scene, each, request.zoom) for each in (truth, own))
    trusted = truth.trusted_until if isinstance(truth, Truth) else 0.0
    metric, reason = choose_metric(context)
    if trusted >= min(MIN_TRUSTED_FRAMES * request.frame, scene.world.duration) and context.moving.any():
        invariant = metric.name if trusted < scene.world.duration and metric.name != "max_position" else None
        limit = None if invariant is None else _limit(metric, request)
        return _Score("max_position", request.length, None, invariant, limit, context, present_context, truth)
    if metric.name == "max_position":  # until a time at which hardly anything has moved
        metric = METRICS["energy"]
    return _Score(metric.name, _limit(metric, request), reason, None, None, context, present_context, truth)


def _limit(metric: Metric, request: _Request) -> float:
    """Return the tolerance of a metric: that of positions for a length, otherwise the default."""
    return request.length if metric.unit == "m" else DEFAULT_TOLERANCES[metric.unit]


def _context(scene: Scene, truth: Truth | str, zoom: float) -> EvaluationContext:
    known, doubt = (truth, None) if isinstance(truth, Truth) else (None, truth)
    return EvaluationContext(scene, known, zoom, doubt)


def _shared_settings(request: _Request) -> Settings | None:
    """Return settings whose frames contain those of the game and of the present setting.

    None if these would be too many frames: each then has a truth of its own.
    """
    if request.is_in_loop:
        return request.loop
    steps = [Fraction(each).limit_denominator(MAX_DENOMINATOR) for each in (request.frame, request.scene.solver.dt)]
    if any(
        abs(float(each) * rate - 1.0) > SAME_STEP
        for each, rate in zip(steps, (request.fps, 1.0 / request.scene.solver.dt), strict=True)
    ):
        return None
    a, b = steps
    shared = Fraction(math.gcd(a.numerator * b.denominator, b.numerator * a.denominator), a.denominator * b.denominator)
    frames = request.scene.world.duration / float(shared) * len(request.scene.bodies)
    if a / shared > MAX_SHARED_FACTOR or frames > MAX_SHARED_FRAMES:
        return None
    try:
        return request.loop.replace(dt=float(shared))
    except ValidationError:  # shorter than a dt may be
        return None


def _evaluate_present(request: _Request, score: _Score) -> Evaluation:
    """Measure the present setting, with its own dt."""
    scene, engine, present = request.scene, request.engine, request.present
    missing = ENGINES[engine].missing(scene, present)
    if missing:
        return refused_evaluation(engine, present, "; ".join(missing))
    space = SearchSpace(scene, present, (engine,), request.frame)
    limit = max(request.effort, MIN_RUN_COST)
    return evaluate(space.starts()[0], space, [score.present], score.metric, limit)


def _search(request: _Request, score: _Score, measured: _Measured) -> None:
    """Search for the cheapest setting of every engine, and choose the recommended one of the present engine."""
    left = request.deadline - clock_without_compilation()
    if left <= 0.0:
        return
    engines = [request.engine, *(name for name in ENGINES if name != request.engine)]
    found = tradeoff(
        request.scene,
        engines,
        metric=score.metric,
        tolerance=score.tolerance,
        budget=request.budget,
        fps=request.fps,
        zoom=request.zoom,
        effort=request.effort,
        time_limit=None if math.isinf(left) else left,
        repeats=min(SEARCH_REPEATS, request.repeats),
        truth=score.truth,
        has_fixed_dt=True,
        is_explained=False,
        on_progress=request.on_progress,
        **request.loop.model_dump(),
    )
    measured.found, measured.interrupted = found, found.interrupted
    objective = Objective(found.metric, found.tolerance, request.budget, request.fps, FRAME_TOLERANCE * request.frame)
    for name in engines:
        points = [point for point in found.points if point.engine == name and point.status != "refused"]
        cheapest = found.cheapest_by_engine.get(name)
        nearest = nearest_to_tolerance(points, objective)
        if name != request.engine:
            best = cheapest or nearest
            if best is not None:
                measured.others[name] = best.point
            continue
        measured.recommended = None if cheapest is None else cheapest.point
        measured.fallback, measured.fallback_kind = _fallback(points, objective, score, cheapest is not None)


def _fallback(
    points: Sequence[Evaluation], objective: Objective, score: _Score, has_cheapest: bool
) -> tuple[Evaluation | None, FallbackKind | None]:
    """Return another setting, in case that the recommended one is missing or over the budget.

    In a chaotic scene without a setting within the tolerance it is the cheapest that keeps the invariant, because
    position errors there are as large with any setting.
    """
    if not has_cheapest and score.invariant is not None and score.invariant_tolerance is not None:
        by_invariant = [replace(point, error=point.metrics.get(score.invariant)) for point in points]
        other = objective._replace(metric=METRICS[score.invariant], tolerance=score.invariant_tolerance)
        kept = recommend_cheapest(by_invariant, other, (), lambda point: point.ranking_error)
        is_affordable = kept is not None and (
            objective.budget is None or kept.point.frame_time(objective.fps) <= objective.budget
        )
        if kept is not None and is_affordable:
            return next(point for point in points if _key(point) == _key(kept.point)), "invariant"
    affordable = recommend_most_accurate(points, objective, (), lambda point: point.ranking_error)
    if affordable is not None:
        return affordable.point, "budget"
    nearest = None if has_cheapest else nearest_to_tolerance(points, objective)
    return (None, None) if nearest is None else (nearest.point, "accuracy")


def _turn_knobs(request: _Request, score: _Score, measured: _Measured) -> None:
    """Measure every single change of the present setting, or of the recommended one if the present dt is no frame."""
    if request.is_in_loop and measured.present.status == "ok":
        measured.knob_start = "present"
    elif measured.recommended is not None:
        measured.knob_start = "recommended"
    elif measured.fallback is not None:
        measured.knob_start = "fallback"
    if measured.start is None or measured.found is None:
        return
    space = SearchSpace(request.scene, request.loop, (request.engine,), request.frame, has_fixed_dt=True)
    configuration = measured.start.configuration
    known = {point.configuration: point for point in measured.found.points}
    for neighbour in [*space.neighbours(configuration), *_pymunk_slop(space, configuration)]:
        if neighbour in known:
            measured.knobs.append(known[neighbour])
            continue
        if clock_without_compilation() > request.deadline:
            measured.untried_knobs += 1
            continue
        request.on_progress(Progress(f"knobs: {_change(space.resolved(configuration), space.resolved(neighbour))}"))
        limit = max(RUN_FRACTION * request.effort, 2.0 * measured.start.counted_seconds)
        measured.knobs.append(evaluate(neighbour, space, [score.context], score.metric, limit, request.deadline))
    if measured.recommended is None and not is_random(request.scene):  # other seeds would have to confirm it
        within = [each for each in measured.knobs if each.ranking_error <= score.tolerance]
        measured.recommended = min(within, key=lambda each: each.counted_seconds, default=None)


def _find_excess(request: _Request, score: _Score, measured: _Measured) -> None:
    """Find the time from which on the errors of the present setting and of the fallback exceed the tolerance."""
    if score.metric != "max_position":
        return
    for point, context in ((measured.present, score.present), (measured.fallback, score.context)):
        if point is None or point.error is None or point.error <= score.tolerance:
            continue
        limit = 2.0 * max(point.counted_seconds, MIN_RUN_COST)
        found, _ = bounded_run(request.scene, point.engine, point.asked, limit, audit=False)
        excess = context.errors(found).first_above(score.tolerance, context.until)
        if excess is not None:
            measured.within_until[_key(point)] = excess


def _pymunk_slop(space: SearchSpace, configuration: Configuration) -> list[Configuration]:
    """Return the configuration with pymunk's own slop, which a game has that does not set it."""
    if configuration.engine != "pymunk" or not space.has_contacts:
        return []
    slop = PYMUNK_DEFAULTS["collision_slop"]
    changed, present = configuration.with_option("slop", slop), space.resolved(configuration).slop
    is_known = present is not None and math.isclose(present, slop, rel_tol=SAME_VALUE)  # pymunk keeps 32 bits of it
    is_new = space.is_valid(changed) and not is_known
    return [changed] if is_new else []


def _replay_actions(request: _Request, measured: _Measured) -> None:
    """Run the present and the recommended setting with the actions of a recording."""
    if request.recording is None or not request.recording.actions:
        return
    actions = tuple(each for each in request.recording.actions if not isinstance(each, Switch))
    chosen = measured.recommended or measured.fallback
    named = {"present": measured.present, "recommended" if measured.recommended else "fallback": chosen}
    for name, each in named.items():
        if each is None or each.status == "refused":
            continue
        request.on_progress(Progress(f"the recording with the {name} setting"))
        try:
            found = run(request.scene, request.engine, actions=actions, **each.asked.model_dump())
        except TooLargeError as error:
            measured.replays.append(ReplayedActions(name, "failed", str(error), None))
        else:
            missed = found.missed_contacts if found.status == "ok" else None
            measured.replays.append(ReplayedActions(name, found.status, found.reason, missed))


def _time_settings(request: _Request, measured: _Measured) -> None:
    """Time every setting of the advice in turns, so that their ratios do not depend on the load of the machine."""
    request.on_progress(Progress("timing"))
    successful = [each for each in measured.settings() if each.status == "ok"]
    once = sum(each.counted_seconds for each in successful)
    affordable = int(TIMING_FRACTION * request.effort / once) if once else request.repeats
    repeats = min(request.repeats, max(MIN_REPEATS, affordable))
    timings = time_in_turns([TimedRun(request.scene, each.engine, each.asked) for each in successful], repeats)
    measured.timed = {
        _key(each): each.with_timing(timing)
        for each, timing in zip(successful, timings, strict=True)
        if timing is not None
    }


def _advice(request: _Request, score: _Score, measured: _Measured) -> Advice:
    """Return the advice of what was measured."""
    scene, truth, found, metric = request.scene, score.truth, measured.found, METRICS[score.metric]
    present = _measured_setting(measured.present, score, measured, request)
    recommended, fallback = (
        None if each is None else _measured_setting(each, score, measured, request)
        for each in (measured.recommended, measured.fallback)
    )
    chosen = recommended or fallback
    advice = Advice(
        scene=scene.title,
        engine=request.engine,
        fps=request.fps,
        zoom=request.zoom,
        metric=metric.name,
        metric_about=metric.about,
        metric_reason=score.reason,
        unit=metric.unit,
        tolerance=score.tolerance,
        tolerance_px=score.tolerance * request.zoom if metric.unit == "m" else None,
        budget=request.budget,
        invariant=score.invariant,
        invariant_tolerance=score.invariant_tolerance,
        truth=truth.kind if isinstance(truth, Truth) else None,
        truth_about=truth.about if isinstance(truth, Truth) else truth,
        trusted_until=truth.trusted_until if isinstance(truth, Truth) else None,
        duration=scene.world.duration,
        risks=tuple(measured.risks),
        notes=tuple(measured.notes),
        present=present,
        is_in_loop=request.is_in_loop,
        recommended=recommended,
        fallback=fallback,
        fallback_kind=measured.fallback_kind,
        remaining_risks=_remaining_risks(request, chosen),
        knob_start=measured.knob_start,
        knob_setting=None if measured.start is None else _measured_setting(measured.start, score, measured, request),
        knobs=_knobs(request, score, measured),
        others=_other_engines(request, score, measured),
        code=_code(request, chosen),
        recorded_actions=0 if request.recording is None else len(request.recording.actions),
        replays=tuple(measured.replays),
        tried=0 if found is None else sum(point.status != "refused" for point in found.points),
        untried=measured.untried_knobs + (0 if found is None else found.untried),
        out_of_time=clock_without_compilation() > request.deadline,
        interrupted=measured.interrupted,
        machine=machine(),
        versions=versions(),
    )
    return replace(advice, fallback=None, fallback_kind=None) if advice.is_met else advice


def _measured_setting(point: Evaluation, score: _Score, measured: _Measured, request: _Request) -> MeasuredSetting:
    """Return an evaluation with its error on the screen, and its cost if it was timed."""
    is_length = METRICS[score.metric].unit == "m"
    timed, present = measured.timed.get(_key(point)), measured.timed.get(_key(measured.present))
    return MeasuredSetting(
        engine=point.engine,
        settings=point.settings,
        asked=point.asked,
        status=point.status,
        reason=point.reason,
        error=point.error,
        error_px=point.error * request.zoom if is_length and point.error is not None else None,
        invariant=None if score.invariant is None else point.metrics.get(score.invariant),
        missed_contacts=point.metrics.get("missed_contacts"),
        within_until=measured.within_until.get(_key(point)),
        frame_ms=None if timed is None else timed.frame_time(request.fps),
        ratio=_ratio(None if timed is None else timed.cost_median, None if present is None else present.cost_median),
        repeats=0 if timed is None else timed.repeats,
    )


def _ratio(value: float | None, base: float | None) -> float | None:
    """Return value / base; None if one is unknown or the base is 0."""
    return value / base if value is not None and base else None


def _remaining_risks(request: _Request, chosen: MeasuredSetting | None) -> tuple[Risk, ...]:
    if chosen is None:
        return ()
    return tuple(formula_forecast(request.scene, chosen.asked, chosen.engine, request.fps))


def _code(request: _Request, chosen: MeasuredSetting | None) -> GameCode | None:
    if chosen is None:
        return None
    is_slop_stated = request.scene.solver.slop is not None
    return game_code(chosen.engine, chosen.settings, request.fps, request.zoom, is_slop_stated)


def _knobs(request: _Request, score: _Score, measured: _Measured) -> tuple[Knob, ...]:
    """Return the effect of each knob that was measured."""
    if measured.start is None:
        return ()
    start, found = _measured_setting(measured.start, score, measured, request), []
    for point in measured.knobs:
        setting = _measured_setting(point, score, measured, request)
        cost_ratio = _ratio(setting.frame_ms, start.frame_ms)
        error_ratio = _ratio(setting.error, start.error)
        found.append(Knob(_change(start.settings, setting.settings), setting, cost_ratio, error_ratio))
    return tuple(found)


def _change(before: Settings, after: Settings) -> str:
    """Return the differences of two resolved settings: `substeps 4 → 8`."""
    old, new = before.model_dump(), after.model_dump()
    names = [key for key in old if old[key] != new[key] and key not in ("dt", "record_every")]
    return ", ".join(f"{key} {_value(old[key])} → {_value(new[key])}" for key in names)


def _value(value: object) -> str:
    return "default" if value is None else format_value(value)


def _other_engines(request: _Request, score: _Score, measured: _Measured) -> tuple[OtherEngine, ...]:
    """Return the price of every engine but the present one."""
    if measured.found is None:
        return ()
    refused = {point.engine: point.reason for point in measured.found.points if point.status == "refused"}
    found = []
    for name in ENGINES:
        point = measured.others.get(name)
        if name == request.engine:
            continue
        setting = None if point is None else _measured_setting(point, score, measured, request)
        is_within = setting is not None and setting.error is not None and setting.error <= score.tolerance
        found.append(OtherEngine(name, setting, is_within, refused.get(name)))
    return tuple(found)
