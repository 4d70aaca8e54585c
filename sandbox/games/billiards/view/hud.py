"""HUD of billiards: scoreboard with status line and decisions, dial of the tip's offset, power bar."""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import pygame

from sandbox.formatting import format_signed
from sandbox.games.billiards.game import MAX_CUE_SPEED
from sandbox.games.billiards.match import Match
from sandbox.games.billiards.rules.base import Decision, renamed
from sandbox.games.billiards.rules.pool import EightBallState
from sandbox.games.billiards.view.balls import IVORY, BallTexture, texture_of
from sandbox.games.billiards.view.player import BOT, BilliardsPlayer
from sandbox.games.billiards.view.prediction import CueState
from sandbox.scene.description.surface import MISCUE
from sandbox.window.render.circles import draw_disc
from sandbox.window.render.palette import (
    FAINT,
    INK,
    LINE,
    ORANGE,
    PANEL,
    PANEL_RAISED,
    SKY,
    VERMILION,
    RgbColour,
    hex_colour,
    mix_colours,
)
from sandbox.window.render.sdf import ShapeStyle, draw_sdf_disc
from sandbox.window.render.text import draw_box, draw_text, text_size, wrap_text

MAX_SCOREBOARD_WIDTH = 470.0
"""px at a UI scale of 1"""
MIN_SCOREBOARD_WIDTH = 300.0
"""px at a UI scale of 1; if the top has less room, the scoreboard is at the bottom"""
FRAME_RATE_WIDTH = 66.0
"""px at a UI scale of 1: free width to its right, for the frame rate"""


class ScoreboardText(NamedTuple):
    """Drawn scoreboard."""

    rect: pygame.Rect
    choices: tuple[tuple[pygame.Rect, Decision], ...]
    """decisions that can be clicked, with their rectangles, px"""


class ScoreboardLayout(NamedTuple):
    """Position and text of a scoreboard."""

    rect: pygame.Rect
    lines: tuple[str, ...]
    """status line, wrapped"""


