"""Air, damping, attraction, thrust, liquids, tyres and constant forces on bodies.

`AttractionField` evaluates attraction in pymunk's velocity update, after positions have moved. A force that depends on
position must act there: set on `body.force` before a step it would be that of the old positions, which is explicit
Euler and gains energy. In the velocity update the scheme is semi-implicit, whose energy does not drift.

`Thrusts` evaluates thrusts before a step, at the angle to which the step turns the body. The same direction would
result in the velocity update, but for overlap corrections; a callback from Munk2D takes ten times as long.

The air gives the acceleration `air.mean_acceleration` of one step. A force F adds φ·(F/m)·h to the velocity of a mass
m, φ being the mean fraction, and not (F/m)·h, so forces that balance each other balance at any h. Spin has no drag, and
torques act unchanged unless the body has angular damping. Where a joint turns a force into a torque, as on a lever held
by a rotary spring, the two differ by the factor φ.

Damping of the world is pymunk's own: in a step it multiplies velocities and spins by a factor before it adds forces.
That of a body, of its velocity and of its spin, is part of the air. Its gravity scale is a constant force, that of a
zone's gravity too: what it has more than the world's gravity. Where bodies can fall asleep, a gravity scale acts in the
velocity update.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from functools import cache, partial
from typing import TYPE_CHECKING, Any, Self, TypeAlias

import numpy as np
import pymunk
from pymunk._chipmunk_cffi import ffi, lib

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.forces.air import Air, mean_acceleration, mean_angular_acceleration
from sandbox.engines.forces.attraction import pull
from sandbox.engines.forces.thrust import load as thrust_load
from sandbox.engines.pymunk_adapter.reader import SpaceReader
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import Point
from sandbox.scene.description.forces import Attraction, Thrust
from sandbox.scene.geometry.shapes import geometry_of

if TYPE_CHECKING:
    from sandbox.engines.forces.liquid import Liquids
    from sandbox.engines.forces.tyre import TyreLoads, Tyres


BodyLoad: TypeAlias = tuple[float, float, float]
"""Force (x, y), N, and torque, N·m, on a body"""

NO_LOAD: BodyLoad = 0.0, 0.0, 0.0


class AttractionField:
    """Attraction by points and by bodies of a scene."""

    def __init__(self, setup: Setup) -> None:
        scene = setup.scene
        self.fractions: dict[str, complex] = {}
        """complex fraction of the accelerations that acts on each body in the coming substep, with air. The velocities
        that determine it cannot be read in the velocity update, because springs have changed them by then."""
        self.applied: dict[str, Point] | None = None
        """last acceleration, m/s², of each body in the space; recorded if it is a dict"""
        self._attracting_points = [a for a in scene.attractions if not isinstance(a.toward, str)]
        self._attracting_bodies = [a for a in scene.attractions if isinstance(a.toward, str)]

    @property
    def between_bodies(self) -> bool:
        """Whether a body attracts."""
        return bool(self._attracting_bodies)

    @property
    def attracts(self) -> bool:
        """Whether there is attraction."""
        return bool(self._attracting_points or self._attracting_bodies)

    def at(self, position: FloatArray) -> FloatArray:
        """Return the acceleration (N, 2), m/s², towards the attracting points, at positions (N, 2), m."""
        total = np.zeros_like(position)
        for attraction in self._attracting_points:
            offset = position - np.asarray(attraction.toward, dtype=np.float64)
            distance = np.sqrt((offset * offset).sum(axis=1))
            is_apart = distance * distance * distance > 0.0  # at the point, or almost, there is no direction
            distance = np.where(is_apart, distance, 1.0)
            with np.errstate(over="ignore", invalid="ignore"):  # next to the point; such a body leaves the bounds
                rate = pull(attraction.strength, attraction.softening, distance) / distance
                total -= offset * np.where(is_apart, rate, 0.0)[:, None]
        return total

    def apply_to(self, name: str, body: pymunk.Body, bodies: dict[str, pymunk.Body]) -> None:
        """Apply the field to a body from now on; `bodies`: those in the space by name, kept up to date."""

        def update_velocity(body: pymunk.Body, gravity: tuple[float, float], damping: float, dt: float) -> None:
            x, y = body.position
            ax, ay = self._attraction(name, x, y, body.mass, bodies)
            if self.applied is not None:
                self.applied[name] = ax, ay
            if self.fractions:
                reduced = complex(ax, ay) * self.fractions[name]
                ax, ay = reduced.real, reduced.imag
            pymunk.Body.update_velocity(body, (gravity[0] + ax, gravity[1] + ay), damping, dt)

        body.velocity_func = update_velocity

    def _attraction(self, name: str, x: float, y: float, mass: float, bodies: dict[str, pymunk.Body]) -> Point:
        ax, ay = 0.0, 0.0
        for attraction in self._attracting_points:
            assert not isinstance(attraction.toward, str)
            dx, dy = attraction.toward[0] - x, attraction.toward[1] - y
            rate = _rate(attraction, dx, dy)
            ax, ay = ax + rate * dx, ay + rate * dy
        for attraction in self._attracting_bodies:
            toward = str(attraction.toward)
            if toward not in bodies:
                continue
            if toward != name:
                px, py = bodies[toward].position
                rate = _rate(attraction, px - x, py - y)
                ax, ay = ax + rate * (px - x), ay + rate * (py - y)
                continue
            for other, body in bodies.items():  # reaction: the attracting body is attracted with the same force
                if other != name and body.body_type == pymunk.Body.DYNAMIC:
                    px, py = body.position
                    rate = _rate(attraction, px - x, py - y) * body.mass / mass
                    ax, ay = ax + rate * (px - x), ay + rate * (py - y)
        return ax, ay


def _rate(attraction: Attraction, dx: float, dy: float) -> float:
    """Return the acceleration for each metre of distance, 1/s²; 0 at, or almost at, the attracting point.

    It never raises: pymunk would only print an exception of a callback and continue.
    """
    distance = math.sqrt(dx * dx + dy * dy)
    if distance * distance * distance == 0.0:
        return 0.0
    return pull(attraction.strength, attraction.softening, distance) / distance


class BodyThrusts:
    """Thrusts on one body in the space."""

    def __init__(
        self,
        thrusts: list[tuple[int, Thrust, Point]],
        levels: Sequence[float],
        body: pymunk.Body,
        began: float,
        h: float,
    ) -> None:
        """Apply thrusts to a body.

        Args:
            thrusts: each with its index and its arm in the body's frame, m.
            levels: of all thrusts of the scene; they may change, see `invalidate`.
            body: the body.
            began: time of the scene at the start of the simulation, s.
            h: substep, s.
        """
        self._thrusts, self._levels, self._record, self._began, self._h = thrusts, levels, body._body, began, h
        self._is_timed = any(thrust.begin > 0.0 or thrust.end is not None for _, thrust, _ in thrusts)
        self._own_load: BodyLoad | None = None  # in the body's frame; None if it has to be computed
        self.load: BodyLoad = NO_LOAD
        """force (x, y), N, and torque, N·m, in the last substep"""

    def invalidate(self) -> None:
        """Record that a level has changed."""
        self._own_load = None

    def update(self, time: float) -> BodyLoad:
        """Return `load`, updated to that of a substep that starts at a time of the simulation, s."""
        load = self._own_load
        if load is None:
            load = self._sum(self._began + time)
            if not self._is_timed:
                self._own_load = load
        x, y, torque = load
        if x or y:  # a torque is the same in every frame
            angle = lib.cpBodyGetAngle(self._record) + lib.cpBodyGetAngularVelocity(self._record) * self._h
            if math.isfinite(angle):  # else math.cos would raise; the step is found to have diverged
                cos, sin = math.cos(angle), math.sin(angle)
                load = x * cos - y * sin, x * sin + y * cos, torque
        self.load = load
        return load

    def apply(self, time: float, constant: tuple[FloatArray, float] | None = None) -> None:
        """Set the force and torque of a substep that starts at a time, s, with constant ones on the body."""
        x, y, torque = self.update(time)
        if constant is not None:
            force, constant_torque = constant
            x, y, torque = x + force[0], y + force[1], torque + constant_torque
        if x or y or torque or constant is not None:  # pymunk resets them to 0 after each step; constant ones are set
            lib.cpBodySetForce(self._record, (x, y))
            lib.cpBodySetTorque(self._record, torque)

    def _sum(self, time: float) -> BodyLoad:
        """Return force and torque in the body's frame, at a time of the scene, s."""
        x = y = torque = 0.0
        for k, thrust, arm in self._thrusts:
            level = self._levels[k]
            if level and thrust.begin <= time and (thrust.end is None or time < thrust.end):
                fx, fy, turning = thrust_load(level, *thrust.force, *arm)
                x, y, torque = x + fx, y + fy, torque + turning
        return x, y, torque


