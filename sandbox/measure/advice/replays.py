"""Replays: settings run with the actions of a recording, from its start and from perturbed ones."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple

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
    It departs sooner if it does in most of the perturbed starts; without any, from that of the recording.
    """
    if request.recording is None or not request.recording.actions:
        return
    measured.is_still_without_actions = _is_still(request, measured)
    finer, starts = _finer_replay(request, measured), _StartReplays(request, measured.present)
    if measured.present.status != "refused":
        _replay(request, measured, starts, "present", measured.present, finer if request.is_in_loop else None)
    if measured.is_still_without_actions:  # no error says anything about the game, so that nothing is recommended
        measured.recommended = measured.fallback = measured.fallback_kind = None
        for point in _finer_settings(request, score, finer):
            _replay(request, measured, starts, "tried", point, finer)
        return
    for candidate in _candidates(request, score, measured):
        if _replay(request, measured, starts, "recommended", candidate, finer):
            measured.recommended = candidate
            return
        measured.replays[-1] = replace(measured.replays[-1], setting="rejected")
    if measured.recommended is not None:
        measured.fallback, measured.fallback_kind, measured.recommended = measured.recommended, "actions", None
    elif measured.fallback is not None:
        _replay(request, measured, starts, "fallback", measured.fallback, finer)


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
    return None if factor is None else _run_with_substeps(request, factor * request.loop.substeps)


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
    return _run_with_substeps(request, substeps)


def _run_with_substeps(
    request: AdviceRequest, substeps: int, starts: Starts | None = None, number: int = 0
) -> Trajectory | None:
    """Return the run of the game's loop with the actions and so many substeps; None if there is none that is ok.

    Args:
        request: the request.
        substeps: substeps of a frame.
        starts: perturbed starts; None for that of the recording.
        number: number of the start.
    """
    if ENGINES[request.engine].missing(request.scene, request.loop) or clock_without_compilation() > request.deadline:
        return None
    request.on_progress(Progress("the recording with finer steps"))
    try:
        finer = request.loop.replace(substeps=substeps)
        scene, actions = request.scene, _actions(request)
        if starts is not None:
            scene, actions = starts.start(number), starts.actions(actions, number)
        found = run(scene, request.engine, audit=False, actions=actions, **finer.model_dump())
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
    request: AdviceRequest,
    measured: AdviceMeasurements,
    starts: "_StartReplays",
    name: str,
    point: Evaluation,
    finer: Trajectory | None,
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
    replayed = ReplayedActions(name, text, found.status, found.reason, missed)
    finer = _finer_than(request, measured, point, finer) if found.status == "ok" else None
    if finer is not None:
        own = _departure(found, finer, request.length)
        replayed = replace(
            replayed,
            finer_substeps=finer.info["settings"]["substeps"],
            departs_at=own.time,
            departed=own.body,
            farthest=own.farthest,
        )
    if found.status == "ok" and (name == "present" or not missed):
        clean, sooner = starts.run(point, replayed.finer_substeps)
        replayed = replace(replayed, over_starts=clean, sooner_over_starts=sooner)
    measured.replays.append(replayed)
    return found.status == "ok" and not missed and not _is_faulty(replayed, measured.replays[0])