def layout_scoreboard(
    player: BilliardsPlayer, free: pygame.Rect, left: int, ui_scale: float, occupied: int = 0
) -> ScoreboardLayout:
    """Return the layout of the scoreboard: at the top of the free area, or at the bottom if the top is too narrow.

    Args:
        player: player at the window.
        free: free area, px.
        left: right edge of the status plate at the upper left, px.
        ui_scale: UI scale, 1 on a display of 1080 lines.
        occupied: occupied width at the bottom right, px.
    """
    size, pad, margin = 13.0 * ui_scale, round(9 * ui_scale), round(10 * ui_scale)
    right = free.right - round(FRAME_RATE_WIDTH * ui_scale)
    at_top = right - left >= MIN_SCOREBOARD_WIDTH * ui_scale
    if not at_top:
        left, right = free.left + margin, free.right - max(margin, occupied)
    width = min(right - left, round(MAX_SCOREBOARD_WIDTH * ui_scale))
    lines = wrap_text(status_line(player), size, width - 2 * pad - 1.3 * size, 2)
    rows = 1 + len(lines) + bool(_pocketed(player.match)) + bool(_offered(player))
    rect = pygame.Rect((left + right - width) // 2, free.top + margin, width, rows * round(1.5 * size) + 2 * pad)
    if not at_top:
        rect.bottomleft = left, free.bottom - margin
    return ScoreboardLayout(rect, lines)


def draw_scoreboard(
    surface: pygame.Surface, player: BilliardsPlayer, free: pygame.Rect, left: int, ui_scale: float, occupied: int = 0
) -> ScoreboardText:
    """Draw the scoreboard; the arguments are those of `layout_scoreboard`."""
    rect, lines = layout_scoreboard(player, free, left, ui_scale, occupied)
    size, pad, match = 13.0 * ui_scale, round(9 * ui_scale), player.match
    line, choices, down = round(1.5 * size), _offered(player), _pocketed(match)
    draw_box(surface, rect, 8 * ui_scale)
    y = rect.top + pad + line / 2
    _draw_players(surface, player, rect, y, size)
    y += line
    if down:
        _draw_ball_row(surface, match, down, rect, y, size)
        y += line
    mark = ORANGE if match.verdict is not None and match.verdict.fouls and player.is_at_rest else SKY
    draw_disc(surface, (rect.left + pad + 0.4 * size, y), 0.3 * size, mark)
    for text in lines:
        draw_text(surface, text, (rect.left + pad + 1.2 * size, y), size, INK, "midleft")
        y += line
    return ScoreboardText(rect, _draw_choices(surface, player.choice, choices, rect, y, size) if choices else ())


def _draw_players(surface: pygame.Surface, player: BilliardsPlayer, rect: pygame.Rect, y: float, size: float) -> None:
    match = player.match
    state = match.state
    cell = (rect.width - 1.4 * size) / state.players
    for index in range(state.players):
        left = rect.left + 0.7 * size + index * cell
        on = index == state.turn and not state.over
        if on:
            marked = pygame.Rect(round(left - 0.3 * size), round(y - 0.75 * size), round(cell), round(1.5 * size))
            pygame.draw.rect(surface, PANEL_RAISED, marked, border_radius=round(0.4 * size))
        name = player.names[index]
        if state.players == 1:
            name = "free play" if match.rules.name == "free" else match.rules.name
        group = ""
        if isinstance(state, EightBallState):
            group = state.groups[index] or "open table"
        won = state.over and state.winner == index
        spot = draw_text(surface, name, (left, y), size, INK if on or won else FAINT, "midleft", bold=on or won)
        if group:
            draw_text(surface, group, (spot.right + 0.6 * size, y), 0.86 * size, FAINT, "midleft")
        if not (match.rules.name == "free" and not match.layout.pockets):
            score = str(state.scores[index])
            draw_text(surface, score, (left + cell - 0.9 * size, y), size, INK, "midright", bold=True, mono=True)


def status_line(player: BilliardsPlayer) -> str:
    """Return the status line: messages of the last shot, and the next action."""
    match = player.match
    if not player.is_at_rest:
        return "balls rolling"
    before = renamed("; ".join(match.messages), player.names)
    if match.over:
        return f"{before or 'the frame is over'}; press R for a new frame"
    shooter = player.names[match.turn]
    if player.opponent is not None and match.turn == BOT:
        now = f"{shooter} is {'thinking' if player.is_bot_thinking else 'aiming'}"
    elif player.carried is not None:
        now = "click to place the cue ball"
    elif match.choices.needed and player.call.pocket is None:
        now = f"{shooter}: click the pocket of the {match.choices.balls[0] if match.choices.balls else 'ball'}"
    elif match.state.in_hand is not None and match.rules.name != "free":
        now = f"{shooter} has the ball in hand {match.state.in_hand}".removesuffix(" anywhere")
    elif match.state.players == 1:
        now = _single_player_line(player)
    else:
        now = f"{shooter} shoots{_ball_on(match)}"
    if player.call.safety:
        now += " (safety)"
    return f"{before}; {now}" if before and now not in before else now


def _single_player_line(player: BilliardsPlayer) -> str:
    return (
        "aim and shoot" if player.strokes == 0 else f"{player.strokes} {'stroke' if player.strokes == 1 else 'strokes'}"
    )


def _ball_on(match: Match) -> str:
    """Return the ball on as the end of the status line; empty if there are several, except in snooker."""
    targets = match.targets
    if match.rules.name == "snooker":
        kinds = {"red" if ball.startswith("red-") else ball for ball in targets}
        return f"; {kinds.pop()} is on" if len(kinds) == 1 else "; a colour is on"
    return f"; the {next(iter(targets))} is on" if len(targets) == 1 else ""


def _pocketed(match: Match) -> tuple[str, ...]:
    """Return the pocketed balls, in the order of the bodies."""
    if not match.layout.pockets:
        return ()
    on_table = {*match.state.table, match.cue}
    return tuple(name for name in match.layout.names if name not in on_table)


def _draw_ball_row(
    surface: pygame.Surface, match: Match, down: tuple[str, ...], rect: pygame.Rect, y: float, size: float
) -> None:
    max_balls = int((rect.width - 1.4 * size) / (1.35 * size))
    colours = {ball.name: ball.colour for ball in match.scene.balls}
    for k, name in enumerate(down[-max_balls:]):
        colour = hex_colour(colours.get(name) or "#808080")
        at = rect.left + 1.3 * size + k * 1.35 * size, y
        sprite = _ball_icon(texture_of(name, colour, struck=False), round(1.16 * size))
        surface.blit(sprite, sprite.get_rect(center=(round(at[0]), round(at[1]))))


@lru_cache(maxsize=128)
def _ball_icon(coat: BallTexture, side: int) -> pygame.Surface:
    """Return a small flat icon of a ball, `side` px wide."""
    oversampling = 4
    large = pygame.Surface((side * oversampling, side * oversampling), pygame.SRCALPHA)
    middle, radius = (side * oversampling // 2, side * oversampling // 2), side * oversampling // 2 - oversampling // 2
    pygame.draw.circle(large, IVORY if coat.kind == "stripe" else coat.colour, middle, radius)
    if coat.kind == "stripe":
        band = pygame.Surface(large.get_size(), pygame.SRCALPHA)
        pygame.draw.circle(band, coat.colour, middle, radius)
        high = round(0.44 * radius)
        band.fill((0, 0, 0, 0), (0, 0, side * oversampling, middle[1] - high - oversampling))
        band.fill((0, 0, 0, 0), (0, middle[1] + high + oversampling, side * oversampling, side * oversampling))
        large.blit(band, (0, 0))
    if coat.label:
        pygame.draw.circle(large, IVORY, middle, round(0.58 * radius))
        draw_text(
            large,
            coat.label,
            (middle[0], middle[1] + oversampling / 2),
            (0.8 if len(coat.label) == 1 else 0.62) * radius,
            (20, 20, 24),
            "center",
            bold=True,
        )
    return pygame.transform.smoothscale(large, (side, side))


def _offered(player: BilliardsPlayer) -> tuple[Decision, ...]:
    """Return the decisions to show; in free play only after another one than `play` was selected."""
    if not player.is_own_turn or player.match.over:
        return ()
    decisions = player.match.choices.decisions
    if player.match.rules.name == "free":
        return decisions if player.choice not in (None, "play") else ()
    return decisions if len(decisions) > 1 else ()


def _draw_choices(
    surface: pygame.Surface,
    now: Decision | None,
    choices: tuple[Decision, ...],
    rect: pygame.Rect,
    y: float,
    size: float,
) -> tuple[tuple[pygame.Rect, Decision], ...]:
    """Draw the decisions as buttons in a row; return those that fit, with their rectangles, px."""
    found, x = [], rect.left + 0.7 * size
    for each in choices:
        wide = text_size(each, 0.92 * size)[0] + round(1.2 * size)
        spot = pygame.Rect(round(x), round(y - 0.7 * size), wide, round(1.4 * size))
        if spot.right > rect.right - 0.5 * size:
            break
        chosen = each == now
        edge: RgbColour = SKY if chosen else LINE
        draw_box(surface, spot, 0.4 * size, PANEL_RAISED, 255, edge)
        draw_text(surface, each, spot.center, 0.92 * size, INK if chosen else FAINT, "center")
        found.append((spot, each))
        x = spot.right + 0.5 * size
    return tuple(found)


TIP_RADIUS = 0.22
"""radius of the tip's mark, in ball radii"""
POWER_MARKS = 5
"""number of intervals on the scale of the power bar"""


def draw_tip(surface: pygame.Surface, rect: pygame.Rect, cue: CueState, ui_scale: float) -> None:
    """Draw the english dial: the ball, the miscue limit, and the contact point of the tip."""
    (x, y), radius = (rect.centerx, rect.centery), rect.width / 2.0
    draw_box(surface, tip_box(rect, ui_scale), 10 * ui_scale, opacity=170)
    draw_sdf_disc(surface, (x, y), radius, ShapeStyle(IVORY, mix_colours(IVORY, PANEL, 0.45), 1.5 * ui_scale))
    faint = mix_colours(IVORY, PANEL, 0.28)
    for a, b in (((x - radius, y), (x + radius, y)), ((x, y - radius), (x, y + radius))):
        pygame.draw.line(surface, faint, a, b)
    for k in range(36):  # dashes
        if k % 2 == 0:
            turns = [math.tau * (k + part / 3.0) / 36.0 for part in range(4)]
            points = [(x + MISCUE * radius * math.cos(t), y + MISCUE * radius * math.sin(t)) for t in turns]
            pygame.draw.aalines(surface, mix_colours(IVORY, VERMILION, 0.75), False, points)
    at = x + cue.side * radius, y - cue.height * radius
    style = ShapeStyle(SKY, mix_colours(SKY, PANEL, 0.6), 1.5 * ui_scale, opacity=0.95)
    draw_sdf_disc(surface, at, TIP_RADIUS * radius, style)
    if cue.side or cue.height:
        text = f"{format_signed(cue.side, 2)}  {format_signed(cue.height, 2)}"
        draw_text(
            surface,
            text,
            (rect.left - 5 * ui_scale, rect.top - 8 * ui_scale),
            11 * ui_scale,
            FAINT,
            "bottomleft",
            mono=True,
        )


def tip_box(rect: pygame.Rect, ui_scale: float) -> pygame.Rect:
    """Return the rectangle of a dial with its background, px."""
    return rect.inflate(round(10 * ui_scale), round(10 * ui_scale))


def draw_power(surface: pygame.Surface, rect: pygame.Rect, cue: CueState, ui_scale: float) -> None:
    """Draw the power as a bar, with the speed of the cue above it."""
    draw_box(surface, tip_box(rect, ui_scale), 10 * ui_scale, opacity=170)
    rounding = round(0.3 * rect.width)
    pygame.draw.rect(surface, LINE, rect, border_radius=rounding)
    high = max(round(rect.height * cue.power), 2)
    full = pygame.Rect(rect.left, rect.bottom - high, rect.width, high)
    pygame.draw.rect(surface, mix_colours(SKY, ORANGE, cue.power), full, border_radius=min(rounding, high // 2))
    for k in range(1, POWER_MARKS):
        level = rect.bottom - rect.height * k / POWER_MARKS
        pygame.draw.line(surface, PANEL, (rect.left, level), (rect.left + rect.width // 3, level))
    shown = f"{cue.power * MAX_CUE_SPEED:.1f} m/s"
    draw_text(
        surface,
        shown,
        (rect.right + 5 * ui_scale, rect.top - 8 * ui_scale),
        11 * ui_scale,
        INK,
        "bottomright",
        mono=True,
    )


DIAL_SIDE, DIAL_GAP = 92.0, 14.0
"""px at a UI scale of 1: side of the english dial, and gap between dials"""
POWER_BAR = 18.0
"""px at a UI scale of 1: width of the power bar"""
MIN_HUD = 420, 300
"""px at a UI scale of 1: width and height of the free area below which no HUD is drawn"""


class BilliardsHud:
    """Scoreboard, english dial and power bar, with their mouse input."""

    def __init__(self, player: BilliardsPlayer) -> None:
        self._player = player
        self._tip = self._power = self._board = pygame.Rect(0, 0, 0, 0)
        self._choices: tuple[tuple[pygame.Rect, Decision], ...] = ()
        self._held = ""

    def draw(self, surface: pygame.Surface, free: pygame.Rect, left: int, ui_scale: float) -> None:
        """Draw the HUD; see `GameHud`."""
        player = self._player
        self._tip = self._power = self._board = pygame.Rect(0, 0, 0, 0)
        self._choices = ()
        if free.width < MIN_HUD[0] * ui_scale or free.height < MIN_HUD[1] * ui_scale:
            return
        scale = _scale(free, ui_scale)
        board = draw_scoreboard(surface, player, free, left, scale, _dials_width(scale))
        self._choices, self._board = board.choices, board.rect
        if not player.can_shoot:
            return
        self._tip, self._power = _dials(free, scale)
        draw_power(surface, self._power, player.cue, scale)
        draw_tip(surface, self._tip, player.cue, scale)

    def reserved(self, free: pygame.Rect, left: int, ui_scale: float) -> list[pygame.Rect]:
        """Return the rectangles of the HUD, px, with the dials even if they are hidden now."""
        if free.width < MIN_HUD[0] * ui_scale or free.height < MIN_HUD[1] * ui_scale:
            return []
        scale = _scale(free, ui_scale)
        board = layout_scoreboard(self._player, free, left, scale, _dials_width(scale)).rect
        return [board, *(tip_box(dial, scale) for dial in _dials(free, scale))]

    def plates(self, free: pygame.Rect, ui_scale: float) -> dict[str, pygame.Rect]:
        """Return the rectangles of the elements as last drawn, by name, px."""
        scale = _scale(free, ui_scale)
        return {"score": self._board} | {name: tip_box(rect, scale) for name, rect in self.dials.items() if rect.width}

    @property
    def dials(self) -> dict[str, pygame.Rect]:
        """Rectangles of the dials `tip` and `power` as last drawn, px; empty ones while they are hidden."""
        return {"tip": self._tip, "power": self._power}

    def handle_event(self, event: pygame.event.Event, run: Callable[[Callable[[], object]], bool]) -> bool:
        """Handle a mouse event; return whether it was used."""
        player = self._player
        if event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
            clicked = next((each for rect, each in self._choices if rect.collidepoint(event.pos)), None)
            if clicked is not None:
                run(lambda: player.decide(clicked))
                return True
            self._held = next((name for name, rect in self.dials.items() if rect.collidepoint(event.pos)), "")
            if self._held and player.is_own_turn:
                self._set(event.pos, player.cue)
            return bool(self._held)
        if event.type == pygame.MOUSEMOTION and self._held:
            if player.is_own_turn:
                self._set(event.pos, player.cue)
            return True
        if event.type in (pygame.MOUSEBUTTONUP, pygame.WINDOWFOCUSLOST):
            self._held = ""
        return False

    def _set(self, at: tuple[int, int], cue: CueState) -> None:
        if self._held == "tip" and self._tip.width:
            half = self._tip.width / 2.0
            cue.tip_at((at[0] - self._tip.centerx) / half, (self._tip.centery - at[1]) / half)
        elif self._power.height:
            cue.power = (self._power.bottom - at[1]) / self._power.height


def _scale(free: pygame.Rect, ui_scale: float) -> float:
    return ui_scale * min(1.0, free.width / (640.0 * ui_scale), free.height / (520.0 * ui_scale))


def _dials(free: pygame.Rect, scale: float) -> tuple[pygame.Rect, pygame.Rect]:
    """Return the rectangles of the english dial and the power bar, px."""
    side, gap, bar = round(DIAL_SIDE * scale), round(DIAL_GAP * scale), round(POWER_BAR * scale)
    power = pygame.Rect(free.right - gap - bar, free.bottom - gap - side, bar, side)
    return pygame.Rect(power.left - gap - side, power.top, side, side), power


def _dials_width(scale: float) -> int:
    """Return the width of the dials at the right, px."""
    return round(DIAL_SIDE * scale) + round(POWER_BAR * scale) + 3 * round(DIAL_GAP * scale)
