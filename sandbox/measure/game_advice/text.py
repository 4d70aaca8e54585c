"""Sentences of an advice for a game, shared by the terminal and the page."""

from collections.abc import Iterator

from sandbox.formatting import format_number, format_percent, format_plural
from sandbox.measure.game_advice.difference import CallbackDifference
from sandbox.measure.game_advice.result import GameAdvice, GameSetting
from sandbox.rehearsal.step_settings import SPACE_ATTRIBUTES


def target_text(advice: GameAdvice) -> str:
    """Return the tolerance and the session."""
    scale = "" if advice.zoom == 1.0 else f" ({advice.zoom:g} px per unit of length)"
    return (
        f"the game itself, {format_plural(advice.frames, 'frame')} ({advice.duration:.3g} s), tolerance "
        f"{advice.tolerance_px:g} px{scale}"
    )


def setting_text(setting: GameSetting) -> str:
    """Return a setting in a few words: `4 substeps, 10 iterations, collision_slop 0.01`."""
    names = SPACE_ATTRIBUTES | {"joint_bias": "error_bias of joints"}
    parts = [format_plural(setting.substeps, "substep"), format_plural(setting.iterations, "iteration")]
    parts += [f"{names.get(name, name)} {value:.3g}" for name, value in setting.changed.items() if name not in COUNTS]
    return ", ".join(parts)


COUNTS = ("substeps", "iterations")


def answer_text(advice: GameAdvice) -> str:
    """Return the answer in one sentence."""
    chosen, present = advice.chosen, advice.present
    if chosen is None or not chosen.changed:
        if advice.recommended is not None:
            return "The present setting is within the tolerance: nothing to change."
        return "The present setting is not good enough, and none that was tried is better."
    errors = f"error {format_number(present.error_px)} → {format_number(chosen.error_px)} px"
    contacts = f"contacts {contacts_text(present)} → {contacts_text(chosen)}"
    changes = errors if contacts_text(present) == contacts_text(chosen) else f"{errors}, {contacts}"
    ratio = f", ×{chosen.physics_ms / present.physics_ms:.2g} the physics" if present.physics_ms else ""
    if advice.recommended is None:
        return f"No setting that was tried is good enough; the closest is {setting_text(chosen)}: {changes}{ratio}."
    return f"Use {setting_text(chosen)}: {changes}{ratio}."


def truth_sentences(advice: GameAdvice) -> Iterator[str]:
    """Yield what errors are measured against, and how far it is known."""
    yield (
        f"Truth: the game with {advice.truth_substeps} substeps, which is {format_number(advice.truth_error_px)} px or "
        f"less from half as many."
    )
    if advice.known_fraction < 1.0:
        named = ", ".join(f"{body} from {time:.3g} s on" for body, time in advice.unknown_from.items())
        yield (
            f"It knows {format_percent(advice.known_fraction)} of the positions; not those that rounding or finer "
            f"steps change: {named or 'moments of impacts'}."
        )


def figures_text(advice: GameAdvice, setting: GameSetting) -> str:
    """Return error and cost of a setting."""
    if setting.error_px is None:
        return f"failed: {setting.failure}"
    parts = [f"error {format_number(setting.error_px)} px"]
    if setting.body is not None and setting.time is not None:
        parts[0] += f" ({setting.body} at {setting.time:.3g} s)"
    if setting.within_until is not None:
        parts[0] += f", more than the tolerance from {setting.within_until:.3g} s on"
    if abs(setting.frames - advice.truth_frames) > 1:
        parts.append(f"the game ends after {setting.frames:,} frames, the truth after {advice.truth_frames:,}")
    parts.append(f"{format_number(setting.physics_ms)} ms of physics per frame")
    return "; ".join(parts)


def contacts_text(setting: GameSetting) -> str:
    """Return how many contacts differ from those of the truth, over all callbacks: `8 missed, 8 extra`."""
    counts = {word: sum(getattr(each, word) for each in setting.callbacks) for word in ("missed", "late", "extra")}
    return ", ".join(f"{count:,} {word}" for word, count in counts.items() if count) or "as in the truth"


def callback_text(difference: CallbackDifference, advice: GameAdvice) -> str:
    """Return the contacts that a callback lacks or has too many."""
    if difference.is_equal:
        return f"{difference.callback}: {format_plural(difference.expected, 'contact')}, as in the truth"
    kinds = (difference.missed, "missed"), (difference.late, "late or early"), (difference.extra, "extra")
    counts = [f"{count} {word}" for count, word in kinds if count]
    text = f"{difference.callback}: of {format_plural(difference.expected, 'contact')} {', '.join(counts)}"
    if difference.first_frame is not None:
        time = difference.first_frame * advice.duration / max(advice.frames, 1)
        text += f"; the first at {time:.3g} s ({difference.first_pair})"
    return text


def recommended_head(advice: GameAdvice) -> str:
    """Return the head of the recommended setting."""
    tried = f"of {format_plural(advice.tried, 'setting')} tried"
    odds = advice.plays.chosen if advice.plays.present.trials else None
    held = "" if odds is None else f"; within it in {odds.hits} of {odds.trials} plays that differ a little"
    if advice.recommended is not None:
        interval = "" if odds is None else f" {odds.interval_text}"
        return f"Cheapest setting within the tolerance, {tried}{held}{interval}"
    if odds is None:
        return f"No setting is within the tolerance, {tried}; the most accurate"
    return (
        f"No setting is within the tolerance in 9 of 10 plays that differ a little, {tried}; the one that is most "
        f"often, in {odds.hits} of {odds.trials}"
    )


def present_odds_text(advice: GameAdvice) -> str:
    """Return the odds of the present setting."""
    odds = advice.plays.present
    return (
        f"within the tolerance in {odds.hits} of {odds.trials} plays with bodies displaced by up to "
        f"{advice.plays.displacement * advice.zoom:.3g} px at the start and inputs up to a frame later"
    )
