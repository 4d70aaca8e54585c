import numpy as np

from sandbox.measure.missed_contacts.contact_history import ContactHistory

PAIRS = np.array([[3, 7], [0, -1], [999_999, -1_000_000], [5, 6]])


def test_a_pair_is_found_at_its_own_look_only():
    looks = ContactHistory()
    looks.add(PAIRS[:2])
    looks.add(PAIRS[2:])
    when = np.array([0, 1, 0, 1])
    assert looks.found(when, PAIRS[[0, 0, 2, 2]]).tolist() == [True, False, False, True]


def test_nothing_is_found_at_a_look_without_contacts():
    looks = ContactHistory()
    looks.add(np.empty((0, 2), np.int64))
    assert looks.found(np.zeros(4, np.int64), PAIRS).tolist() == [False] * 4


def test_neighbouring_numbers_are_not_taken_for_each_other():
    looks = ContactHistory()
    looks.add(np.array([[1, 0], [0, 5]]))
    asked = np.array([[0, 1], [1, -1], [0, 4], [0, 6], [0, 5]])
    assert looks.found(np.zeros(5, np.int64), asked).tolist() == [False] * 4 + [True]


def test_the_last_look_is_kept_and_what_was_added_is_a_copy():
    looks, pairs = ContactHistory(), PAIRS.copy()
    looks.add(PAIRS[:1])
    looks.add(pairs)
    pairs[:] = 0
    looks.forget()
    assert len(looks) == 1
    assert looks.found(np.zeros(4, np.int64), PAIRS).all()
