"""Swept detection: the time of impact in closed form, along the straight line that each centre moves in a step.

Nothing is passed unseen, however fast. Paths under gravity are curved; what the line leaves out is g·h²/8 at most, so
that impacts are second order in time. What `bisect.py` says of explicit Euler holds here too.
"""

import numpy as np

from sandbox.engines.reference.ball_finder import BallFinder
from sandbox.engines.reference.detection.discrete import discrete
from sandbox.engines.reference.detection.resting import MOST_IMPACTS, SLOW, lasting, resting
from sandbox.engines.reference.stage import Stage


def swept(stage: Stage, h: float) -> None:
    """Advance from one first touch to the next; what closes gently comes to rest, and is the discrete stage's."""
    finder = stage.finder
    assert isinstance(finder, BallFinder)  # for polygons the engine refuses this detection
    left, gentle = h, stage.gentle(h)
    rest = resting(stage, left)
    for _ in range(MOST_IMPACTS):
        share, key = finder.first_touch(stage.x[0], stage.moved(left)[0], rest)
        if key < 0:
            break
        reached = stage.moved(share * left)
        contact = finder.only(reached[0], key)
        if stage.closing(contact, reached)[0] <= min(gentle, SLOW * contact.arm.sum() / left):
            rest = np.union1d(rest, [key])
            continue
        stage.impact(reached, contact, lasting(stage, reached, rest, contact), share * left)
        left -= share * left
        if left <= 0.0:  # hit just at the end of the step
            return
        rest = resting(stage, left)
    discrete(stage, left)
