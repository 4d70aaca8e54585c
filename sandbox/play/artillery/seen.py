"""Seen: a game of artillery as it is drawn at one moment."""

import math
from dataclasses import replace

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.games.artillery.flight import Flight, landing
from sandbox.games.artillery.rules import ArtilleryRules
from sandbox.games.artillery.tanks import WHOLE
from sandbox.games.rules import Rules
from sandbox.play.artillery.gunnery import Burst, Clod, Gun, Gunnery
from sandbox.play.sight import Sight

BURST = 0.7
"""s that a blast is seen"""
TRACED = 0.03
"""s between two points of a tracer"""
LONGEST_TRACER = 10.0
"""s, of a shot that comes down nowhere"""


def over(rules: Rules, sight: Sight, present: bool = True) -> Sight:
    """Return a sight with what a game adds to it; of other games than artillery the sight as it is.

    Args:
        rules: as they stand.
        sight: of the scene.
        present: the sight is of now. The rules know no other time: then all that they add is what tanks look like.
    """
    if not isinstance(rules, ArtilleryRules):
        return sight
    if present:
        return replace(sight, gunnery=gunnery_of(rules, sight.frame.time))
    tanks = rules.field.tanks
    guns = tuple(Gun(tank.number, tank.name, tank.angle, tank.power, None, aiming=False) for tank in tanks.every)
    return replace(sight, gunnery=Gunnery(guns, tanks.size, wind=None))


def gunnery_of(rules: ArtilleryRules, time: float) -> Gunnery:
    """Return what is drawn at a time, s."""
    field, barrage = rules.field, rules.barrage
    aiming = rules.phase == "aim" and rules.over is None
    guns = tuple(
        Gun(
            number=tank.number,
            name=tank.name,
            angle=tank.angle,
            power=tank.power,
            health=tank.health / WHOLE,
            aiming=aiming and tank is rules.shooter,
        )
        for tank in field.tanks.alive
    )
    shot = rules.shots[-1] if rules.shots else None
    landed = None if shot is None or shot.place is None or shot.exact is None else (shot.place, shot.exact)
    return Gunnery(
        guns=guns,
        size=field.tanks.size,
        wind=rules.world.wind[0],
        ways=tuple(np.asarray(way) for way in barrage.ways.values() if len(way) > 1),
        flying=tuple(shell.number for shell in barrage.shells if shell.number is not None),
        bursts=tuple(
            Burst(max(time - each.time, 0.0), each.place, each.radius, each.dirt)
            for each in field.blasts
            if time - each.time <= BURST
        ),
        clods=_clods(rules, time),
        tracer=_tracer(rules) if aiming and rules.artillery.tracer else None,
        landed=landed,
    )


def _clods(rules: ArtilleryRules, time: float) -> tuple[Clod, ...]:
    """Return the dirt that is in the air: it falls freely, whatever the air."""
    ground, pull = rules.field.ground, math.hypot(*rules.world.gravity)
    clods = []
    for since, loose in rules.field.falling:
        fallen = 0.5 * pull * max(time - since, 0.0) ** 2
        for each in loose:
            if fallen < each.drop:
                left = each.column * ground.each
                bottom, top = each.bottom - fallen, each.top - fallen
                clods.append(Clod(left, left + ground.each, bottom, top, each.bottom - each.drop))
    return tuple(clods)


def _tracer(rules: ArtilleryRules) -> FloatArray | None:
    """Return the way of a shot as the gun is set now, as far as the first side or the ground."""
    tank, field = rules.shooter, rules.field
    start = field.tanks.muzzle(tank).at(np.array([tank.angle]))[0]
    velocity = rules.speed(tank) * np.array([math.cos(tank.angle), math.sin(tank.angle)])
    flight, down = Flight(rules.world, start, velocity), landing(rules.world, start, velocity, field.ground)
    until = down.time if down is not None else LONGEST_TRACER
    return np.stack([flight.at(float(time))[0] for time in np.arange(0.0, until, TRACED)])
