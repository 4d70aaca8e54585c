"""Projectiles: the shells of a turn from the muzzle to their explosions, and the results of shots.

The engine moves a shell in flight, but detects no collisions of it. Impacts are found between two frames, on the cubic
Hermite curve through both states. No shell tunnels through thin terrain, whatever the time step, and the error of an
impact is that of the integrator alone. Each result states the deviation from the exact trajectory, see
`sandbox.games.artillery.ballistics`.

Rollers that have landed are discs that collide with the terrain in the engine.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sandbox.action import Action, Move, Remove, Spawn
from sandbox.arrays import FloatArray
from sandbox.formatting import format_si
from sandbox.games.artillery.ballistics import (
    ShellImpact,
    bracketed_root,
    crossing,
    first_strike,
    landing,
    state_past_edge,
)
from sandbox.games.artillery.battlefield import (
    FRAGMENT_COUNT,
    FRAGMENT_SPREAD,
    TERRAIN_CLEARANCE,
    Battlefield,
    Tank,
    Weapon,
)
from sandbox.games.artillery.scene import Edges
from sandbox.games.artillery.terrain import Ground
from sandbox.games.contract import StepInfo
from sandbox.scene.description.base import Point
from sandbox.scene.description.discs import Ball
from sandbox.scene.description.world import World

SHELL_RADIUS = 0.25
"""m"""
SHELL_MASS = 10.0
"""kg"""


@dataclass
class Shell:
    """A shell in flight, or a roller on the terrain."""

    name: str
    shooter: Tank
    weapon: Weapon
    position: FloatArray
    """(2,) m, position in the last frame"""
    velocity: FloatArray
    """(2,) m/s"""
    number: int | None = None
    """index of its body; None until the body has been spawned"""
    fired: float = 0.0
    """s, time of the shot"""
    exact: ShellImpact | None = None
    """impact of the exact trajectory; None without one"""
    disturbed: bool = False
    """whether air or gravity changed during the flight"""
    is_whole: bool = True
    """whether it is the shell that was fired; False for a fragment"""
    rolling: float | None = None
    """s, time at which it began to roll; None in flight"""
    slow: float | None = None
    """s, time since which it has been slower than `REST_LIMIT`; None if it is not"""


class FlightSegment:
    """Path of a shell between two frames: the cubic Hermite curve through both states."""

    def __init__(self, start: tuple[FloatArray, FloatArray], end: tuple[FloatArray, FloatArray], time: float) -> None:
        """Create a segment from two states, each a position, m, and a velocity, m/s, and the time between them, s."""
        self._start, self._end, self._time = start, end, time

    def at(self, fraction: float) -> FloatArray:
        """Return the position (2,), m, at a fraction of the time."""
        s, (a, v), (b, w), h = fraction, self._start, self._end, self._time
        level = s * s * (3.0 - 2.0 * s)
        return np.asarray(
            a + level * (b - a) + h * (s * (1.0 - s) ** 2 * v - s * s * (1.0 - s) * w),
        )

    def velocity(self, fraction: float) -> FloatArray:
        """Return the velocity (2,), m/s, at a fraction of the time, by linear interpolation."""
        return np.asarray(self._start[1] + fraction * (self._end[1] - self._start[1]))

    def meets(self, ground: Ground, discs: FloatArray, until: float) -> tuple[float, int | None] | None:
        """Return the first impact before the fraction `until`: fraction of the time and the disc's index, or None.

        The index is None for an impact on the terrain.
        """
        a, b = self._start[0], self.at(until)
        found, struck = crossing(ground, a, b), first_strike(discs, a, b)
        if struck is not None and (found is None or struck[0] < found.here):
            disc = discs[struck[1]]
            fraction = self._root(lambda s: math.dist(self.at(s), disc[:2]) - float(disc[2]), 0.0, struck[0] * until)
            return fraction, struck[1]
        if found is None:
            return None

        def gap(fraction: float) -> float:
            position = self.at(fraction)
            return float(position[1] - ground.surface(position[0]))

        return self._root(gap, found.before * until, found.here * until, found.after * until), None

    @staticmethod
    def _root(f: Callable[[float], float], low: float, chord: float, high: float | None = None) -> float:
        """Return a root near `chord`, the fraction on the chord, if one is bracketed; else `chord`."""
        high = chord if high is None else high
        for until in (high, min(high + 0.05, 1.0)):
            if low < until and f(low) > 0.0 >= f(until):
                return bracketed_root(f, low, until, 1e-12)
        return chord


def past_edge(
    position: FloatArray, velocity: FloatArray, ground: Ground, edges: Edges
) -> tuple[FloatArray, FloatArray] | None:
    """Return position and velocity of a shell after it has passed an end; None if it is inside, or may leave."""
    if edges == "open" or 0.0 <= position[0] <= ground.width:
        return None
    return state_past_edge(position, velocity, 1 if position[0] > 0.0 else -1, ground.width, edges)


class ArtilleryShot(NamedTuple):
    """Result of a shot."""

    shooter: str
    weapon: str
    position: Point | None
    """m, impact; None if the shell left the terrain"""
    exact: Point | None
    """m, impact of the exact trajectory; None if it leaves the terrain, or after a change of air or gravity"""
    flown: float
    """s, time of flight"""
    time: float = 0.0
    """s, time at which the impact, or the loss of the shell, was detected"""
    disturbed: bool = False
    """whether air or gravity changed during the flight, so that there is no exact trajectory"""

    @property
    def off(self) -> float | None:
        """Distance between impact and exact impact, m; None unless both exist."""
        return None if self.position is None or self.exact is None else math.dist(self.position, self.exact)

    @property
    def description(self) -> str:
        """Text for the log: x of the impact, and its deviation from the exact solution in x and y."""
        return self.brief if self.position is None else f"landed at {self.brief}"

    @property
    def brief(self) -> str:
        """Shorter text for the score panel."""
        landed = "out of bounds" if self.position is None else f"{self.position[0]:.2f} m"
        if self.disturbed:
            return f"{landed}; wind or gravity changed during the flight"
        if self.exact is None:
            return landed if self.position is None else f"{landed}, exact solution out of bounds"
        exact = f"{landed}, exact solution {self.exact[0]:.2f} m"
        if self.position is None:
            return exact
        across, up = (format_deviation(abs(a - b)) for a, b in zip(self.position, self.exact, strict=True))
        return f"{exact} (Δx {across}" + (")" if up == BELOW_RESOLUTION else f", Δy {up})")


BELOW_RESOLUTION = "less than 1 nm"


def format_deviation(metres: float) -> str:
    """Return a deviation from the exact solution, m, as text; rounding errors below 1 nm have one text."""
    return BELOW_RESOLUTION if metres < 1e-9 else format_si(metres, "m")


ROLLER_RADIUS = 0.5
"""m, radius of a roller"""
REST_LIMIT = 0.5
"""m/s, and s: a roller that is slower than 0.5 m/s for 0.5 s explodes"""
MAX_ROLL_TIME = 8.0
"""s, longest duration of rolling"""


class Projectiles:
    """Shells in flight and rollers, and the results of all shots of a game."""

    def __init__(self, field: Battlefield) -> None:
        self._field, self._edges = field, field.artillery.edges
        self.shells: list[Shell] = []
        self.shots: list[ArtilleryShot] = []
        """results of all shots of the game"""
        self.paths: dict[str, list[tuple[float, float]]] = {}
        """m, positions at all frames of each shell of the last shot, by name"""
        self._fired = 0

    def fire(self, time: float, world: World, tank: Tank, weapon: Weapon, speed: float) -> list[Action]:
        """Fire a shell from a tank.

        Args:
            time: s.
            world: gravity, drag and wind.
            tank: shooter.
            weapon: kind of shell.
            speed: m/s, at the muzzle.
        """
        field = self._field
        position = field.tanks.muzzle(tank).at(np.array([tank.angle]))[0]
        velocity = speed * np.array([math.cos(tank.angle), math.sin(tank.angle)])
        field.cues.append("fire")
        field.blasts.clear()
        self.paths.clear()
        action = self._spawn_shell(time, tank, weapon, position, velocity)
        exact = landing(world, position, velocity, field.ground, self._edges, field.tanks.discs)
        self.shells[-1].exact = exact
        return [action]

    def find_bodies(self, info: StepInfo) -> None:
        """Find the body indices of spawned shells: new bodies are the last ones, in the order of the actions."""
        new = [shell for shell in self.shells if shell.number is None]
        if not new:
            return
        own = {shell.name for shell in new}
        spawned = [action.single.name for action in info.actions if isinstance(action, Spawn)]
        others = sum(name not in own for name in spawned)
        first = len(info.frame.position) - len(new) - others
        for k, shell in enumerate(new):  # the rules spawn before the player does
            shell.number = first + k

    def disturb(self) -> None:
        """Mark all shells as disturbed: air or gravity has changed since they were fired."""
        for shell in self.shells:
            shell.exact, shell.disturbed = None, True

    def follow(self, info: StepInfo, passed: float) -> list[Action]:
        """Update all shells, and return the actions of their impacts; the last step took `passed`, s."""
        actions: list[Action] = []
        for shell in [*self.shells]:
            number = shell.number
            if number is None:
                continue
            if not info.frame.present[number]:  # bodies beyond the bounds of the world are removed
                self._lose(shell, info.time)
                continue
            before = shell.position, shell.velocity
            shell.position, shell.velocity = info.frame.position[number].copy(), info.frame.velocity[number].copy()
            if shell.rolling is not None:
                actions += self._roll(shell, info.time)
            else:
                actions += self._fly(shell, before, info.time, passed)
            x, y = shell.position.tolist()
            self.paths[shell.name].append((x, y))
        return actions

    def _fly(self, shell: Shell, before: tuple[FloatArray, FloatArray], time: float, passed: float) -> list[Action]:
        """Update a shell in flight: detect impacts, split clusters, and apply the ends of the terrain."""
        field, position = self._field, shell.position
        step = FlightSegment(before, (position, shell.velocity), passed)
        beyond = past_edge(position, shell.velocity, field.ground, self._edges)
        until = 1.0
        if beyond is not None:
            wall = field.ground.width if position[0] > 0.0 else 0.0
            until = min(max(float((wall - before[0][0]) / (position[0] - before[0][0])), 0.0), 1.0)
        found = step.meets(field.ground, field.tanks.discs, until)
        if found is not None:
            return self._land(shell, step, *found, time, passed)
        if shell.weapon.kind == "cluster" and shell.is_whole and before[1][1] > 0.0 >= shell.velocity[1]:
            return self._split(shell, time)
        if beyond is not None:
            shell.position, shell.velocity = beyond
            (x, y), (vx, vy) = (each.tolist() for each in beyond)
            return [Move(time=time, body=shell.name, position=(x, y), velocity=(vx, vy))]
        if position[1] < -1.0 and not 0.0 <= position[0] <= field.ground.width:
            return self._remove_lost(shell, time)
        return []

    def _land(
        self, shell: Shell, step: FlightSegment, fraction: float, struck: int | None, time: float, passed: float
    ) -> list[Action]:
        """Explode a shell at its impact, at a fraction of the last step, or let a roller start there."""
        x, y = step.at(fraction).tolist()
        shell.position = np.array([x, y])
        self._record_result(shell, (x, y), time - (1.0 - fraction) * passed)
        if shell.weapon.kind != "roller" or struck is not None:
            return self._explode(shell, (x, y), time)
        ground = self._field.ground
        low, high = max(x - 0.5, 0.0), min(x + 0.5, ground.width)
        along = np.array([high - low, float(ground.surface(high) - ground.surface(low))])
        along /= np.hypot(*along)
        position = np.array([x, y]) + (ROLLER_RADIUS + TERRAIN_CLEARANCE) * np.array([-along[1], along[0]])
        velocity = float(step.velocity(fraction) @ along) * along
        self.shells.remove(shell)
        rolling = self._spawn_shell(time, shell.shooter, shell.weapon, position, velocity, rolls=True)
        return [Remove(time=time, body=shell.name), rolling]

    def _roll(self, shell: Shell, time: float) -> list[Action]:
        """Explode a roller that touches a tank, comes to rest, or has rolled for `MAX_ROLL_TIME`."""
        assert shell.rolling is not None
        discs = self._field.tanks.discs
        is_near = np.hypot(*(discs[:, :2] - shell.position).T) <= discs[:, 2] + ROLLER_RADIUS
        if float(np.hypot(*shell.velocity)) > REST_LIMIT:
            shell.slow = None
        elif shell.slow is None:
            shell.slow = time
        still = shell.slow is not None and time - shell.slow >= REST_LIMIT
        if is_near.any() or still or time - shell.rolling > MAX_ROLL_TIME:
            x, y = shell.position.tolist()
            return self._explode(shell, (x, y - ROLLER_RADIUS), time)
        if 0.0 <= shell.position[0] <= self._field.ground.width:
            return []
        return self._remove_lost(shell, time) if self._edges == "open" else self._roll_past(shell, time)

    def _roll_past(self, shell: Shell, time: float) -> list[Action]:
        """Move a roller that has passed an end of the terrain back inside; it explodes if it is then underground."""
        ground = self._field.ground
        beyond = past_edge(shell.position, shell.velocity, ground, self._edges)
        assert beyond is not None
        (x, y), (vx, vy) = (each.tolist() for each in beyond)
        surface = float(ground.surface(x))
        if y < surface:
            return self._explode(shell, (x, y), time)
        position = x, max(y, surface + ROLLER_RADIUS)
        shell.position, shell.velocity = np.array(position), beyond[1]
        return [Move(time=time, body=shell.name, position=position, velocity=(vx, vy))]

    def _split(self, shell: Shell, time: float) -> list[Action]:
        """Split a cluster into fragments with different horizontal velocities, whose mean is that of the cluster."""
        self.shells.remove(shell)
        actions: list[Action] = [Remove(time=time, body=shell.name)]
        for k in range(FRAGMENT_COUNT):
            offset = np.array([FRAGMENT_SPREAD * (k - 0.5 * (FRAGMENT_COUNT - 1)), 0.0])
            velocity = shell.velocity + offset
            actions.append(self._spawn_shell(time, shell.shooter, shell.weapon, shell.position, velocity))
            self.shells[-1].is_whole = False
        self._field.cues.append("split")
        return actions

    def _explode(self, shell: Shell, position: tuple[float, float], time: float) -> list[Action]:
        self.shells.remove(shell)
        return [
            Remove(time=time, body=shell.name),
            *self._field.blast(time, shell.shooter, position, shell.weapon),
        ]

    def _remove_lost(self, shell: Shell, time: float) -> list[Action]:
        self._lose(shell, time)
        return [Remove(time=time, body=shell.name)]

    def _lose(self, shell: Shell, time: float) -> None:
        self.shells.remove(shell)
        self._record_result(shell, None, time)

    def _record_result(self, shell: Shell, position: tuple[float, float] | None, time: float) -> None:
        """Record the result of a shot; fragments, and explosions of rollers, are not recorded."""
        if shell.is_whole and shell.rolling is None:
            exact = None if shell.exact is None else shell.exact.position
            flown = time - shell.fired
            self.shots.append(
                ArtilleryShot(shell.shooter.name, shell.weapon.name, position, exact, flown, time, shell.disturbed)
            )

    def _spawn_shell(
        self, time: float, tank: Tank, weapon: Weapon, position: FloatArray, velocity: FloatArray, rolls: bool = False
    ) -> Spawn:
        self._fired += 1
        shell = Shell(f"shell {self._fired}", tank, weapon, position, velocity, fired=time)
        shell.rolling = time if rolls else None
        self.shells.append(shell)
        (x, y), (vx, vy) = position.tolist(), velocity.tolist()
        self.paths[shell.name] = [(x, y)]
        ball = Ball(
            name=shell.name,
            position=(x, y),
            velocity=(vx, vy),
            radius=ROLLER_RADIUS if rolls else SHELL_RADIUS,
            mass=SHELL_MASS,
            collides="fixed" if rolls else "none",
            friction=0.3,
            restitution=0.2,
            colour="#f2e6c8",
        )
        return Spawn(time=time, ball=ball)
