"""A row of the benchmarks: the work timed, its peer, and the claim."""

from collections.abc import Callable
from typing import NamedTuple

from tools.benchmarks.workloads import Timed


class Bench(NamedTuple):
    """A row: ours, the peer, and what is claimed."""

    name: str
    about: str
    ours: Callable[[], Timed]
    peer: Callable[[], Timed]
    target: float | None = None
    """the ratio, or for `above` the seconds, that may not be exceeded; for a rate, what ours must reach"""
    unit: str = "s"
    above: bool = False
    """Ours is what exceeds the peer, not its whole."""
    rate: bool = False
    """Ours and the peer return how much they did in a second; the target is what ours must reach."""
    missing: Callable[[], str | None] | None = None
    """Returns the reason why an optional peer is not installed, or None; the row is then left out, with that reason."""
    same: Callable[[], None] | None = None
    """Asserts that both sides compute the same. None where they differ by design: another method, less physics, or a
    process that is only started."""
