"""Study behind the advice for a game: forecast, present setting, search at the dt of a frame, knobs, other engines.

The search, the truth and the costs are those of `measure.tradeoff`; the settings that it tries have dt = 1/fps, so that
a game steps once a frame and substeps divide the step.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from sandbox.engines.common.compile_clock import clock_without_compilation
from sandbox.engines.pymunk_adapter.engine import SPACE_DEFAULTS, is_space_default
from sandbox.engines.registry import ENGINES, able, engine_named
from sandbox.measure.advice.assembly import (
    AdviceMeasurements,
    assemble_advice,
    evaluation_key,
    settings_change,
)
from sandbox.measure.advice.forecast import forecast, game_notes
from sandbox.measure.advice.replays import replay_actions
from sandbox.measure.advice.result import Advice, FallbackKind
from sandbox.measure.advice.scoring import SAME_STEP, AdviceRequest, AdviceScore, find_score
from sandbox.measure.compare.end_statistics import end_ensemble
from sandbox.measure.compare.metrics import METRICS
from sandbox.measure.run.bounded_run import bounded_run
from sandbox.measure.run.recorder import require_memory
from sandbox.measure.run.sessions import recorded_scene
from sandbox.measure.starts import DEFAULT_SPREAD, DEFAULT_STARTS, Starts
from sandbox.measure.tradeoff.configuration import (
    MIN_STEPS,
    Configuration,
    Evaluation,
    SearchSpace,
    evaluate,
    refused_evaluation,
)
from sandbox.measure.tradeoff.objective import Objective, check_objective
from sandbox.measure.tradeoff.recommendation import (
    FRAME_TOLERANCE,
    nearest_to_tolerance,
    recommend_cheapest,
    recommend_most_accurate,
)
from sandbox.measure.tradeoff.search import MIN_RUN_COST, RUN_FRACTION
from sandbox.measure.tradeoff.start_trials import ENDS_FRACTION, StartTrials
from sandbox.measure.tradeoff.study import (
    DEFAULT_EFFORT,
    DEFAULT_REPEATS,
    MIN_REPEATS,
    TIMING_FRACTION,
    tradeoff,
)
from sandbox.measure.tradeoff.timing import TimedRun, time_in_turns
from sandbox.progress import Progress, ProgressCallback, ignore_progress
from sandbox.recording import Recording
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import as_scene

DEFAULT_FPS, DEFAULT_ZOOM = 60.0, 50.0
"""Frames per second, and px/m."""
MIN_FPS, MAX_FPS = 0.1, 1e6
"""Bounds of the frame rate: dt = 1/fps must be a valid setting."""
SEARCH_REPEATS = 2
"""Timings of a setting during the search; the settings of the advice are then timed again, all in turns."""


def advise(
    scene: Scene | Recording | str | Path,
    engine: str | None = None,
    *,
    fps: float = DEFAULT_FPS,
    tolerance: float | None = None,
    margin: float = 0.0,
    budget: float | None = None,
    zoom: float = DEFAULT_ZOOM,
    starts: int = DEFAULT_STARTS,
    spread: float = DEFAULT_SPREAD,
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
        margin: fraction of the tolerance that a recommended setting has to leave unused, as of `tradeoff`.
        budget: computing time per frame, ms.
        zoom: px/m, for errors on the screen.
        starts: number of perturbed starts that decide on the recommended setting, as of `tradeoff`.
        spread: largest change of a start, as a fraction, as of `tradeoff`.
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
    played = recorded_scene(scene) if isinstance(scene, Recording) else as_scene(scene)
    if engine is None:
        names = able(played)
        engine = recording.engine if recording else "pymunk" if "pymunk" in names or not names else names[0]
    engine_named(engine)
    tolerance = 1.0 / zoom if tolerance is None and zoom > 0.0 else tolerance
    _check(fps=fps, zoom=zoom, tolerance=tolerance, budget=budget, effort=effort, time_limit=time_limit)
    check_objective(None, None, None, fps, margin)
    if not MIN_FPS <= fps <= MAX_FPS:
        raise ValueError(f"fps is {fps:g}; it must be {MIN_FPS:g} to {MAX_FPS:g}")
    if repeats < 1:
        raise ValueError(f"repeats is {repeats}; it must be at least 1")
    if played.world.duration * fps < MIN_STEPS * (1.0 - SAME_STEP):
        raise ValueError(f"the scene lasts {played.world.duration:g} s, fewer than {MIN_STEPS} frames at {fps:g} fps")
    assert tolerance is not None
    request = AdviceRequest(
        scene=played,
        engine=engine,
        recording=recording,
        fps=fps,
        length=tolerance,
        margin=margin,
        budget=budget,
        zoom=zoom,
        starts=starts,
        spread=spread,
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


def _advise(request: AdviceRequest) -> Advice:
    """Measure, and return the advice; after Ctrl-C, of what was measured before."""
    scene, engine = request.scene, request.engine
    require_memory(scene, request.present, 4 * len(scene.bodies))
    request.on_progress(Progress("forecast"))
    is_able = not ENGINES[engine].missing(scene, scene.solver)
    risks = forecast(scene, scene.solver, engine, request.fps) if is_able else []
    request.on_progress(Progress("the truth"))
    score = find_score(request)
    request.on_progress(Progress("the present setting"))
    measured = AdviceMeasurements(risks, game_notes(scene, engine, request.zoom), _evaluate_present(request, score))
    try:
        _search(request, score, measured)
        if not measured.interrupted:
            _turn_knobs(request, score, measured)
            _find_excess(request, score, measured)
            replay_actions(request, score, measured)
            _time_settings(request, measured)
    except KeyboardInterrupt:
        measured.interrupted = True
    return assemble_advice(request, score, measured)


def _evaluate_present(request: AdviceRequest, score: AdviceScore) -> Evaluation:
    """Measure the present setting, with its own dt."""
    scene, engine, present = request.scene, request.engine, request.present
    missing = ENGINES[engine].missing(scene, present)
    if missing:
        return refused_evaluation(engine, present, "; ".join(missing))
    space = SearchSpace(scene, present, (engine,), request.frame)
    limit = max(request.effort, MIN_RUN_COST)
    return evaluate(space.starts()[0], space, [score.present], score.metric, score.tolerance, limit)


def _search(request: AdviceRequest, score: AdviceScore, measured: AdviceMeasurements) -> None:
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
        margin=request.margin,
        budget=request.budget,
        fps=request.fps,
        zoom=request.zoom,
        starts=request.starts,
        spread=request.spread,
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
    objective = Objective(
        found.metric,
        found.tolerance,
        request.budget,
        request.fps,
        FRAME_TOLERANCE * request.frame,
        margin=request.margin,
    )
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
        if cheapest is not None and not _has_actions(request):  # with actions, replays may choose another one
            measured.ends = cheapest.point.end_statistics
        trials = None if cheapest is not None else _end_trials(request, score, objective)
        measured.fallback, measured.fallback_kind = _fallback(points, objective, score, trials)
        if measured.fallback_kind == "invariant" and measured.fallback is not None and trials is not None:
            measured.ends = trials.end_statistics(measured.fallback, fresh=True)


def _has_actions(request: AdviceRequest) -> bool:
    return request.recording is not None and bool(request.recording.actions)


def _end_trials(request: AdviceRequest, score: AdviceScore, objective: Objective) -> StartTrials:
    """Return the trials that compare the ends of settings over perturbed starts; none for a recording with actions."""
    scene, base = request.scene, request.loop
    drawn = Starts(scene, request.spread, max(base.dt, request.frame))
    count = request.starts if drawn.can_vary and not _has_actions(request) else 1
    ends = end_ensemble(score.context, drawn, base, count, ENDS_FRACTION * request.effort, request.length)
    space = SearchSpace(scene, base, (request.engine,), request.frame, has_fixed_dt=True)
    known = space, score.context, objective, drawn, count, request.length, request.effort, request.deadline
    return StartTrials(*known, ends)


def _fallback(
    points: Sequence[Evaluation], objective: Objective, score: AdviceScore, trials: StartTrials | None
) -> tuple[Evaluation | None, FallbackKind | None]:
    """Return another setting, in case that the recommended one is missing or over the budget.

    In a chaotic scene without a setting within the tolerance it is the cheapest that keeps the invariant and ends like
    the truth, because position errors there are as large with any setting.

    Args:
        points: settings that were tried.
        objective: metric, tolerance and budget.
        score: truth and invariant.
        trials: compare the ends of settings; None if a setting is recommended.
    """
    has_cheapest = trials is None
    if trials is not None and score.invariant is not None and score.invariant_tolerance is not None:
        by_invariant = [replace(point, error=point.metrics.get(score.invariant)) for point in points]
        other = objective._replace(metric=METRICS[score.invariant], tolerance=score.invariant_tolerance)
        kept = recommend_cheapest(by_invariant, other, trials.ends_like_the_truth, lambda _: None)
        is_affordable = kept is not None and (
            objective.budget is None or kept.point.frame_time(objective.fps) <= objective.budget
        )
        if kept is not None and is_affordable:
            return next(point for point in points if evaluation_key(point) == evaluation_key(kept.point)), "invariant"
    affordable = recommend_most_accurate(points, objective, lambda _: True, lambda _: None)
    if affordable is not None:
        return affordable.point, "budget"
    nearest = None if has_cheapest else nearest_to_tolerance(points, objective)
    return (None, None) if nearest is None else (nearest.point, "accuracy")


def _turn_knobs(request: AdviceRequest, score: AdviceScore, measured: AdviceMeasurements) -> None:
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
        request.on_progress(
            Progress(f"knobs: {settings_change(space.resolved(configuration), space.resolved(neighbour))}")
        )
        limit = max(RUN_FRACTION * request.effort, 2.0 * measured.start.counted_seconds)
        measured.knobs.append(
            evaluate(neighbour, space, [score.context], score.metric, score.tolerance, limit, request.deadline)
        )
    if measured.recommended is None and measured.found.starts < 2:  # no other starts would have to confirm it
        within = [each for each in measured.knobs if each.meets(score.max_error)]
        measured.recommended = min(within, key=lambda each: each.counted_seconds, default=None)


def _find_excess(request: AdviceRequest, score: AdviceScore, measured: AdviceMeasurements) -> None:
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
            measured.within_until[evaluation_key(point)] = excess


def _pymunk_slop(space: SearchSpace, configuration: Configuration) -> list[Configuration]:
    """Return the configuration with pymunk's own slop, which a game has that does not set it."""
    if configuration.engine != "pymunk" or not space.has_contacts:
        return []
    slop = SPACE_DEFAULTS["collision_slop"]
    changed, present = configuration.with_option("slop", slop), space.resolved(configuration).slop
    is_known = present is not None and is_space_default("collision_slop", present)
    is_new = space.is_valid(changed) and not is_known
    return [changed] if is_new else []


def _time_settings(request: AdviceRequest, measured: AdviceMeasurements) -> None:
    """Time every setting of the advice in turns, so that their ratios do not depend on the load of the machine."""
    request.on_progress(Progress("timing"))
    successful = [each for each in measured.settings() if each.status == "ok"]
    once = sum(each.counted_seconds for each in successful)
    affordable = int(TIMING_FRACTION * request.effort / once) if once else request.repeats
    repeats = min(request.repeats, max(MIN_REPEATS, affordable))
    timings = time_in_turns([TimedRun(request.scene, each.engine, each.asked) for each in successful], repeats)
    measured.timed = {
        evaluation_key(each): each.with_timing(timing)
        for each, timing in zip(successful, timings, strict=True)
        if timing is not None
    }
