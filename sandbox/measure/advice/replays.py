"""Runs of settings with the actions of a recording: a setting that misses contacts then is not recommended."""

from collections.abc import Iterator
from dataclasses import replace

from sandbox.action import Switch
from sandbox.measure.advice.assembly import AdviceMeasurements, evaluation_key
from sandbox.measure.advice.result import ReplayedActions
from sandbox.measure.advice.scoring import AdviceRequest, AdviceScore
from sandbox.measure.advice.text import setting_text
from sandbox.measure.run.bounded_run import clock_without_compilation
from sandbox.measure.run.recorder import TooLargeError
from sandbox.measure.run.runner import run
from sandbox.measure.tradeoff.configuration import Evaluation, SearchSpace, evaluate
from sandbox.measure.tradeoff.recommendation import by_cost
from sandbox.measure.tradeoff.search import RUN_FRACTION
from sandbox.progress import Progress

MAX_REPLAYS, MAX_DOUBLINGS = 4, 4
"""Settings that were tried, and settings with twice the substeps each time, that are replayed if one misses contacts"""


def replay_actions(request: AdviceRequest, score: AdviceScore, measured: AdviceMeasurements) -> None:
    """Run the present and the recommended setting with the actions of a recording.

    A setting that misses contacts then is not recommended; the next dearer one is.
    """
    if request.recording is None or not request.recording.actions:
        return
    if measured.present.status != "refused":
        _replay(request, measured, "present", measured.present)
    for candidate in _candidates(request, score, measured):
        if _replay(request, measured, "recommended", candidate):
            measured.recommended = candidate
            return
        measured.replays[-1] = replace(measured.replays[-1], setting="rejected")
    if measured.recommended is not None:
        measured.fallback, measured.fallback_kind, measured.recommended = measured.recommended, "actions", None
    elif measured.fallback is not None:
        _replay(request, measured, "fallback", measured.fallback)


def _candidates(request: AdviceRequest, score: AdviceScore, measured: AdviceMeasurements) -> Iterator[Evaluation]:
    """Yield the recommended setting, dearer ones that were tried, and the last of them with more substeps."""
    if measured.recommended is None or measured.found is None:
        return
    tried = [*measured.found.points, *measured.knobs]
    within = by_cost([each for each in tried if each.engine == request.engine and each.meets(score.tolerance)])
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
        if last.meets(score.tolerance):
            yield last


def _replay(request: AdviceRequest, measured: AdviceMeasurements, name: str, point: Evaluation) -> bool:
    """Run a setting with the actions of the recording; return whether it reaches the end without a missed contact."""
    assert request.recording is not None
    request.on_progress(Progress(f"the recording with the {name} setting"))
    actions = tuple(each for each in request.recording.actions if not isinstance(each, Switch))
    text = setting_text(point, request.fps)
    try:
        found = run(request.scene, request.engine, actions=actions, **point.asked.model_dump())
    except TooLargeError as error:
        measured.replays.append(ReplayedActions(name, text, "failed", str(error), None))
        return False
    missed = found.missed_contacts if found.status == "ok" else None
    measured.replays.append(ReplayedActions(name, text, found.status, found.reason, missed))
    return found.status == "ok" and not missed
