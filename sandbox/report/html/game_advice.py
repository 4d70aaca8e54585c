"""HTML page of the advice for a game: settings, lines to change, replays side by side, errors, callbacks, cost."""

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from markupsafe import Markup

from sandbox.formatting import format_number, format_plural
from sandbox.measure.game_advice.difference import CallbackDifference, DifferingContact
from sandbox.measure.game_advice.result import GameAdvice, GameSetting
from sandbox.measure.game_advice.step_code import StepCode
from sandbox.measure.game_advice.text import contacts_text, setting_text
from sandbox.measure.proportion import Proportion
from sandbox.rehearsal.rehearse import Rehearsal, densely_numbered
from sandbox.report.game_advice_plot import game_error_chart
from sandbox.report.html.game_replay import GameTrack, contact_marks, frame_times, game_replay
from sandbox.report.html.inline_svg import time_chart
from sandbox.report.html.page import (
    CellColumns,
    Content,
    HtmlColumn,
    Page,
    Section,
    badge,
    concatenated,
    engine_name,
    fragment,
    isolated,
    paragraph,
    table,
    write_page,
)
from sandbox.report.html.replay import TRUTH

TEMPLATE = "game_advice.html.j2"
CLASSES = {"present": "e1", "recommended": "e2", "most accurate": "e3"}
"""Class that has the colour of each run besides the truth"""
HOW_TO_READ = (
    "The truth is dashed in the pictures of the other runs. Press play, drag the slider or drag in a chart: all "
    "pictures show the same time. A ring marks a contact that the truth lacks, or that is missed, late or early."
)


def write_game_advice(
    advice: GameAdvice, runs: Mapping[str, Rehearsal], path: str | Path, remarks: Sequence[str] = ()
) -> Path:
    """Write the page of the advice for a game, to a temporary name first, and return its path.

    Args:
        advice: for the game.
        runs: runs to show by name: `truth`, `present`, and `recommended` or `most accurate`.
        path: of the page.
        remarks: on the recording.

    Raises:
        OSError: the file cannot be written.
    """
    return write_page(game_advice_page(advice, runs, remarks), path)


def game_advice_page(advice: GameAdvice, runs: Mapping[str, Rehearsal], remarks: Sequence[str] = ()) -> Page:
    """Return the page of the advice for a game; arguments as for `write_game_advice`."""
    settings = _named_settings(advice)
    chosen = concatenated(_settings_table(advice, settings), _to_change(advice, remarks))
    sections = [Section("Settings", chosen)]
    if TRUTH in runs:
        sections.append(Section("The runs", _runs(advice, runs, settings), lead=HOW_TO_READ))
    if advice.changes:
        sections.append(Section("One change at a time", _changes(advice)))
    sections.append(Section("How it was measured", _measured_by(advice)))
    lead = fragment(TEMPLATE, "answers", [isolated(each) for each in _answers(advice)])
    return Page(Path(advice.program).name, "Advice for a game", sections, lead, advice.versions, advice.machine)


def _named_settings(advice: GameAdvice) -> dict[str, GameSetting]:
    """Return the present setting, and the recommended or most accurate one if it differs, by the name of the run."""
    others = {"recommended": advice.recommended, "most accurate": advice.most_accurate}
    changed = {name: setting for name, setting in others.items() if setting is not None and setting.changed}
    return {"present": advice.present, **changed}


# The answer


def _answers(advice: GameAdvice) -> Iterator[str]:
    """Yield what the present setting does, and what the recommended one does at which cost."""
    tolerance = f"{format_number(advice.tolerance_px)} px"
    present, plays = advice.present, advice.plays
    if present.is_within and advice.recommended is not None and not advice.recommended.changed:
        yield f"The present setting, {setting_text(present)}, is the cheapest that keeps to {tolerance}."
        return
    failures = [*_lost_texts(present)]
    if present.error_px is not None and present.error_px > advice.tolerance_px:
        failures.append(f"{present.body} is up to {_px(present.error_px)} px off at {present.time or 0.0:.3g} s")
    text = "; ".join(failures) or f"the recorded play keeps to {tolerance}, but not enough of those like it"
    yield f"Present setting ({setting_text(present)}): {text}{_plays_text(plays.present)}."
    chosen = advice.chosen
    if chosen is None:
        yield f"No setting that was tried keeps to {tolerance}."
        return
    result = f"{_px(chosen.error_px)} px, contacts {contacts_text(chosen)}"
    cost = f"{format_number(chosen.physics_ms)} ms of physics per frame ({_cost_ratio(advice, chosen)})"
    odds = _plays_text(plays.chosen)
    if advice.recommended is None:
        enough = " in enough plays" if chosen.is_within else ""
        yield (
            f"No setting that was tried keeps to {tolerance}{enough}. The most accurate one "
            f"({setting_text(chosen)}): {result}, {cost}{odds}."
        )
        return
    yield f"Recommended setting ({setting_text(chosen)}): {result}, {cost}{odds}."


