"""HTML pages from Jinja2 templates: page shell with its content security policy, sections, tables.

Templates escape every text that is not `Markup`. Style and scripts are files in `static/`, copied into the page. The
content security policy names them by their hashes: no other script runs, no other style applies, nothing is fetched.
"""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any, Literal, NamedTuple

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from sandbox.atomic_write import atomic_write
from sandbox.columns import Column, Kind, R
from sandbox.formatting import format_change, format_count, format_number, format_plural
from sandbox.report.colours import css_class_of
from sandbox.report.html.static_files import hash_source, static_text

STYLES = ("palette.css", "page.css")
SCRIPTS = ("charts.js", "format.js", "points.js", "renderer.js", "replay.js")
"""In the order in which they run."""
_CONTROL_CHARACTERS = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ufffe\uffff]")

Content = str | Markup | None
"""Text, which a template escapes, or markup, which it does not."""
Shade = Literal["good", "fair", "bad", "none"]
"""Class of a badge."""


def fragment(template: str, macro: str, *arguments: Any, **named: Any) -> Markup:
    """Return the result of a macro of a template."""
    return Markup(getattr(_environment().get_template(template).module, macro)(*arguments, **named))


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("sandbox.report.html"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    # JSON in a page must be read by JavaScript, which knows no NaN; `tojson` also escapes < > & and '.
    environment.policies["json.dumps_kwargs"] = {"allow_nan": False, "separators": (",", ":")}
    formats = {"number": format_number, "change": format_change, "count": format_count, "plural": format_plural}
    environment.filters.update(formats)
    return environment


class HtmlColumn(NamedTuple):
    """A column of a table."""

    head: str
    numeric: bool = False
    """Cells are flush right, with digits of equal width."""
    about: str | None = None
    """Explanation, shown when the pointer is over the head."""


def table(columns: Sequence[HtmlColumn], rows: Sequence[Sequence[Content]], caption: str, wide: bool = False) -> Markup:
    """Return a table, which scrolls if it is wider than the page.

    Args:
        columns: columns of the table; the first one names the rows. An empty cell in it continues the row above.
        rows: a cell for each column.
        caption: description for screen readers.
        wide: take the whole width of the page.

    Raises:
        ValueError: a row has more or fewer cells than there are columns.
    """
    cells = [list(zip(columns, row, strict=True)) for row in rows]
    return fragment("parts.html.j2", "table", columns, cells, caption, wide)


CellColumns = Sequence[tuple[HtmlColumn, Callable[[R], Content]]]
"""Columns of a table with a row for each R: the head, and the function that returns the cell of a row."""


def row_table(columns: CellColumns[R], rows: Iterable[R], caption: str) -> Markup:
    """Return a table with a row for each of some values; caption as for `table`."""
    cells = [[cell(row) for _, cell in columns] for row in rows]
    return table([head for head, _ in columns], cells, caption)


def html_columns(columns: Iterable[Column[R]]) -> list[HtmlColumn]:
    """Return the heads of columns of values."""
    return [HtmlColumn(column.head, True, column.about) for column in columns]


def value_cells(columns: Iterable[Column[R]], row: R) -> list[Content]:
    """Return the values of a row in some columns."""
    return [_value_cell(column.value(row), column.kind) for column in columns]


def _value_cell(value: float | str | None, kind: Kind) -> str:
    if isinstance(value, str):
        return value
    if kind == "change":
        return format_change(value)
    if kind == "count":
        return format_count(None if value is None else int(value))
    return format_number(value, 4 if kind == "time" else 3)


def column_key(*tables: Sequence[HtmlColumn]) -> Markup:
    """Return the explanations of the columns of some tables, each once."""
    return definitions({column.head: column.about for columns in tables for column in columns if column.about})


def definitions(rows: Mapping[str, Content]) -> Markup:
    """Return terms and their values as a list in two columns."""
    return fragment("parts.html.j2", "definitions", rows)


def isolated(text: str) -> Markup:
    """Return a text of the user, isolated: right-to-left text does not change the order of the surrounding texts."""
    return Markup("<bdi>{}</bdi>").format(text)


def paragraph(text: Content, css_class: str = "soft") -> Markup:
    """Return a paragraph."""
    return Markup('<p class="{}">{}</p>').format(css_class, text)


def remark_paragraphs(remarks: Sequence[str]) -> Markup:
    """Return the remarks on a recording, a paragraph each."""
    return concatenated(*(paragraph(isolated(f"Recording: {each}")) for each in remarks))


def concatenated(*parts: Content) -> Markup:
    """Return texts and markup, one after the other; None is left out."""
    return Markup("").join(part for part in parts if part is not None)


def badge(word: str, shade: Shade, about: str | None = None) -> Markup:
    """Return a word on a coloured background.

    Args:
        word: word to show.
        shade: class of the colours.
        about: explanation, shown when the pointer is over it.
    """
    return fragment("parts.html.j2", "badge", word, shade, about)


def engine_name(engine: str, css_class: str | None = None) -> Markup:
    """Return the name of an engine, or of a row, beside its colour.

    Args:
        engine: the name.
        css_class: class that has the colour; by default that of the engine.
    """
    return fragment("parts.html.j2", "engine_name", engine, css_class_of(engine) if css_class is None else css_class)


@dataclass(frozen=True)
class Section:
    """A part of a page with a heading."""

    title: str
    body: Markup
    anchor: str | None = None
    """identifier for links"""
    lead: Content = None
    """a sentence below the heading"""
    level: int = 2

    def markup(self) -> Markup:
        """Return it as HTML."""
        return fragment("parts.html.j2", "section", self)


@dataclass(frozen=True)
class Page:
    """A whole page."""

    title: str
    kind: str
    """kind of page, above the title"""
    sections: Sequence[Section]
    lead: Content = None
    """summary in a sentence or two"""
    versions: Mapping[str, str] = field(default_factory=dict)
    machine: Mapping[str, str | int] = field(default_factory=dict)

    def html(self, compact: bool = False) -> str:
        """Return the page as one HTML document.

        Control characters, which HTML cannot hold, and lone surrogates become a replacement character.

        Args:
            compact: with small margins and headings, for a frame within another page; the script reports the height to
            that page.
        """
        style, script = ("\n".join(map(static_text, names)) for names in (STYLES, SCRIPTS))
        if compact:
            style = f"{style}\n{static_text('compact.css')}"
            script = f"{script}\n{static_text('frame_height.js')}"
        policy = f"default-src 'none'; img-src data:; style-src {hash_source(style)}; script-src {hash_source(script)}"
        text = (
            _environment()
            .get_template("page.html.j2")
            .render(
                page=self,
                provenance=_provenance(self.machine, self.versions),
                policy=Markup(policy),
                style=Markup(style),
                script=Markup(script),
            )
        )
        return _CONTROL_CHARACTERS.sub("\N{REPLACEMENT CHARACTER}", text.encode("utf-8", "replace").decode("utf-8"))


def write_page(page: Page, path: str | Path) -> Path:
    """Write a page, to a temporary name first, and return its path.

    Raises:
        OSError: the file cannot be written.
    """
    path = Path(path)
    text = page.html()
    with atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")
    return path


def _provenance(machine: Mapping[str, str | int], versions: Mapping[str, str]) -> list[Markup]:
    """Return the machine with the date, and the versions, as two lists; empty if neither is known."""
    if not versions and not machine:
        return []
    facts = {**{key: str(value) for key, value in machine.items()}, "date": f"{datetime.now(UTC):%Y-%m-%d}"}
    return [definitions(facts), definitions(versions)]
