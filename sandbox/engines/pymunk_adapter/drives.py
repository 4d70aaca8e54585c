"""Driven bodies in the space: hinge motors, hinges at a constant rate, and plungers.

A space moves bodies by their old velocity and then changes velocities (drift–kick). So before each step a driven body
is placed at its target minus velocity · h: the step's drift brings it to the target, and contacts see its velocity.

`SpaceDrives` holds the driven bodies by the index of their drive. Before each substep of the space, levels determine
torques and displacements. After it, contacts have changed the velocities of dynamic bodies.

`SpaceHingeMotor` is a drive by torque. In a substep its torque ramps and the body moves between its stops
(`motors.py`); pymunk finds its contacts there, applies the new velocity, and solves the contacts. A one-sided limit
holds a body that is pressed against a stop; pymunk solves it together with the contacts. If all contacts press the body
against its stop too, it is immovable for that substep: alternating between contacts and limit would not converge in 10
iterations.

`SpacePaths` has the kinematic bodies with paths. Before each substep such a body gets its exact pose, and the constant
velocity that leads to the next one.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import pymunk
from pymunk._chipmunk_cffi import ffi, lib

from sandbox.arrays import FloatArray
from sandbox.engines.common.motors import (
    HingeDrive,
    advance_plunger,
    centre_about_pivot,
    gravity_torque,
    plunger_state,
    rate_after_level_change,
    stroke_direction,
    turn_at_rate,
)
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.drives import Mount, about_hinge, mounts
from sandbox.scene.compile.paths import PathMotion
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.forces import PlungerDrive, StrokeDrive, TorqueDrive

IMMOVABLE_MASS = 2.0**100
"""kg, practically immovable: the mass of a body on a hinge. A power of 2, so that its weight is balanced exactly."""


def body_about_hinge(
    mount: Mount, angle: float, position: tuple[float, float], kind: int, moment: float
) -> pymunk.Body:
    """Return a body whose centre of gravity in pymunk is its hinge, about which it turns exactly.

    Args:
        mount: how the drive holds it.
        angle: rad.
        position: position of its centre of mass, m.
        kind: pymunk's body type: dynamic or kinematic.
        moment: of inertia about the hinge, kg·m².
    """
    dynamic = kind == pymunk.Body.DYNAMIC
    body = pymunk.Body(IMMOVABLE_MASS, moment) if dynamic else pymunk.Body(body_type=kind)
    body.center_of_gravity = mount.hinge
    body.angle = angle
    body.position = position
    return body


class DrivenBodyStart(NamedTuple):
    """Initial state of a driven body."""

    body_index: int
    """index of the body"""
    mount: Mount
    body: pymunk.Body
    """in the space"""
    mass: float
    """kg"""
    position: tuple[float, float]
    """of the centre of mass, m"""
    velocity: tuple[float, float]
    """m/s"""
    angle: float
    spin: float
    """rad/s"""
    state: tuple[float, float, float]
    """of its drive: level, torque or pull, rate"""
    h: float
    """substep, s"""


class SpaceDrivenBody:
    """Driven body: its index, and the part of its state that the space does not hold."""

    def __init__(self, start: DrivenBodyStart) -> None:
        self.index, self.mount, self.body, self._h = start.body_index, start.mount, start.body, start.h
        self._record: Any = start.body._body
        self.level = start.state[0]
        self.angle, self.spin = start.angle, start.spin
        self.position, self.velocity = start.position, start.velocity
        """of the centre of mass, m and m/s"""
        drive = start.mount.drive
        self._pivot = start.mount.home if isinstance(drive, PlungerDrive) else drive.pivot

    def before(self) -> None:
        """Prepare the body for a substep."""

    def after(self) -> None:
        """Update the state after a substep."""

    def set(self, level: float) -> None:
        """Set the level from now on."""
        self.level = level

    @property
    def state(self) -> tuple[float, float, float]:
        """Level, torque or pull, and rate, as in `Frame.drives`."""
        return self.level, 0.0, 0.0

    def update_centre(self) -> None:
        """Update position and velocity of the centre of mass of a body on a hinge."""
        self.position, self.velocity = centre_about_pivot(self.mount.hinge, self._pivot, self.angle, self.spin)

    def centre_about_pivot(self, angle: float, spin: float) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return position, m, and velocity, m/s, of the centre of mass at an angle, rad, and a spin, rad/s."""
        return centre_about_pivot(self.mount.hinge, self._pivot, angle, spin)

    def _set_angle_before_step(self, angle: float, spin: float) -> None:
        """Set the angle so that the next step turns the body to `angle` with its spin."""
        lib.cpBodySetAngle(self._record, angle - spin * self._h)


