"""Rules of landing: land a ship on a pad, slowly, upright, and with little fuel.

The scene has a body `ship`, a static body `pad`, and thrusts on the ship that have keys; these thrusts are the
controls. The initial position and velocity are randomized by the seed of the scene. Fuel is measured as impulse, N·s: a
thrust consumes its force × time. All engines stop when the tank is empty. The game ends when the ship is at rest on the
pad, touches the pad too fast or too tilted, touches another static body, tips over on the pad, or leaves the bounds of
the scene.

A landing scores fixed points, and points for the remaining fuel. A crash scores a few points if the ship is near the
pad and slow.
"""

import math
from collections.abc import Mapping, Sequence
from typing import TypedDict

import numpy as np

from sandbox.action import Action, Move, Throttle
from sandbox.arrays import FloatArray
from sandbox.formatting import format_signed
from sandbox.games.contract import Control, ObservationRange, StepInfo, UnsuitableSceneError
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point
from sandbox.scene.description.fixed import Plane, Post, Wall
from sandbox.scene.description.forces import Thrust
from sandbox.scene.description.scene import default_name
from sandbox.scene.geometry.shapes import geometry_of
from sandbox.scene.random_streams import Stream, draws
from sandbox.trajectory import Frame

SHIP, PAD = "ship", "pad"
LANDED, LOST = "landed", "lost in space"
OUTSIDE_PAD, TIPPED_OVER = "crashed outside the pad", "tipped over"
TANK_CAPACITY = 45.0
"""N·s per kg of the ship, capacity of the tank: the change of velocity, m/s, in free space"""
MAX_DESCENT_SPEED, MAX_SIDEWAYS_SPEED, MAX_TILT = 2.0, 1.0, math.radians(15.0)
"""m/s, m/s and rad: limits of vertical speed, horizontal speed and tilt at the first touch"""
REST_SPEED, REST_TIME = 0.05, 1.0
"""m/s and s: the ship has landed when it has been slower than this for this duration"""
TIPPED_OVER_ANGLE = math.radians(45.0)
"""rad, tilt on the pad beyond which the ship has tipped over"""
LANDING_POINTS, FUEL_POINTS = 100, 900
"""points for a landing, and for a full tank"""
MAX_CRASH_POINTS, CRASH_DISTANCE, CRASH_SPEED = 50, 50.0, 15.0
"""points for a crash; they decrease linearly to 0 at a distance from the pad, m, and at a speed, m/s"""
MAX_START_OFFSET, MAX_START_DRIFT = 18.0, 3.0
"""m and m/s, bounds of the random change of the initial horizontal position and velocity"""
UNLIMITED_STEPS = 1_000_000
"""number of `quiet_steps` where no fuel can be burnt"""
GAMEPAD_INPUTS = {"up": "a rt up", "left": "left -leftx", "right": "right +leftx"}
"""gamepad inputs by the key of a thrust"""


class Start(TypedDict):
    """Initial position and velocity of the ship."""

    position: Point
    """m"""
    velocity: Point
    """m/s"""


