"""Names of contacts in Munk2D, which clash for the first shapes of a space.

Munk2D numbers the shapes of a space from 0 in the order of `add`, and names a contact by a hash of the numbers of both
shapes and of their corners (`CP_HASH_PAIR` in cpCollision.c). The hash is symmetric: where the corners of two edges
have the same numbers as the two shapes, both contacts of the edges have the name 0, and start from the impulse of one
of them. If the ground is the first shape of a space and a box from its lower left corner (`pymunk.Poly`) the second, a
stack of boxes leans and falls. A number that no corner has clashes with none.
"""

from collections.abc import Sequence
from itertools import combinations

from sandbox.engines.common.colliders import wall_segments
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import BodySource
from sandbox.scene.description.bodies import Compound
from sandbox.scene.description.fixed import Post, Wall


def is_captured(element: BodySource) -> bool:
    """Return whether a body may be captured from a space: with its centre of mass and its first corners.

    Its polygons start at their first corners, and not where pymunk starts a hull, and its shapes have their numbers in
    that space, so that the scene continues the motion to the same bits.
    """
    return isinstance(element, Compound) and element.centre_of_mass is not None


def numbers_to_skip(bodies: Bodies) -> int:
    """Return how many numbers of shapes to skip, so that no names clash; 0 for bodies captured from a space."""
    if bodies.all_round or any(map(is_captured, bodies.elements)):
        return 0
    return int(bodies.shapes.corners.max())


def clashing_pairs(number: Sequence[int], corners: Sequence[int]) -> set[tuple[int, int]]:
    """Return pairs of shapes, by index, of which both contacts of two edges can have one name.

    Each has an edge between the corners that have the numbers of the two shapes.

    Args:
        number: (K,) numbers of the shapes in their space.
        corners: (K,) counts of corners: 1 of a circle, 2 of a segment.
    """
    able = [k for k, n in enumerate(number) if n < corners[k]]
    return {
        (a, b)
        for a, b in combinations(able, 2)
        if all(_is_edge(number[a], number[b], corners[shape]) for shape in (a, b))
    }


def _is_edge(first: int, second: int, corners: int) -> bool:
    """Return whether an edge connects two corners of a shape, by their numbers."""
    low, high = sorted((first, second))
    return high < corners and high - low in (1, corners - 1)


def confused_elements(scene: Scene) -> list[tuple[str, str]]:
    """Return pairs of elements captured from a space of which both contacts of two edges can have one name."""
    bodies = scene.bodies
    if bodies.all_round or numbers_to_skip(bodies):
        return []
    static, corners = list[str](), list[int]()  # walls and posts, and then bodies, in the order of `add`
    for collider, name in zip(scene.fixed, scene.fixed_names, strict=True):
        count = len(list(wall_segments(collider))) if isinstance(collider, Wall) else 1
        static += [name] * count
        corners += [1 if isinstance(collider, Post) else 2] * count
    names = static + [bodies.names[k] for k in bodies.shapes.body.tolist()]
    corners += bodies.shapes.corners.tolist()
    moves = [False] * len(static) + (~bodies.fixed[bodies.shapes.body]).tolist()
    pairs = [(a, b) for a, b in sorted(clashing_pairs(range(len(names)), corners)) if moves[a] or moves[b]]
    return list(dict.fromkeys((names[a], names[b]) for a, b in pairs if names[a] != names[b]))
