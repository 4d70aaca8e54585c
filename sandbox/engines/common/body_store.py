"""State of all bodies of a running simulation as arrays, and their collision masks."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.actions import derive_contacts, has_same_bodies
from sandbox.engines.common.colliders import StaticColliders, static_colliders
from sandbox.engines.common.lifetimes import Lifetimes
from sandbox.engines.common.motors import rate_after_level_change
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.contacts import ContactMatrix, contact_matrix
from sandbox.scene.compile.drives import Mount, about_hinge, mounts
from sandbox.scene.compile.joint_arrays import JointArrays
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import BodySource, BodySpec, Collides
from sandbox.scene.description.forces import PlungerDrive, TorqueDrive

NOTHING, FIXED, ALL = 0, 1, 2
"""Collision masks, as in `BodyStore.collision_mask`: a body collides with nothing, with static and fixed bodies, or
with everything. They follow from `collides`; a removed body collides with nothing."""

COLLISION_MASKS: dict[Collides, int] = {"none": NOTHING, "fixed": FIXED, "all": ALL}


class BodyStore:
    """State and collision masks of all bodies of a running scene, as arrays. Engines advance the arrays in place."""

    def __init__(self, setup: Setup, h: float) -> None:
        self.setup, self.h = setup, h
        scene, bodies = setup.scene, setup.bodies
        self.static_colliders: StaticColliders = static_colliders(setup)
        self.position: FloatArray = bodies.position.copy()
        self.velocity: FloatArray = bodies.velocity.copy()
        self.angle: FloatArray = bodies.angle.copy()
        self.angular_velocity: FloatArray = bodies.angular_velocity.copy()
        self.roll: FloatArray = bodies.roll.copy()
        """(N, 2) rad/s, angular velocity about x and y, of spheres on a surface"""
        self.present: BoolArray = np.ones(len(bodies), dtype=np.bool_)
        self.force: FloatArray = np.zeros((len(bodies), 2))
        """(N, 2) N, constant forces by actions"""
        self.torque: FloatArray = np.zeros(len(bodies))
        """(N,) N·m, constant torques by actions"""
        self.throttles: FloatArray = np.asarray([0.0 if t.key else 1.0 for t in scene.thrusts], dtype=np.float64)
        """level of each thrust of the scene, 0 to 1"""
        self.tyre_levels: FloatArray = np.zeros((len(scene.tyres), 3))
        """(L, 3) throttle, brake and steering of each tyre of the scene"""
        self.layer: IntArray = bodies.layer.copy()
        """(N,) collision layer of each body, by its index in the scene's `layers`"""
        self.visits: IntArray = bodies.visits.copy()
        """(N, Z) state of each body with regard to each zone"""
        self.held_by_zone: BoolArray = np.zeros(len(bodies), dtype=np.bool_)
        """(N,) whether a zone holds the body in place"""
        self.motor_levels: dict[int, float] = {}
        """levels of motors that actions have set, by the rows of the joints"""
        self.drives: FloatArray = setup.drives.copy()
        """(D, 3) state of each drive, as in `Frame.drives`"""
        self._all_mounts: dict[str, Mount] = mounts(scene)
        self._retired: dict[int, float] = {}
        self._broken: dict[int, float] = {}
        self._lifetimes = Lifetimes(bodies, setup.time, h)
        self._has_torque: BoolArray = np.zeros(len(bodies), dtype=np.bool_)
        self._rebuild(setup, bodies, contact_matrix(setup))

    @property
    def scene(self) -> Scene:
        """The scene, with all changes that actions have made."""
        return self.setup.scene

    def _rebuild(self, setup: Setup, bodies: Bodies, matrix: ContactMatrix) -> None:
        """Use another setup, other bodies or other materials."""
        self._use(setup)
        self.bodies, self.contact_matrix = bodies, matrix
        self._derive_solver_arrays()

    def _use(self, setup: Setup) -> None:
        """Use another setup."""
        self.setup = setup
        self.all_joints: JointArrays = setup.joints.actuated(self.motor_levels) if self.motor_levels else setup.joints
        """the joints of the setup, with motors at their levels"""

    def actuate(self, levels: Mapping[int, float]) -> None:
        """Set the levels of motors, by the rows of the joints."""
        self.motor_levels |= levels
        self._use(self.setup)

    def _derive_solver_arrays(self) -> None:
        """Derive the arrays of a solver, which depend on the bodies that are present and on their materials."""
        bodies, matrix, surfaces = self.bodies, self.contact_matrix, self.contact_matrix.surfaces
        self.radius: FloatArray = bodies.radius
        self.surface: IntArray = surfaces.of_body
        self.fixed_surface: IntArray = surfaces.of_fixed
        self.restitution: FloatArray = surfaces.restitution
        self.friction: FloatArray = surfaces.friction
        self.tangential: FloatArray = np.concatenate(
            (np.stack((surfaces.friction, surfaces.slip_target), axis=-1), surfaces.slip_velocity), axis=-1
        )
        """(S, S, 4) coefficient of friction, slip target, m/s, and slip velocity, (2,) m/s, of pairs of surfaces"""
        self.falloff: FloatArray = surfaces.falloff
        masks = np.asarray([COLLISION_MASKS[element.collides] for element in bodies.elements], dtype=np.int64)
        self.collision_mask: IntArray = np.where(self.present, masks[bodies.element], NOTHING)
        """(N,) `NOTHING`, `FIXED` (planes, walls, posts, fixed bodies) or `ALL`"""
        self.kinematic: BoolArray = bodies.kinematic & self.present
        """(N,) moves along its path whatever it collides with (kinematic)"""
        is_pushable = self.moving & ~self.kinematic
        self.inverse_mass: FloatArray = np.where(is_pushable, 1.0 / bodies.mass, 0.0)
        # A body that nothing can turn gets no inverse moment: its spin stays the same, bit for bit.
        can_turn = is_pushable & (matrix.turnable | self._has_torque)
        self.inverse_moment: FloatArray = np.where(can_turn, 1.0 / bodies.moment, 0.0)
        self.mounts: dict[int, Mount] = {}
        """how drives hold the present bodies, by body index"""
        self.driven: BoolArray = self.kinematic.copy()
        """(N,) has a drive, or is kinematic"""
        self.has_driven = bool(self._all_mounts or self.driven.any())
        """whether a body can be driven"""
        if self.has_driven:
            self._rebuild_driven()

    def _rebuild_driven(self) -> None:
        """Set up bodies with a drive: their hinges, and their inverse masses as the solver sees them."""
        names, bodies = self.bodies.names, self.bodies
        indices = {names.index(name): mount for name, mount in self._all_mounts.items() if name in names}
        self.mounts = {n: mount for n, mount in sorted(indices.items()) if self.present[n]}
        self.hinge: FloatArray = np.zeros((len(bodies), 2))
        """(N, 2) m, in the body's frame, the point about which it turns: its centre unless it is on a hinge"""
        for n, mount in self.mounts.items():
            self.hinge[n], self.driven[n] = mount.hinge, True
            self.kinematic[n] = not isinstance(mount.drive, TorqueDrive)
            moment_about_hinge = about_hinge(mount, float(bodies.mass[n]), float(bodies.moment[n]))
            self.inverse_mass[n], self.inverse_moment[n] = 0.0, 0.0 if self.kinematic[n] else 1.0 / moment_about_hinge

    @property
    def joints(self) -> JointArrays:
        """The joints that are intact and whose bodies are present."""
        return self.all_joints.some(self.intact_joints())

    def intact_joints(self) -> IntArray:
        """Return the indices of the scene's joints that are intact and whose bodies are present."""
        joints, is_present = self.setup.joints, np.append(self.present, True)  # index −1, the world, is the last entry
        intact = is_present[joints.a] & is_present[joints.b]
        intact[list(self._broken)] = False
        return np.flatnonzero(intact)

    def throttle(self, index: int, level: float) -> None:
        """Set the level of a thrust, by its index in the scene: the fraction of its force that acts."""
        self.throttles[index] = level

    def steer(self, index: int, levels: tuple[float, float, float]) -> None:
        """Set the throttle, brake and steering of a tyre, by its index in the scene."""
        self.tyre_levels[index] = levels

    def drive(self, index: int, level: float) -> None:
        """Set the level of a drive, by its index in the scene."""
        before, _, rate = self.drives[index].tolist()
        if isinstance(self.scene.drives[index], PlungerDrive):
            self.drives[index, 2] = rate_after_level_change(before, level, rate)
        self.drives[index, 0] = level

    @property
    def mobile(self) -> BoolArray:
        """(N,) whether each body is present and not fixed."""
        return self.present & ~self.bodies.fixed

    @property
    def moving(self) -> BoolArray:
        """(N,) whether each body is present, not fixed, and not held by a zone."""
        return self.mobile & ~self.held_by_zone

    @property
    def gravity(self) -> FloatArray:
        """Gravity, m/s²: (2,) for all bodies, or (N, 2) for each, times its gravity scale."""
        return self._scaled(np.asarray(self.scene.world.gravity, dtype=np.float64))

    @property
    def world_gravity(self) -> FloatArray:
        """Gravity of the world, m/s²: likewise, whatever zones the bodies are in."""
        return self._scaled(np.asarray(self.scene.world.gravity, dtype=np.float64))

    def _scaled(self, gravity: FloatArray) -> FloatArray:
        """Return gravity, (2,) or (N, 2) m/s², times the gravity scale of each body if one is not 1."""
        return self.bodies.gravity_scale[:, None] * gravity if self.bodies.scales_gravity else gravity

    @property
    def retired(self) -> Mapping[int, float]:
        """Time in s, by body index, at which bodies left the scene."""
        return MappingProxyType(self._retired)

    @property
    def broken(self) -> Mapping[int, float]:
        """Time in s, by index in `setup.joints`, at which joints broke."""
        return MappingProxyType(self._broken)

    def mark_broken(self, joints: IntArray, time: float) -> None:
        """Mark joints, by their indices, as broken since a time, s."""
        self._broken |= dict.fromkeys(joints.tolist(), time)

    def motion(self, index: int) -> tuple[FloatArray, float]:
        """Return the velocity (2,), m/s, and the angular velocity, rad/s, of a body."""
        return self.velocity[index].copy(), float(self.angular_velocity[index])

    def set_velocity(self, index: int, velocity: FloatArray) -> None:
        """Set the velocity of a body, m/s."""
        self.velocity[index] = velocity

    def set_spin(self, index: int, spin: float) -> None:
        """Set the angular velocity of a body, rad/s."""
        self.angular_velocity[index] = spin

    def set_roll(self, index: int, roll: tuple[float, float]) -> None:
        """Set the angular velocity of a sphere on a surface about x and y, rad/s."""
        self.roll[index] = roll

    def set_constant_force(self, index: int, force: FloatArray, torque: float) -> None:
        """Apply a constant force (N) and torque (N·m) to a body from now on."""
        self.force[index], self.torque[index] = force, torque
        if torque and not self._has_torque[index]:
            self._has_torque[index] = True
            self._rebuild(self.setup, self.bodies, self.contact_matrix)

    def move_body(self, index: int, position: FloatArray) -> None:
        """Set the position of a body, m."""
        self.position[index] = position

    def turn_body(self, index: int, angle: float) -> None:
        """Set the angle of a body, rad."""
        self.angle[index] = angle

    def check_place(self, position: tuple[float, float], radius: float, collides: Collides) -> None:
        """Accept every position: bodies may start anywhere."""

    def change(self, setup: Setup, spawned: tuple[BodySource, ...] | None = None) -> None:
        """Continue with a changed scene. Only air, gravity, coefficients, points of walls and solid flags may differ.

        Raises:
            ActionError: the scene would have more different surfaces than allowed.
        """
        scene = setup.scene
        if spawned is None and has_same_bodies(scene, self.scene):
            self._use(setup)
            return
        spawned = self.bodies.elements[len(self.scene.elements) :] if spawned is None else spawned
        bodies = replace(self.bodies, elements=(*scene.elements, *spawned))
        matrix = derive_contacts(setup, bodies)
        if scene.fixed != self.scene.fixed:
            self.static_colliders = static_colliders(setup)
        self._rebuild(setup, bodies, matrix)

    def add(self, single: BodySpec, name: str) -> int:
        """Add a body that has been checked, and return its index.

        Raises:
            ActionError: the scene would have more different surfaces than allowed.
        """
        bodies = self.bodies.joined_by(single, name)
        matrix = derive_contacts(self.setup, bodies)
        self.position = np.vstack((self.position, bodies.position[-1:]))
        self.velocity = np.vstack((self.velocity, bodies.velocity[-1:]))
        self.roll = np.vstack((self.roll, bodies.roll[-1:]))
        self.angle = np.append(self.angle, bodies.angle[-1])
        self.angular_velocity = np.append(self.angular_velocity, bodies.angular_velocity[-1])
        self.present = np.append(self.present, True)
        self.force, self.torque = np.vstack((self.force, np.zeros((1, 2)))), np.append(self.torque, 0.0)
        self._has_torque, self.held_by_zone = np.append(self._has_torque, False), np.append(self.held_by_zone, False)
        self.layer = np.append(self.layer, bodies.layer[-1])
        self.visits = np.vstack((self.visits, bodies.visits[-1:]))
        self._rebuild(self.setup, bodies, matrix)
        return len(bodies) - 1

    def remove_bodies(self, indices: IntArray, time: float) -> None:
        """Remove bodies at a time, s. Their rows stay in the arrays, with zero velocity."""
        self.present[indices] = False
        self.velocity[indices], self.angular_velocity[indices], self.roll[indices] = 0.0, 0.0, 0.0
        self.force[indices], self.torque[indices] = 0.0, 0.0
        self.held_by_zone[indices] = False
        self._retired |= dict.fromkeys(indices.tolist(), time)
        self._rebuild(self.setup, self.bodies, self.contact_matrix)

    @property
    def has_lifetimes(self) -> bool:
        """Whether lifetimes are still to end."""
        return self._lifetimes.any_left

    @property
    def can_expire(self) -> bool:
        """Whether bodies can leave `world.bounds` or reach the end of a lifetime."""
        return self.scene.world.bounds is not None or self._lifetimes.any_left

    def expired(self, time: float) -> IntArray:
        """Return the indices of the bodies to be removed at a time, s: by their lifetime or by world.bounds, (K,)."""
        return self._lifetimes.expired(time, self.position, self.present, self.bodies.fixed, self.scene.world.bounds)

    def beyond(self) -> int | None:
        """Return the index of a body that is not finite or out of bounds; None if there is none."""
        from sandbox.engines.common.state_bounds import first_beyond  # a kernel: not every engine needs a compiler

        index = first_beyond(self.position, self.velocity, self.angle, self.angular_velocity, self.roll)
        return None if index < 0 else index


class HasBodyStore:
    """Simulation whose bodies are in a body store."""

    _store: BodyStore

    @property
    def setup(self) -> Setup:
        """State from which the simulation started, with the changes that actions have made to its scene."""
        return self._store.setup

    @property
    def bodies(self) -> Bodies:
        """Bodies at their start as arrays; spawned bodies are appended."""
        return self._store.bodies

    @property
    def retired(self) -> Mapping[int, float]:
        """Time in s, by body index, at which bodies were removed, left `world.bounds` or ended their lifetime."""
        return self._store.retired

    @property
    def broken(self) -> Mapping[int, float]:
        """Time in s, by index in `setup.joints`, at which joints broke."""
        return self._store.broken
