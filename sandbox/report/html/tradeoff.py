"""HTML page of a trade-off: recommendations, diagram, error budget and all settings."""

import math
from collections.abc import Collection, Sequence
from functools import partial
from itertools import zip_longest
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement

from markupsafe import Markup

from sandbox.columns import TRUTH
from sandbox.formatting import UNKNOWN, format_number, format_plural
from sandbox.measure.compare import Comparison
from sandbox.measure.tradeoff import Tradeoff
from sandbox.measure.tradeoff.recommendation import FRAME_TOLERANCE
from sandbox.report.colours import css_class_of
from sandbox.report.html.comparison import HOW_TO_REPLAY, linked_plots, settings_text
from sandbox.report.html.inline_svg import markup_of, svg_of
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
    paragraph,
    remark_paragraphs,
    row_table,
    table,
    write_page,
)
from sandbox.report.tradeoff_plot import (
    POINT,
    TradeoffMapping,
    WorkPoint,
    describe,
    draw_tradeoff,
    frame_time,
    is_longer_than_frame,
    pareto_of,
    point_of,
    work_points,
)

TEMPLATE = "tradeoff.html.j2"
PARTS = (("time_step", "time step"), ("solver", "solver"), ("left", "error at the finest step"))
"""Parts of an error: key in the document, and name."""
BAR_WIDTH, BAR_HEIGHT = 320.0, 14.0
HIT_RADIUS, RING_RADIUS = 9.0, 9.5
"""Points of the diagram: radius within which a point is clicked, and of the ring around a recommended one."""


def write_tradeoff(document: TradeoffMapping, path: str | Path, comparison: Comparison | None = None) -> Path:
    """Write the page of a trade-off, to a temporary name first, and return its path.

    Raises:
        OSError: the file cannot be written.
    """
    return write_page(tradeoff_page(document, comparison), path)


def tradeoff_page(document: TradeoffMapping, comparison: Comparison | None = None) -> Page:
    """Return the page of a trade-off.

    Args:
        document: document that `sandbox tradeoff --json` prints.
        comparison: comparison of the engines on the scene, for a replay.
    """
    sections = [Section("Error against cost", diagram(document, "cost"), lead=HOW_TO_CLICK), *details(document)]
    if comparison is not None and comparison.trajectories:
        how = f"Each engine runs with the scene's own settings. {HOW_TO_REPLAY}"
        sections.append(Section("Replay", linked_plots(comparison, "plot"), lead=how))
    lead = concatenated(
        answers(document), paragraph(truth_sentence(document)), remark_paragraphs(document.get("remarks") or ())
    )
    title = document.get("title") or str(document.get("scene") or "Untitled scene")
    return Page(title, "Trade-off", sections, lead, document.get("versions") or {}, document.get("machine") or {})


def page_of_tradeoff(found: Tradeoff) -> Page:
    """Return the page of a trade-off that was just measured."""
    return tradeoff_page(found.document())


LONG_STEP, OVER_BUDGET = ">frame", ">budget"
"""Marks of settings whose dt is longer than a frame, and of those whose most expensive frame exceeds the budget."""
HOW_TO_CLICK = (
    "Each point is one setting of one engine. Click it for its [solver] table, to be copied into the scene file."
)


def answers(document: TradeoffMapping) -> Markup | None:
    """Return the recommendations, each with the warnings of `check` for it, and the error metric."""
    sentences = document.get("answers") or []
    if not sentences:
        return None
    shown, items = set[tuple[str, str]](), []
    for text, key in zip_longest(sentences, document.get("answered_by") or []):  # documents of earlier versions lack it
        pick = None if key is None else _value_at(document, key)
        notes = [] if pick is None else _new_warnings(pick, shown)
        items.append((f"{text[:1].upper()}{text[1:]}", notes))
    return fragment(TEMPLATE, "answers", items, metric_sentence(document))


def _value_at(document: TradeoffMapping, key: str) -> Any:
    """Return the value at a key with dots, such as `cheapest_by_engine.pymunk`; None if there is none."""
    found: Any = document
    for name in key.split("."):
        found = (found or {}).get(name)
    return found


