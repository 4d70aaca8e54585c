"""Aim: what is drawn of the next stroke, as a plain value."""

from dataclasses import dataclass

from sandbox.play.billiards.forecast import Forecast
from sandbox.scene.description.base import Point


@dataclass(frozen=True, eq=False)
class Aim:
    """A cue behind a ball, and what its stroke would lead to."""

    ball: int
    """number of the one that is struck"""
    place: Point
    """of its centre, m"""
    angle: float
    """rad, of the cue's way, from +x"""
    side: float
    """of the radius, where the tip is to the right of the middle"""
    back: float
    """m, how far the cue is drawn back"""
    forecast: Forecast | None = None
    carried: bool = False
    """the ball is in a hand: no cue is behind it"""
    refused: bool = False
    """it may not be put where the hand is"""
    called: tuple[Point, float] | None = None
    """centre and radius of the pocket that was called, m"""
    nominated: int | None = None
    """number of the ball that was called"""
