"""Data of a replay: quantised tracks, static geometry and the viewport.

A coordinate is rounded to 1/65534 of the side of a square, an angle to 1/65536 of a turn. Stored are second
differences along time, which are small for smooth motion, low bytes apart from high ones, deflated.
"""

import base64
import math
import zlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.joint_arrays import JointKind
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.fixed import Plane, Post, Wall
from sandbox.scene.geometry.shapes import geometry_of

ABSENT = 65535
"""Code in x of a body that is absent or outside the square."""
LEVELS = 65534
"""Steps along the side of the square; the code 65535 is `ABSENT`."""
Codes = npt.NDArray[np.uint16]


@dataclass(frozen=True)
class QuantisationBox:
    """The square of the world in which positions are encoded, m."""

    x: float
    y: float
    """lower left corner"""
    side: float

    @property
    def step(self) -> float:
        """Resolution of the coordinates, m; the rounding error is at most half of it."""
        return self.side / LEVELS


def encode_positions(position: FloatArray, present: BoolArray, box: QuantisationBox) -> Codes:
    """Return positions as numbers of steps from the corner of the square; `ABSENT` in x where a body is not visible.

    Args:
        position: (F, N, 2), m; nan where a body is absent.
        present: (F, N) false where a body is absent although it has a position.
        box: the square.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        steps = np.rint((position - (box.x, box.y)) / box.step)
        is_visible = present & ((steps >= 0.0) & (steps <= LEVELS)).all(axis=2)  # false for nan
    words = np.where(is_visible[..., None], steps, 0.0).astype(np.uint16)
    words[..., 0][~is_visible] = ABSENT
    return words


def encode_angles(angle: FloatArray) -> Codes:
    """Return angles, rad, in units of 1/65536 of a turn; 0 for angles that are not finite."""
    with np.errstate(invalid="ignore"):
        parts = np.rint(np.mod(angle, 2.0 * math.pi) * (65536.0 / (2.0 * math.pi)))
    return np.asarray(np.where(np.isfinite(parts), parts, 0.0).astype(np.int64) & 0xFFFF, dtype=np.uint16)


def compress(words: Codes) -> str:
    """Return codes (F, …), a row for each frame, as text: second differences, deflated, in base 64."""
    signed = words.astype(np.int64)
    signed[1:] -= words[:-1].astype(np.int64)
    second = signed.copy()
    second[2:] -= signed[1:-1]
    second[1:2] = signed[1:2]
    flat = (second & 0xFFFF).astype("<u2").reshape(-1)
    planes = np.concatenate(((flat & 0xFF).astype(np.uint8), (flat >> 8).astype(np.uint8)))
    return base64.b64encode(zlib.compress(planes.tobytes(), 9)).decode("ascii")


def decompress(text: str, shape: tuple[int, ...]) -> Codes:
    """Return the codes of a text from `compress`; `replay.js` has the same function.

    Raises:
        ValueError: the text holds another number of codes.
    """
    planes = np.frombuffer(zlib.decompress(base64.b64decode(text)), np.uint8).astype(np.uint16)
    half = len(planes) // 2
    if len(planes) % 2 or half != math.prod(shape):
        raise ValueError(f"{half} codes, not {shape}")
    words = (planes[:half] | planes[half:] << 8).reshape(shape)
    if len(words) > 1:
        words[1:] = np.cumsum(words[1:], axis=0, dtype=np.uint16)
    return np.cumsum(words, axis=0, dtype=np.uint16)


MIN_TRIMMED_BODIES = 1000
"""From this number of moving bodies on, the viewport leaves out the outermost positions."""
OUTLIERS = 0.5
"""Positions left out at each side, percent."""
MAX_COORDINATE = 1e15
"""Positions beyond it, m, are ignored: differences of larger numbers lose a metre to rounding."""
MAX_STATIC_DISTANCE = 0.6
"""Static geometry is shown up to this distance from the moving bodies, as a fraction of the size of their region."""
MARGIN = 0.06
"""Free space around the shown region, as a fraction of its size."""
ENCODED_RATIO = 3.0
"""Side of the encoded square, in sizes of the viewport: space for zooming out and panning."""
ANCHORED = (JointKind.ROD, JointKind.PIVOT, JointKind.SLIDE, JointKind.GROOVE, JointKind.SPRING)

Bounds = tuple[float, float, float, float]
"""left, bottom, right, top, m"""


def viewport(scene: Scene, paths: Iterable[FloatArray]) -> Bounds:
    """Return the part of the world to show: the region of the moving bodies, and static geometry near it.

    Args:
        scene: scene of the bodies.
        paths: positions (T, N, 2), m, of all its bodies; nan is ignored.
    """
    bodies = scene.bodies
    found = [each for path in paths if (each := _around(path, bodies)) is not None]
    start = _around(bodies.position[None], bodies, everything=True)
    if start is not None and not found:
        found = [start]
    static = list(_static_bounds(scene))
    if not found:
        found = static or [np.asarray(((-1.0, -1.0), (1.0, 1.0)))]
    low, high = np.min([each[0] for each in found], axis=0), np.max([each[1] for each in found], axis=0)
    reach = MAX_STATIC_DISTANCE * max(float((high - low).max()), 1e-12)
    for corners in static:
        if (corners[0] <= high + reach).all() and (corners[1] >= low - reach).all():
            inside = np.clip(corners, low - reach, high + reach)
            low, high = np.minimum(low, inside[0]), np.maximum(high, inside[1])
    for plane in scene.planes:
        normal = np.asarray(plane.normal) / np.hypot(*plane.normal)
        middle = 0.5 * (low + high)
        foot = middle - ((middle - np.asarray(plane.point)) @ normal) * normal
        if (foot >= low - reach).all() and (foot <= high + reach).all():
            low, high = np.minimum(low, foot), np.maximum(high, foot)
    size = float((high - low).max())
    if not size > 0.0:
        size = 2.0
        low, high = low - 1.0, high + 1.0
    low, high = low - MARGIN * size, high + MARGIN * size
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def quantisation_box(box: Bounds) -> QuantisationBox:
    """Return the square in which a replay encodes positions: the viewport, and as much on each side of it."""
    left, bottom, right, top = box
    side = ENCODED_RATIO * max(right - left, top - bottom)
    return QuantisationBox(0.5 * (left + right) - 0.5 * side, 0.5 * (bottom + top) - 0.5 * side, side)


def _around(path: FloatArray, bodies: Bodies, everything: bool = False) -> FloatArray | None:
    """Return lower left and upper right corner (2, 2), m, of the region of the moving bodies; None without one."""
    selected = np.ones(len(bodies), np.bool_) if everything else ~bodies.fixed
    size = int(selected.sum())
    # For a long path, some of the frames suffice.
    positions = path[:: max(1, len(path) * size // 500_000), selected]
    with np.errstate(invalid="ignore"):
        counts = (np.abs(positions) < MAX_COORDINATE).all(axis=2)
    points, radii = positions[counts], np.broadcast_to(bodies.radius[selected], counts.shape)[counts][:, None]
    if not len(points):
        return None
    if size > MIN_TRIMMED_BODIES:
        typical = float(np.median(radii))
        low, high = np.percentile(points, (OUTLIERS, 100.0 - OUTLIERS), axis=0)
        return np.asarray((low - typical, high + typical))
    return np.asarray(((points - radii).min(axis=0), (points + radii).max(axis=0)))


def _static_bounds(scene: Scene) -> Iterator[FloatArray]:
    """Yield the bounding boxes (2, 2), m, of walls, posts, static bodies, centres of attraction and joint anchors."""
    for thing in scene.fixed:
        if isinstance(thing, Wall):
            points = np.asarray(thing.points)
            yield np.asarray((points.min(axis=0), points.max(axis=0))) + 0.5 * thing.thickness * SIDES
        elif isinstance(thing, Post):
            yield np.asarray(thing.position) + thing.radius * SIDES
        else:
            assert isinstance(thing, Plane)  # unbounded; `viewport` treats it separately
    bodies, joints = scene.bodies, scene.joint_arrays
    for number in np.flatnonzero(bodies.fixed).tolist():
        yield bodies.position[number] + bodies.radius[number] * SIDES
    for each in scene.attractions:
        if not isinstance(each.toward, str):
            yield np.asarray((each.toward, each.toward))
    anchors = joints.anchor_a[(joints.a < 0) & np.isin(joints.kind, ANCHORED)]
    for anchor in (*anchors, *joints.wheels[joints.kind == JointKind.PULLEY].reshape(-1, 2)):
        yield np.asarray((anchor, anchor))


SIDES = np.asarray(((-1.0, -1.0), (1.0, 1.0)))


MAX_JOINTS = 5000
"""Joints that are drawn."""
MAX_NAMES = 8
"""Up to this number of bodies, each is labelled with its name."""
SYMBOLS = {
    JointKind.ROD: "rod",
    JointKind.SLIDE: "string",
    JointKind.GROOVE: "rod",
    JointKind.SPRING: "spring",
    JointKind.PIVOT: "pivot",
    JointKind.PULLEY: "string",
}
"""Visible kinds of joints, and the symbol of each."""


def static_geometry(scene: Scene, drawn: IntArray, origin: tuple[float, float]) -> dict[str, Any]:
    """Return shapes, static geometry and joints as JSON.

    Args:
        scene: the scene.
        drawn: indices of the bodies that a replay draws; joints refer to positions in this array.
        origin: subtracted from every position, m, so that no digits are lost far from the origin of the world.
    """
    bodies = scene.bodies
    used, kind = np.unique(bodies.element[drawn], return_inverse=True)
    return {
        "shapes": [
            [_piece(p.corners, p.radius) for p in geometry_of(bodies.elements[k]).pieces] for k in used.tolist()
        ],
        "shape": kind.tolist(),
        "names": [bodies.names[k] for k in drawn.tolist()] if len(drawn) <= MAX_NAMES else [],
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
        "sensors": [],
        "attractions": [_moved(a.toward, origin) for a in scene.attractions if not isinstance(a.toward, str)],
        "joints": _joints(scene, drawn, origin),
    }


def _piece(corners: Sequence[tuple[float, float]], radius: float) -> list[float]:
    """Return radius and corners of a piece as one list."""
    return [radius, *(_short(value) for corner in corners for value in corner)]


def _solids(bodies: Bodies, origin: tuple[float, float]) -> list[list[Any]]:
    """Return the pieces of static bodies, each with position and angle."""
    return [
        [*_moved(bodies.position[n].tolist(), origin), float(bodies.angle[n]), _piece(piece.corners, piece.radius)]
        for n in np.flatnonzero(bodies.fixed).tolist()
        for piece in geometry_of(bodies.elements[bodies.element[n]]).pieces
    ]


def _joints(scene: Scene, drawn: IntArray, origin: tuple[float, float]) -> list[list[Any]]:
    """Return the visible joints: number, symbol, first and second body, and the anchor on each.

    The rope of a pulley has three parts: from each wheel to its body, and between the wheels. A body is its index among
    those drawn, −1 the world; a joint of a body that is not drawn is omitted, and one to a static body is anchored in
    the world.
    """
    joints, bodies = scene.joint_arrays, scene.bodies
    index_of = np.full(len(bodies) + 1, -2)
    index_of[drawn] = np.arange(len(drawn))
    index_of[-1] = -1
    found = []
    ends = joints.ends(bodies.position, bodies.angle)
    for k in np.flatnonzero(np.isin(joints.kind, list(SYMBOLS)))[:MAX_JOINTS].tolist():
        row: list[Any] = [int(joints.number[k]), SYMBOLS[JointKind(int(joints.kind[k]))]]
        anchors: list[float] = []
        for number, anchor, end in (
            (joints.a[k], joints.anchor_a[k], ends[0][k]),
            (joints.b[k], joints.anchor_b[k], ends[1][k]),
        ):
            if number < 0 or bodies.fixed[number]:
                row.append(-1)
                anchors += _moved(end.tolist(), origin)
            else:
                row.append(int(index_of[number]))
                anchors += [_short(value) for value in anchor.tolist()]
        if -2 in row[2:4] or row[2:4] == [-1, -1]:
            continue
        if joints.kind[k] != JointKind.PULLEY:
            found.append([*row, *anchors])
            continue
        number, symbol, a, b = row
        wheels = joints.wheels[k].tolist()
        first, second = _moved(wheels[:2], origin), _moved(wheels[2:], origin)
        found.append([number, symbol, -1, a, *first, *anchors[:2]])
        found.append([number, symbol, -1, -1, *first, *second])
        found.append([number, symbol, -1, b, *second, *anchors[2:]])
    return found


def _moved(point: Sequence[float], origin: tuple[float, float]) -> list[float]:
    return [_short(point[0] - origin[0]), _short(point[1] - origin[1])]


def _short(value: float) -> float:
    """Return a length rounded to seven digits, far finer than a pixel."""
    return float(f"{value:.7g}")
