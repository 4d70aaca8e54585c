"""Expansion of the elements of a pinball table to walls, posts, zones, bodies and drives."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

from sandbox.games.pinball.elements import (
    MIN_ZONE_DEPTH,
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

INHERITED_FIELDS = "score", "group", "step", "light", "colour"
"""fields that a part takes from its element"""


@dataclass
class Building:
    """Primitives of the elements expanded so far, and the element of each name."""

    axis: float
    """x of the table's axis, m"""
    tolerance: float
    """m, largest deviation of line segments from an arc"""
    ball_radius: float
    ball_mass: float
    gravity: tuple[float, float]
    """m/s², on the playfield"""
    location: Location = ()
    """location of the present element in the scene file"""
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
        """Return a line with its round corners replaced by line segments."""
        return rounded(corners, closed, self.tolerance)

    def wall(self, name: str, points: Sequence[Point], **more: Any) -> None:
        """Add a wall."""
        self.walls.append(Wall(name=name, points=tuple(points), **more))
        self.origins[name] = self.location

    def post(self, name: str, position: Point, radius: float, **more: Any) -> None:
        """Add a post."""
        self.posts.append(Post(name=name, position=position, radius=radius, **more))
        self.origins[name] = self.location

    def zone(self, name: str, **more: Any) -> None:
        """Add a zone."""
        self.zones.append(Zone(name=name, **more))
        self.origins[name] = self.location

    def body(self, body: Ball | Polygon) -> None:
        """Add a body."""
        bodies: list[Any] = self.balls if isinstance(body, Ball) else self.polygons
        bodies.append(body)
        self.origins[str(body.name)] = self.location

    def part(self, name: str, role: Role, element: Scoring | None = None, **more: Any) -> None:
        """Add a part of the game; the values of a scoring element are copied to it."""
        stated = {} if element is None else {key: getattr(element, key) for key in INHERITED_FIELDS}
        self.parts.append(PlayPart(name=name, role=role, **{**stated, **more}))

    def paint(self, colour: str | None, points: Sequence[Point]) -> None:
        """Paint an area, if it has a colour."""
        if colour is not None:
            self.markings.append(Marking(points=tuple(points), colour=colour))

    def dot(self, colour: str | None, position: Point, radius: float) -> None:
        """Paint a disc, if it has a colour."""
        if colour is not None:
            self.markings.append(Marking(position=position, radius=radius, colour=colour))


BALL_MATERIAL = "steel"

MATERIALS = (
    Material(name=BALL_MATERIAL),
    Material(name="wall", restitution=0.3, friction=0.3),
    Material(name="rubber", restitution=0.8, restitution_falloff=0.3, friction=0.6),
    Material(name="target", restitution=0.35, restitution_falloff=0.5, friction=0.2),
    Material(name="post", restitution=0.9, restitution_falloff=0.1, friction=0.3),
    Material(name="flipper", restitution=0.8, restitution_falloff=0.43, friction=0.6),
)
"""The material of the ball has no coefficients: the other material of a contact determines them."""


def pairs(ball_restitution: float) -> tuple[Pair, ...]:
    """Return the coefficients of a contact between two balls."""
    return (Pair(between=(BALL_MATERIAL, BALL_MATERIAL), restitution=ball_restitution, friction=0.2),)


GRAVITY = 9.81
"""m/s²"""
ROLLING_FACTOR = 5.0 / 7.0
"""acceleration of a solid sphere that rolls down a slope, as a fraction of gravity along it: see `rolling_gravity`"""


def rolling_gravity(slope: float) -> Vector:
    """Return the acceleration of a ball that rolls down a slope, rad, as gravity in the plane of the table, m/s².

    Friction F at the point of contact turns a sphere of radius r and moment I = (2/5) m r²: F r = I a / r, so that
    F = (2/5) m a, and m a = m g sin θ − F gives a = (5/7) g sin θ: the inertia of the sphere along the slope is 7/5 of
    its mass. The bodies of a scene are discs in the plane, which cannot roll on it, so gravity is reduced instead.
    Limits: after a collision, a sphere rolls again without delay.
    """
    return 0.0, -ROLLING_FACTOR * GRAVITY * math.sin(slope)


def bat(length: float, base: float, tip: float, tolerance: float = 5e-5) -> tuple[Point, ...]:
    """Return the outline of a bat along x about its pivot, anticlockwise, m.

    The outer tangents of two discs touch both where their normals point: at the angle acos((base − tip) / length) to
    the line of centres.

    Args:
        length: distance between the centres of the discs, m; more than the difference of their radii.
        base: radius of the disc about the pivot, m.
        tip: radius of the disc at the other end, m.
        tolerance: largest distance of the outline from the arcs, to the inside, m.
    """
    angle = math.acos((base - tip) / length)
    ends = Arc((length, 0.0), tip, -angle, 2.0 * angle), Arc((0.0, 0.0), base, angle, 2.0 * (math.pi - angle))
    return tuple(point for arc in ends for point in flattened(arc, tolerance))


