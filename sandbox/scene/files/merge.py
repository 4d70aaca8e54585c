"""Merging of the values of a preset with those stated in the scene, which take precedence."""

from collections.abc import Iterable, Sequence
from typing import Any, TypeVar

from sandbox.scene.description.base import Part
from sandbox.scene.description.world import Pair

Stated = TypeVar("Stated", bound=Part)


def stated(part: Stated, values: dict[str, Any]) -> Stated:
    """Return a part with values for the keys that it does not state itself."""
    return part.model_copy(update={key: value for key, value in values.items() if key not in part.model_fields_set})


def added(own: Sequence[Any], more: Sequence[Any]) -> tuple[Any, ...]:
    """Return the scene's own elements, and those of a preset that have other names."""
    taken = {each.name for each in own}
    return (*own, *(each for each in more if each.name not in taken))


def paired(own: Sequence[Pair], more: Iterable[Pair]) -> tuple[Pair, ...]:
    """Return the scene's own pairs of materials, and those of a preset for other pairs."""
    taken = {frozenset(pair.between) for pair in own}
    return (*own, *(pair for pair in more if frozenset(pair.between) not in taken))
