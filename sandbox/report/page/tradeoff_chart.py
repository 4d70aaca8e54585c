"""The chart of a trade-off: error against cost, log–log, whose points tell their settings."""

import math
from collections.abc import Sequence

from sandbox.report.page.axes import Axes
from sandbox.report.page.markup import Markup, joined, tag
from sandbox.report.page.scales import Log
from sandbox.report.page.verdicts import look_of
from sandbox.report.page.wording import number
from sandbox.report.work_points import (
    Document,
    WorkPoint,
    budget_of,
    costs_of,
    errors_of,
    floors_of,
    methods,
    pareto_of,
    same,
    shown_error,
    told,
    work_points,
)

SIZE = 5.0
"""Half the width of a mark."""
REACH = 9.0
"""Radius within which a point is hit."""
STRIP = 26.0
"""Width of the edges where failures are, right and above."""
SHAPES = ("disc", "square", "diamond", "up", "down", "ring", "frame", "gem", "left", "right")
"""A mark a method of an engine."""
HOLLOW = ("ring", "frame", "gem")


def tradeoff_chart(document: Document, name: str) -> Markup:
    """Return the chart.

    Args:
        document: of the trade-off.
        name: begins the names in it, which no other on the page may share.
    """
    points = work_points(document)
    costs, errors = costs_of(document, points) or [1.0], errors_of(document, points) or [1.0]
    axes = Axes(
        Log.snug(min(costs), max(costs)),
        Log.around(min(errors), max(errors), room=0.05),
        width=760.0,
        height=470.0,
        left=54.0,
        right=STRIP + 12.0,
        top=STRIP + 26.0,
    )
    unit = document.get("unit") or ""
    metric = document["metric"].replace("_", " ")
    curves = methods(points)
    shapes = shapes_of(curves)
    parts = [axes.frame("ms per simulated second", f"{metric}, {unit}" if unit else metric), _bounds(axes, document)]
    inside = [_curve(axes, mine, f"curve {look_of(engine)}") for (engine, _), mine in curves.items()]
    front = pareto_of(document, points)
    if front:
        inside.append(_curve(axes, front, "front"))
    parts.append(axes.clip(f"{name}-cut", *inside))
    fronted = {point.number for point in front}
    best = {p.number for key in ("within_tolerance", "within_budget") if (p := same(points, document.get(key)))}
    marks = [_mark(axes, each, shapes, document, each.number in fronted, each.number in best) for each in points]
    parts.append(tag("g", *marks, class_="points"))
    return tag(
        "svg",
        *parts,
        viewBox=f"0 0 {axes.width:g} {axes.height:g}",
        class_="chart broad",
        role="group",
        aria_label=f"{metric} against cost, {len(points)} points; arrow keys move along the Pareto front",
    )


def shapes_of(curves: dict[tuple[str, str], list[WorkPoint]]) -> dict[tuple[str, str], str]:
    """Return a mark for each method, the first of every engine alike."""
    seen: dict[str, int] = {}
    found = {}
    for key in curves:
        place = seen.setdefault(key[0], 0)
        seen[key[0]] += 1
        found[key] = SHAPES[place % len(SHAPES)]
    return found


def chart_keys(document: Document) -> Markup:
    """Return what marks and lines of the chart mean."""
    points = work_points(document)
    entries = []
    for (engine, method), shape in shapes_of(methods(points)).items():
        mark = tag("svg", _shape(shape, 0.0, 0.0), viewBox="-7 -7 14 14", class_=f"{look_of(engine)} points")
        entries.append(tag("li", tag("span", mark, class_="points"), f"{engine}: {method}" if method else engine))

    def line(look: str, text: str) -> Markup:
        stroke = tag("line", x1=-9.0, x2=9.0, y1=0.0, y2=0.0, class_=look)
        return tag("li", tag("svg", stroke, viewBox="-7 -7 14 14"), text)

    if document["pareto"]:
        entries.append(line("front", "Pareto front: no setting tried is both cheaper and more accurate"))
    entries += [
        line(f"floor {look_of(engine)}", f"{engine}: error limit at any step (its model's error)")
        for engine in floors_of(document)
    ]
    if any(not point.whole for point in points):
        cross = tag("svg", _shape("cross", 0.0, 0.0), viewBox="-7 -7 14 14", class_="truth points")
        entries.append(tag("li", cross, "failed: no valid error at the top, no cost at the right"))
    return tag("ul", *entries, class_="keys")