TARGET_LAMP_DISTANCE = 0.032
"""m, distance from the face of a target to the centre of its lamp"""


DARK = "#0a0f18"
"""colour that shadows and plastics are mixed with"""


def art(building: Building, _: str, element: Art) -> None:
    """Paint an area."""
    if element.points is not None:
        building.paint(element.colour, building.line(element.points, closed=True))
    elif element.position is not None and element.radius is not None:
        building.dot(element.colour, element.position, element.radius)


def wall(building: Building, name: str, element: Line) -> None:
    """Add a wall, or a rubber."""
    material = element.material if isinstance(element, PinballWall) else "rubber"
    points = building.line(element.points, element.closed)
    if element.closed:
        building.paint(element.fill, points)
    building.wall(
        name,
        points,
        closed=element.closed,
        thickness=element.thickness,
        material=material,
        colour=element.colour,
        layers=element.layers,
    )


def post(building: Building, name: str, element: PinballPost) -> None:
    """Add a post."""
    building.post(
        name, element.position, element.radius, material=element.material, colour=element.colour, layers=element.layers
    )


def gate(building: Building, name: str, element: Gate) -> None:
    """Add a one-way wall."""
    building.wall(
        name, element.points, thickness=element.thickness, material="wall", colour=element.colour, one_way=True
    )
    building.part(name, "gate", element)


def bumper(building: Building, name: str, element: Bumper) -> None:
    """Add a post that kicks."""
    kick = Kick(speed=element.speed, threshold=element.threshold)
    building.post(name, element.position, element.radius, material="wall", colour=element.colour, kick=kick)
    building.dot(darker(element.colour, 0.6), element.position, 1.45 * element.radius)  # its skirt
    building.part(name, "bumper", element, light=element.light or element.position)


def slingshot(building: Building, name: str, element: Slingshot) -> None:
    """Add the side that kicks, and the rubber around the other two."""
    first, second, behind = element.points
    rubber = {"thickness": element.thickness, "material": "rubber", "colour": element.colour}
    kick = Kick(speed=element.speed, threshold=element.threshold, profile="middle", adds_to="approach")
    building.wall(name, (first, second), kick=kick, **rubber)
    building.wall(f"{name} back", (second, behind, first), **rubber)
    building.paint(darker(element.colour, 0.45), element.points)
    middle = sum(x for x, _ in element.points) / 3.0, sum(y for _, y in element.points) / 3.0
    building.part(name, "slingshot", element, light=element.light or middle)


def standup(building: Building, name: str, element: Standup) -> None:
    """Add a target."""
    out = unit(element.facing)
    building.wall(name, _plate(element.position, out, element.width, element.thickness), **_target(element))
    building.part(name, "standup", element, light=element.light or moved(element.position, out, TARGET_LAMP_DISTANCE))


def drops(building: Building, name: str, element: DropTargets) -> None:
    """Add a bank of targets, numbered from left to right as seen from the playfield."""
    out = unit(element.facing)
    along = -out[1], out[0]  # to the right, as seen from the playfield
    for k in range(element.count):
        position = moved(element.position, along, (k - 0.5 * (element.count - 1)) * (element.width + element.gap))
        building.wall(f"{name} {k + 1}", _plate(position, out, element.width, element.thickness), **_target(element))
        light = moved(position, out, TARGET_LAMP_DISTANCE)
        building.part(f"{name} {k + 1}", "drop", element, group=element.group or name, step=k, light=light)


def darker(colour: str | None, fraction: float) -> str | None:
    """Return a colour mixed with a fraction of `DARK`."""
    if colour is None:
        return None
    parts = zip((colour[1:3], colour[3:5], colour[5:7]), (DARK[1:3], DARK[3:5], DARK[5:7]), strict=True)
    return "#" + "".join(f"{round(int(a, 16) + (int(b, 16) - int(a, 16)) * fraction):02x}" for a, b in parts)


def unit(direction: Vector) -> Vector:
    """Return a direction with length 1."""
    size = math.hypot(*direction)
    return direction[0] / size, direction[1] / size


def _target(element: Standup | DropTargets) -> dict[str, object]:
    return {"thickness": element.thickness, "material": "target", "colour": element.colour}


def _plate(face: Point, out: Vector, width: float, thickness: float) -> tuple[Point, Point]:
    """Return the centre line of a plate with round ends, which are part of its width; `face` is its front centre."""
    half = 0.5 * (width - thickness)
    middle = moved(face, out, -0.5 * thickness)
    along = -out[1], out[0]
    return moved(middle, along, -half), moved(middle, along, half)


