"""Battlefield: terrain, tanks and weapons, and the effects of explosions and falls on them.

The battlefield returns actions for the engine: it reshapes the wall of the terrain, moves buried tanks, and removes
destroyed ones. Lengths are in m. Health, money and points are plain numbers.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from sandbox.action import Action, Move, Remove, Reshape
from sandbox.arrays import FloatArray
from sandbox.games.artillery.scene import GROUND, Artillery, Player, columns_of
from sandbox.games.artillery.terrain import Crater, Ground, LooseDirt
from sandbox.games.contract import StepInfo, UnsuitableSceneError
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point
from sandbox.scene.description.game_tables import table_of
from sandbox.trajectory import Frame

Ammunition = Literal["shell", "dirt", "cluster", "roller"]
"""A shell digs a crater; dirt adds a heap; a cluster splits at its highest point; a roller rolls until it rests or
hits a tank."""


class Weapon(NamedTuple):
    """A kind of shell."""

    name: str
    kind: Ammunition
    radius: float
    """m, of the crater or the disc of dirt"""
    damage: float
    """health that a direct hit takes; it decreases to 0 at twice the radius"""
    cost: int
    """price of a shot"""


WEAPONS: tuple[Weapon, ...] = (
    Weapon("shell", "shell", 5.0, 35.0, 0),
    Weapon("big shell", "shell", 9.0, 55.0, 300),
    Weapon("cluster", "cluster", 4.0, 25.0, 250),
    Weapon("roller", "roller", 5.5, 50.0, 150),
    Weapon("dirt", "dirt", 7.0, 0.0, 100),
)

WRECK = Weapon("wreck", "shell", 4.0, 30.0, 0)
"""Blast of a destroyed tank."""

FRAGMENT_COUNT = 5
"""number of fragments of a cluster"""
FRAGMENT_SPREAD = 3.0
"""m/s, difference of the horizontal velocities of neighbouring fragments"""


FULL_HEALTH = 100.0
"""initial health of a tank"""
PER_KILL = 100
"""points for destroying a tank, in addition to one for each point of health"""
MONEY_PER_HEALTH = 5
"""money for each point of health taken"""
BARREL_LENGTH = 0.75
"""distance from centre to muzzle, in widths of a tank"""
SAFE_FALL, FALL_DAMAGE = 1.0, 3.0
"""m that a tank may fall without damage, and health lost per metre beyond that"""


class Muzzle(NamedTuple):
    """Muzzle of a gun: for each angle of the barrel, a point on a circle around the tank."""

    centre: Point
    """m"""
    reach: float
    """m, radius of the circle"""

    def at(self, angle: FloatArray) -> FloatArray:
        """Return the positions (K, 2), m, at angles (K,), rad."""
        return np.asarray(np.array(self.centre) + self.reach * np.column_stack((np.cos(angle), np.sin(angle))))


@dataclass
class Tank:
    """A player's tank."""

    player: Player
    number: int
    """index of its body"""
    money: int
    angle: float
    """of the barrel, rad, anticlockwise from the right"""
    power: float = 0.6
    """fraction of full speed"""
    weapon: int = 0
    health: float = FULL_HEALTH
    points: int = 0
    position: Point = (0.0, 0.0)
    """m, of its centre"""

    @property
    def name(self) -> str:
        """Name of the player."""
        return self.player.name

    @property
    def alive(self) -> bool:
        """Whether the tank has health left."""
        return self.health > 0.0


class Tanks:
    """All tanks of a game, in the order of their turns."""

    def __init__(self, artillery: Artillery, names: tuple[str, ...]) -> None:
        """Create the tanks; `names` are the names of all bodies, in order."""
        self.size = artillery.tank
        self.radius = 0.5 * max(artillery.tank)
        """m, radius of the disc around a tank in which a shell hits it"""
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
        """Tanks with health left."""
        return [tank for tank in self.every if tank.alive]

    @property
    def discs(self) -> FloatArray:
        """(M, 3) m, centres and radii of the tanks that are alive."""
        return np.array([(*tank.position, self.radius) for tank in self.alive]).reshape(-1, 3)

    def update(self, frame: Frame) -> None:
        """Update the positions of the tanks."""
        for tank in self.every:
            if frame.present[tank.number]:
                x, y = frame.position[tank.number].tolist()
                tank.position = (x, y)

    def at_rest(self, frame: Frame, speed: float) -> bool:
        """Return whether no tank that is alive moves faster than a speed, m/s."""
        indices = [tank.number for tank in self.alive]
        return bool((np.hypot(*frame.velocity[indices].T) <= speed).all())

    def muzzle(self, tank: Tank) -> Muzzle:
        """Return the muzzle of a tank."""
        return Muzzle(tank.position, BARREL_LENGTH * self.size[0])

    def blast(self, shooter: Tank, position: Point, weapon: Weapon) -> list[Tank]:
        """Damage the tanks near an explosion, and reward the shooter; return the damaged tanks."""
        hurt = []
        for tank in self.alive:
            distance = max(math.dist(tank.position, position) - self.radius, 0.0)
            fraction = 1.0 - distance / (2.0 * weapon.radius)
            if fraction > 0.0 and weapon.damage > 0.0:
                self.hurt(tank, weapon.damage * fraction, shooter)
                hurt.append(tank)
        return hurt

    def hurt(self, tank: Tank, damage: float, shooter: Tank) -> None:
        """Take health from a tank and reward the shooter; damage to its own tank costs the shooter points."""
        taken = min(damage, tank.health)
        tank.health -= taken
        points = round(taken) + (0 if tank.alive else PER_KILL)
        shooter.points += points if tank is not shooter else -points
        shooter.money += MONEY_PER_HEALTH * round(taken) if tank is not shooter else 0


