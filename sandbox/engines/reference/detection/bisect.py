"""Bisection: rewind, and halve the step until the moment of impact is found. The tutorial's example 5.

A step that ends with a new overlap is taken back. The last time at which nothing overlaps yet is found by bisection,
the impact resolved there, and the rest of the step begun anew. It finds when something was hit, not whether: who is
through before the end of the step is not seen, as in discrete detection.

Impacts in time ask for flights that are right: explicit Euler gains g·h of speed in each, which discrete detection
happens to take away again. Here it stays, and a bouncing ball never comes below e·g·h/(1 − e).
"""

from sandbox.engines.reference.detection.discrete import discrete
from sandbox.engines.reference.detection.resting import MOST_IMPACTS, fresh, gathered, lasting, resting
from sandbox.engines.reference.stage import Stage

EPSILON = 1e-9
"""How near to the impact bisection comes, as a part of the step: 30 halvings."""


def bisect(stage: Stage, h: float) -> None:
    """Advance from impact to impact, each to the last time at which nothing overlaps anew within EPSILON·h."""
    left, gentle = h, stage.gentle(h)
    for _ in range(MOST_IMPACTS):
        rest = resting(stage, left)
        clash = fresh(stage, stage.moved(left), rest, gentle)
        if not clash.size:
            break
        low, high = 0.0, left
        while high - low > EPSILON * h:
            middle = 0.5 * (low + high)
            found = fresh(stage, stage.moved(middle), rest, gentle)
            if found.size:
                clash, high = found, middle
            else:
                low = middle
        moved = stage.moved(low)
        clash = gathered(stage, moved, clash)
        stage.impact(moved, clash, lasting(stage, moved, rest, clash), low)
        left -= low
    discrete(stage, left)
