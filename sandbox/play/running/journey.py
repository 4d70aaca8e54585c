"""Journey: the way to another step of a session, gone in parts, one a picture."""

from collections.abc import Iterator
from time import perf_counter

from sandbox.play.running.session import Session

SLICE = 0.04
"""s of each picture that the way may take"""


class Journey:
    """Where a session is on its way to; nowhere, as long as it plays."""

    def __init__(self) -> None:
        self._way: Iterator[float] | None = None
        self.target = 0
        """the step that it was last on its way to"""
        self.share = 0.0
        """of the way that is done"""

    @property
    def under_way(self) -> bool:
        """Whether it has yet to arrive."""
        return self._way is not None

    def set_out(self, session: Session, step: int) -> None:
        """Begin the way to a step, whatever the way was before."""
        self.share, self.target = 0.0, step
        self._way = session.seek(step)

    def go(self) -> bool:
        """Go on for `SLICE` seconds; tell whether it has arrived."""
        until = perf_counter() + SLICE
        while self._way is not None and perf_counter() < until:
            try:
                self.share = next(self._way)
            except StopIteration:
                self._way = None
        return self._way is None
