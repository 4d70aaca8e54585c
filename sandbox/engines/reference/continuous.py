"""Continuous collision detection: steps that end at the time of impact. DETECTIONS is the table of all detections.

Each detection advances a world by h in one or more steps, by the verbs of `step`.

`bisect` finds the time of impact by bisection (the tutorial's example 5). If a step ends with a new overlap, the latest
time without overlap is found, the impact is resolved there, and the rest of the step follows. It finds the time of an
impact and not whether there is one: as with `discrete`, a body tunnels that has passed an obstacle at the end of the
step.

`bisect` and `swept` need an accurate integrator: explicit Euler gains a speed of g·h in each free flight, which
discrete detection happens to remove. With these two it remains, and a bouncing ball keeps a speed of at least e·g·h/(1
− e).

`swept` computes the time of impact of circles in closed form, on the straight line of each centre in a step. Nothing
tunnels at any speed. Paths under gravity are curved; they differ from the line by at most g·h²/8, so that the error of
impact times is of second order.

`shrink` divides the step until all displacements are small, the tutorial's remedy against tunnelling. No body moves
more than half the smallest radius in a piece, so that an overlap is found before a centre has crossed an obstacle. The
fastest body determines the number of pieces for all.
"""

from collections.abc import Iterator

import numpy as np

from sandbox.arrays import BoolArray, IntArray
from sandbox.engines.contract import Exhaustion
from sandbox.engines.reference.collision import CirclePipeline
from sandbox.engines.reference.integrators import State
from sandbox.engines.reference.manifold import Manifolds
from sandbox.engines.reference.step import Detection, StepRecord, WorldState, discrete, step
from sandbox.engines.reference.velocity_solver import Motion
from sandbox.resource_limits import STEP_PIECES

TOUCHING = 1e-6
"""Separation, as a fraction of the contact distance, below which a pair touches: far above the error of bisection, 1e-9
of a step"""

MAX_RESTING_APPROACH = 0.5
"""Approach in a step, as a fraction of the contact distance, below which a pair cannot tunnel"""

MAX_IMPACTS = 200
"""Number of impacts in a substep that are resolved one by one; the rest of the substep is then one discrete step. It
bounds the work for balls that bounce between others at ever shorter intervals."""


def resting_pairs(world: WorldState, h: float) -> IntArray:
    """Return the keys of pairs that touch and close slowly, ascending. The discrete step handles them."""
    x = world.x
    max_separation = TOUCHING * 2.0 * world.pipeline.max_radius
    contacts = world.pipeline.manifolds(x[0], world.pipeline.candidates(x[0], max_separation), max_separation)
    distance = contacts.rn.sum(axis=1)
    still = (contacts.separation <= TOUCHING * distance) & (
        world.closing_speed(contacts, x) * h < MAX_RESTING_APPROACH * distance
    )
    return np.asarray(contacts.key[still])


def new_contacts(world: WorldState, motion: Motion, resting: IntArray, resting_speed: float) -> Manifolds:
    """Return the new contacts at the end of a motion: not resting before, and closing faster than `resting_speed`, m/s.

    Slower ones have come to rest. Otherwise a series of ever smaller bounces would not end (Zeno behaviour).
    """
    contacts = world.solver.detect(motion)
    if not contacts.size:
        return contacts
    return contacts.of(_is_new(contacts, resting) & (world.closing_speed(contacts, motion.placed) > resting_speed))


def persistent_contacts(world: WorldState, motion: Motion, resting: IntArray, colliding: Manifolds) -> Manifolds:
    """Return the resting contacts at the end of a motion, without those of the impact."""
    if not len(resting):
        return colliding.of(slice(0))
    contacts = world.solver.detect(motion)
    return contacts.of(~_is_new(contacts, resting) & _is_new(contacts, colliding.key))


def simultaneous_contacts(world: WorldState, x: State, colliding: Manifolds) -> Manifolds:
    """Return the contacts of an impact, and those at which the same pairs touch up to rounding.

    The corners of a box that lands flat touch the ground at the same time, up to rounding. If they were solved one
    after the other, the first impact would turn the box.
    """
    if isinstance(world.pipeline, CirclePipeline):
        return colliding
    max_separation = TOUCHING * 2.0 * world.pipeline.max_radius
    contacts = world.pipeline.manifolds(x[0], world.pipeline.candidates(x[0], max_separation), max_separation)
    pairs = set(zip(colliding.first.tolist(), colliding.second.tolist(), strict=True))
    same = [pair in pairs for pair in zip(contacts.first.tolist(), contacts.second.tolist(), strict=True)]
    found = contacts.of(np.asarray(same, np.bool_))
    return (
        found if np.isin(colliding.key, found.key).all() else colliding
    )  # too fast: the remaining separation exceeds the tolerance


