"""Gymnasium's LunarLander-v3 on pymunk: observations, actions, rewards and the random numbers of a seed are the same.

Dimensions, forces, random numbers and rewards are those of `gymnasium/envs/box2d/lunar_lander.py` (O. Klimov), in units
of 30 pixels. The scene is `games/lunar_lander`.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces

from sandbox.action import Impulse, Throttle
from sandbox.gym.classic_env import ClassicEnv, below, checked_numbers
from sandbox.gym.game_env import Observation
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point
from sandbox.trajectory import Frame

SCALE = 30.0
"""pixels per metre in Gymnasium, in whose units its dimensions are stated"""
WIDTH, HEIGHT = 600.0 / SCALE, 400.0 / SCALE
"""m, of the view"""
CHUNKS = 11
"""number of corners of the ground"""
PAD_HEIGHT = HEIGHT / 4.0
LEG_HEIGHT = 18.0 / SCALE
"""m, of the lander's origin above its feet"""
MAX_START_IMPULSE = 1000.0 / 50.0
"""N·s, largest component of the random impulse at the start"""
MAIN_IMPULSE, SIDE_IMPULSE = 13.0, 0.6
"""N·s per m between the lander's origin and the point of action, of the main and of the side engines in a step"""
MAIN_OFFSET, SIDE_OFFSET = 4.0 / SCALE, 12.0 / SCALE
"""m, from the lander's origin down to the main engine, and across to a side engine"""
SIDE_HEIGHT = 17.0 / SCALE, 14.0 / SCALE
"""m, from the lander's origin up to the side engines: factors of the horizontal and of the vertical component. They
differ, so that the torque depends on the tilt, as in Gymnasium."""
LINEAR_RESPONSE, ANGULAR_RESPONSE = (0.97364, 0.97132), -0.11027
"""Velocity of the lander after Box2D's first step in parts of that from the random impulse, and its angular velocity,
rad/s per m/s of the horizontal part: that step joins the legs, which start elsewhere and at rest. Fitted to 400 starts
of Gymnasium, from which it differs by less than 1e-5."""
SLEEP_SPEED, SLEEP_RATE, SLEEP_TIME = 0.01, math.radians(2.0), 0.5
"""m/s, rad/s and s: Box2D puts bodies to sleep that have been slower for this time"""
FRAME_RATE = 50.0
"""steps per second; Gymnasium's units of velocity contain it"""
UNITS = 0.5 * WIDTH, 0.5 * HEIGHT, 2.0 * FRAME_RATE / WIDTH, 2.0 * FRAME_RATE / HEIGHT, FRAME_RATE / 20.0
"""m, m, m/s, m/s and rad/s, units of x, y, vx, vy and ω in an observation"""


DRIFT_FIRST = "pymunk", "reference"
"""Engines whose step moves the bodies by their velocities first, and then changes these. Box2D 2.3 does so in the other
order: the state after its step has the positions after a step of these engines, and velocities and contacts before."""


