"""Continuous collision detection: steps that end at the time of impact. DETECTIONS is the table of all detections.

Each advances a world by h, in steps of its own, from the verbs of `step`.

`bisect` rewinds and halves the step until the time of impact is found (the tutorial's example 5). A step that ends with
a new overlap is taken back. The last time at which nothing overlaps yet is found by bisection, the impact is resolved
there, and the rest of the step begins anew. It finds when something was hit, not whether: a body that is through before
the end of the step is not seen, as with `discrete`.

Impacts in time need accurate flights: explicit Euler gains g·h of speed in each, which discrete detection happens to
remove again. With `bisect` and `swept` it stays, and a bouncing ball never falls below e·g·h/(1 − e).

`swept` computes the time of impact of circles in closed form, along the straight line that each centre moves in a step.
Nothing is passed unseen, however fast. Paths under gravity are curved; the line differs by g·h²/8 at most, so that
impacts are second order in time.

`shrink` cuts the step until no displacement is large, the tutorial's remedy against tunnelling. No body moves more than
half the smallest radius in a piece, so that none passes through another, or a wall, unseen: the centre is never across
before the overlap shows. All bodies pay the price for the fastest.
"""

from collections.abc import Iterator

import numpy as np

from sandbox.arrays import BoolArray, IntArray
from sandbox.engines.contract import Exhaustion
from sandbox.engines.reference.collision import CirclePipeline
from sandbox.engines.reference.integrators import State
from sandbox.engines.reference.manifold import Manifolds
from sandbox.engines.reference.step import Detection, StepRecord, WorldState, discrete, step
from sandbox.resource_limits import STEP_PIECES

NEAR = 1e-6
"""A pair nearer than this part of its contact distance touches: far above what bisection leaves (1e-9 of a step)."""

SLOW = 0.5
"""What closes by less than this part of its contact distance in a step cannot pass unseen."""

MAX_IMPACTS = 200
"""Impacts that one substep resolves one by one; the rest of the substep is then one discrete step. It bounds the work
for balls that rattle between others in ever shorter time."""


def resting(world: WorldState, h: float) -> IntArray:
    """Return the keys of pairs that touch already and close slowly, ascending: they are left to the discrete step."""
    x = world.x
    reach = NEAR * 2.0 * world.pipeline.widest
    contacts = world.pipeline.manifolds(x[0], world.pipeline.candidates(x[0], reach), reach)
    distance = contacts.arm.sum(axis=1)
    still = (contacts.separation <= NEAR * distance) & (world.closing_speed(contacts, x) * h < SLOW * distance)
    return np.asarray(contacts.key[still])


def new_contacts(world: WorldState, x: State, rest: IntArray, slow: float) -> Manifolds:
    """Return the contacts of a state that are new: overlapping, not resting before, closing faster than `slow`, m/s.

    Slower ones have come to rest: bounces smaller than a step can show would never end.
    """
    contacts = world.solver.detect(x)
    if not contacts.size:
        return contacts
    return contacts.of(_is_new(contacts, rest) & (world.closing_speed(contacts, x) > slow))


def lasting_contacts(world: WorldState, x: State, rest: IntArray, clash: Manifolds) -> Manifolds:
    """Return the contacts of a state that rested before, without those of the clash."""
    if not len(rest):
        return clash.of(slice(0))
    contacts = world.solver.detect(x)
    return contacts.of(~_is_new(contacts, rest) & _is_new(contacts, clash.key))


def simultaneous_contacts(world: WorldState, x: State, clash: Manifolds) -> Manifolds:
    """Return the points of an impact, and those at which the same bodies touch in a state but for rounding.

    The corners of a box that falls flat meet the ground at one time, of which rounding makes several. Solved one after
    the other, the first would turn the box.
    """
    if isinstance(world.pipeline, CirclePipeline):
        return clash
    reach = NEAR * 2.0 * world.pipeline.widest
    contacts = world.pipeline.manifolds(x[0], world.pipeline.candidates(x[0], reach), reach)
    pairs = set(zip(clash.first.tolist(), clash.second.tolist(), strict=True))
    same = [pair in pairs for pair in zip(contacts.first.tolist(), contacts.second.tolist(), strict=True)]
    found = contacts.of(np.asarray(same, np.bool_))
    return found if np.isin(clash.key, found.key).all() else clash  # so fast that a halved step still is beyond reach


