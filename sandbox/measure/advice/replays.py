"""Replays: settings run with the actions of a recording, from its start and from perturbed ones."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from sandbox.action import Action, Switch
from sandbox.engines.common.compile_clock import clock_without_compilation
from sandbox.engines.registry import ENGINES
from sandbox.measure.advice.assembly import AdviceMeasurements, evaluation_key
from sandbox.measure.advice.result import ReplayedActions
from sandbox.measure.advice.scoring import SAME_STEP, AdviceRequest, AdviceScore
from sandbox.measure.advice.text import setting_text
from sandbox.measure.compare.metrics import displacement
from sandbox.measure.metrics.trajectory_error import common_frames
from sandbox.measure.proportion import Proportion
from sandbox.measure.run.bounded_run import bounded_run
from sandbox.measure.run.recorder import TooLargeError
from sandbox.measure.run.runner import run
from sandbox.measure.starts import Starts, allowed_failures
from sandbox.measure.tradeoff.configuration import Evaluation, SearchSpace, evaluate
from sandbox.measure.tradeoff.recommendation import by_cost
from sandbox.measure.tradeoff.search import MIN_RUN_COST, RUN_FRACTION
from sandbox.measure.tradeoff.start_trials import affordable_starts
from sandbox.progress import Progress
from sandbox.scene.errors import SettingsError
from sandbox.trajectory import Trajectory

FINER = (8, 4, 2)
"""Factors of the substeps of the run to which replays are compared: the first whose run is within the effort"""
TRIED = (2, 4)
"""Factors of the substeps that are compared to that run where nothing moves without the actions"""
MAX_HASTE = 0.8
"""A setting is rejected if it departs from the finer run within less than this fraction of the time of the present
setting. Departures that chaos has grown differ by less."""
MAX_REPLAYS, MAX_DOUBLINGS = 4, 4
"""Settings that were tried, and settings with twice the substeps each time, that are replayed if one misses contacts"""


def replay_actions(request: AdviceRequest, score: AdviceScore, measured: AdviceMeasurements) -> None:
    """Run the present and the recommended setting with the actions of a recording, and compare them to finer steps.

    A setting that misses contacts then, from the start of the recording or in more than 5 % of the perturbed starts, or
    departs from the run with finer steps much sooner than the present one, is not recommended; the next dearer one is.
    """
    if request.recording is None or not request.recording.actions:
        return
    measured.is_still_without_actions = _is_still(request, measured)
    finer = _finer_replay(request, measured)
    if measured.present.status != "refused":
        _replay(request, measured, "present", measured.present, finer if request.is_in_loop else None)
    if measured.is_still_without_actions:  # no error says anything about the game, so that nothing is recommended
        measured.recommended = measured.fallback = measured.fallback_kind = None
        for point in _finer_settings(request, score, finer):
            _replay(request, measured, "tried", point, finer)
        return
    for candidate in _candidates(request, score, measured):
        if _replay(request, measured, "recommended", candidate, finer):
            measured.recommended = candidate
            return
        measured.replays[-1] = replace(measured.replays[-1], setting="rejected")
    if measured.recommended is not None:
        measured.fallback, measured.fallback_kind, measured.recommended = measured.recommended, "actions", None
    elif measured.fallback is not None:
        _replay(request, measured, "fallback", measured.fallback, finer)


def _finer_settings(request: AdviceRequest, score: AdviceScore, finest: Trajectory | None) -> Iterator[Evaluation]:
    """Yield the present setting in a loop of frames with more substeps, up to half those of the finest run."""
    space = SearchSpace(request.scene, request.loop, (request.engine,), request.frame, has_fixed_dt=True)
    for factor in TRIED:
        start = space.starts()[0]
        finer = replace(start, substeps=factor * start.substeps)
        is_finest = finest is not None and 2 * finer.substeps > finest.info["settings"]["substeps"]
        if is_finest or not space.is_valid(finer) or clock_without_compilation() > request.deadline:
            return
        yield evaluate(finer, space, [score.context], score.metric, score.tolerance, request.effort, request.deadline)


def _is_still(request: AdviceRequest, measured: AdviceMeasurements) -> bool:
    """Return whether no body moves farther than the tolerance of positions without the actions."""
    limit = 2.0 * max(measured.present.counted_seconds, MIN_RUN_COST)
    found, _ = bounded_run(request.scene, request.engine, measured.present.asked, limit, audit=False)
    return found.status == "ok" and bool((displacement(found, since=0.0) <= request.length).all())


def _finer_replay(request: AdviceRequest, measured: AdviceMeasurements) -> Trajectory | None:
    """Return the run with the actions and finer steps; None if it costs more than the effort or the time, or fails."""
    per_run = measured.present.counted_seconds
    factor = next((each for each in FINER if each * per_run <= request.effort), None)
    return None if factor is None else _replay_with_substeps(request, factor * request.loop.substeps)


def _finer_than(
    request: AdviceRequest, measured: AdviceMeasurements, point: Evaluation, finer: Trajectory | None
) -> Trajectory | None:
    """Return a run with the actions and at most half the step of a setting: the finer run or another; None as there."""
    if finer is None:
        return None
    substeps = math.ceil(2.0 * request.loop.dt / point.settings.h * (1.0 - SAME_STEP))
    if substeps <= finer.info["settings"]["substeps"]:
        return finer
    if substeps / request.loop.substeps * measured.present.counted_seconds > request.effort:
        return None
    return _replay_with_substeps(request, substeps)


def _replay_with_substeps(request: AdviceRequest, substeps: int) -> Trajectory | None:
    """Return the run of the game's loop with the actions and so many substeps; None if there is none that is ok."""
    if ENGINES[request.engine].missing(request.scene, request.loop) or clock_without_compilation() > request.deadline:
        return None
    request.on_progress(Progress("the recording with finer steps"))
    try:
        finer = request.loop.replace(substeps=substeps)
        found = run(request.scene, request.engine, audit=False, actions=_actions(request), **finer.model_dump())
    except (TooLargeError, SettingsError):  # more memory, or more substeps, than there may be
        return None
    return found if found.status == "ok" else None


