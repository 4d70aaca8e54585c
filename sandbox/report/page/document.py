"""Document: a page as one HTML file that asks no network for anything.

Its style and scripts are files of their own beside this one, put into it. A content security policy names them by their
hashes: nothing else in the page is ever run, and nothing is ever fetched.
"""

import base64
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import cache
from importlib.resources import files
from pathlib import Path
from string import Template

from sandbox.report.page.markup import Child, Markup, escaped, joined, tag
from sandbox.report.page.tables import pairs
from sandbox.whole import whole

SCRIPTS = ("linking.js", "camera.js", "drawing.js", "replay.js", "points.js")
"""In the order in which they run."""


@dataclass(frozen=True)
class Section:
    """A part of a page with a heading."""

    title: str
    body: Markup
    anchor: str | None = None
    """what links lead to"""
    lead: Child = None
    """a sentence below the heading"""
    level: int = 2

    def markup(self) -> Markup:
        """Return it as HTML."""
        heading = tag(f"h{self.level}", tag("bdi", self.title))
        lead = None if self.lead is None else tag("p", self.lead, class_="lead")
        return tag("section", heading, lead, self.body, id=self.anchor)


@dataclass(frozen=True)
class Page:
    """A whole page."""

    title: str
    kind: str
    """what it is, above the title"""
    sections: Sequence[Section]
    lead: Child = None
    """what the page says, in a sentence or two"""
    versions: Mapping[str, str] = field(default_factory=dict)
    machine: Mapping[str, str | int] = field(default_factory=dict)

    def html(self, compact: bool = False) -> str:
        """Return the page as one HTML document.

        Args:
            compact: with small margins and headings, for a frame within another page, to which it reports its height.
        """
        style, script = _resource("page.css"), "\n".join(map(_resource, SCRIPTS))
        if compact:
            style = f"{style}\n{_resource('compact.css')}"
            script = f"{script}\n{_resource('height.js')}"
        head = tag(
            "header",
            tag("p", self.kind, class_="kind"),
            tag("h1", tag("bdi", self.title)),
            None if self.lead is None else tag("div", self.lead, class_="about"),
        )
        body = joined(
            head, tag("main", *(section.markup() for section in self.sections)), _colophon(self.versions, self.machine)
        )
        return Template(_resource("page.html")).substitute(
            policy=f"default-src 'none'; img-src data:; style-src {_source(style)}; script-src {_source(script)}",
            title=escaped(f"{self.title} · {self.kind}"),
            style=style,
            body=body,
            script=script,
        )


def write_page(page: Page, path: str | Path) -> Path:
    """Write a page, to a temporary name first, and return its path.

    Raises:
        OSError: the file cannot be written.
    """
    path = Path(path)
    text = page.html()
    with whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")
    return path


def _colophon(versions: Mapping[str, str], machine: Mapping[str, str | int]) -> Markup | None:
    """Return what all was measured with."""
    if not versions and not machine:
        return None
    told = [(key, str(value)) for key, value in machine.items()]
    made = [(name, version) for name, version in versions.items()]
    return tag(
        "footer",
        tag("h2", "Measured with"),
        tag("div", pairs([*told, ("date", f"{datetime.now(UTC):%Y-%m-%d}")]), pairs(made), class_="colophon"),
        tag("p", "Times hold for this machine and vary between runs; errors do not."),
    )


@cache
def _resource(name: str) -> str:
    return files("sandbox.report.page").joinpath(name).read_text(encoding="utf-8")


def _source(text: str) -> str:
    """Return how a content security policy names what may stand in the page."""
    digest = hashlib.sha256(f"\n{text}\n".encode()).digest()
    return f"'sha256-{base64.b64encode(digest).decode('ascii')}'"
