"""Gauges: what a player of pinball reads off the table and its panel, as numbers for who learns to play."""

from collections.abc import Iterator, Sequence

from sandbox.games.pinball.course import Course
from sandbox.games.pinball.drops import Drops
from sandbox.games.pinball.lamps import Lamps
from sandbox.games.pinball.modes import Modes
from sandbox.games.pinball.multiball import Multiball

Gauge = tuple[str, float]


def gauges(
    course: Course, modes: Modes, multiball: Multiball, lamps: Sequence[Lamps], banks: Sequence[Drops], saved: float
) -> Iterator[Gauge]:
    """Yield names and values, always the same names in the same order.

    Args:
        course: of the game.
        modes: what runs.
        multiball: whether it is on.
        lamps: the sets of lanes and standing targets.
        banks: of drop targets.
        saved: s, in which drained balls come back; 0 for none.
    """
    sheet, nudge = course.sheet, course.nudge
    yield "player", course.turn
    yield "ball", sheet.ball
    yield "shoot again", sheet.again
    yield "bonus", sheet.bonus
    yield "bonus times", sheet.times
    yield "ball save", saved
    yield "balls in play", len(course.trough.live)
    yield "locked", sheet.locked
    yield "lock lit", sheet.lit
    yield "multiball", multiball.on
    yield "mode ready", modes.ready
    yield "mode", 0 if modes.mode is None else 1 + modes.modes.index(modes.mode)
    yield "mode left", 0.0 if modes.mode is None else modes.left
    yield "mode to go", 0 if modes.mode is None else modes.to_go
    yield "warnings", nudge.warnings
    yield "tilted", nudge.tilted
    for each in lamps:
        yield from ((f"{name} lit", lit) for name, lit in zip(each.names, each.lit, strict=True))
    for bank in banks:
        gone = {*bank.down, *bank.falling}
        yield from ((f"{target.name} down", place in gone) for place, target in enumerate(bank.members))
