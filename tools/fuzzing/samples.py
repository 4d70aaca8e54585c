"""Sample cases, one for every kind of outcome, for the tests of the isolation."""

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
    """Raise an unexpected exception."""
    return argument / 0


def violates(_: Any) -> None:
    """Raise a violation of a check."""
    raise Violation("sum", "1 + 1 is 3")


def warns(_: Any) -> None:
    """Issue a warning."""
    warnings.warn("a warning is an error", stacklevel=1)


def aborts(_: Any) -> None:
    """End the process."""
    os.abort()


def loops(_: Any) -> None:
    """Use CPU time without end."""
    while True:
        pass


def waits(_: Any) -> None:
    """Sleep for a long time."""
    time.sleep(600.0)


def allocates(_: Any) -> int:
    """Allocate more memory than the limit."""
    return len(bytearray(2**40))
