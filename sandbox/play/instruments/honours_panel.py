"""Honours panel: the ten best of a table, and the keys that enter one's initials."""

import pygame

from sandbox.play.drawing.palette import FAINT, GREEN, INK
from sandbox.play.drawing.text import measure, write
from sandbox.play.hosting.honours import Honours
from sandbox.play.hosting.host import Host
from sandbox.play.instruments.plates import plate

LETTERS = 15.0
"""px at unit 1"""

DEAF = 0.8
"""s, at first: whoever has just lost a ball still plays"""

ENTER = (pygame.K_RETURN, pygame.K_KP_ENTER)


class HonoursPanel:
    """Shows honours while there are some, and takes all keys that write."""

    def __init__(self) -> None:
        self.honours = Honours()
        self._since = 0

    def watch(self, host: Host | None) -> list[str]:
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
        size = LETTERS * min(unit, free.width / 420.0, free.height / 420.0)
        title = "High scores" if entering.kept else f"Place {entering.place}: type your initials"
        foot = "Enter or Esc: close" if entering.kept else "Enter: save · Esc: discard"
        texts = [
            f"{k:>2}  {each.initials.ljust(3)}  {each.score:>15,}".replace(",", " ") for k, each in enumerate(rows, 1)
        ]
        wide = max(measure(text, 1.2 * size, mono=True)[0] for text in texts)
        wide = max(wide, measure(title, size, bold=True)[0], measure(foot, 0.85 * size)[0])
        rect = pygame.Rect(0, 0, round(wide + 3 * size), round((1.9 * len(rows) + 5.4) * size))
        rect.center = free.center
        plate(surface, rect, 0.6 * size)
        write(surface, title, (rect.centerx, rect.top + 1.4 * size), size, INK, "center", bold=True)
        for k, text in enumerate(texts):
            ours = k + 1 == entering.place
            middle = rect.top + (3.4 + 1.9 * k) * size
            write(surface, text, (rect.centerx, middle), 1.2 * size, GREEN if ours else INK, "center", ours, mono=True)
        write(surface, foot, (rect.centerx, rect.bottom - 1.2 * size), 0.85 * size, FAINT, "center")
