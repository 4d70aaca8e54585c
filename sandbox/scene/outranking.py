"""Outranking: what a scene states itself comes before what a preset writes into it."""

from collections.abc import Iterable, Sequence
from typing import Any, TypeVar

from sandbox.scene.model import Pair
from sandbox.scene.part import Part

Stated = TypeVar("Stated", bound=Part)


def stated(part: Stated, values: dict[str, Any]) -> Stated:
    """Return a part with values for what it does not state itself."""
    return part.model_copy(update={key: value for key, value in values.items() if key not in part.model_fields_set})


def added(own: Sequence[Any], more: Sequence[Any]) -> tuple[Any, ...]:
    """Return a scene's own things, and more that have other names."""
    taken = {each.name for each in own}
    return (*own, *(each for each in more if each.name not in taken))


def paired(own: Sequence[Pair], more: Iterable[Pair]) -> tuple[Pair, ...]:
    """Return a scene's own pairs of materials, and more that are between others."""
    taken = {frozenset(pair.between) for pair in own}
    return (*own, *(pair for pair in more if frozenset(pair.between) not in taken))
