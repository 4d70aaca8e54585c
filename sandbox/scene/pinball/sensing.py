"""Sensing: the zones, rails and lamps of a table's rollovers, spinners, kicker holes, ramps and drains."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

from sandbox.scene.part import Point, Vector
from sandbox.scene.pinball.building import Building
from sandbox.scene.pinball.fixing import DARK, moved, unit
from sandbox.scene.pinball.rolling import ROLLING, G
from sandbox.scene.pinball.rounding import beside, length_of, part_of
from sandbox.scene.pinball.sensed import LEAST_DEPTH, Drain, Kicker, Ramp, Rollover, Spinner
from sandbox.scene.surfaced import GROUND

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
