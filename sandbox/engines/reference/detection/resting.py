"""Resting: the pairs whose touch is nothing new, so that no time of impact is looked for."""

import numpy as np

from sandbox.engines.reference.ball_finder import BallFinder
from sandbox.engines.reference.manifolds import Manifolds
from sandbox.engines.reference.motion import State
from sandbox.engines.reference.stage import Stage
from sandbox.trajectory import BoolArray, IntArray

NEAR = 1e-6
"""A pair nearer than this part of its contact distance touches: far above what bisection leaves (1e-9 of a step)."""

SLOW = 0.5
"""What closes by less than this part of its contact distance in a step cannot pass unseen."""

MOST_IMPACTS = 200
"""Impacts that one substep resolves one by one; beyond, what is left of it is a discrete step. Balls that rattle
between others in ever shorter time would else never end it."""


def resting(stage: Stage, h: float) -> IntArray:
    """Return the keys of pairs that touch already and close slowly, ascending: the discrete stage sees to them."""
    x = stage.x
    reach = NEAR * 2.0 * stage.finder.widest
    contacts = stage.finder.manifolds(x[0], stage.finder.candidates(x[0], reach), reach)
    distance = contacts.arm.sum(axis=1)
    still = (contacts.separation <= NEAR * distance) & (stage.closing(contacts, x) * h < SLOW * distance)
    return np.asarray(contacts.key[still])


def fresh(stage: Stage, x: State, rest: IntArray, gentle: float) -> Manifolds:
    """Return the contacts of a state that are new: overlapping, none of the resting ones, closing faster than gently.

    What closes gently came to rest: bounces smaller than a step can show would go on without an end.
    """
    contacts = stage.overlaps(x)
    if not contacts.size:
        return contacts
    return contacts.of(_new(contacts, rest) & (stage.closing(contacts, x) > gentle))


def lasting(stage: Stage, x: State, rest: IntArray, clash: Manifolds) -> Manifolds:
    """Return the contacts of a state that were resting ones before, apart from those of the clash."""
    if not len(rest):
        return clash.of(slice(0))
    contacts = stage.overlaps(x)
    return contacts.of(~_new(contacts, rest) & _new(contacts, clash.key))


def gathered(stage: Stage, x: State, clash: Manifolds) -> Manifolds:
    """Return the points of an impact, and those at which the same bodies touch in a state but for rounding.

    The corners of a box that falls flat meet the ground at one time, of which rounding makes several. Solved one after
    the other, the first would turn the box.
    """
    if isinstance(stage.finder, BallFinder):
        return clash
    reach = NEAR * 2.0 * stage.finder.widest
    contacts = stage.finder.manifolds(x[0], stage.finder.candidates(x[0], reach), reach)
    pairs = set(zip(clash.first.tolist(), clash.second.tolist(), strict=True))
    same = [pair in pairs for pair in zip(contacts.first.tolist(), contacts.second.tolist(), strict=True)]
    found = contacts.of(np.asarray(same, np.bool_))
    return found if np.isin(clash.key, found.key).all() else clash  # so fast that a halved step still is beyond reach


def _new(contacts: Manifolds, rest: IntArray) -> BoolArray:
    return np.asarray(~np.isin(contacts.key, rest, assume_unique=True))
