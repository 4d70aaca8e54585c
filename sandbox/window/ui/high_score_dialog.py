"""Honours panel: the ten best of a table, and the keys that enter one's initials.

Honours: the high scores at the end of a game, and the initials of who played it; no pygame.
"""

from dataclasses import dataclass

import pygame

from sandbox.games.high_scores import BEST, LETTERS, Entry, HighScores, initials_of, opened, table_of
from sandbox.window.game_host import GameHost
from sandbox.window.render.palette import FAINT, GREEN, INK
from sandbox.window.render.text import draw_box, draw_text, text_size


@dataclass
class HighScoreEntry:
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


class HighScoreDialog:
    """Asks for initials once, at the end of a game that hands have played."""

    def __init__(self) -> None:
        self.notes: list[str] = []
        """what is to be told, by whoever takes them out"""
        self._host: GameHost | None = None  # whose end was seen
        self.entering: HighScoreEntry | None = None

    def watch(self, host: GameHost | None) -> bool:
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
            self.entering = HighScoreEntry(scores, table, score, place)
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


TEXT_SIZE = 15.0
"""px at unit 1"""

DEAF = 0.8
"""s, at first: whoever has just lost a ball still plays"""

ENTER = (pygame.K_RETURN, pygame.K_KP_ENTER)


class HighScoreView:
    """Shows honours while there are some, and takes all keys that write."""

    def __init__(self) -> None:
        self.honours = HighScoreDialog()
        self._since = 0

    def watch(self, host: GameHost | None) -> list[str]:
        """See how a game stands, and open once it has ended well; return what is to be told."""
        if self.honours.watch(host):
            self._since = pygame.time.get_ticks()
        notes, self.honours.notes = self.honours.notes, []
        return notes

    def handle(self, event: pygame.event.Event) -> bool:
        """Let it take a key; return whether it was used up."""
        entering = self.honours.entering
        if entering is None or event.type != pygame.KEYDOWN or event.mod & (pygame.KMOD_CTRL | pygame.KMOD_ALT):
            return False
        if entering.kept:
            if event.key not in (*ENTER, pygame.K_ESCAPE):
                return False
            self.honours.leave()
            return True
        if pygame.time.get_ticks() - self._since < 1000 * DEAF:
            return True
        if event.key in ENTER:
            if entering.letters:  # Enter may be a key of the game, which hands still press
                self.honours.keep()
        elif event.key == pygame.K_ESCAPE:
            self.honours.leave()
        elif event.key == pygame.K_BACKSPACE:
            entering.rub()
        elif event.unicode and event.unicode.isprintable():
            entering.type(event.unicode)
        else:
            return False
        return True

    def draw(self, surface: pygame.Surface, free: pygame.Rect, unit: float) -> None:
        """Draw it in the middle of what is free, px; a list that can no longer be read closes."""
        entering = self.honours.entering
        if entering is None:
            return
        try:
            rows = entering.rows()
        except (OSError, ValueError):
            self.honours.leave()
            return
        size = TEXT_SIZE * min(unit, free.width / 420.0, free.height / 420.0)
        title = "High scores" if entering.kept else f"Place {entering.place}: type your initials"
        foot = "Enter or Esc: close" if entering.kept else "Enter: save · Esc: discard"
        texts = [
            f"{k:>2}  {each.initials.ljust(3)}  {each.score:>15,}".replace(",", " ") for k, each in enumerate(rows, 1)
        ]
        wide = max(text_size(text, 1.2 * size, mono=True)[0] for text in texts)
        wide = max(wide, text_size(title, size, bold=True)[0], text_size(foot, 0.85 * size)[0])
        rect = pygame.Rect(0, 0, round(wide + 3 * size), round((1.9 * len(rows) + 5.4) * size))
        rect.center = free.center
        draw_box(surface, rect, 0.6 * size)
        draw_text(surface, title, (rect.centerx, rect.top + 1.4 * size), size, INK, "center", bold=True)
        for k, text in enumerate(texts):
            ours = k + 1 == entering.place
            middle = rect.top + (3.4 + 1.9 * k) * size
            draw_text(
                surface, text, (rect.centerx, middle), 1.2 * size, GREEN if ours else INK, "center", ours, mono=True
            )
        draw_text(surface, foot, (rect.centerx, rect.bottom - 1.2 * size), 0.85 * size, FAINT, "center")
