"""Turn: one thread at a time."""

import threading


class Turn:
    """Held while a simulation is being changed.

    Two threads in one pymunk space hang or crash the process; elsewhere they would mix two steps into one.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()

    def __enter__(self) -> None:
        """Take the turn.

        Raises:
            RuntimeError: it is taken.
        """
        if not self._lock.acquire(blocking=False):
            raise RuntimeError("the simulation is in the middle of a step or action, perhaps of another thread")

    def __exit__(self, *_: object) -> None:
        """Give the turn back."""
        self._lock.release()
