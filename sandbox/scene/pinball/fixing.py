"""Fixing: what a table's walls, rubbers, bumpers, slingshots and targets are made of."""

import math

from sandbox.scene.kick import Kick
from sandbox.scene.part import Point, Vector
from sandbox.scene.pinball.building import Building
from sandbox.scene.pinball.element import Line
from sandbox.scene.pinball.painted import Art
from sandbox.scene.pinball.solids import Bumper, DropTargets, Gate, PinballPost, PinballWall, Slingshot, Standup

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


def darker(colour: str | None, share: float) -> str | None:
    """Return a colour so much of the way to the dark."""
    if colour is None:
        return None
    parts = zip((colour[1:3], colour[3:5], colour[5:7]), (DARK[1:3], DARK[3:5], DARK[5:7]), strict=True)
    return "#" + "".join(f"{round(int(a, 16) + (int(b, 16) - int(a, 16)) * share):02x}" for a, b in parts)


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
