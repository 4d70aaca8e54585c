"""Hearing: the contacts of a stroke, as a session tells them bit by bit."""

import numpy as np

from sandbox.play.running.live import Live
from sandbox.trajectory import Contacts


class Hearing:
    """All contacts since a stroke."""

    def __init__(self, live: Live) -> None:
        self._live = live
        self._parts: list[Contacts] = []
        live.on_contacts = self._parts.append

    def since(self, began: float) -> Contacts:
        """Return the contacts since a time, s, each once: those that last, or were seen twice, are told again."""
        if not self._parts:
            return Contacts.none()
        whole = Contacts.joined(self._parts)
        _, first = np.unique(np.column_stack((whole.time, whole.pair)), axis=0, return_index=True)
        kept = np.sort(first[whole.time[first] >= began])
        return Contacts(whole.time[kept], whole.pair[kept], whole.point[kept], whole.normal[kept], whole.impulse[kept])

    def clear(self) -> None:
        """Forget all: a stroke begins."""
        self._parts.clear()

    def close(self) -> None:
        """Listen no longer."""
        self._live.on_contacts = len
