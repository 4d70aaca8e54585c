"""Plunger: how a body is drawn back along a line, and springs forward."""

import math
from typing import NamedTuple

from sandbox.scene.drives import PlungerDrive
from sandbox.scene.part import Point


class Pulled(NamedTuple):
    """Where a substep brings a body."""

    pull: float
    """how far it is drawn back, m"""
    rate: float
    """how fast that grows, m/s"""
    arrives: bool
    """It stands still from the end of the substep on."""


def asked(before: float, level: float, rate: float) -> float:
    """Return the rate, m/s, with which a body goes on at another level: a hand that lets go has stood still."""
    return 0.0 if not level > 0.0 and before > 0.0 else rate


def pulled(drive: PlungerDrive, level: float, pull: float, rate: float, h: float) -> Pulled:
    """Draw a body, or let it spring, from a pull, m, and its rate, m/s, for h, s."""
    wanted = level * drive.travel
    if pull == wanted:  # which no spring has reached that was not halted there
        return Pulled(pull, 0.0, False)
    return _drawn(drive, wanted, pull, h) if wanted > 0.0 else _sprung(drive, pull, rate, h)


def _drawn(drive: PlungerDrive, wanted: float, pull: float, h: float) -> Pulled:
    """Go towards the wanted pull, m, as fast as a hand does."""
    rate = drive.travel / drive.draw_time
    arrives = abs(wanted - pull) <= rate * h
    rate = math.copysign(rate, wanted - pull)
    return Pulled(wanted if arrives else pull + rate * h, rate, arrives)


def _sprung(drive: PlungerDrive, pull: float, rate: float, h: float) -> Pulled:
    """Spring forward for a substep, or onto the stop, at the speed of that moment."""
    omega = drive.speed / drive.travel
    cos, sin = math.cos(omega * h), math.sin(omega * h)
    there, pace = pull * cos + rate / omega * sin, rate * cos - pull * omega * sin
    if there <= 0.0:
        return Pulled(0.0, -math.hypot(pull * omega, rate), True)
    return Pulled(there, pace, False)


def along(drive: PlungerDrive) -> Point:
    """Return the direction in which it strikes, of length 1."""
    x, y = drive.direction
    length = math.hypot(x, y)
    return x / length, y / length


def placed(home: Point, direction: Point, pull: float, rate: float) -> tuple[Point, Point]:
    """Return where a body is, m, and how fast, m/s, that strikes in a direction from its home, m."""
    vx, vy = 0.0 - rate * direction[0], 0.0 - rate * direction[1]  # never −0
    return (home[0] - pull * direction[0], home[1] - pull * direction[1]), (vx, vy)
