"""Bot: whom it shoots at, with what, and how well. It errs by its skill, at random from the scene's seed."""

import math

import numpy as np

from sandbox.games.artillery.aim import Aim, best_aim
from sandbox.games.artillery.field import Field
from sandbox.games.artillery.tanks import Tank, Tanks
from sandbox.games.artillery.weapons import WEAPONS
from sandbox.scene.model import World
from sandbox.trajectory import FloatArray

STREAM = 12
"""of the scene's seed; ground has another"""
ANGLE_ERROR, SPEED_ERROR = math.radians(6.0), 0.08
"""Standard deviations of angle, rad, and speed, as a share of it, of who has no skill at all."""
NEAR = 0.2
"""of the crater's radius: a shot that comes down as near to the target as this is as good as any"""
BIG = 0.5
"""the chance of a shot that costs, where there is money for it"""


def chances(seed: int, turn: int) -> np.random.Generator:
    """Return the chances of a turn, which are those of no other."""
    return np.random.Generator(np.random.PCG64([seed, STREAM, turn]))


def choose(tanks: Tanks, shooter: Tank, random: np.random.Generator) -> tuple[Tank, int]:
    """Return whom to shoot at, the weakest, of equals the nearest; and the number of the weapon."""
    others = [tank for tank in tanks.alive if tank is not shooter]
    target = min(others, key=lambda tank: (tank.health, math.dist(tank.place, shooter.place)))
    able = [k for k, weapon in enumerate(WEAPONS) if weapon.kind == "shell" and 0 < weapon.cost <= shooter.money]
    big = bool(random.uniform() < BIG)
    return target, able[-1] if able and big and target.health > WEAPONS[0].damage else 0


def aimed(world: World, field: Field, shooter: Tank, target: Tank, radius: float, random: np.random.Generator) -> Aim:
    """Return the shot that a bot takes at a target: the best there is, but for its error."""
    full = field.artillery.speed

    def muzzle(angle: FloatArray) -> FloatArray:
        return field.tanks.muzzle(shooter, angle)

    aim = best_aim(world, muzzle, field.ground, field.artillery.edges, full, target.place, NEAR * radius)
    lack = 1.0 - (shooter.player.bot or 0.0)
    turned, faster = random.standard_normal(2).tolist()
    angle = min(max(aim.angle + lack * ANGLE_ERROR * turned, 0.0), math.pi)
    speed = min(max(aim.speed * (1.0 + lack * SPEED_ERROR * faster), 0.0), full)
    return aim._replace(angle=angle, speed=speed)