@dataclass
class _StartReplays:
    """Runs from perturbed starts, with the actions up to a frame later.

    Counted work bounds their number, and that of the runs with finer steps that they are compared to.
    """

    request: AdviceRequest
    present: Evaluation
    """present setting, whose runs are the first"""
    departures: dict[int, float] = field(default_factory=dict)
    """s, time at which the present setting departs from the run with finer steps, by start; inf if it does not"""
    finer: dict[tuple[int, int], Trajectory | None] = field(default_factory=dict)
    """runs with finer steps, by start and substeps; None for those that failed"""

    def run(self, point: Evaluation, substeps: int | None) -> tuple[Proportion | None, Proportion | None]:
        """Return in how many starts a setting misses no contact, and in how many it departs sooner than the present.

        Each is None if the effort allows fewer starts than `MIN_STARTS` and than asked for; the second one also for the
        present setting.

        Args:
            point: the setting.
            substeps: substeps of the runs with finer steps; None for no comparison.
        """
        request = self.request
        drawn, actions = Starts(request.scene, request.spread, request.frame), _actions(request)
        departures: dict[int, float] = {}
        hits, trials, compared = 0, 0, self._comparable(point, substeps)
        for number in range(1, self._affordable(point.counted_seconds) + 1):
            if clock_without_compilation() > request.deadline:
                break
            later = drawn.actions(actions, number)
            found = run(drawn.start(number), request.engine, actions=later, **point.asked.model_dump())
            hits += found.status == "ok" and not found.missed_contacts
            trials += 1
            if substeps is None or number > compared:
                continue
            if (number, substeps) not in self.finer:
                self.finer[number, substeps] = _run_with_substeps(request, substeps, drawn, number)
            finer = self.finer[number, substeps]
            if finer is not None:
                time = _departure(found, finer, request.length).time
                ends_at = math.inf if found.status == "ok" else float(found.time[-1])
                departures[number] = ends_at if time is None else time
        clean = Proportion(hits, trials) if trials else None
        if point is self.present:
            self.departures = departures
            return clean, None
        pairs = [(departures[number], self.departures[number]) for number in departures if number in self.departures]
        sooner = sum(own < MAX_HASTE * present for own, present in pairs)
        return clean, Proportion(sooner, len(pairs)) if pairs else None

    def _comparable(self, point: Evaluation, substeps: int | None) -> int:
        """Return the number of starts in which the effort allows to compare a setting to runs with finer steps."""
        if substeps is None:
            return 0
        factor = substeps / self.request.loop.substeps
        return self._affordable(point.counted_seconds + factor * self.present.counted_seconds)

    def _affordable(self, cost: float) -> int:
        request = self.request
        return affordable_starts(request.starts, request.effort, cost) if request.starts > 1 else 0


class _Departure(NamedTuple):
    """Departure of a run from another one."""

    time: float | None
    """s, from which on a body is farther than the tolerance from its place in the other run; None if none is"""
    body: str | None
    """that body"""
    farthest: float
    """m, largest distance of a body"""


def _departure(found: Trajectory, finer: Trajectory, tolerance: float) -> _Departure:
    """Return the departure of a run from that with finer steps; bodies count while they are in both."""
    rows, finer_rows = common_frames(found, finer)
    names = [name for name in found.names.tolist() if name in set(finer.names.tolist())]
    own, other = ([each.names.tolist().index(name) for name in names] for each in (found, finer))
    difference = found.position[rows][:, own] - finer.position[finer_rows][:, other]
    distance = np.hypot(difference[..., 0], difference[..., 1])
    present = found.present(rows)[:, own] & finer.present(finer_rows)[:, other]
    distance = np.where(present & np.isfinite(distance), distance, 0.0)
    beyond, farthest = distance > tolerance, float(distance.max(initial=0.0))
    if not beyond.any():
        return _Departure(None, None, farthest)
    frame = int(beyond.any(axis=1).argmax())
    return _Departure(float(found.time[rows][frame]), names[int(distance[frame].argmax())], farthest)


def _is_faulty(replayed: ReplayedActions, present: ReplayedActions) -> bool:
    """Return whether a setting misses contacts in too many starts, or departs much sooner than the present one.

    In a single start chance decides which of two equal settings departs first; so where there are other starts, it is
    most of these that count.
    """
    clean, sooner = replayed.over_starts, replayed.sooner_over_starts
    if clean is not None and clean.trials - clean.hits > allowed_failures(clean.trials):
        return True
    return _is_hasty(replayed, present) if sooner is None else 2 * sooner.hits > sooner.trials


def _is_hasty(replayed: ReplayedActions, present: ReplayedActions) -> bool:
    """Return whether a setting departs from the run with finer steps much sooner than the present one."""
    if replayed.departs_at is None or present.finer_substeps is None:
        return False
    return present.departs_at is None or replayed.departs_at < MAX_HASTE * present.departs_at
