"""Bodies that can touch nothing, as arrays: they are advanced outside the space, by compiled kernels or numpy.

Each operation is that of Munk2D on a body (`cpBodyUpdatePosition`, `cpBodyUpdateVelocity`), in its order and with its
rounding, so the result is identical to pymunk's, bit for bit, with and without compiled kernels. Compiled, all substeps
of a frame are computed while a body's state is in registers.
"""

from bisect import bisect_left
from collections.abc import Iterator, Mapping

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.base import BEYOND, FARTHEST, FASTEST
from sandbox.engines.forces.air import (
    Air,
    mean_acceleration,
    mean_angular_acceleration,
    mean_fraction,
    rates,
    scaled,
)
from sandbox.engines.pymunk_adapter.forces import AttractionField, damping_factor
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.description.world import World


def runs_of(indices: IntArray) -> IntArray:
    """Return the first index of each run of consecutive sorted indices (M,), and the index after its last, (K, 2)."""
    if not len(indices):
        return np.empty((0, 2), np.int64)
    breaks = np.flatnonzero(np.diff(indices) != 1) + 1
    first = indices[np.concatenate(([0], breaks))]
    last = indices[np.concatenate((breaks - 1, [len(indices) - 1]))]
    return np.column_stack((first, last + 1))


BLOCK = 16_384
"""Rows that numpy processes at once, so that they stay in the cache: half the time at 100,000 bodies."""

MIN_COMPILED = 200
"""Number of bodies from which on the compiled loop is used; below it numpy does the same, and no compiler is loaded."""

SCATTERED = 16
"""Number of runs of consecutive indices from which on numpy gathers bodies instead of processing run by run."""


