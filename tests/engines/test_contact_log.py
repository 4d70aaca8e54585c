"""The sums of a lasting contact do not depend on how the log records it or when rows are taken."""

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.engines.common.contact_log import ContactBatch, ContactLog
from sandbox.trajectory import Contacts

PAIRS = ((0, -1), (1, -1), (0, 1), (1, 2), (-2, 2))  # static shapes first or second, as engines list them


class Interval(NamedTuple):
    """Contacts of one or several substeps, the impulse of each contact, and whether rows are taken meanwhile."""

    pairs: tuple[int, ...]
    impulses: tuple[complex, ...]
    substeps: int
    taken: bool


def intervals() -> st.SearchStrategy[list[Interval]]:
    speeds = st.floats(-1e3, 1e3)
    impulses = st.lists(st.builds(complex, speeds, speeds), min_size=len(PAIRS), max_size=len(PAIRS)).map(tuple)
    pairs = st.lists(st.integers(0, len(PAIRS) - 1), max_size=4).map(tuple)
    return st.lists(st.builds(Interval, pairs, impulses, st.integers(1, 4), st.booleans()), min_size=1, max_size=8)


def record_contacts(script: list[Interval], joints: bool, impulses_only: bool) -> list[Contacts]:
    """Return the rows that a log gives if contacts are recorded in full or, where allowed, by impulses only."""
    log, found, time = ContactLog(2, joints), [], 0.0
    for pairs, impulses, substeps, taken in script:
        each = [PAIRS[k] for k in pairs]
        a, b = (np.asarray([pair[k] for pair in each], np.int64) for k in (0, 1))
        points = np.arange(len(each), dtype=np.complex128)
        for k in range(substeps):
            time += 0.25
            impulse = np.asarray([impulses[n] * (k + 1.0) / 3.0 for n in pairs], np.complex128)
            if impulses_only and k and log.has_distinct_rows:
                log.add_impulses(impulse)
            else:
                log.record(time, ContactBatch(a, b, impulse, points + 1.0, points))
            if taken and k == 1:
                found.append(log.take())
    return [*found, log.take()]


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize("joints", [False, True])
@given(intervals())
def test_impulses_only_records_are_bit_identical_to_full_records(joints: bool, script: list[Interval]) -> None:
    if not joints:  # each pair then occurs once
        script = [interval._replace(pairs=tuple(dict.fromkeys(interval.pairs))) for interval in script]
    for full, short in zip(record_contacts(script, joints, False), record_contacts(script, joints, True), strict=True):
        for column in ("time", "pair", "point", "normal", "impulse"):
            np.testing.assert_array_equal(getattr(full, column), getattr(short, column))


def test_lasting_contact_is_one_row_with_the_summed_impulse() -> None:
    script = [Interval((0, 2), (1.0 + 2.0j,) * len(PAIRS), 4, False)]
    (found,) = record_contacts(script, False, True)
    assert found.pair.tolist() == [[0, -1], [0, 1]]
    # (1 + 2 + 3 + 4)/3 of the impulse, from the first of each pair to the second
    np.testing.assert_allclose(found.impulse, [[-10.0 / 3.0, -20.0 / 3.0]] * 2, rtol=1e-15)


@given(st.lists(st.integers(0, len(PAIRS) - 1), min_size=1, max_size=6), st.integers(1, 5), st.integers(0, 2**32 - 1))
def test_batches_of_repeated_pairs_are_bit_identical_to_records(pairs: list[int], substeps: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b = (np.asarray([PAIRS[k][side] for k in pairs], np.int64) for side in (0, 1))

    def contacts(count: int) -> ContactBatch:
        vectors = (rng.normal(size=(len(a) * count, 2)) @ (1.0, 1j) for _ in range(3))
        return ContactBatch(np.tile(a, count), np.tile(b, count), *vectors)

    first, lasting, last = contacts(1), contacts(substeps), contacts(1)
    found = []
    for at_once in (False, True):
        log = ContactLog(2, can_repeat_pairs=True)
        log.record(0.0, first)
        if at_once:
            log.add_batches(lasting, substeps)
        else:
            for k in range(substeps):
                some = slice(k * len(a), (k + 1) * len(a))
                log.record(0.1 * (k + 1), ContactBatch(*(column[some] for column in lasting)))
        log.add_impulses(last.impulse)
        found.append(log.take())
    one, other = found
    for name in ("time", "pair", "point", "normal", "impulse"):
        assert getattr(one, name).tobytes() == getattr(other, name).tobytes(), name
