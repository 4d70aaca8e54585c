"""Sentences of an advice, shared by the terminal and the page."""

from collections.abc import Iterator

from sandbox.formatting import UNKNOWN, format_percent, format_plural, format_quantity
from sandbox.measure.advice.forecast import Risk
from sandbox.measure.advice.result import Advice, MeasuredSetting, OtherEngine, ReplayedActions
from sandbox.measure.tradeoff.configuration import Evaluation
from sandbox.measure.tradeoff.recommendation import FRAME_TOLERANCE, format_value
from sandbox.measure.tradeoff.timing import MIN_TURNS
from sandbox.scene.description.world import Settings

SMALLEST_PX = 1e-3
"""px; smaller errors are written as a bound, because nothing on the screen shows them."""
SAME_STEP = 1e-9
"""Relative: a dt that differs from a frame by less is written as that of a frame."""
OBJECTIONS = "has objections"
"""Remark on a setting that is within the tolerance and not to be recommended."""
MAX_LEFT = 3
"""Bodies that are named because they do not count to the end."""
METHODS = ("integrator", "detection", "response", "joints", "half_kick", "continuous", "slop", "bias", "persistence")
"""Settings that are named if they were asked for; others have no effect on results."""


def setting_text(setting: MeasuredSetting | Evaluation, fps: float) -> str:
    """Return a setting in a few words: `dt 1/60 s, 4 substeps, 10 iterations, half_kick`."""
    own, asked = setting.settings, setting.asked
    if setting.engine == "exact":
        return f"frames of {step_text(own.dt, fps)}; no time step"
    parts = [f"dt {step_text(own.dt, fps)}", format_plural(own.substeps, "substep")]
    if setting.engine != "box2d":
        parts.append(format_plural(own.iterations, "iteration"))
    return ", ".join([*parts, *_methods(asked)])


def _methods(asked: Settings) -> Iterator[str]:
    for key in METHODS:
        value = getattr(asked, key)
        if value is True:
            yield key
        elif value is not None and value is not False:
            yield f"{key} {format_value(value)}"
        elif value is False and key == "continuous":
            yield "no continuous"


def step_text(dt: float, fps: float) -> str:
    """Return a time step: `1/60 s` for that of a frame, otherwise a decimal number."""
    return f"1/{fps:g} s" if abs(dt * fps - 1.0) <= SAME_STEP else f"{dt:.4g} s"


def pixels_text(pixels: float | None) -> str:
    """Return an error in px without its unit."""
    if pixels is None:
        return UNKNOWN
    return f"<{SMALLEST_PX:g}" if pixels < SMALLEST_PX else f"{pixels:.3g}"


def error_text(advice: Advice, setting: MeasuredSetting) -> str:
    """Return the error of a setting with its unit, in px and as a length where it is one."""
    if setting.status != "ok":
        return f"{setting.status}: {setting.reason or 'no reason given'}"
    if setting.error is None:
        return "error unknown"
    if setting.error_px is None:
        return f"{advice.metric} {format_quantity(setting.error, advice.unit)}"
    is_shown = setting.error_px >= SMALLEST_PX and advice.zoom != 1.0  # at 1 px per metre the figures are the same
    length = f" ({format_quantity(setting.error, 'm')})" if is_shown else ""
    return f"error {pixels_text(setting.error_px)} px{length}"


def figures_text(advice: Advice, setting: MeasuredSetting) -> str:
    """Return error, missed contacts, invariant and cost of a setting, as far as they were measured."""
    parts = [error_text(advice, setting)]
    is_within = advice.is_within_tolerance(setting)
    if is_within is not None:
        parts[0] += ", within the tolerance" if is_within else ", more than the tolerance"
    if setting.missed_contacts:
        parts.append(format_plural(round(setting.missed_contacts), "missed contact"))
    if setting.within_until is not None:
        parts[0] += f" from {setting.within_until:.3g} s on"
    if setting.worst is not None and setting.worst.error > SMALLEST_PX / advice.zoom:
        x, y = setting.worst.position
        parts.append(f"the largest is that of {setting.worst.body!r} at {setting.worst.time:.3g} s, ({x:.4g}, {y:.4g})")
    if advice.invariant is not None and setting.invariant is not None:
        parts.append(f"{advice.invariant} to the end {setting.invariant:.3g}")
    if advice.ends is not None and setting is advice.chosen:
        parts.append(str(advice.ends))
    return "; ".join([*parts, *cost_parts(advice, setting)])


def cost_parts(advice: Advice, setting: MeasuredSetting) -> Iterator[str]:
    """Yield the time of a frame, its ratio to the present setting, and whether it fits the budget."""
    if setting.frame_ms is None:
        return
    dt = setting.settings.dt
    text = f"{setting.frame_ms:.3g} ms per {'frame' if dt * advice.fps <= FRAME_TOLERANCE else f'step of {dt:.4g} s'}"
    if setting.ratio is not None and setting is not advice.present:
        text += f", {ratio_text(setting.ratio, setting.ratio_interval)} the present cost per second"
    fits = advice.fits_budget(setting)
    if fits is not None:
        text += f", {'within' if fits else 'more than'} the budget of {advice.budget:g} ms"
    yield text


