"""Repeats: fixed things that stand in one place many times over.

A tree of bounding boxes, which most engines have, cannot part boxes that are equal: adding n of them takes n² steps.
"""

import math
from collections import Counter
from collections.abc import Iterator
from itertools import pairwise

from sandbox.scene.faults import Location
from sandbox.scene.model import Ball, Plane, Scene, Single, Wall
from sandbox.scene.part import Point
from sandbox.scene.shapes import form_of

MAX_REPEATS = 5_000
"""Equal shapes; half a second."""

Key = tuple[float | str, ...]


def repeats(scene: Scene) -> list[tuple[Location, str]]:
    """Return a fault for every fixed thing that is one too many of its like."""
    found: list[tuple[Location, str]] = []
    seen: Counter[Key] = Counter()
    for location, key in _shapes(scene):
        seen[key] += 1
        if seen[key] == MAX_REPEATS + 1:
            found.append((location, f"this is in one place more than {MAX_REPEATS:,} times; state it once"))
    return found


def _shapes(scene: Scene) -> Iterator[tuple[Location, Key]]:
    for k, plane in enumerate(scene.planes):
        yield ("plane", k), _plane(plane)
    for k, wall in enumerate(scene.walls):
        for n, segment in enumerate(_segments(wall)):
            yield ("wall", k, "points", n), segment
    for k, post in enumerate(scene.posts):
        yield ("post", k), _disc(post.position, post.radius)
    for kind, those in scene.kinds.items():
        for k, single in enumerate(those):
            if isinstance(single, Single) and single.fixed and single.collides != "none":
                for key in _boxes(single):
                    yield (kind, k), key


def _disc(position: Point, radius: float) -> Key:
    return "disc", *position, radius


def _boxes(single: Single) -> Iterator[Key]:
    """Yield the bounding box of each piece of a fixed body: boxes that are equal are not told apart."""
    if isinstance(single, Ball):
        yield _disc(single.position, single.radius)
        return
    cos, sin = math.cos(single.angle), math.sin(single.angle)
    form = form_of(single)
    x, y = form.centre
    for piece in form.pieces:
        corners = [(a + x, b + y) for a, b in piece.corners]
        xs = [single.position[0] + cos * a - sin * b for a, b in corners]
        ys = [single.position[1] + sin * a + cos * b for a, b in corners]
        r = piece.radius
        yield "box", *(round(each, 9) for each in (min(xs) - r, max(xs) + r, min(ys) - r, max(ys) + r))


def _plane(plane: Plane) -> Key:
    """Return a plane's direction and its distance from the origin: its point may be any of its points."""
    length = math.hypot(*plane.normal)
    x, y = (component / length for component in plane.normal) if length > 0 else plane.normal
    return "plane", round(x, 9), round(y, 9), round(x * plane.point[0] + y * plane.point[1], 9)


def _segments(wall: Wall) -> Iterator[Key]:
    ends = (*wall.points, wall.points[0]) if wall.closed else wall.points
    for a, b in pairwise(ends):
        low, high = sorted((a, b))
        yield "segment", *low, *high, wall.thickness
