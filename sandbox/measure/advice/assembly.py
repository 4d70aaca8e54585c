"""Measurements of an advice, and the advice made of them; after Ctrl-C of those that there are."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from sandbox.engines.common.compile_clock import clock_without_compilation
from sandbox.engines.registry import ENGINES
from sandbox.measure.advice.forecast import Risk, formula_forecast
from sandbox.measure.advice.game_code import GameCode, game_code
from sandbox.measure.advice.result import (
    Advice,
    FallbackKind,
    Knob,
    KnobStart,
    MeasuredSetting,
    OtherEngine,
    ReplayedActions,
)
from sandbox.measure.advice.scoring import SAME_STEP, AdviceRequest, AdviceScore
from sandbox.measure.compare.end_statistics import EndStatistics
from sandbox.measure.compare.ground_truth import Truth
from sandbox.measure.compare.metrics import METRICS, EvaluationContext
from sandbox.measure.fresh_starts import FreshStarts
from sandbox.measure.starts import Starts
from sandbox.measure.tradeoff.configuration import (
    Evaluation,
)
from sandbox.measure.tradeoff.recommendation import (
    format_value,
)
from sandbox.measure.tradeoff.result import Tradeoff
from sandbox.measure.tradeoff.timing import CostRatio
from sandbox.provenance import machine, versions
from sandbox.scene.description.world import Settings


@dataclass
class AdviceMeasurements:
    """What has been measured so far; after Ctrl-C the advice is made of it."""

    risks: list[Risk]
    notes: list[str]
    present: Evaluation
    found: Tradeoff | None = None
    recommended: Evaluation | None = None
    fallback: Evaluation | None = None
    fallback_kind: FallbackKind | None = None
    ends: EndStatistics | None = None
    knob_start: KnobStart | None = None
    knobs: list[Evaluation] = field(default_factory=list)
    others: dict[str, Evaluation] = field(default_factory=dict)
    replays: list[ReplayedActions] = field(default_factory=list)
    is_still_without_actions: bool = False
    untried_knobs: int = 0
    within_until: dict[tuple[str, str], float] = field(default_factory=dict)
    """s, time from which on the error exceeds the tolerance, by `evaluation_key`"""
    timed: dict[tuple[str, str], Evaluation] = field(default_factory=dict)
    """evaluations with the costs that were timed together, by `evaluation_key`"""
    interrupted: bool = False

    @property
    def start(self) -> Evaluation | None:
        """The setting that the knobs are changed from."""
        starts = {"present": self.present, "recommended": self.recommended, "fallback": self.fallback}
        return None if self.knob_start is None else starts[self.knob_start]

    def settings(self) -> list[Evaluation]:
        """Return every setting of the advice, each once."""
        found = [self.present, self.recommended, self.fallback, *self.knobs, *self.others.values()]
        return list({evaluation_key(each): each for each in found if each is not None}.values())


def evaluation_key(point: Evaluation) -> tuple[str, str]:
    """Return engine and settings of an evaluation, which are equal for equal runs."""
    return point.engine, point.asked.model_dump_json()


def _confirmation(request: AdviceRequest, measured: AdviceMeasurements) -> FreshStarts | None:
    """Return the errors of the recommended setting from fresh starts; None unless the trade-off recommends it."""
    found = None if measured.found is None else measured.found.cheapest_by_engine.get(request.engine)
    if found is None or measured.recommended is None:
        return None
    is_pick = evaluation_key(found.point) == evaluation_key(measured.recommended)
    return found.confirmation if is_pick else None


def assemble_advice(request: AdviceRequest, score: AdviceScore, measured: AdviceMeasurements) -> Advice:
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
        margin=request.margin,
        position_tolerance=request.length,
        budget=request.budget,
        invariant=score.invariant,
        invariant_tolerance=score.invariant_tolerance,
        truth=truth.kind if isinstance(truth, Truth) else None,
        truth_about=_own_unit_text(truth.about if isinstance(truth, Truth) else truth, request),
        trusted_until=truth.trusted_until if isinstance(truth, Truth) else None,
        duration=scene.world.duration,
        left_at=_left_at(score.context),
        risks=_in_own_unit(measured.risks, request),
        notes=tuple(_own_unit_text(each, request) for each in measured.notes),
        present=present,
        is_in_loop=request.is_in_loop,
        recommended=recommended,
        confirmation=_confirmation(request, measured),
        starts_about=str(Starts(scene, request.spread)) if found is not None and found.starts > 1 else None,
        fallback=fallback,
        fallback_kind=measured.fallback_kind,
        ends=measured.ends,
        remaining_risks=_remaining_risks(request, chosen),
        knob_start=measured.knob_start,
        knob_setting=None if measured.start is None else _measured_setting(measured.start, score, measured, request),
        knobs=_knobs(request, score, measured),
        others=_other_engines(request, score, measured),
        code=_code(request, chosen),
        recorded_actions=0 if request.recording is None else len(request.recording.actions),
        replays=tuple(measured.replays),
        is_still_without_actions=measured.is_still_without_actions,
        tried=0 if found is None else sum(point.status != "refused" for point in found.points),
        tried_here=0
        if found is None
        else sum(point.engine == request.engine and point.status != "refused" for point in found.points),
        untried=measured.untried_knobs + (0 if found is None else found.untried),
        out_of_time=clock_without_compilation() > request.deadline,
        interrupted=measured.interrupted,
        machine=machine(),
        versions=versions(),
    )
    return replace(advice, fallback=None, fallback_kind=None) if advice.is_met else advice


def _measured_setting(
    point: Evaluation, score: AdviceScore, measured: AdviceMeasurements, request: AdviceRequest
) -> MeasuredSetting:
    """Return an evaluation with its error on the screen, and its cost if it was timed."""
    is_length = METRICS[score.metric].unit == "m"
    timed, ratio = measured.timed.get(evaluation_key(point)), _cost_ratio(measured, point, measured.present)
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
        objections=tuple(_own_unit_text(each, request) for each in point.objections),
        worst=point.worst if score.metric == "max_position" else None,
        within_until=measured.within_until.get(evaluation_key(point)),
        frame_ms=None if timed is None else timed.frame_time(request.fps),
        ratio=None if ratio is None else ratio.ratio,
        ratio_interval=None if ratio is None else ratio.interval,
        repeats=0 if timed is None else timed.repeats,
    )


def _left_at(context: EvaluationContext) -> dict[str, float]:
    """Return the time at which each body leaves the level, s, of those that do while the truth is trusted."""
    left = context.left_at
    return {context.scene.bodies.names[k]: float(left[k]) for k in np.flatnonzero(left < context.until).tolist()}


def _cost_ratio(measured: AdviceMeasurements, point: Evaluation, base: Evaluation) -> CostRatio | None:
    """Return the cost of an evaluation relative to another one; None if one of them was not timed."""
    found, other = (measured.timed.get(evaluation_key(each)) for each in (point, base))
    return None if found is None or other is None else CostRatio.of(found.turns, other.turns)


def _ratio(value: float | None, base: float | None) -> float | None:
    """Return value / base; None if one is unknown or the base is 0."""
    return value / base if value is not None and base else None


def _remaining_risks(request: AdviceRequest, chosen: MeasuredSetting | None) -> tuple[Risk, ...]:
    if chosen is None:
        return ()
    return _in_own_unit(formula_forecast(request.scene, chosen.asked, chosen.engine, request.fps), request)


METRES = re.compile(r"(?<=\d )m(?=[ ,;)/]|$)")
"""Unit of a number in a message"""


def _own_unit_text(text: str, request: AdviceRequest) -> str:
    """Return a message with px for m if the unit of length of the game is the pixel."""
    return METRES.sub("px", text) if request.zoom == 1.0 else text


def _in_own_unit(risks: Sequence[Risk], request: AdviceRequest) -> tuple[Risk, ...]:
    return tuple(replace(each, message=_own_unit_text(each.message, request)) for each in risks)


def _code(request: AdviceRequest, chosen: MeasuredSetting | None) -> GameCode | None:
    if chosen is None:
        return None
    is_slop_stated = request.scene.solver.slop is not None
    code = game_code(chosen.engine, chosen.settings, request.fps, request.zoom, is_slop_stated)
    return replace(code, remarks=(*code.remarks, *_callback_remarks(request, chosen)))


def _callback_remarks(request: AdviceRequest, chosen: MeasuredSetting) -> list[str]:
    """Return the effect of other substeps on the impulses in the callbacks of a recorded game; empty without any."""
    game = None if request.recording is None else request.recording.game
    if game is None or not any("space.on_collision" in each for each in game.omitted):
        return []
    present, now = (request.scene.solver.dt / request.scene.solver.substeps, chosen.settings.h)
    if abs(now / present - 1.0) <= SAME_STEP:
        return []
    return [
        f"collision callbacks of the game: an impulse is that of a step, which is now {now / present:.3g} times as "
        "long. A threshold for impulses, such as arbiter.total_impulse, has to be changed by this factor, or impulses "
        "are summed over the frame"
    ]


def _knobs(request: AdviceRequest, score: AdviceScore, measured: AdviceMeasurements) -> tuple[Knob, ...]:
    """Return the effect of each knob that was measured."""
    if measured.start is None:
        return ()
    start, found = _measured_setting(measured.start, score, measured, request), []
    for point in measured.knobs:
        setting = _measured_setting(point, score, measured, request)
        cost = _cost_ratio(measured, point, measured.start)
        ratio, interval = (None, None) if cost is None else (cost.ratio, cost.interval)
        error_ratio = _ratio(setting.error, start.error)
        found.append(Knob(settings_change(start.settings, setting.settings), setting, ratio, error_ratio, interval))
    return tuple(found)


def settings_change(before: Settings, after: Settings) -> str:
    """Return the differences of two resolved settings: `substeps 4 → 8`."""
    old, new = before.model_dump(), after.model_dump()
    names = [key for key in old if old[key] != new[key] and key not in ("dt", "record_every")]
    return ", ".join(f"{key} {_value(old[key])} → {_value(new[key])}" for key in names)


def _value(value: object) -> str:
    return "default" if value is None else format_value(value)


def _other_engines(request: AdviceRequest, score: AdviceScore, measured: AdviceMeasurements) -> tuple[OtherEngine, ...]:
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
        is_within = setting is not None and setting.error is not None and setting.error <= score.max_error
        found.append(OtherEngine(name, setting, is_within, refused.get(name)))
    return tuple(found)
