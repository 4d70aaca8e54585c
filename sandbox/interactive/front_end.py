"""Front end of live scenes: one ES module and one style sheet, with the renderer and the palette of the pages."""

from functools import cache
from html import escape
from importlib.resources import files
from string import Template

from sandbox.report.html.static_files import hash_source, static_text

SHARED_SCRIPTS = ("format.js", "renderer.js")
"""Scripts of the pages that the module begins with."""
SCRIPTS = ("energy_chart.js", "controls.js", "live.js", "widget.js")


@cache
def _text(name: str) -> str:
    return files("sandbox.interactive").joinpath("static", name).read_text(encoding="utf-8")


@cache
def module() -> str:
    """Return the ES module. Its default export is that of a widget of anywidget; it also exports `mount`."""
    return "\n".join([*map(static_text, SHARED_SCRIPTS), *map(_text, SCRIPTS)])


@cache
def style() -> str:
    """Return the style sheet. Everything is below the class `sandbox-live`, so that it changes nothing beside it."""
    return "\n".join([static_text("palette.css").replace(":root", ".sandbox-live"), _text("live.css")])


def page(title: str, about: str) -> str:
    """Return the page of a server: it opens a web socket to the server that it comes from.

    Its content security policy lets it run only the inline module and connect to nothing but that server.

    Args:
        title: of the scene.
        about: description of the scene; may be empty.
    """
    script = "\n".join([module(), _text("socket.js")])
    sheet = "\n".join([static_text("palette.css"), style(), _text("page.css")])
    policy = (
        f"default-src 'none'; img-src data:; connect-src 'self'; style-src {hash_source(sheet)};"
        f" script-src {hash_source(script)}; base-uri 'none'; form-action 'none'"
    )
    return Template(_text("page.html")).substitute(
        policy=policy, title=escape(title), about=escape(about), style=sheet, script=script
    )
