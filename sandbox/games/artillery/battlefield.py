"""Field: the ground, and the tanks on it; what blasts do to both, and how both settle.

Weapons: what can be fired, and at what price. WEAPONS is the table of them.

Tanks: who fights, what each has left, and what blasts and falls do to them.
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
from sandbox.scene.description.base import Point
from sandbox.scene.description.game_tables import table_of
from sandbox.scene.scene import Scene
from sandbox.trajectory import Frame

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


REST_SPEED = 0.1
"""m/s: slower, tanks count as at rest"""
SETTLE_TIMEOUT = 8.0
"""s that tanks are given to come to rest"""
PAUSE = 0.5
"""s that settling takes, at least"""
LIFT = 0.01
"""m above the ground: who was under it is put there"""


class Explosion(NamedTuple):
    """Where and when a shell went off, for who draws it."""

    time: float
    """s"""
    place: Point
    """m"""
    radius: float
    """m"""
    dirt: bool


class Battlefield:
    """A ground with tanks on it."""

    def __init__(self, scene: Scene, bodies: Bodies) -> None:
        """Lay it out.

        Raises:
            UnfitError: the scene has no `[artillery]`, or no ground and tanks for it.
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
        """(s, dirt): since when it falls"""
        self.blasts: list[Explosion] = []
        """of this turn"""
        self.cues: list[str] = []
        """names of sounds"""
        self.pull = math.hypot(*scene.world.gravity)
        """m/s², with which dirt falls"""
        self._since = 0.0
        self._stood: dict[str, float] = {}  # how high each tank stood when it began to fall, m

    def blast(self, time: float, shooter: Tank, place: Point, weapon: Weapon) -> list[Action]:
        """Take ground away or bring some, and hurt who is near; who is then out goes off as well."""
        dirt = weapon.kind == "dirt"
        change = (self.ground.with_heap if dirt else self.ground.without)(place, weapon.radius)
        self.cues.append("dirt" if dirt else "blast")
        self.blasts.append(Explosion(time, place, weapon.radius, dirt))
        actions = self._changed(time, change)
        hurt = self.tanks.blast(shooter, place, weapon)
        return actions + self._out(time, [tank for tank in hurt if not tank.alive])

    def _out(self, time: float, dead: Sequence[Tank]) -> list[Action]:
        """Take tanks out that have no health left; each goes off itself, and may take others with it."""
        actions: list[Action] = []
        for tank in dead:
            actions.append(Remove(time=time, body=tank.name))
            actions += self.blast(time, tank, tank.place, WRECK)
        return actions

    def _changed(self, time: float, change: Crater) -> list[Action]:
        """Go on with another ground, and lift who would be under it."""
        self.ground = change.ground
        if change.loose:
            self.falling.append((time, change.loose))
        return [Reshape(time=time, thing=GROUND, points=self.ground.points), *self._lifted(time)]

    def _lifted(self, time: float) -> list[Action]:
        """Put tanks on the ground that they are in."""
        actions: list[Action] = []
        for tank in self.tanks.alive:
            x, y = tank.place
            if 0.0 <= x <= self.ground.width and y < self.ground.surface(x):
                width, height = self.tanks.size
                tank.place = (x, self.ground.under(x, 0.5 * width) + 0.5 * height + LIFT)
                actions.append(Move(time=time, body=tank.name, position=tank.place, velocity=(0.0, 0.0)))
        return actions

    def begin_to_settle(self, time: float) -> None:
        """Note how high all stand who may fall now."""
        self._since = time
        self._stood = {tank.name: tank.place[1] for tank in self.tanks.alive}

    def settle(self, seen: StepInfo, shooter: Tank) -> tuple[bool, list[Action]]:
        """Wait until dirt has fallen and tanks stand; hurt who fell, end who left the ground; tell whether it is done.

        Args:
            seen: what there is now.
            shooter: who has brought it about.
        """
        actions = self._lifted(seen.time)
        waited = seen.time - self._since
        still = self._fallen(seen.time) and self.tanks.at_rest(seen.frame, REST_SPEED)
        if waited < PAUSE or (waited < SETTLE_TIMEOUT and not still):
            return False, actions
        self.falling.clear()
        dead = []
        for tank in self.tanks.alive:
            fall = self._stood.get(tank.name, tank.place[1]) - tank.place[1]
            beside = not 0.0 <= tank.place[0] <= self.ground.width
            if beside or fall > SAFE_FALL:
                self.tanks.hurt(tank, math.inf if beside else PER_METRE * (fall - SAFE_FALL), shooter)
                dead += [] if tank.alive else [tank]
        self.begin_to_settle(seen.time)
        return not dead, actions + self._out(seen.time, dead)

    def _fallen(self, time: float) -> bool:
        """Tell whether all dirt has come down that falls."""
        drops = [(since, each.drop) for since, loose in self.falling for each in loose]
        return not self.pull or all(0.5 * self.pull * (time - since) ** 2 >= drop for since, drop in drops)
