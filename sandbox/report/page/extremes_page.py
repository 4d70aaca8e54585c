"""Extremes as a page: a table an axis with a verdict a cell, limits, and how good the forecasts were."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from sandbox.measure.extremes.cell import MEANINGS, Word
from sandbox.report.page.document import Page, Section, write_page
from sandbox.report.page.markup import Child, Markup, joined, tag
from sandbox.report.page.tables import Column, table
from sandbox.report.page.verdicts import Shade, badge, engine_name
from sandbox.report.page.wording import NONE, number, plural

Document = Mapping[str, Any]
"""What `sandbox extremes --json` prints."""

SIGNS: dict[Word, tuple[str, Shade]] = {
    "exact": ("✓", "good"),
    "degraded": ("~", "fair"),
    "refused": ("–", "none"),
    "failed": ("✕", "bad"),
}


def write_extremes(document: Document, path: str | Path) -> Path:
    """Write the page of the extremes, to a temporary name first, and return its path.

    Raises:
        OSError: the file cannot be written.
    """
    return write_page(extremes_page(document), path)


def extremes_page(document: Document) -> Page:
    """Return the page of the extremes."""
    cells: Sequence[Document] = document["cells"]
    verdicts = [cell["verdict"] for cell in cells]
    counts = [f"{verdicts.count(word):,} {word}" for word in SIGNS if word in verdicts]
    keys = [tag("li", badge(f"{sign} {word}", shade), " ", MEANINGS[word]) for word, (sign, shade) in SIGNS.items()]
    lead = joined(tag("p", f"{plural(len(cells), 'cell')}: {', '.join(counts)}."), tag("ul", *keys, class_="keys"))
    axes = dict.fromkeys(str(cell["axis"]) for cell in cells)
    heats = [joined(tag("h3", axis.replace("_", " ")), _heat(axis, cells)) for axis in axes]
    sections = [Section("Axis by axis", joined(*heats), lead="Hover over a cell for its reason.")]
    if document["limits"]:
        lead_ = "The last level that passed and the first that failed, found by bisection."
        sections.append(Section("Limits", _limits(document["limits"]), lead=lead_))
    if document["predictions"]:
        sections.append(Section("Forecasts", _forecasts(document["predictions"]), lead=FORECASTS))
    return Page(
        "How far each engine goes",
        "Extremes",
        sections,
        lead,
        document["versions"],
        document["machine"],
    )


FORECASTS = (
    "sandbox check warned before each run. Precision is the fraction of warnings that came true; "
    "recall is the fraction of failures that had a warning."
)


def _heat(axis: str, cells: Sequence[Document]) -> Markup:
    """Return the table of an axis: a row an engine and setup, a column a level."""
    mine = [cell for cell in cells if cell["axis"] == axis]
    levels = sorted({float(cell["level"]) for cell in mine})
    rows: dict[tuple[str, str], dict[float, Document]] = {}
    for cell in mine:
        rows.setdefault((cell["engine"], _setup(cell)), {})[float(cell["level"])] = cell
    head = tag("tr", tag("th", "engine", scope="col"), *(tag("th", number(level, 4), scope="col") for level in levels))
    body = [
        tag(
            "tr",
            tag("th", engine_name(engine), f", {setup}" if setup else None, scope="row"),
            *(_cell(found.get(level)) for level in levels),
        )
        for (engine, setup), found in rows.items()
    ]
    caption = tag("caption", f"Verdicts along {axis}", class_="unseen")
    whole = tag("table", caption, tag("thead", head), tag("tbody", *body))
    return tag("div", whole, class_="table heat", tabindex="0", role="region", aria_label=f"Verdicts along {axis}")


def _cell(cell: Document | None) -> Markup:
    if cell is None:
        return tag("td", "", class_="cell")
    word: Word = cell["verdict"]
    sign, _ = SIGNS[word]
    about = f"{word}: {cell['reason']}"
    return tag(
        "td",
        tag("span", sign, aria_hidden="true"),
        tag("span", about, class_="unseen"),
        class_=f"cell {word}",
        title=about,
    )


def _setup(cell: Document) -> str:
    """Return what is set besides the axis, in a few words."""
    return "" if cell["setup"] == cell["engine"] else str(cell["setup"]).removeprefix(f"{cell['engine']}, ")


def _limits(rows: Sequence[Document]) -> Markup:
    columns = (
        Column("axis"),
        Column("engine"),
        Column("settings"),
        Column("passes up to", True),
        Column("first failure", True),
    )
    cells: list[list[Child]] = [
        [
            str(row["axis"]).replace("_", " "),
            engine_name(row["engine"]),
            _setup(row) or "default",
            number(row["limit"], 4),
            number(row["first_failure"], 4),
        ]
        for row in rows
    ]
    return table(columns, cells, "Limits")


def _forecasts(predictions: Sequence[Document]) -> Markup:
    """Return a row a kind of warning."""
    columns = (
        Column("warning"),
        Column("precision", True),
        Column("recall", True),
        Column("true alarms", True),
        Column("false alarms", True),
        Column("missed failures", True),
    )
    cells: list[list[Child]] = [
        [
            str(row["kind"]).replace("_", " "),
            _percent(row["precision"]),
            _percent(row["recall"]),
            *(number(row[key]) for key in ("true_positives", "false_positives", "false_negatives")),
        ]
        for row in predictions
    ]
    return table(columns, cells, "Forecasts")


def _percent(value: float | None) -> str:
    return NONE if value is None else f"{100.0 * value:.0f} %"
