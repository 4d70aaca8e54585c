"""Scoreboard: who plays, what for, how it stands, what is to be done; and what may be decided."""

from functools import lru_cache
from typing import NamedTuple

import pygame

from sandbox.games.billiards.match import Match
from sandbox.games.billiards.rules.call import Decision
from sandbox.games.billiards.rules.eight_ball import EightBallState
from sandbox.games.billiards.rules.verdict import renamed
from sandbox.play.billiards.game import BOT, Game
from sandbox.play.billiards.person import Person
from sandbox.play.drawing.palette import FAINT, INK, LINE, ORANGE, PANEL_RAISED, SKY, Colour, hex_colour
from sandbox.play.drawing.table.coats import IVORY, Coat, coat_of
from sandbox.play.drawing.text import measure, write
from sandbox.play.instruments.icons import draw_disc
from sandbox.play.instruments.plates import plate, wrapped

WIDEST = 470.0
"""px at unit 1"""
NARROWEST = 300.0
RIGHT = 66.0
"""px at unit 1 beside it, for how many pictures a second there are"""


class Drawn(NamedTuple):
    """A scoreboard as it was drawn."""

    rect: pygame.Rect
    choices: tuple[tuple[pygame.Rect, Decision], ...]
    """where the decisions are that can be clicked"""


class Laid(NamedTuple):
    """Where a scoreboard lies, and what it says."""

    rect: pygame.Rect
    lines: tuple[str, ...]
    """what happened, and what is to be done"""


