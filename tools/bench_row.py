"""A row of the benchmarks: what is timed of ours, against what, and what is claimed."""

from collections.abc import Callable
from typing import NamedTuple

from workloads import Timed


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
    """Says why the peer is not to be had, where it may not be; the row is then left out, and that is told."""