def _recommended(document: TradeoffMapping) -> list[TradeoffMapping]:
    """Return the recommended settings, or the nearest ones if none can be recommended."""
    found = [document.get("within_tolerance") or document.get("nearest_to_tolerance")]
    found += [document.get("within_budget") or document.get("nearest_to_budget")]
    found += (document.get("cheapest_by_engine") or {}).values()
    return [pick for pick in found if pick]


def _new_warnings(pick: TradeoffMapping, shown: set[tuple[str, str]]) -> list[str]:
    """Return the warnings for a recommended setting that are not shown yet, and add them to those that are."""
    keys = dict.fromkeys((str(pick["sentence"]), str(each["message"])) for each in pick.get("warnings") or ())
    found = [key for key in keys if key not in shown]
    shown.update(found)
    return [message for _, message in found]


def metric_sentence(document: TradeoffMapping) -> str:
    """Return the error metric and the reason for it as a sentence."""
    name = str(document["metric"]).replace("_", " ")
    about = f" ({document['metric_about']})" if document.get("metric_about") else ""
    reason = f", chosen because {document['metric_reason']}" if document.get("metric_reason") else ""
    return f"Error metric: {name}{about}{reason}."


def truth_sentence(document: TradeoffMapping) -> str:
    """Return the truth that errors are measured against."""
    if not document.get("truth"):
        why = f": {document['truth_about']}" if document.get("truth_about") else ""
        return f"No truth is available to measure errors against{why}."
    about = f" ({document['truth_about']})" if document.get("truth_about") else ""
    until = document.get("trusted_until")
    trusted = "" if until is None else f", trusted until {format_number(until, 4)} s"
    return f"Errors are measured against the truth: {str(document['truth']).replace('_', ' ')}{about}{trusted}."


def diagram(document: TradeoffMapping, name: str) -> Markup:
    """Return the diagram, whose points can be selected, beside the facts about the selected point.

    Args:
        document: document of the trade-off.
        name: name of the diagram, unique in the page.
    """
    points = work_points(document)
    metric = document["metric"].replace("_", " ")
    label = f"{metric} against cost, {format_plural(len(points), 'point')}; arrow keys move along the Pareto front"
    root = svg_of(draw_tradeoff(document, with_title=False), name, label, "chart broad points")
    root.set("role", "group")  # not an image: it contains buttons
    front = {point.index for point in pareto_of(document, points)}
    recommended = [point_of(points, document.get(key)) for key in ("within_tolerance", "within_budget")]
    ringed = {point.index for point in recommended if point is not None}
    groups = {group.get("data-gid", ""): group for group in root.iter("g")}
    for point in points:
        _make_button(groups[f"{POINT}{point.index}"], point, document, front, ringed)
    return fragment(TEMPLATE, "diagram", markup_of(root), [_facts(point, document) for point in points])


def _make_button(
    group: Element, point: WorkPoint, document: TradeoffMapping, front: Collection[int], ringed: Collection[int]
) -> None:
    """Make a point of the diagram a button with a label, a large enough area to click, and a ring if recommended."""
    lines = list(describe(point, document["metric"], document.get("unit") or ""))
    mark = next(group.iter("use"))
    centre = {"cx": mark.get("x", "0"), "cy": mark.get("y", "0")}
    del group.attrib["data-gid"]
    attributes = {"class": css_class_of(point.engine), "data-point": str(point.index), "role": "button"}
    group.attrib.update(
        attributes | {"tabindex": "0" if point.index in front else "-1", "aria-label": "; ".join(lines)}
    )
    if point.index in front:
        group.set("data-front", "")
    if point.index in ringed:
        SubElement(group, "circle", {**centre, "r": f"{RING_RADIUS}", "class": "best"})
    SubElement(group, "circle", {**centre, "r": f"{HIT_RADIUS}", "class": "hit-area"})
    title = Element("title")
    title.text = "\n".join(lines)
    group.insert(0, title)


