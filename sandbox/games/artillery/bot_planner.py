"""Bot: whom it shoots at, with what, and how well. It errs by its skill, at random from the scene's seed."""

import math

import numpy as np

from sandbox.games.artillery.battlefield import WEAPONS, Battlefield, Tank, Tanks
from sandbox.games.artillery.targeting import AimSolver, FiringSolution, TargetingProblem
from sandbox.scene.description.world import World
from sandbox.scene.random_streams import Stream, draws

ANGLE_ERROR, SPEED_ERROR = math.radians(6.0), 0.08
"""Standard deviations of angle, rad, and speed, as a share of it, of who has no skill at all."""
NEAR = 0.2
"""of the crater's radius: a shot that comes down as near to the target as this is as good as any"""
BIG = 0.5
"""the chance of a shot that costs, where there is money for it"""
WORK = 6_000
"""of the search for a shot, at each look of the rules: 1 to 4 ms, so that a window stays smooth, and some 80 looks"""


def hit_probabilities(seed: int, turn: int) -> np.random.Generator:
    """Return the chances of a turn, which are those of no other."""
    return draws(Stream.SHELL, seed, turn)


def choose_shot(tanks: Tanks, shooter: Tank, random: np.random.Generator) -> tuple[Tank, int]:
    """Return whom to shoot at, the weakest, of equals the nearest; and the number of the weapon."""
    others = [tank for tank in tanks.alive if tank is not shooter]
    target = min(others, key=lambda tank: (tank.health, math.dist(tank.place, shooter.place)))
    able = [k for k, weapon in enumerate(WEAPONS) if weapon.kind == "shell" and 0 < weapon.cost <= shooter.money]
    big = bool(random.uniform() < BIG)
    return target, able[-1] if able and big and target.health > WEAPONS[0].damage else 0


class BotPlanner:
    """A bot's thought about its turn, by and by. A copy goes on by itself."""

    def __init__(
        self, world: World, field: Battlefield, shooter: Tank, random: np.random.Generator, skill: float | None = None
    ) -> None:
        """Choose a target and a weapon, and begin to look for the shot.

        Args:
            world: with the wind of the turn.
            field: as it lies.
            shooter: who thinks.
            random: the chances of the turn.
            skill: 0 to 1; by default that of the shooter, who is a bot.
        """
        target, self.weapon = choose_shot(field.tanks, shooter, random)
        self._full = field.artillery.speed
        self._lack = 1.0 - ((shooter.player.bot or 0.0) if skill is None else skill)
        self._errors = random.standard_normal(2).tolist()
        self._search = AimSolver(
            TargetingProblem(
                world=world,
                muzzle=field.tanks.muzzle(shooter),
                ground=field.ground,
                edges=field.artillery.edges,
                full=self._full,
                at=target.place[0],
                near=NEAR * WEAPONS[self.weapon].radius,
            )
        )

    def go_on(self, work: int = WORK) -> FiringSolution | None:
        """Think on, for so much work; return the shot once there is one: the best, but for the bot's error."""
        aim = self._search.go_on(work)
        if aim is None:
            return None
        turned, faster = self._errors
        angle = min(max(aim.angle + self._lack * ANGLE_ERROR * turned, 0.0), math.pi)
        speed = min(max(aim.speed * (1.0 + self._lack * SPEED_ERROR * faster), 0.0), self._full)
        return aim._replace(angle=angle, speed=speed)
