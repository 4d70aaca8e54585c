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
LIMITS = "The last level that passed and the first that failed, found by bisection."
SURVIVAL = (
    "A level passes if 95 % of its perturbed starts survive. The bounds are the hardest level up to which all of them "
    "do, and the easiest that surely fails."
)
COST = (
    "The cost is the counted work at the easiest level relative to plain pymunk; limits of time steps are divided by "
    "it for a comparison at equal cost."
)
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
        lead = " ".join((LIMITS, *((SURVIVAL,) if document["starts"] > 1 else ()), COST))
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
        found.setdefault((cell["engine"], _setup(cell)), {})[float(cell["level"])] = _cell(cell)
    rows = [
        (engine_name(engine), setup, [by_level.get(level) for level in levels])
        for (engine, setup), by_level in found.items()
    ]
    return fragment(TEMPLATE, "verdicts", axis.replace("_", " "), levels, rows)


def _cell(cell: ExtremesMapping) -> dict[str, Any]:
    """Return the word, sign and reason of a cell; where some starts failed and some survived, with their fraction."""
    word: Verdict = cell["verdict"]
    sign, reason, survived = SIGNS[word][0], cell["reason"], cell["survived"]
    is_partial = survived is not None and 0 < survived["hits"] < survived["trials"]
    if is_partial:
        sign = f"{sign} {format_percent(survived['probability'])}"
    if survived is not None and survived["trials"] > 1:
        reason += f" ({survived['hits']} of {survived['trials']} starts survived)"
    return {"word": word, "sign": sign, "reason": reason, "is_partial": is_partial}


def _setup(cell: ExtremesMapping) -> str:
    """Return the settings of a setup besides the axis, in a few words."""
    return "" if cell["setup"] == cell["engine"] else str(cell["setup"]).removeprefix(f"{cell['engine']}, ")


def _limits(rows: Sequence[ExtremesMapping]) -> Markup:
    columns: CellColumns[ExtremesMapping] = (
        (HtmlColumn("axis"), lambda row: str(row["axis"]).replace("_", " ")),
        (HtmlColumn("engine"), lambda row: engine_name(row["engine"])),
        (HtmlColumn("settings"), lambda row: _setup(row) or "default"),
        (HtmlColumn("cost", True), lambda row: format_number(row["cost_ratio"], 3)),
        (HtmlColumn("passes up to", True), lambda row: format_number(row["limit"], 4)),
        (HtmlColumn("at equal cost", True), lambda row: format_number(row["limit_at_equal_cost"], 4)),
        (HtmlColumn("first failure", True), lambda row: format_number(row["first_failure"], 4)),
        (HtmlColumn("survived there", True), lambda row: _survived(row["failure_survived"])),
        (HtmlColumn("bounds", True), lambda row: _bounds(row)),
    )
    return row_table(columns, rows, "Limits")


def _survived(survived: ExtremesMapping | None) -> str:
    return UNKNOWN if survived is None else f"{survived['hits']} of {survived['trials']}"


def _bounds(limit: ExtremesMapping) -> str:
    if limit["bounds"] is None or limit["first_failure"] is None:
        return UNKNOWN
    return " to ".join(format_number(level, 4) for level in limit["bounds"])


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