def _facts(point: WorkPoint, document: TradeoffMapping) -> dict[str, Any]:
    """Return the facts about a point that are shown when it is selected."""
    unit, metric = document.get("unit") or "", document["metric"].replace("_", " ")
    row = point.row
    repeats = row.get("repeats")
    estimated = "" if repeats else ", not timed"
    median = format_number(row.get("cost_median_ms_per_second"))
    figures = [
        (metric, f"{_error_cell(point)} {'' if point.error is None or point.is_truth else unit}".rstrip()),
        *_start_figures(point),
        ("cost", UNKNOWN if point.cost is None else f"{format_number(point.cost)} ms per s{estimated}"),
        ("median cost", f"{median} ms per s" if repeats else UNKNOWN),
        ("repeats", str(repeats) if repeats else UNKNOWN),
        ("time per frame", _frame_text(point, document)),
        *((str(name).replace("_", " "), f"{count:,}") for name, count in (row.get("work") or {}).items()),
    ]
    if point.status != "ok":
        figures.insert(0, (point.status, row.get("reason") or "no reason given"))
    elif is_longer_than_frame(point, document):
        figures.insert(0, (LONG_STEP, f"not recommended: {_long_reason(document)}"))
    picks = [pick for pick in _recommended(document) if point_of([point], pick) is not None]
    messages = dict.fromkeys(str(each["message"]) for pick in picks for each in pick.get("warnings") or ())
    figures += [("note", message) for message in messages]
    title = next(describe(point, document["metric"], unit))
    return {"title": title, "figures": figures, "text": settings_text(point.settings, point.engine)}


def _start_figures(point: WorkPoint) -> list[tuple[str, str]]:
    """Return the errors of a point from fresh starts and what differs in its ends; empty without such starts."""
    figures: list[tuple[str, str]] = []
    if found := point.row.get("fresh_starts"):
        figures += [
            ("fresh starts", str(found["held"]["trials"])),
            ("median of these", format_number(found["median_error"])),
            ("95 % of these", format_number(found["error_95"])),
        ]
    if ends := point.row.get("end_statistics"):
        differing = [each["name"].replace("_", " ") for each in ends["statistics"] if each["differs"]]
        failed = [f"{ends['failed']} failed"] if ends["failed"] else []
        figures.append((f"ends of {ends['starts']} starts differ in", ", ".join([*failed, *differing]) or "nothing"))
    return figures


def _start_cell(point: WorkPoint, key: str) -> str:
    """Return a quantile of the errors of a point from fresh starts, and `∞` where too many of its runs failed."""
    found = point.row.get("fresh_starts")
    if not found:
        return UNKNOWN
    if point.is_truth and found[key] == 0.0:
        return TRUTH
    return format_number(math.inf if found[key] is None else found[key])


def _frame_text(point: WorkPoint, document: TradeoffMapping) -> str:
    """Return the computing time of the most expensive frame, compared with the budget if there is one."""
    time, budget = frame_time(point, document), document.get("budget")
    if time is None:
        return UNKNOWN
    if budget is None:
        return f"{format_number(time)} ms at {document['fps']:g} fps"
    relation = " of" if time <= budget else ", more than"
    return f"{format_number(time)} ms{relation} the budget of {format_number(budget)} ms"


def _long_reason(document: TradeoffMapping) -> str:
    """Return the meaning of `LONG_STEP`."""
    exception = "" if document["max_dt"] <= FRAME_TOLERANCE / document["fps"] else " and than the dt of the scene"
    return f"dt is longer than a frame at {document['fps']:g} fps{exception}"


def details(document: TradeoffMapping) -> list[Section]:
    """Return the sections below the diagram, those that the document has results for."""
    found = []
    points = work_points(document)
    front = pareto_of(document, points)
    if front:
        lead = (
            "From the cheapest to the most accurate. No other setting that was tried is both cheaper and more accurate."
        )
        body = concatenated(_front_table(front, document), _long_legend(front, document))
        found.append(Section("The Pareto front", body, lead=lead))
    if document.get("orders"):
        lead = (
            "Power of the substep that the error of a method is proportional to, fitted over three substeps or more. "
            "Methods whose errors do not fall steadily have none."
        )
        found.append(Section("Orders of convergence", _orders(document["orders"]), lead=lead))
    if document.get("split"):
        lead = (
            "Solver: error that more iterations remove. Time step: error that the finest step tried removes. "
            "The rest is left at that step; with collisions, a still finer one may remove it."
        )
        found.append(Section("Sources of error", error_budget(document["split"]), lead=lead))
    if document.get("proposals"):
        found.append(Section("Cheaper models", _proposals(document["proposals"], document.get("unit") or "")))
    summary = f"{format_plural(len(points), 'point')}, with metrics and work counters"
    rows = _points_table(points, document), _long_legend(points, document)
    found.append(Section("All settings tried", fragment(TEMPLATE, "all_settings", summary, *rows)))
    return found


