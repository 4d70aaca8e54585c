"""Elements of a pinball table as walls, posts, zones, bodies and drives."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

from sandbox.games.pinball.elements import (
    LEAST_DEPTH,
    Art,
    Bumper,
    Drain,
    DropTargets,
    FilletCorner,
    Flipper,
    Gate,
    Kicker,
    Line,
    PinballBall,
    PinballPost,
    PinballWall,
    Plunger,
    Ramp,
    Rollover,
    Scoring,
    Slingshot,
    Spinner,
    Standup,
)
from sandbox.scene.description.base import GROUND, Point, Vector
from sandbox.scene.description.bodies import Polygon
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.fixed import Post, Wall, Zone
from sandbox.scene.description.forces import AnyDrive, PlungerDrive, StrokeDrive, TorqueDrive
from sandbox.scene.description.play import Marking, PlayPart, Role
from sandbox.scene.description.world import Kick, Material, Pair
from sandbox.scene.errors import Location
from sandbox.scene.geometry.polyline import Arc, beside, flattened, length_of, part_of, rounded

STATED = "score", "group", "step", "light", "colour"
"""what a part has from its element"""


@dataclass
class Building:
    """The primitives that elements stand for so far, and which element each name is of."""

    axis: float
    """x of the table's axis, m"""
    tolerance: float
    """of arcs, m"""
    ball_radius: float
    ball_mass: float
    gravity: tuple[float, float]
    """on the playfield, m/s²"""
    here: Location = ()
    """the element that is being built"""
    walls: list[Wall] = field(default_factory=list)
    posts: list[Post] = field(default_factory=list)
    zones: list[Zone] = field(default_factory=list)
    balls: list[Ball] = field(default_factory=list)
    polygons: list[Polygon] = field(default_factory=list)
    drives: list[AnyDrive] = field(default_factory=list)
    parts: list[PlayPart] = field(default_factory=list)
    markings: list[Marking] = field(default_factory=list)
    origins: dict[str, Location] = field(default_factory=dict)

    def line(self, corners: Sequence[FilletCorner], closed: bool = False) -> tuple[Point, ...]:
        """Return a line with its round corners flattened."""
        return rounded(corners, closed, self.tolerance)

    def wall(self, name: str, points: Sequence[Point], **more: Any) -> None:
        """Add a wall."""
        self.walls.append(Wall(name=name, points=tuple(points), **more))
        self.origins[name] = self.here

    def post(self, name: str, position: Point, radius: float, **more: Any) -> None:
        """Add a post."""
        self.posts.append(Post(name=name, position=position, radius=radius, **more))
        self.origins[name] = self.here

    def zone(self, name: str, **more: Any) -> None:
        """Add a zone."""
        self.zones.append(Zone(name=name, **more))
        self.origins[name] = self.here

    def body(self, body: Ball | Polygon) -> None:
        """Add a body."""
        those: list[Any] = self.balls if isinstance(body, Ball) else self.polygons
        those.append(body)
        self.origins[str(body.name)] = self.here

    def part(self, name: str, role: Role, element: Scoring | None = None, **more: Any) -> None:
        """Say which part something plays; of an element that rules hear of, with what it states."""
        stated = {} if element is None else {key: getattr(element, key) for key in STATED}
        self.parts.append(PlayPart(name=name, role=role, **{**stated, **more}))

    def paint(self, colour: str | None, points: Sequence[Point]) -> None:
        """Paint an area, if it has a colour."""
        if colour is not None:
            self.markings.append(Marking(points=tuple(points), colour=colour))

    def dot(self, colour: str | None, position: Point, radius: float) -> None:
        """Paint a disc, if it has a colour."""
        if colour is not None:
            self.markings.append(Marking(position=position, radius=radius, colour=colour))


BALL = "steel"

MATERIALS = (
    Material(name=BALL),
    Material(name="wall", restitution=0.3, friction=0.3),
    Material(name="rubber", restitution=0.8, restitution_falloff=0.3, friction=0.6),
    Material(name="target", restitution=0.35, restitution_falloff=0.5, friction=0.2),
    Material(name="post", restitution=0.9, restitution_falloff=0.1, friction=0.3),
    Material(name="flipper", restitution=0.8, restitution_falloff=0.43, friction=0.6),
)
"""The ball's own has no figures: of a contact, those of the other side hold."""


def pairs(ball_restitution: float) -> tuple[Pair, ...]:
    """Return the coefficients of what meets its own kind."""
    return (Pair(between=(BALL, BALL), restitution=ball_restitution, friction=0.2),)


G = 9.81
"""m/s²"""
ROLLING = 5.0 / 7.0
"""of gravity along a slope that speeds up a solid sphere which rolls on it: see `rolling_gravity`"""


