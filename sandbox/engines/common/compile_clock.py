"""Time spent compiling kernels, and the notice about it.

This module imports no numba, so that commands without kernels start fast.
"""

import sys
from collections.abc import Callable
from functools import cache
from time import perf_counter

ANNOUNCEMENT = (
    "compiling some functions for the first time, which can take a minute; `sandbox warm` compiles all in advance, in "
    "about 3 minutes"
)
"""2 min 41 s on two cores with other load, 94 s of computing"""


@cache
def say(text: str) -> None:
    """Print a notice on standard error, each text once per process."""
    if sys.stderr is not None:
        sys.stderr.write(f"{text}\n")
        sys.stderr.flush()


class CompileClock:
    """Measures compile time and announces it once per process. Later processes load compiled kernels from disk."""

    def __init__(self) -> None:
        self.seconds = 0.0
        """s, in this process; timings of runs exclude it"""
        self.on_begin: Callable[[str], None] | None = None
        """callback that receives the notice before each kernel is compiled"""
        self.announces = True
        """whether the notice is printed"""
        self._depth, self._began = 0, 0.0

    def begin(self, module: str) -> None:
        """Record that compiling of a function of a module begins.

        Calls may nest: a kernel's callees are compiled within it.
        """
        if self._depth == 0:
            self._began = perf_counter()
        self._depth += 1
        if module.startswith("sandbox."):
            if self.announces:
                say(ANNOUNCEMENT)
            if self.on_begin is not None:
                self.on_begin(ANNOUNCEMENT)

    def end(self) -> None:
        """Record that compiling of a function has ended."""
        self._depth -= 1
        if self._depth == 0:
            self.seconds += perf_counter() - self._began


COMPILE_CLOCK = CompileClock()


def clock_without_compilation() -> float:
    """Return the time of a clock that stops while code is compiled, s; only differences are meaningful."""
    return perf_counter() - COMPILE_CLOCK.seconds
