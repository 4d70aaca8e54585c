"""Shrinking: cut the step until no displacement is large. The tutorial's remedy against tunnelling.

No body moves more than half the smallest radius in a piece, so that none passes through another, or a wall, unseen:
the centre itself is never across before the overlap shows. The price is paid by all for the fastest.
"""

import numpy as np

from sandbox.engines.contract import Exhaustion
from sandbox.engines.reference.detection.discrete import discrete
from sandbox.engines.reference.stage import Stage

MOST_PIECES = 100_000
"""Pieces of one substep; beyond, the scene asks for another detection."""


def shrink(stage: Stage, h: float) -> None:
    """Advance in pieces, each as long as the largest possible displacement allows."""
    left, pieces = h, 0
    while left > 0.0:
        ways = _longest_way(stage, left) / (0.5 * stage.finder.thinnest)
        if not ways < MOST_PIECES - pieces:
            raise Exhaustion(f"a substep would be cut into {ways:.3g} pieces; at most {MOST_PIECES:,}")
        piece = left / ways if ways > 1.0 else left
        discrete(stage, piece)
        left = left - piece if piece < left else 0.0
        pieces += 1


def _longest_way(stage: Stage, h: float) -> float:
    """Return a bound, m, for the way of any body in h, s.

    The speeds at both ends count too: who is thrown up and falls back has gone a way, and is where it was.
    """
    finder, x, moved = stage.finder, stage.x, stage.moved(h)
    still = np.zeros_like(x[1])
    return max(finder.farthest(x[0], moved[0]), finder.farthest(still, h * x[1]), finder.farthest(still, h * moved[1]))
