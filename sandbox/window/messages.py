"""Messages: what the window has to say, each for a few seconds."""

from time import perf_counter

MESSAGE_DURATION = {"info": 3.0, "warning": 6.0, "error": 10.0}
"""s that a message of a level is seen"""
MAX_MESSAGES = 5


class Messages:
    """The messages of the last seconds, newest last."""

    def __init__(self) -> None:
        self._messages: list[tuple[float, str, str]] = []

    def tell(self, text: str, level: str = "info") -> None:
        """Say something; the same thing said again only lasts longer."""
        until = perf_counter() + MESSAGE_DURATION[level]
        self._messages = [each for each in self._messages if each[1:] != (level, text)]
        self._messages = [*self._messages, (until, level, text)][-MAX_MESSAGES:]

    def take(self, notes: list[tuple[str, str]]) -> None:
        """Say what is noted, (level, text), and empty the list."""
        for level, text in notes:
            self.tell(text, level)
        notes.clear()

    def shown(self) -> tuple[tuple[str, str], ...]:
        """Return (level, text) of those whose time is not over."""
        now = perf_counter()
        self._messages = [each for each in self._messages if each[0] > now]
        return tuple((level, text) for _, level, text in self._messages)