def _orders(orders: Sequence[TradeoffMapping]) -> Markup:
    columns: CellColumns[TradeoffMapping] = (
        (HtmlColumn("engine"), lambda row: engine_name(row["engine"])),
        (HtmlColumn("method"), lambda row: _changes_text(row["changes"]) or "as the scene has it"),
        (HtmlColumn("order", True), lambda row: format_number(row["order"])),
        (HtmlColumn("substeps, s", True), lambda row: f"{row['finest']:.3g} to {row['coarsest']:.3g}"),
        (HtmlColumn("settings", True), lambda row: str(len(row["points"]))),
    )
    return row_table(columns, orders, "Orders of convergence")


def error_budget(rows: Sequence[TradeoffMapping]) -> Markup:
    """Return the parts of each engine's error as a table with bars of equal length.

    Args:
        rows: each with `engine`, `total`, `time_step`, `solver` and `left`, in m.
    """
    columns = [HtmlColumn("engine"), HtmlColumn("fractions"), HtmlColumn("error, m", True)]
    columns += [HtmlColumn(f"{name}, m", True) for _, name in PARTS]
    cells = [
        [
            engine_name(row["engine"]),
            _bar(row),
            format_number(row["total"]),
            *(format_number(row.get(key)) for key, _ in PARTS),
        ]
        for row in rows
    ]
    return concatenated(table(columns, cells, "Sources of error"), fragment(TEMPLATE, "bar_key", PARTS))


def _bar(row: TradeoffMapping) -> Markup:
    """Return the bar of an engine: the fractions of its error."""
    parts = {key: max(float(row.get(key) or 0.0), 0.0) for key, _ in PARTS}
    total = sum(parts.values())
    x, bars, words = 0.0, [], []
    for key, name in PARTS:
        width = BAR_WIDTH * parts[key] / total if total > 0.0 else 0.0
        if width > 0.0:
            bars.append({"x": f"{x:.6g}", "width": f"{width:.6g}", "key": key})
        words.append(f"{name} {100.0 * width / BAR_WIDTH:.0f} %")
        x += width
    return fragment(TEMPLATE, "bar", ", ".join(words), f"{BAR_WIDTH:g}", f"{BAR_HEIGHT:g}", bars)


def _long_legend(points: Sequence[WorkPoint], document: TradeoffMapping) -> Markup | None:
    """Return the meaning of `LONG_STEP`, if a point of a table has that mark."""
    if not any(is_longer_than_frame(point, document) for point in points):
        return None
    return paragraph(f"{LONG_STEP}: {_long_reason(document)}, so the setting is not recommended.")


def _metric_column(document: TradeoffMapping) -> HtmlColumn:
    unit = document.get("unit") or ""
    return HtmlColumn(f"{document['metric'].replace('_', ' ')}{', ' if unit else ''}{unit}", True)


def _error_cell(point: WorkPoint) -> str:
    """Return the error of a point as text, `truth` if its run is the truth itself."""
    return TRUTH if point.is_truth else format_number(point.error)


COST = HtmlColumn(
    "ms per s",
    True,
    "milliseconds per simulated second, minimum of the repeats; without repeats estimated from the counted work",
)
REPEATS = HtmlColumn("repeats", True, "timings in turns")


def _front_table(points: Sequence[WorkPoint], document: TradeoffMapping) -> Markup:
    """Return a row for each point of the front."""
    at = f" at {document['fps']:g} fps" if document.get("fps") else ""
    median = HtmlColumn("median ms per s", True, "milliseconds per simulated second, median of the repeats")
    frame = HtmlColumn("ms per frame", True, f"median of the most expensive frame{at}")
    columns: CellColumns[WorkPoint] = (
        (HtmlColumn("engine"), lambda point: engine_name(point.engine)),
        (HtmlColumn("changes"), lambda point: _marked_changes(point, document)),
        (_metric_column(document), _error_cell),
        (
            HtmlColumn("median", True, "median of the errors from fresh starts"),
            partial(_start_cell, key="median_error"),
        ),
        (HtmlColumn("95 %", True, "95 % quantile of these errors"), partial(_start_cell, key="error_95")),
        (COST, lambda point: format_number(point.cost)),
        (median, lambda point: format_number(point.row.get("cost_median_ms_per_second"))),
        (frame, lambda point: _frame_cell(point, document)),
        (REPEATS, lambda point: str(point.row.get("repeats", UNKNOWN))),
    )
    return row_table(columns, points, "The Pareto front")


