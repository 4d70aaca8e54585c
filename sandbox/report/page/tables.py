"""Tables of a page."""

from collections.abc import Sequence
from typing import NamedTuple

from sandbox.report.page.markup import Child, Markup, joined, tag


class Column(NamedTuple):
    """A column of a table."""

    head: str
    numeric: bool = False
    """Its cells are flush right, and their figures equally wide."""
    about: str | None = None
    """what it holds, shown where one points at its head"""


def table(columns: Sequence[Column], rows: Sequence[Sequence[Child]], caption: str, wide: bool = False) -> Markup:
    """Return a table whose first column names its rows, an empty one those below the last name.

    Where it is wider than the page, it scrolls by itself.

    Args:
        columns: its columns.
        rows: a cell for each column.
        caption: what it is, for those who hear it.
        wide: it takes the whole width.

    Raises:
        ValueError: a row has more or fewer cells than there are columns.
    """
    head = [
        tag("th", each.head, scope="col", class_="figure" if each.numeric else None, title=each.about)
        for each in columns
    ]
    body = []
    for row in rows:
        cells = [
            tag("td" if k else "th", cell, scope=None if k else "row", class_="figure" if column.numeric else None)
            for k, (column, cell) in enumerate(zip(columns, row, strict=True))
        ]
        body.append(tag("tr", *cells, class_=None if row[0] else "more"))
    whole = tag(
        "table",
        tag("caption", caption, class_="unseen"),
        tag("thead", tag("tr", *head)),
        tag("tbody", joined(*body)),
        class_="wide" if wide else None,
    )
    return tag("div", whole, class_="table", tabindex="0", role="region", aria_label=caption)


def column_key(*tables: Sequence[Column]) -> Markup:
    """Return what the columns of some tables hold, each once, those that say so."""
    found = {column.head: column.about for columns in tables for column in columns if column.about}
    return tag("dl", *(joined(tag("dt", head), tag("dd", about)) for head, about in found.items()))


def pairs(rows: Sequence[tuple[str, Child]]) -> Markup:
    """Return names and what they stand for, as a list in two columns."""
    return tag("dl", *(joined(tag("dt", name), tag("dd", value)) for name, value in rows))
