"""Time-step solver of balls on a surface: closed-form motion, and collision response at the times of impact.

A substep: spheres slide, roll and spin in closed form; a collision detector moves their discs by the mean velocity of
the substep and returns the pairs in contact (`PairFinder`); `contacts.resolve` takes each pair back to its time of
impact and applies the models of `collisions`; balls in a pocket are captured.

Energy accounting: friction of the cloth, of balls against each other and against cushions is FRICTION; RESTITUTION is
the loss of the same impacts without friction; the energy of a pocketed ball is RETIRED. Paths are exact, so the
integrator contributes nothing. Nor does the correction of overlaps: a horizontal surface stores no energy by position.
"""

from collections.abc import Iterable
from typing import NamedTuple, Protocol

import numpy as np

from sandbox.action import ActionError
from sandbox.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from sandbox.engines.common.base import BEYOND
from sandbox.engines.common.body_store import COLLISION_MASKS, NOTHING
from sandbox.engines.common.colliders import StaticColliders
from sandbox.engines.common.contact_log import NO_CONTACTS, ContactBatch, join_batches
from sandbox.engines.common.state_bounds import first_beyond
from sandbox.engines.contract import Exhaustion
from sandbox.engines.energy_ledger import Cause, EnergyLedger
from sandbox.engines.tabletop.collisions import BALL_BALL, CUSHION
from sandbox.engines.tabletop.contacts import (
    GAP,
    IMPULSE_X,
    NORMAL_X,
    POINT_X,
    WIDTH,
    Cushions,
    HitParameters,
    cushions_of,
    resolve,
)
from sandbox.engines.tabletop.motion import TabletopBalls, advance_all, figures_of, find_in_pockets
from sandbox.resource_limits import PAIRS
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.contacts import ContactMatrix
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings

EXTRA_PAIRS = 100
"""Number of pairs beyond twice the initial ones that collisions may bring into contact within a substep; further pairs
are found in the next substep."""


TESTS_PER_PAIR = 10
"""Tests of a pair or ball after a collision, of 1 to 3 ns each, that count as one pair test of the resource limit."""


class BallArrays(NamedTuple):
    """Arrays of all bodies, which the stepper writes to."""

    position: FloatArray
    """(N, 2) m"""
    velocity: FloatArray
    """(N, 2) m/s"""
    roll: FloatArray
    """(N, 2) rad/s, about x and y"""
    spin: FloatArray
    """(N,) rad/s, about z"""
    angle: FloatArray
    """(N,) rad"""


class PairFinder(Protocol):
    """Collision detection between balls, and of balls with cushions."""

    def find_pairs(self, velocity: FloatArray) -> IntArray:
        """Return the pairs (K, 2) in contact after a substep with mean velocities (N, 2), m/s.

        The arrays of the stepper have the positions after the substep already. Static collider k has the index −1 − k.
        Pairs may repeat, come in any order, and include pairs that do not touch.
        """

    def set_position(self, index: int, position: FloatArray) -> None:
        """Set the position, (2,) m, of a ball that collision response has moved."""


