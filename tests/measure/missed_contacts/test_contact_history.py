import numpy as np

from sandbox.measure.missed_contacts.contact_history import ContactHistory

PAIRS = np.array([[3, 7], [0, -1], [999_999, -1_000_000], [5, 6]])


def test_pair_is_found_in_its_own_step_only():
    history = ContactHistory()
    history.add(PAIRS[:2])
    history.add(PAIRS[2:])
    when = np.array([0, 1, 0, 1])
    assert history.found(when, PAIRS[[0, 0, 2, 2]]).tolist() == [True, False, False, True]


def test_no_pair_is_found_in_a_step_without_contacts():
    history = ContactHistory()
    history.add(np.empty((0, 2), np.int64))
    assert history.found(np.zeros(4, np.int64), PAIRS).tolist() == [False] * 4


def test_pairs_with_adjacent_indices_are_distinguished():
    history = ContactHistory()
    history.add(np.array([[1, 0], [0, 5]]))
    pairs = np.array([[0, 1], [1, -1], [0, 4], [0, 6], [0, 5]])
    assert history.found(np.zeros(5, np.int64), pairs).tolist() == [False] * 4 + [True]


def test_forget_keeps_the_last_step_and_add_copies_its_pairs():
    history, pairs = ContactHistory(), PAIRS.copy()
    history.add(PAIRS[:1])
    history.add(pairs)
    pairs[:] = 0
    history.forget()
    assert len(history) == 1
    assert history.found(np.zeros(4, np.int64), PAIRS).all()