def _is_new(contacts: Manifolds, resting: IntArray) -> BoolArray:
    return np.asarray(~np.isin(contacts.key, resting, assume_unique=True))


BISECTION_TOLERANCE = 1e-9
"""Error of the time of impact as a fraction of the step: 30 halvings"""


def bisect(world: WorldState, h: float) -> Iterator[StepRecord]:
    """Advance from impact to impact; each is resolved at the latest time without new overlap."""
    left, resting_speed = h, world.resting_speed(h)
    for _ in range(MAX_IMPACTS):
        resting = resting_pairs(world, left)
        colliding = new_contacts(world, world.integrate(left), resting, resting_speed)
        if not colliding.size:
            break
        low, high = 0.0, left
        while high - low > BISECTION_TOLERANCE * h:
            middle = 0.5 * (low + high)
            found = new_contacts(world, world.integrate(middle), resting, resting_speed)
            if found.size:
                colliding, high = found, middle
            else:
                low = middle
        motion = world.integrate(low)
        colliding = simultaneous_contacts(world, motion.placed, colliding)
        yield world.impact(motion, persistent_contacts(world, motion, resting, colliding), colliding, low)
        left -= low
    yield step(world, left)


def shrink(world: WorldState, h: float) -> Iterator[StepRecord]:
    """Advance in pieces, each as long as the largest possible displacement allows.

    Raises:
        Exhaustion: the substep would have more pieces than its share of the limit of one step.
    """
    left, pieces, limit = h, 0, STEP_PIECES.value // world.substeps
    while left > 0.0:
        pieces_needed = _max_displacement(world, left) / (0.5 * world.pipeline.min_radius)
        if not pieces_needed < limit - pieces:
            reason = f"a substep would be divided into {pieces_needed:.3g} parts; the limit is {limit:,}"
            remedy = STEP_PIECES.remedy((pieces_needed + pieces) * world.substeps)
            raise Exhaustion(f"{reason}; other detections need fewer; {remedy}")
        piece = left / pieces_needed if pieces_needed > 1.0 else left
        yield step(world, piece)
        left = left - piece if piece < left else 0.0
        pieces += 1


def _max_displacement(world: WorldState, h: float) -> float:
    """Return a bound, m, for the displacement of any body in h, s.

    The speeds at both ends count too, because a body that rises and falls back in h has moved without a displacement.
    """
    pipeline, x, moved = world.pipeline, world.x, world.integrate(h).placed
    still = np.zeros_like(x[1])
    displacements = (x[0], moved[0]), (still, h * x[1]), (still, h * moved[1])
    return max(pipeline.max_displacement(start, end) for start, end in displacements)


def swept(world: WorldState, h: float) -> Iterator[StepRecord]:
    """Advance from one time of impact to the next. Slow contacts come to rest and are solved by the discrete step."""
    pipeline = world.pipeline
    assert isinstance(pipeline, CirclePipeline)  # the engine refuses this detection for polygons
    left, resting_speed = h, world.resting_speed(h)
    resting = resting_pairs(world, left)
    for _ in range(MAX_IMPACTS):
        fraction, key = pipeline.first_touch(world.x[0], world.integrate(left).placed[0], resting)
        if key < 0:
            break
        motion = world.integrate(fraction * left)
        contact = pipeline.pair_manifold(motion.placed[0], key)
        if world.closing_speed(contact, motion.placed)[0] <= min(
            resting_speed, MAX_RESTING_APPROACH * contact.rn.sum() / left
        ):
            resting = np.union1d(resting, [key])
            continue
        persistent = persistent_contacts(world, motion, resting, contact)
        yield world.impact(motion, persistent, contact, fraction * left)
        left -= fraction * left
        if left <= 0.0:  # the impact is at the end of the step
            return
        resting = resting_pairs(world, left)
    yield step(world, left)


DETECTIONS: dict[str, Detection] = {
    "discrete": discrete,
    "bisect": bisect,
    "swept": swept,
    "shrink": shrink,
}
