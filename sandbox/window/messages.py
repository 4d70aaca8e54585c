"""Messages of the window, each shown for a few seconds."""

from time import perf_counter

MESSAGE_DURATION = {"info": 3.0, "warning": 6.0, "error": 10.0}
"""s that a message is shown, by its level"""
MAX_MESSAGES = 5


class Messages:
    """The messages of the last seconds, newest last."""

    def __init__(self) -> None:
        self._messages: list[tuple[float, str, str]] = []

    def add(self, text: str, level: str = "info") -> None:
        """Add a message; a repeated one is shown for longer instead."""
        until = perf_counter() + MESSAGE_DURATION[level]
        self._messages = [each for each in self._messages if each[1:] != (level, text)]
        self._messages = [*self._messages, (until, level, text)][-MAX_MESSAGES:]

    def extend(self, notes: list[tuple[str, str]]) -> None:
        """Add notes, (level, text), and clear the list."""
        for level, text in notes:
            self.add(text, level)
        notes.clear()

    def visible(self) -> tuple[tuple[str, str], ...]:
        """Return (level, text) of the messages that have not expired."""
        now = perf_counter()
        self._messages = [each for each in self._messages if each[0] > now]
        return tuple((level, text) for _, level, text in self._messages)