def _points_table(points: Sequence[WorkPoint], document: TradeoffMapping) -> Markup:
    """Return a row for each point, with every metric and counter that any of them has."""
    metrics = [key for key in _keys(points, "metrics") if key != document["metric"]]
    counters = _keys(points, "work")
    columns = [
        HtmlColumn("engine"),
        HtmlColumn("changes"),
        HtmlColumn("verdict"),
        _metric_column(document),
        COST,
        REPEATS,
    ]
    columns += [HtmlColumn(name.replace("_", " "), True) for name in (*metrics, *counters)]
    rows = []
    for point in points:
        cells: list[Content] = [engine_name(point.engine), _marked_changes(point, document)]
        cells.append(badge(point.status, "good" if point.is_drawable else "bad", point.row.get("reason")))
        cells += [_error_cell(point), format_number(point.cost), str(point.row.get("repeats", UNKNOWN))]
        cells += [format_number((point.row.get("metrics") or {}).get(name)) for name in metrics]
        counts = point.row.get("work") or {}
        cells += [f"{counts[name]:,}" if name in counts else UNKNOWN for name in counters]
        rows.append(cells)
    return table(columns, rows, "All points")


def _keys(points: Sequence[WorkPoint], field: str) -> list[str]:
    return list(dict.fromkeys(key for point in points for key in point.row.get(field) or {}))


def _frame_cell(point: WorkPoint, document: TradeoffMapping) -> Content:
    """Return the computing time of the most expensive frame, marked where it is more than the budget."""
    time, budget = frame_time(point, document), document.get("budget")
    if time is None or budget is None or time <= budget:
        return format_number(time)
    mark = badge(OVER_BUDGET, "fair", f"more than the budget of {format_number(budget)} ms")
    return concatenated(mark, " ", format_number(time))


def _marked_changes(point: WorkPoint, document: TradeoffMapping) -> Content:
    """Return the changes of a point, marked where its dt is longer than a frame."""
    if not is_longer_than_frame(point, document):
        return _changes(point)
    mark = badge(LONG_STEP, "fair", f"{_long_reason(document)}, so it is not recommended")
    return concatenated(_changes(point), " ", mark)


def _changes(point: WorkPoint) -> str:
    """Return the changes of a point to the scene's own solver, in a line."""
    changes = point.row.get("changes") or {}
    text = _changes_text(changes) or "the scene's own settings"
    return f"{text} (the scene's own)" if changes and point.row.get("scene_setting") else text


def _changes_text(changes: TradeoffMapping) -> str:
    """Return changes of settings in a line."""
    words = [
        f"{key} {format_number(value, 4) if isinstance(value, float) else value}" for key, value in changes.items()
    ]
    return ", ".join(words).replace("_", " ")


def _proposals(proposals: Sequence[TradeoffMapping], unit: str) -> Markup:
    columns: CellColumns[TradeoffMapping] = (
        (HtmlColumn("instead"), lambda row: str(row.get("what")).replace("_", " ")),
        (HtmlColumn("engine"), lambda row: engine_name(row["engine"]) if row.get("engine") else UNKNOWN),
        (HtmlColumn(f"error{', ' if unit else ''}{unit}", True), lambda row: format_number(row.get("error"))),
        (HtmlColumn("ms per s", True), lambda row: format_number(row.get("cost_ms_per_second"))),
        (HtmlColumn("relative cost", True), _ratio_cell),
    )
    sentences = [each["sentence"] for each in proposals if each.get("sentence")]
    listed = fragment("parts.html.j2", "items", sentences, "plain") if sentences else None
    return concatenated(listed, row_table(columns, proposals, "Cheaper models"))


def _ratio_cell(row: TradeoffMapping) -> str:
    if row.get("ratio") is None:
        return UNKNOWN
    low, high = row.get("interval") or (None, None)
    interval = "" if low is None else f" ({format_number(low, 2)} to {format_number(high, 2)})"
    return f"×{format_number(row['ratio'], 2)}{interval}"