def rolling_gravity(slope: float) -> Vector:
    """Return the acceleration of a ball that rolls down a slope, rad, as gravity in the plane of the table, m/s².

    Friction F at the point of contact turns a sphere of radius r and moment I = (2/5) m r²: F r = I a / r, so that
    F = (2/5) m a, and m a = m g sin θ − F gives a = (5/7) g sin θ: it is as if the sphere were 7/5 as heavy along its
    way. A disc that lies flat in the plane, as bodies here do, cannot roll on it, so gravity itself is made smaller.
    Limits: speeds that collisions change are those of a sphere that rolls again at once.
    """
    return 0.0, -ROLLING * G * math.sin(slope)


def bat(length: float, base: float, tip: float, tolerance: float = 5e-5) -> tuple[Point, ...]:
    """Return the outline of a bat along x about its pivot, anticlockwise, m.

    The outer tangents of two discs touch both where their normals point: at the angle acos((base − tip) / length) to
    the line of centres.

    Args:
        length: between the centres of the discs, m; more than their radii differ by.
        base: radius of the disc about the pivot, m.
        tip: radius of the disc at the other end, m.
        tolerance: how far the outline may lie inside the arcs, m.
    """
    angle = math.acos((base - tip) / length)
    ends = Arc((length, 0.0), tip, -angle, 2.0 * angle), Arc((0.0, 0.0), base, angle, 2.0 * (math.pi - angle))
    return tuple(point for arc in ends for point in flattened(arc, tolerance))


AHEAD = 0.032
"""m, from the face of a target to the middle of its lamp"""


DARK = "#0a0f18"
"""what shadows and plastics lean to"""


def art(to: Building, _: str, of: Art) -> None:
    """Paint an area."""
    if of.points is not None:
        to.paint(of.colour, to.line(of.points, closed=True))
    elif of.position is not None and of.radius is not None:
        to.dot(of.colour, of.position, of.radius)


def wall(to: Building, name: str, of: Line) -> None:
    """Add a wall, or a rubber."""
    material = of.material if isinstance(of, PinballWall) else "rubber"
    points = to.line(of.points, of.closed)
    if of.closed:
        to.paint(of.fill, points)
    to.wall(
        name, points, closed=of.closed, thickness=of.thickness, material=material, colour=of.colour, layers=of.layers
    )


def post(to: Building, name: str, of: PinballPost) -> None:
    """Add a post."""
    to.post(name, of.position, of.radius, material=of.material, colour=of.colour, layers=of.layers)


def gate(to: Building, name: str, of: Gate) -> None:
    """Add a wall that is one from one side alone."""
    to.wall(name, of.points, thickness=of.thickness, material="wall", colour=of.colour, one_way=True)
    to.part(name, "gate", of)


def bumper(to: Building, name: str, of: Bumper) -> None:
    """Add a post that kicks."""
    kick = Kick(speed=of.speed, threshold=of.threshold)
    to.post(name, of.position, of.radius, material="wall", colour=of.colour, kick=kick)
    to.dot(darker(of.colour, 0.6), of.position, 1.45 * of.radius)  # its skirt
    to.part(name, "bumper", of, light=of.light or of.position)


def slingshot(to: Building, name: str, of: Slingshot) -> None:
    """Add the side that kicks, and the rubber around the other two."""
    first, second, behind = of.points
    alike = {"thickness": of.thickness, "material": "rubber", "colour": of.colour}
    kick = Kick(speed=of.speed, threshold=of.threshold, profile="middle", adds_to="approach")
    to.wall(name, (first, second), kick=kick, **alike)
    to.wall(f"{name} back", (second, behind, first), **alike)
    to.paint(darker(of.colour, 0.45), of.points)
    middle = sum(x for x, _ in of.points) / 3.0, sum(y for _, y in of.points) / 3.0
    to.part(name, "slingshot", of, light=of.light or middle)


def standup(to: Building, name: str, of: Standup) -> None:
    """Add a target."""
    out = unit(of.facing)
    to.wall(name, _plate(of.position, out, of.width, of.thickness), **_target(of))
    to.part(name, "standup", of, light=of.light or moved(of.position, out, AHEAD))


def drops(to: Building, name: str, of: DropTargets) -> None:
    """Add a bank of targets, numbered along it from the left as seen from the ball."""
    out = unit(of.facing)
    along = -out[1], out[0]  # to the ball's right, as the ball looks at the faces
    for k in range(of.count):
        place = moved(of.position, along, (k - 0.5 * (of.count - 1)) * (of.width + of.gap))
        to.wall(f"{name} {k + 1}", _plate(place, out, of.width, of.thickness), **_target(of))
        light = moved(place, out, AHEAD)
        to.part(f"{name} {k + 1}", "drop", of, group=of.group or name, step=k, light=light)


