"""Bars of what an error consists of: model, time step, solver, and what is error at the finest step that was tried."""

from collections.abc import Sequence

from sandbox.report.page.markup import Markup, joined, tag
from sandbox.report.page.tables import Column, table
from sandbox.report.page.verdicts import engine_name
from sandbox.report.page.wording import number
from sandbox.report.work_points import Document

PARTS = (("model", "model"), ("time_step", "time step"), ("solver", "solver"), ("left", "error at the finest step"))
WIDTH, HEIGHT = 320.0, 14.0


def split_bars(rows: Sequence[Document]) -> Markup:
    """Return a bar an engine, as long for a small error as for a large one: the shares are what it shows.

    Args:
        rows: each with `engine`, `total`, `model`, `time_step`, `solver` and `left`, in m; unknown parts are None.
            What is error at the finest step is the model's where that is known.
    """
    columns = [Column("engine"), Column("shares"), Column("error, m", True)]
    columns += [Column(f"{words}, m", True) for _, words in PARTS]
    cells = [
        [engine_name(row["engine"]), _bar(row), number(row["total"]), *(number(row.get(key)) for key, _ in PARTS)]
        for row in rows
    ]
    keys = [tag("li", tag("span", class_=f"swatch square {key}", aria_hidden="true"), words) for key, words in PARTS]
    return joined(table(columns, cells, "Sources of error"), tag("ul", *keys, class_="keys"))


def _bar(row: Document) -> Markup:
    parts = {key: max(float(row.get(key) or 0.0), 0.0) for key, _ in PARTS}
    if row.get("model") is not None:
        parts["left"] = 0.0
    whole = sum(parts.values())
    x, bars, told = 0.0, [], []
    for key, words in PARTS:
        wide = WIDTH * parts[key] / whole if whole > 0.0 else 0.0
        if wide > 0.0:
            bars.append(tag("rect", x=x, y=0.0, width=wide, height=HEIGHT, class_=f"bar {key}"))
        told.append(f"{words} {100.0 * wide / WIDTH:.0f} %")
        x += wide
    size = {"width": WIDTH, "height": HEIGHT}
    label = ", ".join(told)
    return tag(
        "svg", tag("title", label), *bars, viewBox=f"0 0 {WIDTH:g} {HEIGHT:g}", role="img", aria_label=label, **size
    )
