"""Bodies in a pymunk space by index: operations on single bodies, and constant forces on them."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
import pymunk
from pymunk._chipmunk_cffi import ffi, lib

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.forces.air import Air, mean_acceleration
from sandbox.engines.pymunk_adapter.reader import SpaceReader
from sandbox.scene.description.base import Point


class SpaceBody(NamedTuple):
    """A body in the space, with its shapes; a body that can touch nothing has none."""

    body: pymunk.Body
    shapes: tuple[tuple[int, pymunk.Shape], ...]
    """each shape with its index among the shapes of all bodies"""

    @property
    def moves(self) -> bool:
        """Whether it is not fixed."""
        return self.body.body_type != pymunk.Body.STATIC


class SpaceBodyTable:
    """Bodies in a space by index, and operations on single bodies."""

    def __init__(self, space: pymunk.Space) -> None:
        self._space = space
        self._members: dict[int, SpaceBody] = {}
        self._resting: dict[int, tuple[float, float]] = {}  # mass and moment of bodies held by zones
        self._state: tuple[IntArray, FloatArray] | None = None  # as last read; None after a change

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
        self._members[index].body.velocity = float(velocity[0]), float(velocity[1])
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
        self._resting[index] = body.mass, body.moment
        body.velocity, body.angular_velocity = (0.0, 0.0), 0.0
        body.body_type = pymunk.Body.KINEMATIC
        pymunk.Body.update_position(body, 0.0)  # resets the bias velocity of the overlap correction
        self._state = None

    def release(self, index: int) -> None:
        """Release a body that was held."""
        body = self._members[index].body
        body.body_type = pymunk.Body.DYNAMIC
        body.mass, body.moment = self._resting.pop(index)
        body.force, body.torque = (0.0, 0.0), 0.0  # of thrusts, set while it was held
        self._state = None


class ConstantForces:
    """Constant force (N) and torque (N·m) on each body, by body index."""

    def __init__(self) -> None:
        self._action_forces: dict[int, tuple[FloatArray, float]] = {}
        self._zone_forces: dict[int, FloatArray] = {}
        self._total: dict[int, tuple[FloatArray, float]] = {}  # sums of both
        self._prepared: list[tuple[Any, Any, float]] | None = None  # `cpBody`, force and torque of each

    @property
    def with_zone_force(self) -> list[int]:
        """Indices of the bodies on which a zone's gravity acts."""
        return list(self._zone_forces)

    def __iter__(self) -> Iterator[int]:
        return iter(self._total)

    def __len__(self) -> int:
        return len(self._total)

    def items(self) -> list[tuple[int, tuple[FloatArray, float]]]:
        """Return index, and force and torque, of each body that has some."""
        return list(self._total.items())

    def set_force(self, index: int, force: FloatArray, torque: float) -> None:
        """Apply a force and a torque to a body from now on."""
        if force.any() or torque:
            self._action_forces[index] = force, torque
        else:
            self._action_forces.pop(index, None)
        self._sum(index)

    def set_zone_force(self, index: int, force: FloatArray | None) -> None:
        """Apply a zone's force (2,), N, to a body from now on, in place of any other zone's; None: no zone's."""
        if force is None and index not in self._zone_forces:
            return
        if force is None:
            del self._zone_forces[index]
        else:
            self._zone_forces[index] = force
        self._sum(index)

    def _sum(self, index: int) -> None:
        self._prepared = None
        action, zone_force = self._action_forces.get(index), self._zone_forces.get(index)
        if action is not None:
            self._total[index] = action if zone_force is None else (action[0] + zone_force, action[1])
        elif zone_force is not None:
            self._total[index] = zone_force, 0.0
        else:
            self._total.pop(index, None)

    def drop(self, index: int) -> None:
        """Remove all forces on a body."""
        for each in (self._action_forces, self._zone_forces, self._total):
            each.pop(index, None)
        self._prepared = None

    @property
    def total(self) -> Mapping[int, tuple[FloatArray, float]]:
        """Force and torque on each body that has some, by body index."""
        return self._total

    def apply(self, members: Mapping[int, SpaceBody]) -> None:
        """Set forces and torques for the next step, in a scene without air."""
        if self._prepared is None:
            self._prepared = [
                (members[index].body._body, ffi.new("cpVect *", force.tolist())[0], torque)
                for index, (force, torque) in self._total.items()
            ]
        for record, force, torque in self._prepared:  # pymunk's setters take five times as long
            lib.cpBodySetForce(record, force)
            if torque:  # pymunk resets it to 0 after each step
                lib.cpBodySetTorque(record, torque)

    def apply_with_air(
        self,
        members: Mapping[int, SpaceBody],
        loads: Mapping[int, tuple[float, float, float]],
        reader: SpaceReader,
        state: tuple[IntArray, FloatArray],
        springs: FloatArray | None,
        air: Air,
        gravity: Point,
        h: float,
    ) -> None:
        """Set forces and torques for the next step of h, s, in a scene whose air acts.

        Args:
            members: bodies by index.
            loads: force (x, y), N, and torque, N·m, of thrusts, by body index.
            reader: of the space; it sets the forces on all bodies at once.
            state: body indices (R,), and position, angle, velocity, spin (R, 6).
            springs: (R, 2) N, which pymunk itself adds in that step, or None. Drag reduces their effect.
            air: its coefficients.
            gravity: m/s².
            h: substep, s.
        """
        indices, values = state
        mass = np.asarray([members[n].body.mass for n in indices.tolist()])[:, None]
        mass[np.isinf(mass)] = 0.0  # of bodies moved by a drive or held by a zone: no force affects them
        applied = np.zeros((len(indices), 2))
        for row, index in enumerate(indices.tolist()):
            if mass[row] and (index in self._total or index in loads):
                constant = self._total[index][0] if index in self._total else 0.0
                thrust = loads[index][0:2] if index in loads else 0.0
                applied[row] = np.add(constant, thrust) * (1.0 / mass[row])
        if springs is not None:
            spring_acceleration = np.divide(springs, mass, out=np.zeros_like(springs), where=mass > 0.0)
            applied += spring_acceleration
        mean = mean_acceleration(air, indices, gravity, values[:, 3:5], values[:, 5], applied, h)
        reader.set_forces(mass * (mean if springs is None else mean - spring_acceleration))
        torques = {index: torque for index, (_, torque) in self._total.items()}
        for index, load in loads.items():
            torques[index] = torques.get(index, 0.0) + load[2]
        for index, torque in torques.items():
            members[index].body.torque = torque
