"""Delta debugging: the result satisfies the predicate, and no single item of it can be removed."""

from hypothesis import given
from hypothesis import strategies as st

from sandbox.measure.compare.reduce import ddmin


@given(st.integers(1, 60), st.sets(st.integers(0, 59), max_size=8))
def test_ddmin_returns_exactly_the_needed_items(count: int, wanted: set[int]) -> None:
    needed = {item for item in wanted if item < count}
    assert ddmin(range(count), lambda kept: needed <= set(kept)) == tuple(sorted(needed))


@given(st.integers(1, 12), st.randoms(use_true_random=False))
def test_no_single_item_of_the_result_can_be_removed_for_any_predicate(count: int, random: object) -> None:
    answers: dict[tuple[int, ...], bool] = {tuple(range(count)): True}
    calls = 0

    def holds(kept: tuple[int, ...]) -> bool:
        nonlocal calls
        calls += 1
        return answers.setdefault(kept, random.random() < 0.2)

    kept = ddmin(range(count), holds)
    assert calls <= count**2 + 3 * count + 1  # worst case of Zeller and Hildebrandt, and the call for the empty set
    assert answers[kept]
    if len(kept) > 1:
        assert not any(holds(kept[:k] + kept[k + 1 :]) for k in range(len(kept)))


def test_single_needed_item_of_many_is_found_in_few_calls() -> None:
    calls = []
    assert ddmin(range(1024), lambda kept: calls.append(kept) or 700 in kept) == (700,)
    assert len(calls) <= 2 * 10 + 1
