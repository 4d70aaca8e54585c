"""Discrete detection: look once, at the end of the step. What passes through within a step is not seen.

A thin wall is tunnelled through when v·h > r + half its thickness, a ball by a ball when v·h > r₁ + r₂.
"""

from sandbox.engines.reference.stage import Stage


def discrete(stage: Stage, h: float) -> None:
    """Advance, detect, resolve."""
    moved = stage.moved(h)
    contacts = stage.overlaps(moved)
    stage.resolve(moved, contacts, h)
