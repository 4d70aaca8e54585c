"""Books: the account of an exact run, of what kernels have booked and of what actions did."""

from collections.abc import Mapping

from sandbox.engines.account import Account, Cause
from sandbox.engines.exact.arena import (
    ACCOUNTING,
    BOOKED,
    BOOKED_LATE,
    BY_KICKS,
    BY_NORMAL,
    BY_PHANTOM,
    BY_RUBBING,
    Arena,
)
from sandbox.engines.exact.booking import book_slides

PLACES = {
    Cause.RESTITUTION: BY_NORMAL,
    Cause.FRICTION: BY_RUBBING,
    Cause.KICKS: BY_KICKS,
    Cause.PHANTOM: BY_PHANTOM,
}


class Books:
    """The energy that each cause has brought since the books were opened.

    Between events motion is in closed form and keeps its energy, so there is no entry of an integrator; nor of
    shifted positions, as none is. A series of bounces that is cut at its end belongs to restitution, and so does
    what a hop gives, which is phantom. What is left over is rounding: 1e-9 of the energy in motion at most.
    """

    def __init__(self, arena: Arena, now: float) -> None:
        """Open the books of all that happens in an arena from a time on, s."""
        self.account = Account()
        """of what is done from outside"""
        arena.counts[ACCOUNTING] = 1
        arena.state[:, BOOKED], arena.state[:, BOOKED_LATE] = now, 0.0

    def entries(self, arena: Arena, now: float) -> Mapping[Cause, float]:
        """Return what each cause has brought up to a time, s; J."""
        book_slides(arena, now, 0.0)
        booked = {cause: float(arena.world[place]) for cause, place in PLACES.items()}
        return {cause: energy + booked.get(cause, 0.0) for cause, energy in self.account.entries().items()}
