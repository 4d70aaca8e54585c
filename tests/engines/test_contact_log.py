"""What a contact that lasts is summed to does not hang on how the log is told of it, nor on when it is taken."""

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.engines.common.contact_log import ContactBatch, ContactLog
from sandbox.trajectory import Contacts

PAIRS = ((0, -1), (1, -1), (0, 1), (1, 2), (-2, 2))  # fixed things first or second, as engines list them


class Moment(NamedTuple):
    """What touches in one substep or several, and what each is given in each of them."""

    pairs: tuple[int, ...]
    given: tuple[complex, ...]
    lasts: int
    taken: bool


def moments() -> st.SearchStrategy[list[Moment]]:
    speeds = st.floats(-1e3, 1e3)
    given = st.lists(st.builds(complex, speeds, speeds), min_size=len(PAIRS), max_size=len(PAIRS)).map(tuple)
    pairs = st.lists(st.integers(0, len(PAIRS) - 1), max_size=4).map(tuple)
    return st.lists(st.builds(Moment, pairs, given, st.integers(1, 4), st.booleans()), min_size=1, max_size=8)


def told(script: list[Moment], joints: bool, quickly: bool) -> list[Contacts]:
    """Return what a log tells: told anew of all that touches, or where it may be of the impulses alone."""
    log, found, time = ContactLog(2, joints), [], 0.0
    for pairs, given_to, lasts, taken in script:
        each = [PAIRS[k] for k in pairs]
        a, b = (np.asarray([pair[k] for pair in each], np.int64) for k in (0, 1))
        places = np.arange(len(each), dtype=np.complex128)
        for k in range(lasts):
            time += 0.25
            impulse = np.asarray([given_to[n] * (k + 1.0) / 3.0 for n in pairs], np.complex128)
            if quickly and k and log.steady:
                log.add_impulses(impulse)
            else:
                log.record(time, ContactBatch(a, b, impulse, places + 1.0, places))
            if taken and k == 1:
                found.append(log.take())
    return [*found, log.take()]


@pytest.mark.parametrize("joints", [False, True])
@settings(max_examples=200)
@given(moments())
def test_impulses_alone_add_up_to_the_same_bit_by_bit(joints: bool, script: list[Moment]) -> None:
    if not joints:  # a pair then shows once
        script = [moment._replace(pairs=tuple(dict.fromkeys(moment.pairs))) for moment in script]
    for slow, quick in zip(told(script, joints, False), told(script, joints, True), strict=True):
        for column in ("time", "pair", "point", "normal", "impulse"):
            np.testing.assert_array_equal(getattr(slow, column), getattr(quick, column))


def test_contact_that_lasts_is_one_row_with_all_it_gave() -> None:
    script = [Moment((0, 2), (1.0 + 2.0j,) * len(PAIRS), 4, False)]
    (found,) = told(script, False, True)
    assert found.pair.tolist() == [[0, -1], [0, 1]]
    # 1/3 + 2/3 + 3/3 + 4/3 of what is given; by the first of each pair to the second
    np.testing.assert_allclose(found.impulse, [[-10.0 / 3.0, -20.0 / 3.0]] * 2, rtol=1e-15)