UNLIMITED = 1e12
"""rad: bounds that no body reaches, of an inactive limit"""

MIN_BIAS = 1e-300
"""rad/s: a limit acts only while it has an error to correct; this is practically 0"""

RESTING_SPIN = 1e-9
"""rad/s, rounding in the spin of a body that is pressed against its stop"""


class SpaceHingeMotor(SpaceDrivenBody):
    """Body on a hinge, driven by a torque."""

    def __init__(self, start: DrivenBodyStart, ground: pymunk.Body) -> None:
        """Create the motor from its initial state; `ground` is the space's static body."""
        super().__init__(start)
        assert isinstance(start.mount.drive, TorqueDrive)
        self.moment, self._mass = float(start.body.moment), start.mass
        self._hinge_drive, self.torque = HingeDrive(start.mount.drive, self.moment), start.state[1]
        self._sense, rest = self._hinge_drive.sense, self._hinge_drive.rest
        self._angles = rest - UNLIMITED, rest + UNLIMITED
        self.limit = pymunk.RotaryLimitJoint(ground, self.body, *self._angles)
        self.limit.max_bias = MIN_BIAS
        self._limited_stop = 0
        self.stop = 0
        """the stop that the body is pressed against: −1, 1 or 0"""
        self._is_locked, self._can_leave_stop, self._had_contact, self._was_shifted = False, False, False, False
        self.was_locked = False
        """whether it was immovable in the last substep"""
        self._gravity = (0.0, 0.0)
        self._weight: Any = (0.0, 0.0)
        self._is_resting = False  # at rest at a stop, with the same torque as in the last substep
        self.total_torque = self.weight_torque = 0.0
        """N·m, total torque without contacts and the limit, and the part of its weight"""
        lib.cpBodySetAngularVelocity(self._record, self.spin)

    def set_gravity(self, gravity: tuple[float, float], space_gravity: tuple[float, float]) -> None:
        """Set the gravity, m/s², and the gravity that the space itself applies to all bodies."""
        counterforce = -space_gravity[0] * self.body.mass, -space_gravity[1] * self.body.mass
        self._gravity, self._weight = gravity, ffi.new("cpVect *", counterforce)[0]  # once: a tuple takes 0.15 µs more
        self._is_resting = False

    def set(self, level: float) -> None:
        """Set the level from now on."""
        self.level, self._is_resting = level, False

    def before(self) -> None:
        """Prepare the body for a substep."""
        lib.cpBodySetForce(self._record, self._weight)
        if self.spin or not self._is_resting:
            self._move()
        lib.cpBodySetTorque(self._record, self.total_torque)
        self._can_leave_stop = self._had_contact = False

    def _move(self) -> None:
        h, hinge_drive = self._h, self._hinge_drive
        self.weight_torque = gravity_torque(self.mount.hinge, self.angle, self._mass, self._gravity)
        angle, spin, self.stop, press, self.torque, steady = hinge_drive.turn(
            self.angle, self.spin, self.torque, self.level, self.weight_torque, h
        )
        self._set_angle_before_step(angle, self.spin)
        self.total_torque = self.moment * (spin - self.spin) / h
        if self.stop:
            self.total_torque += press
        self._is_resting = self.stop != 0 and steady and not self.spin and angle == self.angle
        self._set_limit(self.stop)
        self.angle = angle

    def _set_limit(self, stop: int) -> None:
        """Activate the limit at a stop, or deactivate it."""
        if stop == self._limited_stop:
            return
        self._limited_stop = stop
        low, high = self._angles
        direction = stop * self._sense
        self.limit.min, self.limit.max = (
            low + 2.0 * UNLIMITED * (direction < 0),
            high - 2.0 * UNLIMITED * (direction > 0),
        )

    def on_contact(self, arbiter: pymunk.Arbiter, is_first: bool) -> None:
        """Handle a contact before it is solved; `is_first`: whether the body is the first of the two."""
        self._had_contact = True
        if not self.stop:
            return
        nx, ny = arbiter.normal
        direction = self.stop * self._sense * (-1.0 if is_first else 1.0)
        x, y = self._pivot
        presses_onto_stop = all(
            direction * ((p.point_a[0] - x) * ny - (p.point_a[1] - y) * nx) >= 0.0
            for p in arbiter.contact_point_set.points
        )
        if presses_onto_stop and not (self._can_leave_stop or self._is_locked):
            self._is_locked = True
            lib.cpBodySetAngularVelocity(self._record, 0.0)
            lib.cpBodySetMoment(self._record, math.inf)
            self._set_limit(0)  # a limit between two immovable bodies would give nan
        elif not presses_onto_stop:
            self._can_leave_stop = True
            self._unlock()

    def _unlock(self) -> None:
        if self._is_locked:
            self._is_locked = False
            lib.cpBodySetMoment(self._record, self.moment)
            self._set_limit(self.stop)

    def after(self) -> None:
        """Update the state after a substep."""
        if self._is_resting and not (self._had_contact or self._was_shifted):
            return  # its spin is rounding at most
        self.was_locked = self._is_locked
        self._unlock()
        spin = lib.cpBodyGetAngularVelocity(self._record)
        if self.stop and abs(spin) <= RESTING_SPIN:
            if spin:
                lib.cpBodySetAngularVelocity(self._record, 0.0)
            spin = 0.0
        self.spin = spin
        if self._had_contact or self._was_shifted:  # undo pymunk's overlap correction, which acts one substep later
            lib.cpBodySetAngle(self._record, self.angle)
            self._was_shifted = self._had_contact

    @property
    def state(self) -> tuple[float, float, float]:
        """Level, torque in N·m, and 0."""
        return self.level, self.torque, 0.0

    @property
    def drive_impulse(self) -> float:
        """Angular impulse of drive and stops in the last substep, N·m·s; undefined while the body is immovable."""
        limit_impulse = -self.stop * self._sense * abs(self.limit.impulse)
        return (self.total_torque - self.weight_torque) * self._h + limit_impulse


