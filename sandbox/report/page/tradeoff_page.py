"""A trade-off as a page: the answers first, then error against cost, what the error consists of, and all figures."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sandbox.measure.compare import Comparison
from sandbox.measure.tradeoff import Tradeoff
from sandbox.measure.tradeoff.picking import LONGER
from sandbox.report.page.comparison_page import HOW, linked_plots
from sandbox.report.page.document import Page, Section, write_page
from sandbox.report.page.markup import Child, Markup, data, joined, tag
from sandbox.report.page.settings_text import settings_text
from sandbox.report.page.split_bars import split_bars
from sandbox.report.page.tables import Column, table
from sandbox.report.page.tradeoff_chart import chart_keys, tradeoff_chart
from sandbox.report.page.verdicts import badge, engine_name
from sandbox.report.page.wording import NONE, number, plural
from sandbox.report.work_points import (
    Document,
    WorkPoint,
    frame_time,
    is_longer_than_frame,
    pareto_of,
    same,
    told,
    work_points,
)


def write_tradeoff(document: Document, path: str | Path, comparison: Comparison | None = None) -> Path:
    """Write the page of a trade-off, to a temporary name first, and return its path.

    Raises:
        OSError: the file cannot be written.
    """
    return write_page(tradeoff_page(document, comparison), path)


def tradeoff_page(document: Document, comparison: Comparison | None = None) -> Page:
    """Return the page of a trade-off.

    Args:
        document: what `sandbox tradeoff --json` prints.
        comparison: of the scene, to be replayed beside it.
    """
    sections = [Section("Error against cost", weighed(document, "trade"), lead=POINTS), *details(document)]
    if comparison is not None and comparison.trajectories:
        how = f"Each engine runs with the scene's own settings. {HOW}"
        sections.append(Section("Replay", linked_plots(comparison, "plot"), lead=how))
    lead = joined(answers(document), tag("p", truth_of(document), class_="soft"))
    title = document.get("title") or str(document.get("scene") or "Untitled scene")
    return Page(title, "Trade-off", sections, lead, document.get("versions") or {}, document.get("machine") or {})


def page_of_tradeoff(found: Tradeoff) -> Page:
    """Return the page of a trade-off that was just measured."""
    return tradeoff_page(found.document())


LONG, OVER = ">frame", ">budget"
"""Marks of settings whose dt is longer than a frame, and of those whose most expensive frame exceeds the budget."""
POINTS = "Each point is one setting of one engine. Click it for its [solver] table, to be copied into the scene file."


def answers(document: Document) -> Markup | None:
    """Return the sentences that people came for, and in which metric they are."""
    told_ = document.get("answers") or []
    if not told_:
        return None
    picks, shown = _picks(document), set[tuple[str, str]]()
    items = []
    for text in told_:
        pick = next((each for each in picks if text.endswith(each["sentence"])), None)
        notes = [] if pick is None else _new_warnings(pick, shown)
        items.append(tag("li", f"{text[:1].upper()}{text[1:]}", *(_note(message) for message in notes)))
    return joined(tag("ul", *items, class_="answers"), tag("p", metric_of(document), class_="soft"))


def _picks(document: Document) -> list[Document]:
    """Return the recommended settings, with those that are nearest where none is."""
    found = [document.get("within_tolerance") or document.get("nearest_to_tolerance")]
    found += [document.get("within_budget") or document.get("nearest_to_budget")]
    found += (document.get("cheapest_by_engine") or {}).values()
    return [pick for pick in found if pick]


def _new_warnings(pick: Document, shown: set[tuple[str, str]]) -> list[str]:
    """Return the warnings for a recommended setting that are not shown yet, and add them to those that are."""
    keys = dict.fromkeys((str(pick["sentence"]), str(each["message"])) for each in pick.get("warnings") or ())
    found = [key for key in keys if key not in shown]
    shown.update(found)
    return [message for _, message in found]


def _note(message: str) -> Markup:
    """Return a warning of `check` for a recommended setting."""
    return tag("p", badge("note", "fair", "predicted by formulas; the measured runs may not show it"), " ", message)


def metric_of(document: Document) -> str:
    """Say what errors are counted in, and why."""
    name = str(document["metric"]).replace("_", " ")
    about = f" ({document['metric_about']})" if document.get("metric_about") else ""
    reason = f", chosen because {document['metric_reason']}" if document.get("metric_reason") else ""
    return f"Error metric: {name}{about}{reason}."


def truth_of(document: Document) -> str:
    """Say what errors are measured against."""
    if not document.get("truth"):
        why = f": {document['truth_about']}" if document.get("truth_about") else ""
        return f"No truth is available to measure errors against{why}."
    about = f" ({document['truth_about']})" if document.get("truth_about") else ""
    until = document.get("trusted_until")
    trusted = "" if until is None else f", trusted until {number(until, 4)} s"
    return f"Errors are measured against the truth: {str(document['truth']).replace('_', ' ')}{about}{trusted}."


def weighed(document: Document, name: str) -> Markup:
    """Return the chart beside what the chosen point is.

    Args:
        document: of the trade-off.
        name: begins the names in it, which no other on the page may share.
    """
    points = work_points(document)
    chosen = tag(
        "aside",
        tag("h3", "No point chosen", class_="what"),
        tag("dl", class_="figures"),
        tag("pre", tag("code", ""), hidden=True),
        tag("button", "Copy", type="button", class_="copy", hidden=True),
        class_="chosen",
        aria_live="polite",
    )
    chart = tag("div", tradeoff_chart(document, name), chart_keys(document))
    facts = data([_facts(point, document) for point in points], class_="facts")
    return tag("div", chart, chosen, facts, class_="weigh")


def _facts(point: WorkPoint, document: Document) -> dict[str, Any]:
    """Return what is told of a point that is chosen."""
    unit, metric = document.get("unit") or "", document["metric"].replace("_", " ")
    row = point.document
    repeats = row.get("repeats")
    figures = [
        (metric, f"{number(point.error)} {unit}".rstrip() if point.error is not None else NONE),
        ("cost", f"{number(point.cost)} ms per s" if point.cost is not None else NONE),
        ("median cost", f"{number(row.get('cost_median_ms_per_second'))} ms per s" if repeats else NONE),
        ("repeats", str(repeats) if repeats else NONE),
        ("time per frame", _frame_words(point, document)),
        *((str(name).replace("_", " "), f"{count:,}") for name, count in (row.get("work") or {}).items()),
    ]
    if point.status != "ok":
        figures.insert(0, (point.status, point.reason or "no reason given"))
    elif is_longer_than_frame(point, document):
        figures.insert(0, (LONG, f"not recommended: {long_about(document)}"))
    own = [pick for pick in _picks(document) if same([point], pick) is not None]
    messages = dict.fromkeys(str(each["message"]) for pick in own for each in pick.get("warnings") or ())
    figures += [("note", message) for message in messages]
    title = next(told(point, document["metric"], unit))
    return {"title": title, "figures": figures, "text": settings_text(point.settings, point.engine)}


def _frame_words(point: WorkPoint, document: Document) -> str:
    """Return the computing time of the most expensive frame, compared with the budget if there is one."""
    time, budget = frame_time(point, document), document.get("budget")
    if time is None:
        return NONE
    if budget is None:
        return f"{number(time)} ms at {document['fps']:g} fps"
    return f"{number(time)} ms{' of' if time <= budget else ', more than'} the budget of {number(budget)} ms"


def long_about(document: Document) -> str:
    """Say what `LONG` means."""
    own = "" if document["max_dt"] <= LONGER / document["fps"] else " and than the dt of the scene"
    return f"dt is longer than a frame at {document['fps']:g} fps{own}"


def details(document: Document) -> list[Section]:
    """Return the tables and bars below the chart, those that there is something for."""
    found = []
    points = work_points(document)
    unit = document.get("unit") or ""
    front = pareto_of(document, points)
    if front:
        lead = (
            "From the cheapest to the most accurate. No other setting that was tried is both cheaper and more accurate."
        )
        body = joined(_front_table(front, document), _long_legend(front, document))
        found.append(Section("The Pareto front", body, lead=lead))
    if document.get("split"):
        lead = (
            "Model: error that remains as the time step goes to 0. Solver: error that more iterations remove. "
            "Time step: the rest."
        )
        found.append(Section("Sources of error", split_bars(document["split"]), lead=lead))
    if document.get("proposals"):
        found.append(Section("Cheaper models", _proposals(document["proposals"], unit)))
    others = _points_table(points, document, "All points")
    summary = tag("summary", f"{plural(len(points), 'point')}, with metrics and work counters")
    found.append(Section("All settings tried", tag("details", summary, others, _long_legend(points, document))))
    return found


def _long_legend(points: Sequence[WorkPoint], document: Document) -> Markup | None:
    """Return what `LONG` means, where a point of a table bears it."""
    if not any(is_longer_than_frame(point, document) for point in points):
        return None
    return tag("p", f"{LONG}: {long_about(document)}, so the setting is not recommended.", class_="soft")


def _front_table(points: Sequence[WorkPoint], document: Document) -> Markup:
    """Return a row a point of the front."""
    unit = document.get("unit") or ""
    at = f" at {document['fps']:g} fps" if document.get("fps") else ""
    columns = (
        Column("engine"),
        Column("changes"),
        Column(f"{document['metric'].replace('_', ' ')}{', ' if unit else ''}{unit}", True),
        Column("ms per s", True, "milliseconds per simulated second, minimum of the repeats"),
        Column("median", True, "milliseconds per simulated second, median of the repeats"),
        Column("ms per frame", True, f"median of the most expensive frame{at}"),
        Column("repeats", True),
    )
    rows = [
        [
            engine_name(point.engine),
            _marked_changes(point, document),
            number(point.error),
            number(point.cost),
            number(point.document.get("cost_median_ms_per_second")),
            _frame_cell(point, document),
            str(point.document.get("repeats", NONE)),
        ]
        for point in points
    ]
    return table(columns, rows, "The Pareto front")


def _points_table(points: Sequence[WorkPoint], document: Document, caption: str) -> Markup:
    """Return a row a point, with every metric and counter that any of them has."""
    unit = document.get("unit") or ""
    metrics = _keys(points, "metrics", document["metric"])
    work = _keys(points, "work", "")
    head = [Column("engine"), Column("changes"), Column("verdict")]
    head += [Column(f"{document['metric'].replace('_', ' ')}{', ' if unit else ''}{unit}", True)]
    head += [Column("ms per s", True, "milliseconds per simulated second, minimum of the repeats")]
    head += [Column(name.replace("_", " "), True) for name in (*metrics, *work)]
    rows = []
    for point in points:
        cells: list[Child] = [engine_name(point.engine), _marked_changes(point, document)]
        cells.append(badge(point.status, "good" if point.whole else "bad", point.reason))
        cells += [number(point.error), number(point.cost)]
        cells += [number((point.document.get("metrics") or {}).get(name)) for name in metrics]
        for name in work:
            value = (point.document.get("work") or {}).get(name)
            cells.append(NONE if value is None else f"{value:,}")
        rows.append(cells)
    return table(head, rows, caption)


def _keys(points: Sequence[WorkPoint], field: str, without: str) -> list[str]:
    keys = dict.fromkeys(key for point in points for key in point.document.get(field) or {})
    return [key for key in keys if key != without]


def _frame_cell(point: WorkPoint, document: Document) -> Child:
    """Return the computing time of the most expensive frame, marked where it is more than the budget."""
    time, budget = frame_time(point, document), document.get("budget")
    if time is None or budget is None or time <= budget:
        return number(time)
    return joined(badge(OVER, "fair", f"more than the budget of {number(budget)} ms"), " ", number(time))


def _marked_changes(point: WorkPoint, document: Document) -> Child:
    """Return what a point changes, marked where its dt is longer than a frame."""
    if not is_longer_than_frame(point, document):
        return _changes(point)
    return joined(_changes(point), " ", badge(LONG, "fair", f"{long_about(document)}, so it is not recommended"))


def _changes(point: WorkPoint) -> str:
    """Return what a point changes of the scene's own solver, in a line."""
    changes = point.document.get("changes") or {}
    words = [f"{key} {number(value, 4) if isinstance(value, float) else value}" for key, value in changes.items()]
    text = ", ".join(words).replace("_", " ") or "the scene's own settings"
    return f"{text} (the scene's own)" if changes and point.document.get("scene_setting") else text


def _proposals(proposals: Sequence[Document], unit: str) -> Markup:
    columns = (
        Column("instead"),
        Column("engine"),
        Column(f"error{', ' if unit else ''}{unit}", True),
        Column("ms per s", True),
        Column("relative cost", True),
    )
    rows = [
        [
            str(each.get("what")).replace("_", " "),
            engine_name(each["engine"]) if each.get("engine") else NONE,
            number(each.get("error")),
            number(each.get("cost_ms_per_second")),
            f"×{number(each['ratio'])}" if each.get("ratio") is not None else NONE,
        ]
        for each in proposals
    ]
    sentences = [tag("li", each["sentence"]) for each in proposals if each.get("sentence")]
    return joined(tag("ul", *sentences, class_="plain") if sentences else None, table(columns, rows, "Cheaper models"))
