"""Hold: how a support lets go of a ball, and what it does to its velocity."""

from sandbox.engines.exact.arena import (
    FORCE,
    LIGHTNESS,
    ROW,
    SUPPORT,
    VX,
    VY,
    Arena,
)
from sandbox.engines.exact.booking import book_velocity
from sandbox.engines.exact.log import add_impulse
from sandbox.engines.kernel import bare_kernel as kernel

REST_TIME = 1e-13
"""s: when what is left of a series of bounces takes less, the ball rests; it is as if they had all been made."""


@kernel
def release(arena: Arena, i: int, which: int) -> None:
    """End a support; the second of two becomes the first."""
    if which == 0:
        arena.tags[i, SUPPORT], arena.tags[i, ROW] = arena.tags[i, SUPPORT + 1], arena.tags[i, ROW + 1]
    arena.tags[i, SUPPORT + 1], arena.tags[i, ROW + 1] = -1, -1
    arena.state[i, FORCE + 2], arena.state[i, FORCE + 3] = 0.0, 0.0


@kernel
def freed(arena: Arena, i: int) -> None:
    """End all of a ball's supports, whose impulses are logged."""
    release(arena, i, 0)
    release(arena, i, 0)


@kernel
def keep(arena: Arena, i: int, which: int, vx: float, vy: float) -> None:
    """Set a ball's velocity to what its supports leave of it, and log the little that this changes."""
    state, im = arena.state, arena.state[i, LIGHTNESS]
    add_impulse(arena, arena.tags[i, ROW + which], (state[i, VX] - vx) / im, (state[i, VY] - vy) / im)
    book_velocity(arena, i, vx, vy)
    state[i, VX], state[i, VY] = vx, vy