class Thrusts:
    """Thrusts on bodies in the space."""

    def __init__(self, setup: Setup, h: float) -> None:
        """Start with the levels of a scene; h is the substep, s."""
        scene, bodies = setup.scene, setup.bodies
        self._levels = [0.0 if thrust.key else 1.0 for thrust in scene.thrusts]
        self._began, self._h = setup.time, h
        self._of_body: dict[int, list[tuple[int, Thrust, Point]]] = {}
        for k, thrust in enumerate(scene.thrusts):
            index = bodies.number_of.get(thrust.body)
            if index is None:  # it left the scene on an earlier engine
                continue
            x, y = geometry_of(bodies.elements[bodies.element[index]]).centre
            arm = thrust.point[0] - x, thrust.point[1] - y
            self._of_body.setdefault(index, []).append((k, thrust, arm))
        self._in_space: dict[int, BodyThrusts] = {}

    def acts_on(self, index: int) -> bool:
        """Return whether a body carries a thrust."""
        return index in self._of_body

    def join(self, index: int, body: pymunk.Body) -> None:
        """Apply the thrusts to a body in the space from now on."""
        self._in_space[index] = BodyThrusts(self._of_body[index], self._levels, body, self._began, self._h)

    def leave(self, index: int) -> None:
        """Stop: a body leaves the space."""
        self._in_space.pop(index, None)

    def set_level(self, index: int, level: float) -> None:
        """Set the level of a thrust, by its index in the scene."""
        self._levels[index] = level
        for each in self._in_space.values():
            each.invalidate()

    def forces(self, constant: Mapping[int, tuple[FloatArray, float]]) -> Iterator[Callable[[float], None]]:
        """Yield functions that set the force and torque of a substep on each body, given its start, s.

        Args:
            constant: other forces, N, and torques, N·m, to add, by body index.
        """
        for index, each in self._in_space.items():
            yield partial(each.apply, constant=constant[index]) if index in constant else each.apply

    def update_loads(self, time: float) -> "BodyLoads":
        """Return `loads`, updated to those of a substep that starts at a time, s."""
        return {index: each.update(time) for index, each in self._in_space.items()}

    @property
    def loads(self) -> "BodyLoads":
        """Force (x, y), N, and torque, N·m, on each body in the last substep, by body index."""
        return {index: each.load for index, each in self._in_space.items()}


