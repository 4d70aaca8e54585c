"""All bodies of a simulation: those in the pymunk space, those that can touch nothing, and changes by actions.

Bodies that can touch something are in the pymunk space (`SpaceBodies`), all others in arrays (`Particles`); both follow
the same scheme. A body joins the space when something that it can touch appears, and stays there.
"""

import math
from collections.abc import Mapping

import numpy as np

from sandbox.action import ActionError
from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.body_store import BodyStore
from sandbox.engines.forces.air import Air
from sandbox.engines.pymunk_adapter.particles import Particles
from sandbox.engines.pymunk_adapter.requirements import combination_faults
from sandbox.engines.pymunk_adapter.space import SpaceBodies
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.demands import Demand, air_demands, demands_of_body
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import BodySource, BodySpec, Collides, Point
from sandbox.scene.description.world import Settings, World

MAX_OVERLAPPED_BODIES = 100
"""Number of bodies that a new body may overlap: pymunk takes minutes to separate a thousand at one point."""

MAX_CANDIDATES = 1000
"""The same for bodies that pass through each other: pymunk still tests every pair."""


def check_overlaps(
    centre: FloatArray, radius: float, collides: Collides, position: FloatArray, bodies: Bodies, present: BoolArray
) -> None:
    """Check that a body at a position would not overlap too many bodies.

    Args:
        centre: position of the body, (2,) m.
        radius: of the body, m.
        collides: what the body collides with.
        position: (N, 2) m, of all bodies.
        bodies: all.
        present: (N,) whether each body is in the scene.

    Raises:
        ActionError: it would overlap too many.
    """
    is_near = np.hypot(*(position - centre).T) < bodies.radius + radius
    overlapping = bodies.element[is_near & present]
    kinds = [bodies.elements[element].collides for element in overlapping.tolist()]
    colliding, candidates = kinds.count("all"), len(kinds) - kinds.count("none")
    if collides == "all" and colliding >= MAX_OVERLAPPED_BODIES:
        raise ActionError(f"it would overlap {colliding} bodies; pymunk can separate at most {MAX_OVERLAPPED_BODIES}")
    if candidates >= MAX_CANDIDATES:
        raise ActionError(f"it would overlap {candidates} bodies; the limit is {MAX_CANDIDATES}")