def ratio_text(ratio: float | None, interval: tuple[float, float] | None = None) -> str:
    """Return a ratio: `×0.52`, or with its confidence interval `×0.52 (0.5 to 0.55)`."""
    if ratio is None:
        return UNKNOWN
    return f"×{ratio:.3g}" if interval is None else f"×{ratio:.2g} ({interval[0]:.2g} to {interval[1]:.2g})"


def target_text(advice: Advice) -> str:
    """Return the frame rate, tolerance and budget."""
    tolerance = format_quantity(advice.tolerance, advice.unit)
    if advice.tolerance_px is not None:
        scale = "the unit of length" if advice.zoom == 1.0 else f"{tolerance} at {advice.zoom:g} px per metre"
        tolerance = f"{pixels_text(advice.tolerance_px)} px ({scale})"
    else:
        tolerance = f"{advice.metric} {tolerance}"
    if advice.margin:
        tolerance += f" less a margin of {100.0 * advice.margin:.3g} %"
    budget = "" if advice.budget is None else f", budget {advice.budget:g} ms per frame"
    return f"{advice.engine} at {advice.fps:g} fps, tolerance {tolerance}{budget}"


def coverage_sentence(advice: Advice) -> str | None:
    """Return which part of a scene was judged and what of the rest was not; None if positions were to the end."""
    if advice.is_predictable and advice.metric_reason is None:
        return None
    judged = "missed contacts, joint errors and the forecast"
    if advice.metric_reason is not None:
        return (
            f"Not judged: positions, because {advice.metric_reason}. Judged: {advice.metric} ({advice.metric_about}), "
            f"{judged}."
        )
    if advice.invariant not in (None, "joint_error", "missed_contacts"):  # these are named already
        judged = f"{advice.invariant}, {judged}"
    return (
        f"Judged: positions up to {advice.trusted_until:.3g} s of {advice.duration:.4g} s. Not judged: positions after "
        f"that, which no setting predicts; {judged} are judged to the end."
    )


def truth_sentences(advice: Advice) -> Iterator[str]:
    """Yield the truth that errors are measured against, bodies that do not count to the end, and the other starts."""
    if advice.truth is None or advice.trusted_until is None:
        yield f"No truth is known: {advice.truth_about}."
    else:
        kind = advice.truth.replace("_", " ")
        until = "the end" if advice.is_predictable else "that time"
        yield f"Errors of positions are distances from the truth ({kind}: {advice.truth_about}), up to {until}."
    for name, time in list(advice.left_at.items())[:MAX_LEFT]:
        yield f"{name!r} does not count after {time:.3g} s: it has fallen past everything that could stop it."
    if len(advice.left_at) > MAX_LEFT:
        yield f"The same holds for {len(advice.left_at) - MAX_LEFT} other bodies."
    if advice.starts_about is not None:
        if advice.confirmation is not None and advice.confirmation.held.trials:
            yield f"The recommended setting is also tried from starts with {advice.starts_about}."
        elif any(each.over_starts is not None for each in advice.replays):
            yield f"Perturbed starts have {advice.starts_about}."


def recording_sentences(advice: Advice) -> Iterator[str]:
    """Yield that the advice is for a scene without the actions of its recording, and the runs with them."""
    if not advice.recorded_actions:
        return
    yield (
        f"The recording has {format_plural(advice.recorded_actions, 'action')}. Errors, costs and forecast are those "
        "of its scene without them, because no truth with actions is available."
    )
    if advice.is_still_without_actions:
        yield (
            f"Without the actions no body moves farther than {_length(advice, advice.position_tolerance)}: errors and "
            "forecast are those of a scene at rest."
        )
    for each in advice.replays:
        outcome = format_plural(each.missed_contacts or 0, "missed contact")
        if each.status != "ok" or each.missed_contacts is None:
            outcome = f"{each.status}{'' if each.reason is None else f': {each.reason}'}"
        outcome += _departure_text(advice, each) + _over_starts_text(each)
        if each.setting in ("rejected", "tried"):
            end = "; so it is not recommended" if each.setting == "rejected" else ""
            yield f"With the actions, {each.label} has: {outcome}{end}."
        else:
            yield f"With the actions, the {each.setting} setting has: {outcome}."


