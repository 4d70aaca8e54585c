"""Weapons: what can be fired, and at what price. WEAPONS is the table of them."""

from typing import Literal, NamedTuple

Kind = Literal["shell", "dirt", "cluster", "roller"]
"""A shell digs where it strikes; dirt heaps up there; a cluster comes apart at its highest point; a roller goes on
rolling until it is at rest, or meets a tank."""


class Weapon(NamedTuple):
    """One sort of shell."""

    name: str
    kind: Kind
    radius: float
    """m, of the crater or the disc of dirt"""
    damage: float
    """to a tank that is struck, of 100 that it has; it falls to nothing at twice the radius"""
    cost: int
    """each, of a player's money; a player without it fires shells"""


WEAPONS: tuple[Weapon, ...] = (
    Weapon("shell", "shell", 5.0, 35.0, 0),
    Weapon("big shell", "shell", 9.0, 55.0, 300),
    Weapon("cluster", "cluster", 4.0, 25.0, 250),
    Weapon("roller", "roller", 5.5, 50.0, 150),
    Weapon("dirt", "dirt", 7.0, 0.0, 100),
)

WRECK = Weapon("wreck", "shell", 4.0, 30.0, 0)
"""What becomes of a tank that has no health left."""

FRAGMENTS = 5
"""of a cluster"""
SPREAD = 3.0
"""m/s, between neighbouring fragments, across"""
