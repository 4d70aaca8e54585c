"""High-score dialog: asks for initials after a game with a score among the ten best, and lists the scores."""

from dataclasses import dataclass, field

import pygame

from sandbox.games.contract import HasRanking
from sandbox.games.high_scores import LETTERS, MAX_SCORES, Entry, HighScores, initials_of, opened, table_of
from sandbox.window.game_host import GameHost
from sandbox.window.input.keymap import latin_key
from sandbox.window.render.palette import FAINT, GREEN, INK
from sandbox.window.render.text import draw_box, draw_text, text_lines_width, text_size
from sandbox.window.ui.text_edit import TextEdit, is_text_shortcut

TEXT_SIZE = 15.0
"""px at UI scale 1"""
MIN_DELAY_S = 0.8
"""s after the end of the game during which keys are ignored, as the player may still be pressing keys of the game"""
FIRST_FUNCTION_KEY = 1 << 30
"""key codes from here on belong to keys without a character, such as F1 and the arrows"""
ENTER_KEYS = (pygame.K_RETURN, pygame.K_KP_ENTER)


@dataclass
class HighScoreEntry:
    """A score among the ten best, and the initials typed for it."""

    scores: HighScores
    table: str
    score: int | float
    rank: int
    """1 is the best"""
    others: tuple[Entry, ...] = ()
    """scores in the file before this one is saved"""
    edit: TextEdit = field(default_factory=lambda: TextEdit("", clean=_initials, max_length=LETTERS))
    saved: tuple[Entry, ...] | None = None
    """scores in the file after this one was saved; None before"""

    @property
    def letters(self) -> str:
        """Initials typed so far."""
        return self.edit.text

    def save(self) -> None:
        """Save the score to the file.

        Raises:
            OSError: the file cannot be read or written.
            ValueError: the file has become invalid since the dialog opened.
        """
        self.scores.enter(self.table, self.letters, self.score)
        self.saved = self.scores.of(self.table)

    def rows(self) -> tuple[Entry, ...]:
        """Return the ten best scores including this one, without reading the file."""
        if self.saved is not None:
            return self.saved
        own = Entry(self.letters.ljust(LETTERS, "_"), self.score)
        return (*self.others[: self.rank - 1], own, *self.others[self.rank - 1 :])[:MAX_SCORES]


def _initials(text: str) -> str:
    """Return the characters of a text that initials can have, as capital letters."""
    letters = (letter.upper() for letter in text)
    return "".join(letter for letter in letters if len(letter) == 1 and initials_of(letter) == letter)


class HighScoreDialog:
    """Dialog that opens once after a game with player input, and consumes text input while it is open."""

    def __init__(self) -> None:
        self.entry: HighScoreEntry | None = None
        """None while closed"""
        self._ended: GameHost | None = None  # game whose end has been handled
        self._opened_at = 0  # ms
        self._notes: list[str] = []

    def update(self, host: GameHost | None) -> list[str]:
        """Open the dialog if the game has just ended with a score among the best; return messages to show."""
        if host is None or host.rules.game_over is None:
            self._ended, self.entry = None, None
        elif host is not self._ended:
            self._ended = host
            self.entry = self._new_entry(host) if host.touched else None
            self._opened_at = pygame.time.get_ticks()
        notes, self._notes = self._notes, []
        return notes

    def _new_entry(self, host: GameHost) -> HighScoreEntry | None:
        if isinstance(host.rules, HasRanking) and not host.rules.is_ranked:
            return None
        try:
            scores = opened()
            if scores.notice is not None:
                self._notes.append(scores.notice)
            table, score = table_of(host.live.scene), host.rules.score
            rank = scores.rank(table, score)
            return None if rank is None else HighScoreEntry(scores, table, score, rank, scores.of(table))
        except (OSError, ValueError) as error:
            self._notes.append(f"high scores unavailable: {error}")
            return None

    @property
    def is_typing(self) -> bool:
        """Whether letters are typed as initials, so that they are no commands."""
        return self.entry is not None and self.entry.saved is None

    def handle_event(self, event: pygame.event.Event) -> bool:
        """Process a key press; return whether it was consumed.

        Raises:
            ClipboardError: a text was to be copied or pasted, and the system gives no access to its clipboard.
        """
        entry = self.entry
        if entry is None or event.type != pygame.KEYDOWN:
            return False
        is_shortcut = is_text_shortcut(event) and entry.saved is None
        if event.mod & (pygame.KMOD_CTRL | pygame.KMOD_ALT) and not is_shortcut:
            return False
        if entry.saved is not None:
            if event.key not in (*ENTER_KEYS, pygame.K_ESCAPE):
                return False
            self.entry = None
            return True
        if pygame.time.get_ticks() - self._opened_at < 1000 * MIN_DELAY_S:
            return True
        if is_shortcut:
            entry.edit.press(event)
        elif event.key in ENTER_KEYS:
            if entry.letters:  # Enter may be a game key that is still being pressed
                self._save(entry)
        elif event.key == pygame.K_ESCAPE:
            self.entry = None
        elif event.key == pygame.K_BACKSPACE:
            entry.edit.delete(-1)
        elif event.unicode and event.unicode.isprintable():
            key = latin_key(event)  # a layout without Latin letters cannot type initials
            entry.edit.insert(event.unicode if key == event.key else chr(key))
        else:  # keys of characters are no commands here, whatever text an input method makes of them
            return bool(event.key < FIRST_FUNCTION_KEY)
        return True

    def _save(self, entry: HighScoreEntry) -> None:
        """Save the entry; on failure close the dialog and add a message."""
        try:
            entry.save()
        except (OSError, ValueError) as error:
            self._notes.append(f"high score not saved: {error}")
            self.entry = None

    def draw(self, surface: pygame.Surface, area: pygame.Rect, ui_scale: float) -> None:
        """Draw the dialog in the centre of an area, px."""
        entry = self.entry
        if entry is None:
            return
        size = TEXT_SIZE * min(ui_scale, area.width / 420.0, area.height / 420.0)
        title = f"Rank {entry.rank}: type your initials" if entry.saved is None else "High scores"
        hint = "Enter: save · Esc: discard" if entry.saved is None else "Enter or Esc: close"
        lines = [f"{k:>2}  {row.initials.ljust(3)}  {row.score:>15,}" for k, row in enumerate(entry.rows(), 1)]
        width = max(
            text_size(title, size, bold=True)[0],
            text_size(hint, 0.85 * size)[0],
            text_lines_width(lines, 1.2 * size, mono=True),
        )
        rect = pygame.Rect(0, 0, round(width + 3 * size), round((1.9 * len(lines) + 5.4) * size))
        rect.center = area.center
        draw_box(surface, rect, 0.6 * size)
        draw_text(surface, title, (rect.centerx, rect.top + 1.4 * size), size, INK, "center", bold=True)
        for k, line in enumerate(lines):
            own, y = k + 1 == entry.rank, rect.top + (3.4 + 1.9 * k) * size
            colour = GREEN if own else INK
            draw_text(surface, line, (rect.centerx, y), 1.2 * size, colour, "center", bold=own, mono=True)
        draw_text(surface, hint, (rect.centerx, rect.bottom - 1.2 * size), 0.85 * size, FAINT, "center")
