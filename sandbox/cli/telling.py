"""Telling what is being done, while it is done."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from sandbox.measure.told import Told


@contextmanager
def telling(silent: bool) -> Iterator[Told | None]:
    """Yield who says what is being done: a line that comes and goes on a terminal, nobody elsewhere."""
    if silent or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.text import Text

    with Console(stderr=True).status("") as line:
        yield lambda what: line.update(Text(what))
