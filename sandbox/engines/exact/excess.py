"""Excess: what to say of more events than are bearable."""

from collections.abc import Sequence

from sandbox.engines.exact.advance import TOO_DENSE
from sandbox.engines.exact.arena import AT_INSTANT, BALL, FLAT, IN_SECOND, KNOB, NOW, THING, WHAT, WHO, WITH, Arena


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
    number, span = (counts[AT_INSTANT], "an instant") if status == TOO_DENSE else (counts[IN_SECOND], "one second")
    return (
        f"at {float(arena.world[NOW]):.9g} s: more than {int(number) - 1:,} events within {span}, last of {who}; "
        "engines that step could go on: pymunk, reference"
    )