class Landing:
    """Rules and state of a game."""

    def __init__(self, scene: Scene, bodies: Bodies) -> None:
        """Start a game.

        Raises:
            UnsuitableSceneError: the scene has no ship, no pad, or no thrust with a key on the ship.
        """
        self.thrusts = {
            thrust.name or default_name("thrust", k): thrust
            for k, thrust in enumerate(scene.thrusts)
            if thrust.body == SHIP and thrust.key is not None
        }
        """thrusts of the ship that are controls, by name"""
        if SHIP not in bodies.names or PAD not in scene.fixed_names or not self.thrusts:
            raise UnsuitableSceneError(
                f"landing needs a body {SHIP!r}, a fixed element {PAD!r}, and a thrust on the ship that has a key"
            )
        self.controls = tuple(_control(name, thrust) for name, thrust in self.thrusts.items())
        self.score = 0
        self.game_over: str | None = None
        self.ship = bodies.names.index(SHIP)
        """index of the body"""
        self.mass, self.moment = float(bodies.mass[self.ship]), float(bodies.moment[self.ship])
        """kg and kg·m² of the ship"""
        self.gravity = -scene.world.gravity[1]
        """m/s², downwards"""
        self.pad = _pad_position(scene)
        """m, centre of the top of the pad"""
        self.pad_index = -1 - scene.fixed_names.index(PAD)
        """number of the pad in the pairs of contacts"""
        self._static_count = len(scene.fixed)
        form = geometry_of(bodies.elements[int(bodies.element[self.ship])])
        self._corners = [(x, y, piece.radius) for piece in form.pieces for x, y in piece.corners]
        self.full_tank = TANK_CAPACITY * self.mass
        """N·s"""
        self.forces = {name: math.hypot(*thrust.force) for name, thrust in self.thrusts.items()}
        """N, of each thrust at full level"""
        self._tank = self.full_tank
        self._levels = dict.fromkeys(self.thrusts, 0.0)
        self._burn_rate = 0.0  # N·s per s, since the last change of a level
        self._changed, self._tank_then = 0.0, self._tank  # time and fuel at that change
        self._start = Move(time=0.0, body=SHIP, **self.random_start(scene.world.seed, bodies))
        self._time, self._rest_time = 0.0, 0.0
        self._previous_frame: Frame | None = None
        self._frame: Frame | None = None
        self._cues: list[str] = []
        self._touched = False

    def on_input(self, control: str, value: float) -> Sequence[Action]:
        """Set the level of a thrust; without effect if the tank is empty."""
        return (Throttle(time=0.0, thrust=control, level=min(value, 1.0)),) if self._tank > 0.0 else ()

    def on_step(self, info: StepInfo) -> Sequence[Action]:
        """Update fuel and score, and determine whether the game is over."""
        if self._frame is None:
            self._frame = info.frame
            return (self._start,)
        self._previous_frame, self._frame = self._frame, info.frame
        before, self._time = self._time, info.time
        elapsed, stopped = info.time - before, self._burn(info, before)
        self.game_over = self._end_reason(info, elapsed)
        if self.game_over is not None:
            if self.game_over != LANDED:
                previous = self._previous_frame
                self.score = self.crash_points(previous.position[self.ship], previous.velocity[self.ship])
            self._cues.append("win" if self.game_over == LANDED else "lose")
            return tuple(Throttle(time=0.0, thrust=name, level=0.0) for name, level in self._levels.items() if level)
        return stopped

    def quiet_steps(self, dt: float) -> int:
        """Return the number of steps of dt, s, in which the tank cannot become empty, as `HasQuietSteps`."""
        burnt = sum(self.forces.values()) * dt  # at most, in a step
        return max(int(self._tank / burnt), 1) if burnt and self._tank else UNLIMITED_STEPS

    def _burn(self, info: StepInfo, before: float) -> Sequence[Action]:
        """Consume fuel since a time, s; return the actions that stop all engines when the tank becomes empty.

        The fuel follows from the time since the last change of a level, so that it does not depend on how many steps
        lie between two calls.
        """
        levels = {
            action.thrust: action.level
            for action in info.actions
            if isinstance(action, Throttle) and action.thrust in self._levels
        }
        if levels:
            self._set_levels(self._levels | levels, before)
        tank_before, self._tank = self._tank, max(self._tank_then - self._burn_rate * (info.time - self._changed), 0.0)
        if self._tank > 0.0 or tank_before == 0.0:
            return ()
        self._cues.append("empty")
        open_thrusts = [name for name, level in self._levels.items() if level > 0.0]
        self._set_levels(dict.fromkeys(self._levels, 0.0), info.time)
        return tuple(Throttle(time=0.0, thrust=name, level=0.0) for name in open_thrusts)

    def _set_levels(self, levels: dict[str, float], time: float) -> None:
        """Set the levels of the thrusts from a time, s, on."""
        self._levels, self._changed, self._tank_then = levels, time, self._tank
        self._burn_rate = 0.0
        for name, level in levels.items():
            self._burn_rate += level * self.forces[name]

    def _end_reason(self, info: StepInfo, elapsed: float) -> str | None:
        """Return the reason why the game is over, and set the score of a landing; None while it runs."""
        frame, ship = info.frame, self.ship
        if not frame.present[ship]:
            return LOST
        touched = {int(pair[1]) if pair[0] == ship else int(pair[0]) for pair in info.contacts.pair if ship in pair}
        if any(number >= -self._static_count for number in touched - {self.pad_index}):  # smaller numbers are zones
            return OUTSIDE_PAD
        if self.pad_index not in touched:
            self._rest_time = 0.0
            return None
        first, self._touched = not self._touched, True
        if first:
            assert self._previous_frame is not None
            fault = crash_reason(self._previous_frame.velocity[ship], float(self._previous_frame.angle[ship]))
            if fault is not None:
                return fault
            self._cues.append("touch")
        if abs(tilt(float(frame.angle[ship]))) > TIPPED_OVER_ANGLE:
            return TIPPED_OVER
        self._rest_time = self._rest_time + elapsed if is_at_rest(frame.velocity[ship]) else 0.0
        if self._rest_time < REST_TIME:
            return None
        self.score = self.landing_points(self._tank)
        return LANDED

    @property
    def is_ranked(self) -> bool:
        """Whether the score may enter the high scores: that of a landing, not of a crash."""
        return self.game_over == LANDED

    def landing_points(self, tank: float) -> int:
        """Return the points of a landing with fuel, N·s, left."""
        return LANDING_POINTS + round(FUEL_POINTS * tank / self.full_tank)

    def crash_points(self, position: FloatArray, velocity: FloatArray) -> int:
        """Return the points of a crash, from the position, m, and the velocity, m/s, of the ship before it, (2,)."""
        proximity = max(1.0 - math.dist(position.tolist(), self.pad) / CRASH_DISTANCE, 0.0)
        return round(MAX_CRASH_POINTS * proximity * max(1.0 - float(np.hypot(*velocity)) / CRASH_SPEED, 0.0))

    def random_start(self, seed: int, bodies: Bodies) -> Start:
        """Return the random initial position and velocity of the ship."""
        rng = draws(Stream.LANDING, seed)
        (x, y), (vx, vy) = bodies.position[self.ship].tolist(), bodies.velocity[self.ship].tolist()
        x += rng.uniform(-MAX_START_OFFSET, MAX_START_OFFSET)
        vx += rng.uniform(-MAX_START_DRIFT, MAX_START_DRIFT)
        return {"position": (x, y), "velocity": (vx, vy)}

    def tilt(self, frame: Frame) -> float:
        """Return the angle of the ship, rad, −π to π; positive if it leans to the left."""
        return tilt(float(frame.angle[self.ship]))

    def display_lines(self) -> Sequence[tuple[str, str]]:
        """Return fuel, height, speeds and tilt; values beyond the limits of a landing are marked by `!`."""
        fuel = ("fuel", f"{100.0 * self._tank / self.full_tank:.0f} %")
        if self._frame is None or not self._frame.present[self.ship]:
            return (fuel,)
        sideways, up = self._frame.velocity[self.ship].tolist()
        tilt = self.tilt(self._frame)
        return (
            fuel,
            ("height", f"{max(self.height(self._frame), 0.0):.1f} m"),
            ("down", _marked(f"{format_signed(-up, 1)} m/s", -up > MAX_DESCENT_SPEED)),
            ("sideways", _marked(f"{format_signed(sideways, 1)} m/s", abs(sideways) > MAX_SIDEWAYS_SPEED)),
            ("tilt", _marked(f"{format_signed(-math.degrees(tilt), 0)}°", abs(tilt) > MAX_TILT)),
        )

    def observation(self) -> Sequence[tuple[str, float]]:
        """Return the fuel as a fraction of a full tank."""
        return (("fuel", self._tank / self.full_tank),)

    def observation_ranges(self) -> Mapping[str, ObservationRange]:
        """Return the range of the fuel."""
        return {"fuel": ObservationRange(0.0, 1.0)}

    def height(self, frame: Frame) -> float:
        """Return the height of the lowest point of the ship above the pad, m."""
        sine, cosine = math.sin(frame.angle[self.ship]), math.cos(frame.angle[self.ship])
        lowest = min(x * sine + y * cosine - radius for x, y, radius in self._corners)
        return float(frame.position[self.ship, 1]) + lowest - self.pad[1]

    def sounds(self) -> Sequence[str]:
        """Return the names of the sounds since the last call."""
        cues, self._cues = self._cues, []
        return cues