class TabletopStepper:
    """Balls on a surface. It owns their state, in the arrays of all bodies."""

    def __init__(self, scene: Scene, settings: Settings) -> None:
        assert settings.slop is not None and settings.bias is not None
        self._h = settings.h
        self._slop, self._correction = settings.slop, 1.0 - settings.bias**settings.h
        self._collider_count = len(scene.fixed)
        self._pockets = np.asarray([[*p.position, p.radius] for p in scene.pockets], dtype=np.float64).reshape(-1, 3)
        self.pocket: IntArray = np.empty(0, np.int64)
        """(N,) index of the pocket that each ball lies in; −1 for none"""
        self.touching: ContactBatch = NO_CONTACTS
        """contacts of the last substep"""
        self.account: EnergyLedger | None = None
        """energy ledger; None while accounting is off"""
        self._balls: TabletopBalls | None = None
        self._captures: ContactBatch = NO_CONTACTS
        self._max_tests = TESTS_PER_PAIR * PAIRS.value

    def rebuild(self, scene: Scene, matrix: ContactMatrix, static: StaticColliders) -> None:
        """Update after a change of the scene's coefficients or surfaces."""
        surfaces, models = matrix.surfaces, scene.contact_models
        self._floor = figures_of(scene.surface)
        self._parameters = HitParameters(
            BALL_BALL[models.ball_ball],
            CUSHION[models.cushion],
            surfaces.restitution,
            surfaces.friction,
            self._floor.grip,
            self._slop,
            self._correction,
        )
        self._cushions: Cushions = cushions_of(scene, static, surfaces.of_fixed)
        self._surface: IntArray = surfaces.of_body

    def rebuild_arrays(self, state: BallArrays, bodies: Bodies, present: BoolArray, held: BoolArray) -> None:
        """Use these arrays from now on. Pockets of bodies that were there before are kept.

        Args:
            state: arrays of N bodies.
            bodies: their start.
            present: (N,) whether each is in the scene.
            held: (N,) whether a zone holds each.
        """
        count = len(bodies)
        pocket = np.full(count, -1, np.int64)
        pocket[: len(self.pocket)] = self.pocket
        self.pocket = pocket
        self._masks = np.asarray([COLLISION_MASKS[each.collides] for each in bodies.elements], np.int64)[bodies.element]
        self._moment = np.where(bodies.fixed, 0.0, bodies.moment)
        self._mass = np.where(bodies.fixed, 0.0, bodies.mass)
        self._displacement, self._pocket_index = np.zeros((count, 2)), np.zeros(count, np.int64)
        self._balls = TabletopBalls(
            *state,
            anchor=np.zeros((count, 8)),
            age=np.zeros(count),
            moved=np.zeros(count, np.bool_),
            in_play=present & ~bodies.fixed & ~held & (pocket < 0),
            collision_mask=np.where(present & (pocket < 0), self._masks, NOTHING),
            radius=bodies.radius,
            inverse_mass=np.where(bodies.fixed | held, 0.0, 1.0 / bodies.mass),
            surface=self._surface,
            floor=self._floor,
        )

    @property
    def balls(self) -> TabletopBalls:
        """Arrays of the balls, for kernels."""
        assert self._balls is not None
        return self._balls

    @property
    def can_repeat_pairs(self) -> bool:
        """Whether a ball and a wall can have several contacts at once, in a corner of the wall."""
        return len(self._cushions.collider) > len(np.unique(self._cushions.collider))

    def check_in_play(self, index: int, name: str) -> None:
        """Refuse to set a ball in motion that is in a pocket.

        Raises:
            ActionError: it is in a pocket.
        """
        if self.pocket[index] >= 0:
            raise ActionError(f"{name!r} is in a pocket; move it back into play first")

    def return_to_play(self, index: int) -> None:
        """Return a ball from its pocket to play."""
        self.pocket[index] = -1
        self.balls.in_play[index] = True
        self.balls.collision_mask[index] = self._masks[index]

    def remove(self, indices: IntArray) -> None:
        """Remove balls that have left the scene."""
        self.balls.in_play[indices] = False
        self.balls.collision_mask[indices] = NOTHING
        self.pocket[indices] = -1

    def step(
        self,
        finder: PairFinder,
        forces: Iterable[tuple[int, tuple[FloatArray, float]]],
        fraction: float = 1.0,
    ) -> None:
        """Advance by a substep or, for the last, by a fraction of one.

        Args:
            finder: collision detector.
            forces: constant force (2,), N, and torque, N·m, by ball index.
            fraction: fraction of a substep.

        Raises:
            Exhaustion: so many balls touch at once that resolving their collisions would take too long.
        """
        balls, h = self.balls, self._h * fraction
        self._apply_forces(forces, h)
        before = self._energy()
        advance_all(balls, h, self._displacement)
        self._attribute(Cause.FRICTION, before)
        found = _with_cushions(finder.find_pairs(self._displacement / self._h), self._cushions.collider)
        pairs, count = _distinct_pairs(found, balls.in_play)
        rows, work = np.zeros((len(pairs), WIDTH)), np.zeros(3)
        if count:
            initial_count = count
            count = resolve(balls, self._cushions, self._parameters, pairs, rows, work, count, self._max_tests)
            if count < 0:
                remedy = PAIRS.remedy(10 * PAIRS.value)
                raise Exhaustion(f"a substep with {initial_count:,} pairs of balls in contact takes too long; {remedy}")
            for index in np.flatnonzero(balls.moved).tolist():
                finder.set_position(index, balls.position[index])
            if self.account is not None:
                self.account.add_contacts(*work[:2].tolist())
                self.account.add_unchecked(Cause.FRICTION, float(work[2]))  # may be positive: undone friction
        self.touching = _touching(pairs[:count], rows[:count], self._cushions.collider)

    def _apply_forces(self, forces: Iterable[tuple[int, tuple[FloatArray, float]]], h: float) -> None:
        """Apply constant forces and torques for a time, s, as one impulse."""
        items = list(forces)
        before = self._energy() if items else 0.0
        for index, (force, torque) in items:
            self.balls.velocity[index] += force * (h / self._mass[index])
            self.balls.spin[index] += torque * (h / self._moment[index])
        if items:
            self._attribute(Cause.DRIVES, before)

    def capture(self) -> IntArray:
        """Move balls whose centres are within a pocket to its centre, out of play; return their indices."""
        balls = self.balls
        if not len(self._pockets):
            return np.empty(0, np.int64)
        if not find_in_pockets(balls, self._pockets, self._pocket_index):
            return np.empty(0, np.int64)
        indices = np.flatnonzero(self._pocket_index >= 0)
        pocket = self._pocket_index[indices]
        before = self._energy()
        centre, radius = self._pockets[pocket, :2], self._pockets[pocket, 2]
        position = balls.position[indices]
        momentum = balls.velocity[indices] * self._mass[indices, None]
        normal = (centre - position) / radius[:, None]
        captures = ContactBatch(
            indices, -1 - self._collider_count - pocket, *map(_complex, (-momentum, normal, position))
        )
        self._captures = join_batches(self._captures, captures)
        self.pocket[indices] = pocket
        balls.in_play[indices] = False
        balls.collision_mask[indices] = NOTHING
        balls.position[indices] = centre
        for array in (balls.velocity, balls.roll, balls.spin):
            array[indices] = 0.0
        self._attribute(Cause.RETIRED, before)
        return indices

    def drain_contacts(self) -> ContactBatch:
        """Return the contacts of the last substep, and the captures since the last call."""
        captures, self._captures = self._captures, NO_CONTACTS
        if not len(captures.a):
            return self.touching
        return join_batches(self.touching, captures)

    def beyond(self) -> tuple[int, str] | None:
        """Return a ball that is not finite or out of bounds, and a description; else None."""
        balls = self.balls
        index = first_beyond(balls.position, balls.velocity, balls.angle, balls.spin, balls.roll)
        return None if index < 0 else (index, BEYOND)

    def _energy(self) -> float:
        """Return the energy of all balls, J, if accounting is on."""
        if self.account is None:
            return 0.0
        balls = self.balls
        squared_spin = np.square(balls.roll).sum(axis=1) + np.square(balls.spin)
        return 0.5 * float(self._mass @ np.square(balls.velocity).sum(axis=1) + self._moment @ squared_spin)

    def _attribute(self, cause: Cause, before: float) -> None:
        if self.account is not None:
            self.account.add(cause, self._energy() - before)


