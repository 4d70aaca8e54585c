"""Sphinx extension: directives within HTML comments, which a repository page does not show.

    <!-- ::::{tab-set} -->
    **fish** <!-- :::{tab-item} -->

    …

    <!-- ::: -->
    <!-- :::: -->

A repository page shows the bold label and the text below it; the site shows tabs. A bold text before the comment
becomes the argument of the directive.
"""

import re
from typing import Any

FENCE = re.compile(r"^(?:\*\*(?P<label>[^*\n]+)\*\* )?<!-- (?P<fence>:{3,}[^\n]*?) -->$", re.MULTILINE)


def reveal(text: str) -> str:
    """Return the text of a page with its hidden directives as directives."""
    return FENCE.sub(lambda match: f"{match['fence']} {match['label'] or ''}".rstrip(), text)


def setup(app: Any) -> dict[str, bool]:
    """Register with Sphinx."""
    app.connect("source-read", _reveal_page)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _reveal_page(_: Any, __: str, source: list[str]) -> None:
    source[0] = reveal(source[0])
