"""Sphinx extension: blocks of a page that are generated from the code while the documentation is built.

    ```{generated} scene ball grid
    ```

stands for the Markdown that the generator `scene` returns for the arguments `ball` and `grid`. It replaces the block
before the page is parsed, so that headings, anchors and the table of contents come out as in a hand-written page. Where
the page is read without the site, such as in a repository, an HTML comment in place of the block stays invisible:

    <!-- generated: replay bounce --sweep solver.dt=0.001,0.01 -->
"""

import re
from pathlib import Path
from typing import Any

from code_tables import GENERATORS

BLOCK = re.compile(
    r"^(?:```\{generated\}[ ]*(?P<words>[^\n]*)\n```|<!-- generated: (?P<hidden>[^\n]*) -->)$", re.MULTILINE
)


def generate(words: str) -> str:
    """Return the Markdown that a block stands for.

    Args:
        words: name of the generator, and its arguments.

    Raises:
        ValueError: there is no such generator.
    """
    name, *arguments = words.split() or [""]
    if name not in GENERATORS:
        raise ValueError(f"no generator {name!r}; generators: {', '.join(GENERATORS)}")
    return GENERATORS[name](*arguments)


def expand(text: str) -> str:
    """Return the text of a page with all blocks replaced."""
    return BLOCK.sub(lambda block: generate(block["words"] or block["hidden"] or ""), text)


def setup(app: Any) -> dict[str, bool]:
    """Register with Sphinx."""
    app.connect("source-read", _expand_page)
    app.connect("env-get-outdated", lambda _app, env, *_: [page for page in env.found_docs if _is_generated(env, page)])
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _expand_page(_: Any, __: str, source: list[str]) -> None:
    source[0] = expand(source[0])


def _is_generated(env: Any, page: str) -> bool:
    """Return whether a page has such blocks: those pages are read at every build, as the code may have changed."""
    path = Path(env.doc2path(page))
    return path.suffix == ".md" and BLOCK.search(path.read_text(encoding="utf-8")) is not None
