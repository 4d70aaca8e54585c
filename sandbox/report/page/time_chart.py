"""Charts against time: a line an engine, with a cursor that goes with the replay."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.report.page.axes import Axes
from sandbox.report.page.markup import Markup, tag
from sandbox.report.page.scales import Linear, Log
from sandbox.report.page.wording import number, power_of

FLOOR = 1e-16
"""The lowest that a logarithmic axis reaches; what is smaller, such as 0, lies on its low end."""
BEYOND = 1e150
"""What is larger cannot be drawn."""
STRETCHES = 300
"""Of each the lowest and the highest point is kept."""
ROOM = 2.0
"""How far a linear axis follows engines that run away, in spans of what is right."""
TRUTH = "truth"


@dataclass(frozen=True, eq=False)
class Curve:
    """Values of one engine, or of the truth, at K times."""

    name: str
    look: str
    """its class: `e0`, `e1`, … for engines, `truth`"""
    time: FloatArray
    values: FloatArray


def error_chart(
    curves: Sequence[Curve], label: str, duration: float, trusted_until: float | None, tolerance: float, name: str
) -> Markup:
    """Return errors ≥ 0 on a logarithmic axis with the tolerance, grey where the truth is not trusted.

    Args:
        curves: one an engine.
        label: what is drawn, with its unit.
        duration: of the scene, s.
        trusted_until: s; None without a truth.
        tolerance: in the unit of the curves.
        name: of the chart, the only one of that name on the page.
    """
    positive = [each.values[(each.values > 0.0) & (each.values < BEYOND)] for each in curves]
    least = min((float(values.min()) for values in positive if len(values)), default=tolerance)
    most = max((float(values.max()) for values in positive if len(values)), default=tolerance)
    scale = Log.around(max(FLOOR, min(least, tolerance)), max(most, tolerance, 10.0 * FLOOR), room=0.2)
    axes = Axes(Linear(0.0, duration), scale)
    y = axes.up(tolerance)
    limit = tag("line", x1=axes.left, x2=axes.width - axes.right, y1=y, y2=y, class_="tolerance")
    words = tag("text", f"tolerance {number(tolerance, 2)} m", x=axes.left + 5.0, y=y - 5.0, class_="note")
    return _chart(axes, curves, label, duration, trusted_until, name, limit, words)


def energy_chart(
    curves: Sequence[Curve],
    label: str,
    duration: float,
    trusted_until: float | None,
    name: str,
    whole: bool = False,
) -> Markup:
    """Return energies, J, on a linear axis that holds what is right, and engines that are not far from it.

    Args:
        curves: one an engine, and the truth's.
        label: what is drawn; its unit is added.
        duration: of the scene, s.
        trusted_until: s; None without a truth.
        name: of the chart, the only one of that name on the page.
        whole: hold all values, as of a single run, even far from what is right.
    """
    low, high = _range(curves, math.inf if whole else ROOM)
    size = max(abs(low), abs(high))
    power = 0 if size == 0.0 or 1e-3 <= size < 1e5 else 3 * math.floor(math.log10(size) / 3.0)
    scaled = [Curve(each.name, each.look, each.time, each.values / 10.0**power) for each in curves]
    axes = Axes(Linear(0.0, duration), Linear.around(low / 10.0**power, high / 10.0**power), left=64.0)
    unit = f"10{power_of(power)} J" if power else "J"
    return _chart(axes, scaled, f"{label}, {unit}", duration, trusted_until, name)


def sparkline(curves: Sequence[Curve], duration: float, tolerance: float, label: str) -> Markup:
    """Return errors as small lines without axes: how they grow, against the tolerance.

    Args:
        curves: one an engine.
        duration: s.
        tolerance: in the unit of the curves; its line is dotted.
        label: what it shows, for those who hear it.
    """
    positive = [each.values[(each.values > 0.0) & (each.values < BEYOND)] for each in curves]
    least = min((float(values.min()) for values in positive if len(values)), default=tolerance)
    most = max((float(values.max()) for values in positive if len(values)), default=tolerance)
    scale = Log.around(max(FLOOR, min(least, tolerance)), max(most, tolerance), room=0.0)
    axes = Axes(Linear(0.0, duration), scale, width=150.0, height=23.0, left=1.0, right=1.0, top=2.0, bottom=2.0)
    y = axes.up(tolerance)
    lines = [tag("line", x1=1.0, x2=149.0, y1=y, y2=y, class_="tolerance")]
    lines += [_line(axes, each, 40) for each in curves]
    return tag("svg", *lines, viewBox="0 0 150 23", class_="spark", role="img", aria_label=label)


def _chart(
    axes: Axes,
    curves: Sequence[Curve],
    label: str,
    duration: float,
    trusted_until: float | None,
    name: str,
    limit: Markup | None = None,
    words: Markup | None = None,
) -> Markup:
    base = axes.height - axes.bottom
    parts = [axes.frame("time, s", label)]
    lines = [_line(axes, each, STRETCHES) for each in curves]
    if limit is not None:
        lines.insert(0, limit)
    if trusted_until is not None and trusted_until < duration:
        x = axes.across(trusted_until)
        wide = {"width": axes.width - axes.right - x, "height": axes.inner_height}
        lines.append(tag("rect", x=x, y=axes.top, class_="distrusted", **wide))
    parts.append(axes.clip(name, *lines))
    if trusted_until is not None and trusted_until < duration:
        x = axes.across(trusted_until)
        late = x > axes.left + 0.6 * axes.inner_width
        text, look = ("trusted until here", "note end") if late else ("truth no longer trusted", "note")
        parts.append(tag("text", text, x=x - 5.0 if late else x + 5.0, y=base - 7.0, class_=look))
        parts.append(tag("line", x1=x, x2=x, y1=axes.top, y2=base, class_="limit"))
    if words is not None:
        parts.append(words)
    cursor = tag("line", x1=axes.left, x2=axes.left, y1=axes.top, y2=base, class_="cursor")
    return tag(
        "svg",
        *parts,
        cursor,
        viewBox=f"0 0 {axes.width:g} {axes.height:g}",
        class_="chart time",
        role="img",
        aria_label=f"{label} against time, of {', '.join(each.name for each in curves) or 'nothing'}",
        data_left=axes.left,
        data_right=axes.width - axes.right,
        data_width=axes.width,
        data_duration=repr(duration),
    )


def _line(axes: Axes, curve: Curve, stretches: int) -> Markup:
    """Return a curve as a path that breaks where there is no value."""
    time, values = _thinned(curve.time, curve.values, stretches)
    words, drawing = [], False
    for t, value in zip(time.tolist(), values.tolist(), strict=True):
        if math.isnan(value):
            drawing = False
            continue
        words.append(f"{'L' if drawing else 'M'}{axes.across(t):.1f} {min(max(axes.up(value), -1e4), 1e4):.1f}")
        drawing = True
    return tag("path", d="".join(words), class_=f"line {curve.look}")


def _thinned(time: FloatArray, values: FloatArray, stretches: int) -> tuple[FloatArray, FloatArray]:
    """Keep of a long curve the lowest and the highest point of each stretch; what cannot be drawn is nan."""
    values = np.where(np.abs(values) < BEYOND, values, np.nan)
    if len(time) <= 2 * stretches:
        return time, values
    kept = {0, len(time) - 1}
    for part in np.array_split(np.arange(len(time)), stretches):
        finite = part[np.isfinite(values[part])]
        some = finite if len(finite) else part
        kept |= {int(some[values[some].argmin()]), int(some[values[some].argmax()])} if len(finite) else {int(part[0])}
    places = np.asarray(sorted(kept))
    return time[places], values[places]


def _range(curves: Sequence[Curve], room: float = ROOM) -> tuple[float, float]:
    """Return the lowest and highest energy to show: the truth's, and others' where they are not out of all reach."""
    finite = {each.name: each.values[np.abs(each.values) < BEYOND] for each in curves}
    known = {name: values for name, values in finite.items() if len(values)}
    if not known:
        return 0.0, 1.0
    right = known.get(TRUTH)
    if right is None:
        right = np.asarray([values[0] for values in known.values()])
    low, high = float(right.min()), float(right.max())
    reach = room * max(high - low, 0.1 * max(abs(low), abs(high)), 1e-300)
    if low == high == 0.0:
        reach = math.inf
    lows = [max(float(values.min()), low - reach) for values in known.values()]
    highs = [min(float(values.max()), high + reach) for values in known.values()]
    return min(low, *lows), max(high, *highs)
