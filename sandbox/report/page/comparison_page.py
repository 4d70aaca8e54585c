"""A comparison as a page: the replay in step with the error, energies, tables, events, verdicts."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sandbox.measure.compare import Comparison, Row
from sandbox.measure.compare.alignment import Event
from sandbox.measure.compare.errors import errors
from sandbox.measure.energy import energies
from sandbox.measure.versions import machine, versions
from sandbox.report.page.document import Page, Section, write_page
from sandbox.report.page.markup import Child, Markup, joined, named, tag
from sandbox.report.page.replay import Track, replay
from sandbox.report.page.settings_text import settings_text
from sandbox.report.page.tables import Column, table
from sandbox.report.page.time_chart import TRUTH, Curve, energy_chart, error_chart
from sandbox.report.page.verdicts import badge_of, engine_name, look_of
from sandbox.report.page.wording import NONE, count, number, plural, share

MOST_EVENTS = 50
"""Missed and phantom contacts told of each engine."""
ENGINES = (
    Column("engine"),
    Column("verdict"),
    Column("max error, m", True, "the largest distance of any body from the truth while that is trusted"),
    Column("rms error, m", True, "root of the mean square over bodies and frames"),
    Column("max error, m/s", True, "the largest velocity error"),
    Column("energy", True, "how far the energy is off, as a share: from the truth's, else from the start's"),
    Column("momentum", True, "how far the momentum is off, as a share"),
    Column("contacts", True, "that the truth has too"),
    Column("missed", True, "contacts of the truth that never happened"),
    Column("phantom", True, "contacts that the truth does not have"),
    Column("after", True, "contacts in one of the two alone after a body had diverged: not judged"),
    Column("seconds", True, "of the steps alone"),
    Column("ms per s", True, "milliseconds per simulated second"),
)


def write_comparison(comparison: Comparison, path: str | Path) -> Path:
    """Write the page of a comparison, to a temporary name first, and return its path.

    Raises:
        OSError: the file cannot be written.
    """
    return write_page(comparison_page(comparison), path)


def comparison_page(comparison: Comparison) -> Page:
    """Return the page of a comparison."""
    scene = comparison.scene
    lead = joined(
        tag("p", tag("bdi", scene.about)) if scene.about else None,
        tag("p", sentence(comparison), class_="soft"),
    )
    sections = [Section("Engines", joined(engines_table(comparison), remarks(comparison)))]
    if comparison.trajectories:
        sections.append(Section("Replay", linked_plots(comparison, "plot"), lead=HOW))
    sections += explanations(comparison)
    sections.append(Section("Settings", settings_of(comparison.rows)))
    return Page(scene.title or "Untitled scene", "Comparison", sections, lead, versions(), machine())


HOW = (
    "Press play, or drag in a plot: the replay goes there. Click the picture, then wheel or + and − zoom; "
    "drag moves it. Uncheck an engine to hide it."
)


def sentence(comparison: Comparison) -> str:
    """Say what the truth is, as a sentence of its own."""
    text = comparison.sentence()
    return f"{text[0].upper()}{text[1:]}."


def linked_plots(comparison: Comparison, name: str) -> Markup:
    """Return the replay and the plots that go with it.

    Args:
        comparison: of which.
        name: begins the plots' names, which no others on the page may share.
    """
    scene, truth, duration = comparison.scene, comparison.best, comparison.scene.world.duration
    until, moving = comparison.trusted_until, ~scene.bodies.fixed
    tracks, off, total = [], [], []
    for engine, run in comparison.trajectories.items():
        error = None
        if truth is not None:
            found = errors(run, truth.trajectory, moving)
            error = found.time, found.position
            off.append(Curve(engine, look_of(engine), *error))
        total.append(Curve(engine, look_of(engine), run.time, energies(run, scene).total))
        tracks.append(Track(engine, look_of(engine), run, error))
    if truth is not None:
        tracks.append(Track(TRUTH, TRUTH, truth.trajectory))
        right = energies(truth.trajectory, scene).total
        trusted = np.where(truth.trajectory.time <= truth.trusted_until, right, np.nan)
        total.append(Curve(TRUTH, TRUTH, truth.trajectory.time, trusted))
    plots = [energy_chart(total, "total energy", duration, until, f"{name}-energy")]
    if truth is not None:
        label = "largest position error, m"
        plots.insert(0, error_chart(off, label, duration, until, comparison.tolerance, f"{name}-error"))
    return tag("div", replay(scene, tracks, until), tag("div", *plots, class_="plots"), class_="side linked")


def engines_table(comparison: Comparison) -> Markup:
    """Return the figures of every engine."""
    rows = []
    for row in comparison.rows:
        cost = milliseconds(comparison, row)
        rows.append(
            [
                engine_name(row.engine),
                badge_of(row, comparison.tolerance),
                number(row.score.max_position),
                number(row.score.rms_position),
                number(row.score.max_velocity),
                share(row.energy_drift),
                share(row.momentum_drift),
                *(count(row.count(kind)) for kind in ("matched", "missed", "phantom", "after_divergence")),
                number(row.seconds),
                number(cost),
            ]
        )
    return table(ENGINES, rows, "Engines against the truth", wide=True)


def milliseconds(comparison: Comparison, row: Row) -> float | None:
    """Return an engine's cost, ms per simulated second, of this one run with all its frames kept."""
    run = comparison.trajectories.get(row.engine)
    if row.seconds is None or run is None or not len(run.time) or not run.time[-1] > 0.0:
        return None
    return 1e3 * row.seconds / float(run.time[-1])