class SpaceKinematicHinge(SpaceDrivenBody):
    """Body on a hinge that turns at a rate."""

    def __init__(self, start: DrivenBodyStart) -> None:
        """Create the hinge from its initial state."""
        super().__init__(start)
        assert isinstance(start.mount.drive, StrokeDrive)
        self._drive, self._arrives = start.mount.drive, False
        lib.cpBodySetAngularVelocity(self._record, self.spin)

    def before(self) -> None:
        """Prepare the body for a substep."""
        angle, spin, self._arrives = turn_at_rate(self._drive, self.level, self.angle, self._h)
        if not spin:
            if self.spin:
                self._halt()
            return
        if spin != self.spin:
            self.spin = spin
            lib.cpBodySetAngularVelocity(self._record, spin)
        self.angle = angle
        self._set_angle_before_step(self.angle, spin)

    def after(self) -> None:
        """Stop the body once it has reached a stop."""
        if self._arrives and self.spin:
            self._halt()

    def _halt(self) -> None:
        self.spin = 0.0
        lib.cpBodySetAngularVelocity(self._record, 0.0)


class SpacePlunger(SpaceDrivenBody):
    """Body that is drawn back along a line and springs forward."""

    def __init__(self, start: DrivenBodyStart) -> None:
        """Create the plunger from its initial state."""
        super().__init__(start)
        assert isinstance(start.mount.drive, PlungerDrive)
        self._drive, self._arrives = start.mount.drive, False
        self._direction = stroke_direction(self._drive)
        _, self.pull, self.rate = start.state
        """m, distance by which it is drawn back, and the rate at which that grows, m/s"""
        lib.cpBodySetVelocity(self._record, self.velocity)

    def set(self, level: float) -> None:
        """Set the level from now on."""
        self.level, self.rate = level, rate_after_level_change(self.level, level, self.rate)

    def before(self) -> None:
        """Prepare the body for a substep."""
        if self.pull == self.level * self._drive.travel and not self.rate:  # it is at its target
            self._arrives = False
            return
        h = self._h
        self.pull, self.rate, self._arrives = advance_plunger(self._drive, self.level, self.pull, self.rate, h)
        self.position, self.velocity = plunger_state(self.mount.home, self._direction, self.pull, self.rate)
        (x, y), (vx, vy) = self.position, self.velocity
        lib.cpBodySetPosition(self._record, (x - vx * h, y - vy * h))
        lib.cpBodySetVelocity(self._record, (vx, vy))

    def after(self) -> None:
        """Stop the body once it has reached its target."""
        if self._arrives:
            self.rate, self.velocity = 0.0, (0.0, 0.0)
            lib.cpBodySetVelocity(self._record, (0.0, 0.0))

    @property
    def state(self) -> tuple[float, float, float]:
        """Level, pull in m, and its rate, m/s."""
        return self.level, self.pull, self.rate

    def update_centre(self) -> None:
        """Position and velocity are always up to date."""


