"""Swept detection: the time of impact in closed form, along the straight line that each centre moves in a step.

Nothing is passed unseen, however fast. Paths under gravity are curved; what the line leaves out is g·h²/8 at most, so
that impacts are second order in time.
"""

from sandbox.engines.reference.detection.discrete import discrete
from sandbox.engines.reference.detection.resting import MOST_IMPACTS, resting
from sandbox.engines.reference.stage import Stage


def swept(stage: Stage, h: float) -> None:
    """Advance from one first touch to the next."""
    left = h
    for _ in range(MOST_IMPACTS):
        moved = stage.moved(left)
        share, key = stage.finder.first_touch(stage.x[0], moved[0], resting(stage, left))
        if key < 0:
            break
        reached = stage.moved(share * left)
        stage.impact(reached, stage.finder.only(reached[0], key), share * left)
        left -= share * left
    discrete(stage, left)
