"""Board: a table as its rules see it: which number plays which part, and where balls are put."""

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

FIRES: dict[Role, float] = {"bumper": 0.054, "slingshot": 0.054, "standup": 0.108, "drop": 0.108}
"""m/s, the normal approach speed above which a switch closes. Source: Visual Pinball's defaults, in its unit of
.53975 mm a centisecond: bumpers and slingshots 1, targets 2."""

LAUNCH = 3.0
"""m/s, up the lane, of a plunger that states nothing"""

EJECT = 1.2
"""m/s, towards the middle of the table, of a hole that states nothing"""

LANE_UP, LANE_DOWN, LANE_SIDE = 0.10, 0.10, 0.03
"""m, about where balls are served, what counts as the lane: a plunger draws a ball down by some 43 mm"""

MARGIN = 0.05
"""m: what is so far outside everything fixed has left the table"""


@dataclass(frozen=True, eq=False)
class PlayfieldElement:
    """A thing that plays a part. Copies share it: nothing in it changes."""

    name: str
    role: Role
    group: str | None
    step: int
    score: int
    where: Point
    """its middle, m"""
    out: Vector
    """the velocity with which it lets a ball go, m/s"""
    least: float = 0.0
    """m/s, the normal impulse over a ball's mass above which its switch closes"""
    outline: tuple[Point, ...] = ()
    """of a wall, m"""
    reach: float = 0.0
    """from the outline to its surface, m"""
    span: float = 0.0
    """of a body, from its centre to its farthest point, m"""

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self


@dataclass(frozen=True, eq=False)
class Playfield:
    """A table. Copies share it: nothing in it changes."""

    elements: tuple[PlayfieldElement, ...]
    switches: dict[int, PlayfieldElement]
    """by number of the fixed thing, −1 − k"""
    balls: tuple[int, ...]
    """numbers of the bodies that are played with"""
    names: dict[int, str]
    """of the balls"""
    mass: dict[int, float]
    """kg, of the balls"""
    radius: float
    """m, of the largest ball"""
    serve: Point
    """where a ball waits for the plunger, m"""
    launch: Vector
    """m/s, of a ball that the table launches by itself"""
    homes: tuple[Point, ...]
    """where balls that are out of play lie, m"""
    up: Vector
    """unit vector against gravity"""
    corners: tuple[Point, Point]
    """lower left and upper right, m; a ball beyond them is lost"""
    dt: float
    """s"""
    seed: int
    players: int

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self

    @classmethod
    def of(cls, scene: Scene, bodies: Bodies) -> Self:
        """Read a scene.

        Raises:
            UnsuitableSceneError: it has no ball.
        """
        parts = scene.play.parts
        numbers = {name: k for k, name in enumerate(bodies.names)}
        stated = {numbers[part.name]: part for part in parts if part.role == "ball" and part.name in numbers}
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
            launch=(plunger and plunger.out) or (LAUNCH * up[0], LAUNCH * up[1]),
            homes=tuple(starts[k] for k in balls[1:]),
            up=up,
            corners=_corners(scene),
            dt=scene.solver.dt,
            seed=scene.world.seed,
            players=scene.play.players,
        )

    def of_role(self, *roles: Role) -> tuple[PlayfieldElement, ...]:
        """Return the elements that play certain parts, in the scene's order."""
        return tuple(each for each in self.elements if each.role in roles)

    def groups(self, role: Role) -> dict[str, tuple[PlayfieldElement, ...]]:
        """Return those of a role that belong together, each group by its steps; what is in no group is left out."""
        groups: dict[str, list[PlayfieldElement]] = {}
        for each in self.of_role(role):
            if each.group is not None:
                groups.setdefault(each.group, []).append(each)
        return {name: tuple(sorted(those, key=lambda each: each.step)) for name, those in groups.items()}

    def flippers(self, side: str) -> tuple[PlayfieldElement, ...]:
        """Return the flippers of a side, `left` or `right`."""
        middle = (self.corners[0][0] + self.corners[1][0]) / 2.0
        return tuple(
            each
            for each in self.of_role("flipper")
            if side == (each.group or ("left" if each.where[0] < middle else "right"))
        )

    def height(self, x: float, y: float) -> float:
        """Return how far up from where balls are served a point is, m."""
        return (x - self.serve[0]) * self.up[0] + (y - self.serve[1]) * self.up[1]

    def in_lane(self, x: float, y: float) -> bool:
        """Tell whether a point, m, is where balls are served, or where a plunger draws them."""
        along, dx, dy = self.height(x, y), x - self.serve[0], y - self.serve[1]
        return -LANE_DOWN <= along <= LANE_UP and abs(dx * self.up[1] - dy * self.up[0]) <= LANE_SIDE

    def inside(self, x: float, y: float) -> bool:
        """Tell whether a point, m, is on the table; what is not a number is not."""
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
    """Yield what plays a part, but balls."""
    things: dict[str, Fixed] = dict(zip(scene.fixed_names, scene.fixed, strict=False))  # pockets and zones come after
    fires, middle = _thresholds(scene, bodies, ball), _middle(scene)
    those = {name: k for k, name in enumerate(bodies.names)}
    for part in (each for each in scene.play.parts if each.role != "ball"):
        thing, body = things.get(part.name), those.get(part.name)
        where, span = part.at or _where(thing), 0.0
        if body is not None:
            (x, y), span = bodies.position[body].tolist(), float(bodies.radius[body])
            where = part.at or (x, y)
        yield PlayfieldElement(
            name=part.name,
            role=part.role,
            group=part.group,
            step=part.step,
            score=part.score,
            where=where,
            out=part.out or _towards(where, middle),
            least=fires.get(part.name, 0.0),
            outline=_outline(thing) if isinstance(thing, Wall) else (),
            reach=thing.thickness / 2.0 if isinstance(thing, Wall) else 0.0,
            span=span,
        )


