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
from sandbox.report.page.tables import Column, column_key, table
from sandbox.report.page.time_chart import TRUTH, Curve, energy_chart, error_chart
from sandbox.report.page.verdicts import badge_of, engine_name, key, looks_of
from sandbox.report.page.wording import NONE, count, number, plural, share

MOST_EVENTS = 50
"""Missed and phantom contacts told of each engine."""
ENGINES = (
    Column("engine"),
    Column("verdict"),
    Column("max error, m", True, "largest position error of any body while the truth is trusted"),
    Column("rms error, m", True, "root mean square of the position error, over bodies and frames"),
    Column("max error, m/s", True, "largest velocity error of any body"),
    Column("energy", True, "energy error at the end, relative to the largest kinetic energy of the run"),
    Column("momentum", True, "unexplained momentum at the end, relative to the largest sum of |m v|"),
    Column("contacts", True, "contacts that the truth has too"),
    Column("missed", True, "contacts of the truth that the engine does not have"),
    Column("phantom", True, "contacts of the engine that the truth does not have"),
    Column("after", True, "unmatched contacts after a body diverged, which are not judged"),
    Column("ms per s", True, "computing time in milliseconds per simulated second"),
)


def write_comparison(comparison: Comparison, path: str | Path) -> Path:
    """Write the page of a comparison, to a temporary name first, and return its path.

    Raises:
        OSError: the file cannot be written.
    """
    return write_page(comparison_page(comparison), path)


def comparison_page(comparison: Comparison, replayed: bool = True) -> Page:
    """Return the page of a comparison.

    Args:
        comparison: which.
        replayed: with the replay and the plots that go with it.
    """
    scene = comparison.scene
    lead = joined(
        tag("p", tag("bdi", scene.about)) if scene.about else None,
        tag("p", sentence(comparison), class_="soft"),
    )
    meanings = tag("details", tag("summary", "What the columns and verdicts mean"), column_key(ENGINES), key())
    sections = [Section("Engines", joined(engines_table(comparison), remarks(comparison), meanings))]
    if replayed and comparison.trajectories and comparison.same_scene:
        sections.append(Section("Replay", linked_plots(comparison, "plot"), lead=HOW))
    sections += explanations(comparison)
    sections.append(Section("Settings", settings_of(comparison)))
    return Page(scene.title or "Untitled scene", "Comparison", sections, lead, versions(), machine())


HOW = (
    "Press play, or drag in a plot to move the replay to that time. Click the picture, then zoom with the wheel or "
    "+ and −; drag to pan. Uncheck an engine to hide it."
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
    tracks, off, total, looks = [], [], [], looks_of(comparison)
    for name_of_row, run in comparison.trajectories.items():
        error, look, own = None, looks[name_of_row], comparison.truth_of(name_of_row)
        if own is not None:
            found = errors(run, own.trajectory, moving)
            error = found.time, found.position
            off.append(Curve(name_of_row, look, *error))
        total.append(Curve(name_of_row, look, run.time, energies(run, scene).total))
        tracks.append(Track(name_of_row, look, run, error))
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
    rows, looks = [], looks_of(comparison)
    for row in comparison.rows:
        cost = milliseconds(comparison, row)
        rows.append(
            [
                engine_name(row.name, looks[row.name]),
                badge_of(row, comparison.tolerance),
                number(row.score.max_position),
                number(row.score.rms_position),
                number(row.score.max_velocity),
                share(row.energy_drift),
                share(row.momentum_drift),
                *(count(row.count(kind)) for kind in ("matched", "missed", "phantom", "after_divergence")),
                number(cost),
            ]
        )
    return table(ENGINES, rows, "Engines against the truth", wide=True)


def milliseconds(comparison: Comparison, row: Row) -> float | None:
    """Return an engine's cost, ms per simulated second, of this one run with all its frames kept."""
    run = comparison.trajectories.get(row.name)
    if row.seconds is None or run is None or not len(run.time) or not run.time[-1] > 0.0:
        return None
    return 1e3 * row.seconds / float(run.time[-1])


def remarks(comparison: Comparison) -> Markup | None:
    """Return why engines refused or failed, and what the energy is held against."""
    looks = looks_of(comparison)
    found: list[Child] = [
        row.reason if row.status == "refused" else joined(engine_name(row.name, looks[row.name]), f": {row.reason}")
        for row in comparison.rows
        if row.reason
    ]
    if any(row.energy_against == "start" and row.energy_drift for row in comparison.rows):
        found.append(
            "Energy is the change from the start, correct losses included, because the truth ends before the run."
        )
    return tag("ul", *(tag("li", each) for each in found), class_="plain soft") if found else None


def explanations(comparison: Comparison) -> list[Section]:
    """Return why engines are off, where that was asked, and which contacts they missed or made up."""
    found, looks = [], looks_of(comparison)
    told = [
        tag("li", engine_name(row.name, looks[row.name]), ": ", row.verdict) for row in comparison.rows if row.verdict
    ]
    if told:
        turned = joined(*(_knobs(row) for row in comparison.rows if row.why))
        found.append(Section("Why", joined(tag("ul", *told, class_="plain"), turned)))
    events = [(row, event) for row in comparison.rows for event in _odd(row)]
    if events:
        found.append(Section("Missed and phantom contacts", _events(comparison, events)))
    return found


def _odd(row: Row) -> list[Event]:
    return [event for event in row.events or () if event.kind in ("missed", "phantom")]


def _events(comparison: Comparison, events: Sequence[tuple[Row, Event]]) -> Markup:
    columns = Column("engine"), Column("contact"), Column("between"), Column("at, s", True)
    cells: list[list[Child]] = []
    looks = looks_of(comparison)
    for row in comparison.rows:
        label = engine_name(row.name, looks[row.name])
        mine = [event for other, event in events if other is row]
        cells += [
            [
                label,
                event.kind,
                joined(named(event.between[0]), " and ", named(event.between[1])),
                number(event.when, 4),
            ]
            for event in mine[:MOST_EVENTS]
        ]
        if len(mine) > MOST_EVENTS:
            cells.append([label, f"and {plural(len(mine) - MOST_EVENTS, 'more').removesuffix('s')}", "", ""])
    return table(columns, cells, "Missed and phantom contacts")


def _knobs(row: Row) -> Markup:
    columns = Column("change"), Column("remaining error", True), Column("max error, m", True)
    cells = [
        [
            knob.label,
            f"×{number(knob.ratio)}" if knob.ratio is not None else knob.status,
            number(knob.max_position_error) if knob.max_position_error is not None else NONE,
        ]
        for knob in row.why
    ]
    caption = f"{row.name}: remaining error after one changed setting"
    return tag("details", tag("summary", caption), table(columns, cells, "Changed settings"))


def settings_of(comparison: Comparison) -> Markup:
    """Return the settings of engines, as they filled them in; engines that share all are told together."""
    told: dict[str, list[str]] = {}
    looks = looks_of(comparison)
    for row in comparison.rows:
        if row.status != "refused":
            told.setdefault(settings_text(row.settings), []).append(row.name)
    return tag(
        "div",
        *(
            tag(
                "div",
                tag("h3", *(joined(engine_name(name, looks[name]), " ") for name in names)),
                tag("pre", tag("code", text)),
            )
            for text, names in told.items()
        ),
        class_="colophon",
    )