def darker(colour: str | None, fraction: float) -> str | None:
    """Return a colour so much of the way to the dark."""
    if colour is None:
        return None
    parts = zip((colour[1:3], colour[3:5], colour[5:7]), (DARK[1:3], DARK[3:5], DARK[5:7]), strict=True)
    return "#" + "".join(f"{round(int(a, 16) + (int(b, 16) - int(a, 16)) * fraction):02x}" for a, b in parts)


def unit(way: Vector) -> Vector:
    """Return a direction with length 1."""
    size = math.hypot(*way)
    return way[0] / size, way[1] / size


def _target(of: Standup | DropTargets) -> dict[str, object]:
    return {"thickness": of.thickness, "material": "target", "colour": of.colour}


def _plate(face: Point, out: Vector, width: float, thickness: float) -> tuple[Point, Point]:
    """Return the middle line of a plate with round ends, width and all, whose face is at a point."""
    half = 0.5 * (width - thickness)
    middle = moved(face, out, -0.5 * thickness)
    along = -out[1], out[0]
    return moved(middle, along, -half), moved(middle, along, half)


def moved(point: Point, way: Vector, distance: float) -> Point:
    """Return a point moved so far, m, along a unit vector."""
    return point[0] + way[0] * distance, point[1] + way[1] * distance


RAMP = 0.03
"""s, in which a coil's torque rises"""
RETURN = 0.058
"""of the torque, by which a spring draws a bat back"""
HOLD, WITHIN = 0.75, math.radians(6.0)
"""of the torque that is left this near the raised stop, rad"""
BOUNCE = 0.3
"""of its speed with which a bat comes back from a stop"""
DEPTH = 0.012
"""m, of a plunger's tip along its way"""


def ball(to: Building, name: str, of: PinballBall) -> None:
    """Add a ball."""
    radius = to.ball_radius if of.radius is None else of.radius
    mass = to.ball_mass if of.mass is None else of.mass
    to.body(Ball(name=name, position=of.position, radius=radius, mass=mass, material=BALL, colour=of.colour))
    to.part(name, "ball", at=of.position)


def flipper(to: Building, name: str, of: Flipper) -> None:
    """Add a bat and what turns it."""
    to.body(
        Polygon(
            name=name,
            position=of.pivot,
            points=bat(of.length, of.base, of.tip),
            angle=of.stops[0],
            mass=of.mass,
            material="flipper",
            colour=of.colour,
        )
    )
    to.drives.append(_drive(name, of))
    to.part(name, "flipper", group=of.side or ("left" if of.pivot[0] < to.axis else "right"))


def plunger(to: Building, name: str, of: Plunger) -> None:
    """Add a rod's tip and what shoots it."""
    (x, y), along = of.position, unit(of.direction)
    half = 0.5 * of.width
    tip = (0.0, half), (-DEPTH, half), (-DEPTH, -half), (0.0, -half)
    points = tuple((u * along[0] - v * along[1], u * along[1] + v * along[0]) for u, v in tip)
    to.body(Polygon(name=name, position=(x, y), points=points, material="wall", colour=of.colour))
    to.drives.append(
        PlungerDrive(kind="plunger", name=name, body=name, direction=of.direction, travel=of.travel, speed=of.speed)
    )
    served = x + along[0] * 1.001 * to.ball_radius, y + along[1] * 1.001 * to.ball_radius
    to.part(name, "plunger", of, at=served)


def _drive(name: str, of: Flipper) -> TorqueDrive | StrokeDrive:
    """Return the drive of a bat: a stroke, or a coil to which it is as heavy as a rod of its mass and length."""
    held: dict[str, Any] = {"name": name, "body": name, "pivot": of.pivot, "stops": of.stops}
    if of.drive == "stroke":
        return StrokeDrive(kind="stroke", rate=of.rate, return_rate=of.return_rate, **held)
    return TorqueDrive(
        kind="torque",
        torque=of.torque,
        ramp=RAMP,
        return_ratio=RETURN,
        hold_ratio=HOLD,
        hold_within=WITHIN,
        bounce=BOUNCE,
        moment=of.mass * of.length**2 / 3.0,
        **held,
    )


PIECE = 0.03
"""m, of a bent climb, along which gravity has one direction"""
BEFORE = 0.014
"""m, from the rim of a hole to the middle of its lamp"""
GAP = 0.006
"""m, between the strips at the mouth of a ramp of which one lifts the ball and the other lets it down"""


def rollover(to: Building, name: str, of: Rollover) -> None:
    """Add a zone under a wire."""
    to.zone(name, position=of.position, radius=of.radius, colour=of.colour)
    to.part(name, "rollover", of, light=of.light or of.position)


def spinner(to: Building, name: str, of: Spinner) -> None:
    """Add a strip under a plate."""
    to.zone(name, points=_within(of.points, of.thickness), thickness=of.thickness, colour=of.colour)
    to.part(name, "spinner", of)


