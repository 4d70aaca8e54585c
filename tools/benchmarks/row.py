"""A row of the benchmarks: the timed workload, its peer, and the claim."""

from collections.abc import Callable
from typing import NamedTuple

from tools.benchmarks.workloads import Timed


class Bench(NamedTuple):
    """A row: our workload, the peer, and the claimed target."""

    name: str
    about: str
    ours: Callable[[], Timed]
    peer: Callable[[], Timed]
    target: float | None = None
    """largest ratio, or for `above` largest difference in seconds; for a rate, the smallest value of ours"""
    unit: str = "s"
    above: bool = False
    """whether the result is the difference of ours and the peer, not their ratio"""
    rate: bool = False
    """whether both sides return amounts per second"""
    missing: Callable[[], str | None] | None = None
    """returns the reason why an optional peer is not installed, or None; with a reason the row is skipped"""
    same: Callable[[], None] | None = None
    """asserts that both sides compute the same; None if they differ by design: another method, less physics, or a
    process that is only started"""
