"""All bodies of a simulation: those in the pymunk space, those that can touch nothing, and changes by actions.

Bodies that can touch something are in the pymunk space (`SpaceBodies`), all others in arrays (`Particles`); both follow
the same scheme. A body joins the space when something that it can touch appears, and stays there.
"""

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sandbox.action import ActionError
from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.actions import derive_contacts, has_same_bodies
from sandbox.engines.common.lifetimes import NO_BODIES
from sandbox.engines.common.zones import ZoneTracker
from sandbox.engines.pymunk_adapter.particles import Particles
from sandbox.engines.pymunk_adapter.requirements import combination_faults
from sandbox.engines.pymunk_adapter.space import SpaceBodies
from sandbox.engines.tabletop.requirements import on_floor, unsupported_by_steppers
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.contacts import ContactMatrix, contact_matrix
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import BodySource, BodySpec, Collides, Point
from sandbox.scene.description.world import Settings

if TYPE_CHECKING:
    from sandbox.engines.tabletop.stepper import TabletopStepper


class PymunkZoneHost:
    """`ZoneHost` of the bodies in a pymunk space."""

    def __init__(self, space_bodies: SpaceBodies) -> None:
        self._space_bodies = space_bodies

    def rebuild(self, scene: Scene, bodies: Bodies) -> None:
        """Update after a change of the scene's gravity, or of the set of bodies."""
        self._gravity, self._bodies = np.asarray(scene.world.gravity), bodies

    @property
    def pending(self) -> set[int]:
        """Bodies that have entered or left a zone, or are to be checked."""
        return self._space_bodies.zone_sensors.pending

    @pending.setter
    def pending(self, pending: set[int]) -> None:
        self._space_bodies.zone_sensors.pending = pending

    def at(self, position: FloatArray) -> list[int]:
        """Return the zones that contain a position, m, in ascending order."""
        return self._space_bodies.zone_sensors.at(position)

    def inside(self, index: int) -> list[int]:
        """Return the zones that contained a body's centre at the end of the last substep, in ascending order."""
        return self._space_bodies.zone_sensors.inside(index)

    def is_sensed(self, index: int) -> bool:
        """Return whether a body is in the space and zones sense it."""
        return self._space_bodies.is_sensed(index)

    @property
    def with_own_gravity(self) -> list[int]:
        """Bodies on which a zone's gravity acts."""
        return self._space_bodies.constant_forces.with_zone_force

    def set_layer(self, index: int) -> None:
        """Apply a body's changed collision layer from now on. Its contacts on the old layer end."""
        self._space_bodies.set_layer(index, self._bodies)

    def set_position(self, index: int, position: FloatArray) -> None:
        """Set the position of a body, m."""
        self._space_bodies.set_position(index, position)

    def hold(self, index: int) -> None:
        """Hold a body in place, whatever it collides with, until `release`."""
        self._space_bodies.hold(index)

    def release(self, index: int) -> None:
        """Release a body that was held."""
        self._space_bodies.release(index)

    def set_gravity(self, index: int, gravity: Point | None) -> None:
        """Replace the world's gravity on a body by another, m/s², by a force that makes up the difference."""
        force = None if gravity is None else (np.asarray(gravity) - self._gravity) * self._bodies.mass[index]
        self._space_bodies.constant_forces.set_zone_force(index, force)


UNCORRECTED = 1e9
"""m of overlap that pymunk leaves uncorrected on a surface, where the tabletop stepper corrects it."""

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


def _solvers(setup: Setup, settings: Settings) -> "tuple[TabletopStepper | None, SpaceBodies]":
    """Return the stepper of balls on a surface, None without a surface, and the bodies in the pymunk space."""
    if not on_floor(setup):
        return None, SpaceBodies(setup, settings)
    from sandbox.engines.tabletop.contacts import SKIN  # only scenes with a surface load kernels and their compiler
    from sandbox.engines.tabletop.stepper import TabletopStepper

    return TabletopStepper(setup.scene, settings), SpaceBodies(setup, settings.replace(slop=UNCORRECTED), SKIN)