def moved(point: Point, direction: Vector, distance: float) -> Point:
    """Return a point moved by a distance, m, along a unit vector."""
    return point[0] + direction[0] * distance, point[1] + direction[1] * distance


COIL_RISE_TIME = 0.03
"""s, rise time of the torque of a coil"""
RETURN_TORQUE = 0.058
"""torque of the return spring, as a fraction of the torque of the coil"""
HOLD_TORQUE, HOLD_ANGLE = 0.75, math.radians(6.0)
"""torque near the raised stop, as a fraction of the torque of the coil; and the angle to the stop, rad, within which it
applies"""
STOP_RESTITUTION = 0.3
"""restitution of a bat at its stops"""
PLUNGER_DEPTH = 0.012
"""m, length of a plunger's tip along its direction"""


def ball(building: Building, name: str, element: PinballBall) -> None:
    """Add a ball."""
    radius = building.ball_radius if element.radius is None else element.radius
    mass = building.ball_mass if element.mass is None else element.mass
    building.body(
        Ball(
            name=name,
            position=element.position,
            radius=radius,
            mass=mass,
            material=BALL_MATERIAL,
            colour=element.colour,
        )
    )
    building.part(name, "ball", at=element.position)


def flipper(building: Building, name: str, element: Flipper) -> None:
    """Add a bat and its drive."""
    building.body(
        Polygon(
            name=name,
            position=element.pivot,
            points=bat(element.length, element.base, element.tip),
            angle=element.stops[0],
            mass=element.mass,
            material="flipper",
            colour=element.colour,
        )
    )
    building.drives.append(_drive(name, element))
    building.part(name, "flipper", group=element.side or ("left" if element.pivot[0] < building.axis else "right"))


def plunger(building: Building, name: str, element: Plunger) -> None:
    """Add the tip of a rod and its drive."""
    (x, y), along = element.position, unit(element.direction)
    half = 0.5 * element.width
    tip = (0.0, half), (-PLUNGER_DEPTH, half), (-PLUNGER_DEPTH, -half), (0.0, -half)
    points = tuple((u * along[0] - v * along[1], u * along[1] + v * along[0]) for u, v in tip)
    building.body(Polygon(name=name, position=(x, y), points=points, material="wall", colour=element.colour))
    building.drives.append(
        PlungerDrive(
            kind="plunger",
            name=name,
            body=name,
            direction=element.direction,
            travel=element.travel,
            speed=element.speed,
        )
    )
    served = x + along[0] * 1.001 * building.ball_radius, y + along[1] * 1.001 * building.ball_radius
    building.part(name, "plunger", element, at=served)


def _drive(name: str, element: Flipper) -> TorqueDrive | StrokeDrive:
    """Return the drive of a bat: a stroke, or a coil that turns a rod of the mass and length of the bat."""
    held: dict[str, Any] = {"name": name, "body": name, "pivot": element.pivot, "stops": element.stops}
    if element.drive == "stroke":
        return StrokeDrive(kind="stroke", rate=element.rate, return_rate=element.return_rate, **held)
    return TorqueDrive(
        kind="torque",
        torque=element.torque,
        ramp=COIL_RISE_TIME,
        return_ratio=RETURN_TORQUE,
        hold_ratio=HOLD_TORQUE,
        hold_within=HOLD_ANGLE,
        bounce=STOP_RESTITUTION,
        moment=element.mass * element.length**2 / 3.0,
        **held,
    )


CLIMB_PIECE = 0.03
"""m, approximate length of the pieces of a curved climb; gravity has one direction on each"""
KICKER_LAMP_DISTANCE = 0.014
"""m, distance from the rim of a hole to the centre of its lamp"""
MOUTH_GAP = 0.006
"""m, distance between the two zones at the mouth of a ramp: one moves a ball to the layer of the ramp, the other to
the ground"""


def rollover(building: Building, name: str, element: Rollover) -> None:
    """Add the zone of a rollover wire."""
    building.zone(name, position=element.position, radius=element.radius, colour=element.colour)
    building.part(name, "rollover", element, light=element.light or element.position)


def spinner(building: Building, name: str, element: Spinner) -> None:
    """Add the zone under the plate of a spinner."""
    building.zone(
        name, points=_within(element.points, element.thickness), thickness=element.thickness, colour=element.colour
    )
    building.part(name, "spinner", element)


def kicker(building: Building, name: str, element: Kicker) -> None:
    """Add a zone that holds a ball."""
    building.zone(name, position=element.position, radius=element.radius, colour=element.colour, holds=True)
    building.dot(element.colour, element.position, 1.25 * element.radius)
    building.dot(DARK, element.position, element.radius)
    light = element.light or (
        moved(element.position, unit(element.out), element.radius + KICKER_LAMP_DISTANCE) if any(element.out) else None
    )
    building.part(name, "kicker", element, out=element.out, at=element.position, light=light)