def _bounds(axes: Axes, document: Document) -> Markup:
    """Return the floors, the tolerance and the budget."""
    parts = []
    end, base = axes.width - axes.right, axes.height - axes.bottom
    for engine, floor in floors_of(document).items():
        y = axes.up(shown_error(floor))
        parts.append(tag("line", x1=axes.left, x2=end, y1=y, y2=y, class_=f"floor {look_of(engine)}"))
    tolerance, budget = document.get("tolerance"), budget_of(document)
    if tolerance:
        y = axes.up(tolerance)
        text = f"tolerance {number(tolerance, 2)} {document.get('unit') or ''}"
        parts.append(tag("line", x1=axes.left, x2=end, y1=y, y2=y, class_="bound"))
        parts.append(tag("text", text, x=axes.left + 5.0, y=y - 5.0, class_="note"))
    if budget:
        x = axes.across(budget)
        parts.append(tag("line", x1=x, x2=x, y1=axes.top, y2=base, class_="bound"))
        parts.append(
            tag(
                "text", f"budget {number(document.get('budget'), 2)} ms a frame", x=x + 5.0, y=base - 7.0, class_="note"
            )
        )
    return joined(*parts)


def _curve(axes: Axes, points: Sequence[WorkPoint], look: str) -> Markup:
    words = [f"{x:.1f},{y:.1f}" for x, y in (_place(axes, point) for point in points)]
    return tag("polyline", points=" ".join(words), class_=look)


def _place(axes: Axes, point: WorkPoint) -> tuple[float, float]:
    """Return where a point lies; what has no error lies above all, what has no cost to the right."""
    x = axes.across(point.cost) if point.cost and point.cost > 0.0 else axes.width - 0.5 * STRIP
    if point.error is None or point.status != "ok" or not math.isfinite(point.error):
        return x, axes.top - 0.5 * STRIP
    return x, axes.up(shown_error(point.error))


def _mark(
    axes: Axes, point: WorkPoint, shapes: dict[tuple[str, str], str], document: Document, front: bool, best: bool
) -> Markup:
    x, y = _place(axes, point)
    shape = shapes.get((point.engine, point.method), "disc") if point.whole else "cross"
    lines = list(told(point, document["metric"], document.get("unit") or ""))
    return tag(
        "g",
        tag("title", "\n".join(lines)),
        tag("circle", cx=x, cy=y, r=REACH, class_="reach"),
        tag("circle", cx=x, cy=y, r=SIZE + 5.0, class_="best") if best else None,
        _shape(shape, x, y),
        class_=look_of(point.engine),
        data_point=str(point.number),
        data_front=front,
        tabindex="0" if front else "-1",
        role="button",
        aria_label="; ".join(lines),
    )


def _shape(shape: str, x: float, y: float) -> Markup:
    """Return a mark about a place."""
    s = SIZE
    corners = {
        "square": ((-0.85, -0.85), (0.85, -0.85), (0.85, 0.85), (-0.85, 0.85)),
        "frame": ((-0.8, -0.8), (0.8, -0.8), (0.8, 0.8), (-0.8, 0.8)),
        "diamond": ((0.0, -1.15), (1.15, 0.0), (0.0, 1.15), (-1.15, 0.0)),
        "gem": ((0.0, -1.1), (1.1, 0.0), (0.0, 1.1), (-1.1, 0.0)),
        "left": ((-1.1, 0.0), (0.8, -1.05), (0.8, 1.05)),
        "right": ((1.1, 0.0), (-0.8, -1.05), (-0.8, 1.05)),
        "up": ((0.0, -1.1), (1.05, 0.8), (-1.05, 0.8)),
        "down": ((0.0, 1.1), (1.05, -0.8), (-1.05, -0.8)),
    }
    if shape == "cross":
        a, b = 0.85 * s, f"M{x - 0.85 * s:.1f} {y - 0.85 * s:.1f}"
        return tag("path", d=f"{b}l{2 * a:.1f} {2 * a:.1f}m0 {-2 * a:.1f}l{-2 * a:.1f} {2 * a:.1f}", class_="cross")
    if shape in corners:
        path = "L".join(f"{x + s * a:.1f} {y + s * b:.1f}" for a, b in corners[shape])
        return tag("path", d=f"M{path}Z", class_="hollow" if shape in HOLLOW else "mark")
    return tag("circle", cx=x, cy=y, r=s, class_="hollow" if shape == "ring" else "mark")
