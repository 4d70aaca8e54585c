"""Sample cases: one for every kind of outcome, by which the isolation is tested."""

import os
import time
import warnings
from typing import Any

from tools.fuzzing.isolated import Violation


def passes(_: Any) -> None:
    """Return nothing."""


def refuses(_: Any) -> str:
    """Return the name of an error."""
    return "ValueError"


def raises(argument: int) -> float:
    """Let an exception escape."""
    return argument / 0


def violates(_: Any) -> None:
    """Find a check violated."""
    raise Violation("sum", "1 + 1 is 3")


def warns(_: Any) -> None:
    """Warn."""
    warnings.warn("a warning is an error", stacklevel=1)


def aborts(_: Any) -> None:
    """End the process."""
    os.abort()


def loops(_: Any) -> None:
    """Use CPU time without end."""
    while True:
        pass


def waits(_: Any) -> None:
    """Use no CPU time, for long."""
    time.sleep(600.0)


def allocates(_: Any) -> int:
    """Ask for more memory than there may be."""
    return len(bytearray(2**40))
