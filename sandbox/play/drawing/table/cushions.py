"""Cushions: the outlines of a table's rubber, worked out from walls, jaws and facings; in metres, no pygame.

A cushion is a wall along an edge of the playing area. At each end it may be rounded by a jaw, a post that touches it
where it ends, and go on along a facing, a wall that touches the same jaw.
"""

import math
from typing import NamedTuple

from sandbox.play.camera import Box
from sandbox.scene.description.base import Point, Vector
from sandbox.scene.description.fixed import Post, Wall
from sandbox.scene.scene import Scene

DEPTH = 0.036
"""of a table's width, from the nose of a cushion to the wood"""
RIM = 0.115
"""likewise, to the outside of the wood"""
TOUCH = 1e-6
"""m: what is nearer touches"""
ARC = math.radians(6.0)
"""from point to point of a jaw"""


class Cushion(NamedTuple):
    """One piece of rubber."""

    outline: tuple[Point, ...]
    """all around, m"""
    nose: tuple[Point, ...]
    """the part of it that balls meet, m"""
    out: Vector
    """away from the playing area"""


def width_of(area: Box) -> float:
    """Return the shorter side of a playing area, m."""
    (left, bottom), (right, top) = area
    return min(right - left, top - bottom)


def outside(area: Box) -> Box:
    """Return the box of a whole table, with its wood, m."""
    rim = RIM * width_of(area)
    (left, bottom), (right, top) = area
    return (left - rim, bottom - rim), (right + rim, top + rim)


def cushions(scene: Scene, area: Box) -> tuple[Cushion, ...]:
    """Return the cushions of a table, as far as its fixed things are such."""
    depth = DEPTH * width_of(area)
    noses = {k: out for k, wall in enumerate(scene.walls) if (out := _out(wall, area)) is not None}
    facings = [wall for k, wall in enumerate(scene.walls) if k not in noses and len(wall.points) == 2]
    return tuple(_cushion(scene.walls[k], out, scene, facings, depth) for k, out in noses.items())


def others(scene: Scene, area: Box) -> tuple[tuple[Wall, ...], tuple[Post, ...]]:
    """Return the walls and posts that are no part of the cushions."""
    noses = [(wall, out) for wall in scene.walls if (out := _out(wall, area)) is not None]
    jaws = [jaw for wall, out in noses for end in wall.points if (jaw := _jaw(end, out, scene)) is not None]
    known = [wall for wall, _ in noses] + [
        wall for wall in scene.walls if len(wall.points) == 2 and any(_from_jaw(wall, jaw) for jaw in jaws)
    ]
    walls = tuple(wall for wall in scene.walls if not any(wall is each for each in known))
    return walls, tuple(post for post in scene.posts if not any(post is each for each in jaws))


def _jaw(end: Point, out: Vector, scene: Scene) -> Post | None:
    """Return the post that a nose touches where it ends."""
    return next((post for post in scene.posts if math.dist(post.position, _moved(end, out, post.radius)) < TOUCH), None)


def _out(wall: Wall, area: Box) -> Vector | None:
    """Return the way out of the area, of a wall along one of its edges."""
    if len(wall.points) != 2 or wall.closed:
        return None
    (left, bottom), (right, top) = area
    (ax, ay), (bx, by) = wall.points
    for edge, a, b, out in (
        (left, ax, bx, (-1.0, 0.0)),
        (right, ax, bx, (1.0, 0.0)),
        (bottom, ay, by, (0.0, -1.0)),
        (top, ay, by, (0.0, 1.0)),
    ):
        if abs(a - edge) < TOUCH and abs(b - edge) < TOUCH:
            return out
    return None


def _cushion(wall: Wall, out: Vector, scene: Scene, facings: list[Wall], depth: float) -> Cushion:
    a, b = wall.points
    length = max(math.dist(a, b), TOUCH)
    along = (b[0] - a[0]) / length, (b[1] - a[1]) / length
    back = -along[0], -along[1]
    first, last = _end(a, back, out, scene, facings, depth), _end(b, along, out, scene, facings, depth)
    nose = (*reversed(first), *last)
    height = [(x - a[0]) * out[0] + (y - a[1]) * out[1] for x, y in (nose[0], nose[-1])]
    corners = [_moved(nose[-1], out, max(depth - height[1], 0.0)), _moved(nose[0], out, max(depth - height[0], 0.0))]
    if len(last) == 1:  # no jaw: it meets the next cushion in a mitre
        corners[0] = _moved(corners[0], along, depth)
    if len(first) == 1:
        corners[1] = _moved(corners[1], back, depth)
    return Cushion((*nose, *corners), nose, out)


def _end(end: Point, along: Vector, out: Vector, scene: Scene, facings: list[Wall], depth: float) -> tuple[Point, ...]:
    """Return the points from where a nose ends around its jaw and along its facing."""
    jaw = _jaw(end, out, scene)
    if jaw is None:
        return (end,)
    facing = next((ends for wall in facings if (ends := _from_jaw(wall, jaw)) is not None), None)
    if facing is not None:
        x, y = facing[0][0] - jaw.position[0], facing[0][1] - jaw.position[1]
        turn = math.atan2(x * along[0] + y * along[1], -(x * out[0] + y * out[1]))
    else:
        turn = math.acos(max(1.0 - depth / jaw.radius, 0.0))
    points = [end]
    count = max(math.ceil(turn / ARC), 1)
    for k in range(1, count + 1):
        cos, sin = math.cos(turn * k / count), math.sin(turn * k / count)
        here = _moved(_moved(jaw.position, out, -jaw.radius * cos), along, jaw.radius * sin)
        if any(math.dist(here, hole.position) < hole.radius for hole in scene.pockets):
            break
        points.append(here)
    return (*points, facing[1]) if facing is not None else tuple(points)


def _from_jaw(wall: Wall, jaw: Post) -> tuple[Point, Point] | None:
    """Return the ends of a wall that begins on a jaw and leaves it straight, the one on the jaw first."""
    for near, far in (wall.points, wall.points[::-1]):
        x, y = near[0] - jaw.position[0], near[1] - jaw.position[1]
        leaves = abs(x * (far[0] - near[0]) + y * (far[1] - near[1])) < TOUCH
        if leaves and abs(math.hypot(x, y) - jaw.radius) < TOUCH:
            return near, far
    return None


def _moved(point: Point, way: Vector, distance: float) -> Point:
    return point[0] + way[0] * distance, point[1] + way[1] * distance