REST_SPEED = 0.1
"""m/s: below this speed, a tank counts as at rest"""
SETTLE_TIMEOUT = 8.0
"""s after which settling ends even if tanks still move"""
MIN_SETTLING_TIME = 0.5
"""s, minimum duration of settling"""
TERRAIN_CLEARANCE = 0.01
"""m, clearance above the terrain at which buried tanks and new rollers are placed"""


class Blast(NamedTuple):
    """An explosion, for the view."""

    time: float
    """s"""
    position: Point
    """m"""
    radius: float
    """m"""
    dirt: bool


class Battlefield:
    """Terrain with tanks."""

    def __init__(self, scene: Scene, bodies: Bodies) -> None:
        """Create the battlefield of a scene.

        Raises:
            UnsuitableSceneError: the scene has no `[artillery]`, or no ground and tanks for it.
        """
        wall = next((wall for wall in scene.walls if wall.name == GROUND), None)
        columns = None if wall is None else columns_of(wall.points)
        artillery = table_of(scene, Artillery)
        if artillery is None or columns is None:
            raise UnsuitableSceneError("artillery needs [artillery] with players, and a [terrain] that they stand on")
        self.artillery = artillery
        self.ground = Ground(np.asarray(columns[0]), columns[1])
        self.tanks = Tanks(artillery, bodies.names)
        self.falling: list[tuple[float, tuple[LooseDirt, ...]]] = []
        """start of the fall, s, and the falling dirt"""
        self.blasts: list[Blast] = []
        """explosions of this turn"""
        self.cues: list[str] = []
        """names of sounds"""
        self.pull = math.hypot(*scene.world.gravity)
        """m/s², acceleration of falling dirt"""
        self._since = 0.0
        self._heights_before: dict[str, float] = {}  # height of each tank at the start of settling, m

    def blast(self, time: float, shooter: Tank, position: Point, weapon: Weapon) -> list[Action]:
        """Apply an explosion: carve or add terrain, and damage tanks in range; destroyed tanks explode in turn."""
        dirt = weapon.kind == "dirt"
        change = (self.ground.with_heap if dirt else self.ground.without)(position, weapon.radius)
        self.cues.append("dirt" if dirt else "blast")
        self.blasts.append(Blast(time, position, weapon.radius, dirt))
        actions = self._replace_terrain(time, change)
        hurt = self.tanks.blast(shooter, position, weapon)
        return actions + self._remove_destroyed(time, [tank for tank in hurt if not tank.alive])

    def _remove_destroyed(self, time: float, destroyed: Sequence[Tank]) -> list[Action]:
        """Remove destroyed tanks; each explodes, which may destroy others."""
        actions: list[Action] = []
        for tank in destroyed:
            actions.append(Remove(time=time, body=tank.name))
            actions += self.blast(time, tank, tank.position, WRECK)
        return actions

    def _replace_terrain(self, time: float, change: Crater) -> list[Action]:
        """Replace the terrain, and lift buried tanks."""
        self.ground = change.ground
        if change.loose:
            self.falling.append((time, change.loose))
        return [Reshape(time=time, thing=GROUND, points=self.ground.points), *self._lift_buried(time)]

    def _lift_buried(self, time: float) -> list[Action]:
        """Place buried tanks on the terrain."""
        actions: list[Action] = []
        for tank in self.tanks.alive:
            x, y = tank.position
            if 0.0 <= x <= self.ground.width and y < self.ground.surface(x):
                width, height = self.tanks.size
                tank.position = (x, self.ground.under(x, 0.5 * width) + 0.5 * height + TERRAIN_CLEARANCE)
                actions.append(Move(time=time, body=tank.name, position=tank.position, velocity=(0.0, 0.0)))
        return actions

    def start_settling(self, time: float) -> None:
        """Start settling: record the heights from which tanks may fall."""
        self._since = time
        self._heights_before = {tank.name: tank.position[1] for tank in self.tanks.alive}

    def settle(self, info: StepInfo, shooter: Tank) -> tuple[bool, list[Action]]:
        """Wait until dirt and tanks are at rest, then apply falls; return whether settling is done, and the actions.

        Args:
            info: input of the step.
            shooter: tank whose shot caused the falls.
        """
        actions = self._lift_buried(info.time)
        waited = info.time - self._since
        still = self._has_dirt_landed(info.time) and self.tanks.at_rest(info.frame, REST_SPEED)
        if waited < MIN_SETTLING_TIME or (waited < SETTLE_TIMEOUT and not still):
            return False, actions
        self.falling.clear()
        destroyed = []
        for tank in self.tanks.alive:
            fall = self._heights_before.get(tank.name, tank.position[1]) - tank.position[1]
            beside = not 0.0 <= tank.position[0] <= self.ground.width
            if beside or fall > SAFE_FALL:
                self.tanks.hurt(tank, math.inf if beside else FALL_DAMAGE * (fall - SAFE_FALL), shooter)
                destroyed += [] if tank.alive else [tank]
        self.start_settling(info.time)
        return not destroyed, actions + self._remove_destroyed(info.time, destroyed)

    def _has_dirt_landed(self, time: float) -> bool:
        """Return whether all falling dirt has landed."""
        drops = [(since, each.drop) for since, loose in self.falling for each in loose]
        return not self.pull or all(0.5 * self.pull * (time - since) ** 2 >= drop for since, drop in drops)
