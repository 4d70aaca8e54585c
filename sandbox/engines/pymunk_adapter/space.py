"""Bodies in the pymunk space: their creation, steps and state."""

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
import pymunk
from pymunk._chipmunk_cffi import lib

from sandbox.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from sandbox.engines.common.base import BEYOND, FARTHEST
from sandbox.engines.common.collision_bits import bits_of_body
from sandbox.engines.common.contact_log import NO_CONTACTS, ContactBatch, ContactLog
from sandbox.engines.forces.air import Air, mean_fraction, rates
from sandbox.engines.pymunk_adapter.batch_reader import FEW_BODIES, Batch, BatchReader, StateCheck, state_check
from sandbox.engines.pymunk_adapter.colliders import (
    StaticShapes,
    SurfaceSetter,
    body_shapes,
    gravity_of,
    jointed_surfaces,
    new_space,
    shape_filter,
    shuffled,
    skip_numbers,
)
from sandbox.engines.pymunk_adapter.contact_names import numbers_to_skip
from sandbox.engines.pymunk_adapter.contacts import ContactLists, ContactReader
from sandbox.engines.pymunk_adapter.drives import SpaceDrives, SpacePaths
from sandbox.engines.pymunk_adapter.forces import (
    AttractionField,
    BodyLoads,
    ConstantForces,
    SpaceLiquids,
    SpaceTyres,
    Thrusts,
    scale_gravity,
    sum_of_loads,
)
from sandbox.engines.pymunk_adapter.joints import SpaceJoints, spring_forces
from sandbox.engines.pymunk_adapter.reader import SpaceReader
from sandbox.engines.pymunk_adapter.rolling import SpaceRolling
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.contacts import ContactMatrix
from sandbox.scene.compile.joint_arrays import WORLD, JointArrays
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.fixed import PlaneReach
from sandbox.scene.description.world import Settings


class SpaceBody(NamedTuple):
    """A body in the space, with its shapes; a body that can touch nothing has none."""

    body: pymunk.Body
    shapes: tuple[tuple[int, pymunk.Shape], ...]
    """each shape with its index among the shapes of all bodies"""

    @property
    def moves(self) -> bool:
        """Whether it is not fixed."""
        return self.body.body_type != pymunk.Body.STATIC


