"""Tools: what a player has beside the table: the ball with the tip's mark, the power, the scores."""

from collections.abc import Callable

import pygame

from sandbox.games.billiards.rules.call import Decision
from sandbox.play.billiards.cue import Cue
from sandbox.play.billiards.person import Person
from sandbox.play.instruments.scoreboard import draw_scoreboard, lay_scoreboard
from sandbox.play.instruments.tip import draw_power, draw_tip, plate_of
from sandbox.play.running.live import Live

SIDE, GAP = 92.0, 14.0
"""px at unit 1"""
BAR = 18.0
LEAST = 420, 300
"""px at unit 1: a smaller picture has no room for them"""

Act = Callable[[Callable[[Live], object]], bool]


class Tools:
    """Draws them, and lets the mouse set them."""

    def __init__(self) -> None:
        self._tip = self._power = pygame.Rect(0, 0, 0, 0)
        self._choices: tuple[tuple[pygame.Rect, Decision], ...] = ()
        self.foot = 0
        """px that they cover at the bottom left, where messages are told"""
        self.board = pygame.Rect(0, 0, 0, 0)
        """where the scores stand"""
        self._held = ""

    def draw(self, surface: pygame.Surface, person: Person, free: pygame.Rect, left: int, unit: float) -> None:
        """Draw all.

        Args:
            surface: the picture.
            person: who plays.
            free: px, what nothing else covers.
            left: px, what is told at the upper left.
            unit: px of a pixel at 1080 lines.
        """
        self._tip = self._power = pygame.Rect(0, 0, 0, 0)
        self._choices, self.foot, self.board = (), 0, pygame.Rect(0, 0, 0, 0)
        if free.width < LEAST[0] * unit or free.height < LEAST[1] * unit:
            return
        scale = _scale(free, unit)
        board = draw_scoreboard(surface, person, free, left, scale, _aside(scale))
        self._choices, self.board = board.choices, board.rect
        if board.rect.top > free.centery:
            self.foot = free.bottom - board.rect.top
        if not person.game.aiming:
            return
        self._tip, self._power = _dials(free, scale)
        draw_power(surface, self._power, person.game.cue, scale)
        draw_tip(surface, self._tip, person.game.cue, scale)

    def taken(self, person: Person, free: pygame.Rect, left: int, unit: float) -> list[pygame.Rect]:
        """Return what they cover, or will as soon as somebody aims; as `draw`."""
        if free.width < LEAST[0] * unit or free.height < LEAST[1] * unit:
            return []
        scale = _scale(free, unit)
        board = lay_scoreboard(person, free, left, scale, _aside(scale)).rect
        return [board, *(plate_of(dial, scale) for dial in _dials(free, scale))]

    def plates(self, free: pygame.Rect, unit: float) -> dict[str, pygame.Rect]:
        """Return what each of them covers, as they were last drawn."""
        scale = _scale(free, unit)
        dials = {name: plate_of(rect, scale) for name, rect in self._rects() if rect.width}
        return {"score": self.board, **dials}

    def handle(self, event: pygame.event.Event, person: Person, act: Act) -> bool:
        """Take an event in; return whether it was used up."""
        if event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
            clicked = next((each for rect, each in self._choices if rect.collidepoint(event.pos)), None)
            if clicked is not None:
                act(lambda _: person.decide(clicked))
                return True
            self._held = next((name for name, rect in self._rects() if rect.collidepoint(event.pos)), "")
            if self._held and person.game.mine:
                self._set(event.pos, person.game.cue)
            return bool(self._held)
        if event.type == pygame.MOUSEMOTION and self._held:
            if person.game.mine:
                self._set(event.pos, person.game.cue)
            return True
        if event.type in (pygame.MOUSEBUTTONUP, pygame.WINDOWFOCUSLOST):
            self._held = ""
        return False

    def _rects(self) -> tuple[tuple[str, pygame.Rect], ...]:
        return ("tip", self._tip), ("power", self._power)

    def _set(self, at: tuple[int, int], cue: Cue) -> None:
        if self._held == "tip" and self._tip.width:
            half = self._tip.width / 2.0
            cue.tip_at((at[0] - self._tip.centerx) / half, (self._tip.centery - at[1]) / half)
        elif self._power.height:
            cue.power = (self._power.bottom - at[1]) / self._power.height


def _scale(free: pygame.Rect, unit: float) -> float:
    return unit * min(1.0, free.width / (640.0 * unit), free.height / (520.0 * unit))


def _dials(free: pygame.Rect, scale: float) -> tuple[pygame.Rect, pygame.Rect]:
    """Return where the tip and the power are set."""
    side, gap, bar = round(SIDE * scale), round(GAP * scale), round(BAR * scale)
    power = pygame.Rect(free.right - gap - bar, free.bottom - gap - side, bar, side)
    return pygame.Rect(power.left - gap - side, power.top, side, side), power


def _aside(scale: float) -> int:
    """Return what the dials cover at the right, px."""
    return round(SIDE * scale) + round(BAR * scale) + 3 * round(GAP * scale)
