"""Tanks: who fights, what each has left, and what blasts and falls do to them."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.games.artillery.terrain import Artillery, Player
from sandbox.games.artillery.weapons import Weapon
from sandbox.scene.description.base import Point
from sandbox.trajectory import Frame

WHOLE = 100.0
"""health that a tank begins with"""
PER_KILL = 100
"""points for the last hit, beside one for each point of health taken"""
PER_POINT = 5
"""of money, for each point of health taken"""
BARREL = 0.75
"""of a tank's width, from its middle to the muzzle"""
SAFE_FALL, PER_METRE = 1.0, 3.0
"""m that a tank falls unharmed, and health that each more costs"""


class Muzzle(NamedTuple):
    """Where shells begin: on a circle about a gun."""

    centre: Point
    """m"""
    reach: float
    """m"""

    def at(self, angle: FloatArray) -> FloatArray:
        """Return where shells leave at angles (K,), rad; (K, 2) m."""
        return np.asarray(np.array(self.centre) + self.reach * np.column_stack((np.cos(angle), np.sin(angle))))


@dataclass
class Tank:
    """A player's tank."""

    player: Player
    number: int
    """of its body"""
    money: int
    angle: float
    """of the barrel, rad, anticlockwise from the right"""
    power: float = 0.6
    """share of full speed"""
    weapon: int = 0
    health: float = WHOLE
    points: int = 0
    place: Point = (0.0, 0.0)
    """m, of its centre"""

    @property
    def name(self) -> str:
        """The player's."""
        return self.player.name

    @property
    def alive(self) -> bool:
        """Whether it still fights."""
        return self.health > 0.0


class Tanks:
    """All tanks of a game, in the order of their turns."""

    def __init__(self, artillery: Artillery, names: tuple[str, ...]) -> None:
        """Line them up; `names` are those of the scene's bodies."""
        self.size = artillery.tank
        self.radius = 0.5 * max(artillery.tank)
        """m, of the disc that a shell has to strike"""
        middle = sum(player.position for player in artillery.players) / len(artillery.players)
        self.every = [
            Tank(
                player=player,
                number=names.index(player.name),
                money=artillery.money,
                angle=math.radians(60.0 if player.position < middle else 120.0),
            )
            for player in artillery.players
        ]

    @property
    def alive(self) -> list[Tank]:
        """Those that still fight."""
        return [tank for tank in self.every if tank.alive]

    @property
    def discs(self) -> FloatArray:
        """(M, 3) centre and radius of those that still fight, m."""
        return np.array([(*tank.place, self.radius) for tank in self.alive]).reshape(-1, 3)

    def see(self, frame: Frame) -> None:
        """Take note of where they are."""
        for tank in self.every:
            if frame.present[tank.number]:
                x, y = frame.position[tank.number].tolist()
                tank.place = (x, y)

    def at_rest(self, frame: Frame, speed: float) -> bool:
        """Tell whether none of those that fight moves faster than a speed, m/s."""
        those = [tank.number for tank in self.alive]
        return bool((np.hypot(*frame.velocity[those].T) <= speed).all())

    def muzzle(self, tank: Tank) -> Muzzle:
        """Return where a tank's shells leave."""
        return Muzzle(tank.place, BARREL * self.size[0])

    def blast(self, shooter: Tank, place: Point, weapon: Weapon) -> list[Tank]:
        """Hurt who stands near a blast, and reward the shooter; return who was hurt."""
        hurt = []
        for tank in self.alive:
            far = max(math.dist(tank.place, place) - self.radius, 0.0)
            share = 1.0 - far / (2.0 * weapon.radius)
            if share > 0.0 and weapon.damage > 0.0:
                self.hurt(tank, weapon.damage * share, shooter)
                hurt.append(tank)
        return hurt

    def hurt(self, tank: Tank, damage: float, shooter: Tank) -> None:
        """Take health from a tank. Who shoots at himself loses the points that others bring."""
        taken = min(damage, tank.health)
        tank.health -= taken
        points = round(taken) + (0 if tank.alive else PER_KILL)
        shooter.points += points if tank is not shooter else -points
        shooter.money += PER_POINT * round(taken) if tank is not shooter else 0