def drain(building: Building, name: str, element: Drain) -> None:
    """Add the zone of a drain."""
    building.zone(name, points=element.points, thickness=element.thickness, colour=element.colour)
    building.part(name, "drain", element)


def ramp(building: Building, name: str, element: Ramp) -> None:
    """Add a ramp.

    On the climb, an acceleration of (5/7) g · rise/climb down the ramp is added to gravity. The ground has walls along
    the climb and across its top, because a ball cannot roll below the ramp there.
    """
    layer = element.layer or name
    line = building.line(element.points)
    whole, half = length_of(line), 0.5 * (element.width + element.thickness)
    rail: dict[str, Any] = {"thickness": element.thickness, "material": "wall", "colour": element.colour}
    for side, aside in (("left", half), ("right", -half)):
        building.wall(f"{name} {side} rail", beside(line, aside), layers=(layer,), **rail)
    building.paint(element.floor, (*beside(line, half), *reversed(beside(line, -half))))
    climb = part_of(line, 0.0, element.climb)
    left, right = beside(climb, half), beside(climb, -half)
    (ax, ay), (bx, by) = climb[-2:]
    ahead = half / math.dist((ax, ay), (bx, by))
    ridge = bx + (bx - ax) * ahead, by + (by - ay) * ahead  # a straight wall could stop a ball that comes from above
    building.wall(f"{name} sides", (*left, ridge, *reversed(right)), **rail)

    depth, half_depth = MIN_ZONE_DEPTH, 0.5 * MIN_ZONE_DEPTH
    mouth = depth + MOUTH_GAP + half_depth
    building.zone(
        f"{name} foot",
        points=_across(line, half_depth, element.width - depth),
        thickness=depth,
        layers=(layer,),
        to_layer=GROUND,
    )
    building.zone(name, points=_across(line, mouth, element.width - depth), thickness=depth, to_layer=layer)
    for k, piece in enumerate(_pieces(line, mouth, element.climb)):
        left, right = beside(piece, half), beside(piece, -half)
        outline = left[0], left[-1], right[-1], right[0]  # outside it in a bend, a ball would overlap a rail
        building.zone(
            f"{name} climb {k + 1}",
            points=outline,
            layers=(layer,),
            gravity=_pull(building, piece, element.rise / element.climb),
        )
    end = f"{name} exit"
    building.zone(
        end,
        points=_across(line, whole - half_depth, element.width - depth),
        thickness=depth,
        layers=(layer,),
        to_layer=GROUND,
    )
    group = element.group or name
    building.part(name, "ramp", group=group, step=0)
    building.part(
        end, "ramp", group=group, step=1, score=element.score, light=element.light or line[0], colour=element.colour
    )


def _pieces(line: Sequence[Point], begin: float, end: float) -> list[tuple[Point, ...]]:
    """Return a part of a line in pieces that are nearly straight, and too long for a ball to cross in one step."""
    whole = part_of(line, begin, end)
    count = 1 if len(whole) == 2 else max(round((end - begin) / CLIMB_PIECE), 1)
    cuts = [begin + (end - begin) * k / count for k in range(count + 1)]
    return [part_of(line, a, b) for a, b in pairwise(cuts)]


def _pull(building: Building, piece: tuple[Point, ...], steepness: float) -> Vector:
    """Return gravity on a piece of a climb, m/s²; its work between the ends of the piece is that of the rise."""
    (ax, ay), (bx, by) = piece[0], piece[-1]
    size = math.dist(piece[0], piece[-1])
    deceleration = GRAVITY * ROLLING_FACTOR * steepness * length_of(piece) / size**2
    return building.gravity[0] - deceleration * (bx - ax), building.gravity[1] - deceleration * (by - ay)


def _across(line: tuple[Point, ...], along: float, width: float) -> tuple[Point, Point]:
    """Return the ends of a segment of a width, m, that crosses a line at right angles at a distance along it, m."""
    epsilon = 1e-4
    piece = part_of(line, along - epsilon, along + epsilon)
    a, b = piece[0], piece[-1]
    return beside((a, b), 0.5 * width)[0], beside((a, b), -0.5 * width)[0]


def _within(points: tuple[Point, Point], thickness: float) -> tuple[Point, Point]:
    """Return the centre line of a zone whose length, including its round ends, is the distance of two points."""
    (ax, ay), (bx, by) = points
    size = math.dist(*points)
    cut = 0.5 * thickness / size
    return (ax + (bx - ax) * cut, ay + (by - ay) * cut), (bx - (bx - ax) * cut, by - (by - ay) * cut)
