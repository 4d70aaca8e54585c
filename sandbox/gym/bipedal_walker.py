"""Gymnasium's BipedalWalker-v3 on pymunk: observations, actions, rewards and the random numbers of a seed are the same.

Dimensions, motors, random numbers and rewards are those of `gymnasium/envs/box2d/bipedal_walker.py` (O. Klimov), in
units of 30 pixels. The scene is `games/bipedal_walker`.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces

from sandbox.action import Actuate, Throttle
from sandbox.arrays import FloatArray
from sandbox.gym.classic_env import ClassicEnv, below, checked_numbers
from sandbox.gym.game_env import Observation
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import Point
from sandbox.scene.description.bodies import Polygon
from sandbox.trajectory import Frame

SCALE = 30.0
"""pixels per metre in Gymnasium, in whose units its dimensions are stated"""
WIDTH, HEIGHT = 600.0 / SCALE, 400.0 / SCALE
"""m, of the view"""
GROUND_STEP, GROUND_CORNERS, START_CORNERS, GRASS_CORNERS = 14.0 / SCALE, 200, 20, 10
"""m between two corners of the ground; numbers of corners: in all, of the flat start, and of a stretch of grass"""
GROUND_HEIGHT = HEIGHT / 4.0
GRASS, STUMP, STAIRS, PIT, STATES = range(5)
"""stretches of the ground, and their number"""
CLOUD_NUMBERS = 11 * (GROUND_CORNERS // 20)
"""random numbers that Gymnasium draws for its clouds"""
MAX_START_IMPULSE = 5.0 / 50.0
"""N·s, largest horizontal impulse at the start"""
RAYS, RAY_ANGLE, RAY_LENGTH = 10, 1.5, 160.0 / SCALE
"""number of range finders, rad between straight down and the first beyond the last, and m"""
EDGES_IN_RANGE = math.ceil(RAY_LENGTH / GROUND_STEP) + 2
"""number of edges of the ground that rays can reach"""
JOINTS = "first hip", "first knee", "second hip", "second knee"
BODIES = "first thigh", "first shin", "second thigh", "second shin"
ANGLE_OFFSETS = 0.05, 1.0, -0.05, 1.0
"""rad, observed angle of each joint when the two bodies are parallel"""
LEG_NUMBERS = "hip angle", "hip rate", "knee angle", "knee rate", "foot touches"
"""observed numbers of a leg"""
RATES = 4.0, 6.0, 4.0, 6.0
"""rad/s, of the motors"""
TORQUE_COST = 0.00035 * 80.0
"""points per step of a motor at its largest torque"""
FRAME_RATE = 50.0
"""steps per second; Gymnasium's units of velocity contain it"""


