"""Perturbed starts of a scene: the same level, a little different, as a player meets it.

A measurement on the one start in the file says little about others: whether a fast body misses a wall depends on where
its steps begin. `Starts` draws starts by their numbers. Number 0 is the start in the file; another one has

- each free body, and each group of bodies that touch or are joined, displaced by up to `spread` times the smallest half
  width of a body in the scene,
- each velocity changed by up to `spread` of its value, and that of a free body turned by up to `spread` rad,
- free bodies turned by up to half a degree for a spread of 1 %, and moved on by a part of a step of free motion,
  so that the steps fall elsewhere in the motion; these parts divide the step evenly, however many starts there are,
- groups that hang at one point of the world turned about it by up to half a degree,
- another seed, if the scene has random bodies.

No start has an overlap that the scene does not have, and none stretches a joint: bodies for which that is not possible,
such as a rope between two posts, start as in the file.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from sandbox.action import Action
from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.formatting import format_quantity
from sandbox.measure.metrics.clearance import IndexPair, close_pairs
from sandbox.measure.metrics.perturbation import (
    TOUCH_TOLERANCE,
    TouchingPair,
    connected_groups,
    perturb,
    touching_pairs,
)
from sandbox.measure.seeds import is_random, with_seed
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.drives import is_driven
from sandbox.scene.compile.joint_arrays import WORLD, JointKind
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.geometry.vectors import rotate
from sandbox.scene.random_streams import Stream, draws

DEFAULT_SPREAD = 0.01
MAX_SPREAD = 0.5
DEFAULT_STARTS = 30
MAX_STARTS = 10_000
HELD_FRACTION = 0.95
"""Fraction of the starts in which a setting must be within its tolerance, or break no rule, to be accepted"""
TURN_PER_SPREAD = 0.87
"""rad: a spread of 1 % turns free bodies by up to half a degree"""
SEED_COUNT = 2**63
"""Seeds wrap around to 0."""
GOLDEN_RATIO = 0.5 * (math.sqrt(5.0) - 1.0)
"""Difference of the phases of successive starts, in steps: the phases of any number of starts divide the step evenly,
so that they estimate odds better than random ones."""
MAX_WIDTHS = 16.0
"""Largest free motion before the start, in half widths of the body, as more takes long to check for what is in its way;
a faster body is moved on by a smaller part of a step."""
STRETCH_TOLERANCE = 1e-9
"""m: ends of a joint that part by more than this count as stretched; rounding of a rigid motion is far smaller"""


@dataclass(frozen=True)
class Starts:
    """Starts of a scene by their numbers, 0 for that in the file; `run(Starts(scene).start(7))` runs one of them.

    Such a scene cannot be written to a file.
    """

    scene: Scene
    spread: float = DEFAULT_SPREAD
    """largest change, as a fraction; 0: all starts are that of the file, but for the seed"""
    step: float | None = None
    """s, a part of which free bodies are moved on; default: the dt of the scene. It should be the longest dt of the
    runs, so that each phase of their steps occurs"""

    def __post_init__(self) -> None:
        """Raise ValueError if the spread is not from 0 to `MAX_SPREAD`."""
        check_spread(self.spread)

    @property
    def distance(self) -> float:
        """Largest displacement of a group of bodies, m."""
        movable = self._movable(self.scene.bodies)
        return self.spread * float(self.scene.bodies.thin[movable].min()) if movable.any() else 0.0

    @property
    def can_vary(self) -> bool:
        """Whether the starts differ; they do not if nothing moves, or all hangs at rest between several points."""
        if is_random(self.scene):
            return True
        own, other = self.scene.bodies, self.start(1).bodies
        return any(
            not np.array_equal(getattr(own, name), getattr(other, name))
            for name in ("position", "velocity", "angle", "angular_velocity")
        )

    def __str__(self) -> str:
        """Return the changes in words: `positions ± 0.5 mm, velocities ± 1 %, angles ± 0.5°, the phase of the step`."""
        parts = []
        if self.distance > 0.0:
            parts += [
                f"positions ± {format_quantity(self.distance, 'm')}",
                f"velocities ± {100.0 * self.spread:g} %",
                f"angles ± {math.degrees(TURN_PER_SPREAD * self.spread):.2g}°",
                "the phase of the step",
            ]
        if is_random(self.scene):
            parts.append("the seed")
        return ", ".join(parts) if parts else "no changes"

    def start(self, number: int) -> Scene:
        """Return the scene with a start.

        Args:
            number: of the start; the same number gives the same start, bit for bit.

        Raises:
            ValueError: the number is negative.
        """
        if number < 0:
            raise ValueError(f"number: must be at least 0, is {number}")
        if number == 0:
            return self.scene
        scene = self.scene
        if is_random(scene):
            scene = with_seed(scene, (scene.world.seed + number) % SEED_COUNT)
        if not self.spread:
            return scene
        random = draws(Stream.STARTS, self.scene.world.seed, number)
        return scene.started_from(self._changed(scene, random, number))

    def actions(self, actions: Sequence[Action], number: int) -> tuple[Action, ...]:
        """Return the actions of a player who acts up to a frame later, by a time of its own for each moment.

        Args:
            actions: those for start 0, in the order of their times.
            number: of the start; 0 changes nothing.
        """
        if number == 0 or not actions or not self.spread:
            return tuple(actions)
        random = draws(Stream.REACTIONS, self.scene.world.seed, number)
        moments, moment = np.unique([each.time for each in actions], return_inverse=True)
        step = self.scene.solver.dt if self.step is None else self.step
        later = np.maximum.accumulate(moments + step * random.uniform(size=len(moments)))
        return tuple(each.at(time) for each, time in zip(actions, later[moment].tolist(), strict=True))

    def _movable(self, bodies: Bodies) -> BoolArray:
        return ~(bodies.fixed | is_driven(self.scene, bodies))

    @cached_property
    def _own(self) -> "_Unperturbed":
        return _Unperturbed.of(self.scene, self.distance)

    def _changed(self, scene: Scene, random: np.random.Generator, number: int) -> Bodies:
        """Return the bodies of a scene in another start."""
        base = self._own if scene is self.scene else _Unperturbed.of(scene, self.distance)
        own, movable = base.setup.bodies, self._movable(base.setup.bodies)
        free, group = movable & base.free, base.group
        # Numbers for all bodies, so that those of one do not depend on the state of another.
        heading, length = 2.0 * math.pi * random.uniform(size=len(own)), np.sqrt(random.uniform(size=len(own)))
        factor, turn, rotation = random.uniform(-1.0, 1.0, (3, len(own)))
        step = scene.solver.dt if self.step is None else self.step
        time = number * GOLDEN_RATIO % 1.0 * step
        factor = 1.0 + self.spread * factor[group]  # one for joined bodies, so that they keep moving together
        velocity = own.velocity * factor[:, None]
        velocity[free] = _rotated(velocity, self.spread * turn)[free]
        times = time * _motion_fraction(scene, own, velocity, step)[:, None]
        fall = own.gravity_scale[:, None] * np.asarray(scene.world.gravity) * times
        shift = self.distance * length[:, None] * np.column_stack((np.cos(heading), np.sin(heading)))
        shift += (velocity + 0.5 * fall) * times
        velocity[free] += fall[free]
        rotation *= TURN_PER_SPREAD * self.spread
        together = self._moved_together(base, random, number, rotation)
        changed = replace(
            own,
            position=np.where(free[:, None], own.position + shift, together.position),
            angle=np.where(free, own.angle + np.where(own.round, 0.0, rotation), together.angle),
            velocity=np.where(movable[:, None], velocity, own.velocity),
            angular_velocity=np.where(movable, own.angular_velocity * factor, own.angular_velocity),
            roll=np.where(movable[:, None], own.roll * factor[:, None], own.roll),
        )
        return _without_faults(base, changed, free)

    def _moved_together(
        self, base: "_Unperturbed", random: np.random.Generator, number: int, rotation: FloatArray
    ) -> Bodies:
        """Return the bodies with those that touch or are joined moved, so that they still touch and are joined.

        A group that hangs at one point of the world is rotated about it; one that hangs at several, or whose angle a
        weld or a gear holds, is not moved.
        """
        own, amount = base.setup.bodies, self.distance * math.sqrt(random.uniform())
        reverse = bool(random.integers(2))
        moved = perturb(base.setup, amount, number, reverse, base.touching) if amount > 0.0 else None
        found = own if moved is None else moved.bodies
        position, angle = found.position.copy(), found.angle.copy()
        for label, points in base.anchors.items():
            members = np.flatnonzero(base.group == label)
            position[members], angle[members] = own.position[members], own.angle[members]
            if len(points) == 1 and label not in base.angle_held:
                (point,) = points
                by = np.full(len(members), rotation[label])
                position[members] = point + _rotated(own.position[members] - point, by)
                angle[members] += by
        return replace(own, position=position, angle=angle)


@dataclass(frozen=True)
class _Unperturbed:
    """Start of a scene that others differ from."""

    setup: Setup
    touching: list[TouchingPair]
    """pairs that touch, or may do so after a displacement"""
    free: BoolArray
    """bodies that neither touch anything nor have a joint, (N,)"""
    group: IntArray
    """for each body, the lowest index of the bodies that joints connect it with, (N,)"""
    anchors: dict[int, set[tuple[float, float]]]
    """points of the world at which each group hangs, by the label of the group"""
    angle_held: frozenset[int]
    """labels of the groups whose angle the world holds"""
    overlaps: dict[IndexPair, float]
    """depth of each overlap, m"""

    @classmethod
    def of(cls, scene: Scene, distance: float) -> Self:
        """Derive it from a scene whose bodies are to be displaced by up to a distance, m."""
        setup = Setup.of(scene)
        touching, group = touching_pairs(setup, max(TOUCH_TOLERANCE, 2.0 * distance)), _joined_groups(setup)
        free = np.ones(len(setup.bodies), np.bool_)
        for pair, _ in touching:
            free[[number for number in pair if number >= 0]] = False
        for ends in (setup.joints.a, setup.joints.b):
            free[ends[ends != WORLD]] = False
        anchors, angle_held = _anchors(setup, group), _angle_held(setup, group)
        return cls(setup, touching, free, group, anchors, angle_held, _overlaps(setup, setup.bodies))


def check_spread(spread: float) -> None:
    """Raise ValueError if a spread is not from 0 to `MAX_SPREAD`."""
    if not 0.0 <= spread <= MAX_SPREAD:
        raise ValueError(f"spread: must be from 0 to {MAX_SPREAD:g}, such as 0.01 for 1 %; is {spread:g}")


def allowed_failures(count: int) -> int:
    """Return in how many of some starts an accepted setting may fail."""
    return math.floor((1.0 - HELD_FRACTION) * count + 1e-9)


def _without_faults(base: _Unperturbed, changed: Bodies, free: BoolArray) -> Bodies:
    """Return the bodies moved as far as they neither overlap anything nor stretch a joint.

    Free bodies move in steps of about half a width, so that none passes through another one or a wall.
    """
    setup, own, group = base.setup, base.setup.bodies, base.group
    shift, turn = changed.position - own.position, changed.angle - own.angle
    widths = np.hypot(*shift[free].T) / own.thin[free]
    count = max(1, math.ceil(widths.max(initial=0.0)))
    fraction = np.zeros(len(own))
    stopped = np.zeros(len(own), np.bool_)
    for k in range(1, count + 1):
        wanted = np.where(free, k / count, float(k == count))  # others move at once, so that they keep together
        while True:
            tried = np.where(stopped, fraction, wanted)
            placed = replace(changed, position=own.position + tried[:, None] * shift, angle=own.angle + tried * turn)
            faulty = _overlapping(setup, placed, base.overlaps) | _stretched(setup, placed)
            blocked = np.isin(group, group[sorted(faulty)]) & ~stopped & (tried > 0.0)
            if not blocked.any():
                break
            stopped |= blocked
        fraction = tried
    return placed


def _motion_fraction(scene: Scene, bodies: Bodies, velocity: FloatArray, step: float) -> FloatArray:
    """Return the fraction of a step, s, in which each body covers at most `MAX_WIDTHS` of its half widths, (N,)."""
    gravity = math.hypot(*scene.world.gravity) * np.abs(bodies.gravity_scale)
    distance = np.hypot(*velocity.T) * step + 0.5 * gravity * step**2
    with np.errstate(divide="ignore", over="ignore"):
        return np.asarray(np.fmin(1.0, MAX_WIDTHS * bodies.thin / distance))


def _rotated(vectors: FloatArray, angles: FloatArray) -> FloatArray:
    """Return vectors, (N, 2), rotated by angles, (N,) rad."""
    return np.column_stack(rotate(vectors[:, 0], vectors[:, 1], np.cos(angles), np.sin(angles)))


def _joined_groups(setup: Setup) -> IntArray:
    """Return for each body the lowest index of the bodies that joints connect it with, (N,), not through fixed ones."""
    fixed, pairs = setup.bodies.fixed, zip(setup.joints.a.tolist(), setup.joints.b.tolist(), strict=True)
    joined = [(a, b) for a, b in pairs if a != WORLD and not (fixed[a] or fixed[b])]
    return connected_groups(len(setup.bodies), joined)


def _anchors(setup: Setup, group: IntArray) -> dict[int, set[tuple[float, float]]]:
    """Return the points of the world at which each group hangs, by the label of the group."""
    joints, bodies = setup.joints, setup.bodies
    still = bodies.fixed | is_driven(setup.scene, bodies)
    found: dict[int, set[tuple[float, float]]] = {}
    first, second = joints.ends(bodies.position, bodies.angle)
    for k, (a, b) in enumerate(zip(joints.a.tolist(), joints.b.tolist(), strict=True)):
        for number, other, point in ((a, b, second[k]), (b, a, first[k])):
            if number != WORLD and not still[number] and (other == WORLD or still[other]):
                found.setdefault(int(group[number]), set()).add((float(point[0]), float(point[1])))
    return found


def _angle_held(setup: Setup, group: IntArray) -> frozenset[int]:
    """Return the labels of the groups with a joint that holds an angle to the world, or to a body that cannot move."""
    bodies, gears = setup.bodies, setup.joints.of(JointKind.GEAR)
    still = np.append(bodies.fixed | is_driven(setup.scene, bodies), True)  # the world, −1, selects the last row
    held = (gears.b[still[gears.a]].tolist(), gears.a[still[gears.b]].tolist())
    return frozenset(int(group[body]) for side in held for body in side if body != WORLD)


def _overlaps(setup: Setup, bodies: Bodies) -> dict[IndexPair, float]:
    """Return the depth of each overlap, m."""
    return {pair: -clear for pair, clear in close_pairs(replace(setup, bodies=bodies)) if clear < 0.0}


def _overlapping(setup: Setup, bodies: Bodies, allowed: dict[IndexPair, float]) -> set[int]:
    """Return the bodies that overlap deeper than in the scene."""
    found = _overlaps(setup, bodies).items()
    deeper = (pair for pair, depth in found if depth > allowed.get(pair, 0.0) + TOUCH_TOLERANCE)
    return {number for pair in deeper for number in pair if number >= 0}


def _stretched(setup: Setup, changed: Bodies) -> set[int]:
    """Return the bodies of joints whose ends are farther from each other, or nearer, than in the scene."""
    joints, own = setup.joints, setup.bodies
    before, after = joints.ends(own.position, own.angle), joints.ends(changed.position, changed.angle)
    length = np.hypot(*(before[1] - before[0]).T), np.hypot(*(after[1] - after[0]).T)
    wrong = np.abs(length[1] - length[0]) > STRETCH_TOLERANCE
    return {number for ends in (joints.a, joints.b) for number in ends[wrong].tolist() if number != WORLD}