class SpaceBodies:
    """Bodies in a space, addressed by their indices. Static shapes are added when the first body joins."""

    def __init__(self, setup: Setup, settings: Settings) -> None:
        """Create an empty space; the settings are resolved."""
        scene = setup.scene
        self._setup, self._scene, self._settings = setup, scene, settings
        self._h = settings.h
        self.air = Air.of(scene.world, setup.bodies)
        """forces that depend on velocity"""
        self._air_acts = self.air.acts_by_force
        self._space = new_space(scene, settings)
        self._members: dict[int, SpaceBody] = {}
        self._resting: dict[int, tuple[float, float]] = {}  # mass and moment of bodies held by zones
        self._state: tuple[IntArray, FloatArray] | None = None  # as last read; None after a change
        self._reader = SpaceReader(self._space, bool(settings.sleeping))
        self._batch_reader = BatchReader(self._space, settings, self._reader.order_of if settings.sleeping else None)
        self._surface_setter = SurfaceSetter(self._space, settings.h)
        self._static_shapes = StaticShapes(self._space, self._surface_setter)
        self._surface_of: IntArray = np.empty(0, np.int64)
        self._moments: FloatArray = np.empty(0)
        self._can_touch: BoolArray = np.empty(0, np.bool_)
        self.layer: IntArray = setup.bodies.layer
        """(N,) collision layer of each body"""
        self.joints = SpaceJoints(self._space)
        self._polygons, self._skipped_numbers = False, 0
        self._by_name: dict[str, pymunk.Body] = {}
        self._name_of: dict[int, str] = {}
        self.contact_reader = ContactReader(self._space, self._reader, self._surface_setter.pair_callbacks)
        """reads the contacts of the space"""
        self.field, self.thrusts = AttractionField(setup), Thrusts(setup, settings.h)
        self.liquids = SpaceLiquids.of(scene, settings.h)
        """liquids of zones; None without any"""
        self.tyres = SpaceTyres.of(setup, settings.h)
        """tyres of bodies; None without any"""
        self._bodies = setup.bodies
        self.drives = SpaceDrives(setup, self._space, settings.h)
        self.drives.set_gravity(scene.world.gravity, gravity_of(scene.world, self.air))
        self._paths = SpacePaths(setup.time, settings.h)
        self._one_way: set[int] = set()  # indices of one-way bodies
        self._continues = setup.time > 0.0  # until the first bodies have joined
        self._surface_of_fixed: IntArray = np.empty(0, np.int64)
        self.constant_forces = ConstantForces()
        self.rolling = SpaceRolling(self._space, settings.h)
        """rolling resistance of balls"""
        self.limits: dict[int, tuple[float, float]] = {}
        """largest speed, m/s, and angular speed, rad/s, of each body in the space that has a limit, by its index"""
        self.limit_changes: list[tuple[int, float, float, float]] = []
        """bodies whose speed was reduced in the last substep, and the changes of velocity, m/s, and spin, rad/s"""
        self._moving = 0
        self._needs_check: StateCheck | None = None

    def __len__(self) -> int:
        return self._moving

    def join(
        self,
        indices: IntArray,
        bodies: Bodies,
        position: FloatArray,
        velocity: FloatArray,
        angle: FloatArray,
        angular_velocity: FloatArray,
        moment: FloatArray,
    ) -> None:
        """Add bodies: their (M,) indices and present state."""
        if not len(indices):
            return
        to_skip = numbers_to_skip(bodies)
        if to_skip > self._skipped_numbers:
            skip_numbers(self._space, to_skip - self._skipped_numbers)
            self._skipped_numbers = to_skip
        self._static_shapes.create(self._scene, self._setup.plane_reach, bodies, self._surface_of_fixed)
        self._bodies, self._moments = bodies, bodies.moment
        self._polygons = self._polygons or not bodies.round.all()
        order = np.asarray(shuffled(len(indices)))
        states = np.column_stack((position, angle, velocity, angular_velocity, bodies.mass[indices], moment))
        for index, state in zip(indices[order].tolist(), states[order].tolist(), strict=True):
            self._add(index, bodies, state)
        self._register()
        self.drives.add_callbacks(self._collision_types)
        if self._continues and self._surface_setter.one_way_walls.any_left:
            walls = {index: each for each, index in self._one_way_ids.items()}
            pairs = [(n, walls[wall]) for n, wall in self._setup.passing if n in self._members]
            self._surface_setter.one_way_walls.resume([(self._members[n].body.id, wall) for n, wall in pairs])
        self._continues = False

    def _body(self, index: int) -> pymunk.Body:
        return self._members[index].body

    def holds(self, index: int) -> bool:
        """Return whether a body is in the space."""
        return index in self._members

    def movable_indices(self) -> list[int]:
        """Return the indices of the bodies that are not fixed."""
        return [index for index, member in self._members.items() if member.moves]

    def position_of(self, index: int) -> tuple[float, float]:
        """Return the position of a body, m."""
        vector = lib.cpBodyGetPosition(self._members[index].body._body)
        return vector.x, vector.y

    def moment(self, index: int) -> float:
        """Return a body's moment of inertia, kg·m²; infinite if nothing in the scene can turn it."""
        return self._resting[index][1] if index in self._resting else self._members[index].body.moment

    def give_moment(self, index: int, moment: float) -> None:
        """Set a body's moment of inertia, kg·m², so that it can turn."""
        if index in self._resting:
            self._resting[index] = self._resting[index][0], moment
        else:
            self._members[index].body.moment = moment

    def set_position(self, index: int, position: FloatArray) -> None:
        """Set the position of a body, m.

        The next step updates the tree of shapes that are not static. To do it here would change the order of contacts,
        compared with a game that sets `body.position`.
        """
        body = self._members[index].body
        body.position = float(position[0]), float(position[1])
        self._update_pose(body)

    def set_angle(self, index: int, angle: float) -> None:
        """Set the angle of a body, rad; see `set_position`."""
        body = self._members[index].body
        body.angle = angle
        self._update_pose(body)

    def _update_pose(self, body: pymunk.Body) -> None:
        """Update the tree of static shapes and the state after a body was placed."""
        if body.body_type == pymunk.Body.STATIC:
            self._space.reindex_shapes_for_body(body)
        self._state = None

    def set_velocity(self, index: int, velocity: FloatArray) -> None:
        """Set the velocity of a body, m/s."""
        lib.cpBodySetVelocity(self._members[index].body._body, (velocity[0], velocity[1]))
        self._state = None

    def set_spin(self, index: int, spin: float) -> None:
        """Set the angular velocity of a body, rad/s."""
        self._members[index].body.angular_velocity = spin
        self._state = None

    def hold(self, index: int) -> None:
        """Hold a body in place, whatever it collides with, until `release`."""
        if index in self._resting:  # it is kinematic already and has no mass in pymunk
            return
        body = self._members[index].body
        self.rolling.leave(body)
        self._resting[index] = body.mass, body.moment
        body.velocity, body.angular_velocity = (0.0, 0.0), 0.0
        body.body_type = pymunk.Body.KINEMATIC
        pymunk.Body.update_position(body, 0.0)  # resets the bias velocity of the overlap correction
        self._state = None

    def release(self, index: int) -> None:
        """Release a body that was held."""
        body = self._members[index].body
        self.rolling.leave(body)
        body.body_type = pymunk.Body.DYNAMIC
        body.mass, body.moment = self._resting.pop(index)
        body.force, body.torque = (0.0, 0.0), 0.0  # of thrusts, set while it was held
        self._state = None

    def passing(self) -> IntArray | None:
        """Return the pairs (P, 2) of a body and the one-way wall, −1 − k, or body that it passes; None without any."""
        ids = self._surface_setter.one_way_walls.passing()
        if not ids:
            return None
        indices = {member.body.id: n for n, member in self._members.items()}
        walls = self._one_way_ids
        pairs = sorted((indices[body], walls[wall]) for body, wall in ids if body in indices)
        return np.asarray(pairs, np.int64) if pairs else None

    @property
    def _one_way_ids(self) -> dict[int, int]:
        """Index of each one-way body, or −1 − k of each static body, by its id."""
        one_way = {self._members[index].body.id: index for index in self._one_way}
        return self._static_shapes.ids | one_way

    def _collision_types(self, index: int) -> set[int]:
        """Return the collision types of a body's shapes."""
        return {shape.collision_type for _, shape in self._members[index].shapes}

    def _add(self, index: int, bodies: Bodies, state: list[float]) -> None:
        """Add a body with its state: x, y, angle, vx, vy, ω, mass, moment."""
        x, y, angle, vx, vy, spin, mass, moment = state
        fixed, kinematic, name = bool(bodies.fixed[index]), bool(bodies.kinematic[index]), bodies.names[index]
        driven = self.drives.holds(name)
        if driven:
            body = self.drives.body(name, index, bodies, state)
            self._moving += 1
        else:
            kind = pymunk.Body.KINEMATIC if kinematic else pymunk.Body.STATIC if fixed else pymunk.Body.DYNAMIC
            body = pymunk.Body(mass, moment, body_type=kind)
            body.position = x, y
            if angle:
                body.angle = angle
            if not fixed:
                body.velocity = vx, vy
                if spin:
                    body.angular_velocity = spin
                self._moving += 1
        self._space.add(body)
        self._members[index] = SpaceBody(body, ())
        # Each shape gets a number, which the order of contacts depends on: a body without any in a game has none here.
        if self._can_touch[index] or (fixed and bodies.elements[bodies.element[index]].collides != "none"):
            self._add_shapes(index, bodies)
        self._by_name[name], self._name_of[index] = body, name
        if bodies.round[index]:
            self.rolling.join(body, float(bodies.radius[index]))
        if driven:
            self.drives.join(name, index, body, state)
        elif index in bodies.paths:
            self._paths.join(index, bodies.paths[index], body)
        elif not (fixed or kinematic):
            if self.liquids is not None:
                self.liquids.join(index)
            if self.field.attracts:
                self.field.apply_to(name, body, self._by_name)
            if self.thrusts.acts_on(index):
                self.thrusts.join(index, body)
            if self.tyres is not None:
                self.tyres.join(index, body)
            if self._settings.sleeping and bodies.gravity_scale[index] != 1.0:
                scale_gravity(body, float(bodies.gravity_scale[index]))
            if bodies.limited[index]:
                self.limits[index] = float(bodies.max_speed[index]), float(bodies.max_angular_velocity[index])

    def _add_shapes(self, index: int, bodies: Bodies) -> None:
        """Add the shapes of a body in the space."""
        body = self._members[index].body
        shapes = tuple(body_shapes(body, bodies, index))
        shape_filter = self._filter(index, bodies)
        for piece, shape in shapes:
            shape.filter = shape_filter
            self._surface_setter.set_surface(shape, int(self._surface_of[piece]))
        self._space.add(*(shape for _, shape in shapes))
        self._members[index] = SpaceBody(body, shapes)
        if index in bodies.one_way:
            self._one_way.add(index)
            self._surface_setter.one_way_walls.platforms |= {shape: bodies.one_way[index] for _, shape in shapes}

    def _filter(self, index: int, bodies: Bodies) -> pymunk.ShapeFilter:
        bits = bits_of_body(self._scene, bodies, index, int(self.layer[index]))
        return shape_filter(*bits, int(bodies.group[index]))

    def set_layer(self, index: int, bodies: Bodies) -> None:
        """Apply a body's changed collision layer from now on. Its contacts on the old layer end."""
        shape_filter = self._filter(index, bodies)
        for _, shape in self._members[index].shapes:
            shape.filter = shape_filter

    def add_missing_shapes(self, bodies: Bodies) -> None:
        """Add shapes to bodies that so far were only joined or driven, and can now touch something."""
        for index, member in self._members.items():
            if not member.shapes and self._can_touch[index]:
                self._add_shapes(index, bodies)

    def _register(self) -> None:
        self._needs_check = None
        moving = {m.body.id: index for index, m in self._members.items() if m.moves}
        self._reader.records = {self._members[index].body._body: index for index in moving.values()}
        static = {m.body.id: index for index, m in self._members.items() if not m.moves}
        self._reader.assign(moving, static | self._static_shapes.ids)
        self._state = None

    def leave(self, indices: IntArray) -> None:
        """Remove bodies."""
        if not len(indices):
            return
        for index in indices.tolist():
            self.joints.remove(index)
            self._resting.pop(index, None)
            self.drives.leave(index)
            self._paths.leave(index)
            member = self._members.pop(index)
            self._one_way.discard(index)
            for _, shape in member.shapes:
                self._surface_setter.one_way_walls.platforms.pop(shape, None)
            self._moving -= member.moves
            self.rolling.leave(member.body)
            self._space.remove(*(shape for _, shape in member.shapes), member.body)
            del self._by_name[self._name_of.pop(index)]  # in place: the force field holds a reference
            self.constant_forces.drop(index)
            self.thrusts.leave(index)
            if self.liquids is not None:
                self.liquids.leave(index)
            if self.tyres is not None:
                self.tyres.leave(index)
            self.limits.pop(index, None)
        self._reader.invalidate_order()
        self._state = self._needs_check = None

    def add_joints(self, joints: JointArrays) -> None:
        """Add the scene's joints, once; jointed bodies are always in the space."""
        assert self._settings.bias is not None
        if self._members:
            self.joints.add(joints, self._body, self._settings.bias)

    @property
    def asleep(self) -> BoolArray | None:
        """(N,) bodies that are asleep; None if none can fall asleep."""
        if not self._settings.sleeping:
            return None
        asleep = np.zeros(len(self._can_touch), np.bool_)
        asleep[[n for n, member in self._members.items() if member.moves and member.body.is_sleeping]] = True
        return asleep

    @property
    def solved_joint_count(self) -> int:
        """Number of joints that pymunk solves."""
        return self.joints.count if self._moving else 0

    @property
    def can_repeat_pairs(self) -> bool:
        """Whether two bodies can have several contacts at once."""
        return self._static_shapes.has_several_shapes or any(
            len(member.shapes) > 1 for member in self._members.values()
        )

    def rebuild(self, scene: Scene, air: Air, matrix: ContactMatrix) -> None:
        """Update after a change of the scene's coefficients, walls, surfaces, bodies or world."""
        self._static_shapes.reshape(self._scene, scene)
        self.rebuild_world(scene, air)
        self._surface_of, self._surface_of_fixed = matrix.surfaces.of_shape, matrix.surfaces.of_fixed
        self._can_touch = matrix.touches
        self._surface_setter.rebuild(matrix, jointed_surfaces(scene, self._surface_of_fixed))
        self.rolling.rebuild(matrix)
        for index, (_, shapes) in self._members.items():
            for piece, shape in shapes:
                self._surface_setter.set_surface(shape, int(self._surface_of[piece]))
            needs_moment = matrix.turnable[index] and math.isinf(self.moment(index))
            is_dynamic = index in self._resting or self._members[index].body.body_type == pymunk.Body.DYNAMIC
            if needs_moment and is_dynamic and index not in self.drives.indices:
                self.give_moment(index, float(self._moments[index]))
        if self.drives.driven_bodies:
            self.drives.add_callbacks(self._collision_types)
        self._static_shapes.rebuild(scene, self._surface_of_fixed)

    def rebuild_world(self, scene: Scene, air: Air) -> None:
        """Update after a change of the scene's gravity or air, or of its bodies."""
        self._scene, self._needs_check = scene, None
        self.air, self._air_acts = air, air.acts_by_force
        self.field.fractions.clear()
        gravity = gravity_of(scene.world, self.air)
        if self._space.gravity != gravity:  # to set it wakes bodies
            self._space.gravity = gravity
        self._space.damping = scene.world.damping
        if self.drives.driven_bodies:
            self.drives.set_gravity(scene.world.gravity, gravity)

    def step(self, time: float) -> None:
        """Advance by one substep, from a time, s."""
        if not self._moving:
            return
        self._set_forces(time)
        if self._surface_setter.one_way_walls.any_left:
            self._surface_setter.one_way_walls.tick += 1
        if self.drives.driven_bodies:
            self.drives.before()
            self._space.step(self._h)
            self.drives.after()
        else:
            self._space.step(self._h)
        if self.rolling.is_active:
            self.rolling.update()
        if self.limits:
            self._limit_speeds()
        self._state = None

    @property
    def rolled(self) -> IntArray:
        """Indices of the bodies on which rolling resistance acted in the last substep."""
        ids = self.rolling.resisted
        return np.asarray([n for n, member in self._members.items() if member.body.id in ids], np.int64)

    def _limit_speeds(self) -> None:
        """Reduce speeds to their limits."""
        self.limit_changes.clear()
        for index, (speed, spin) in self.limits.items():
            record = self._members[index].body._body
            velocity, turning = lib.cpBodyGetVelocity(record), lib.cpBodyGetAngularVelocity(record)
            x, y = velocity.x, velocity.y
            fast, turned = math.hypot(x, y), max(min(turning, spin), -spin)
            change = speed / fast - 1.0 if fast > speed else 0.0
            if change:
                lib.cpBodySetVelocity(record, (x + change * x, y + change * y))
            if turned != turning:
                lib.cpBodySetAngularVelocity(record, turned)
            if change or turned != turning:
                self.limit_changes.append((index, change * x, change * y, turned - turning))

    def _set_forces(self, time: float) -> None:
        """Set what acts in a substep that starts at a time, s: paths, forces, thrusts, liquids, the air, and tyres."""
        if self.liquids is None and not self._air_acts:
            for set_forces in self._forces():
                set_forces(time)
            return
        if self._paths:
            self._paths.before(time)
        thrusts = self.thrusts.update_loads(time)
        if self.liquids is not None:
            self._apply_liquids(self.liquids, thrusts)
        else:
            self._apply_air(*self._read(), thrusts)
        if self.tyres is not None:
            self._apply_tyres(self.tyres)

    def _apply_tyres(self, tyres: SpaceTyres) -> None:
        """Set the forces of tyres, after all others: they oppose the motion to which these lead."""
        tyres.apply(self._space, self._resting.keys())

    def _forces(self) -> list[Callable[[float], None]]:
        """Return the functions that set forces before a substep, given its start, s; without air and liquids."""
        forces: list[Callable[[float], None]] = []
        if self._paths:
            forces.append(self._paths.before)
        if self.constant_forces:
            forces.append(lambda _: self.constant_forces.apply(self._body))
        forces += self.thrusts.forces(self.constant_forces.total)
        tyres = self.tyres
        if tyres is not None:
            forces.append(lambda _: self._apply_tyres(tyres))
        return forces

    def _apply_liquids(self, liquids: SpaceLiquids, thrusts: BodyLoads) -> None:
        """Set the forces of the next substep in a scene with liquids; `thrusts` are the loads of thrusts."""
        constant = {n: (float(x), float(y), turn) for n, ((x, y), turn) in self.constant_forces.items()}
        others = sum_of_loads(constant, thrusts)
        liquids.update(self._bodies, self.layer, self._read(), self._resting.keys(), self._scene.world.gravity, others)
        loads = sum_of_loads(thrusts, liquids.loads)
        if self._air_acts:
            self._apply_air(*self._read(), loads)
            return
        for n, (x, y, turn) in sum_of_loads(loads, constant).items():
            record = self._members[n].body._body
            lib.cpBodySetForce(record, (x, y))
            lib.cpBodySetTorque(record, turn)

    @property
    def can_batch(self) -> bool:
        """Whether nothing has to be done between two substeps, so that `step_batch` can make many."""
        return not (
            not self._moving
            or self._air_acts
            or self.field.attracts
            or self.drives.driven_bodies
            or self._scene.zones
            or self._surface_setter.one_way_walls.any_left
            or self.joints.has_breakable
            or self.limits
            or self.rolling.is_active
        )

    def batch_steps(self, lists_substeps: bool) -> int:
        """Return the largest number of steps of `step_batch`."""
        rows = self._batch_reader.max_rows(self._reader.body_count)
        return max(rows // self._settings.substeps, 1) if lists_substeps else rows

    def step_batch(
        self,
        first: int,
        steps: int,
        *,
        lists_substeps: bool,
        lists_contacts: bool,
        until_contact: bool,
    ) -> Batch:
        """Make at most so many steps, until one whose state has to be checked.

        Args:
            first: number of steps made before.
            steps: largest number of steps, at most `batch_steps`.
            lists_substeps: whether states are listed after every substep, not only after every step.
            lists_contacts: whether contacts are listed, after every substep.
            until_contact: whether the batch ends after the first step with contacts.
        """
        self._state = None
        batch = self._batch_reader.step(
            first,
            steps,
            self._reader.body_count,
            self._reader.moving_rows,
            lists_substeps=lists_substeps,
            polygons=self._polygons,
            until_contact=until_contact,
            warm_starts=self.contact_reader.warm_starts if lists_contacts else None,
            forces=self._forces(),
            needs_check=self._state_check(),
        )
        # The states are valid until the next batch, like those that the reader returns.
        self._state = self._reader.moving_indices, batch.states[-1]
        return batch

    @property
    def needs_check(self) -> bool:
        """Whether the state after a step has to be checked: a body may have diverged or left `world.bounds`."""
        if not self._moving:
            return False
        self._read()
        return self._moving > FEW_BODIES or self._state_check()(self._reader.numbers)

    def _state_check(self) -> StateCheck:
        """Return the check of states after each step of a batch; it is kept until bodies or bounds change."""
        if self._needs_check is None:
            reader, static = self._reader, self._static_shapes
            self._needs_check = state_check(
                reader.body_count, reader.moving_rows, static.within, static.quick_bound, self._scene.world.bounds
            )
        return self._needs_check

    def write_states(
        self,
        states: FloatArray,
        rows: slice,
        position: FloatArray,
        velocity: FloatArray,
        angle: FloatArray,
        angular_velocity: FloatArray,
    ) -> None:
        """Write states (S, R, 6) of a batch into S rows of arrays of frames, in scene order."""
        slots = self._reader.slots
        position[rows, slots], velocity[rows, slots] = states[..., 0:2], states[..., 3:5]
        angle[rows, slots], angular_velocity[rows, slots] = states[..., 2], states[..., 5]

    def write_positions(self, states: FloatArray, position: FloatArray) -> None:
        """Write positions of states (S, R, 6) of a batch into an array (S, N, 2) in scene order."""
        position[:, self._reader.slots] = states[..., 0:2]

    def read_batch(self, lists: ContactLists, log: ContactLog, times: FloatArray) -> Iterator[tuple[int, int]]:
        """Enter the contacts of a batch into a log, as `ContactReader.read_batch`."""
        return self.contact_reader.read_batch(lists, log, times, self._polygons)

    def _apply_air(self, indices: IntArray, state: FloatArray, loads: BodyLoads) -> None:
        """Set the forces of the next substep on bodies (R,) of a state (R, 6), in a scene whose air acts.

        Args:
            indices: (R,) the bodies.
            state: (R, 6).
            loads: force (x, y), N, and torque, N·m, of thrusts and liquids, by body index.
        """
        springs = self._springs(indices, state)
        self.constant_forces.apply_with_air(
            self._body, loads, self._reader, (indices, state), springs, self.air, self._scene.world.gravity, self._h
        )
        if self.field.attracts:
            fractions = mean_fraction(rates(self.air, indices, state[:, 3:5], state[:, 5]), self._h).tolist()
            self.field.fractions = {self._name_of[n]: each for n, each in zip(indices.tolist(), fractions, strict=True)}

    def _springs(self, indices: IntArray, state: FloatArray) -> FloatArray | None:
        """Return the forces, N, of springs on bodies (R,) of a state (R, 6) in the next substep; None without springs.

        pymunk evaluates springs after positions have moved by the old velocities.
        """
        joints = self.joints.by_kind.springs
        if not len(joints):
            return None
        position, angle = np.zeros((len(self._can_touch), 2)), np.zeros(len(self._can_touch))
        position[indices] = state[:, 0:2] + state[:, 3:5] * self._h
        angle[indices] = state[:, 2] + state[:, 5] * self._h
        for index in np.setdiff1d(np.concatenate((joints.a, joints.b)), [WORLD, *indices]).tolist():  # fixed bodies
            body = self._members[index].body
            position[index], angle[index] = body.position, body.angle
        return spring_forces(joints, position, angle)[indices]

    def _read(self) -> tuple[IntArray, FloatArray]:
        if self._state is None:
            self._state = self._reader.state()
        return self._state

    def write(
        self, position: FloatArray, velocity: FloatArray, angle: FloatArray, angular_velocity: FloatArray
    ) -> None:
        """Write the present state into arrays in scene order."""
        if not self._moving:
            return
        _, state = self._read()
        rows = self._reader.slots
        position[rows], velocity[rows] = state[:, 0:2], state[:, 3:5]
        angle[rows], angular_velocity[rows] = state[:, 2], state[:, 5]
        if self.drives.driven_bodies:
            self.drives.write(position, velocity, angle, angular_velocity)

    def touching(self, impulses_suffice: bool = False) -> ContactBatch | ComplexArray:
        """Return the present contacts, as `ContactReader.touching` does."""
        if not self._moving:
            return NO_CONTACTS
        return self.contact_reader.touching(self._polygons, impulses_suffice)

    def beyond(self) -> tuple[int, str] | None:
        """Return a body that is not finite or out of bounds, and a description; else None.

        Half-planes are extended first if a body is beyond them.
        """
        if not self._moving:
            return None
        indices, state = self._read()
        within = self._static_shapes.within(state)
        if within.all():
            return None
        self.extend_planes()
        within = self._static_shapes.within(state)
        if within.all():
            return None
        row = int(np.argmin(np.all(within, axis=1)))
        if not np.isfinite(state[row]).all() or self._static_shapes.reach > FARTHEST:
            return int(indices[row]), BEYOND
        return int(
            indices[row]
        ), f"is more than {self._static_shapes.reach:g} m out, beyond the range of pymunk's half-planes"

    @property
    def plane_reach(self) -> PlaneReach | None:
        """Present extent of half-planes; None while there are none."""
        return self._static_shapes.plane_reach

    def reaches(self, position: FloatArray) -> bool:
        """Return whether half-planes can be extended to a position."""
        return self._static_shapes.reaches(position)

    def extend_planes(self) -> None:
        """Extend half-planes to the bodies in the space."""
        if self._moving and math.isfinite(self._static_shapes.reach):
            self._static_shapes.extend(self._read()[1][:, 0:2])
            self._needs_check = None

    def set_constant_force(self, index: int, force: FloatArray, torque: float) -> None:
        """Apply a constant force (N) and torque (N·m) to a body from now on."""
        self.constant_forces.set_force(index, force, torque)
