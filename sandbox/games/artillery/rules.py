"""Rules of artillery: players take turns to aim and fire, until one tank is left.

A turn has the phases of `TurnPhase`: aiming, flight of the shells, and settling of terrain and tanks. A key tap
changes the gun by one small step; a held key moves it continuously, and faster after `FAST_DELAY`. A bot plans its shot
during the aiming phase, moves the gun to it at a fixed rate, and fires.

Angles are in rad, anticlockwise from the right; power is a fraction of full speed.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np

from sandbox.action import Action, SetParameter
from sandbox.arrays import FloatArray
from sandbox.games.artillery.ballistics import Flight, landing
from sandbox.games.artillery.battlefield import (
    FRAGMENT_COUNT,
    FULL_HEALTH,
    MIN_SETTLING_TIME,
    WEAPONS,
    Battlefield,
    Tank,
)
from sandbox.games.artillery.bot_planner import BotPlanner, turn_generator
from sandbox.games.artillery.shells import ArtilleryShot, Projectiles
from sandbox.games.artillery.targeting import FiringSolution
from sandbox.games.artillery.view_state import (
    EXPLOSION_DURATION,
    ArtilleryViewState,
    ExplosionView,
    FallingDirt,
    GunView,
)
from sandbox.games.contract import FLAG, Control, ObservationRange, StepInfo
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.scene import Scene

CONTROLS = (
    Control("left", "turn the barrel left", ("left",), pad="left -leftx"),
    Control("right", "turn the barrel right", ("right",), pad="right +leftx"),
    Control("up", "more power", ("up",), pad="up -lefty"),
    Control("down", "less power", ("down",), pad="down +lefty"),
    Control("weapon", "next affordable weapon", ("w",), pad="x"),
    Control("fire", "fire", ("space",), pad="a"),
)

TAP_ANGLE, TAP_POWER = math.radians(0.1), 0.001
"""rad, and fraction of full speed, of one tap"""
SLOW_FACTOR, FAST_FACTOR = 1.0, 8.0
"""rates of a held key as multiples of `HOLD_RATES`, before and after `FAST_DELAY`"""
FAST_DELAY = 0.6
"""s, time after which a held key moves the gun faster"""
HOLD_RATES = math.radians(5.0), 0.05
"""rad/s, and fraction of full speed per second, by a held key"""
BOT_GUN_RATES = math.radians(90.0), 1.0
"""rad/s, and fraction of full speed per second, at which a bot sets its gun"""
MIN_POWER = 0.02
"""fraction of full speed, lower bound of the power"""


class GunControls:
    """Setting of the gun by keys: the held keys, and the time for which each has been held."""

    def __init__(self) -> None:
        self._held: dict[str, float] = {}

    def press(self, name: str, value: float) -> None:
        """Record a key press or release."""
        if value > 0.0:
            self._held[name] = 0.0
        else:
            self._held.pop(name, None)

    def tap(self, name: str, tank: Tank) -> None:
        """Apply one tap of a key."""
        match name:
            case "left" | "right":
                set_gun(tank, TAP_ANGLE if name == "left" else -TAP_ANGLE, 0.0)
            case "up" | "down":
                set_gun(tank, 0.0, TAP_POWER if name == "up" else -TAP_POWER)
            case "weapon":
                count = len(WEAPONS)
                nexts = ((tank.weapon + k) % count for k in range(1, count + 1))
                tank.weapon = next(k for k in nexts if WEAPONS[k].cost <= tank.money)

    def hold(self, tank: Tank, time: float) -> None:
        """Move the gun by the held keys, for a time, s."""
        for name in self._held:
            self._held[name] += time
        turn, power = (self._hold_direction(more, less) for more, less in (("left", "right"), ("up", "down")))
        set_gun(tank, turn * HOLD_RATES[0] * time, power * HOLD_RATES[1] * time)

    def _hold_direction(self, more: str, less: str) -> float:
        return sum(
            sign * (SLOW_FACTOR if self._held[name] < FAST_DELAY else FAST_FACTOR)
            for name, sign in ((more, 1.0), (less, -1.0))
            if name in self._held
        )

    @staticmethod
    def move_towards(tank: Tank, angle: float, power: float, time: float) -> bool:
        """Move a gun towards a setting, for a time, s; return whether it has reached it."""
        turn, more = angle - tank.angle, power - tank.power
        reached = abs(turn) <= BOT_GUN_RATES[0] * time and abs(more) <= BOT_GUN_RATES[1] * time
        if reached:
            tank.angle, tank.power = angle, power
        else:
            tank.angle += math.copysign(min(abs(turn), BOT_GUN_RATES[0] * time), turn)
            tank.power += math.copysign(min(abs(more), BOT_GUN_RATES[1] * time), more)
        return reached


def set_gun(tank: Tank, turn: float, more: float) -> None:
    """Change angle, rad, and power of a gun within their limits."""
    tank.angle = min(max(tank.angle + turn, 0.0), math.pi)
    tank.power = min(max(tank.power + more, MIN_POWER), 1.0)


OBSERVED_HEIGHTS = 33
"""number of terrain heights in an observation, evenly spaced from side to side"""

AIR_PARAMETERS = frozenset({"gravity", "wind", "linear_drag", "quadratic_drag", "damping"})
"""parameters of the world that affect the flight of shells"""

TRACER_STEP = 0.03
"""s between two points of the tracer"""
MAX_TRACER_TIME = 10.0
"""s, length of the tracer of a shot that does not land"""
TIME_ROUNDING = 1e-9
"""s, rounding error of the times of steps"""

TurnPhase = Literal["begin", "aim", "fly", "settle"]
"""Phases of a turn: the next player is chosen; the player aims; shells fly; terrain and tanks come to rest."""


class ArtilleryRules:
    """Rules and state of a game."""

    def __init__(self, scene: Scene, bodies: Bodies) -> None:
        """Start a game.

        Raises:
            UnsuitableSceneError: the scene has no players, or no ground.
        """
        self.field = Battlefield(scene, bodies)
        self.artillery = self.field.artillery
        self.barrage = Projectiles(self.field)
        self.world = scene.world
        """world with the wind of the present turn"""
        self.turn = 0
        """number of the turn, from 1, counted over all players"""
        self.phase: TurnPhase = "begin"
        self._gunner = GunControls()
        self._time, self._previous_time, self._since, self._shooter_index = 0.0, 0.0, 0.0, 0
        self._planner: BotPlanner | None = None  # of a bot whose turn it is
        self._aim: FiringSolution | None = None
        self._over: str | None = None
        self._winner: str | None = None

    @property
    def controls(self) -> tuple[Control, ...]:
        """Controls of the player."""
        return CONTROLS

    @property
    def score(self) -> int:
        """Points of the first player without a bot; if all have bots, the highest points."""
        tanks = self.field.tanks.every
        humans = [tank.points for tank in tanks if tank.player.bot is None]
        return humans[0] if humans else max(tank.points for tank in tanks)

    @property
    def player(self) -> str:
        """Player whose turn it is."""
        return self.shooter.player.name

    @property
    def scores(self) -> dict[str, int]:
        """Points of each player."""
        return {tank.player.name: tank.points for tank in self.field.tanks.every}

    @property
    def bots(self) -> tuple[str, ...]:
        """Players that are bots."""
        return tuple(tank.name for tank in self.field.tanks.every if tank.player.bot is not None)

    @property
    def winner(self) -> str | None:
        """Player who has won; None while the game runs, and after a draw."""
        return self._winner

    @property
    def game_over(self) -> str | None:
        """Winner, or that it is a draw; None while the game runs."""
        return self._over

    @property
    def shooter(self) -> Tank:
        """Tank whose turn it is."""
        return self.field.tanks.every[self._shooter_index]

    @property
    def thinking(self) -> bool:
        """Whether a bot is searching for its shot."""
        return self._planner is not None and self._aim is None

    @property
    def shots(self) -> list[ArtilleryShot]:
        """Results of all shots."""
        return self.barrage.shots

    @property
    def log(self) -> Sequence[tuple[float, str]]:
        """Time, s, and result of each shot."""
        return [(shot.time, f"{shot.shooter}, {shot.weapon}: {shot.description}") for shot in self.shots]

    def speed(self, tank: Tank) -> float:
        """Return the muzzle speed at the present setting of a tank, m/s."""
        return tank.power * self.artillery.speed

    def on_input(self, control: str, value: float) -> Sequence[Action]:
        """Set angle, power or weapon, or fire."""
        self._gunner.press(control, value)
        if self.phase != "aim" or self.shooter.player.bot is not None or value <= 0.0:
            return ()
        if control == "fire":
            return self._fire()
        self._gunner.tap(control, self.shooter)
        if control == "weapon":
            self.field.cues.append("click")
        return ()

    def on_step(self, info: StepInfo) -> Sequence[Action]:
        """Advance the turn: move the gun by held keys, track shells, or wait until everything is at rest."""
        passed = info.time - self._time
        self._previous_time, self._time = self._time, info.time
        self._update_air(info.actions)
        self.barrage.find_bodies(info)
        self.field.tanks.update(info.frame)
        match self.phase:
            case "begin":
                return self._begin_turn()
            case "aim":
                return self._set_gun(passed)
            case "fly":
                actions = self.barrage.follow(info, passed)
                if not self.barrage.shells:
                    self.phase = "settle"
                    self.field.start_settling(info.time)
                return actions
            case "settle":
                done, actions = self.field.settle(info, self.shooter)
                if done:
                    self.phase = "begin"
                return actions

    def display_lines(self) -> Sequence[tuple[str, str]]:
        """Return state of the tanks, setting of the gun, and result of the last shot."""
        lines = []
        for tank in self.field.tanks.every:
            mark = "▸ " if tank is self.shooter and self._over is None else ""
            points = f"{tank.points:,} point{'' if tank.points == 1 else 's'}"
            state = f"{tank.health:.0f} %, {points}, ${tank.money:,}" if tank.alive else f"out, {points}"
            lines.append((f"{mark}{tank.name}", state))
        wind = self.world.wind[0]
        side = "to the right" if wind > 0 else "to the left"
        lines.append(("wind", f"{abs(wind):.1f} m/s {side}" if wind else "none"))
        tank, weapon = self.shooter, WEAPONS[self.shooter.weapon]
        gun = f"{math.degrees(tank.angle):.1f}°, {100.0 * tank.power:.1f} %, {self.speed(tank):.1f} m/s"
        lines.append(("gun", f"{tank.name} is thinking" if self.thinking else gun))
        lines.append(("weapon", f"{weapon.name}, ${weapon.cost:,}" if weapon.cost else weapon.name))
        if self.shots:
            lines.append(("last shot", self.shots[-1].brief.replace("exact solution", "exact")))
        return lines

    def observation(self) -> Sequence[tuple[str, float]]:
        """Return turn, wind, state of every tank and its gun, last impact, and terrain heights."""
        field, impacts = self.field, [shot.position for shot in self.shots if shot.position is not None]
        last = impacts[-1] if impacts else None
        person = self.phase == "aim" and self.shooter.player.bot is None
        found = [("turn", float(self.turn)), ("shooter", self._shooter_index), ("may fire", person)]
        found += [("wind", self.world.wind[0]), ("shells", len(self.barrage.shells))]
        for tank in field.tanks.every:
            own = {"health": tank.health, "money": tank.money, "points": tank.points}
            gun = {"barrel": tank.angle, "power": tank.power, "weapon": tank.weapon}
            found += [(f"{tank.name} {name}", value) for name, value in (own | gun).items()]
        found += [("landed x", -1.0 if last is None else last[0])]
        heights = field.ground.surface(np.linspace(0.0, field.ground.width, OBSERVED_HEIGHTS))
        return [*found, *((f"height {k}", height) for k, height in enumerate(heights.tolist()))]

    def observation_ranges(self) -> Mapping[str, ObservationRange]:
        """Return the ranges of turn, wind, and of tanks and guns."""
        tanks, wind = self.field.tanks.every, self.artillery.wind or math.inf
        tank = {
            "health": ObservationRange(0.0, FULL_HEALTH, "%"),
            "money": ObservationRange(0.0, unit="$"),
            "barrel": ObservationRange(0.0, math.pi, "rad"),
            "power": ObservationRange(MIN_POWER, 1.0),
            "weapon": ObservationRange(0.0, len(WEAPONS) - 1.0),
        }
        return {
            "turn": ObservationRange(0.0, float(self.artillery.rounds * len(tanks))),
            "shooter": ObservationRange(0.0, len(tanks) - 1.0),
            "may fire": FLAG,
            "wind": ObservationRange(-wind, wind, "m/s"),
            "shells": ObservationRange(0.0, float(FRAGMENT_COUNT)),
            **{f"{each.name} {name}": its for each in tanks for name, its in tank.items()},
            "landed x": ObservationRange(unit="m"),
            **{f"height {k}": ObservationRange(0.0, unit="m") for k in range(OBSERVED_HEIGHTS)},
        }

    def view_state(self, time: float) -> ArtilleryViewState:
        """Return the values to draw at a time, s; for the past only the guns, as they are now."""
        tanks = self.field.tanks
        if time < self._previous_time - TIME_ROUNDING:
            guns = [GunView(tank.number, tank.name, tank.angle, tank.power, None, aiming=False) for tank in tanks.every]
            return ArtilleryViewState(tuple(guns), tanks.size, wind=None)
        aiming = self.phase == "aim" and self._over is None
        shot = self.shots[-1] if self.shots else None
        return ArtilleryViewState(
            guns=tuple(
                GunView(
                    number=tank.number,
                    name=tank.name,
                    angle=tank.angle,
                    power=tank.power,
                    health=tank.health / FULL_HEALTH,
                    aiming=aiming and tank is self.shooter,
                )
                for tank in tanks.alive
            ),
            size=tanks.size,
            wind=self.world.wind[0],
            paths=tuple(np.asarray(path) for path in self.barrage.paths.values() if len(path) > 1),
            flying=tuple(shell.number for shell in self.barrage.shells if shell.number is not None),
            bursts=tuple(
                ExplosionView(max(time - each.time, 0.0), each.position, each.radius, each.dirt)
                for each in self.field.blasts
                if time - each.time <= EXPLOSION_DURATION
            ),
            clods=self._falling_dirt(time),
            tracer=self._tracer() if aiming and self.artillery.tracer else None,
            landed=None if shot is None or shot.position is None or shot.exact is None else (shot.position, shot.exact),
        )

    def _falling_dirt(self, time: float) -> tuple[FallingDirt, ...]:
        """Return the dirt in the air at a time, s. It falls freely, without drag."""
        ground, gravity = self.field.ground, math.hypot(*self.world.gravity)
        dirt = []
        for since, loose in self.field.falling:
            fallen = 0.5 * gravity * max(time - since, 0.0) ** 2
            for each in loose:
                if fallen < each.drop:
                    left = each.column * ground.each
                    bottom, top = each.bottom - fallen, each.top - fallen
                    dirt.append(FallingDirt(left, left + ground.each, bottom, top, each.bottom - each.drop))
        return tuple(dirt)

    def _tracer(self) -> FloatArray:
        """Return the path of a shot with the present setting of the gun, up to the terrain or the first side."""
        tank, field = self.shooter, self.field
        start = field.tanks.muzzle(tank).at(np.array([tank.angle]))[0]
        velocity = self.speed(tank) * np.array([math.cos(tank.angle), math.sin(tank.angle)])
        flight, impact = Flight(self.world, start, velocity), landing(self.world, start, velocity, field.ground)
        end = impact.time if impact is not None else MAX_TRACER_TIME
        return np.stack([flight.at(float(time))[0] for time in np.arange(0.0, end, TRACER_STEP)])

    def sounds(self) -> Sequence[str]:
        """Return the sounds since the last call."""
        cues, self.field.cues = self.field.cues, []
        return cues

    def _update_air(self, actions: Sequence[Action]) -> None:
        """Apply changes of air and gravity; shells in flight then have no exact solution."""
        for action in actions:
            key = action.path.removeprefix("world.") if isinstance(action, SetParameter) else ""
            if not isinstance(action, SetParameter) or key not in AIR_PARAMETERS:
                continue
            value = tuple(action.value) if isinstance(action.value, list) else action.value
            self.world = self.world.model_copy(update={key: value})
            self.field.pull = math.hypot(*self.world.gravity)
            self.barrage.disturb()

    def _begin_turn(self) -> list[Action]:
        """Start the turn of the next tank, with a new wind; or end the game."""
        tanks, alive = self.field.tanks.every, self.field.tanks.alive
        if len(alive) < 2:
            if not alive:
                return self._end("no tank is left: a draw", None)
            return self._end(f"{alive[0].name} wins", alive[0].name)
        if self.turn >= self.artillery.rounds * len(tanks):
            best = max(tanks, key=lambda tank: (tank.points, tank.health))
            return self._end(f"out of shells; {best.name} wins on points", best.name)
        first = self._shooter_index + 1 if self.turn else 0
        order = (k % len(tanks) for k in range(first, first + len(tanks)))
        self._shooter_index = next(k for k in order if tanks[k].alive)
        self.turn += 1
        self.phase, self._since = "aim", self._time
        self._planner, self._aim = None, None
        if WEAPONS[self.shooter.weapon].cost > self.shooter.money:
            self.shooter.weapon = 0
        self.field.cues.append("turn")
        max_wind = self.artillery.wind
        if not max_wind:
            return []
        wind = (float(turn_generator(self.world.seed, 2 * self.turn).uniform(-max_wind, max_wind)), 0.0)
        self.world = self.world.model_copy(update={"wind": wind})
        return [SetParameter(time=self._time, path="world.wind", value=list(wind))]

    def _end(self, reason: str, winner: str | None) -> list[Action]:
        self._over, self._winner = reason, winner
        self.field.cues.append("win")
        return []

    def _set_gun(self, passed: float) -> list[Action]:
        """Move the gun by held keys; a bot searches for a shot, moves the gun to it, and fires."""
        tank = self.shooter
        if tank.player.bot is None:
            self._gunner.hold(tank, passed)
            return []
        if self._planner is None:
            self._planner = BotPlanner(self.world, self.field, tank, turn_generator(self.world.seed, 2 * self.turn + 1))
            tank.weapon = self._planner.weapon
        if self._aim is None:
            self._aim = self._planner.advance()
        if self._aim is None:
            return []
        reached = self._gunner.move_towards(tank, self._aim.angle, self._aim.speed / self.artillery.speed, passed)
        return self._fire() if reached and self._time - self._since >= MIN_SETTLING_TIME else []

    def _fire(self) -> list[Action]:
        tank = self.shooter
        weapon = WEAPONS[tank.weapon]
        tank.money -= weapon.cost
        self.phase = "fly"
        return self.barrage.fire(self._time, self.world, tank, weapon, self.speed(tank))
