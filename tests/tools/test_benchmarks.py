"""Benchmarks: both sides of a row compute the same; sides take turns; result of a row."""

import itertools

import pytest

from tools.benchmarks.__main__ import measure
from tools.benchmarks.row import Bench
from tools.benchmarks.suite import BENCHES

CHECKED = {bench.same: bench for bench in BENCHES if bench.same is not None}
"""One row per check function: rows that differ only in size have the same one."""


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize("bench", CHECKED.values(), ids=lambda bench: bench.name)
def test_both_sides_of_a_row_compute_the_same(bench: Bench) -> None:
    assert bench.same is not None
    bench.same()  # asserts


def test_names_of_rows_are_unique() -> None:
    assert len({bench.name for bench in BENCHES}) == len(BENCHES)


@pytest.mark.fail_slow(60)  # takes over half a second
def test_sides_take_turns_and_the_first_alternates() -> None:
    order: list[str] = []

    def side(name: str, *seconds: float):
        values = itertools.chain((9.0,), seconds)  # the first value is for the warm-up

        def work() -> float:
            order.append(name)
            return next(values)

        return lambda: work

    row = measure(
        Bench("a", "", side("ours", 1.0, 2.0, 3.0), side("peer", 4.0, 4.0, 5.0), same=lambda: order.append("same")), 3
    )
    assert order == ["same", "ours", "peer", "ours", "peer", "peer", "ours", "ours", "peer"]
    assert (row["ours"], row["peer"], row["ratio"]) == (2.0, 4.0, 0.5)
    assert (row["ours_spread"], row["spread"]) == (2.0, 0.25)


def test_sides_that_differ_are_not_timed() -> None:
    def differ() -> None:
        raise AssertionError("positions differ")

    def timed() -> float:
        raise RuntimeError("timed")

    with pytest.raises(AssertionError, match="positions differ"):
        measure(Bench("a", "", lambda: timed, lambda: timed, same=differ), 1)