class PymunkBodies:
    """State of all bodies of a running scene as arrays in scene order, and the space and particles that advance it."""

    def __init__(self, setup: Setup, settings: Settings) -> None:
        self.setup, scene = setup, setup.scene
        self.bodies: Bodies = setup.bodies
        self.position, self.velocity = self.bodies.position.copy(), self.bodies.velocity.copy()
        self.angle, self.angular_velocity = self.bodies.angle.copy(), self.bodies.angular_velocity.copy()
        self.present: BoolArray = np.ones(len(self.bodies), dtype=np.bool_)
        self.ended = False
        self._fresh = True
        self.h, self._settings = settings.h, settings
        self._half_kick = 0.5 * settings.h if settings.half_kick else 0.0
        self.velocity[~self.bodies.fixed] += self.ahead
        self.roll = self.bodies.roll.copy()
        self.layer, self.visits = self.bodies.layer.copy(), self.bodies.visits.copy()
        self.tabletop, self.space_bodies = _solvers(setup, settings)
        self.particles = Particles(scene.world, settings.h, self.space_bodies.field)
        self._zone_host = PymunkZoneHost(self.space_bodies)
        self.zone_tracker = ZoneTracker(scene, self._zone_host) if scene.zones else None
        """state of bodies with regard to zones; None without zones"""
        self._rebuild(scene, contact_matrix(setup))
        self._set_arrays()
        self.distribute(np.arange(len(self.bodies)))
        self.capture()
        if self.zone_tracker is not None:
            sensed = filter(
                self.space_bodies.is_sensed, np.flatnonzero(self._contact_matrix.can_enter_zone).tolist()
            )  # others may lie in pockets
            self.zone_tracker.begin(sensed, entering=setup.time == 0.0)

    @property
    def scene(self) -> Scene:
        """The scene, with all changes that actions have made."""
        return self.setup.scene

    def _rebuild(self, scene: Scene, matrix: ContactMatrix, same_bodies: bool = False) -> None:
        """Update after a change of the scene or contact matrix. With `same_bodies`, only the world has changed."""
        self._contact_matrix = matrix
        if self.tabletop is not None:  # the tabletop stepper resolves collisions, not pymunk
            self.tabletop.rebuild(scene, matrix)
            zero = np.zeros_like(matrix.surfaces.restitution)
            matrix = replace(matrix, surfaces=replace(matrix.surfaces, restitution=zero, friction=zero))
        if same_bodies:
            self.space_bodies.rebuild_world(scene)
        else:
            self.space_bodies.rebuild(scene, matrix)
        if self.zone_tracker is not None:
            self._zone_host.rebuild(scene, self.bodies)
            self.zone_tracker.rebuild(matrix)

    def _set_arrays(self) -> None:
        """Pass the present arrays to the space, the zones and the tabletop stepper."""
        self.space_bodies.layer = self.layer
        if self.zone_tracker is not None:
            self.zone_tracker.rebuild_arrays(
                self.position, self.velocity, self.angular_velocity, self.layer, self.visits
            )
        if self.tabletop is not None:
            from sandbox.engines.tabletop.stepper import BallArrays

            state = BallArrays(self.position, self.velocity, self.roll, self.angular_velocity, self.angle)
            self.tabletop.rebuild_arrays(state, self.bodies, self.present)

    def capture(self) -> bool:
        """Capture balls in pockets. Return whether there were any."""
        captured = self.tabletop.capture() if self.tabletop is not None else NO_BODIES
        if len(captured):
            self.space_bodies.leave(captured)
        return len(captured) > 0

    @property
    def has_pending_zones(self) -> bool:
        """Whether a body has entered or left a zone."""
        return self.zone_tracker is not None and bool(self.space_bodies.zone_sensors.pending)

    def update_zones(self) -> None:
        """Apply the effects of zones."""
        if self.zone_tracker is not None:
            self.refresh()
            self.zone_tracker.apply_effects(self.ahead)

    @property
    def free_to_move(self) -> BoolArray:
        """(N,) whether each body is present, not fixed, and not held by a zone."""
        return self.moving if self.zone_tracker is None else self.moving & ~self.zone_tracker.held

    @property
    def ahead(self) -> FloatArray:
        """Velocity, (2,) m/s, by which velocities are ahead of time: half a kick, or 0."""
        return np.asarray(self.scene.world.gravity) * self._half_kick

    @property
    def moving(self) -> BoolArray:
        """(N,) whether each body is present and not fixed."""
        return self.present & ~self.bodies.fixed

    @property
    def can_turn(self) -> bool:
        """Whether an angle may change."""
        return self.particles.can_turn or len(self.space_bodies) > 0

    def invalidate(self) -> None:
        """Record that the space and particles have advanced beyond the arrays."""
        self._fresh = self.ended or self.tabletop is not None

    def end(self) -> None:
        """Keep the arrays as they are from now on."""
        self.refresh()
        self.ended = True

    def refresh(self) -> None:
        """Update the arrays in scene order."""
        if self._fresh:
            return
        self._fresh = True
        self.space_bodies.write(self.position, self.velocity, self.angle, self.angular_velocity)

    def break_joints(self) -> IntArray:
        """Remove joints whose load exceeded their strength in the last substep; return their indices."""
        self.refresh()
        return self.space_bodies.joints.break_overloaded(
            self.position, self.velocity, self.angle, self.angular_velocity, self.h
        )

    def distribute(self, indices: IntArray) -> None:
        """Add each of some bodies to the space or to the particles."""
        matrix, bodies = self._contact_matrix, self.bodies
        is_particle = matrix.free[indices] & ~self._driven[indices]
        state = self.position, self.velocity, self.angle, self.angular_velocity
        self.particles.rebuild_arrays(*state, bodies)
        self.particles.join(indices[is_particle & ~bodies.fixed[indices]])
        # In the space, a body that nothing can turn gets no moment, unless its rotation could keep it awake. A particle
        # keeps it, for torques of actions.
        moment = np.where(matrix.turnable | bool(self._settings.sleeping), bodies.moment, math.inf)
        in_space = indices[~is_particle]
        position, velocity, angle, spin = (array[in_space] for array in state)
        self.space_bodies.join(in_space, bodies, position, velocity, angle, spin, moment[in_space])
        self.space_bodies.link(self.setup.links)

    @property
    def _driven(self) -> BoolArray:
        """(N,) bodies that only the space can move: kinematic ones, and those with thrusts or drives.

        All bodies if they attract each other or can fall asleep, or on a surface.
        """
        space_bodies, scene = self.space_bodies, self.scene
        if space_bodies.field.between_bodies or self.tabletop is not None or self._settings.sleeping:
            return np.ones(len(self.bodies), dtype=np.bool_)
        if not (scene.thrusts or scene.drives):
            return self.bodies.kinematic
        has_thrust, is_driven = space_bodies.thrusts.acts_on, space_bodies.drives.holds
        driven = [has_thrust(k) or is_driven(name) for k, name in enumerate(self.bodies.names)]
        return self.bodies.kinematic | np.asarray(driven, np.bool_)

    def change(self, setup: Setup, spawned: tuple[BodySource, ...] | None = None) -> None:
        """Continue with a changed scene. Only air, gravity, coefficients, points of walls and solid flags may differ.

        Raises:
            ActionError: the settings or the engine do not support the change.
        """
        scene = setup.scene
        if faults := combination_faults(scene, self._settings, bool(self.bodies.kinematic.any())):
            raise ActionError(faults[0])
        bodies, matrix = self.bodies, self._contact_matrix
        same_bodies = spawned is None and has_same_bodies(scene, self.scene)
        is_checked = same_bodies and scene.world is self.scene.world
        if self.tabletop is not None and not is_checked and (reason := next(unsupported_by_steppers(setup), None)):
            raise ActionError(reason)
        if not same_bodies:
            spawned = bodies.elements[len(self.scene.elements) :] if spawned is None else spawned
            bodies = replace(bodies, elements=(*scene.elements, *spawned))
            matrix = derive_contacts(setup, bodies)
        self.refresh()
        self.velocity[self.moving] -= self.ahead
        self.setup, self.bodies = setup, bodies
        self.velocity[self.moving] += self.ahead
        if self._half_kick:
            for index in self.space_bodies.movable_indices():
                self.space_bodies.set_velocity(index, self.velocity[index])
        self.particles.world = scene.world
        self.particles.rebuild()
        self._rebuild(scene, matrix, same_bodies)
        self.space_bodies.joints.update(setup.links)
        self._set_arrays()

    def is_in_pocket(self, index: int) -> bool:
        """Return whether a body lies in a pocket."""
        return self.tabletop is not None and bool(self.tabletop.pocket[index] >= 0)

    def add(self, single: BodySpec, name: str) -> int:
        """Add a body and return its index.

        Raises:
            ActionError: the scene would have too many different surfaces, or the body is not supported on a surface.
        """
        scene = self.scene
        bodies = self.bodies.joined_by(single, name)
        if self.tabletop is not None and (reason := next(unsupported_by_steppers(self.setup, bodies), None)):
            raise ActionError(reason)
        if faults := combination_faults(scene, self._settings, bool(bodies.kinematic.any())):
            raise ActionError(f"pymunk: {faults[0]}")
        matrix = derive_contacts(self.setup, bodies)
        self.refresh()
        index = len(self.bodies)
        self.bodies = bodies
        ahead = np.zeros(2) if single.fixed else self.ahead
        self.position = np.vstack((self.position, self.bodies.position[-1:]))
        self.velocity = np.vstack((self.velocity, self.bodies.velocity[-1:] + ahead))
        self.angle = np.append(self.angle, self.bodies.angle[-1])
        self.angular_velocity = np.append(self.angular_velocity, self.bodies.angular_velocity[-1])
        self.roll = np.vstack((self.roll, self.bodies.roll[-1:]))
        self.present = np.append(self.present, True)
        self.layer = np.append(self.layer, self.bodies.layer[-1])
        self.visits = np.vstack((self.visits, self.bodies.visits[-1:]))

        self._rebuild(scene, matrix)
        self._set_arrays()
        self.space_bodies.add_missing_shapes(bodies)
        outside = [n for n in np.flatnonzero(self.present & ~matrix.free).tolist() if not self.space_bodies.holds(n)]
        self._move_to_space(np.asarray([n for n in outside if n != index and not self.is_in_pocket(n)], np.int64))
        self.distribute(np.asarray([index]))
        if self.zone_tracker is not None:
            self.zone_tracker.update_position(index)
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

    def remove_bodies(self, indices: IntArray) -> None:
        """Remove bodies. Their rows stay in the arrays, with zero velocity."""
        self.refresh()
        self.particles.leave(indices)
        self.space_bodies.leave(np.asarray([n for n in indices.tolist() if self.space_bodies.holds(n)], np.int64))
        self.present[indices] = False
        self.velocity[indices], self.angular_velocity[indices], self.roll[indices] = 0.0, 0.0, 0.0
        if self.tabletop is not None:
            self.tabletop.remove(indices)
        if self.zone_tracker is not None:
            self.zone_tracker.forget(indices)

    def motion(self, index: int) -> tuple[FloatArray, float]:
        """Return the velocity (2,), m/s, and the angular velocity, rad/s, of a body."""
        self.refresh()
        return self.velocity[index] - self.ahead, float(self.angular_velocity[index])

    def set_velocity(self, index: int, velocity: FloatArray) -> None:
        """Set the velocity of a body, m/s.

        Raises:
            ActionError: it lies in a pocket.
        """
        if self._is_in_play(index):
            self.velocity[index] = velocity
        else:
            self._release(index)
            self._owner(index).set_velocity(index, velocity + self.ahead)

    def set_spin(self, index: int, spin: float) -> None:
        """Set the angular velocity of a body, rad/s.

        Raises:
            ActionError: it lies in a pocket.
        """
        if self._is_in_play(index):
            self.angular_velocity[index] = spin
        else:
            self._owner(index).set_spin(index, spin)

    def set_roll(self, index: int, roll: tuple[float, float]) -> None:
        """Set the angular velocity of a ball on a surface about x and y, rad/s; without a surface do nothing.

        Raises:
            ActionError: it lies in a pocket.
        """
        if self._is_in_play(index):
            self.roll[index] = roll

    def _release(self, index: int) -> None:
        """Release a body that a zone holds."""
        if self.zone_tracker is not None:
            self.zone_tracker.release_body(index)

    def _is_in_play(self, index: int) -> bool:
        """Return whether a body is a ball on a surface.

        Raises:
            ActionError: it lies in a pocket.
        """
        if self.tabletop is None:
            return False
        self.tabletop.check_in_play(index, self.bodies.names[index])
        return True

    def set_constant_force(self, index: int, force: FloatArray, torque: float) -> None:
        """Apply a constant force (N) and torque (N·m) to a body from now on.

        Raises:
            ActionError: it lies in a pocket.
        """
        self._is_in_play(index)
        if force.any() or torque:
            self._release(index)
        owner = self._owner(index)
        if torque and owner is self.space_bodies and not math.isfinite(owner.moment(index)):
            owner.give_moment(index, float(self.bodies.moment[index]))
        owner.set_constant_force(index, force, torque)

    def move_body(self, index: int, position: FloatArray) -> None:
        """Set the position of a body, m."""
        self.refresh()
        self.position[index] = position
        if self.tabletop is not None and self.is_in_pocket(index):
            self.tabletop.return_to_play(index)
            self.distribute(np.asarray([index]))
            return
        self._release(index)
        owner = self._holder(index)
        if owner is not None:
            owner.set_position(index, position)
        if self.zone_tracker is not None:
            self.zone_tracker.update_position(index)

    def turn_body(self, index: int, angle: float) -> None:
        """Set the angle of a body, rad."""
        self.refresh()
        self.angle[index] = angle
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

    def drive(self, index: int, level: float) -> None:
        """Set the level of a drive, by its index in the scene."""
        self.space_bodies.drives.set(index, level)

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
