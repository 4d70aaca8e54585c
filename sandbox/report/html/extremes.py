"""HTML page of the extremes: a table of verdicts for each axis, limits, and precision and recall of the warnings."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from markupsafe import Markup

from sandbox.formatting import UNKNOWN, format_number, format_percent, format_plural
from sandbox.measure.extremes.outcome import MEANINGS, Verdict
from sandbox.report.html.page import (
    CellColumns,
    HtmlColumn,
    Page,
    Section,
    Shade,
    concatenated,
    engine_name,
    fragment,
    row_table,
    write_page,
)

TEMPLATE = "extremes.html.j2"
ExtremesMapping = Mapping[str, Any]
"""Document that `sandbox extremes --json` prints."""

SIGNS: dict[Verdict, tuple[str, Shade]] = {
    "exact": ("✓", "good"),
    "degraded": ("~", "fair"),
    "refused": ("–", "none"),
    "failed": ("✕", "bad"),
}
PREDICTIONS = (
    "sandbox check warned before each run. Precision is the fraction of warnings that came true; "
    "recall is the fraction of failures that had a warning."
)


def write_extremes(document: ExtremesMapping, path: str | Path) -> Path:
    """Write the page of the extremes, to a temporary name first, and return its path.

    Raises:
        OSError: the file cannot be written.
    """
    return write_page(extremes_page(document), path)


def extremes_page(document: ExtremesMapping) -> Page:
    """Return the page of the extremes."""
    cells: Sequence[ExtremesMapping] = document["cells"]
    verdicts = [cell["verdict"] for cell in cells]
    counts = [f"{verdicts.count(word):,} {word}" for word in SIGNS if word in verdicts]
    summary = f"{format_plural(len(cells), 'cell')}: {', '.join(counts)}."
    meanings = [(word, sign, shade, MEANINGS[word]) for word, (sign, shade) in SIGNS.items()]
    axes = dict.fromkeys(str(cell["axis"]) for cell in cells)
    tables = concatenated(*(_verdict_table(axis, cells) for axis in axes))
    sections = [Section("Axis by axis", tables, lead="Hover over a cell for its reason.")]
    if document["limits"]:
        lead = "The last level that passed and the first that failed, found by bisection."
        sections.append(Section("Limits", _limits(document["limits"]), lead=lead))
    if document["predictions"]:
        sections.append(Section("Predictions", _predictions(document["predictions"]), lead=PREDICTIONS))
    lead_of_page = fragment(TEMPLATE, "lead", summary, meanings)
    provenance = document["versions"], document["machine"]
    return Page("Limits of each engine", "Extremes", sections, lead_of_page, *provenance)


def _verdict_table(axis: str, cells: Sequence[ExtremesMapping]) -> Markup:
    """Return the table of an axis: a row for each engine and setup, a column for each level."""
    axis_cells = [cell for cell in cells if cell["axis"] == axis]
    levels = sorted({float(cell["level"]) for cell in axis_cells})
    found: dict[tuple[str, str], dict[float, dict[str, str]]] = {}
    for cell in axis_cells:
        word: Verdict = cell["verdict"]
        shown = {"word": word, "sign": SIGNS[word][0], "reason": cell["reason"]}
        found.setdefault((cell["engine"], _setup(cell)), {})[float(cell["level"])] = shown
    rows = [
        (engine_name(engine), setup, [by_level.get(level) for level in levels])
        for (engine, setup), by_level in found.items()
    ]
    return fragment(TEMPLATE, "verdicts", axis.replace("_", " "), levels, rows)


def _setup(cell: ExtremesMapping) -> str:
    """Return the settings of a setup besides the axis, in a few words."""
    return "" if cell["setup"] == cell["engine"] else str(cell["setup"]).removeprefix(f"{cell['engine']}, ")


def _limits(rows: Sequence[ExtremesMapping]) -> Markup:
    columns: CellColumns[ExtremesMapping] = (
        (HtmlColumn("axis"), lambda row: str(row["axis"]).replace("_", " ")),
        (HtmlColumn("engine"), lambda row: engine_name(row["engine"])),
        (HtmlColumn("settings"), lambda row: _setup(row) or "default"),
        (HtmlColumn("passes up to", True), lambda row: format_number(row["limit"], 4)),
        (HtmlColumn("first failure", True), lambda row: format_number(row["first_failure"], 4)),
    )
    return row_table(columns, rows, "Limits")


def _predictions(predictions: Sequence[ExtremesMapping]) -> Markup:
    """Return a row for each kind of warning."""
    columns: CellColumns[ExtremesMapping] = (
        (HtmlColumn("warning"), lambda row: str(row["kind"]).replace("_", " ")),
        (HtmlColumn("precision", True), lambda row: _percentage(row["precision"])),
        (HtmlColumn("recall", True), lambda row: _percentage(row["recall"])),
        (HtmlColumn("true alarms", True), lambda row: format_number(row["true_positives"])),
        (HtmlColumn("false alarms", True), lambda row: format_number(row["false_positives"])),
        (HtmlColumn("missed failures", True), lambda row: format_number(row["false_negatives"])),
    )
    return row_table(columns, predictions, "Predictions")


def _percentage(fraction: float | None) -> str:
    return UNKNOWN if fraction is None else format_percent(fraction)
