"""Excess: what to say of more events than are bearable."""

from collections.abc import Sequence

from sandbox.engines.exact.advance import BATCHES, RUSH, TOO_DENSE, TOO_FAST
from sandbox.engines.exact.arena import (
    AT_INSTANT,
    BALL,
    BUDGET,
    FLAT,
    IN_SECOND,
    KNOB,
    NOW,
    THING,
    WHAT,
    WHO,
    WITH,
    Arena,
)


def too_many(arena: Arena, names: Sequence[str], fixed_names: Sequence[str], status: int) -> str:
    """Say when there were too many events, how many, and whose the last was.

    Args:
        arena: as it was left.
        names: of the bodies.
        fixed_names: of the fixed things.
        status: what `advance` returned.
    """
    counts = arena.counts
    kind, partner = int(counts[WHAT]), int(counts[WITH])
    who = repr(names[counts[WHO]])
    if kind == BALL:
        who += f" and {names[partner]!r}"
    elif kind in (FLAT, KNOB):
        thing = (arena.flat_tags if kind == FLAT else arena.knob_tags)[partner, THING]
        who += f" and {fixed_names[thing]!r}"
    budget = int(counts[BUDGET])
    if status == TOO_FAST:
        number, span = 2 * budget // BATCHES, 2.0 / (RUSH * BATCHES)
        many = f"{number:,} events within {span:.3g} s where {budget:,} a second are allowed"
    elif status == TOO_DENSE:
        many = f"more than {int(counts[AT_INSTANT]) - 1:,} events within an instant"
    else:
        many = f"more than {int(counts[IN_SECOND]) - 1:,} events within one second"
    return (
        f"at {float(arena.world[NOW]):.9g} s: {many}, last of {who}; engines that step could go on: pymunk, reference"
    )