def _thresholds(scene: Scene, bodies: Bodies, ball: int) -> dict[str, float]:
    """Return the impulse over mass, m/s, above which the switch of each struck thing closes, by name.

    A ball that comes with v leaves with e(v)·v, so the impulse tells v, whatever else the step has done to the ball.
    The law is that of `engines.common.restitution`, which is not imported for one line: it wakes the compiler.
    """
    surfaces, roles = pair_table(scene, bodies), {part.name: part.role for part in scene.play.parts}
    fires = {}
    for number, (name, thing) in enumerate(zip(scene.fixed_names, scene.fixed, strict=False)):
        if roles.get(name) not in FIRES:
            continue
        pair = surfaces.of_body[ball], surfaces.of_fixed[number]
        restitution, falloff = float(surfaces.restitution[pair]), float(surfaces.falloff[pair])
        kick = None if isinstance(thing, Plane) else thing.kick
        speed = FIRES[roles[name]] if kick is None else kick.threshold
        fires[name] = speed * (1.0 + restitution / (1.0 + falloff * speed))
    return fires


def _outline(wall: Wall) -> tuple[Point, ...]:
    return (*wall.points, wall.points[0]) if wall.closed else wall.points


def _where(thing: Fixed | None) -> Point:
    """Return the middle of a thing, m; of what lies nowhere, such as a drive, the origin."""
    if isinstance(thing, Post):
        return thing.position
    if isinstance(thing, Wall):
        return _mean(thing.points)
    return (0.0, 0.0)


def _mean(points: tuple[Point, ...]) -> Point:
    return sum(x for x, _ in points) / len(points), sum(y for _, y in points) / len(points)


def _towards(where: Point, middle: Point) -> Vector:
    x, y = middle[0] - where[0], middle[1] - where[1]
    size = math.hypot(x, y)
    return (EJECT * x / size, EJECT * y / size) if size else (0.0, EJECT)


def _corners(scene: Scene) -> tuple[Point, Point]:
    """Return the box about everything fixed that has an end, with a margin; without any, no box at all."""
    points = [point for wall in scene.walls for point in wall.points] + [post.position for post in scene.posts]
    if not points:
        return (-math.inf, -math.inf), (math.inf, math.inf)
    xs, ys = zip(*points, strict=True)
    return (min(xs) - MARGIN, min(ys) - MARGIN), (max(xs) + MARGIN, max(ys) + MARGIN)


def _middle(scene: Scene) -> Point:
    (left, low), (right, high) = _corners(scene)
    return ((left + right) / 2.0, (low + high) / 2.0) if math.isfinite(left) else (0.0, 0.0)
