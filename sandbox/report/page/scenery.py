"""Scenery: what a replay draws besides motion: shapes, fixed things, joints, as JSON about an origin of its own."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from sandbox.arrays import IntArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.joint_arrays import LinkKind
from sandbox.scene.geometry.shapes import form_of
from sandbox.scene.scene import Scene

MOST_LINKS = 5000
"""Joints drawn."""
MOST_NAMES = 8
"""Bodies up to which each bears its name."""
DRAWN = {
    LinkKind.ROD: "rod",
    LinkKind.SLIDE: "string",
    LinkKind.GROOVE: "rod",
    LinkKind.SPRING: "spring",
    LinkKind.PIVOT: "pivot",
}
"""Joints that can be seen, and how each looks."""


def scenery_of(scene: Scene, drawn: IntArray, origin: tuple[float, float]) -> dict[str, Any]:
    """Return shapes, fixed things and joints.

    Args:
        scene: of what.
        drawn: numbers of the bodies that a replay draws; joints name them by their places in it.
        origin: subtracted from every place, m, so that what is far out keeps its digits.
    """
    bodies = scene.bodies
    used, kind = np.unique(bodies.element[drawn], return_inverse=True)
    return {
        "forms": [[_piece(p.corners, p.radius) for p in form_of(bodies.elements[k]).pieces] for k in used.tolist()],
        "kind": kind.tolist(),
        "names": [bodies.names[k] for k in drawn.tolist()] if len(drawn) <= MOST_NAMES else [],
        "planes": [
            [*_moved(plane.point, origin), *(np.asarray(plane.normal) / np.hypot(*plane.normal)).tolist()]
            for plane in scene.planes
        ],
        "walls": [
            {
                "points": [_moved(point, origin) for point in wall.points],
                "thickness": wall.thickness,
                "closed": wall.closed,
            }
            for wall in scene.walls
            if wall.solid
        ],
        "posts": [[*_moved(post.position, origin), post.radius] for post in scene.posts if post.solid],
        "pockets": [[*_moved(pocket.position, origin), pocket.radius] for pocket in scene.pockets],
        "solids": _solids(bodies, origin),
        "attractions": [_moved(a.toward, origin) for a in scene.attractions if not isinstance(a.toward, str)],
        "links": _links(scene, drawn, origin),
    }


def _piece(corners: Sequence[tuple[float, float]], radius: float) -> list[float]:
    """Return a piece's radius and its corners, one after the other."""
    return [radius, *(_short(value) for corner in corners for value in corner)]


def _solids(bodies: Bodies, origin: tuple[float, float]) -> list[list[Any]]:
    """Return the pieces of fixed bodies, each with its place and angle."""
    return [
        [*_moved(bodies.position[n].tolist(), origin), float(bodies.angle[n]), _piece(piece.corners, piece.radius)]
        for n in np.flatnonzero(bodies.fixed).tolist()
        for piece in form_of(bodies.elements[bodies.element[n]]).pieces
    ]


def _links(scene: Scene, drawn: IntArray, origin: tuple[float, float]) -> list[list[Any]]:
    """Return what is seen of joints: number, look, first and second body, and where each is held.

    A body is its place among those drawn, −1 the world; a joint of a body that is not drawn is left out, and one to a
    fixed body is held by the world.
    """
    links, bodies = scene.links, scene.bodies
    place = np.full(len(bodies) + 1, -2)
    place[drawn] = np.arange(len(drawn))
    place[-1] = -1
    found = []
    ends = links.ends(bodies.position, bodies.angle)
    for k in np.flatnonzero(np.isin(links.kind, list(DRAWN)))[:MOST_LINKS].tolist():
        row: list[Any] = [int(links.number[k]), DRAWN[LinkKind(int(links.kind[k]))]]
        held = []
        for number, anchor, end in (
            (links.a[k], links.anchor_a[k], ends[0][k]),
            (links.b[k], links.anchor_b[k], ends[1][k]),
        ):
            if number < 0 or bodies.fixed[number]:
                row.append(-1)
                held += _moved(end.tolist(), origin)
            else:
                row.append(int(place[number]))
                held += [_short(value) for value in anchor.tolist()]
        if -2 not in row[2:4] and row[2:4] != [-1, -1]:
            found.append([*row, *held])
    return found


def _moved(point: Sequence[float], origin: tuple[float, float]) -> list[float]:
    return [_short(point[0] - origin[0]), _short(point[1] - origin[1])]


def _short(value: float) -> float:
    """Return a length to seven digits, far finer than any screen."""
    return float(f"{value:.7g}")
