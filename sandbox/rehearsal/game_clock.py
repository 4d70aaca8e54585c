"""Clock of a game: functions of `time`, as its own code calls them, read from a tape.

Calls of the standard library and of this package keep the real clock, so that timeouts and measurements are true.
"""

import sys
import sysconfig
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

from sandbox.rehearsal.tape import WALL_CLOCK, InputTape

CLOCKS = ("time", "perf_counter", "monotonic", "process_time")
NANOSECONDS = 1e9
EPOCH = 1e9
"""s, `time.time()` at the start of a virtual clock"""
_OWN_CODE = (sysconfig.get_path("stdlib"), str(Path(__file__).parents[1]), "<frozen")
PACKAGES = ("site-packages", "dist-packages")


@contextmanager
def clock_from(
    tape: InputTape, *, sleep: Callable[[float], None], now: Callable[[], float] | None = None
) -> Iterator[None]:
    """Let a program read the functions of `time` from a tape, within a `with` block.

    Args:
        tape: of the readings.
        sleep: replaces `time.sleep`.
        now: virtual clock from which a tape that records reads, s since the start; default: the real clocks.
    """
    with ExitStack() as stack:
        for name in CLOCKS:
            for unit, per_second in (("", 1.0), ("_ns", NANOSECONDS)):
                kind = f"time.{name}{unit}"
                real = getattr(time, f"{name}{unit}")
                live = real if now is None else _since(EPOCH if kind.startswith(WALL_CLOCK) else 0.0, now, per_second)
                stack.enter_context(patch.object(time, f"{name}{unit}", _read(tape, kind, real, live, per_second)))
        stack.enter_context(patch.object(time, "sleep", _unless_own(time.sleep, sleep)))
        yield


def _since(start: float, now: Callable[[], float], per_second: float) -> Callable[[], float]:
    return lambda: per_second * (start + now())


def _read(
    tape: InputTape, kind: str, real: Callable[[], Any], live: Callable[[], Any], per_second: float
) -> Callable[[], Any]:
    convert = int if per_second == NANOSECONDS else float
    return _unless_own(real, lambda: convert(tape.time(kind, live, per_second)))


def _unless_own(real: Callable[..., Any], replaced: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that calls the real one for the standard library and this package, and else another one."""

    def function(*arguments: Any) -> Any:
        caller = sys._getframe(1).f_code.co_filename
        return real(*arguments) if is_own_code(caller) else replaced(*arguments)

    return function


@cache
def is_own_code(file: str) -> bool:
    """Return whether a file belongs to the standard library or to this package."""
    return file.startswith(_OWN_CODE[1:]) or (
        file.startswith(_OWN_CODE[0]) and not any(name in file for name in PACKAGES)
    )