def remarks(comparison: Comparison) -> Markup | None:
    """Return why engines refused or failed, and what the energy is held against."""
    found: list[Child] = [
        row.reason if row.status == "refused" else joined(engine_name(row.engine), f": {row.reason}")
        for row in comparison.rows
        if row.reason
    ]
    if any(row.energy_against == "start" and row.energy_drift for row in comparison.rows):
        found.append(
            "Energy is the change from the start, losses that are right included: the truth ends before the run."
        )
    return tag("ul", *(tag("li", each) for each in found), class_="plain soft") if found else None


def explanations(comparison: Comparison) -> list[Section]:
    """Return why engines are off, where that was asked, and which contacts they missed or made up."""
    found = []
    told = [tag("li", engine_name(row.engine), ": ", row.verdict) for row in comparison.rows if row.verdict]
    if told:
        turned = joined(*(_knobs(row) for row in comparison.rows if row.why))
        found.append(Section("Why", joined(tag("ul", *told, class_="plain"), turned)))
    events = [(row, event) for row in comparison.rows for event in _odd(row)]
    if events:
        found.append(Section("Missed and phantom contacts", _events(comparison.rows, events)))
    return found


def _odd(row: Row) -> list[Event]:
    return [event for event in row.events or () if event.kind in ("missed", "phantom")]


def _events(rows: Sequence[Row], events: Sequence[tuple[Row, Event]]) -> Markup:
    columns = Column("engine"), Column("contact"), Column("between"), Column("at, s", True)
    cells: list[list[Child]] = []
    for row in rows:
        mine = [event for other, event in events if other is row]
        cells += [
            [
                engine_name(row.engine),
                event.kind,
                joined(named(event.between[0]), " and ", named(event.between[1])),
                number(event.when, 4),
            ]
            for event in mine[:MOST_EVENTS]
        ]
        if len(mine) > MOST_EVENTS:
            cells.append(
                [engine_name(row.engine), f"and {plural(len(mine) - MOST_EVENTS, 'more').removesuffix('s')}", "", ""]
            )
    return table(columns, cells, "Missed and phantom contacts")


def _knobs(row: Row) -> Markup:
    columns = Column("change"), Column("of the error is left", True), Column("max error, m", True)
    cells = [
        [
            knob.label,
            f"×{number(knob.ratio)}" if knob.ratio is not None else knob.status,
            number(knob.max_position_error) if knob.max_position_error is not None else NONE,
        ]
        for knob in row.why
    ]
    caption = f"{row.engine}: what changes of settings leave of the error"
    return tag("details", tag("summary", caption), table(columns, cells, "Changes of settings"))


def settings_of(rows: Sequence[Row]) -> Markup:
    """Return the settings of engines, as they filled them in; engines that share all are told together."""
    told: dict[str, list[str]] = {}
    for row in rows:
        if row.status != "refused":
            told.setdefault(settings_text(row.settings), []).append(row.engine)
    return tag(
        "div",
        *(
            tag("div", tag("h3", *(joined(engine_name(name), " ") for name in names)), tag("pre", tag("code", text)))
            for text, names in told.items()
        ),
        class_="colophon",
    )
