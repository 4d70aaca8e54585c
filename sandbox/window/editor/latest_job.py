"""Background computation of which only the latest input matters, such as a check of the scene that is edited."""

import math
import threading
from collections.abc import Callable
from time import monotonic
from typing import Generic, TypeVar

InputT = TypeVar("InputT")
ResultT = TypeVar("ResultT")


class LatestJob(Generic[InputT, ResultT]):
    """Computes the result of the latest input in a thread; inputs that are replaced before it begins are skipped.

    Args:
        compute: called in the thread; must not raise.
        name: of the thread.
        delay: s without another input after which the computation begins, unless `submit` has another.
    """

    def __init__(self, compute: Callable[[InputT], ResultT], name: str, delay: float = 0.0) -> None:
        self._compute, self._name, self._delay = compute, name, delay
        self._condition = threading.Condition()
        self._thread: threading.Thread | None = None
        self._input: InputT | None = None
        self._due_at = -math.inf
        self._computed: InputT | None = None
        self._result: ResultT | None = None
        self._is_closed = False

    def submit(self, given: InputT, delay: float | None = None) -> None:
        """Have a result computed, unless this object was submitted last. Cheap: for every frame."""
        if given is self._input or self._is_closed:
            return
        with self._condition:
            self._input = given
            self._due_at = monotonic() + (self._delay if delay is None else delay)
            self._condition.notify()
        if self._thread is None:
            # A daemon, so that a second Ctrl+C ends the process without waiting for it.
            self._thread = threading.Thread(target=self._work, name=self._name, daemon=True)
            self._thread.start()

    def forget(self) -> None:
        """Drop the input and the result, also one that is being computed."""
        with self._condition:
            self._input = self._computed = self._result = None

    @property
    def result(self) -> ResultT | None:
        """Latest result, also of a former input (`is_current`); None before the first."""
        return self._result

    @property
    def is_current(self) -> bool:
        """Whether the result is that of the input that was submitted last."""
        return self._computed is not None and self._computed is self._input

    def close(self) -> None:
        """End the thread after the computation that is running; the result stays."""
        with self._condition:
            self._is_closed = True
            self._condition.notify()

    def _work(self) -> None:
        while (given := self._next_input()) is not None:
            result = self._compute(given)
            with self._condition:
                if self._input is not None:
                    self._computed, self._result = given, result

    def _next_input(self) -> InputT | None:
        """Wait for an input that has not changed for the delay, and return it; None after `close`."""
        with self._condition:
            while not self._is_closed:
                if self._input is self._computed:
                    self._condition.wait()
                    continue
                remaining = self._due_at - monotonic()
                if remaining <= 0.0:
                    return self._input
                self._condition.wait(remaining)
        return None