class _PathBody:
    """Body in the space that follows a path."""

    def __init__(self, motion: PathMotion, body: pymunk.Body, time: float) -> None:
        self.motion, self.pose = motion, motion.pose(time)
        self.record: Any = body._body
        self.is_moving = True


class SpacePaths:
    """Kinematic bodies in the space that follow paths, by their index."""

    def __init__(self, began: float, h: float) -> None:
        """Start without bodies, at a time of the scene, s; h is the substep, s."""
        self._began, self._h = began, h
        self._bodies: dict[int, _PathBody] = {}

    def __len__(self) -> int:
        return len(self._bodies)

    def join(self, index: int, motion: PathMotion, body: pymunk.Body) -> None:
        """Move a body that is in the space along its path."""
        self._bodies[index] = _PathBody(motion, body, self._began)

    def leave(self, index: int) -> None:
        """Forget a body, by its index, that leaves the space."""
        self._bodies.pop(index, None)

    def before(self, time: float) -> None:
        """Prepare the bodies for a substep that starts at a time of the simulation, s.

        Its drift adds one rounding to the pose. A body at rest is not touched.
        """
        h, end = self._h, self._began + time + self._h
        for each in self._bodies.values():
            pose, each.pose = each.pose, each.motion.pose(end)
            moves = pose != each.pose
            if moves or each.is_moving:
                (x, y, angle), (end_x, end_y, end_angle) = pose, each.pose
                lib.cpBodySetPosition(each.record, (x, y))
                lib.cpBodySetAngle(each.record, angle)
                lib.cpBodySetVelocity(each.record, ((end_x - x) / h, (end_y - y) / h))
                lib.cpBodySetAngularVelocity(each.record, (end_angle - angle) / h)
            each.is_moving = moves