class Particles:
    """M bodies in free flight, which are rows of the arrays of all N: nothing is copied."""

    def __init__(self, world: World, h: float, field: AttractionField | None = None) -> None:
        self._field = field if field is not None and field.attracts else None
        self.indices: IntArray = np.empty(0, np.int64)
        """(M,) body indices of the particles, ascending"""
        self._h = h
        self.world = world
        self._forces: dict[int, tuple[FloatArray, float]] = {}

    def __len__(self) -> int:
        return len(self.indices)

    def rebuild_arrays(
        self,
        position: FloatArray,
        velocity: FloatArray,
        angle: FloatArray,
        angular_velocity: FloatArray,
        bodies: Bodies,
    ) -> None:
        """Use these arrays of all N bodies from now on; each must be contiguous."""
        self._position, self._velocity, self._angle, self._spin = position, velocity, angle, angular_velocity
        self._flat = position.reshape(-1), velocity.reshape(-1)
        self._bodies, self._mass, self._moment = bodies, bodies.mass, bodies.moment

    def join(self, indices: IntArray) -> None:
        """Add bodies, (M,) indices, that are no particles yet."""
        for array in (self._position, self._velocity, self._angle, self._spin):
            array[indices] += 0.0  # turns −0.0 into 0.0, as the sums of Munk2D do
        self._set_indices(np.sort(np.concatenate((self.indices, indices))))

    def leave(self, indices: IntArray) -> None:
        """Remove bodies; indices of other bodies are ignored."""
        for index in self._forces.keys() & set(indices.tolist()) if self._forces else ():
            del self._forces[index]
        is_removed = np.zeros(len(self._mass), np.bool_)
        is_removed[indices] = True
        self._set_indices(self.indices[~is_removed[self.indices]])

    def holds(self, index: int) -> bool:
        """Return whether a body is a particle."""
        row = bisect_left(self.indices, index)
        return row < len(self.indices) and int(self.indices[row]) == index

    def _set_indices(self, indices: IntArray) -> None:
        self.indices, self._runs = indices, runs_of(indices)
        self.rebuild()

    @property
    def has_only_gravity(self) -> bool:
        """Whether only gravity acts."""
        is_slowed = self._air.acts_by_force or self.world.has_damping
        return self._field is None and not (self._has_force or self._has_torque or is_slowed)

    @property
    def forces(self) -> Mapping[int, tuple[FloatArray, float]]:
        """Constant forces, N, and torques, N·m, by body index."""
        return self._forces

    def rebuild(self) -> None:
        """Update the forces that a substep needs."""
        world = self.world
        self._scaled: IntArray = self.indices[self._bodies.gravity_scale[self.indices] != 1.0]
        self._has_force = any(force.any() for force, _ in self._forces.values()) or len(self._scaled) > 0
        self._has_torque = any(torque for _, torque in self._forces.values())
        self._air = Air.of(world, self._bodies, self.indices)
        self._damping_factor = damping_factor(world.damping, self._h) if world.has_damping else 1.0
        self.can_turn = bool(self._spin[self.indices].any()) or self._has_torque
        self._kick: FloatArray = (np.asarray(world.gravity) + 0.0) * self._h
        if not self._compiled:
            return
        from sandbox.engines.pymunk_adapter.particle_kernels import tile_of

        self._kick_tile = tile_of(self._kick)
        if self._air.flows and self._air.is_linear:
            fraction = float(mean_fraction(np.asarray([world.linear_drag]), self._h)[0])
            self._drift = np.repeat(self._mass, 2), tile_of(world.gravity), tile_of(world.wind)
            self._drag = world.linear_drag, fraction

    def set_constant_force(self, index: int, force: FloatArray, torque: float) -> None:
        """Apply a constant force (N) and torque (N·m) to a body from now on."""
        self._forces[index] = force, torque
        self.rebuild()

    def constant_force(self, index: int) -> tuple[FloatArray, float]:
        """Return the constant force and torque on a body."""
        force, torque = self._forces.get(index, (np.zeros(2), 0.0))
        return force.copy(), torque

    def set_position(self, index: int, position: FloatArray) -> None:
        """Set the position of a body, m."""
        self._position[index] = position

    def set_angle(self, index: int, angle: float) -> None:
        """Set the angle of a body, rad."""
        self._angle[index] = angle

    def set_velocity(self, index: int, velocity: FloatArray) -> None:
        """Set the velocity of a body, m/s."""
        self._velocity[index] = velocity

    def set_spin(self, index: int, spin: float) -> None:
        """Set the angular velocity of a body, rad/s."""
        self._spin[index] = spin
        self.rebuild()

    def beyond(self) -> tuple[int, str] | None:
        """Return a body that is not finite or out of bounds, and a description; else None.

        Under gravity alone nothing is checked: every valid start stays finite for the largest number of steps.
        """
        if not (self._has_force or self._has_torque or self._air.acts_by_force or self._field is not None):
            return None
        # Quick test: if both coordinates are below half a bound, the length is below the bound.
        if self._compiled and not self._has_torque:
            from sandbox.engines.pymunk_adapter.particle_kernels import all_within

            position, speed = self._flat
            if all_within(position, self._runs, 0.5 * FARTHEST) and all_within(speed, self._runs, 0.5 * FASTEST):
                return None
        position, speed = (np.hypot(*array[self.indices].T) for array in (self._position, self._velocity))
        is_valid = (position <= FARTHEST) & (speed <= FASTEST) & np.isfinite(self._spin[self.indices])
        return None if is_valid.all() else (int(self.indices[np.argmin(is_valid)]), BEYOND)

    @property
    def _compiled(self) -> bool:
        if len(self.indices) < MIN_COMPILED:
            return False
        from sandbox.engines.common.kernel import COMPILED

        return COMPILED

    def step(self, substeps: int = 1) -> None:
        """Advance by some substeps: in each, positions by the old velocity, then velocities."""
        if not len(self.indices):
            return
        turns_faster = self._has_torque or self._air.damps_bodies
        if substeps > 1 and turns_faster and self._air.depends_on_spin:  # which changes from substep to substep
            for _ in range(substeps):
                self.step()
            return
        compiled = self._compiled and not self.world.has_damping
        has_uniform_air = self._air.is_linear and not self._air.damps_bodies
        has_forces = self._has_force or self._field is not None or not has_uniform_air
        if compiled and not has_forces:
            self._step_compiled(substeps)
        else:
            self._step_with_numpy(substeps, has_forces or self._air.acts_by_force)
        if self._has_torque:
            for _ in range(substeps):
                self._turn_with_torques()
        elif self.can_turn and compiled and not self._air.damps_bodies:
            from sandbox.engines.pymunk_adapter.particle_kernels import turn

            turn(self._angle, self._spin, self._runs, self._h, substeps)
        elif self.can_turn:
            for piece in self._pieces():
                for _ in range(substeps):
                    self._turn(piece)

    def _step_compiled(self, substeps: int) -> None:
        from sandbox.engines.pymunk_adapter.particle_kernels import drift, fall

        if not self._air.flows:
            fall(*self._flat, self._runs, self._h, self._kick_tile, substeps)
        else:
            mass, gravity, wind = self._drift
            drift(*self._flat, self._runs, self._h, mass, gravity, wind, *self._drag, substeps)

    def _step_with_numpy(self, substeps: int, has_forces: bool) -> None:
        uniform_kick = self._kick
        forces = self._force_array() if self._has_force else None
        for piece in self._pieces():
            position, velocity = self._position[piece], self._velocity[piece]
            displacement = np.empty_like(velocity)
            mass = self._mass[piece][:, None]
            force = None if forces is None else forces[piece]
            for _ in range(substeps):
                np.multiply(velocity, self._h, out=displacement)
                position += displacement
                kick = self._forced_kick(piece, position, velocity, mass, force) if has_forces else uniform_kick
                if self.world.has_damping:
                    velocity *= self._damping_factor
                velocity += kick
            if not isinstance(piece, slice):
                self._position[piece], self._velocity[piece] = position, velocity

    def _pieces(self) -> Iterator[slice | IntArray]:
        """Yield the rows to advance together. Only slices give views that can be written in place."""
        if len(self._runs) >= SCATTERED:
            for first in range(0, len(self.indices), BLOCK):
                yield self.indices[first : first + BLOCK]
            return
        for first, end in self._runs.tolist():
            for begin in range(first, end, BLOCK):
                yield slice(begin, min(begin + BLOCK, end))

    def _force_array(self) -> FloatArray:
        """Return the constant forces on all bodies, (N, 2) N."""
        forces = np.zeros_like(self._position)
        for index, (force, _) in self._forces.items():
            forces[index] = force
        if len(self._scaled):  # in the operations of `PymunkBodies`, for bodies in the space
            world, scale = np.asarray(self.world.gravity), self._bodies.gravity_scale[self._scaled]
            forces[self._scaled] += (scale[:, None] * world - world) * self._mass[self._scaled][:, None]
        return forces

    def _turn_with_torques(self) -> None:
        """Advance angles, then the spins of bodies with a constant torque; those of damped ones are up to date."""
        for piece in self._pieces():
            self._turn(piece)
        for index, (_, torque) in self._forces.items():
            if not self._air.angular_damping[index]:
                self._spin[index] += torque * (1.0 / self._moment[index]) * self._h

    def _turn(self, piece: slice | IntArray) -> None:
        """Advance the angles of some rows by a substep, then damp their spins."""
        self._angle[piece] += self._spin[piece] * self._h
        if self._air.damps_bodies:
            self._damp_spins(piece)
        if self.world.has_damping:
            self._spin[piece] *= self._damping_factor

    def _damp_spins(self, piece: slice | IntArray) -> None:
        """Advance the spins of those of some rows that have angular damping."""
        rows = np.arange(len(self._spin))[piece]
        rows = rows[self._air.angular_damping[rows] > 0.0]
        torque = np.asarray([self._forces[n][1] if n in self._forces else 0.0 for n in rows.tolist()], np.float64)
        inverse = 1.0 / self._moment[rows]
        mean = mean_angular_acceleration(self._air, rows, self._spin[rows], torque * inverse, self._h)
        self._spin[rows] += (self._moment[rows] * mean) * inverse * self._h

    def _forced_kick(
        self,
        piece: slice | IntArray,
        position: FloatArray,
        velocity: FloatArray,
        mass: FloatArray,
        force: FloatArray | None,
    ) -> FloatArray:
        """Return (g + a + f/m)·h of some rows, a the attraction; with air, whose force includes gravity, g is 0."""
        inverse = 1.0 / mass
        if self._air.acts_by_force:
            acceleration_by_force = None if force is None else force * inverse
            air, spin = self._air, self._spin[piece]
            mean = mean_acceleration(air, piece, self.world.gravity, velocity, spin, acceleration_by_force, self._h)
            kick = (mass * mean) * inverse
            if self._field is not None:
                kick += scaled(self._field.at(position), mean_fraction(rates(air, piece, velocity, spin), self._h))
            return kick * self._h
        gravity = np.asarray(self.world.gravity)
        acceleration_sum = gravity if self._field is None else gravity + self._field.at(position)
        return (acceleration_sum + (np.zeros(2) if force is None else force * inverse)) * self._h