def _is_new(contacts: Manifolds, rest: IntArray) -> BoolArray:
    return np.asarray(~np.isin(contacts.key, rest, assume_unique=True))


EPSILON = 1e-9
"""How near to the impact bisection comes, as a part of the step: 30 halvings."""


def bisect(world: WorldState, h: float) -> Iterator[StepRecord]:
    """Advance from impact to impact, each to the last time at which nothing overlaps anew within EPSILON·h."""
    left, slow = h, world.resting_speed(h)
    for _ in range(MAX_IMPACTS):
        rest = resting(world, left)
        clash = new_contacts(world, world.advance(left).placed, rest, slow)
        if not clash.size:
            break
        low, high = 0.0, left
        while high - low > EPSILON * h:
            middle = 0.5 * (low + high)
            found = new_contacts(world, world.advance(middle).placed, rest, slow)
            if found.size:
                clash, high = found, middle
            else:
                low = middle
        motion = world.advance(low)
        clash = simultaneous_contacts(world, motion.placed, clash)
        yield world.impact(motion, lasting_contacts(world, motion.placed, rest, clash), clash, low)
        left -= low
    yield step(world, left)


def shrink(world: WorldState, h: float) -> Iterator[StepRecord]:
    """Advance in pieces, each as long as the largest possible displacement allows.

    Raises:
        Exhaustion: the substep would take more than its part of the pieces that one step may have.
    """
    left, pieces, limit = h, 0, STEP_PIECES.value // world.substeps
    while left > 0.0:
        needed = _max_displacement(world, left) / (0.5 * world.pipeline.thinnest)
        if not needed < limit - pieces:
            reason = f"a substep would be divided into {needed:.3g} parts; the limit is {limit:,}"
            remedy = STEP_PIECES.remedy((needed + pieces) * world.substeps)
            raise Exhaustion(f"{reason}; other detections need fewer; {remedy}")
        piece = left / needed if needed > 1.0 else left
        yield step(world, piece)
        left = left - piece if piece < left else 0.0
        pieces += 1


def _max_displacement(world: WorldState, h: float) -> float:
    """Return a bound, m, for the displacement of any body in h, s.

    The speeds at both ends count too: a body that is thrown up and falls back has moved, and is where it was.
    """
    pipeline, x, moved = world.pipeline, world.x, world.advance(h).placed
    still = np.zeros_like(x[1])
    displacements = (x[0], moved[0]), (still, h * x[1]), (still, h * moved[1])
    return max(pipeline.max_displacement(start, end) for start, end in displacements)


def swept(world: WorldState, h: float) -> Iterator[StepRecord]:
    """Advance from one first touch to the next; slow contacts come to rest, and are left to the discrete step."""
    pipeline = world.pipeline
    assert isinstance(pipeline, CirclePipeline)  # for polygons the engine refuses this detection
    left, slow = h, world.resting_speed(h)
    rest = resting(world, left)
    for _ in range(MAX_IMPACTS):
        fraction, key = pipeline.first_touch(world.x[0], world.advance(left).placed[0], rest)
        if key < 0:
            break
        motion = world.advance(fraction * left)
        contact = pipeline.only(motion.placed[0], key)
        if world.closing_speed(contact, motion.placed)[0] <= min(slow, SLOW * contact.arm.sum() / left):
            rest = np.union1d(rest, [key])
            continue
        lasting = lasting_contacts(world, motion.placed, rest, contact)
        yield world.impact(motion, lasting, contact, fraction * left)
        left -= fraction * left
        if left <= 0.0:  # the impact is at the end of the step
            return
        rest = resting(world, left)
    yield step(world, left)


DETECTIONS: dict[str, Detection] = {
    "discrete": discrete,
    "bisect": bisect,
    "swept": swept,
    "shrink": shrink,
}
