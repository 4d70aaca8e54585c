"""Delta debugging: what it returns holds, and lacks nothing that could be left out alone."""

from hypothesis import given
from hypothesis import strategies as st

from sandbox.measure.compare.reduce import ddmin


@given(st.integers(1, 60), st.sets(st.integers(0, 59), max_size=8))
def test_what_needs_some_items_is_left_with_these(count: int, wanted: set[int]) -> None:
    needed = {item for item in wanted if item < count}
    assert ddmin(range(count), lambda kept: needed <= set(kept)) == tuple(sorted(needed))


@given(st.integers(1, 12), st.randoms(use_true_random=False))
def test_nothing_can_be_left_out_alone_whatever_is_asked(count: int, random: object) -> None:
    answers: dict[tuple[int, ...], bool] = {tuple(range(count)): True}
    asked = 0

    def holds(kept: tuple[int, ...]) -> bool:
        nonlocal asked
        asked += 1
        return answers.setdefault(kept, random.random() < 0.2)

    kept = ddmin(range(count), holds)
    assert asked <= count**2 + 3 * count + 1  # Zeller and Hildebrandt's worst case, and the question for nothing
    assert answers[kept]
    if len(kept) > 1:
        assert not any(holds(kept[:k] + kept[k + 1 :]) for k in range(len(kept)))


def test_one_of_many_is_found_in_few_questions() -> None:
    asked = []
    assert ddmin(range(1024), lambda kept: asked.append(kept) or 700 in kept) == (700,)
    assert len(asked) <= 2 * 10 + 1


def test_nothing_is_left_where_nothing_is_needed() -> None:
    assert ddmin("abc", lambda _: True) == ()