@cache
def damping_factor(damping: float, h: float) -> float:
    """Return the factor by which a step of h, s, multiplies velocities: `damping ** h`, with Munk2D's own rounding."""
    space = pymunk.Space()
    space.damping = damping
    body = pymunk.Body(1.0, 1.0)
    body.velocity = 1.0, 0.0
    space.add(body)
    space.step(h)
    return body.velocity.x


def scale_gravity(body: pymunk.Body, scale: float) -> None:
    """Let gravity act on a body by a factor, in pymunk's velocity update.

    A force would keep the body awake: to set it resets the time for which a body has been idle.
    """

    def update_velocity(body: pymunk.Body, gravity: tuple[float, float], damping: float, dt: float) -> None:
        pymunk.Body.update_velocity(body, (scale * gravity[0], scale * gravity[1]), damping, dt)

    body.velocity_func = update_velocity


BodyLoads: TypeAlias = Mapping[int, BodyLoad]
"""Loads on some bodies, by their index"""


def sum_of_loads(*each: BodyLoads) -> dict[int, tuple[float, float, float]]:
    """Return the sums of loads."""
    total: dict[int, tuple[float, float, float]] = {}
    for loads in each:
        for n, (x, y, turn) in loads.items():
            own_x, own_y, own_turn = total.get(n, (0.0, 0.0, 0.0))
            total[n] = own_x + x, own_y + y, own_turn + turn
    return total