def _lost_texts(setting: GameSetting) -> Iterator[str]:
    for each in setting.callbacks:
        if each.missed:
            yield f"{each.missed:,} of {format_plural(each.expected, 'contact')} of {_function(each)} missed"
        if each.late:
            yield f"{each.late:,} of {format_plural(each.expected, 'contact')} of {_function(each)} at another time"
        if each.extra:
            yield f"{format_plural(each.extra, 'extra contact')} of {_function(each)}"


def _plays_text(held: Proportion | None) -> str:
    return "" if held is None else f"; {held.hits} of {held.trials} plays that differ a little are within the tolerance"


def _measured_by(advice: GameAdvice) -> Markup:
    """Return the session, the truth, which part of it is not known, and the work of the search."""
    sentences = [
        f"{advice.duration:.3g} s of the game with recorded inputs: {format_plural(advice.frames, 'frame')}, up to "
        f"{format_plural(advice.bodies, 'body', 'bodies')}, steps of {1e3 * advice.dts[1]:.3g} ms.",
        f"The truth is the game itself with {format_plural(advice.truth_substeps, 'substep')}. It is within "
        f"{_px(advice.truth_error_px)} px of the run with half as many.",
    ]
    if advice.known_fraction < 1.0:
        bodies = ", ".join(f"{name} from {time:.3g} s on" for name, time in advice.unknown_from.items())
        sentences.append(
            f"It is known for {100.0 * advice.known_fraction:.3g} % of the positions, and only these count. "
            f"Not known: {bodies or 'moments of impacts'}."
        )
    displacement = advice.zoom * advice.plays.displacement
    sentences.append(
        f"In plays that differ a little, all bodies start up to {displacement:.3g} px off, and each input comes up to "
        "a frame later."
    )
    sentences.append(
        f"{format_plural(advice.tried, 'setting')} tried in {format_plural(advice.runs, 'run')} of the game, "
        f"{advice.seconds:.0f} s."
    )
    if advice.out_of_time:
        sentences.append("The time limit ended the search.")
    return concatenated(*(paragraph(isolated(each)) for each in sentences))


def _settings_table(advice: GameAdvice, settings: Mapping[str, GameSetting]) -> Markup:
    """Return a row for each setting of `settings`."""
    odds = dict.fromkeys(settings, advice.plays.chosen) | {"present": advice.plays.present}
    columns: CellColumns[tuple[str, GameSetting]] = (
        (HtmlColumn("run"), lambda row: engine_name(row[0], CLASSES[row[0]])),
        (HtmlColumn("setting"), lambda row: setting_text(row[1])),
        (HtmlColumn("verdict"), lambda row: _verdict(row[1])),
        (HtmlColumn("error, px", True, "largest distance of a body from the truth"), lambda row: _px(row[1].error_px)),
        (HtmlColumn("of body"), lambda row: _where(row[1])),
        (
            HtmlColumn("contacts", True, "contacts whose callbacks are missed, late, early or extra"),
            lambda row: contacts_text(row[1]),
        ),
        (
            HtmlColumn("ms per frame", True, "time of Space.step in a frame, with the callbacks"),
            lambda row: format_number(row[1].physics_ms),
        ),
        (HtmlColumn("cost", True, "relative to the present setting"), lambda row: _cost_ratio(advice, row[1])),
        (
            HtmlColumn("plays held", True, "plays that differ a little and are within the tolerance"),
            lambda row: _odds(odds.get(row[0])),
        ),
    )
    cells = [[cell(row) for _, cell in columns] for row in settings.items()]
    return table([head for head, _ in columns], cells, "Present and recommended setting", wide=True)


def _verdict(setting: GameSetting) -> Markup:
    if setting.failure is not None:
        return badge("fails", "bad", setting.failure)
    if setting.is_within:
        return badge("within tolerance", "good")
    if setting.differing:
        return badge(contacts_text(setting), "bad")
    if setting.within_until is None:
        return badge("not within", "bad")
    return badge(f"too far off at {setting.within_until:.3g} s", "bad")


def _where(setting: GameSetting) -> Content:
    if setting.body is None:
        return None
    return isolated(setting.body if setting.time is None else f"{setting.body} at {setting.time:.3g} s")


def _px(error: float | None) -> str:
    return "failed" if error is None else format_number(error)


def _cost_ratio(advice: GameAdvice, setting: GameSetting) -> str:
    present = advice.present.physics_ms
    return f"×{setting.physics_ms / present:.2f}" if present > 0.0 else "–"


def _odds(held: Proportion | None) -> str:
    if held is None:
        return "–"
    return f"{held.hits} of {held.trials} ({100.0 * held.low:.0f}–{100.0 * held.high:.0f} %)"


