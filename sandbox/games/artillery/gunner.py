"""Gunner: how keys set a gun. A tap moves it a little, a key that is held moves it on, faster after a while."""

import math

from sandbox.games.artillery.tanks import Tank
from sandbox.games.artillery.weapons import WEAPONS
from sandbox.games.rules import Control

CONTROLS = (
    Control("left", "turn the barrel left", ("left",), pad="left -leftx"),
    Control("right", "turn the barrel right", ("right",), pad="right +leftx"),
    Control("up", "more power", ("up",), pad="up -lefty"),
    Control("down", "less power", ("down",), pad="down +lefty"),
    Control("weapon", "next affordable weapon", ("w",), pad="x"),
    Control("fire", "fire", ("space",), pad="a"),
)

TURN, POWER = math.radians(0.1), 0.001
"""rad and share of full speed, by a tap"""
SLOW, FAST = 1.0, 8.0
"""how many times 5° or 5 % a second, at first and later"""
LATER = 0.6
"""s"""
PER_SECOND = math.radians(5.0), 0.05
BRING = math.radians(90.0), 1.0
"""rad/s and shares of full speed a second, by which a bot sets its gun"""
LEAST = 0.02
"""of full speed"""


class Gunner:
    """Which keys are held, and for how long."""

    def __init__(self) -> None:
        self._held: dict[str, float] = {}

    def press(self, name: str, value: float) -> None:
        """Take note of a key that goes down, or up."""
        if value > 0.0:
            self._held[name] = 0.0
        else:
            self._held.pop(name, None)

    def touch(self, name: str, tank: Tank) -> None:
        """Do what a tap does."""
        match name:
            case "left" | "right":
                set_gun(tank, TURN if name == "left" else -TURN, 0.0)
            case "up" | "down":
                set_gun(tank, 0.0, POWER if name == "up" else -POWER)
            case "weapon":
                count = len(WEAPONS)
                nexts = ((tank.weapon + k) % count for k in range(1, count + 1))
                tank.weapon = next(k for k in nexts if WEAPONS[k].cost <= tank.money)

    def hold(self, tank: Tank, time: float) -> None:
        """Go on with what is held, for a time, s."""
        for name in self._held:
            self._held[name] += time
        turn, power = (self._way(more, less) for more, less in (("left", "right"), ("up", "down")))
        set_gun(tank, turn * PER_SECOND[0] * time, power * PER_SECOND[1] * time)

    def _way(self, more: str, less: str) -> float:
        return sum(
            sign * (SLOW if self._held[name] < LATER else FAST)
            for name, sign in ((more, 1.0), (less, -1.0))
            if name in self._held
        )

    @staticmethod
    def bring(tank: Tank, angle: float, power: float, time: float) -> bool:
        """Bring a gun nearer to where it is to be, for a time, s; tell whether it is there."""
        turn, more = angle - tank.angle, power - tank.power
        there = abs(turn) <= BRING[0] * time and abs(more) <= BRING[1] * time
        if there:
            tank.angle, tank.power = angle, power
        else:
            tank.angle += math.copysign(min(abs(turn), BRING[0] * time), turn)
            tank.power += math.copysign(min(abs(more), BRING[1] * time), more)
        return there


def set_gun(tank: Tank, turn: float, more: float) -> None:
    """Turn a barrel, rad, and change its power, within what a gun can do."""
    tank.angle = min(max(tank.angle + turn, 0.0), math.pi)
    tank.power = min(max(tank.power + more, LEAST), 1.0)