def lay_scoreboard(person: Person, free: pygame.Rect, left: int, unit: float, aside: int = 0) -> Laid:
    """Lay it at the top of what is free, or where that is too narrow, at the bottom.

    Args:
        person: who plays.
        free: px, what it may cover.
        left: px, what else covers the top.
        unit: px of a pixel at 1080 lines.
        aside: px at the right that something else covers at the bottom.
    """
    size, pad, margin = 13.0 * unit, round(9 * unit), round(10 * unit)
    right = free.right - round(RIGHT * unit)
    above = right - left >= NARROWEST * unit
    if not above:
        left, right = free.left + margin, free.right - max(margin, aside)
    width = min(right - left, round(WIDEST * unit))
    lines = wrapped(status_line(person), size, width - 2 * pad - 1.3 * size, 2)
    rows = 1 + len(lines) + bool(_down(person.game.match)) + bool(_choices(person))
    rect = pygame.Rect((left + right - width) // 2, free.top + margin, width, rows * round(1.5 * size) + 2 * pad)
    if not above:
        rect.bottomleft = left, free.bottom - margin
    return Laid(rect, lines)


def draw_scoreboard(
    surface: pygame.Surface, person: Person, free: pygame.Rect, left: int, unit: float, aside: int = 0
) -> Drawn:
    """Draw it where it is laid; as `lay_scoreboard`."""
    rect, lines = lay_scoreboard(person, free, left, unit, aside)
    size, pad, game, match = 13.0 * unit, round(9 * unit), person.game, person.game.match
    line, choices, down = round(1.5 * size), _choices(person), _down(match)
    plate(surface, rect, 8 * unit)
    y = rect.top + pad + line / 2
    _players(surface, game, rect, y, size)
    y += line
    if down:
        _row_of_balls(surface, match, down, rect, y, size)
        y += line
    mark = ORANGE if match.verdict is not None and match.verdict.fouls and game.resting else SKY
    draw_disc(surface, (rect.left + pad + 0.4 * size, y), 0.3 * size, mark)
    for text in lines:
        write(surface, text, (rect.left + pad + 1.2 * size, y), size, INK, "midleft")
        y += line
    return Drawn(rect, _draw_choices(surface, person.choice, choices, rect, y, size) if choices else ())


def _players(surface: pygame.Surface, game: Game, rect: pygame.Rect, y: float, size: float) -> None:
    match = game.match
    state = match.state
    cell = (rect.width - 1.4 * size) / state.players
    for player in range(state.players):
        left = rect.left + 0.7 * size + player * cell
        on = player == state.turn and not state.over
        if on:
            marked = pygame.Rect(round(left - 0.3 * size), round(y - 0.75 * size), round(cell), round(1.5 * size))
            pygame.draw.rect(surface, PANEL_RAISED, marked, border_radius=round(0.4 * size))
        name = game.names[player]
        if state.players == 1:
            name = "free play" if match.rules.name == "free" else match.rules.name
        group = ""
        if isinstance(state, EightBallState):
            group = state.groups[player] or "open table"
        won = state.over and state.winner == player
        spot = write(surface, name, (left, y), size, INK if on or won else FAINT, "midleft", bold=on or won)
        if group:
            write(surface, group, (spot.right + 0.6 * size, y), 0.86 * size, FAINT, "midleft")
        if not (match.rules.name == "free" and not match.layout.pockets):
            score = str(state.scores[player])
            write(surface, score, (left + cell - 0.9 * size, y), size, INK, "midright", bold=True, mono=True)


def status_line(person: Person) -> str:
    """Return the line about what happened and what is to be done."""
    game, match = person.game, person.game.match
    if not game.resting:
        return "balls rolling"
    before = renamed("; ".join(match.messages), game.names)
    if match.over:
        return f"{before or 'the frame is over'}; press R for a new frame"
    who = game.names[match.turn]
    if game.opponent is not None and match.turn == BOT:
        now = f"{who} is {'thinking' if game.bot_is_thinking else 'aiming'}"
    elif person.carried is not None:
        now = "click to place the cue ball"
    elif match.choices.needed and game.call.pocket is None:
        now = f"{who}: click the pocket of the {match.choices.balls[0] if match.choices.balls else 'ball'}"
    elif match.state.in_hand is not None and match.rules.name != "free":
        now = f"{who} has the ball in hand {match.state.in_hand}".removesuffix(" anywhere")
    elif match.state.players == 1:
        now = _asked(game)
    else:
        now = f"{who} shoots{_on(match)}"
    if game.call.safety:
        now += " (safety)"
    return f"{before}; {now}" if before and now not in before else now


def _asked(game: Game) -> str:
    return "aim and shoot" if game.strokes == 0 else f"{game.strokes} {'stroke' if game.strokes == 1 else 'strokes'}"


def _on(match: Match) -> str:
    """Return what is on, where that is one ball or one kind."""
    targets = match.targets
    if match.rules.name == "snooker":
        kinds = {"red" if ball.startswith("red-") else ball for ball in targets}
        return f"; {kinds.pop()} is on" if len(kinds) == 1 else "; a colour is on"
    return f"; the {next(iter(targets))} is on" if len(targets) == 1 else ""


def _down(match: Match) -> tuple[str, ...]:
    """Return the balls that have been made, in the order of their numbers; reds of snooker are counted."""
    if not match.layout.pockets:
        return ()
    here = {*match.state.table, match.cue}
    return tuple(name for name in match.layout.names if name not in here)


def _row_of_balls(
    surface: pygame.Surface, match: Match, down: tuple[str, ...], rect: pygame.Rect, y: float, size: float
) -> None:
    room = int((rect.width - 1.4 * size) / (1.35 * size))
    colours = {ball.name: ball.colour for ball in match.scene.balls}
    for k, name in enumerate(down[-room:]):
        colour = hex_colour(colours.get(name) or "#808080")
        at = rect.left + 1.3 * size + k * 1.35 * size, y
        sprite = _small(coat_of(name, colour, struck=False), round(1.16 * size))
        surface.blit(sprite, sprite.get_rect(center=(round(at[0]), round(at[1]))))


@lru_cache(maxsize=128)
def _small(coat: Coat, side: int) -> pygame.Surface:
    """Return a little flat picture of a ball."""
    over = 4
    large = pygame.Surface((side * over, side * over), pygame.SRCALPHA)
    middle, radius = (side * over // 2, side * over // 2), side * over // 2 - over // 2
    pygame.draw.circle(large, IVORY if coat.kind == "stripe" else coat.colour, middle, radius)
    if coat.kind == "stripe":
        band = pygame.Surface(large.get_size(), pygame.SRCALPHA)
        pygame.draw.circle(band, coat.colour, middle, radius)
        high = round(0.44 * radius)
        band.fill((0, 0, 0, 0), (0, 0, side * over, middle[1] - high - over))
        band.fill((0, 0, 0, 0), (0, middle[1] + high + over, side * over, side * over))
        large.blit(band, (0, 0))
    if coat.label:
        pygame.draw.circle(large, IVORY, middle, round(0.58 * radius))
        write(
            large,
            coat.label,
            (middle[0], middle[1] + over / 2),
            (0.8 if len(coat.label) == 1 else 0.62) * radius,
            (20, 20, 24),
            "center",
            bold=True,
        )
    return pygame.transform.smoothscale(large, (side, side))


def _choices(person: Person) -> tuple[Decision, ...]:
    """Return what is to be decided; in free play nothing needs to be."""
    game = person.game
    if not game.mine or game.match.over:
        return ()
    decisions = game.match.choices.decisions
    if game.match.rules.name == "free":
        return decisions if person.choice not in (None, "play") else ()
    return decisions if len(decisions) > 1 else ()


def _draw_choices(
    surface: pygame.Surface,
    now: Decision | None,
    choices: tuple[Decision, ...],
    rect: pygame.Rect,
    y: float,
    size: float,
) -> tuple[tuple[pygame.Rect, Decision], ...]:
    """Draw the decisions as plates side by side."""
    found, x = [], rect.left + 0.7 * size
    for each in choices:
        wide = measure(each, 0.92 * size)[0] + round(1.2 * size)
        spot = pygame.Rect(round(x), round(y - 0.7 * size), wide, round(1.4 * size))
        if spot.right > rect.right - 0.5 * size:
            break
        chosen = each == now
        edge: Colour = SKY if chosen else LINE
        plate(surface, spot, 0.4 * size, PANEL_RAISED, 255, edge)
        write(surface, each, spot.center, 0.92 * size, INK if chosen else FAINT, "center")
        found.append((spot, each))
        x = spot.right + 0.5 * size
    return tuple(found)