class PymunkBodies(BodyStore):
    """State of all bodies of a running scene as arrays in scene order, and the space and particles that advance it.

    The arrays are read from the space when they are asked for; see `refresh`. With `half_kick` the velocities are half
    a kick ahead of time.
    """

    def __init__(self, setup: Setup, settings: Settings) -> None:
        self._settings, self.ended, self._is_fresh = settings, False, True
        self._half_kick = 0.5 * settings.h if settings.half_kick else 0.0
        self.space_bodies = SpaceBodies(setup, settings)
        self.particles = Particles(setup.scene.world, settings.h, self.space_bodies.field)
        super().__init__(setup, settings.h)
        self._ahead = self._velocity_ahead()
        self.velocity[~self.bodies.fixed] += self.ahead
        self.space_bodies.layer = self.layer
        self.space_bodies.rebuild(self.scene, self._air, self.contact_matrix)
        self.distribute(np.arange(len(self.bodies)))

    def _derive_solver_arrays(self) -> None:
        """Derive none: pymunk has its own, and to derive them takes longer than to remove a body."""

    @property
    def ahead(self) -> FloatArray:
        """Velocity, (2,) m/s, by which velocities are ahead of time: half a kick, or 0."""
        return self._ahead

    def _velocity_ahead(self) -> FloatArray:
        """Return `ahead` for the present gravity."""
        return np.asarray(self.scene.world.gravity) * self._half_kick

    @property
    def can_turn(self) -> bool:
        """Whether an angle may change."""
        return self.particles.can_turn or len(self.space_bodies) > 0

    def invalidate(self) -> None:
        """Record that the space and particles have advanced beyond the arrays."""
        self._is_fresh = self.ended

    def end(self) -> None:
        """Keep the arrays as they are from now on."""
        self.refresh()
        self.ended = True

    def refresh(self) -> None:
        """Update the arrays in scene order."""
        if not self._is_fresh:
            self._is_fresh = True
            self.space_bodies.write(self.position, self.velocity, self.angle, self.angular_velocity)

    def break_joints(self) -> IntArray:
        """Remove joints whose load exceeded their strength in the last substep; return their indices."""
        self.refresh()
        return self.space_bodies.joints.break_overloaded(
            self.position, self.velocity, self.angle, self.angular_velocity, self.h
        )

    def distribute(self, indices: IntArray) -> None:
        """Add each of some bodies to the space or to the particles."""
        matrix, bodies = self.contact_matrix, self.bodies
        is_particle = matrix.free[indices] & ~self._needs_space[indices]
        state = self.position, self.velocity, self.angle, self.angular_velocity
        self.particles.rebuild_arrays(*state, bodies)
        self.particles.join(indices[is_particle & ~bodies.fixed[indices]])
        # In the space, a body that nothing can turn gets no moment, unless its rotation could keep it awake. A particle
        # keeps it, for torques of actions.
        moment = np.where(matrix.turnable | bool(self._settings.sleeping), bodies.moment, math.inf)
        in_space = indices[~is_particle]
        position, velocity, angle, spin = (array[in_space] for array in state)
        self.space_bodies.join(in_space, bodies, position, velocity, angle, spin, moment[in_space])
        self._update_scaled_gravity(in_space)
        self.space_bodies.add_joints(self.all_joints)

    def _update_scaled_gravity(self, indices: IntArray) -> None:
        """Update the gravity on those of some bodies in the space that scale it."""
        if self.scales_by_force:
            for index in indices[self.bodies.gravity_scale[indices] != 1.0].tolist():
                self._update_gravity(index)

    @property
    def scales_by_force(self) -> bool:
        """Whether gravity scales are forces on bodies in the space; else they act in pymunk's velocity update."""
        return self.bodies.scales_gravity and not self._settings.sleeping

    def _update_gravity(self, index: int) -> None:
        """Apply the force by which gravity on a body in the space differs from the world's."""
        world, scale = np.asarray(self.scene.world.gravity), self.bodies.gravity_scale[index]
        zone = self._zone_gravity(index)
        force: FloatArray | None = None
        if zone is not None or scale != 1.0:
            force = (scale * (world if zone is None else np.asarray(zone)) - world) * self.bodies.mass[index]
        self.space_bodies.constant_forces.set_gravity_force(index, force)

    def _zone_gravity(self, index: int) -> Point | None:
        """Return the gravity, m/s², that a zone applies to a body in place of the world's; None without."""
        del index
        return None

    @property
    def _needs_space(self) -> BoolArray:
        """(N,) bodies that only the space can move: kinematic ones, those with thrusts, tyres, drives or speed limits.

        All bodies if they attract each other, can fall asleep or there is a liquid.
        """
        space_bodies, scene = self.space_bodies, self.scene
        if space_bodies.field.between_bodies or self._settings.sleeping or scene.liquids:
            return np.ones(len(self.bodies), dtype=np.bool_)
        if not (scene.thrusts or scene.drives or space_bodies.tyres is not None):
            return self.bodies.kinematic | self.bodies.limited
        has_thrust, is_driven = space_bodies.thrusts.acts_on, space_bodies.drives.holds
        acts = np.asarray([has_thrust(k) or is_driven(name) for k, name in enumerate(self.bodies.names)], np.bool_)
        if space_bodies.tyres is not None:
            acts[space_bodies.tyres.indices] = True
        return self.bodies.kinematic | self.bodies.limited | acts

    def change(self, setup: Setup, spawned: tuple[BodySource, ...] | None = None) -> None:
        """Continue with a changed scene, as `BodyStore.change`.

        Raises:
            ActionError: as `BodyStore.change`, or the settings or pymunk do not support the change.
        """
        if faults := combination_faults(setup.scene, self._settings, self._demands(setup.scene.world)):
            raise ActionError(faults[0])
        matrix = self.contact_matrix
        self.refresh()
        present_velocity = self.velocity[self.mobile] - self.ahead
        super().change(setup, spawned)
        self._ahead = self._velocity_ahead()
        self.velocity[self.mobile] = present_velocity + self.ahead
        if self._half_kick:
            for index in self.space_bodies.movable_indices():
                self.space_bodies.set_velocity(index, self.velocity[index])
        self.particles.world = setup.scene.world
        self.particles.rebuild()
        if self.contact_matrix is matrix:  # the same bodies, in another world
            self.space_bodies.rebuild_world(setup.scene, self._air)
        else:
            self.space_bodies.rebuild(setup.scene, self._air, self.contact_matrix)
        self.space_bodies.joints.update(self.all_joints)
        if self.scales_by_force:
            self._update_scaled_gravity(np.asarray(self.space_bodies.movable_indices(), np.int64))

    def _demands(self, world: World) -> frozenset[Demand]:
        """Return the demands of the bodies, with those that actions have added, and of a world."""
        bodies, present = self.bodies, self.present
        others = {
            Demand.KINEMATIC: bodies.kinematic & present,
            Demand.GRAVITY_SCALE: (bodies.gravity_scale != 1.0) & present,
            Demand.SPEED_LIMITS: bodies.limited & present,
        }
        return air_demands(world, bodies, present) | {demand for demand, which in others.items() if which.any()}

    @property
    def _air(self) -> Air:
        return Air.of(self.scene.world, self.bodies, self.present)

    def add(self, single: BodySpec, name: str) -> int:
        """Add a body and return its index, as `BodyStore.add`.

        Raises:
            ActionError: as `BodyStore.add`, or pymunk does not support the body in the scene.
        """
        wanted = self._demands(self.scene.world) | demands_of_body(single, self.scene)
        if faults := combination_faults(self.scene, self._settings, wanted):
            raise ActionError(f"pymunk: {faults[0]}")
        self.refresh()
        index = super().add(single, name)
        self.velocity[index] += np.zeros(2) if single.fixed else self.ahead
        self.space_bodies.layer = self.layer
        self.space_bodies.rebuild(self.scene, self._air, self.contact_matrix)
        self.space_bodies.add_missing_shapes(self.bodies)
        touching = np.flatnonzero(self.present & ~self.contact_matrix.free).tolist()
        outside = [n for n in touching if n != index and not self.space_bodies.holds(n)]
        self._move_to_space(np.asarray(outside, np.int64))
        self.distribute(np.asarray([index]))
        return index

    def _move_to_space(self, indices: IntArray) -> None:
        """Move particles that can now touch something to the space."""
        if not len(indices):
            return
        particles = indices[np.isin(indices, self.particles.indices)]
        forces = {n: self.particles.constant_force(n) for n in particles.tolist()}
        self.particles.leave(indices)
        self.distribute(indices)
        for index, (force, torque) in forces.items():
            if torque:
                self.space_bodies.give_moment(index, float(self.bodies.moment[index]))
            if force.any() or torque:
                self.space_bodies.set_constant_force(index, force, torque)

    def remove_bodies(self, indices: IntArray, time: float) -> None:
        """Remove bodies at a time, s. Their rows stay in the arrays, with zero velocity."""
        self.refresh()
        self.particles.leave(indices)
        self.space_bodies.leave(np.asarray([n for n in indices.tolist() if self.space_bodies.holds(n)], np.int64))
        super().remove_bodies(indices, time)

    def motion(self, index: int) -> tuple[FloatArray, float]:
        """Return the velocity (2,), m/s, and the angular velocity, rad/s, of a body."""
        self.refresh()
        return self.velocity[index] - self.ahead, float(self.angular_velocity[index])

    def set_velocity(self, index: int, velocity: FloatArray) -> None:
        """Set the velocity of a body, m/s."""
        velocity_ahead = velocity + self.ahead
        super().set_velocity(index, velocity_ahead)
        self._owner(index).set_velocity(index, velocity_ahead)

    def set_spin(self, index: int, spin: float) -> None:
        """Set the angular velocity of a body, rad/s."""
        super().set_spin(index, spin)
        self._owner(index).set_spin(index, spin)

    def set_constant_force(self, index: int, force: FloatArray, torque: float) -> None:
        """Apply a constant force (N) and torque (N·m) to a body from now on."""
        super().set_constant_force(index, force, torque)
        owner = self._owner(index)
        if torque and owner is self.space_bodies and not math.isfinite(owner.moment(index)):
            owner.give_moment(index, float(self.bodies.moment[index]))
        owner.set_constant_force(index, force, torque)

    def move_body(self, index: int, position: FloatArray) -> None:
        """Set the position of a body, m."""
        self.refresh()
        super().move_body(index, position)
        owner = self._holder(index)
        if owner is not None:
            owner.set_position(index, position)

    def turn_body(self, index: int, angle: float) -> None:
        """Set the angle of a body, rad."""
        self.refresh()
        super().turn_body(index, angle)
        owner = self._holder(index)
        if owner is not None:
            owner.set_angle(index, angle)

    def _owner(self, index: int) -> Particles | SpaceBodies:
        """Return the part that holds a body; the space for a fixed body that nothing can touch."""
        return self.particles if self.particles.holds(index) else self.space_bodies

    def _holder(self, index: int) -> Particles | SpaceBodies | None:
        """Return the part that holds a body; None for a fixed body that nothing can touch."""
        if self.particles.holds(index):
            return self.particles
        return self.space_bodies if self.space_bodies.holds(index) else None

    def throttle(self, index: int, level: float) -> None:
        """Set the level of a thrust, by its index in the scene: the fraction of its force that acts."""
        self.space_bodies.thrusts.set_level(index, level)

    def steer(self, index: int, levels: tuple[float, float, float]) -> None:
        """Set the throttle, brake and steering of a tyre, by its index in the scene."""
        assert self.space_bodies.tyres is not None
        self.space_bodies.tyres.set_levels(index, levels)

    def drive(self, index: int, level: float) -> None:
        """Set the level of a drive, by its index in the scene."""
        self.space_bodies.drives.set(index, level)

    def actuate(self, levels: Mapping[int, float]) -> None:
        """Set the levels of motors, by the rows of the joints."""
        super().actuate(levels)
        self.space_bodies.joints.update(self.all_joints)

    def check_place(self, position: tuple[float, float], radius: float, collides: Collides) -> None:
        """Check that pymunk can place a body at a position.

        Raises:
            ActionError: the position is out of range, or would overlap too many bodies.
        """
        centre = np.asarray(position)
        self.refresh()
        if not self.space_bodies.reaches(centre):
            raise ActionError(f"{position} m is out of range of pymunk's half-planes")
        check_overlaps(centre, radius, collides, self.position, self.bodies, self.present)
