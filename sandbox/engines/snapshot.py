"""State snapshot: an exact copy of the state of a running simulation."""

import copy
from typing import Generic, Protocol, TypeVar


class Copyable(Protocol):
    """Has a simulated time."""

    @property
    def time(self) -> float:
        """Simulated time, s."""


Running = TypeVar("Running", bound=Copyable)


class StateSnapshot(Generic[Running]):
    """State of a simulation at one time. It does not change, and can be continued any number of times."""

    def __init__(self, simulation: Running) -> None:
        """Copy a simulation.

        Raises:
            SnapshotError: the engine cannot copy its state.
        """
        self._copy = copy.deepcopy(simulation)
        self.time = simulation.time
        """s, simulated time"""

    def __repr__(self) -> str:
        return f"<StateSnapshot at {self.time:g} s of {self._copy!r}>"

    def resumed(self) -> Running:
        """Return a new simulation that continues from the state, without an observer."""
        return copy.deepcopy(self._copy)
