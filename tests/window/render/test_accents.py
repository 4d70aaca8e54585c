"""Accents stay with their elements while a scene is edited."""

from collections import Counter
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from sandbox.scene.description.base import BodySource
from sandbox.scene.description.bodies import Box
from sandbox.scene.description.discs import Ball
from sandbox.window.render.accents import AccentNumbers
from sandbox.window.render.palette import ACCENTS

Item = tuple[int, BodySource]
"""Identity and present values of an element."""


def made(number: int, is_box: bool, is_named: bool) -> Item:
    common: dict[str, Any] = {"position": (float(number), 0.0), "name": f"body-{number}" if is_named else None}
    return number, Box(size=(1.0, 1.0), **common) if is_box else Ball(radius=0.5, **common)


def in_order(items: list[Item]) -> list[Item]:
    """Return elements as a scene has them: balls before boxes."""
    return sorted(items, key=lambda item: isinstance(item[1], Box))


STEPS = st.lists(
    st.tuples(st.sampled_from(("add", "delete", "edit", "rename", "swap", "undo")), st.integers(0, 99)), max_size=20
)


@given(st.lists(st.tuples(st.booleans(), st.booleans()), max_size=12), STEPS)
def test_each_element_keeps_its_accent_through_any_edits(
    kinds: list[tuple[bool, bool]], steps: list[tuple[str, int]]
) -> None:
    accents, count, history = AccentNumbers(), len(kinds), list[list[Item]]()
    items = in_order([made(k, *kind) for k, kind in enumerate(kinds)])
    numbers = accents.update([element for _, element in items])
    assert list(numbers) == list(range(len(items)))
    of = {identity: number for (identity, _), number in zip(items, numbers, strict=True)}
    for step, argument in steps:
        if step != "undo":
            history.append(list(items))
        k = argument % max(len(items), 1)
        if step == "undo":
            items = history.pop() if history else items
        elif step == "add" or not items:
            # The editor names what it adds. Without an earlier element there is nothing to be compared with.
            items, count = in_order([*items, made(count, argument % 2 == 0, is_named=True)]), count + 1
        elif step == "delete":
            del items[k]
        elif step == "edit":
            moved = {"position": (float(argument), 1.0 + len(history))}
            items[k] = items[k][0], items[k][1].model_copy(update=moved)
        elif step == "rename":
            items[k] = items[k][0], items[k][1].model_copy(update={"name": f"renamed-{len(history)}"})
        elif items[k - 1 :] and type(items[k - 1][1]) is type(items[k][1]):
            items[k - 1], items[k] = items[k], items[k - 1]
        numbers = accents.update([element for _, element in items])
        for (identity, _), number in zip(items, numbers, strict=True):
            assert of.setdefault(identity, number) == number, (step, argument)


def test_new_elements_have_the_rarest_accents() -> None:
    accents, items = AccentNumbers(), list[BodySource]()
    for number in range(3 * len(ACCENTS)):
        items = [
            element for _, element in in_order([(0, each) for each in [*items, made(number, number % 3 == 0, True)[1]]])
        ]
        found = Counter(number % len(ACCENTS) for number in accents.update(items))
        assert max(found.values()) - min(found.get(k, 0) for k in range(len(ACCENTS))) <= 1
    accents.clear()
    assert accents.update(items) == tuple(range(len(items)))
