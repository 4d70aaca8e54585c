"""Progress of a long computation, and the callback that receives it."""

from collections.abc import Callable
from typing import NamedTuple


class Progress(NamedTuple):
    """State of a computation at one time."""

    message: str = ""
    """the present stage; empty if there is only one"""
    fraction: float | None = None
    """completed fraction, 0 to 1; None if it is unknown"""


ProgressCallback = Callable[[Progress], None]
"""Progress callback: called from time to time with the state of the computation."""


def ignore_progress(_: Progress) -> None:
    """Ignore the progress: the default of a progress callback."""
