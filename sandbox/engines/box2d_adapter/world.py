"""Bodies in a Box2D world: their creation, steps and state.

The world is in Box2D's units of length; see `limits`. All that comes from or goes to it passes here, in SI units. A
body has its origin at its centre of mass. Each static collider is a static body of its own.

Box2D checks its arguments by assertions, which the binding compiles out: a value that is not finite, or a shape that
was destroyed, damages the process. So values are checked before they come here.
"""

import atexit
import gc
import math
import os
import sys
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pyb2d3 as box2d

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.box2d_adapter.chains import DEPTH_LENGTHS, chain_loops
from sandbox.engines.box2d_adapter.contacts import TouchingPairs
from sandbox.engines.box2d_adapter.limits import (
    CLAMPED_LENGTHS,
    FARTHEST_LENGTHS,
    FASTEST_LENGTHS,
    MAX_WORLDS,
    scale_for,
)
from sandbox.engines.box2d_adapter.materials import ShapeRole, roles, shape_materials
from sandbox.engines.common.body_store import BodyStore
from sandbox.engines.common.colliders import wall_segments
from sandbox.engines.common.collision_bits import bits_of_body, bits_of_static, static_categories
from sandbox.engines.common.contact_log import ContactBatch
from sandbox.scene.description.base import BACKING
from sandbox.scene.description.fixed import Plane, PlaneReach, Post, Wall
from sandbox.scene.description.world import Settings


def _discard_leak_report() -> None:
    """Send what is printed after this to nowhere.

    The binding keeps its types alive until the process ends, and reports that on standard error in dozens of lines. It
    has no setting for that.
    """
    if sys.stderr is not None:  # a program without a console has none
        sys.stderr.flush()
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)


atexit.register(_discard_leak_report)  # of these functions, the one that was registered first runs last

SHORTEST_REACH = 1024.0
"""Box2D's lengths, extent of half-planes from the middle of the scene. They are boxes, whose rounding error grows with
their size: to 6e-5 at this reach, which is a hundredth of the slop."""


Float32Array = npt.NDArray[np.float32]


class RawRows(NamedTuple):
    """Memory for the states of M moving bodies after B steps, as Box2D has them."""

    transform: Float32Array
    """(B, M, 4) position in Box2D's lengths, and cosine and sine of the angle"""
    velocity: Float32Array
    """(B, M, 2) Box2D's lengths/s"""
    spin: Float32Array
    """(B, M) rad/s"""


class StateRows(NamedTuple):
    """States of M moving bodies after B steps."""

    position: FloatArray
    """(B, M, 2) m"""
    velocity: FloatArray
    """(B, M, 2) m/s"""
    angle: FloatArray
    """(B, M) rad"""
    spin: FloatArray
    """(B, M) rad/s"""


class TooManyWorldsError(RuntimeError):
    """Box2D has no room for another world."""


