"""Field: the ground, and the tanks on it; what blasts do to both, and how both settle."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sandbox.action import Action, Move, Remove, Reshape
from sandbox.games.artillery.ground import Crater, Ground, Loose
from sandbox.games.artillery.landscape import columns_of
from sandbox.games.artillery.preset import GROUND
from sandbox.games.artillery.tanks import PER_METRE, SAFE_FALL, Tank, Tanks
from sandbox.games.artillery.terrain import Artillery
from sandbox.games.artillery.weapons import WRECK, Weapon
from sandbox.games.rules import Seen, UnfitError
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.description.base import Point
from sandbox.scene.description.game_tables import table_of
from sandbox.scene.scene import Scene

STILL = 0.1
"""m/s: slower, tanks count as at rest"""
PATIENCE = 8.0
"""s that tanks are given to come to rest"""
PAUSE = 0.5
"""s that settling takes, at least"""
LIFT = 0.01
"""m above the ground: who was under it is put there"""


class Blast(NamedTuple):
    """Where and when a shell went off, for who draws it."""

    time: float
    """s"""
    place: Point
    """m"""
    radius: float
    """m"""
    dirt: bool


class Field:
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
            raise UnfitError("artillery needs [artillery] with players, and a [terrain] that they stand on")
        self.artillery = artillery
        self.ground = Ground(np.asarray(columns[0]), columns[1])
        self.tanks = Tanks(artillery, bodies.names)
        self.falling: list[tuple[float, tuple[Loose, ...]]] = []
        """(s, dirt): since when it falls"""
        self.blasts: list[Blast] = []
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
        self.blasts.append(Blast(time, place, weapon.radius, dirt))
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

    def settle(self, seen: Seen, shooter: Tank) -> tuple[bool, list[Action]]:
        """Wait until dirt has fallen and tanks stand; hurt who fell, end who left the ground; tell whether it is done.

        Args:
            seen: what there is now.
            shooter: who has brought it about.
        """
        actions = self._lifted(seen.time)
        waited = seen.time - self._since
        still = self._fallen(seen.time) and self.tanks.at_rest(seen.frame, STILL)
        if waited < PAUSE or (waited < PATIENCE and not still):
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
