"""Felt: the balls of a scene on a floor, beside a pymunk space that moves their discs and finds who touches.

A substep: spheres slide and roll on in closed form; pymunk's discs go the same way, by the mean of each one's velocity
over the substep; whom pymunk then finds in contact is dealt with by the laws of `floor.collide`; who lies in a pocket
leaves the space. Of pymunk's own solving, which knows one spin, nothing is used.

Energy, where it is booked: what the cloth takes is FRICTION's, with what balls rub off each other and cushions;
RESTITUTION's is what hits would take if nothing rubbed; what falls into a pocket is RETIRED. Paths are exact, so the
integrator brings nothing; and as nothing is stored in places on a floor, nor does the mending of overlaps.
"""

from typing import NamedTuple

import numpy as np

from sandbox.engines.account import Account, Cause
from sandbox.engines.floor.collide import BALL_BALL, CUSHION
from sandbox.engines.floor.phase import figures_of
from sandbox.engines.limits import BEYOND, FARTHEST, FASTEST
from sandbox.engines.native.cushions import Cushions, cushions_of
from sandbox.engines.native.hits import Laws, resolve
from sandbox.engines.native.meeting import MeetingBodies
from sandbox.engines.native.overlaps import GAP, IMPULSE_X, NORMAL_X, POINT_X, WIDTH
from sandbox.engines.native.rolling import Balls, find_in_pockets, first_beyond, roll_all
from sandbox.engines.roster import MEETS
from sandbox.engines.roster import NOTHING as NOTHING_AT_ALL
from sandbox.engines.touching import NOTHING, ComplexArray, Touching, joined
from sandbox.scene.bodies import Bodies
from sandbox.scene.meetings import Meetings
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings
from sandbox.trajectory import BoolArray, FloatArray, IntArray

ROOM = 100
"""Pairs that hits may bring into contact within a substep, besides as many as were in contact; others wait."""


class State(NamedTuple):
    """The arrays of a population, which the felt writes to."""

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