class Box2DWorld:
    """A world with the bodies of a body store, by their indices."""

    def __init__(self, store: BodyStore, settings: Settings, plane_reach: PlaneReach | None) -> None:
        """Create the world.

        Raises:
            TooManyWorldsError: Box2D has no room for another world.
        """
        self._store, self.scale = store, scale_for(settings)
        self._world = self._new_world(settings)
        self._world.sleeping_enabled = settings.sleeping
        self._world.continuous_enabled = settings.continuous
        self._is_open = True
        self._first = len(store.scene.fixed)  # user data of shapes: index + number of static colliders
        self._bodies: dict[int, Any] = {}
        self._shapes: dict[int, list[tuple[ShapeRole, Any]]] = {}  # by the index of the body
        self._fixed_values: dict[int, list[tuple[float, float]]] = {}  # as `_fixed_value`, other than 0, of shapes
        self._pairs = TouchingPairs(self._first, self.scale)
        self.ground = self._world.create_static_body(position=(0.0, 0.0))
        """static body at the origin, for joints to the world"""
        self._set_reach(plane_reach)
        self._materials = shape_materials(store.contact_matrix)
        self._known_roles: dict[tuple[int, tuple[int, int], bool], list[ShapeRole]] = {}
        for k in range(self._first):
            self._add_static(k)
        for index in np.flatnonzero(store.present).tolist():
            self._create(index)
        self._collect()

    def _new_world(self, settings: Settings) -> Any:
        """Return a new world.

        Raises:
            TooManyWorldsError: Box2D has no room for another world.
        """
        arguments: dict[str, Any] = {
            "gravity": self._vector(self._store.scene.world.gravity),
            "restitution_threshold": 0.0,
            "maximum_linear_speed": CLAMPED_LENGTHS,
        }
        if settings.workers is not None and settings.workers > 1:
            arguments["thread_pool"] = box2d.ThreadPool(settings.workers)
        world = box2d.World(**arguments)
        if not world.is_valid():
            gc.collect()  # simulations that were not closed, and are no longer used
            world = box2d.World(**arguments)
        if not world.is_valid():
            raise TooManyWorldsError(f"{MAX_WORLDS} Box2D worlds exist, its limit in a process; close some simulations")
        return world

    def _vector(self, vector: Any) -> tuple[float, float]:
        """Return a vector in Box2D's lengths."""
        return float(vector[0]) * self.scale, float(vector[1]) * self.scale

    def _set_reach(self, plane_reach: PlaneReach | None) -> None:
        moving = self._store.position[~self._store.bodies.fixed]
        if plane_reach is not None:
            self._middle, self._reach = np.asarray(plane_reach[:2]), plane_reach[2]
        elif len(moving):
            low, high = moving.min(axis=0), moving.max(axis=0)
            self._middle = 0.5 * (low + high)
            self._reach = max(SHORTEST_REACH / self.scale, 2.0 * float((high - low).max()))
        else:
            self._middle, self._reach = np.zeros(2), SHORTEST_REACH / self.scale

    @property
    def plane_reach(self) -> PlaneReach | None:
        """Present extent of half-planes as (x, y, distance), m; None without any."""
        if not self._store.scene.planes:
            return None
        return float(self._middle[0]), float(self._middle[1]), self._reach

    def _shape_def(self, index: int, surface: int, role: ShapeRole, group: int = 0) -> Any:
        """Return the definition of a shape of a body or, with −1 − k, of a static collider."""
        shape_def = box2d.shape_def(density=1.0, enable_contact_events=True, update_body_mass=False)
        shape_def.material = self._material(surface, role)
        shape_def.filter = _filter(role, group)
        shape_def.user_data = index + self._first
        self._note_fixed_value(index, surface, role)
        return shape_def

    def _material(self, surface: int, role: ShapeRole) -> Any:
        """Return the material of a shape."""
        return box2d.surface_material(
            friction=float(self._materials.friction[surface, role.column]),
            restitution=float(self._materials.restitution[surface, role.column]),
            rolling_resistance=float(self._materials.rolling[surface, role.column]),
            tangent_speed=self._store.contact_matrix.surfaces.surfaces[surface].speed * self.scale,
        )

    def _fixed_value(self, surface: int, role: ShapeRole) -> tuple[float, float]:
        """Return what the binding cannot change in a shape: speed of the surface, m/s, and rolling resistance."""
        speed = self._store.contact_matrix.surfaces.surfaces[surface].speed
        return speed, float(self._materials.rolling[surface, role.column])

    def _note_fixed_value(self, index: int, surface: int, role: ShapeRole) -> None:
        """Note the fixed value of a new shape, if it is not 0."""
        value = self._fixed_value(surface, role)
        if any(value):
            self._fixed_values.setdefault(index, []).append(value)

    def _surfaces_of_parts(self, index: int) -> list[int]:
        """Return the surface of each part of a body."""
        bodies, surfaces = self._store.bodies, self._store.contact_matrix.surfaces
        if bodies.round.all():
            return [int(surfaces.of_body[index])]
        first, last = np.searchsorted(bodies.shapes.body, (index, index + 1)).tolist()
        return [int(surface) for surface in surfaces.of_shape[first:last]]

    def _parts_of(self, index: int) -> list[tuple[int, ShapeRole]]:
        """Return surface and role of each shape that a body or, with −1 − k, a static collider should have."""
        shapes = self._shapes[index]
        if index < 0:
            surface = int(self._store.contact_matrix.surfaces.of_fixed[-1 - index])
            return [(surface, self._role_of_static(-1 - index, surface))] * len(shapes)
        if not self._has_contacts(index) and (self._materials.is_split or not shapes):
            return []
        return [(part, role) for part in self._surfaces_of_parts(index) for role in self._roles(index, part)]

    def _with_new_value(self) -> set[int]:
        """Return the bodies and static colliders whose surfaces have another fixed value than their shapes."""
        speeds = [surface.speed for surface in self._store.contact_matrix.surfaces.surfaces]
        if not (self._fixed_values or any(speeds) or self._materials.rolling.any()):
            return set()
        found = set()
        for index in self._shapes:
            wanted = [value for part in self._parts_of(index) if any(value := self._fixed_value(*part))]
            if self._shapes[index] and wanted != self._fixed_values.get(index, []):
                found.add(index)
        return found

    def add(self, index: int) -> None:
        """Add a body in its present state."""
        self._create(index)
        self._collect()

    def _create(self, index: int) -> None:
        store, bodies = self._store, self._store.bodies
        fixed, kinematic = bool(bodies.fixed[index]), bool(store.kinematic[index])
        create = self._world.create_static_body if fixed else self._world.create_dynamic_body
        if kinematic:
            create = self._world.create_kinematic_body
        body = create(position=self._vector(store.position[index]), rotation=box2d.make_rot(float(store.angle[index])))
        self._bodies[index] = body
        self._shapes[index] = []
        if self._has_contacts(index):
            for surface, geometry in zip(self._surfaces_of_parts(index), self._geometries(index), strict=True):
                for role in self._roles(index, surface):
                    definition = self._shape_def(index, surface, role, int(bodies.group[index]))
                    self._shapes[index].append((role, body.create_shape(definition, geometry)))
        if not fixed:
            body.apply_mass_from_shapes()  # finds the extents that decide about continuous collision
            self.set_motion(index)
        if not (fixed or kinematic):
            self.set_mass(index)
            body.gravity_scale = float(bodies.gravity_scale[index])

    def _has_contacts(self, index: int) -> bool:
        """Return whether a body can touch something, or is fixed, so that others may touch it."""
        return bool(self._store.contact_matrix.touches[index] or self._store.bodies.fixed[index])

    def _roles(self, index: int, surface: int) -> list[ShapeRole]:
        """Return the role of each shape that a body has for a part with a surface."""
        store = self._store
        bits = bits_of_body(store.scene, store.bodies, index, int(store.layer[index]))
        key = surface, bits, bool(store.bodies.fixed[index])
        if key not in self._known_roles:
            static = None if store.bodies.fixed[index] else static_categories(store.scene)
            self._known_roles[key] = list(roles(self._materials, store.contact_matrix, surface, bits, static))
        return self._known_roles[key]

    def _role_of_static(self, k: int, surface: int) -> ShapeRole:
        """Return the role of the shapes of the k-th static collider."""
        bits = bits_of_static(self._store.scene, self._store.scene.fixed[k])
        return next(roles(self._materials, self._store.contact_matrix, surface, bits, None))

    def set_mass(self, index: int) -> None:
        """Set mass and moment of inertia of a body.

        A body that nothing can turn gets the moment 0, so that it keeps its spin; one that a zone holds the mass 0,
        which Box2D does not move.
        """
        data, inverse_moment = box2d.MassData(), float(self._store.inverse_moment[index])
        data.mass = 0.0 if self._store.held_by_zone[index] else float(self._store.bodies.mass[index])
        data.rotational_inertia = self.scale**2 / inverse_moment if inverse_moment else 0.0
        self._bodies[index].mass_data = data

    def set_motion(self, index: int) -> None:
        """Set the velocities of a body to those in the store."""
        body = self._bodies[index]
        body.linear_velocity = self._vector(self._store.velocity[index])
        body.angular_velocity = float(self._store.angular_velocity[index])

    def set_velocity(self, index: int, velocity: tuple[float, float], spin: float) -> None:
        """Set the velocities of a body, m/s and rad/s, in the world only."""
        body = self._bodies[index]
        body.linear_velocity = self._vector(velocity)
        body.angular_velocity = spin

    def set_pose(self, index: int) -> None:
        """Set position and angle of a body to those in the store."""
        position = self._vector(self._store.position[index])
        self._bodies[index].set_transform(position, box2d.make_rot(float(self._store.angle[index])))

    def _geometries(self, index: int) -> Iterator[Any]:
        """Yield the geometry of each part of a body."""
        bodies, scale = self._store.bodies, self.scale
        if bodies.round.all():
            yield box2d.circle(radius=float(bodies.radius[index]) * scale, center=(0.0, 0.0))
            return
        shapes = bodies.shapes
        first, last = np.searchsorted(shapes.body, (index, index + 1)).tolist()
        for piece in range(first, last):
            corners = shapes.corner[shapes.first[piece] : shapes.first[piece + 1]] * scale
            radius = float(shapes.radius[piece]) * scale
            yield _geometry(corners, radius)

    def _add_static(self, k: int) -> None:
        """Add the k-th static collider, if it is solid."""
        scene, index = self._store.scene, -1 - k
        collider = scene.fixed[k]
        self._bodies[index] = body = self._world.create_static_body(position=self._origin_of(collider))
        self._shapes[index] = []
        if isinstance(collider, Plane) or collider.solid:
            surface = int(self._store.contact_matrix.surfaces.of_fixed[k])
            role = self._role_of_static(k, surface)
            depth = DEPTH_LENGTHS / self.scale
            loops = chain_loops(scene, self._store.bodies, self._store.position, k, depth)
            if loops is not None:
                self._add_loops(index, loops, surface, role)
                return
            for geometry in self._static_geometries(collider):
                shape = body.create_shape(self._shape_def(index, surface, role), geometry)
                self._shapes[index].append((role, shape))

    def _add_loops(self, index: int, loops: list[FloatArray], surface: int, role: ShapeRole) -> None:
        for points in loops:
            definition = box2d.chain_def(points * self.scale, material=self._material(surface, role), is_loop=True)
            definition.filter = _filter(role)
            for shape in self._bodies[index].create_chain(definition).get_segments():
                shape.user_data = index + self._first
                self._shapes[index].append((role, shape))
                self._note_fixed_value(index, surface, role)

    def _origin_of(self, collider: Plane | Wall | Post) -> tuple[float, float]:
        """Return the position of the body of a static collider; of a plane, the point nearest to the middle."""
        if not isinstance(collider, Plane):
            return (0.0, 0.0)
        normal = np.asarray(collider.normal) / math.hypot(*collider.normal)
        return self._vector(self._middle - normal * float((self._middle - np.asarray(collider.point)) @ normal))

    def _static_geometries(self, collider: Plane | Wall | Post) -> Iterator[Any]:
        if isinstance(collider, Plane):
            x, y = np.asarray(collider.normal) / math.hypot(*collider.normal)
            half, depth = 2.0 * self._reach * self.scale, max(BACKING, self._reach) * self.scale
            ends = [(y * half, -x * half), (-y * half, x * half)]
            corners = [*ends, *((a - x * depth, b - y * depth) for a, b in reversed(ends))]
            yield _geometry(np.asarray(corners), 0.0)
        elif isinstance(collider, Wall):
            for part in wall_segments(collider):
                ends = [self._vector(part.a), self._vector(part.b)]
                yield _geometry(np.asarray(ends), 0.5 * collider.thickness * self.scale)
        else:
            yield box2d.circle(radius=collider.radius * self.scale, center=self._vector(collider.position))

    def extend_planes(self) -> None:
        """Extend half-planes that bodies are about to leave. They have twice the reach, so that this is in time."""
        planes = self._store.scene.planes
        if not planes or not len(self.indices):
            return
        distance = np.abs(self._store.position[self.indices] - self._middle).max()
        if not distance > self._reach or self._reach >= FARTHEST_LENGTHS / self.scale:
            return
        while self._reach < distance:
            self._reach *= 2.0
        for k, _ in enumerate(planes):  # planes come first
            self._replace_static(k)

    def update_static(self, changed: list[int]) -> None:
        """Replace static colliders, by their numbers k, whose points or solidity have changed."""
        for k in changed:
            self._replace_static(k)

    def _replace_static(self, k: int) -> None:
        self._remove_body(-1 - k)
        self._add_static(k)

    def update_surfaces(self) -> set[int]:
        """Set the values of all shapes anew after a change of coefficients, bodies or the possible contacts.

        Return the indices of bodies that had to be replaced, which end their joints.
        """
        replaced: set[int] = set()
        store, materials = self._store, shape_materials(self._store.contact_matrix)
        self._materials, self._known_roles = materials, {}
        with_new_value = self._with_new_value()
        for index, shapes in list(self._shapes.items()):
            parts = self._parts_of(index)
            if index not in with_new_value and [role for _, role in parts] == [role for role, _ in shapes]:
                for (surface, role), (_, shape) in zip(parts, shapes, strict=True):
                    shape.friction = float(materials.friction[surface, role.column])
                    shape.restitution = float(materials.restitution[surface, role.column])
                if index >= 0 and not (store.bodies.fixed[index] or store.kinematic[index]):
                    self.set_mass(index)
            elif index < 0:
                self._replace_static(-1 - index)
            else:
                self._replace(index)
                replaced.add(index)
        self._collect()
        return replaced

    def replace(self, index: int) -> None:
        """Replace a body after a change of its layer; its contacts and joints end."""
        self._replace(index)
        self._collect()

    def _replace(self, index: int) -> None:
        """Replace a body by one with other shapes, in the same state.

        The binding can neither remove shapes nor change the speed and rolling resistance of their surface.
        """
        replaced = self._bodies[index]
        linear, angular = replaced.linear_damping, replaced.angular_damping
        self._remove_body(index)
        self._create(index)
        self._bodies[index].linear_damping, self._bodies[index].angular_damping = linear, angular

    def set_gravity(self, gravity: tuple[float, float]) -> None:
        """Set the gravity, m/s²."""
        self._world.gravity = self._vector(gravity)

    def set_damping(self, linear: float, angular: float) -> None:
        """Set the damping rates of the velocities and spins of all bodies that forces move, 1/s, besides their own."""
        bodies = self._store.bodies
        for index in self.indices[~self._store.kinematic[self.indices]].tolist():
            self._bodies[index].linear_damping = linear + float(bodies.linear_damping[index])
            self._bodies[index].angular_damping = angular + float(bodies.angular_damping[index])

    def remove(self, indices: list[int]) -> None:
        """Remove bodies; their contacts end."""
        for index in indices:
            self._destroy(index)
        self._pairs.remove(set(indices))
        self._collect()

    def _remove_body(self, index: int) -> None:
        """Remove a body or static collider with its contacts. Its end events have no shapes and are ignored."""
        self._destroy(index)
        self._pairs.remove({index})

    def _destroy(self, index: int) -> None:
        self._bodies.pop(index).destroy()
        del self._shapes[index]
        self._fixed_values.pop(index, None)

    def _collect(self) -> None:
        """Collect the moving bodies, whose states are read at once."""
        store = self._store
        moving = [n for n in sorted(self._bodies) if n >= 0 and not store.bodies.fixed[n] and n not in store.mounts]
        self.indices: IntArray = np.asarray(moving, np.int64)
        """(M,) indices of the moving bodies without a drive"""
        self._moving = box2d.Bodies()
        for index in moving:
            self._moving.append(self._bodies[index].id)
        self._rows = RawRows(*(np.empty((0, 0), np.float32) for _ in range(3)))

    def body(self, index: int) -> Any:
        """Return Box2D's body; that of the ground for −1."""
        return self.ground if index < 0 else self._bodies[index]

    def create_joint(self, definition: Any) -> Any:
        """Create a joint."""
        if isinstance(definition, box2d.FilterJointDef):  # which pyb2d3 0.11 looks for by its former name
            return self._world.create_filter_joint(definition)
        if isinstance(definition, box2d.WeldJointDef):  # and which it calls a gear
            return self._world.create_weld_joint(definition)
        return self._world.create_joint(definition)

    def push(self, index: int, force: FloatArray, torque: float) -> None:
        """Apply a force at the centre of mass, N, and a torque, N·m, for the next step."""
        body = self._bodies[index]
        body.apply_force_to_center(self._vector(force), True)
        if torque:
            body.apply_torque(torque * self.scale**2, True)

    @property
    def count(self) -> int:
        """Number of moving bodies."""
        return len(self.indices)

    def raw_rows(self, steps: int) -> RawRows:
        """Return memory for the states of moving bodies after so many steps."""
        if len(self._rows.spin) < steps:
            shape = steps, len(self.indices)
            transforms, velocities = (np.empty((*shape, width), np.float32) for width in (4, 2))
            self._rows = RawRows(transforms, velocities, np.empty(shape, np.float32))
        return self._rows

    def step(self, dt: float, substeps: int, rows: RawRows, row: int) -> bool:
        """Advance by dt, s, and write the state of moving bodies into a row; return whether contacts have changed."""
        self._world.step(dt, substeps)
        self._moving.get_transforms(rows.transform[row])
        self._moving.get_linear_velocities(rows.velocity[row])
        self._moving.get_angular_velocities(rows.spin[row])
        events = self._world.get_contact_events()
        if not (events.begin_count or events.end_count):
            return False
        self._pairs.update(events)
        return True

    def quick_bound(self, largest_spin: float) -> tuple[float, float, float]:
        """Return squares of norms of all transforms, velocities and spins below which nothing is beyond a limit.

        Args:
            largest_spin: rad/s.
        """
        reach = min(self._reach * self.scale, FARTHEST_LENGTHS) if self._store.scene.planes else FARTHEST_LENGTHS
        distance = max(reach - float(np.abs(self._middle).max()) * self.scale, 0.0)
        return 0.99 * distance**2, 0.99 * FASTEST_LENGTHS**2, 0.99 * largest_spin**2

    def is_quickly_within(self, rows: RawRows, row: int, bound: tuple[float, float, float]) -> bool:
        """Return whether all bodies are certainly within the limits, by one norm of all their coordinates."""
        transform, velocity, spin = rows.transform[row].ravel(), rows.velocity[row].ravel(), rows.spin[row]
        return bool(  # comparisons with nan are false
            transform.dot(transform) < bound[0] and velocity.dot(velocity) < bound[1] and spin.dot(spin) < bound[2]
        )

    def read(self, rows: RawRows, steps: int, dt: float, substeps: int) -> StateRows:
        """Return the states after steps of dt, s, in SI units, and write the last into the store.

        Box2D knows angles modulo 2π only. The whole turns follow from the spins: it turns a body by atan(ω·h) in a
        substep, which is less than ω·h.
        """
        store, indices = self._store, self.indices
        transforms, spin = rows.transform[:steps].astype(np.float64), rows.spin[:steps].astype(np.float64)
        position, velocity = transforms[..., :2] / self.scale, rows.velocity[:steps] / np.float64(self.scale)
        reduced = np.arctan2(transforms[..., 3], transforms[..., 2])
        before, spin_before = store.angle[indices], store.angular_velocity[indices]
        starts, spins = np.vstack((before, reduced[:-1])), np.vstack((spin_before, spin[:-1]))
        turned = substeps * np.arctan(0.5 * dt / substeps * (spins + spin))
        turns = np.cumsum(np.rint((starts + turned - reduced) / math.tau), axis=0)
        angle = reduced + math.tau * turns
        states = StateRows(position, velocity, angle, spin)
        if len(indices):
            store.position[indices], store.velocity[indices] = position[-1], velocity[-1]
            store.angle[indices], store.angular_velocity[indices] = angle[-1], spin[-1]
        return states

    def contact_batch(self) -> ContactBatch:
        """Return the present contacts. Box2D does not report their impulses, which are nan."""
        return self._pairs.batch()

    def close(self) -> None:
        """Destroy the world; nothing of it may be used afterwards."""
        if self._is_open:
            self._is_open = False
            self._bodies.clear()
            self._shapes.clear()
            self._world.destroy()


def _filter(role: ShapeRole, group: int = 0) -> Any:
    shape_filter = box2d.Filter()
    shape_filter.category_bits, shape_filter.mask_bits = role.categories, role.mask
    shape_filter.group_index = -group  # shapes of a negative group do not collide with each other
    return shape_filter


def _geometry(corners: FloatArray, radius: float) -> Any:
    """Return a geometry by its corners (K, 2), in Box2D's lengths: a circle, segment, capsule or rounded polygon."""
    points = [(float(x), float(y)) for x, y in corners.tolist()]
    if len(points) == 1:
        return box2d.circle(radius=radius, center=points[0])
    if len(points) == 2:
        return box2d.capsule(*points, radius) if radius else box2d.segment(*points)
    hull = box2d.compute_hull(np.ascontiguousarray(corners, np.float32))
    if hull.count != len(points):
        raise ValueError("Box2D cannot represent a polygon; `missing` refuses those")
    return box2d.polygon(hull=hull, radius=radius)
