"""Shot planner of a bot: target, weapon and aim.

The search for the aim is spread over the steps of the game. Random errors are added to the result: normally
distributed, proportional to 1 − skill, and determined by the seed of the scene and the turn.
"""

import math

import numpy as np

from sandbox.games.artillery.battlefield import WEAPONS, Battlefield, Tank, Tanks
from sandbox.games.artillery.targeting import AimSolver, FiringSolution, TargetingProblem
from sandbox.scene.description.world import World
from sandbox.scene.random_streams import Stream, draws

ANGLE_ERROR, SPEED_ERROR = math.radians(6.0), 0.08
"""rad, and relative: standard deviations of the errors of angle and speed at skill 0"""
EQUAL_MISS_FRACTION = 0.2
"""fraction of the crater radius: shots that land nearer to the target than this are equally good"""
BIG_WEAPON_PROBABILITY = 0.5
"""probability of a weapon that costs money, if the tank can pay for it"""
WORK = 6_000
"""work of the search per step, as counted by `AimSolver.advance`: 1 to 4 ms, so that the window remains responsive; a
search takes about 80 steps"""


def turn_generator(seed: int, turn: int) -> np.random.Generator:
    """Return the random generator of a turn; generators of different turns are independent."""
    return draws(Stream.SHELL, seed, turn)


def choose_shot(tanks: Tanks, shooter: Tank, random: np.random.Generator) -> tuple[Tank, int]:
    """Return the target, the weakest tank or among equals the nearest, and the index of the weapon."""
    others = [tank for tank in tanks.alive if tank is not shooter]
    target = min(others, key=lambda tank: (tank.health, math.dist(tank.position, shooter.position)))
    affordable = [k for k, weapon in enumerate(WEAPONS) if weapon.kind == "shell" and 0 < weapon.cost <= shooter.money]
    big = bool(random.uniform() < BIG_WEAPON_PROBABILITY)
    return target, affordable[-1] if affordable and big and target.health > WEAPONS[0].damage else 0


class BotPlanner:
    """Incremental search for the shot of a turn. A copy is independent of the original."""

    def __init__(
        self, world: World, field: Battlefield, shooter: Tank, random: np.random.Generator, skill: float | None = None
    ) -> None:
        """Choose target and weapon, and prepare the search.

        Args:
            world: world with the wind of the turn.
            field: the present battlefield.
            shooter: tank of the bot.
            random: random generator of the turn.
            skill: 0 to 1; default: that of the shooter.
        """
        target, self.weapon = choose_shot(field.tanks, shooter, random)
        self._full_speed = field.artillery.speed
        self._error_scale = 1.0 - ((shooter.player.bot or 0.0) if skill is None else skill)
        self._errors = random.standard_normal(2).tolist()
        self._search = AimSolver(
            TargetingProblem(
                world=world,
                muzzle=field.tanks.muzzle(shooter),
                ground=field.ground,
                edges=field.artillery.edges,
                full_speed=self._full_speed,
                target_x=target.position[0],
                tolerance=EQUAL_MISS_FRACTION * WEAPONS[self.weapon].radius,
            )
        )

    def advance(self, work: int = WORK) -> FiringSolution | None:
        """Continue the search by an amount of work; return the shot once it is found, with the error of the bot."""
        aim = self._search.advance(work)
        if aim is None:
            return None
        angle_error, speed_error = self._errors
        angle = min(max(aim.angle + self._error_scale * ANGLE_ERROR * angle_error, 0.0), math.pi)
        speed = min(max(aim.speed * (1.0 + self._error_scale * SPEED_ERROR * speed_error), 0.0), self._full_speed)
        return aim._replace(angle=angle, speed=speed)