class LunarLander(ClassicEnv):
    """Land between the flags.

    Observation: x and y of the lander from the pad in halves of the view, vx and vy, angle in rad, angular velocity,
    and for each leg whether it touches the ground, 1 or 0. `UNITS` has the units.

    Action: 0 nothing, 1 the left engine, 2 the main engine, 3 the right engine. With `continuous`, the throttle of the
    main engine and that of the side engines, −1 to 1: the main engine is off below 0 and then rises from 50 to 100 %;
    the side engines are off from −0.5 to 0.5, and rise from 50 to 100 % beyond.

    Reward: decrease of the distance from the pad, the speed and the tilt; 10 points for each leg that touches the
    ground; −0.3 for the main engine and −0.03 for a side engine at full throttle; −100 for a crash or for leaving the
    view, 100 for coming to rest. 200 points solve it.

    Episode: it is terminated when the body touches the ground, when x is beyond the view, or when lander and legs have
    been at rest for 0.5 s. `gymnasium.make` truncates it after 1,000 steps.

    Start: ground and first impulse are random, and so is the direction of the engines in each step. A seed leads to
    the same random numbers as in Gymnasium's environment; while the lander flies, the observations of both agree within
    0.02.

    Args:
        render_mode: None, or `rgb_array`.
        continuous: whether actions are throttles.
        gravity: m/s², between −12 and 0.
        enable_wind: whether there are gusts, until a leg touches the ground.
        wind_power: largest force of the wind, N.
        turbulence_power: largest torque of the wind, N·m.
        engine: `pymunk` or `reference`.

    Raises:
        ValueError: an argument is out of range, or the engine is another one.
    """

    def __init__(
        self,
        render_mode: str | None = None,
        continuous: bool = False,
        gravity: float = -10.0,
        enable_wind: bool = False,
        wind_power: float = 15.0,
        turbulence_power: float = 1.5,
        engine: str = "pymunk",
    ) -> None:
        """Create an environment; `reset` begins an episode."""
        if engine not in DRIFT_FIRST:
            raise ValueError(f"{engine} changes velocities before it moves bodies; use {' or '.join(DRIFT_FIRST)}")
        super().__init__("games/lunar_lander", engine, render_mode)
        if not -12.0 < gravity < 0.0:
            raise ValueError(f"gravity must be between -12 and 0 m/s², is {gravity!r}")
        self.observed = "x", "y", "vx", "vy", "angle", "ω", "right leg touches", "left leg touches"
        self.continuous, self.gravity, self.enable_wind = continuous, float(gravity), enable_wind
        self.wind_power, self.turbulence_power = float(wind_power), float(turbulence_power)
        bound = np.asarray([2.5, 2.5, 10.0, 10.0, 2.0 * math.pi, 10.0, 1.0, 1.0], np.float32)
        self.observation_space = spaces.Box(np.append(-bound[:6], np.zeros(2, np.float32)), bound)
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32) if continuous else spaces.Discrete(4)
        bodies = self._base.bodies
        self._lander, self._legs = (
            bodies.names.index("lander"),
            (
                bodies.names.index("right leg"),
                bodies.names.index("left leg"),
            ),
        )
        self._mass, self._moment = float(bodies.mass[self._lander]), float(bodies.moment[self._lander])
        origin = self._base.polygons[0].position
        self._centre: Point = (
            float(bodies.position[self._lander, 0]) - origin[0],
            float(bodies.position[self._lander, 1]) - origin[1],
        )
        """centre of mass in the frame of the lander, whose origin is observed, m"""
        self._throttle_of: dict[str, float] = {}

    def _begin_episode(self) -> None:
        """Begin an episode on a random ground, with a random impulse."""
        ground = self._random_ground()
        impulse = self.np_random.uniform(-MAX_START_IMPULSE, MAX_START_IMPULSE, 2)
        self._frame = self._begin(self._scene_of(ground, impulse)).frame()
        self._touching = set[tuple[int, int]](), set[tuple[int, int]]()  # before the last step, and after it
        self._leg_contact, self._crashed, self._rest_time = [0.0, 0.0], False, 0.0
        if self.enable_wind:
            self._wind_phase, self._torque_phase = (int(self.np_random.integers(-9999, 9999)) for _ in range(2))

    def _random_ground(self) -> list[Point]:
        """Return the corners of a random ground, m, which is flat between the flags."""
        heights = self.np_random.uniform(0.0, 0.5 * HEIGHT, CHUNKS + 1)
        heights[CHUNKS // 2 - 2 : CHUNKS // 2 + 3] = PAD_HEIGHT
        smoothed = 0.33 * (np.roll(heights, 1) + heights + np.roll(heights, -1))[:CHUNKS]
        return list(zip((WIDTH / (CHUNKS - 1) * np.arange(CHUNKS)).tolist(), smoothed.tolist(), strict=True))

    def _scene_of(self, ground: list[Point], impulse: np.ndarray[Any, Any]) -> Scene:
        """Return the scene of an episode, from the corners of its ground, m, and the impulse at its start, N·s."""
        base, (vx, vy) = self._base, (impulse / self._mass).tolist()
        spin = ANGULAR_RESPONSE * vx
        vx, vy = LINEAR_RESPONSE[0] * vx, LINEAR_RESPONSE[1] * vy
        substeps = base.solver.substeps
        # Box2D adds gravity before it moves the bodies: with this, they fall by as much in each step.
        vy += self.gravity * base.solver.dt * (substeps + 1) / (2 * substeps)
        offset = base.bodies.position - base.bodies.position[self._lander]

        def started(body: Any, index: int) -> Any:
            dx, dy = offset[index].tolist()
            return body.model_copy(update={"velocity": (vx - spin * dy, vy + spin * dx), "angular_velocity": spin})

        moon = base.play.markings[-1]
        rock = moon.model_copy(update={"points": (*ground, *below(ground))})
        return base.model_copy(
            update={
                "world": base.world.model_copy(update={"gravity": (0.0, self.gravity)}),
                "play": base.play.model_copy(update={"markings": (*base.play.markings[:-1], rock)}),
                "walls": tuple(
                    wall.model_copy(update={"points": tuple(ground[k : k + 2])}) for k, wall in enumerate(base.walls)
                ),
                "polygons": (started(base.polygons[0], self._lander),),
                "boxes": tuple(started(box, base.bodies.names.index(box.name)) for box in base.boxes),
                "thrusts": (),  # the engines are impulses
            }
        )

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Fire the engines, and advance by 0.02 s.

        Args:
            action: as in the description of the class.

        Returns:
            Observation, reward, terminated, False, and an empty info dict.

        Raises:
            ValueError: the action is invalid. The environment is left unchanged.
            ResetNeeded: no episode has begun.
        """
        main, side = self._throttles(action)
        simulation, frame, lander = self._running, self._frame, self._lander
        jx, jy, turn = self._engine_impulse(frame, main, side)
        if self.enable_wind and not any(self._leg_contact):
            gust, twist = self._next_gust()
            jx, turn = jx + gust, turn + twist
        contacts = self._advance(
            [Impulse(time=simulation.time, body="lander", impulse=(jx, jy), angular=turn)] if jx or jy or turn else []
        )
        self._frame = after = simulation.frame()
        vx, vy = frame.velocity[lander].tolist()
        vx, vy, spin = (
            vx + jx / self._mass,
            vy + jy / self._mass,
            float(frame.angular_velocity[lander]) + turn / self._moment,
        )
        self._note_contacts({(max(pair), min(pair)) for pair in contacts.pair.tolist()})
        self._note_rest(frame, vx, vy, spin)

        x, y, angle = self._pose(after)
        legs = self._leg_contact
        values = (
            (x - 0.5 * WIDTH) / UNITS[0],
            (y - PAD_HEIGHT - LEG_HEIGHT) / UNITS[1],
            vx / UNITS[2],
            vy / UNITS[3],
            angle,
            spin / UNITS[4],
            *legs,
        )
        potential = 10.0 * (legs[0] + legs[1]) - 100.0 * (
            math.hypot(values[0], values[1]) + math.hypot(values[2], values[3]) + abs(angle)
        )
        reward = self._gain(potential) - 0.3 * main - 0.03 * abs(side)
        self._throttle_of = {"main engine": main, "left engine": max(-side, 0.0), "right engine": max(side, 0.0)}
        is_asleep = self._rest_time >= SLEEP_TIME
        is_lost = self._crashed or abs(values[0]) >= 1.0
        if is_asleep or is_lost:
            reward = 100.0 if is_asleep else -100.0
        return np.array(values, np.float32), reward, is_asleep or is_lost, False, {}

    @property
    def _idle_action(self) -> Any:
        return np.zeros(2) if self.continuous else 0

    def _throttles(self, action: Any) -> tuple[float, float]:
        """Return the throttles of the main engine, 0 to 1, and of the side engines, −1 (left) to 1 (right).

        Raises:
            ValueError: the action is invalid.
        """
        if not self.continuous:
            if not self.action_space.contains(action):
                raise ValueError(f"an action is 0, 1, 2 or 3, not {action!r}")
            return float(action == 2), float(action == 3) - float(action == 1)
        main, side = checked_numbers(action, 2)
        return 0.5 * (main + 1.0) if main > 0.0 else 0.0, side if abs(side) > 0.5 else 0.0

    def _engine_impulse(self, frame: Frame, main: float, side: float) -> tuple[float, float, float]:
        """Return the impulse of the engines in a step, N·s, and its moment about the centre of mass, N·m·s."""
        first, second = (self.np_random.uniform(-1.0, 1.0, 2) / SCALE).tolist()
        total = 0.0, 0.0, 0.0
        if not (main or side):
            return total
        (x, y, angle), (cx, cy) = self._pose(frame), frame.position[self._lander].tolist()
        sine, cosine = math.sin(angle), math.cos(angle)
        engines = (  # where each acts: along the axis of the lander, across it, and from there; and N·s per m
            (MAIN_OFFSET + 2.0 * first, second, 0.0, 0.0, MAIN_IMPULSE * main),
            (
                first,
                3.0 * second + math.copysign(SIDE_OFFSET, side),
                -sine * SIDE_HEIGHT[0],
                cosine * SIDE_HEIGHT[1],
                SIDE_IMPULSE * abs(side),
            ),
        )
        for along, across, px, py, power in engines:
            if power:
                ox, oy = sine * along - cosine * across, -cosine * along - sine * across
                jx, jy = -power * ox, -power * oy
                turn = (x + ox + px - cx) * jy - (y + oy + py - cy) * jx
                total = total[0] + jx, total[1] + jy, total[2] + turn
        return total

    def _next_gust(self) -> tuple[float, float]:
        """Return the impulse of the wind in a step, N·s, and its angular impulse, N·m·s."""
        phases = self._wind_phase, self._torque_phase
        self._wind_phase, self._torque_phase = phases[0] + 1, phases[1] + 1
        gust, twist = (math.tanh(math.sin(0.02 * k) + math.sin(0.01 * math.pi * k)) / FRAME_RATE for k in phases)
        return self.wind_power * gust, self.turbulence_power * twist

    def _pose(self, frame: Frame) -> tuple[float, float, float]:
        """Return the position of the lander's origin, m, and its angle, rad."""
        (x, y), angle = frame.position[self._lander].tolist(), float(frame.angle[self._lander])
        (dx, dy), sine, cosine = self._centre, math.sin(angle), math.cos(angle)
        return x - cosine * dx + sine * dy, y - sine * dx - cosine * dy, angle

    def _note_contacts(self, touching: set[tuple[int, int]]) -> None:
        """Update the contacts, from pairs of a body and a chunk of the ground that touch after the present step.

        A leg is off the ground as soon as it leaves a chunk, even if it has moved on to the next, as in Gymnasium.
        """
        before, now = self._touching
        self._touching = now, touching
        for body, _ in now - before:
            if body == self._lander:
                self._crashed = True
            else:
                self._leg_contact[self._legs.index(body)] = 1.0
        for body, _ in before - now:
            if body != self._lander:
                self._leg_contact[self._legs.index(body)] = 0.0

    def _note_rest(self, frame: Frame, vx: float, vy: float, spin: float) -> None:
        """Measure the time for which all bodies have been slow, from the velocities of the lander and of the legs."""
        is_slow = math.hypot(vx, vy) < SLEEP_SPEED and abs(spin) < SLEEP_RATE
        if is_slow:
            legs = list(self._legs)
            speeds, rates = np.hypot(*frame.velocity[legs].T), np.abs(frame.angular_velocity[legs])
            is_slow = bool((speeds < SLEEP_SPEED).all() and (rates < SLEEP_RATE).all())
        self._rest_time = self._rest_time + 1.0 / FRAME_RATE if is_slow else 0.0

    def _drawn(self) -> tuple[Scene, Mapping[str, Throttle]]:
        """Return the scene with flames of the engines that have fired in the last step."""
        throttles = {name: Throttle(time=0.0, thrust=name, level=level) for name, level in self._throttle_of.items()}
        return self._running.scene.model_copy(update={"thrusts": self._base.thrusts}), throttles
