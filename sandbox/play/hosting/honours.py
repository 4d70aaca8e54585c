"""Honours: the high scores at the end of a game, and the initials of who played it; no pygame."""

from dataclasses import dataclass

from sandbox.games.high_scores import BEST, LETTERS, Entry, HighScores, initials_of, opened, table_of
from sandbox.play.hosting.host import Host


@dataclass
class Entering:
    """A score that is among the ten best, while its initials are typed."""

    scores: HighScores
    table: str
    score: int | float
    place: int
    """from 1"""
    letters: str = ""
    kept: bool = False

    def type(self, text: str) -> None:
        """Add a letter; what is none is ignored."""
        letter = text.upper()
        if len(letter) == 1 and len(self.letters) < LETTERS and initials_of(letter) == letter:
            self.letters += letter

    def rub(self) -> None:
        """Take the last letter back."""
        self.letters = self.letters[:-1]

    def keep(self) -> None:
        """Enter the score.

        Raises:
            OSError: the file cannot be written.
            ValueError: somebody has damaged it meanwhile.
        """
        self.scores.enter(self.table, self.letters, self.score)
        self.kept = True

    def rows(self) -> tuple[Entry, ...]:
        """Return the ten best, this one among them.

        Raises:
            OSError: the file cannot be read.
            ValueError: it is damaged.
        """
        known = self.scores.of(self.table)
        if self.kept:
            return known
        ours = Entry(self.letters.ljust(LETTERS, "_"), self.score)
        return (*known[: self.place - 1], ours, *known[self.place - 1 :])[:BEST]


class Honours:
    """Asks for initials once, at the end of a game that hands have played."""

    def __init__(self) -> None:
        self.notes: list[str] = []
        """what is to be told, by whoever takes them out"""
        self._host: Host | None = None  # whose end was seen
        self.entering: Entering | None = None

    def watch(self, host: Host | None) -> bool:
        """See how a game stands; return whether it has just ended with a score that is among the best."""
        if host is None or host.rules.over is None:
            self._host, self.entering = None, None
            return False
        if host is self._host:
            return False
        self._host, self.entering = host, None
        if not host.touched:
            return False
        try:
            scores = opened()
            if scores.told is not None:
                self.notes.append(scores.told)
            table, score = table_of(host.live.scene), host.rules.score
            place = scores.rank(table, score)
        except (OSError, ValueError) as error:
            self.notes.append(f"no high scores: {error}")
            return False
        if place is not None:
            self.entering = Entering(scores, table, score, place)
        return place is not None

    def keep(self) -> None:
        """Enter the score; tell why where it cannot be."""
        if self.entering is None:
            return
        try:
            self.entering.keep()
        except (OSError, ValueError) as error:
            self.notes.append(f"no high scores: {error}")
            self.entering = None

    def leave(self) -> None:
        """Enter nothing, or close the list."""
        self.entering = None