class SpaceLiquids:
    """Forces of the liquids of zones on the bodies in the space."""

    def __init__(self, liquids: "Liquids", h: float) -> None:
        self._liquids, self._h = liquids, h
        self._floating: set[int] = set()
        self.loads: dict[int, tuple[float, float, float]] = {}
        """force (x, y), N, and torque, N·m, on each body in the last substep, by its index"""

    @classmethod
    def of(cls, scene: Scene, h: float) -> Self | None:
        """Return the liquids of a scene, with substeps of h, s; None without any."""
        if not scene.liquids:
            return None
        from sandbox.engines.forces.liquid import Liquids  # compiled: only where it is needed

        return cls(Liquids(scene), h)

    def join(self, index: int) -> None:
        """Include a body."""
        self._floating.add(index)

    def leave(self, index: int) -> None:
        """Forget a body that leaves the space."""
        self._floating.discard(index)
        self.loads.pop(index, None)

    def update(
        self,
        bodies: Bodies,
        layer: IntArray,
        state: tuple[IntArray, FloatArray],
        resting: AbstractSet[int],
        gravity: Point,
        others: BodyLoads,
    ) -> None:
        """Update `loads` to those of the next substep.

        pymunk moves positions by the old velocities first: the liquids act on the poses that this leads to.

        Args:
            bodies: all N bodies.
            layer: (N,) present layer of each.
            state: indices (R,) of the bodies in the space, and (R, 6) their poses and velocities.
            resting: bodies that zones hold.
            gravity: of the world, m/s².
            others: the other loads on bodies.
        """
        (indices, values), count, h = state, len(bodies), self._h
        states, acts = np.zeros((count, 6)), np.zeros(count, np.bool_)
        states[indices], floating = values, sorted(self._floating - resting)
        acts[floating] = True
        submerged = self._liquids.submerged(bodies, layer, acts, states[:, 0:3] + h * states[:, 3:6])
        force, torque = np.zeros((count, 2)), np.zeros(count)
        for n, (x, y, turn) in others.items():
            force[n], torque[n] = (x, y), turn
        force += bodies.mass[:, None] * np.asarray(gravity)
        inertia, rates = (1.0 / bodies.mass[:, None], 1.0 / bodies.moment), (states[:, 3:5], states[:, 5])
        loads = np.column_stack(self._liquids.step_loads(submerged, rates, (force, torque), inertia, gravity, h))
        self.loads = {n: (x, y, turn) for n, (x, y, turn) in zip(floating, loads[floating].tolist(), strict=True)}


class SpaceTyres:
    """Friction of the tyres of bodies in the space.

    It is added before a step, when all other forces on the bodies are set, at the poses to which the step moves them.
    Joints, springs and contacts of the step act after it.
    """

    def __init__(self, tyres: "Tyres", levels: int, h: float) -> None:
        self._tyres, self._h = tyres, h
        self._levels: FloatArray = np.zeros((levels, 3))
        self._rows = {index: row for row, index in enumerate(tyres.bodies.tolist())}
        self._in_space: dict[int, pymunk.Body] = {}
        self.loads: TyreLoads | None = None
        """loads in the last substep, on `indices`"""

    @classmethod
    def of(cls, setup: Setup, h: float) -> Self | None:
        """Return the tyres of a scene, with substeps of h, s; None without any."""
        if not setup.scene.tyres:
            return None
        from sandbox.engines.forces.tyre import Tyres  # compiled: only where it is needed

        return cls(Tyres(setup.scene, setup.bodies), len(setup.scene.tyres), h)

    @property
    def indices(self) -> IntArray:
        """(T,) indices of the bodies that have tyres."""
        return self._tyres.bodies

    def join(self, index: int, body: pymunk.Body) -> None:
        """Include a body in the space, if it has tyres."""
        if index in self._rows:
            self._in_space[index] = body

    def leave(self, index: int) -> None:
        """Forget a body that leaves the space."""
        self._in_space.pop(index, None)

    def set_levels(self, index: int, levels: tuple[float, float, float]) -> None:
        """Set the throttle, brake and steering of a tyre, by its index in the scene."""
        self._levels[index] = levels

    def apply(self, space: pymunk.Space, resting: AbstractSet[int]) -> None:
        """Add the forces of the next substep; bodies that zones hold rest."""
        count, h, kept = len(self._rows), self._h, damping_factor(space.damping, self._h)
        pose, rate, inverse = np.zeros((count, 3)), np.zeros((count, 3)), np.zeros((count, 2))
        gravity = space.gravity
        acting = [(self._rows[n], body) for n, body in self._in_space.items() if n not in resting]
        for row, body in acting:
            record = body._body
            position, angle = lib.cpBodyGetPosition(record), lib.cpBodyGetAngle(record)
            velocity, spin = lib.cpBodyGetVelocity(record), lib.cpBodyGetAngularVelocity(record)
            force, torque = lib.cpBodyGetForce(record), lib.cpBodyGetTorque(record)
            by_mass, by_moment = 1.0 / body.mass, 1.0 / body.moment
            pose[row] = position.x + h * velocity.x, position.y + h * velocity.y, angle + h * spin
            rate[row] = (
                kept * velocity.x + h * (gravity.x + by_mass * force.x),
                kept * velocity.y + h * (gravity.y + by_mass * force.y),
                kept * spin + h * by_moment * torque,
            )
            inverse[row] = by_mass, by_moment
        self.loads = self._tyres.loads(self._levels, pose, rate, inverse, h)
        total = self.loads.drive + self.loads.friction
        for row, body in acting:
            x, y, turn = total[row].tolist()
            if x or y or turn:
                record = body._body
                force, torque = lib.cpBodyGetForce(record), lib.cpBodyGetTorque(record)
                lib.cpBodySetForce(record, (force.x + x, force.y + y))
                lib.cpBodySetTorque(record, torque + turn)