def _departure_text(advice: Advice, replayed: ReplayedActions) -> str:
    """Return from when on a replay departs from that with finer steps, and how far; empty if there was none."""
    if replayed.finer_substeps is None or replayed.farthest is None:
        return ""
    tolerance, finer = _length(advice, advice.position_tolerance), format_plural(replayed.finer_substeps, "substep")
    if replayed.departs_at is None:
        return f"; it stays within {tolerance} of the run with {finer}"
    return (
        f"; from {replayed.departs_at:.3g} s on it is farther than {tolerance} from the run with {finer} "
        f"({replayed.departed!r}), by up to {_length(advice, replayed.farthest)}"
    )


def _over_starts_text(replayed: ReplayedActions) -> str:
    """Return from how many perturbed starts a replay misses no contact, and departs soon; empty without starts."""
    clean, sooner, text = replayed.over_starts, replayed.sooner_over_starts, ""
    if clean is not None:
        starts = f"of {clean.trials} perturbed starts with the actions up to a frame later"
        text = f"; no missed contact in {clean.hits} {starts} {clean.interval_text}"
        text = text if clean.hits else f"; missed contacts in all {starts}"
    if sooner is not None:
        text += f"; it departs sooner than the present setting in {sooner.hits} of {sooner.trials} such starts"
    return text


def _length(advice: Advice, length: float) -> str:
    """Return a length in px."""
    return f"{pixels_text(length * advice.zoom)} px"


def risk_label(risk: Risk) -> str:
    """Return the odds of a risk: `observed in 83 %`, `68 %`, or `forecast` if a formula gives no odds."""
    if risk.is_observed and risk.odds is not None:
        return f"observed in {format_percent(risk.odds)}"
    return "forecast" if risk.odds is None else format_percent(risk.odds)


def risk_text(risk: Risk, fps: float) -> str:
    """Return the description of a risk with its remedy, also for a loop of frames."""
    remedy = f"substeps >= {risk.safe_substeps}"
    if risk.safe_substeps is None or remedy in risk.message:
        return risk.message
    return f"{risk.message}; at dt = 1/{fps:g} s, {remedy}"


def cheapest_head(advice: Advice) -> str:
    """Return the heading of the recommended setting: among how many it is the cheapest, and its fresh starts."""
    tried = f", of {advice.tried_here} tried on {advice.engine}" if advice.tried_here else ""
    confirmed = "" if advice.confirmation is None else f"; {advice.confirmation}"
    less = " less the margin" if advice.margin else ""
    return f"Cheapest setting within the tolerance{less}{tried}{confirmed}"


def no_setting_text(advice: Advice) -> str:
    """Return why there is no recommended setting."""
    if not advice.tried:
        return "no setting was tried" + (" within the time limit" if advice.out_of_time else "")
    if advice.is_still_without_actions:
        return "none, because without the actions nothing moves; the lines above compare runs with the actions"
    if any(each.setting == "rejected" for each in advice.replays):
        return (
            f"every setting tried on {advice.engine} misses contacts with the actions, or departs sooner from finer "
            "steps than the present one"
        )
    is_within = advice.fallback is not None and advice.is_within_margin(advice.fallback)
    return "none without an objection" if is_within else "none"


def fallback_head(advice: Advice) -> str:
    """Return what the fallback is."""
    if advice.fallback_kind == "actions":
        return "cheapest setting within the tolerance, without the actions"
    if advice.fallback_kind == "invariant":
        return f"cheapest setting with {advice.invariant} within {advice.invariant_tolerance:g} to the end"
    return f"most accurate setting {'within the budget' if advice.fallback_kind == 'budget' else 'tried'}"


def knob_head(advice: Advice) -> str:
    """Return the heading of the knobs, with the setting that they are changed from."""
    start, which = advice.knob_setting, {"present": "the present setting", "recommended": "the recommended setting"}
    text = "" if start is None else f": {setting_text(start, advice.fps)}"
    return f"One change at a time of {which.get(advice.knob_start or '', 'this setting')}{text}"


def engine_text(advice: Advice, other: OtherEngine) -> str:
    """Return the remark about another engine: why it cannot run the scene, or that it misses the tolerance."""
    if other.missing is not None:
        return f"cannot run the scene: {other.missing}"
    if other.setting is None:
        return "no setting reached the end of the scene"
    if not other.is_within_tolerance:
        return "misses the tolerance, or its margin" if advice.margin else "misses the tolerance"
    return OBJECTIONS if other.setting.objections else ""


def search_sentence(advice: Advice) -> str:
    """Return how many settings were tried, and what ended the search early."""
    parts = [f"{advice.tried} settings tried over all engines"]
    if advice.untried:
        parts.append(f"{advice.untried} left out as too expensive")
    if advice.out_of_time:
        parts.append("the time limit ended the search")
    repeats = advice.present.repeats or (advice.chosen.repeats if advice.chosen else 0)
    costs = f"costs are medians of {repeats} timings in turns on this machine" if repeats else "no costs were timed"
    if repeats >= MIN_TURNS:
        costs += ", with 95 % intervals of their ratios"
    return "; ".join([*parts, costs])
