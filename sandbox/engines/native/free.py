"""Free flight: bodies that can meet nothing, advanced together as arrays by pymunk's own rule.

Each operation is the one that Munk2D performs for a body (`cpBodyUpdatePosition`, `cpBodyUpdateVelocity`), in its
order and with its roundings, so the result is bit-identical; only the loop over bodies is compiled, or numpy's.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from sandbox.engines.kernel import COMPILED
from sandbox.engines.limits import BEYOND, FARTHEST, FASTEST
from sandbox.engines.native.drag import acceleration, is_dragged, mean_share, rates
from sandbox.engines.native.field import Field
from sandbox.engines.native.flight import calm, drift, fall, runs_of, tile_of, turn
from sandbox.scene.bodies import Bodies
from sandbox.scene.model import World
from sandbox.scene.near import FloatArray, IntArray

BLOCK = 16_384
"""Rows that numpy advances at once, so that its passes over a block find it in cache: half the time at 100,000."""

MANY = 200
"""Bodies from which on a compiled loop is worth fetching; below it numpy does the same."""

SCATTERED = 16
"""Runs of consecutive numbers, from which on numpy collects their bodies instead of going run by run."""


class FreeFlight:
    """M bodies in free flight, which are rows of the arrays of all N: nothing is copied."""

    def __init__(self, world: World, h: float, field: Field | None = None) -> None:
        self._field = field if field is not None and field.attracts else None
        self.numbers: IntArray = np.empty(0, np.int64)
        """(M,) of those in flight, in order"""
        self._h = h
        self.world = world
        self._steady: dict[int, tuple[FloatArray, float]] = {}

    def __len__(self) -> int:
        return len(self.numbers)

    def live_in(
        self,
        position: FloatArray,
        velocity: FloatArray,
        angle: FloatArray,
        angular_velocity: FloatArray,
        bodies: Bodies,
    ) -> None:
        """Advance rows of these arrays from now on, which hold all N bodies and lie in one piece each."""
        self._position, self._velocity, self._angle, self._spin = position, velocity, angle, angular_velocity
        self._flat = position.reshape(-1), velocity.reshape(-1)
        self._mass, self._moment = bodies.mass, bodies.moment

    def join(self, numbers: IntArray) -> None:
        """Let bodies fly, (M,) numbers of such as do not yet."""
        for array in (self._position, self._velocity, self._angle, self._spin):
            array[numbers] += 0.0  # makes −0.0 a plain 0, as the sums of Munk2D do
        self._fly(np.sort(np.concatenate((self.numbers, numbers))))

    def leave(self, numbers: IntArray) -> None:
        """Take bodies out, of which some may not be here."""
        for number in self._steady.keys() & set(numbers.tolist()) if self._steady else ():
            del self._steady[number]
        gone = np.zeros(len(self._mass), np.bool_)
        gone[numbers] = True
        self._fly(self.numbers[~gone[self.numbers]])

    def holds(self, number: int) -> bool:
        """Tell whether a body flies."""
        at = int(np.searchsorted(self.numbers, number))
        return at < len(self.numbers) and int(self.numbers[at]) == number

    def _fly(self, numbers: IntArray) -> None:
        self.numbers, self._runs = numbers, runs_of(numbers)
        self.forces_changed()

    @property
    def even(self) -> bool:
        """Whether gravity alone acts."""
        return self._field is None and not (self._pushed or self._twisted or self._dragged)

    @property
    def pushes(self) -> Mapping[int, tuple[FloatArray, float]]:
        """Steady forces, N, and torques, N·m, by the number of the body."""
        return self._steady

    def forces_changed(self) -> None:
        """Work out anew which stages a substep needs."""
        world = self.world
        self._pushed = any(force.any() for force, _ in self._steady.values())
        self._twisted = any(torque for _, torque in self._steady.values())
        self._dragged = is_dragged(world)
        self.turns = bool(self._spin[self.numbers].any()) or self._twisted
        self._kick = tile_of((np.asarray(world.gravity) + 0.0) * self._h)
        if self._dragged and self._compiled:
            share = float(mean_share(np.asarray([world.linear_drag]), self._h)[0])
            self._air = np.repeat(self._mass, 2), tile_of(world.gravity), tile_of(world.wind)
            self._drag = world.linear_drag, share

    def push(self, number: int, force: FloatArray, torque: float) -> None:
        """Let a steady force (N) and torque (N·m) act on a body from now on."""
        self._steady[number] = force, torque
        self.forces_changed()

    def steady(self, number: int) -> tuple[FloatArray, float]:
        """Return the steady force and torque on a body."""
        force, torque = self._steady.get(number, (np.zeros(2), 0.0))
        return force.copy(), torque

    def set_position(self, number: int, position: FloatArray) -> None:
        """Put a body somewhere, m."""
        self._position[number] = position

    def set_velocity(self, number: int, velocity: FloatArray) -> None:
        """Give a body a velocity, m/s."""
        self._velocity[number] = velocity

    def set_spin(self, number: int, spin: float) -> None:
        """Give a body an angular velocity, rad/s."""
        self._spin[number] = spin
        self.forces_changed()

    def beyond(self) -> tuple[int, str] | None:
        """Return a body that is not finite or beyond all bounds, and what is the matter; else None.

        Under gravity alone what a scene can start with stays finite for as many steps as it may have, so
        nothing is looked at then.
        """
        if not (self._pushed or self._twisted or self._dragged or self._field is not None):
            return None
        if self._compiled and not self._twisted:  # a glance: two numbers below half a length make less than all of it
            place, speed = self._flat
            if calm(place, self._runs, 0.5 * FARTHEST) and calm(speed, self._runs, 0.5 * FASTEST):
                return None
        place, speed = (np.hypot(*array[self.numbers].T) for array in (self._position, self._velocity))
        good = (place <= FARTHEST) & (speed <= FASTEST) & np.isfinite(self._spin[self.numbers])
        return None if good.all() else (int(self.numbers[np.argmin(good)]), BEYOND)

    @property
    def _compiled(self) -> bool:
        return COMPILED and len(self.numbers) >= MANY

    def step(self, substeps: int = 1) -> None:
        """Advance by some substeps: in each, positions by the old velocity, then velocities by their kick."""
        if not len(self.numbers):
            return
        world, compiled = self.world, self._compiled
        forced = self._pushed or self._field is not None or world.quadratic_drag > 0
        if compiled and not forced and not self._dragged:
            fall(*self._flat, self._runs, self._h, self._kick, substeps)
        elif compiled and not forced:
            mass, gravity, wind = self._air
            drift(*self._flat, self._runs, self._h, mass, gravity, wind, *self._drag, substeps)
        else:
            self._fly_by_numpy(substeps, forced or self._dragged)
        if self._twisted:
            for _ in range(substeps):
                self._twist()
        elif self.turns and compiled:
            turn(self._angle, self._spin, self._runs, self._h, substeps)
        elif self.turns:
            for piece in self._pieces():
                for _ in range(substeps):
                    self._angle[piece] += self._spin[piece] * self._h

    def _fly_by_numpy(self, substeps: int, forced: bool) -> None:
        even = self._kick[:2]
        pushes = self._pushes() if self._pushed else None
        for piece in self._pieces():
            position, velocity = self._position[piece], self._velocity[piece]
            moved = np.empty_like(velocity)
            mass = self._mass[piece][:, None]
            push = None if pushes is None else pushes[piece]
            for _ in range(substeps):
                np.multiply(velocity, self._h, out=moved)
                position += moved
                velocity += self._forced_kick(position, velocity, mass, push) if forced else even
            if not isinstance(piece, slice):
                self._position[piece], self._velocity[piece] = position, velocity

    def _pieces(self) -> Iterator[slice | IntArray]:
        """Yield which rows to advance together; only slices are written to in place."""
        if len(self._runs) >= SCATTERED:
            for first in range(0, len(self.numbers), BLOCK):
                yield self.numbers[first : first + BLOCK]
            return
        for first, end in self._runs.tolist():
            for begin in range(first, end, BLOCK):
                yield slice(begin, min(begin + BLOCK, end))

    def _pushes(self) -> FloatArray:
        """Return the steady forces on all bodies, (N, 2) N."""
        forces = np.zeros_like(self._position)
        for number, (force, _) in self._steady.items():
            forces[number] = force
        return forces

    def _twist(self) -> None:
        """Turn bodies, and change the spins of those that a torque acts on."""
        for piece in self._pieces():
            self._angle[piece] += self._spin[piece] * self._h
        for number, (_, torque) in self._steady.items():
            self._spin[number] += torque * (1.0 / self._moment[number]) * self._h

    def _forced_kick(
        self, position: FloatArray, velocity: FloatArray, mass: FloatArray, force: FloatArray | None
    ) -> FloatArray:
        """Return (g + a + f/m)·h, a the pull of the field; with drag, whose force already holds gravity, g is 0."""
        inverse = 1.0 / mass
        if self._dragged:
            push = None if force is None else force * inverse
            kick = (mass * acceleration(self.world, velocity, push, self._h)) * inverse
            if self._field is not None:
                kick += self._field.at(position) * mean_share(rates(self.world, velocity), self._h)[:, None]
            return kick * self._h
        gravity = np.asarray(self.world.gravity)
        pull = gravity if self._field is None else gravity + self._field.at(position)
        return (pull + (np.zeros(2) if force is None else force * inverse)) * self._h