def _actions(request: AdviceRequest) -> tuple[Action, ...]:
    """Return the actions of the recording, without switches of the engine."""
    assert request.recording is not None
    return tuple(each for each in request.recording.actions if not isinstance(each, Switch))


def _candidates(request: AdviceRequest, score: AdviceScore, measured: AdviceMeasurements) -> Iterator[Evaluation]:
    """Yield the recommended setting, dearer ones that were tried, and the last of them with more substeps."""
    if measured.recommended is None or measured.found is None:
        return
    tried = [*measured.found.points, *measured.knobs]
    within = by_cost([each for each in tried if each.engine == request.engine and each.meets(score.max_error)])
    keys = [evaluation_key(each) for each in within]
    begin = keys.index(evaluation_key(measured.recommended)) + 1 if evaluation_key(measured.recommended) in keys else 0
    last = measured.recommended
    yield last
    for last in within[begin : begin + MAX_REPLAYS]:
        yield last
    space = SearchSpace(request.scene, request.loop, (request.engine,), request.frame, has_fixed_dt=True)
    for _ in range(MAX_DOUBLINGS):
        finer = replace(last.configuration, substeps=2 * last.configuration.substeps)
        if not space.is_valid(finer) or clock_without_compilation() > request.deadline:
            return
        limit = 2.0 * RUN_FRACTION * request.effort
        last = evaluate(finer, space, [score.context], score.metric, score.tolerance, limit, request.deadline)
        if last.meets(score.max_error):
            yield last


def _replay(
    request: AdviceRequest, measured: AdviceMeasurements, name: str, point: Evaluation, finer: Trajectory | None
) -> bool:
    """Run a setting with the actions of the recording; return whether it may be recommended."""
    request.on_progress(Progress(f"the recording with the {name} setting"))
    text = setting_text(point, request.fps)
    try:
        found = run(request.scene, request.engine, actions=_actions(request), **point.asked.model_dump())
    except TooLargeError as error:
        measured.replays.append(ReplayedActions(name, text, "failed", str(error), None))
        return False
    missed = found.missed_contacts if found.status == "ok" else None
    over_starts = _over_starts(request, point) if found.status == "ok" and (name == "present" or not missed) else None
    replayed = ReplayedActions(name, text, found.status, found.reason, missed, over_starts)
    if found.status == "ok" and (finer := _finer_than(request, measured, point, finer)) is not None:
        replayed = _compared(replayed, found, finer, request.length)
    measured.replays.append(replayed)
    is_clean = found.status == "ok" and not missed
    if over_starts is not None and over_starts.trials - over_starts.hits > allowed_failures(over_starts.trials):
        is_clean = False
    return is_clean and not _is_hasty(replayed, measured.replays[0])


def _over_starts(request: AdviceRequest, point: Evaluation) -> Proportion | None:
    """Return from how many perturbed starts, with the actions up to a frame later, a setting misses no contact.

    Counted work bounds the number of starts; None if it allows fewer than `MIN_STARTS` and than asked for.
    """
    count = affordable_starts(request.starts, request.effort, point.counted_seconds) if request.starts > 1 else 0
    drawn, hits, trials = Starts(request.scene, request.spread, request.frame), 0, 0
    for number in range(1, count + 1):
        if clock_without_compilation() > request.deadline:
            break
        actions = drawn.actions(_actions(request), number)
        found = run(drawn.start(number), request.engine, actions=actions, **point.asked.model_dump())
        hits += found.status == "ok" and not found.missed_contacts
        trials += 1
    return Proportion(hits, trials) if trials else None


def _compared(replayed: ReplayedActions, found: Trajectory, finer: Trajectory, tolerance: float) -> ReplayedActions:
    """Return a replay with its departure from the run with finer steps; bodies count while they are in both."""
    rows, finer_rows = common_frames(found, finer)
    names = [name for name in found.names.tolist() if name in set(finer.names.tolist())]
    own, other = ([each.names.tolist().index(name) for name in names] for each in (found, finer))
    difference = found.position[rows][:, own] - finer.position[finer_rows][:, other]
    distance = np.hypot(difference[..., 0], difference[..., 1])
    present = found.present(rows)[:, own] & finer.present(finer_rows)[:, other]
    distance = np.where(present & np.isfinite(distance), distance, 0.0)
    beyond = distance > tolerance
    frame = int(beyond.any(axis=1).argmax())
    has_departed = bool(beyond.any())
    return replace(
        replayed,
        finer_substeps=finer.info["settings"]["substeps"],
        departs_at=float(found.time[rows][frame]) if has_departed else None,
        departed=names[int(distance[frame].argmax())] if has_departed else None,
        farthest=float(distance.max(initial=0.0)),
    )


def _is_hasty(replayed: ReplayedActions, present: ReplayedActions) -> bool:
    """Return whether a setting departs from the run with finer steps much sooner than the present one."""
    if replayed.departs_at is None or present.finer_substeps is None:
        return False
    return present.departs_at is None or replayed.departs_at < MAX_HASTE * present.departs_at
