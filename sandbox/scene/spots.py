"""Spots: the named points of a table, which rules speak of and the window draws; and the games there are."""

from typing import Literal

from sandbox.scene.part import Name, Part, Point

TableGame = Literal["8-ball", "9-ball", "three-cushion", "straight-rail", "snooker", "free"]
"""Games of billiards, which need a table."""

Game = Literal[
    TableGame,
    "artillery",
    "curling",
    "landing",
    "pinball",
]
"""All games; those that need no table are in `games.registry.RULES` too."""


class Spot(Part):
    """A point with a name: `head`, `foot` and `centre` of a table, in snooker the colours' own."""

    name: Name
    """by which rules speak of it"""
    position: Point
    """where it is, m"""