class ConstantForces:
    """Constant force (N) and torque (N·m) on each body, by body index."""

    def __init__(self) -> None:
        self._action_forces: dict[int, tuple[FloatArray, float]] = {}
        self._gravity_forces: dict[int, FloatArray] = {}
        self._total: dict[int, tuple[FloatArray, float]] = {}  # sums of both
        self._prepared: list[tuple[Any, Any, float]] | None = None  # `cpBody`, force and torque of each

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

    def set_gravity_force(self, index: int, force: FloatArray | None) -> None:
        """Set the force (2,), N, that makes up for another gravity than the world's on a body; None: no such force."""
        if force is None and index not in self._gravity_forces:
            return
        if force is None:
            del self._gravity_forces[index]
        else:
            self._gravity_forces[index] = force
        self._sum(index)

    def _sum(self, index: int) -> None:
        self._prepared = None
        action, gravity_force = self._action_forces.get(index), self._gravity_forces.get(index)
        if action is not None:
            self._total[index] = action if gravity_force is None else (action[0] + gravity_force, action[1])
        elif gravity_force is not None:
            self._total[index] = gravity_force, 0.0
        else:
            self._total.pop(index, None)

    def drop(self, index: int) -> None:
        """Remove all forces on a body."""
        for each in (self._action_forces, self._gravity_forces, self._total):
            each.pop(index, None)
        self._prepared = None

    @property
    def total(self) -> Mapping[int, tuple[FloatArray, float]]:
        """Force and torque on each body that has some, by body index."""
        return self._total

    def apply(self, body_of: Callable[[int], pymunk.Body]) -> None:
        """Set forces and torques for the next step, in a scene without air."""
        if self._prepared is None:
            self._prepared = [
                (body_of(index)._body, ffi.new("cpVect *", force.tolist())[0], torque)
                for index, (force, torque) in self._total.items()
            ]
        for record, force, torque in self._prepared:  # pymunk's setters take five times as long
            lib.cpBodySetForce(record, force)
            if torque:  # pymunk resets it to 0 after each step
                lib.cpBodySetTorque(record, torque)

    def apply_with_air(
        self,
        body_of: Callable[[int], pymunk.Body],
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
            body_of: returns a body by its index.
            loads: force (x, y), N, and torque, N·m, of thrusts, by body index.
            reader: of the space; it sets the forces on all bodies at once.
            state: body indices (R,), and position, angle, velocity, spin (R, 6).
            springs: (R, 2) N, which pymunk itself adds in that step, or None. Drag reduces their effect.
            air: its coefficients.
            gravity: m/s².
            h: substep, s.
        """
        indices, values = state
        mass = np.asarray([body_of(n).mass for n in indices.tolist()])[:, None]
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
        for index, (_, _, torque) in loads.items():
            torques[index] = torques.get(index, 0.0) + torque
        if air.damps_bodies:
            rows = [
                r for r, n in enumerate(indices.tolist()) if air.angular_damping[n] and body_of(n).moment < math.inf
            ]
            damped = indices[rows]
            moment = np.asarray([body_of(n).moment for n in damped.tolist()], np.float64)
            given = np.asarray([torques.get(n, 0.0) for n in damped.tolist()], np.float64)
            mean_turn = moment * mean_angular_acceleration(air, damped, values[rows, 5], given / moment, h)
            torques |= dict(zip(damped.tolist(), mean_turn.tolist(), strict=True))
        for index, torque in torques.items():
            body_of(index).torque = torque