def crash_reason(velocity: FloatArray, angle: float) -> str | None:
    """Return the reason why the first touch of the pad is a crash, from the state of the ship before it, or None.

    Args:
        velocity: (2,) m/s.
        angle: rad.
    """
    sideways, up = velocity.tolist()
    if -up > MAX_DESCENT_SPEED:
        return f"crashed: {-up:.1f} m/s down (limit {MAX_DESCENT_SPEED:g})"
    if abs(sideways) > MAX_SIDEWAYS_SPEED:
        return f"crashed: {abs(sideways):.1f} m/s sideways (limit {MAX_SIDEWAYS_SPEED:g})"
    lean = abs(tilt(angle))
    if lean > MAX_TILT:
        return f"crashed: tilted by {math.degrees(lean):.0f}° (limit {math.degrees(MAX_TILT):.0f}°)"
    return None


def tilt(angle: float) -> float:
    """Return an angle, rad, as one from −π to π."""
    return math.remainder(angle, math.tau)


def is_at_rest(velocity: FloatArray) -> bool:
    """Return whether a velocity, (2,) m/s, is that of a ship at rest."""
    return float(np.hypot(*velocity)) < REST_SPEED


def _control(name: str, thrust: Thrust) -> Control:
    assert thrust.key is not None
    return Control(name, name, (thrust.key,), GAMEPAD_INPUTS.get(thrust.key), analogue=True)


def _pad_position(scene: Scene) -> Point:
    """Return the centre of the top of the pad, m.

    Raises:
        UnsuitableSceneError: the pad is not a plane, a wall or a post.
    """
    pad = dict(zip(scene.fixed_names, scene.fixed, strict=False)).get(PAD)  # names of pockets, zones and sensors follow
    match pad:
        case Wall():
            across, up = zip(*pad.points, strict=True)
            return 0.5 * (min(across) + max(across)), max(up) + 0.5 * pad.thickness
        case Post():
            return pad.position[0], pad.position[1] + pad.radius
        case Plane():
            return pad.point
    raise UnsuitableSceneError(f"landing needs a pad that is a plane, a wall or a post, called {PAD!r}")


def _marked(text: str, beyond: bool) -> str:
    return f"{text} !" if beyond else text
