"""Merging of rectangles that share a whole side: tiles of a map, and static boxes of a drawing.

Bodies would stop at the seams between them.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

from sandbox.levels.scene_text import LevelBlock


class TileRectangle(NamedTuple):
    """A rectangle with sides along the axes, in the units of a map, y down."""

    x: float
    y: float
    width: float
    height: float


def merge_rectangles(rectangles: Iterable[TileRectangle]) -> list[TileRectangle]:
    """Return rectangles of which neighbours with a whole side in common are merged: rows first, then equal rows.

    A flat floor becomes one rectangle, so that bodies do not catch on seams. Rectangles of different width in the rows
    of a vertical face keep seams there. Takes O(n log n) time.
    """
    rows = _merged_along(sorted(set(rectangles), key=lambda r: (r.y, r.height, r.x, r.width)), 0)
    return sorted(_merged_along(sorted(rows, key=lambda r: (r.x, r.width, r.y, r.height)), 1), key=lambda r: (r.y, r.x))


def _merged_along(ordered: Sequence[TileRectangle], axis: int) -> list[TileRectangle]:
    """Return rectangles with neighbours along an axis merged; those of one strip follow each other in order."""
    merged: list[TileRectangle] = []
    across = 1 - axis
    for each in ordered:
        last = merged[-1] if merged else None
        if (
            last is not None
            and (last[across], last[across + 2]) == (each[across], each[across + 2])
            and each[axis] <= last[axis] + last[axis + 2]  # they touch, or overlap
        ):
            end = max(last[axis] + last[axis + 2], each[axis] + each[axis + 2])
            size = end - last[axis]
            merged[-1] = last._replace(width=size) if axis == 0 else last._replace(height=size)
        else:
            merged.append(each)
    return merged


STEP = 1e-4
"""User units to which edges of boxes are rounded before they are compared; a hundred times the rounding of boxes."""


class MergedBoxes(NamedTuple):
    """Blocks of a level after a merge."""

    blocks: list[LevelBlock]
    merged: list[list[LevelBlock]]
    """the blocks of each new box; it has the name and the element of the first"""


def merge_boxes(blocks: Sequence[LevelBlock], scale: float) -> MergedBoxes:
    """Merge upright static boxes with a whole side in common and equal values otherwise.

    Args:
        blocks: blocks of a level.
        scale: m for each user unit.
    """
    groups: dict[str, list[LevelBlock]] = {}
    for block in blocks:
        if block.table == "box" and block.values.get("fixed") and not block.values.keys() & {"angle", "radius"}:
            others = {key: value for key, value in block.values.items() if key not in ("name", "position", "size")}
            groups.setdefault(repr(sorted(others.items())), []).append(block)
    result, replaced = list(blocks), dict[int, LevelBlock | None]()
    merged = []
    for group in groups.values():
        for members, values in _merged(group, STEP * scale):
            first = members[0]
            replaced |= {id(each): None for each in members} | {id(first): first._replace(values=first.values | values)}
            merged.append(members)
    if merged:
        kept = (replaced.get(id(block), block) for block in blocks)
        result = [block for block in kept if block is not None]
    return MergedBoxes(result, merged)


def _merged(group: Sequence[LevelBlock], step: float) -> Iterator[tuple[list[LevelBlock], dict[str, Any]]]:
    """Yield the members of each new box, and its position and size, m."""
    rectangles = [_rectangle(block, step) for block in group]
    for whole in set(merge_rectangles(rectangles)).difference(rectangles):
        members = [block for block, part in zip(group, rectangles, strict=True) if _contains(whole, part)]
        x, y, width, height = (each * step for each in whole)
        yield members, {"position": _rounded(x + 0.5 * width, y + 0.5 * height), "size": _rounded(width, height)}


def _rectangle(block: LevelBlock, step: float) -> TileRectangle:
    """Return the rectangle of a box, in steps."""
    edges = []
    for middle, size in zip(block.values["position"], block.values["size"], strict=True):
        edges.append((round((middle - 0.5 * size) / step), round((middle + 0.5 * size) / step)))
    (left, right), (low, high) = edges
    return TileRectangle(left, low, right - left, high - low)


def _rounded(x: float, y: float) -> tuple[float, float]:
    """Return a pair of multiples of half a step without the rounding errors of the product."""
    return float(f"{x:.12g}"), float(f"{y:.12g}")


def _contains(whole: TileRectangle, part: TileRectangle) -> bool:
    return all(
        whole[axis] <= part[axis] and part[axis] + part[axis + 2] <= whole[axis] + whole[axis + 2] for axis in (0, 1)
    )