def _distinct_pairs(pairs: IntArray, in_play: BoolArray) -> tuple[IntArray, int]:
    """Return distinct pairs (K, 2) in order, a ball in play first, with room for more; and their number.

    pymunk lists pairs by memory address.
    """
    if not len(pairs):
        return pairs, 0
    first, second = pairs.max(axis=1), pairs.min(axis=1)
    swapped = (second >= 0) & in_play[np.maximum(second, 0)]
    first, second = np.where(swapped, second, first), np.where(swapped, first, second)
    distinct = np.unique(np.column_stack((first, second))[in_play[first]], axis=0)
    return np.concatenate((distinct, np.zeros((EXTRA_PAIRS + len(distinct), 2), np.int64))), len(distinct)


def _with_cushions(pairs: IntArray, collider: IntArray) -> IntArray:
    """Return pairs (K, 2) in which each static collider, −1 − k, is replaced by each of its cushions.

    Args:
        pairs: pairs of balls, and of balls with static colliders.
        collider: as `Cushions.collider`.
    """
    is_static = (pairs < 0).any(axis=1)
    if not is_static.any():
        return pairs
    ball, wall = pairs[is_static].max(axis=1), -1 - pairs[is_static].min(axis=1)
    begin, end = np.searchsorted(collider, wall), np.searchsorted(collider, wall, side="right")
    count = end - begin
    cushion = np.arange(count.sum()) + np.repeat(begin - (np.cumsum(count) - count), count)
    return np.concatenate((pairs[~is_static], np.column_stack((np.repeat(ball, count), -1 - cushion))))


def _touching(pairs: IntArray, rows: FloatArray, collider: IntArray) -> ContactBatch:
    """Return contacts as a batch, from their rows (K, WIDTH); `collider` as in `Cushions`."""
    is_touching = (rows[:, GAP] < 0.0) | rows[:, IMPULSE_X : IMPULSE_X + 2].any(axis=1)  # other pairs were only close
    pairs, rows = pairs[is_touching], rows[is_touching]
    if not len(pairs):
        return NO_CONTACTS
    vectors = (_complex(rows[:, k : k + 2]) for k in (IMPULSE_X, NORMAL_X, POINT_X))
    impulse, normal, point = vectors
    second = pairs[:, 1].copy()
    static = second < 0
    second[static] = -1 - collider[-1 - second[static]]
    return ContactBatch(pairs[:, 0].copy(), second, -impulse, normal, point)


def _complex(vectors: FloatArray) -> ComplexArray:
    """Return rows (K, 2) as complex numbers (K,)."""
    return vectors[:, 0] + 1j * vectors[:, 1]
