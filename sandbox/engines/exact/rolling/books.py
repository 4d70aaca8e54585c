"""Books: the account of a run on a floor, of what kernels have booked and of what actions did."""

from collections.abc import Mapping

from sandbox.engines.account import Account, Cause
from sandbox.engines.exact.arena import BY_NORMAL, BY_PHANTOM, BY_RUBBING
from sandbox.engines.exact.rolling.board import (
    ACCOUNTING,
    BOOKED,
    BY_CAPTURE,
    BY_FLOOR,
    BY_HOPS,
    Board,
)
from sandbox.engines.exact.rolling.book import book_floor

PLACES = {
    Cause.RESTITUTION: (BY_NORMAL,),
    Cause.FRICTION: (BY_RUBBING, BY_FLOOR),
    Cause.PHANTOM: (BY_PHANTOM, BY_HOPS),
    Cause.RETIRED: (BY_CAPTURE,),
}


class Books:
    """The energy that each cause has brought since the books were opened.

    The floor's work is friction. What falls into a pocket is retired with all it had. What a hop gives is phantom.
    """

    def __init__(self, board: Board, now: float) -> None:
        """Open the books of all that happens on a board from a time on, s."""
        self.account = Account()
        """of what is done from outside"""
        board.counts[ACCOUNTING] = 1
        board.state[:, BOOKED] = now

    def entries(self, board: Board, now: float) -> Mapping[Cause, float]:
        """Return what each cause has brought up to a time, s; J."""
        book_floor(board, now)
        entries = dict(self.account.entries())
        for cause, places in PLACES.items():
            entries[cause] += sum(float(board.world[place]) for place in places)
        return entries