def kicker(to: Building, name: str, of: Kicker) -> None:
    """Add a hole that holds."""
    to.zone(name, position=of.position, radius=of.radius, colour=of.colour, holds=True)
    to.dot(of.colour, of.position, 1.25 * of.radius)
    to.dot(DARK, of.position, of.radius)
    light = of.light or (moved(of.position, unit(of.out), of.radius + BEFORE) if any(of.out) else None)
    to.part(name, "kicker", of, out=of.out, at=of.position, light=light)


def drain(to: Building, name: str, of: Drain) -> None:
    """Add the strip in which a ball is lost."""
    to.zone(name, points=of.points, thickness=of.thickness, colour=of.colour)
    to.part(name, "drain", of)


def ramp(to: Building, name: str, of: Ramp) -> None:
    """Add a ramp.

    Along the climb, gravity down the slope adds to the playfield's: (5/7) g · rise/climb against the way up. Beside it
    the ground has walls too, and one across its top: there the ramp is too low to roll under.
    """
    layer = of.layer or name
    line = to.line(of.points)
    whole, half = length_of(line), 0.5 * (of.width + of.thickness)
    rail: dict[str, Any] = {"thickness": of.thickness, "material": "wall", "colour": of.colour}
    for side, aside in (("left", half), ("right", -half)):
        to.wall(f"{name} {side} rail", beside(line, aside), layers=(layer,), **rail)
    to.paint(of.floor, (*beside(line, half), *reversed(beside(line, -half))))
    climb = part_of(line, 0.0, of.climb)
    left, right = beside(climb, half), beside(climb, -half)
    (ax, ay), (bx, by) = climb[-2:]
    ahead = half / math.dist((ax, ay), (bx, by))
    ridge = bx + (bx - ax) * ahead, by + (by - ay) * ahead  # on a straight top a ball from above could come to rest
    to.wall(f"{name} sides", (*left, ridge, *reversed(right)), **rail)

    deep, half_deep = LEAST_DEPTH, 0.5 * LEAST_DEPTH
    mouth = deep + GAP + half_deep
    to.zone(
        f"{name} foot",
        points=_across(line, half_deep, of.width - deep),
        thickness=deep,
        layers=(layer,),
        to_layer=GROUND,
    )
    to.zone(name, points=_across(line, mouth, of.width - deep), thickness=deep, to_layer=layer)
    for k, piece in enumerate(_pieces(line, mouth, of.climb)):
        left, right = beside(piece, half), beside(piece, -half)
        outline = left[0], left[-1], right[-1], right[0]  # what a bend leaves out lies nearer to a rail than any ball
        to.zone(f"{name} climb {k + 1}", points=outline, layers=(layer,), gravity=_pull(to, piece, of.rise / of.climb))
    end = f"{name} exit"
    to.zone(
        end, points=_across(line, whole - half_deep, of.width - deep), thickness=deep, layers=(layer,), to_layer=GROUND
    )
    group = of.group or name
    to.part(name, "ramp", group=group, step=0)
    to.part(end, "ramp", group=group, step=1, score=of.score, light=of.light or line[0], colour=of.colour)


def _pieces(line: Sequence[Point], begin: float, end: float) -> list[tuple[Point, ...]]:
    """Return part of a line in pieces that are nearly straight and long enough for no ball to pass one unnoticed."""
    whole = part_of(line, begin, end)
    count = 1 if len(whole) == 2 else max(round((end - begin) / PIECE), 1)
    cuts = [begin + (end - begin) * k / count for k in range(count + 1)]
    return [part_of(line, a, b) for a, b in pairwise(cuts)]


def _pull(to: Building, piece: tuple[Point, ...], steepness: float) -> Vector:
    """Return gravity on a piece of a climb, m/s²: from one end to the other it takes what the rise does."""
    (ax, ay), (bx, by) = piece[0], piece[-1]
    size = math.dist(piece[0], piece[-1])
    back = G * ROLLING * steepness * length_of(piece) / size**2
    return to.gravity[0] - back * (bx - ax), to.gravity[1] - back * (by - ay)


def _across(line: tuple[Point, ...], along: float, width: float) -> tuple[Point, Point]:
    """Return the ends of a piece of a width across a line, a length along it, m."""
    hair = 1e-4
    piece = part_of(line, along - hair, along + hair)
    a, b = piece[0], piece[-1]
    return beside((a, b), 0.5 * width)[0], beside((a, b), -0.5 * width)[0]


def _within(points: tuple[Point, Point], thickness: float) -> tuple[Point, Point]:
    """Return a strip's middle line that, with its round ends, is as long as was stated."""
    (ax, ay), (bx, by) = points
    size = math.dist(*points)
    cut = 0.5 * thickness / size
    return (ax + (bx - ax) * cut, ay + (by - ay) * cut), (bx - (bx - ax) * cut, by - (by - ay) * cut)
