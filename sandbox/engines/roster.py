"""Roster: the bodies of a running scene as arrays in scene order, for the engines written by hand."""

import math
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from sandbox.engines.acting import derived, is_matter_same
from sandbox.engines.driving.plunger import asked
from sandbox.engines.expiry import Expiry
from sandbox.engines.fixtures import Fixtures, fixtures_of
from sandbox.engines.kernel import kernel
from sandbox.engines.limits import FARTHEST, FASTEST
from sandbox.scene.bodies import Bodies
from sandbox.scene.driven import Mount, about_hinge, mounts
from sandbox.scene.drives import PlungerDrive, TorqueDrive
from sandbox.scene.links import Links
from sandbox.scene.meetings import Meetings, meetings
from sandbox.scene.model import Collides, Scene, Single
from sandbox.scene.surfaced import Mover
from sandbox.trajectory import BoolArray, FloatArray, IntArray

NOTHING, FIXED, ALL = 0, 1, 2
"""What a body can meet, as `Roster.meets` holds it: by `collides`, and nothing at all once it is gone."""

MEETS: dict[Collides, int] = {"none": NOTHING, "fixed": FIXED, "all": ALL}


class Roster:
    """Who is in a running scene, where, how fast, and what each can meet. Engines advance the arrays in place."""

    def __init__(self, scene: Scene, h: float) -> None:
        self.scene, self.h = scene, h
        self.fixtures: Fixtures = fixtures_of(scene)
        bodies = scene.bodies
        self.position: FloatArray = bodies.position.copy()
        self.velocity: FloatArray = bodies.velocity.copy()
        self.angle: FloatArray = bodies.angle.copy()
        self.angular_velocity: FloatArray = bodies.angular_velocity.copy()
        self.roll: FloatArray = bodies.roll.copy()
        """(N, 2) rad/s, of spheres on a floor, about x and y"""
        self.present: BoolArray = np.ones(len(bodies), dtype=np.bool_)
        self.force: FloatArray = np.zeros((len(bodies), 2))
        """(N, 2) N, steady, by actions"""
        self.torque: FloatArray = np.zeros(len(bodies))
        """(N,) N·m, steady, by actions"""
        self.throttles: FloatArray = np.asarray([0.0 if t.key else 1.0 for t in scene.thrusts], dtype=np.float64)
        """how far each thrust of the scene is open, 0 to 1"""
        self.layer: IntArray = bodies.layer.copy()
        """(N,) on which each is, by its number in the scene's `layers`"""
        self.visits: IntArray = bodies.visits.copy()
        """(N, Z) how each is with each zone"""
        self.caught: BoolArray = np.zeros(len(bodies), dtype=np.bool_)
        """(N,) who stands still, as zones hold it"""
        self.drives: FloatArray = scene.driven.copy()
        """(D, 3) of each drive, as a frame tells them"""
        self._mounts: dict[str, Mount] = mounts(scene)
        self._retired: dict[int, float] = {}
        self._broken: dict[int, float] = {}
        self._expiry = Expiry(bodies, scene.began, h)
        self._twisted: BoolArray = np.zeros(len(bodies), dtype=np.bool_)
        self._assume(scene, bodies, meetings(scene, bodies))

    def _assume(self, scene: Scene, bodies: Bodies, meet: Meetings) -> None:
        """Derive what follows from who there is and what they are made of."""
        self.scene, self.bodies, self.meet = scene, bodies, meet
        surfaces = meet.surfaces
        self.radius: FloatArray = bodies.radius
        self.surface: IntArray = surfaces.of_body
        self.fixed_surface: IntArray = surfaces.of_fixed
        self.restitution: FloatArray = surfaces.restitution
        self.friction: FloatArray = surfaces.friction
        self.falloff: FloatArray = surfaces.falloff
        kinds = np.asarray([MEETS[element.collides] for element in bodies.elements], dtype=np.int64)
        self.meets: IntArray = np.where(self.present, kinds[bodies.element], NOTHING)
        """(N,) `NOTHING`, `FIXED` (planes, walls, posts, fixed balls) or `ALL`"""
        moves = self.moving
        self.inverse_mass: FloatArray = np.where(moves, 1.0 / bodies.mass, 0.0)
        # What nothing can turn gets no moment: its spin stays as it is, bit for bit.
        turns = moves & (meet.turnable | self._twisted)
        self.inverse_moment: FloatArray = np.where(turns, 1.0 / bodies.moment, 0.0)
        self.held: dict[int, Mount] = {}
        """how drives hold the bodies that are there, by number"""
        if self._mounts:
            self._hold()

    def _hold(self) -> None:
        """Let drives hold their bodies: nothing moves a hinge, nor what is led whatever it meets."""
        names, bodies = self.bodies.names, self.bodies
        numbers = {names.index(name): mount for name, mount in self._mounts.items() if name in names}
        self.held = {n: mount for n, mount in sorted(numbers.items()) if self.present[n]}
        self.hinge: FloatArray = np.zeros((len(bodies), 2))
        """(N, 2) m, in each body's own frame, the point about which it turns: its centre but for those on a hinge"""
        self.led: BoolArray = np.zeros(len(bodies), np.bool_)
        """(N,) goes on whatever is in its way"""
        for n, mount in self.held.items():
            self.hinge[n], self.led[n] = mount.hinge, not isinstance(mount.drive, TorqueDrive)
            about = about_hinge(mount, float(bodies.mass[n]), float(bodies.moment[n]))
            self.inverse_mass[n], self.inverse_moment[n] = 0.0, 0.0 if self.led[n] else 1.0 / about

    @property
    def links(self) -> Links:
        """The joints that hold: whole, and their bodies all there."""
        return self.scene.links.some(self.linked())

    def linked(self) -> IntArray:
        """Return the numbers of the scene's joints that hold."""
        links, there = self.scene.links, np.append(self.present, True)  # the world, −1, finds the last
        holds = there[links.a] & there[links.b]
        holds[list(self._broken)] = False
        return np.flatnonzero(holds)

    def throttle(self, number: int, level: float) -> None:
        """Open the scene's thrust of that number to a share of its force."""
        self.throttles[number] = level

    def drive(self, number: int, level: float) -> None:
        """Ask the scene's drive of that number for a level."""
        before, _, rate = self.drives[number].tolist()
        if isinstance(self.scene.drives[number], PlungerDrive):
            self.drives[number, 2] = asked(before, level, rate)
        self.drives[number, 0] = level

    @property
    def mobile(self) -> BoolArray:
        """(N,) which bodies are there and not fixed."""
        return self.present & ~self.bodies.fixed

    @property
    def moving(self) -> BoolArray:
        """(N,) which bodies are there, not fixed, and held by no zone."""
        return self.mobile & ~self.caught

    @property
    def gravity(self) -> FloatArray:
        """Of all bodies alike, (2,), or of each, (N, 2), m/s²."""
        return np.asarray(self.scene.world.gravity, dtype=np.float64)

    @property
    def retired(self) -> Mapping[int, float]:
        """When each body that is no longer there was gone: number → s."""
        return MappingProxyType(self._retired)

    @property
    def broken(self) -> Mapping[int, float]:
        """When each joint broke that did: its number in `scene.links` → s."""
        return MappingProxyType(self._broken)

    def part(self, links: IntArray, time: float) -> None:
        """Let joints, by their numbers, hold no more from a time on, s."""
        self._broken |= dict.fromkeys(links.tolist(), time)

    def motion(self, number: int) -> tuple[FloatArray, float]:
        """Return a body's velocity (2,), m/s, and angular velocity, rad/s."""
        return self.velocity[number].copy(), float(self.angular_velocity[number])

    def set_velocity(self, number: int, velocity: FloatArray) -> None:
        """Give a body a velocity, m/s."""
        self.velocity[number] = velocity

    def set_spin(self, number: int, spin: float) -> None:
        """Give a body an angular velocity, rad/s."""
        self.angular_velocity[number] = spin

    def set_roll(self, number: int, roll: tuple[float, float]) -> None:
        """Give a sphere on a floor an angular velocity about x and y, rad/s."""
        self.roll[number] = roll

    def push(self, number: int, force: FloatArray, torque: float) -> None:
        """Let a steady force (N) and torque (N·m) act on a body from now on."""
        self.force[number], self.torque[number] = force, torque
        if torque and not self._twisted[number]:
            self._twisted[number] = True
            self._assume(self.scene, self.bodies, self.meet)

    def put(self, number: int, position: FloatArray) -> None:
        """Put a body somewhere, m."""
        self.position[number] = position

    def check_place(self, position: tuple[float, float], radius: float, collides: Collides) -> None:
        """Refuse no place: bodies may start from anywhere."""

    def change(self, scene: Scene, spawned: tuple[Mover, ...] | None = None) -> None:
        """Go on with a scene that differs alone in air, gravity, coefficients, courses of walls, or in what is solid.

        Raises:
            ActionError: it has more surfaces than a scene may have.
        """
        if spawned is None and is_matter_same(scene, self.scene):
            self.scene = scene
            return
        spawned = self.bodies.elements[len(self.scene.elements) :] if spawned is None else spawned
        bodies = replace(self.bodies, elements=(*scene.elements, *spawned))
        meet = derived(scene, bodies)
        if scene.fixed != self.scene.fixed:
            self.fixtures = fixtures_of(scene)
        self._assume(scene, bodies, meet)

    def add(self, single: Single, name: str) -> int:
        """Add a body that was checked, and return its number.

        Raises:
            ActionError: it makes more surfaces than a scene may have.
        """
        bodies = self.bodies.joined_by(single, name)
        meet = derived(self.scene, bodies)
        self.position = np.vstack((self.position, bodies.position[-1:]))
        self.velocity = np.vstack((self.velocity, bodies.velocity[-1:]))
        self.roll = np.vstack((self.roll, bodies.roll[-1:]))
        self.angle = np.append(self.angle, bodies.angle[-1])
        self.angular_velocity = np.append(self.angular_velocity, bodies.angular_velocity[-1])
        self.present = np.append(self.present, True)
        self.force, self.torque = np.vstack((self.force, np.zeros((1, 2)))), np.append(self.torque, 0.0)
        self._twisted, self.caught = np.append(self._twisted, False), np.append(self.caught, False)
        self.layer = np.append(self.layer, bodies.layer[-1])
        self.visits = np.vstack((self.visits, bodies.visits[-1:]))
        self._assume(self.scene, bodies, meet)
        return len(bodies) - 1

    def take_out(self, numbers: IntArray, time: float) -> None:
        """Remove bodies at a time, s. They stay where they are in the arrays, with no velocity."""
        self.present[numbers] = False
        self.velocity[numbers], self.angular_velocity[numbers], self.roll[numbers] = 0.0, 0.0, 0.0
        self.force[numbers], self.torque[numbers] = 0.0, 0.0
        self.caught[numbers] = False
        self._retired |= dict.fromkeys(numbers.tolist(), time)
        self._assume(self.scene, self.bodies, self.meet)

    def going(self, time: float) -> IntArray:
        """Return who is to be retired at a time, s: whose life is over or whose centre has left world.bounds, (K,)."""
        return self._expiry.going(time, self.position, self.present, self.bodies.fixed, self.scene.world.bounds)

    def beyond(self) -> int | None:
        """Return a body that is not finite, or beyond all bounds; else None."""
        worst = first_beyond(self.position, self.velocity, self.angle, self.angular_velocity)
        return None if worst < 0 else worst


@kernel
def first_beyond(position: FloatArray, velocity: FloatArray, angle: FloatArray, spin: FloatArray) -> int:
    """Return the first of N bodies that is not finite, or beyond all bounds; −1 for none."""
    for i in range(len(position)):
        # Comparisons with nan are false, so that what is not good is caught, whatever it is.
        good = position[i, 0] ** 2 + position[i, 1] ** 2 <= FARTHEST * FARTHEST
        good = good and velocity[i, 0] ** 2 + velocity[i, 1] ** 2 <= FASTEST * FASTEST
        if not (good and abs(spin[i]) < math.inf and abs(angle[i]) < math.inf):
            return i
    return -1
