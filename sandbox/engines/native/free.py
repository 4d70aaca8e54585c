"""Free flight: bodies that can meet nothing, advanced together as arrays by pymunk's own rule.

Each operation is the one that Munk2D performs for a body (`cpBodyUpdatePosition`, `cpBodyUpdateVelocity`), in its
order and with its roundings, so the result is bit-identical; only the loop over bodies is numpy's.
"""

import numpy as np

from sandbox.engines.limits import BEYOND, FARTHEST, FASTEST
from sandbox.engines.native.drag import acceleration
from sandbox.engines.native.field import Field
from sandbox.scene.bodies import Bodies
from sandbox.scene.model import World
from sandbox.scene.near import FloatArray, IntArray

BLOCK = 16_384
"""Rows advanced at once, so that the three passes over a block find it in cache: half the time at 100,000."""


class FreeFlight:
    """M bodies in free flight. Rows are this object's own; `numbers` says which body each row is."""

    def __init__(self, world: World, h: float, field: Field | None = None) -> None:
        self._field = field if field is not None and field.attracts else None
        self.numbers: IntArray = np.empty(0, np.int64)
        self.position: FloatArray = np.empty((0, 2))
        self.velocity: FloatArray = np.empty((0, 2))
        self.angle: FloatArray = np.empty(0)
        self.angular_velocity: FloatArray = np.empty(0)
        self._mass: FloatArray = np.empty(0)
        self._moment: FloatArray = np.empty(0)
        self._force: FloatArray = np.empty((0, 2))
        self._torque: FloatArray = np.empty(0)
        self._h = h
        self.world = world
        self._layout_changed()

    def __len__(self) -> int:
        return len(self.numbers)

    def join(
        self,
        numbers: IntArray,
        bodies: Bodies,
        position: FloatArray,
        velocity: FloatArray,
        angle: FloatArray,
        angular_velocity: FloatArray,
        moment: FloatArray,
    ) -> None:
        """Add bodies, (M,) numbers with their present state."""
        count = len(numbers)
        for name, more in (
            ("numbers", numbers),
            # Adding 0.0 makes −0.0 a plain 0, as the sums of Munk2D do.
            ("position", position + 0.0),
            ("velocity", velocity + 0.0),
            ("angle", angle + 0.0),
            ("angular_velocity", angular_velocity + 0.0),
            ("_mass", bodies.mass[numbers]),
            ("_moment", moment),
            ("_force", np.zeros((count, 2))),
            ("_torque", np.zeros(count)),
        ):
            setattr(self, name, np.concatenate((getattr(self, name), more)))
        self._layout_changed()

    def leave(self, numbers: IntArray) -> None:
        """Take bodies out."""
        stay = ~np.isin(self.numbers, numbers)
        if stay.all():
            return
        for name in ("numbers", "position", "velocity", "angle", "angular_velocity"):
            setattr(self, name, getattr(self, name)[stay])
        for name in ("_mass", "_moment", "_force", "_torque"):
            setattr(self, name, getattr(self, name)[stay])
        self._layout_changed()

    def live_in(
        self, position: FloatArray, velocity: FloatArray, angle: FloatArray, angular_velocity: FloatArray
    ) -> None:
        """Keep the state in arrays of scene order from now on, where rows are consecutive bodies: no copying then."""
        if not isinstance(self._slots, slice):
            return
        for name, array in (
            ("position", position),
            ("velocity", velocity),
            ("angle", angle),
            ("angular_velocity", angular_velocity),
        ):
            home = array[self._slots]
            home[...] = getattr(self, name)
            setattr(self, name, home)
        self._layout_changed()
        self._at_home = True

    def _layout_changed(self) -> None:
        self._at_home = False
        size = min(BLOCK, len(self))
        self._moved, self._kick = np.empty((size, 2)), np.empty((size, 2))
        self._blocks = [
            (self.position[a : a + BLOCK], self.velocity[a : a + BLOCK]) for a in range(0, len(self), BLOCK)
        ]
        first = int(self.numbers[0]) if len(self) else 0
        consecutive = np.array_equal(self.numbers, np.arange(first, first + len(self)))
        self._slots: slice | IntArray = slice(first, first + len(self)) if consecutive else self.numbers
        self.forces_changed()

    def forces_changed(self) -> None:
        """Work out anew which stages a substep needs."""
        world = self.world
        self._pushed = bool(self._force.any())
        self._twisted = bool(self._torque.any())
        self._dragged = world.linear_drag > 0 or world.quadratic_drag > 0
        self._falls = world.gravity != (0.0, 0.0)
        self.turns = bool(self.angular_velocity.any()) or self._twisted
        if len(self):
            self._kick[:] = (np.asarray(world.gravity) + 0.0) * self._h

    def _row(self, number: int) -> int:
        return int(np.flatnonzero(self.numbers == number)[0])

    def push(self, number: int, force: FloatArray, torque: float) -> None:
        """Let a steady force (N) and torque (N·m) act on a body from now on."""
        row = self._row(number)
        self._force[row], self._torque[row] = force, torque
        self.forces_changed()

    def steady(self, number: int) -> tuple[FloatArray, float]:
        """Return the steady force and torque on a body."""
        row = self._row(number)
        return self._force[row].copy(), float(self._torque[row])

    def moment(self, number: int) -> float:
        """Return a body's moment of inertia, kg·m²."""
        return float(self._moment[self._row(number)])

    def give_moment(self, number: int, moment: float) -> None:
        """Let a body turn from now on."""
        self._moment[self._row(number)] = moment

    def set_position(self, number: int, position: FloatArray) -> None:
        """Put a body somewhere, m."""
        self.position[self._row(number)] = position

    def set_velocity(self, number: int, velocity: FloatArray) -> None:
        """Give a body a velocity, m/s."""
        self.velocity[self._row(number)] = velocity

    def set_spin(self, number: int, spin: float) -> None:
        """Give a body an angular velocity, rad/s."""
        self.angular_velocity[self._row(number)] = spin
        self.forces_changed()

    def write(
        self, position: FloatArray, velocity: FloatArray, angle: FloatArray, angular_velocity: FloatArray
    ) -> None:
        """Write the present state into arrays in scene order."""
        if self._at_home:
            return
        at = self._slots
        position[at], velocity[at] = self.position, self.velocity
        if self.turns:
            angle[at], angular_velocity[at] = self.angle, self.angular_velocity

    def beyond(self) -> tuple[int, str] | None:
        """Return a body that is not finite or beyond all bounds, and what is the matter; else None.

        Under gravity alone what a scene can start with stays finite for as many steps as it may have, so
        nothing is looked at then.
        """
        if not (self._pushed or self._twisted or self._dragged or self._field is not None):
            return None
        place, speed = np.hypot(*self.position.T), np.hypot(*self.velocity.T)
        good = (place <= FARTHEST) & (speed <= FASTEST) & np.isfinite(self.angular_velocity)
        return None if good.all() else (int(self.numbers[np.argmin(good)]), BEYOND)

    def step(self) -> None:
        """Advance by one substep: positions by the old velocity, then velocities by their kick."""
        if not len(self.numbers):
            return
        forced = self._dragged or self._pushed or self._field is not None
        for position, velocity in self._blocks:
            moved = self._moved[: len(position)]
            np.multiply(velocity, self._h, out=moved)
            position += moved
            if self._falls and not forced:
                velocity += self._kick[: len(velocity)]
        if forced:
            self.velocity += self._forced_kick()
        if self.turns:
            self.angle += self.angular_velocity * self._h
        if self._twisted:
            self.angular_velocity += self._torque * (1.0 / self._moment) * self._h

    def _forced_kick(self) -> FloatArray:
        """Return (g + a + f/m)·h, a the pull of the field; with drag, whose force already holds gravity, g is 0."""
        mass = self._mass[:, None]
        inverse = 1.0 / mass
        if self._dragged:
            push = self._force * inverse if self._pushed else None
            kick = (mass * acceleration(self.world, self.velocity, push, self._h)) * inverse
            return (kick if self._field is None else self._field.at(self.position) + kick) * self._h
        gravity = np.asarray(self.world.gravity)
        pull = gravity if self._field is None else gravity + self._field.at(self.position)
        return (pull + self._force * inverse) * self._h
