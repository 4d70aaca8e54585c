"""Filters of pymunk's shapes as keys of a scene: `collides`, or `categories` and `mask`.

A filter has 32 bits of categories and 32 of a mask. Only the relation that they state counts: which kinds of shapes can
collide with which. Where the values of `collides` cannot state it, the bits become named categories.
"""

from collections.abc import Mapping, Set
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import pymunk

from sandbox.engines.common.collision_bits import KINDS
from sandbox.engines.pymunk_adapter.engine import FILTER_BITS
from sandbox.scene.description.base import Collides

MAX_CATEGORIES = FILTER_BITS // KINDS
"""Largest number of collision categories of a scene with one layer that the engine `pymunk` can filter."""


class FilterKind(NamedTuple):
    """Which shapes a shape can collide with, apart from its group."""

    is_static: bool
    categories: int
    mask: int

    @classmethod
    def of(cls, shape: pymunk.Shape) -> Self:
        """Return the kind of a shape in a space."""
        assert shape.body is not None
        return cls(shape.body.body_type == pymunk.Body.STATIC, shape.filter.categories, shape.filter.mask)

    def meets(self, other: "FilterKind") -> bool:
        """Return whether shapes of two kinds can collide."""
        can_move = not (self.is_static and other.is_static)
        return can_move and bool(self.categories & other.mask and other.categories & self.mask)


@dataclass(frozen=True)
class SceneFilters:
    """Keys of a scene for each kind of shapes of a space."""

    values: Mapping[FilterKind, Mapping[str, Any]]
    """`collides`, or `categories` and `mask`; without any of them, it collides with all"""
    has_too_many_categories: bool = False
    """whether the engine could not filter by all categories, which are therefore left out"""

    @classmethod
    def of(cls, kinds: Set[FilterKind]) -> Self:
        """Return the keys for the kinds of shapes of a space."""
        collides = collides_by_filter(kinds)
        if None not in collides.values():
            return cls({kind: {} if each == "all" else {"collides": each} for kind, each in collides.items()})
        named = categories_by_filter(kinds)
        if len({name for lists in named.values() for names in lists for name in names}) > MAX_CATEGORIES:
            return cls({kind: {} for kind in kinds}, has_too_many_categories=True)
        return cls(
            {
                kind: {"categories": categories, "mask": mask}
                | ({"collides": "none"} if collides[kind] == "none" else {})
                for kind, (categories, mask) in named.items()
            }
        )


def collides_by_filter(kinds: Set[FilterKind]) -> dict[FilterKind, Collides | None]:
    """Return what each kind of shapes of a space collides with, as a scene states it; None if it cannot.

    Two bodies of a scene collide if both collide with all, or if one is static and the other collides with something.
    Other filters need categories.
    """
    static, moving = {kind for kind in kinds if kind.is_static}, {kind for kind in kinds if not kind.is_static}
    found: dict[FilterKind, Collides | None] = {}
    for kind in moving:
        meets = {other for other in kinds if kind.meets(other)}
        if not meets:
            found[kind] = "none"
        elif meets == static:
            found[kind] = "fixed"
        else:
            found[kind] = "all"
    free = {kind for kind in moving if found[kind] == "all"}
    for kind in free:
        if {other for other in kinds if kind.meets(other)} != static | free:
            found[kind] = None
    wanted = {kind for kind in moving if found[kind] != "none"}
    return found | {kind: "all" if all(kind.meets(other) for other in wanted) else None for kind in static}


def categories_by_filter(kinds: Set[FilterKind]) -> dict[FilterKind, tuple[list[str], list[str]]]:
    """Return the categories and the mask of each kind of shapes, as names.

    Bits that the same kinds have in their categories, and the same in their masks, are one category. It is called by
    the number of the first of these bits. Bits that no kind collides with, or none has, are left out.
    """
    ordered = sorted(kinds)
    names: dict[tuple[tuple[bool, ...], tuple[bool, ...]], str] = {}
    for bit in range(32):
        members = tuple(bool(kind.categories >> bit & 1) for kind in ordered)
        seekers = tuple(bool(kind.mask >> bit & 1) for kind in ordered)
        if any(members) and any(seekers):
            names.setdefault((members, seekers), f"bit {bit}")
    return {
        kind: (
            [name for (members, _), name in names.items() if members[k]],
            [name for (_, seekers), name in names.items() if seekers[k]],
        )
        for k, kind in enumerate(ordered)
    }