def _to_change(advice: GameAdvice, remarks: Sequence[str]) -> Markup:
    """Return the lines to change, and beside them the remarks."""
    texts = [
        *(isolated(each) for each in advice.remarks),
        *(isolated(f"Recording: {each}") for each in remarks),
    ]
    notes = (
        None
        if not texts
        else concatenated(
            Markup("<h3>{}</h3>").format("Remarks"), fragment("parts.html.j2", "items", texts, "plain soft")
        )
    )
    if advice.code is None:
        return notes or Markup()
    head = "Lines to change" if advice.recommended is not None else "Lines of the most accurate setting"
    old = advice.code.old.splitlines()
    lines = fragment(TEMPLATE, "code", _place(advice.program, advice.code), old, advice.code.new)
    code = concatenated(Markup("<h3>{}</h3>").format(head), lines)
    return code if notes is None else fragment(TEMPLATE, "beside", code, notes)


def _place(program: str, code: StepCode) -> str:
    """Return file and line of the step, relative to the folder of the program if it is in it."""
    file, own = Path(code.file), Path(program).resolve()
    folder = own if own.is_dir() else own.parent
    return f"{file.relative_to(folder) if file.is_relative_to(folder) else file}:{code.line}"


# The runs


def _runs(advice: GameAdvice, runs: Mapping[str, Rehearsal], settings: Mapping[str, GameSetting]) -> Markup:
    """Return the replays side by side, the errors over time, and the callbacks.

    The replay begins with the first differing contact of the present setting, or with its largest error.
    """
    duration = advice.duration or 1.0  # a session of a single frame has none
    times = frame_times(runs.values(), duration)
    runs = densely_numbered(runs)
    tracks = [GameTrack(TRUTH, TRUTH, runs[TRUTH])]
    for name, run in runs.items():
        if name in settings:
            setting = settings[name]
            tracks.append(GameTrack(name, CLASSES[name], run, setting.errors_px, _contacts(setting)))
    curves = {
        int(track.css_class[1:]): (times[: len(track.error)], np.asarray(track.error))
        for track in tracks
        if track.error is not None
    }
    label = f"largest error of a body, px, against time, of {', '.join(track.name for track in tracks[1:])}"
    chart = time_chart(game_error_chart(curves, advice.tolerance_px, duration), "error", label, duration)
    marks, contacts = contact_marks(tracks[1:], times, duration), _contacts(advice.present)
    start = float(times[contacts[0][0].frame]) if contacts else advice.present.time or 0.0
    replay = game_replay(Path(advice.program).name, tracks, duration, advice.zoom, start, marks)
    return fragment(TEMPLATE, "replay_and_error", replay, chart, _callbacks(settings))


def _contacts(setting: GameSetting) -> list[tuple[DifferingContact, str]]:
    """Return all differing contacts of a setting with the function of each, in order."""
    found = [(contact, _function(each)) for each in setting.callbacks for contact in each.contacts]
    return sorted(found, key=lambda each: each[0].frame)


def _function(difference: CallbackDifference) -> str:
    """Return the name of the function of a callback, the last word and the last part of its qualified name."""
    return difference.callback.split(" ")[-1].split(".")[-1]


def _callbacks(settings: Mapping[str, GameSetting]) -> Markup:
    """Return the contacts of each callback, and those that each run loses."""
    names = list(dict.fromkeys(each.callback for setting in settings.values() for each in setting.callbacks))
    if not names:
        return paragraph("No collision callback was called.")
    by_run = {name: {each.callback: each for each in setting.callbacks} for name, setting in settings.items()}
    columns = HtmlColumn("callback"), HtmlColumn("contacts", True, "in the truth"), *map(HtmlColumn, settings)
    rows: list[list[Content]] = []
    for name in names:
        found = [by_run[run].get(name) for run in settings]
        expected = max(each.expected for each in found if each is not None)
        rows.append(
            [Markup('<span class="wrap">{}</span>').format(isolated(name)), f"{expected:,}", *map(_lost, found)]
        )
    return table(columns, rows, "Contacts of the collision callbacks")


def _lost(difference: CallbackDifference | None) -> Markup:
    if difference is None or difference.is_equal:
        return badge("equal", "good")
    return badge(", ".join(_counts(difference)), "bad", f"the first one between {difference.first_pair}")


def _counts(difference: CallbackDifference) -> Iterator[str]:
    for count, word in ((difference.missed, "missed"), (difference.late, "late"), (difference.extra, "extra")):
        if count:
            yield f"{count:,} {word}"


# Changes


def _changes(advice: GameAdvice) -> Markup:
    """Return the error after each single change of the present setting."""
    columns = (
        HtmlColumn("change"),
        HtmlColumn("verdict"),
        HtmlColumn("error, px", True),
        HtmlColumn("error ratio", True, "relative to the present setting"),
        HtmlColumn("contacts", True),
    )
    rows: list[list[Content]] = [
        [
            each.change,
            _verdict(each.setting),
            _px(each.setting.error_px),
            _error_ratio(advice.present.error_px, each.setting.error_px),
            contacts_text(each.setting),
        ]
        for each in advice.changes
    ]
    return table(columns, rows, "One change of the setting")


def _error_ratio(present: float | None, changed: float | None) -> str:
    if not present or changed is None or not math.isfinite(changed):
        return "–"
    return f"×{changed / present:.2g}"
