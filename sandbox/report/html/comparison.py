"""HTML page of a comparison: verdicts, settings, charts over time and replay."""

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from markupsafe import Markup

from sandbox.columns import TRUTH, shown
from sandbox.formatting import UNKNOWN, format_number
from sandbox.measure.compare import Comparison, Row
from sandbox.measure.compare.columns import COLUMNS, DIVERGENCE, END_LEGEND, end_table
from sandbox.measure.compare.contact_matching import ContactMatch
from sandbox.measure.metrics.trajectory_error import errors
from sandbox.provenance import machine, versions
from sandbox.report.comparison_plot import colour_indices, energy_chart, error_chart
from sandbox.report.html.inline_svg import time_chart
from sandbox.report.html.page import (
    Content,
    HtmlColumn,
    Page,
    Section,
    Shade,
    badge,
    column_key,
    concatenated,
    engine_name,
    fragment,
    html_columns,
    isolated,
    remark_paragraphs,
    table,
    value_cells,
    write_page,
)
from sandbox.report.html.replay import TRUTH as TRUTH_TRACK
from sandbox.report.html.replay import Track, replay
from sandbox.scene.description.world import Settings

TEMPLATE = "comparison.html.j2"
DEFAULTS = Settings()


def settings_text(settings: Mapping[str, Any], engine: str | None = None) -> str:
    """Return settings as TOML, without those left to the engine.

    Args:
        settings: settings by name; None is left out, and so are defaults of settings that are not numerical.
        engine: name of the engine, written as a comment.
    """
    lines = ["[solver]" if engine is None else f"[solver]  # {engine}"]
    for name, value in settings.items():
        if value is None or (name in {"half_kick", "record_every"} and value == getattr(DEFAULTS, name)):
            continue
        # Strings, integers, floats and booleans have the same form in TOML and JSON.
        lines.append(f"{name} = {json.dumps(value)}")
    return "\n".join(lines)


NEGLIGIBLE = 1e-6
"""Fraction of the tolerance up to which an error counts as a match: rounding, far below any model error."""


def css_classes(comparison: Comparison) -> dict[str, str]:
    """Return the class that has the colour of each row, by the name of the row."""
    return {name: f"e{index}" for name, index in colour_indices(comparison).items()}


def verdict_of(row: Row, tolerance: float) -> tuple[str, Shade]:
    """Return the verdict on an engine against the truth, in a few words."""
    error = row.score.max_position
    missed, phantom = row.count("missed"), row.count("phantom")
    if row.status == "refused":
        return "unsupported", "none"
    if row.status != "ok":
        return row.status, "bad"
    if error is None:
        return "not judged", "none"
    first = min((event.when for event in row.events or () if event.kind == "missed"), default=math.inf)
    if missed and (row.first_divergence is None or first <= row.first_divergence):
        return f"{missed:,} missed", "bad"
    if row.first_divergence is not None:
        return f"diverges at {format_number(row.first_divergence)} s", "bad" if error > 10.0 * tolerance else "fair"
    if phantom:
        return f"{phantom:,} phantom", "fair"
    if row.is_truth:
        return TRUTH, "good"
    return ("matches", "good") if error <= NEGLIGIBLE * tolerance else ("within tolerance", "good")


def badge_of(row: Row, tolerance: float) -> Markup:
    """Return the verdict on an engine as a badge."""
    return badge(*verdict_of(row, tolerance), about=row.reason)


VERDICTS: tuple[tuple[str, Shade, str], ...] = (
    (TRUTH, "good", "the run is the truth itself, so that its errors are 0"),
    ("matches", "good", "error at most a millionth of the tolerance"),
    ("within tolerance", "good", "error within the tolerance while the truth is trusted"),
    (
        "diverges at",
        "fair",
        "error exceeds the tolerance from that time on; red where it exceeds ten times the tolerance",
    ),
    ("missed", "bad", "number of contacts that the engine missed, the first before any body diverged"),
    ("unsupported", "none", "the engine does not support the scene"),
)
"""Meanings of the verdicts."""
MAX_EVENTS = 50
"""Missed and phantom contacts that are listed for each engine."""
NAMES = HtmlColumn("engine"), HtmlColumn("verdict")
COST = HtmlColumn("ms per s", True, "computing time in milliseconds per simulated second")


MEASURED = tuple(column for column in COLUMNS if column is not DIVERGENCE)
"""Columns of the measured values, but for the time that the verdict states."""
ENGINE_COLUMNS = (*NAMES, *html_columns(MEASURED), COST)
"""All columns that the table of the engines may have."""