class SpaceDrives:
    """Drives of a scene and the bodies that they hold."""

    def __init__(self, setup: Setup, space: pymunk.Space, h: float) -> None:
        self._space, self._h = space, h
        self._mounts: dict[str, Mount] = mounts(setup.scene)
        self.state: FloatArray = setup.drives.copy()
        """(D, 3) state of each drive, as in `Frame.drives`; out of date for drives that hold a body"""
        self._by_drive: dict[int, SpaceDrivenBody] = {}
        self.driven_bodies: list[SpaceDrivenBody] = []
        """the driven bodies"""
        self._hinges: dict[int, SpaceHingeMotor] = {}  # by the ids of their bodies
        self._with_callback: set[int] = set()
        self._gravity = (0.0, 0.0), (0.0, 0.0)

    def holds(self, name: str) -> bool:
        """Return whether a body is driven."""
        return name in self._mounts

    def body(self, name: str, index: int, bodies: Bodies, state: list[float]) -> pymunk.Body:
        """Create the pymunk body of a driven body.

        Args:
            name: of the body.
            index: its index.
            bodies: all.
            state: x, y, angle, vx, vy, spin.
        """
        mount = self._mounts[name]
        x, y, angle, *_ = state
        moment = about_hinge(mount, float(bodies.mass[index]), float(bodies.moment[index]))
        kind = pymunk.Body.DYNAMIC if isinstance(mount.drive, TorqueDrive) else pymunk.Body.KINEMATIC
        return body_about_hinge(mount, angle, (x, y), kind, moment)

    def join(self, name: str, index: int, body: pymunk.Body, state: list[float]) -> None:
        """Drive a body that is in the space; its state is x, y, angle, vx, vy, spin, mass."""
        mount = self._mounts[name]
        level, torque_or_pull, rate = self.state[mount.number].tolist()
        x, y, angle, vx, vy, spin, mass, *_ = state
        drive_state = level, torque_or_pull, rate
        start = DrivenBodyStart(index, mount, body, mass, (x, y), (vx, vy), angle, spin, drive_state, self._h)
        if isinstance(mount.drive, TorqueDrive):
            hinge = SpaceHingeMotor(start, self._space.static_body)
            hinge.set_gravity(*self._gravity)
            self._space.add(hinge.limit)
            self._hinges[body.id] = hinge
            self._by_drive[mount.number] = hinge
        else:
            self._by_drive[mount.number] = (
                SpacePlunger(start) if isinstance(mount.drive, PlungerDrive) else SpaceKinematicHinge(start)
            )
        self.driven_bodies = list(self._by_drive.values())

    def leave(self, index: int) -> None:
        """Stop driving a body, by its index, that leaves the space."""
        for k, driven_body in list(self._by_drive.items()):
            if driven_body.index == index:
                self.state[k] = driven_body.state
                del self._by_drive[k]
                if isinstance(driven_body, SpaceHingeMotor):
                    del self._hinges[driven_body.body.id]
                    self._space.remove(driven_body.limit)
        self.driven_bodies = list(self._by_drive.values())

    def add_callbacks(self, collision_types: Callable[[int], set[int]]) -> None:
        """Add callbacks for contacts of hinged bodies; `collision_types` returns those of a body by its index."""
        for hinge in self._hinges.values():
            for collision_type in collision_types(hinge.index) - self._with_callback:
                self._with_callback.add(collision_type)
                self._space.on_collision(collision_type, None, pre_solve=self._contact_callback)

    def _contact_callback(self, arbiter: pymunk.Arbiter, _: pymunk.Space, __: object) -> None:
        if not arbiter.process_collision:  # it passes a one-way wall
            return
        for shape, is_first in zip(arbiter.shapes, (True, False), strict=True):
            hinge = self._hinges.get(shape.body.id) if shape.body is not None else None
            if hinge is not None:
                hinge.on_contact(arbiter, is_first)

    def set_gravity(self, gravity: tuple[float, float], space_gravity: tuple[float, float]) -> None:
        """Set the gravity, m/s², and the gravity that the space itself applies to all bodies."""
        self._gravity = gravity, space_gravity
        for hinge in self._hinges.values():
            hinge.set_gravity(gravity, space_gravity)

    def set(self, index: int, level: float) -> None:
        """Set the level of a drive from now on."""
        self.state[index, 0] = level
        if index in self._by_drive:
            self._by_drive[index].set(level)

    def before(self) -> None:
        """Prepare the driven bodies for a substep."""
        for driven_body in self.driven_bodies:
            driven_body.before()

    def after(self) -> None:
        """Update the driven bodies after a substep."""
        for driven_body in self.driven_bodies:
            driven_body.after()

    def write(
        self, position: FloatArray, velocity: FloatArray, angle: FloatArray, angular_velocity: FloatArray
    ) -> None:
        """Write the present state of driven bodies into arrays in scene order."""
        for driven_body in self._by_drive.values():
            driven_body.update_centre()
            n = driven_body.index
            position[n], velocity[n] = driven_body.position, driven_body.velocity
            angle[n], angular_velocity[n] = driven_body.angle, driven_body.spin

    @property
    def indices(self) -> list[int]:
        """Indices of the driven bodies."""
        return [driven_body.index for driven_body in self.driven_bodies]

    def current_state(self) -> FloatArray:
        """Return the present state of the drives, (D, 3), as in `Frame.drives`."""
        if self._by_drive:
            self.state[list(self._by_drive)] = [driven_body.state for driven_body in self._by_drive.values()]
        return self.state.copy()
