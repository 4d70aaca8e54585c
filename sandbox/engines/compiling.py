"""Compiling: how long it took, and who is told. Light to import: what compiles is `kernel.py`."""

import sys
from collections.abc import Callable
from functools import cache
from time import perf_counter

ANNOUNCEMENT = "compiling: up to half a minute, this once"


@cache
def say(text: str) -> None:
    """Tell whoever watches, on standard error, once."""
    if sys.stderr is not None:
        sys.stderr.write(f"{text}\n")
        sys.stderr.flush()


class Compiling:
    """Times compiling, and says once that it happens: half a minute at first, later uses find it on disk."""

    def __init__(self) -> None:
        self.seconds = 0.0
        """s, of this process, so that who times a run can leave it out"""
        self.on_begin: Callable[[str], None] | None = None
        """told of each kernel that is about to be compiled, by whoever else wants to say so"""
        self._depth, self._began = 0, 0.0

    def begin(self, module: str) -> None:
        """Note that a function of a module is being compiled; it may be on behalf of another."""
        if self._depth == 0:
            self._began = perf_counter()
        self._depth += 1
        if module.startswith("sandbox."):
            say(ANNOUNCEMENT)
            if self.on_begin is not None:
                self.on_begin(ANNOUNCEMENT)

    def end(self) -> None:
        """Note that it is done."""
        self._depth -= 1
        if self._depth == 0:
            self.seconds += perf_counter() - self._began


COMPILING = Compiling()