def columns_of(rows: Sequence[Row]) -> list[HtmlColumn]:
    """Return the columns of the table of all engines."""
    return [*NAMES, *html_columns(shown(MEASURED, rows)), COST]


def write_comparison(comparison: Comparison, path: str | Path, on_recording: Sequence[str] = ()) -> Path:
    """Write the page of a comparison, to a temporary name first, and return its path.

    Raises:
        OSError: the file cannot be written.
    """
    return write_page(comparison_page(comparison, on_recording=on_recording), path)


def comparison_page(comparison: Comparison, replayed: bool = True, on_recording: Sequence[str] = ()) -> Page:
    """Return the page of a comparison.

    Args:
        comparison: the comparison.
        replayed: with the replay and the charts beside it.
        on_recording: remarks on the recording whose scene is compared.
    """
    scene = comparison.scene
    meanings = meanings_of(columns_of(comparison.rows))
    sections = [Section("Engines", concatenated(engines_table(comparison), remarks(comparison), meanings))]
    if replayed and comparison.trajectories and comparison.same_scene:
        sections.append(Section("Replay", linked_plots(comparison, "plot"), lead=HOW_TO_REPLAY))
    heads, rows = end_table(comparison)
    if rows:
        columns = [HtmlColumn(head, k > 0) for k, head in enumerate(heads)]
        sections.append(
            Section("Ends", table(columns, rows, "Ends of runs from perturbed starts"), lead=f"{END_LEGEND}.")
        )
    sections += explanations(comparison)
    sections.append(Section("Settings", settings_of(comparison)))
    about = fragment(TEMPLATE, "lead", scene.about, truth_sentence(comparison))
    lead = concatenated(about, remark_paragraphs(on_recording))
    return Page(scene.title or "Untitled scene", "Comparison", sections, lead, versions(), machine())


HOW_TO_REPLAY = (
    "Press play, or drag in a plot to move the replay to that time. Click the picture, then zoom with the wheel or "
    "+ and −; drag to pan. Uncheck an engine to hide it."
)


def meanings_of(*columns: Sequence[HtmlColumn]) -> Markup:
    """Return the meanings of the columns of some tables, and of the verdicts, folded."""
    return fragment(TEMPLATE, "meanings", column_key(*columns), VERDICTS)


def truth_sentence(comparison: Comparison) -> str:
    """Return the kind and source of the truth, and the perturbed starts, as complete sentences."""
    sentences = filter(None, (comparison.sentence(), comparison.starts_about))
    return " ".join(f"{text[0].upper()}{text[1:]}." for text in sentences)


def swept_numbers(comparison: Comparison) -> tuple[str, dict[str, float]] | None:
    """Return the key whose numbers distinguish the runs, and its value in each row, by name; None: there is none."""
    values = {row.name: row.set for row in comparison.rows if row.name in comparison.trajectories}
    keys = {key for each in values.values() for key in each}
    if len(keys) != 1 or len(values) < 2:
        return None
    (key,) = keys
    numbers = {name: each[key] for name, each in values.items()}
    if any(isinstance(number, bool) or not isinstance(number, int | float) for number in numbers.values()):
        return None
    return key, {name: float(number) for name, number in numbers.items()}


def replay_page(comparison: Comparison) -> Page:
    """Return the replay of a comparison with its charts, and nothing else, for a frame in a page of documentation.

    Raises:
        ValueError: the comparison has no runs, or they are of different scenes.
    """
    if not comparison.trajectories or not comparison.same_scene:
        raise ValueError("there are no runs of one scene to replay")
    section = Section("Replay", linked_plots(comparison, "plot"), lead=truth_sentence(comparison))
    return Page(comparison.scene.title or "Untitled scene", "Comparison", [section])


def linked_plots(comparison: Comparison, name: str) -> Markup:
    """Return the replay, and beside it the charts over time, which share a time cursor.

    In a sweep over one number a slider selects its value.

    Args:
        comparison: the comparison.
        name: prefix of the identifiers of the charts, unique in the page.
    """
    scene, truth, duration = comparison.scene, comparison.best, comparison.scene.world.duration
    moving, tracks, classes = ~scene.bodies.fixed, [], css_classes(comparison)
    swept, values = swept_numbers(comparison) or (None, {})
    for row_name, run in comparison.trajectories.items():
        error, row_truth = None, comparison.truth_of(row_name)
        if row_truth is not None:
            found = errors(run, row_truth.trajectory, moving)
            error = found.time, found.position
        tracks.append(Track(row_name, classes[row_name], run, error, values.get(row_name)))
    names = ", ".join(comparison.trajectories) or "nothing"
    charts = []
    if truth is not None:
        tracks.append(Track(TRUTH_TRACK, TRUTH_TRACK, truth.trajectory))
        label = f"largest position error, m, against time, of {names}"
        charts.append(time_chart(error_chart(comparison), f"{name}-error", label, duration))
    label = f"total energy, J, against time, of {names}"
    charts.append(time_chart(energy_chart(comparison), f"{name}-energy", label, duration))
    return fragment(TEMPLATE, "linked_plots", replay(scene, tracks, comparison.trusted_until, swept), charts)


