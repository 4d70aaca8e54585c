"""MeetingBodies: the bodies that can touch something, or are joined to something, in a pymunk space."""

import math

import numpy as np
import pymunk

from sandbox.engines.limits import BEYOND, FARTHEST
from sandbox.engines.native.drag import is_dragged, mean_share, rates
from sandbox.engines.native.drives import Drives
from sandbox.engines.native.encounters import Encounters
from sandbox.engines.native.field import Field
from sandbox.engines.native.ground import Ground, jointed_surfaces, shuffled
from sandbox.engines.native.members import Member, Members
from sandbox.engines.native.probes import Probes
from sandbox.engines.native.reader import Reader
from sandbox.engines.native.space import (
    SurfaceSetter,
    body_shapes,
    category,
    gravity_of,
    new_space,
)
from sandbox.engines.native.steady import Steady
from sandbox.engines.native.tension import spring_forces
from sandbox.engines.native.tethers import Tethers
from sandbox.engines.touching import NOTHING, ComplexArray, Touching
from sandbox.scene.bodies import Bodies
from sandbox.scene.links import WORLD, Links
from sandbox.scene.meetings import Meetings
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings
from sandbox.trajectory import BoolArray, FloatArray, IntArray


class MeetingBodies(Members):
    """Bodies in a space, addressed by their numbers. The space is not made before a first body joins."""

    def __init__(self, scene: Scene, settings: Settings, skin: float = 0.0) -> None:
        """Set up.

        Args:
            scene: what runs.
            settings: resolved.
            skin: the share of its radius by which each lone disc is larger in the space than it is.
        """
        self._scene, self._settings, self._skin = scene, settings, skin
        self._h, self._dragged = settings.h, is_dragged(scene.world)
        super().__init__(new_space(scene, settings))
        self._reader = Reader(self._space)
        self._setter = SurfaceSetter(self._space, settings.h)
        self._ground = Ground(self._space, self._setter)
        self._surface_of: IntArray = np.empty(0, np.int64)
        self._moments: FloatArray = np.empty(0)
        self._touches: BoolArray = np.empty(0, np.bool_)
        self._noted: BoolArray = np.empty(0, np.bool_)
        self.layer: IntArray = scene.bodies.layer
        """(N,) on which each body is"""
        self.probes = Probes(self._space, scene.zones)
        self.tethers = Tethers(self._space)
        self._polygons = False
        self._single = False  # whether two touch in one place at most, and nothing else is listed
        self._named: dict[str, pymunk.Body] = {}
        self._name_of: dict[int, str] = {}
        self.encounters = Encounters(self._space, self._reader, self._setter.laws, len(scene.fixed_names))
        """what the space tells of contacts"""
        self.field = Field(scene)
        self.drives = Drives(scene, self._space, settings.h)
        self.drives.weigh(scene.world.gravity, gravity_of(scene))
        self._surface_of_fixed: IntArray = np.empty(0, np.int64)
        self.steady = Steady()
        self._moving = 0

    def __len__(self) -> int:
        return self._moving

    def join(
        self,
        numbers: IntArray,
        bodies: Bodies,
        position: FloatArray,
        velocity: FloatArray,
        angle: FloatArray,
        angular_velocity: FloatArray,
        moment: FloatArray,
    ) -> None:
        """Add bodies, (M,) numbers with their present state."""
        if not len(numbers):
            return
        self._ground.lay(self._scene, bodies, self._surface_of_fixed)
        self._moments = bodies.moment
        self._polygons = self._polygons or not bodies.round.all()
        order = np.asarray(shuffled(len(numbers)))
        states = np.column_stack((position, angle, velocity, angular_velocity, bodies.mass[numbers], moment))
        for number, state in zip(numbers[order].tolist(), states[order].tolist(), strict=True):
            self._add(number, bodies, state)
        self._register()
        self._single = not (self._polygons or self.joints or self._scene.zones or self._setter.gates.walls)
        self.drives.watch(self._kinds)
        if self._scene.began and self._setter.gates.walls:
            walls = {number: each for each, number in self._ground.ids.items()}
            pairs = [(n, walls[wall]) for n, wall in self._scene.passing if n in self._members]
            self._setter.gates.go_on([(self._members[n].body.id, wall) for n, wall in pairs])

    def passing(self) -> IntArray | None:
        """Return who is being let through a one-way wall, and which, −1 − k, (P, 2); none where nobody is."""
        who = self._setter.gates.passing()
        if not who:
            return None
        numbers = {member.body.id: n for n, member in self._members.items()}
        walls = self._ground.ids
        pairs = sorted((numbers[body], walls[wall]) for body, wall in who if body in numbers)
        return np.asarray(pairs, np.int64) if pairs else None

    def _kinds(self, number: int) -> set[int]:
        """Return the collision types of a body's shapes."""
        return {shape.collision_type for _, shape in self._members[number].shapes}

    def _add(self, number: int, bodies: Bodies, state: list[float]) -> None:
        """Add a body with its state: x, y, angle, vx, vy, ω, mass, moment."""
        x, y, angle, vx, vy, spin, mass, moment = state
        fixed, name = bool(bodies.fixed[number]), bodies.names[number]
        driven = self.drives.holds(name)
        if driven:
            body = self.drives.body(name, number, bodies, state)
            self._moving += 1
        else:
            body = pymunk.Body(mass, moment, body_type=pymunk.Body.STATIC if fixed else pymunk.Body.DYNAMIC)
            body.position = x, y
            if angle:
                body.angle = angle
            if not fixed:
                body.velocity = vx, vy
                if spin:
                    body.angular_velocity = spin
                self._moving += 1
        self._space.add(body)
        self._members[number] = Member(body, ())
        if self._touches[number] or fixed:
            self._give_shapes(number, bodies)
        if self._noted[number]:
            self.probes.add(number, body)
        self._named[name], self._name_of[number] = body, name
        if driven:
            self.drives.join(name, number, body, state)
        elif not fixed and (self.field.attracts or self.field.thrusted(name)):
            self.field.drive(name, body, self._named)

    def _give_shapes(self, number: int, bodies: Bodies) -> None:
        """Let a body in the space be touched from now on."""
        body = self._members[number].body
        shapes = tuple(body_shapes(body, bodies, number, self._skin))
        who = self._filter(number, bodies)
        for piece, shape in shapes:
            shape.filter = who
            self._setter.dress(shape, int(self._surface_of[piece]))
        self._space.add(*(shape for _, shape in shapes))
        self._members[number] = Member(body, shapes)

    def _filter(self, number: int, bodies: Bodies) -> pymunk.ShapeFilter:
        collides = bodies.elements[bodies.element[number]].collides
        layers = 1 << int(self.layer[number])
        return category(bool(bodies.fixed[number]), collides, int(bodies.group[number]), layers)

    def set_layer(self, number: int, bodies: Bodies) -> None:
        """Let a body meet what is on its layer from now on; what it touched elsewhere it touches no more."""
        who = self._filter(number, bodies)
        for _, shape in self._members[number].shapes:
            shape.filter = who

    def noted(self, number: int) -> bool:
        """Tell whether a body is here, and zones can note it."""
        return number in self._members and bool(self._noted[number])

    def touched(self, bodies: Bodies) -> None:
        """Give shapes to those that were only joined or driven, and have come to meet something."""
        for number, member in self._members.items():
            if not member.shapes and self._touches[number]:
                self._give_shapes(number, bodies)

    def _register(self) -> None:
        moving = {m.body.id: number for number, m in self._members.items() if m.moves}
        self._reader.records = {self._members[number].body._body: number for number in moving.values()}
        still = {m.body.id: number for number, m in self._members.items() if not m.moves}
        self._reader.assign(moving, still | self._ground.ids)
        self._state = None

    def leave(self, numbers: IntArray) -> None:
        """Take bodies out."""
        if not len(numbers):
            return
        for number in numbers.tolist():
            self.tethers.untie(number)
            self.probes.drop(number)
            self._resting.pop(number, None)
            self.drives.leave(number)
            member = self._members.pop(number)
            self._moving -= member.moves
            self._space.remove(*(shape for _, shape in member.shapes), member.body)
            del self._named[self._name_of.pop(number)]  # in place: the field looks into it
            self.steady.drop(number)
        self._reader.members_changed()
        self._state = None

    def link(self, links: Links) -> None:
        """Join the bodies that are here as a scene says, once; what is joined is always here."""
        assert self._settings.bias is not None
        if self._members:
            self.tethers.tie(links, lambda number: self._members[number].body, self._settings.bias)

    @property
    def joined(self) -> int:
        """How many joints there are that pymunk solves."""
        return self.tethers.count if self._moving else 0

    @property
    def joints(self) -> bool:
        """Whether two can touch in several places at once."""
        return self._ground.several or any(len(member.shapes) > 1 for member in self._members.values())

    def renew(self, scene: Scene, meet: Meetings) -> None:
        """Go on with a scene's changed coefficients or walls, or with more surfaces, and with its air."""
        if self._ground.reshape(self._scene, scene):
            self._single = False  # who leant on what was there before is remembered no more, and no listing tells
        self.renew_air(scene)
        self._surface_of, self._surface_of_fixed = meet.surfaces.of_shape, meet.surfaces.of_fixed
        self._touches, self._noted = meet.touches, meet.noted
        self._setter.renew(meet, jointed_surfaces(scene, self._surface_of_fixed))
        for number, (_, own) in self._members.items():
            for piece, shape in own:
                self._setter.dress(shape, int(self._surface_of[piece]))
            heavy = meet.turnable[number] and math.isinf(self.moment(number))
            if heavy and number not in self.drives.numbers:
                self.give_moment(number, float(self._moments[number]))
        if self.drives.axles:
            self.drives.watch(self._kinds)
        self._ground.renew(scene, self._surface_of_fixed)

    def renew_air(self, scene: Scene) -> None:
        """Go on with a scene's changed gravity, drag and wind."""
        self._scene = scene
        self._dragged = is_dragged(scene.world)
        self.field.shares.clear()
        self._space.gravity = gravity_of(scene)
        if self.drives.axles:
            self.drives.weigh(scene.world.gravity, gravity_of(scene))

    def step(self, time: float) -> None:
        """Advance by one substep, from a time, s."""
        if not self._moving:
            return
        self.field.time = time
        if self._dragged:
            self._apply_drag(*self._read())
        else:
            self.steady.apply(self._members)
        if self._setter.gates.walls:
            self._setter.gates.tick += 1
        if self.drives.axles:
            self.drives.before()
            self._space.step(self._h)
            self.drives.after()
        else:
            self._space.step(self._h)
        self._state = None

    def _apply_drag(self, numbers: IntArray, state: FloatArray) -> None:
        """Set the forces of the coming substep on bodies (R,) of a state (R, 6), where there is drag."""
        world, springs = self._scene.world, self._springs(numbers, state)
        self.steady.apply_with_drag(self._members, self._reader, (numbers, state), springs, world, self._h)
        if self.field.kicks:
            shares = mean_share(rates(world, state[:, 3:5]), self._h).tolist()
            self.field.shares = {self._name_of[n]: each for n, each in zip(numbers.tolist(), shares, strict=True)}

    def _springs(self, numbers: IntArray, state: FloatArray) -> FloatArray | None:
        """Return the forces, N, that springs will give to bodies (R,) of a state (R, 6), in the coming substep.

        pymunk evaluates springs after positions have moved by the old velocities. None where there are no springs.
        """
        links = self.tethers.held.springs
        if not len(links):
            return None
        position, angle = np.zeros((len(self._touches), 2)), np.zeros(len(self._touches))
        position[numbers] = state[:, 0:2] + state[:, 3:5] * self._h
        angle[numbers] = state[:, 2] + state[:, 5] * self._h
        for number in np.setdiff1d(np.concatenate((links.a, links.b)), [WORLD, *numbers]).tolist():  # fixed bodies
            body = self._members[number].body
            position[number], angle[number] = body.position, body.angle
        return spring_forces(links, position, angle)[numbers]

    def drive(self, velocity: FloatArray) -> None:
        """Let all bodies of the space go by velocities (N, 2), m/s, for the next step."""
        if self._moving:
            self._reader.drive(velocity)

    def pairs(self) -> IntArray:
        """Return who is in contact, (K, 2) numbers, fixed things being −1 − k; a pair may be listed twice."""
        return self._reader.pairs() if self._moving else np.empty((0, 2), np.int64)

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
        at = self._reader.slots
        position[at], velocity[at] = state[:, 0:2], state[:, 3:5]
        angle[at], angular_velocity[at] = state[:, 2], state[:, 5]
        if self.drives.axles:
            self.drives.write(position, velocity, angle, angular_velocity)

    def touching(self, steady: bool = False) -> Touching | ComplexArray:
        """Return who touches whom now, and how, as `Encounters.touching` does."""
        if not self._moving:
            return NOTHING
        return self.encounters.touching(self._polygons, self._single, steady)

    def beyond(self) -> tuple[int, str] | None:
        """Return a body that is not finite or beyond all bounds, and what is the matter; else None.

        Half-planes are made longer first for one that strays.
        """
        if not self._moving:
            return None
        numbers, state = self._read()
        within = self._ground.within(state)
        if within.all():
            return None
        self.extend_planes()
        within = self._ground.within(state)
        if within.all():
            return None
        worst = int(np.argmin(np.all(within, axis=1)))
        if not np.isfinite(state[worst]).all() or self._ground.reach > FARTHEST:
            return int(numbers[worst]), BEYOND
        return int(numbers[worst]), f"is more than {self._ground.reach:g} m out, where pymunk's half-planes end"

    def reaches(self, place: FloatArray) -> bool:
        """Tell whether planes can be made to reach a place."""
        return self._ground.reaches(place)

    def extend_planes(self) -> None:
        """Make half-planes reach the bodies that are here, where they do not."""
        if self._moving and math.isfinite(self._ground.reach):
            self._ground.extend(self._read()[1][:, 0:2])

    def push(self, number: int, force: FloatArray, torque: float) -> None:
        """Let a steady force (N) and torque (N·m) act on a body from now on."""
        self.steady.push(number, force, torque)