class BipedalWalker(ClassicEnv):
    """Walk to the end of the ground on two legs.

    Observation: angle of the hull, its angular velocity, vx and vy; for each leg angle and rate of hip and knee, and
    whether the shin touches the ground, 1 or 0; the distances that ten range finders measure, in parts of their range.

    Action: level of the motors of both hips and knees, −1 to 1: direction, and fraction of the largest torque.

    Reward: 130 points per 30 m of the way, less 5 per rad by which the hull is tilted; less the cost of the torques;
    −100 for a fall or for x below 0. 300 points solve it.

    Episode: it is terminated when the hull touches the ground, and at either end of the ground. `gymnasium.make`
    truncates it after 1,600 steps, or 2,000 with `hardcore`.

    Start: the ground is random, and the walker gets a small random push. A seed leads to the same ground as in
    Gymnasium's environment.

    Args:
        render_mode: None, or `rgb_array`.
        hardcore: whether there are stumps, pits and stairs.
        engine: `pymunk`, `box2d` or `reference`.

    Raises:
        ValueError: an argument is out of range.
        Refusal: the engine does not support the scene.
    """

    def __init__(self, render_mode: str | None = None, hardcore: bool = False, engine: str = "pymunk") -> None:
        """Create an environment; `reset` begins an episode."""
        super().__init__("games/bipedal_walker", engine, render_mode)
        self.hardcore = hardcore
        legs = (f"{leg} {number}" for leg in ("first", "second") for number in LEG_NUMBERS)
        self.observed = "angle", "ω", "vx", "vy", *legs, *(f"ray {k + 1}" for k in range(RAYS))
        leg = [math.pi, 5.0, math.pi, 5.0, 5.0]
        high = np.asarray([math.pi, 5.0, 5.0, 5.0, *leg, *leg, *[1.0] * RAYS], np.float32)
        low = -high
        low[[8, 13]] = 0.0
        self.observation_space = spaces.Box(low, high)
        self.action_space = spaces.Box(-1.0, 1.0, (4,), np.float32)
        bodies = self._base.bodies
        self._hull = bodies.names.index("hull")
        self._limbs = [bodies.names.index(name) for name in BODIES]
        self._parents = [self._hull, self._limbs[0], self._hull, self._limbs[2]]
        hull = self._base.polygons[0]
        cosine, sine = math.cos(hull.angle), math.sin(hull.angle)
        dx, dy = (bodies.position[self._hull] - np.asarray(hull.position)).tolist()
        self._centre: Point = (cosine * dx + sine * dy, cosine * dy - sine * dx)
        """centre of mass in the frame of the hull, whose origin is observed, m"""
        angles = RAY_ANGLE / RAYS * np.arange(RAYS)
        self._rays: FloatArray = RAY_LENGTH * np.stack((np.sin(angles), -np.cos(angles)), axis=1)

    def _begin_episode(self) -> None:
        """Begin an episode on a random ground, with a random push."""
        ground, boxes = self._random_ground()
        self.np_random.uniform(size=CLOUD_NUMBERS)
        push = float(self.np_random.uniform(-MAX_START_IMPULSE, MAX_START_IMPULSE))
        self._begin(self._scene_of(ground, boxes, push))
        self._edges, *box_edges = (
            np.column_stack((line[:-1], line[1:])) for line in (ground, *([*box, box[0]] for box in boxes))
        )
        self._box_edges = np.concatenate(box_edges) if box_edges else None
        self._touching = set[tuple[int, int]]()
        self._foot_contact, self._fallen = [0.0, 0.0], False

    def _random_ground(self) -> tuple[list[Point], list[list[Point]]]:
        """Return the corners of a random ground, and the corners of each box on it, m."""
        rng, step = self.np_random, GROUND_STEP
        state, is_first, counter = GRASS, False, START_CORNERS
        y, slope, level = GROUND_HEIGHT, 0.0, 0.0
        stairs, stair_width, stair_sign = 0, 0, 0
        corners, boxes = list[Point](), list[list[Point]]()
        for k in range(GROUND_CORNERS):
            x = k * step
            if state == GRASS and not is_first:
                slope = 0.8 * slope + 0.01 * float(np.sign(GROUND_HEIGHT - y))
                if k > START_CORNERS:
                    slope += float(rng.uniform(-1.0, 1.0)) / SCALE
                y += slope
            elif state == PIT and is_first:
                counter = int(rng.integers(3, 5))
                boxes += [_box(x + d * step, y - 4.0 * step, step, 4.0 * step) for d in (0, counter)]
                counter, level = counter + 2, y
            elif state == PIT:
                y = level - (4.0 * step if counter > 1 else 0.0)
            elif state == STUMP and is_first:
                counter = int(rng.integers(1, 3))
                boxes.append(_box(x, y, counter * step, counter * step))
            elif state == STAIRS and is_first:
                stair_sign = 1 if rng.random() > 0.5 else -1
                stair_width, stairs, level = int(rng.integers(4, 5)), int(rng.integers(3, 5)), y
                boxes += [
                    _box(x + s * stair_width * step, y + (s * stair_sign - 1) * step, stair_width * step, step)
                    for s in range(stairs)
                ]
                counter = stairs * stair_width
            elif state == STAIRS:
                y = level + (stairs * stair_width - counter - stair_sign) / stair_width * stair_sign * step
            corners.append((x, y))
            is_first, counter = False, counter - 1
            if counter == 0:
                counter = int(rng.integers(GRASS_CORNERS // 2, GRASS_CORNERS))
                is_obstacle = state == GRASS and self.hardcore
                state, is_first = int(rng.integers(1, STATES)) if is_obstacle else GRASS, True
        return corners, boxes

    def _scene_of(self, ground: list[Point], boxes: list[list[Point]], push: float) -> Scene:
        """Return the scene of an episode, from the corners of ground and boxes, m, and the push at its start, N·s."""
        base = self._base
        wall, soil = base.walls[0], base.play.markings[-1]
        velocity = push / float(base.bodies.mass.sum()), 0.0
        return base.model_copy(
            update={
                "play": base.play.model_copy(
                    update={
                        "markings": (
                            *base.play.markings[:-1],
                            soil.model_copy(update={"points": (*ground, *below(ground))}),
                        )
                    }
                ),
                # One wall an edge, as the environment tells from which of them to which a foot moves.
                "walls": tuple(
                    wall.model_copy(update={"name": f"ground {k}", "points": tuple(ground[k : k + 2])})
                    for k in range(len(ground) - 1)
                ),
                "boxes": tuple(box.model_copy(update={"velocity": velocity}) for box in base.boxes),
                "polygons": (
                    base.polygons[0].model_copy(update={"velocity": velocity}),
                    *(
                        Polygon(name=f"box {k}", points=box, fixed=True, colour="#ffffff")
                        for k, box in enumerate(boxes)
                    ),
                ),
                "events": (),
            }
        )

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Set the motors, and advance by 0.02 s.

        Args:
            action: level of each motor, −1 to 1.

        Returns:
            Observation, reward, terminated, False, and an empty info dict.

        Raises:
            ValueError: the action is invalid. The environment is left unchanged.
            ResetNeeded: no episode has begun.
        """
        simulation, levels = self._running, checked_numbers(action, 4)
        actuate = Actuate(time=simulation.time, levels=dict(zip(JOINTS, levels, strict=True)))
        contacts = self._advance([actuate])
        frame = simulation.frame()
        self._note_contacts({(max(pair), min(pair)) for pair in contacts.pair.tolist()})

        x, y, angle = self._pose(frame)
        vx, vy = frame.velocity[self._hull].tolist()
        angles, rates = frame.angle.tolist(), frame.angular_velocity.tolist()
        joints = [
            (angles[limb] - angles[parent] + offset, (rates[limb] - rates[parent]) / rate)
            for limb, parent, offset, rate in zip(self._limbs, self._parents, ANGLE_OFFSETS, RATES, strict=True)
        ]
        values = (
            angle,
            2.0 * rates[self._hull] / FRAME_RATE,
            0.3 * vx * WIDTH / FRAME_RATE,
            0.3 * vy * HEIGHT / FRAME_RATE,
            *(*joints[0], *joints[1], self._foot_contact[0]),
            *(*joints[2], *joints[3], self._foot_contact[1]),
            *self._distances(x, y),
        )
        reward = self._gain(130.0 * x / SCALE - 5.0 * abs(angle)) - TORQUE_COST * sum(map(abs, levels))
        is_lost = self._fallen or x < 0.0
        is_over = is_lost or x > (GROUND_CORNERS - GRASS_CORNERS) * GROUND_STEP
        return np.array(values, np.float32), -100.0 if is_lost else reward, is_over, False, {}

    @property
    def _idle_action(self) -> Any:
        return np.zeros(4)

    def _pose(self, frame: Frame) -> tuple[float, float, float]:
        """Return the position of the hull's origin, m, and its angle, rad."""
        (x, y), angle = frame.position[self._hull].tolist(), float(frame.angle[self._hull])
        (dx, dy), sine, cosine = self._centre, math.sin(angle), math.cos(angle)
        return x - cosine * dx + sine * dy, y - sine * dx - cosine * dy, angle

    def _note_contacts(self, touching: set[tuple[int, int]]) -> None:
        """Update the contacts, from pairs of a body and an edge or a box that touch after the present step.

        A foot is off the ground as soon as it leaves an edge, even if it has moved on to the next, as in Gymnasium.
        """
        feet = self._limbs[1], self._limbs[3]
        for value, changed in ((1.0, touching - self._touching), (0.0, self._touching - touching)):
            for pair in changed:
                for k, foot in enumerate(feet):
                    if foot in pair:
                        self._foot_contact[k] = value
        self._fallen = self._fallen or any(self._hull in pair for pair in touching)
        self._touching = touching

    def _distances(self, x: float, y: float) -> list[float]:
        """Return the distances to the ground, in parts of the range, that the range finders measure from a point, m."""
        first = max(int(x / GROUND_STEP) - 1, 0)
        edges = self._edges[first : first + EDGES_IN_RANGE]
        if self._box_edges is not None:
            edges = np.concatenate((edges, self._box_edges))
        start, way = edges[:, :2] - (x, y), edges[:, 2:] - edges[:, :2]
        rays = self._rays[:, None, :]
        cross = rays[..., 0] * way[:, 1] - rays[..., 1] * way[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):  # rays along an edge do not meet it
            along = (start[:, 0] * way[:, 1] - start[:, 1] * way[:, 0]) / cross
            across = (start[:, 0] * rays[..., 1] - start[:, 1] * rays[..., 0]) / cross
        hits = (along >= 0.0) & (across >= 0.0) & (across <= 1.0)
        distances: list[float] = np.where(hits, along, 1.0).min(axis=1).clip(0.0, 1.0).tolist()
        return distances

    def _drawn(self) -> tuple[Scene, Mapping[str, Throttle]]:
        """Return the scene with a view that moves with the walker."""
        scene, frame = self._running.scene, self._running.frame()
        left = float(frame.position[self._hull, 0]) - 0.2 * WIDTH
        play = scene.play.model_copy(update={"view": ((left, 0.0), (left + WIDTH, HEIGHT))})
        return scene.model_copy(update={"play": play}), {}


def _box(x: float, y: float, width: float, height: float) -> list[Point]:
    """Return the corners of a box from its lower left one, m."""
    return [(x, y + height), (x + width, y + height), (x + width, y), (x, y)]