def engines_table(comparison: Comparison) -> Markup:
    """Return the table of all engines."""
    classes, columns = css_classes(comparison), shown(MEASURED, comparison.rows)
    rows = [
        [
            engine_name(row.name, classes[row.name]),
            badge_of(row, comparison.tolerance),
            *value_cells(columns, row),
            format_number(cost_of(comparison, row)),
        ]
        for row in comparison.rows
    ]
    return table(columns_of(comparison.rows), rows, "Engines against the truth", wide=True)


def cost_of(comparison: Comparison, row: Row) -> float | None:
    """Return the cost of an engine, ms per simulated second, from this single run with all frames."""
    run = comparison.trajectories.get(row.name)
    if row.seconds is None or run is None or not len(run.time) or not run.time[-1] > 0.0:
        return None
    return 1e3 * row.seconds / float(run.time[-1])


def remarks(comparison: Comparison) -> Markup | None:
    """Return the reasons of refusals and failures, and the reference of the energy error."""
    classes = css_classes(comparison)
    found: list[Content] = [
        row.reason
        if row.status == "refused"
        else Markup("{}: {}").format(engine_name(row.name, classes[row.name]), row.reason)
        for row in comparison.rows
        if row.reason
    ]
    if any(row.energy_against == "start" and row.energy_drift for row in comparison.rows):
        found.append(
            "Energy is the change from the start, correct losses included, because the truth ends before the run."
        )
    return fragment("parts.html.j2", "items", found, "plain soft") if found else None


def explanations(comparison: Comparison) -> list[Section]:
    """Return the sections on causes of errors, if they were examined, and on missed and phantom contacts."""
    found, classes = [], css_classes(comparison)
    verdicts = [(engine_name(row.name, classes[row.name]), row.verdict) for row in comparison.rows if row.verdict]
    if verdicts:
        changes = [_changed_settings(row) for row in comparison.rows if row.why]
        found.append(Section("Why", fragment(TEMPLATE, "why", verdicts, changes)))
    unmatched = {row.name: _unmatched(row) for row in comparison.rows if _unmatched(row)}
    if unmatched:
        cells: list[list[Content]] = []
        for name, events in unmatched.items():
            cells += _event_rows(engine_name(name, classes[name]), events)
        columns = HtmlColumn("engine"), HtmlColumn("contact"), HtmlColumn("between"), HtmlColumn("at, s", True)
        title = "Missed and phantom contacts"
        found.append(Section(title, table(columns, cells, title)))
    return found


def _unmatched(row: Row) -> list[ContactMatch]:
    return [event for event in row.events or () if event.kind in ("missed", "phantom")]


def _event_rows(engine: Markup, events: Sequence[ContactMatch]) -> list[list[Content]]:
    """Return the rows of the table of unmatched contacts for an engine."""
    rows: list[list[Content]] = [
        [
            engine,
            event.kind,
            Markup("{} and {}").format(*map(isolated, event.between)),
            format_number(event.when, 4),
        ]
        for event in events[:MAX_EVENTS]
    ]
    if len(events) > MAX_EVENTS:
        rows.append([engine, f"and {len(events) - MAX_EVENTS:,} more", "", ""])
    return rows


def _changed_settings(row: Row) -> tuple[str, Markup]:
    """Return caption and table of the errors that remain after one setting is changed."""
    columns = HtmlColumn("change"), HtmlColumn("remaining error", True), HtmlColumn("max error, m", True)
    cells = [
        [
            knob.label,
            f"×{format_number(knob.ratio)}" if knob.ratio is not None else knob.status,
            format_number(knob.max_position_error) if knob.max_position_error is not None else UNKNOWN,
        ]
        for knob in row.why
    ]
    return f"{row.name}: remaining error after one changed setting", table(columns, cells, "Changed settings")


def settings_of(comparison: Comparison) -> Markup:
    """Return the settings of the engines, completed by them; engines with equal settings share an entry."""
    groups: dict[str, list[Markup]] = {}
    classes = css_classes(comparison)
    for row in comparison.rows:
        if row.status != "refused":
            groups.setdefault(settings_text(row.settings), []).append(engine_name(row.name, classes[row.name]))
    return fragment(TEMPLATE, "settings", [(engines, text) for text, engines in groups.items()])