class Felt:
    """Balls on a floor. Their state is that of the population's arrays, never pymunk's."""

    def __init__(self, scene: Scene, settings: Settings) -> None:
        assert settings.slop is not None and settings.bias is not None
        self._h = settings.h
        self._slop, self._mend = settings.slop, 1.0 - settings.bias**settings.h
        self._floor = figures_of(scene.surface)
        self._solid = len(scene.fixed)
        self._pockets = np.asarray([[*p.position, p.radius] for p in scene.pockets], dtype=np.float64).reshape(-1, 3)
        self.pocket: IntArray = np.empty(0, np.int64)
        """(N,) the pocket that each lies in; −1 for none"""
        self.touching: Touching = NOTHING
        """what touched in the last substep, with what was captured in it"""
        self.account: Account | None = None
        """where energy is booked, if anywhere"""
        self._balls: Balls | None = None
        self._fell: Touching = NOTHING

    def renew(self, scene: Scene, meet: Meetings) -> None:
        """Go on with a scene's changed coefficients, or with more surfaces."""
        surfaces, models = meet.surfaces, scene.contact_models
        self._laws = Laws(
            BALL_BALL[models.ball_ball],
            CUSHION[models.cushion],
            surfaces.restitution,
            surfaces.friction,
            self._floor.grip,
            self._slop,
            self._mend,
        )
        self._cushions: Cushions = cushions_of(scene, surfaces.of_fixed)
        self._surface: IntArray = surfaces.of_body

    def live_in(self, state: State, bodies: Bodies, present: BoolArray) -> None:
        """Advance these arrays from now on; of those that were there before, what was known of them still holds."""
        number = len(bodies)
        pocket = np.full(number, -1, np.int64)
        pocket[: len(self.pocket)] = self.pocket
        self.pocket = pocket
        self._meets = np.asarray([MEETS[each.collides] for each in bodies.elements], np.int64)[bodies.element]
        self._moment = np.where(bodies.fixed, 0.0, bodies.moment)
        self._mass = np.where(bodies.fixed, 0.0, bodies.mass)
        self._way, self._which = np.zeros((number, 2)), np.zeros(number, np.int64)
        self._balls = Balls(
            *state,
            anchor=np.zeros((number, 8)),
            age=np.zeros(number),
            moved=np.zeros(number, np.bool_),
            plays=present & ~bodies.fixed & (pocket < 0),
            meets=np.where(present & (pocket < 0), self._meets, NOTHING_AT_ALL),
            radius=bodies.radius,
            lightness=np.where(bodies.fixed, 0.0, 1.0 / bodies.mass),
            surface=self._surface,
            floor=self._floor,
        )

    @property
    def balls(self) -> Balls:
        """The balls."""
        assert self._balls is not None
        return self._balls

    def free(self, number: int) -> None:
        """Bring a ball that lies in a pocket back into play."""
        self.pocket[number] = -1
        self.balls.plays[number] = True
        self.balls.meets[number] = self._meets[number]

    def leave(self, numbers: IntArray) -> None:
        """Take balls out that are no longer there."""
        self.balls.plays[numbers] = False
        self.balls.meets[numbers] = NOTHING_AT_ALL
        self.pocket[numbers] = -1

    def step(self, meeting: MeetingBodies, time: float, share: float = 1.0) -> None:
        """Advance by a substep or, for the last, by a share of one, from a time, s."""
        balls, h = self.balls, self._h * share
        self._push(meeting.steady.items(), h)
        before = self._energy()
        roll_all(balls, h, self._way)
        self._book(Cause.FRICTION, before)
        meeting.drive(self._way / self._h)
        meeting.step(time)
        pairs, count = _with_room(meeting.pairs(), balls.plays)
        told, taken = np.zeros((len(pairs), WIDTH)), np.zeros(3)
        if count:
            count = resolve(balls, self._cushions, self._laws, pairs, told, taken, count)
            for number in np.flatnonzero(balls.moved).tolist():
                meeting.set_position(number, balls.position[number])
            if self.account is not None:
                self.account.touch(*taken[:2].tolist())
                self.account.add(Cause.FRICTION, float(taken[2]))  # which may give back what it took too soon
        self.touching = _touching(pairs[:count], told[:count])

    def _push(self, steady: list[tuple[int, tuple[FloatArray, float]]], h: float) -> None:
        """Let steady forces and torques act for a time, s, all at once."""
        before = self._energy() if steady else 0.0
        for number, (force, torque) in steady:
            self.balls.velocity[number] += force * (h / self._mass[number])
            self.balls.spin[number] += torque * (h / self._moment[number])
        if steady:
            self._book(Cause.DRIVES, before)

    def capture(self) -> IntArray:
        """Let balls whose centres are within a pocket fall into it, where they lie at its centre; return who did."""
        balls = self.balls
        if not len(self._pockets):
            return np.empty(0, np.int64)
        if not find_in_pockets(balls, self._pockets, self._which):
            return np.empty(0, np.int64)
        numbers = np.flatnonzero(self._which >= 0)
        which = self._which[numbers]
        before = self._energy()
        centre, reach = self._pockets[which, :2], self._pockets[which, 2]
        place = balls.position[numbers]
        given = balls.velocity[numbers] * self._mass[numbers, None]
        normal = (centre - place) / reach[:, None]
        fell = Touching(numbers, -1 - self._solid - which, *map(_complex, (-given, normal, place)))
        self._fell = joined(self._fell, fell)
        self.pocket[numbers] = which
        balls.plays[numbers] = False
        balls.meets[numbers] = NOTHING_AT_ALL
        balls.position[numbers] = centre
        for array in (balls.velocity, balls.roll, balls.spin):
            array[numbers] = 0.0
        self._book(Cause.RETIRED, before)
        return numbers

    def told(self) -> Touching:
        """Return what touched in the last substep, and what has fallen since this was last asked."""
        fell, self._fell = self._fell, NOTHING
        if not len(fell.a):
            return self.touching
        return joined(self.touching, fell)

    def beyond(self) -> tuple[int, str] | None:
        """Return a ball that is not finite or beyond all bounds, and what is the matter; else None."""
        number = first_beyond(self.balls, FARTHEST, FASTEST)
        return None if number < 0 else (number, BEYOND)

    def _energy(self) -> float:
        """Return the energy of all balls, J, where an account is kept."""
        if self.account is None:
            return 0.0
        balls = self.balls
        turning = np.square(balls.roll).sum(axis=1) + np.square(balls.spin)
        return 0.5 * float(self._mass @ np.square(balls.velocity).sum(axis=1) + self._moment @ turning)

    def _book(self, cause: Cause, before: float) -> None:
        if self.account is not None:
            self.account.enter(cause, self._energy() - before)


def _with_room(pairs: IntArray, plays: BoolArray) -> tuple[IntArray, int]:
    """Return pairs (K, 2) each once, in order, with a ball that plays first, and room for more; and how many they are.

    pymunk lists them by addresses.
    """
    if not len(pairs):
        return pairs, 0
    first, second = pairs.max(axis=1), pairs.min(axis=1)
    swapped = (second >= 0) & plays[np.maximum(second, 0)]
    first, second = np.where(swapped, second, first), np.where(swapped, first, second)
    once = np.unique(np.column_stack((first, second))[plays[first]], axis=0)
    return np.concatenate((once, np.zeros((ROOM + len(once), 2), np.int64))), len(once)


def _touching(pairs: IntArray, told: FloatArray) -> Touching:
    """Return contacts as told of: their impulses are on the first."""
    met = (told[:, GAP] < 0.0) | told[:, IMPULSE_X : IMPULSE_X + 2].any(axis=1)  # others were only near
    pairs, told = pairs[met], told[met]
    if not len(pairs):
        return NOTHING
    vectors = (_complex(told[:, k : k + 2]) for k in (IMPULSE_X, NORMAL_X, POINT_X))
    given, normal, point = vectors
    return Touching(pairs[:, 0].copy(), pairs[:, 1].copy(), -given, normal, point)


def _complex(vectors: FloatArray) -> ComplexArray:
    """Return rows (K, 2) as complex numbers (K,)."""
    return vectors[:, 0] + 1j * vectors[:, 1]
