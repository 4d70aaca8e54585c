"""Spots: the named points of a table, which rules speak of and the window draws; and which games it can play."""

from typing import Literal

from sandbox.scene.part import Name, Part, Point

Game = Literal["8-ball", "9-ball", "three-cushion", "straight-rail", "snooker", "free"]


class Spot(Part):
    """A point with a name: `head`, `foot` and `centre` of a table, in snooker the colours' own."""

    name: Name
    position: Point
