"""Playfield: elements of a table by index and role, as the rules use them, and the positions where balls are placed."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Self

from sandbox.games.contract import UnsuitableSceneError
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.contacts import pair_table
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point, Vector
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.fixed import Plane, Post, Wall
from sandbox.scene.description.play import PlayPart, Role

Fixed = Plane | Wall | Post

SWITCH_THRESHOLDS: dict[Role, float] = {"bumper": 0.054, "slingshot": 0.054, "standup": 0.108, "drop": 0.108}
"""m/s, normal approach speed above which a switch closes. Source: defaults of Visual Pinball, in its unit of 0.53975 mm
per centisecond: bumpers and slingshots 1, targets 2."""

LAUNCH_SPEED = 3.0
"""m/s, default launch speed of a plunger, up the lane"""

EJECT_SPEED = 1.2
"""m/s, default speed at which a kicker ejects a ball, towards the centre of the table"""

LANE_UP, LANE_DOWN, LANE_SIDE = 0.10, 0.10, 0.03
"""m, extent of the lane around the position where balls are served: a pulled plunger lowers the ball by about 43 mm"""

TABLE_MARGIN = 0.05
"""m: a ball farther than this outside all static bodies has left the table"""


@dataclass(frozen=True, eq=False)
class PlayfieldElement:
    """Element with a role in the game. It is immutable, so copies of a game share it."""

    name: str
    role: Role
    group: str | None
    step: int
    score: int
    position: Point
    """m, centre"""
    out: Vector
    """m/s, velocity at which it releases a ball"""
    min_closing_speed: float = 0.0
    """m/s, normal impulse over the mass of the ball above which its switch closes"""
    outline: tuple[Point, ...] = ()
    """m, corners of a wall"""
    reach: float = 0.0
    """m, distance from the outline to the surface"""
    span: float = 0.0
    """m, distance from the centre of a body to its farthest point"""

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self


@dataclass(frozen=True, eq=False)
class Playfield:
    """A table. It is immutable, so copies of a game share it."""

    elements: tuple[PlayfieldElement, ...]
    switches: dict[int, PlayfieldElement]
    """elements by the index of their static body, −1 − k"""
    balls: tuple[int, ...]
    """indices of the balls"""
    names: dict[int, str]
    """names of the balls"""
    mass: dict[int, float]
    """kg, mass of each ball"""
    radius: float
    """m, radius of the largest ball"""
    serve: Point
    """m, position of a ball that waits for the plunger"""
    launch: Vector
    """m/s, velocity of a ball that is launched automatically"""
    homes: tuple[Point, ...]
    """m, positions of the balls that are out of play"""
    up: Vector
    """unit vector against gravity"""
    corners: tuple[Point, Point]
    """m, lower left and upper right corner; a ball outside has left the table"""
    dt: float
    """s"""
    seed: int
    players: int

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self

    @classmethod
    def of(cls, scene: Scene, bodies: Bodies) -> Self:
        """Return the playfield of a scene.

        Raises:
            UnsuitableSceneError: the scene has no ball.
        """
        parts = scene.play.parts
        body_indices = {name: k for k, name in enumerate(bodies.names)}
        stated = {body_indices[part.name]: part for part in parts if part.role == "ball" and part.name in body_indices}
        balls = tuple(stated) or tuple(k for k, each in enumerate(bodies.element) if _is_ball(bodies, int(each)))
        if not balls:
            raise UnsuitableSceneError('pinball needs a ball: a `[[play.part]]` with role "ball"')
        starts = {k: _start(bodies, k, stated.get(k)) for k in balls}
        up, plunger = _up(scene), next((part for part in parts if part.role == "plunger"), None)
        elements = tuple(_elements(scene, bodies, balls[0]))
        fixed = {name: -1 - k for k, name in enumerate(scene.fixed_names)}
        return cls(
            elements=elements,
            switches={fixed[each.name]: each for each in elements if each.name in fixed},
            balls=balls,
            names={k: bodies.names[k] for k in balls},
            mass={k: float(bodies.mass[k]) for k in balls},
            radius=max(float(bodies.radius[k]) for k in balls),
            serve=(plunger and plunger.at) or starts[balls[0]],
            launch=(plunger and plunger.out) or (LAUNCH_SPEED * up[0], LAUNCH_SPEED * up[1]),
            homes=tuple(starts[k] for k in balls[1:]),
            up=up,
            corners=_corners(scene),
            dt=scene.solver.dt,
            seed=scene.world.seed,
            players=scene.play.players,
        )

    def of_role(self, *roles: Role) -> tuple[PlayfieldElement, ...]:
        """Return the elements with one of some roles, in the order of the scene."""
        return tuple(each for each in self.elements if each.role in roles)

    def groups(self, role: Role) -> dict[str, tuple[PlayfieldElement, ...]]:
        """Return the groups of elements of a role, each sorted by step; elements without a group are left out."""
        groups: dict[str, list[PlayfieldElement]] = {}
        for each in self.of_role(role):
            if each.group is not None:
                groups.setdefault(each.group, []).append(each)
        return {name: tuple(sorted(members, key=lambda each: each.step)) for name, members in groups.items()}

    def flippers(self, side: str) -> tuple[PlayfieldElement, ...]:
        """Return the flippers of a side, `left` or `right`."""
        middle = (self.corners[0][0] + self.corners[1][0]) / 2.0
        return tuple(
            each
            for each in self.of_role("flipper")
            if side == (each.group or ("left" if each.position[0] < middle else "right"))
        )

    def height(self, x: float, y: float) -> float:
        """Return the height of a point up the slope, above the position where balls are served, m."""
        return (x - self.serve[0]) * self.up[0] + (y - self.serve[1]) * self.up[1]

    def in_lane(self, x: float, y: float) -> bool:
        """Return whether a point, m, is in the plunger lane, near the position where balls are served."""
        along, dx, dy = self.height(x, y), x - self.serve[0], y - self.serve[1]
        return -LANE_DOWN <= along <= LANE_UP and abs(dx * self.up[1] - dy * self.up[0]) <= LANE_SIDE

    def inside(self, x: float, y: float) -> bool:
        """Return whether a point, m, is on the table; a point with a NaN coordinate is not."""
        (left, low), (right, high) = self.corners
        return left <= x <= right and low <= y <= high


def _is_ball(bodies: Bodies, element: int) -> bool:
    return isinstance(bodies.elements[element], Ball)


def _start(bodies: Bodies, number: int, part: PlayPart | None) -> Point:
    if part is not None and part.at is not None:
        return part.at
    x, y = bodies.position[number].tolist()
    return x, y


def _up(scene: Scene) -> Vector:
    x, y = scene.world.gravity
    size = math.hypot(x, y)
    return (-x / size, -y / size) if size else (0.0, 1.0)


def _elements(scene: Scene, bodies: Bodies, ball: int) -> Iterator[PlayfieldElement]:
    """Yield the elements with a role, except balls."""
    fixed_bodies: dict[str, Fixed] = dict(
        zip(scene.fixed_names, scene.fixed, strict=False)
    )  # pockets and zones come after
    thresholds, middle = _thresholds(scene, bodies, ball), _middle(scene)
    indices = {name: k for k, name in enumerate(bodies.names)}
    for part in (each for each in scene.play.parts if each.role != "ball"):
        element, body = fixed_bodies.get(part.name), indices.get(part.name)
        position, span = part.at or _centre(element), 0.0
        if body is not None:
            (x, y), span = bodies.position[body].tolist(), float(bodies.radius[body])
            position = part.at or (x, y)
        yield PlayfieldElement(
            name=part.name,
            role=part.role,
            group=part.group,
            step=part.step,
            score=part.score,
            position=position,
            out=part.out or _eject_velocity(position, middle),
            min_closing_speed=thresholds.get(part.name, 0.0),
            outline=_outline(element) if isinstance(element, Wall) else (),
            reach=element.thickness / 2.0 if isinstance(element, Wall) else 0.0,
            span=span,
        )


def _thresholds(scene: Scene, bodies: Bodies, ball: int) -> dict[str, float]:
    """Return the impulse over mass, m/s, above which the switch of each struck thing closes, by name.

    A ball that arrives at v leaves at e(v)·v, so v follows from the impulse, whatever else happens to the ball in the
    step. The law of e(v) is that of `engines.common.restitution`, which is not imported because it loads the compiler.
    """
    surfaces, roles = pair_table(scene, bodies), {part.name: part.role for part in scene.play.parts}
    thresholds = {}
    for number, (name, element) in enumerate(zip(scene.fixed_names, scene.fixed, strict=False)):
        if roles.get(name) not in SWITCH_THRESHOLDS:
            continue
        pair = surfaces.of_body[ball], surfaces.of_fixed[number]
        restitution, falloff = float(surfaces.restitution[pair]), float(surfaces.falloff[pair])
        kick = None if isinstance(element, Plane) else element.kick
        speed = SWITCH_THRESHOLDS[roles[name]] if kick is None else kick.threshold
        thresholds[name] = speed * (1.0 + restitution / (1.0 + falloff * speed))
    return thresholds


def _outline(wall: Wall) -> tuple[Point, ...]:
    return (*wall.points, wall.points[0]) if wall.closed else wall.points


def _centre(element: Fixed | None) -> Point:
    """Return the centre of a static body, m; the origin for an element without a position, such as a drive."""
    if isinstance(element, Post):
        return element.position
    if isinstance(element, Wall):
        return _mean(element.points)
    return (0.0, 0.0)


def _mean(points: tuple[Point, ...]) -> Point:
    return sum(x for x, _ in points) / len(points), sum(y for _, y in points) / len(points)


def _eject_velocity(where: Point, middle: Point) -> Vector:
    x, y = middle[0] - where[0], middle[1] - where[1]
    size = math.hypot(x, y)
    return (EJECT_SPEED * x / size, EJECT_SPEED * y / size) if size else (0.0, EJECT_SPEED)


def _corners(scene: Scene) -> tuple[Point, Point]:
    """Return the bounding box of walls and posts, with a margin; infinite without any."""
    points = [point for wall in scene.walls for point in wall.points] + [post.position for post in scene.posts]
    if not points:
        return (-math.inf, -math.inf), (math.inf, math.inf)
    xs, ys = zip(*points, strict=True)
    return (min(xs) - TABLE_MARGIN, min(ys) - TABLE_MARGIN), (max(xs) + TABLE_MARGIN, max(ys) + TABLE_MARGIN)


def _middle(scene: Scene) -> Point:
    (left, low), (right, high) = _corners(scene)
    return ((left + right) / 2.0, (low + high) / 2.0) if math.isfinite(left) else (0.0, 0.0)
