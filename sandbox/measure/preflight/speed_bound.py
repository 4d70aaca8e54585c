"""Upper bounds of the speed of each body, from energy, time, tethers, and impacts by heavier bodies."""

import heapq
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.measure.preflight.diagnostic import ROUNDING
from sandbox.scene.compile.contacts import ContactMatrix, contact_matrix
from sandbox.scene.compile.joint_arrays import MOTORS, WORLD, JointKind
from sandbox.scene.compile.potential import Potential
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import MAX_SPEED
from sandbox.scene.description.fixed import Plane, Post, Wall
from sandbox.scene.description.forces import Attraction
from sandbox.scene.validate.bodies import height_above

Paths = list[list[tuple[int, float]]]


def tether_reach(scene: Scene, down: FloatArray) -> FloatArray:
    """Return how far along `down` each body can move at most, (N,) m; inf if it is not tethered to a static point.

    Joints that give way do not tether.

    From each anchor in the world or on a static body, the reach is the sum of the rods, the slides at their longest,
    and the paths through the bodies between their joints.
    """
    bodies, joints = scene.bodies, scene.joint_arrays
    joints = joints.some(~joints.is_limited).of(JointKind.ROD, JointKind.PIVOT, JointKind.SLIDE)
    length = np.where(joints.kind == JointKind.ROD, joints.figures[:, 0], 0.0)
    length = np.where(joints.kind == JointKind.SLIDE, joints.figures[:, 1], length)
    arm_a, arm_b = (np.hypot(*each.T) for each in (joints.anchor_a, joints.anchor_b))
    is_static = np.append(bodies.fixed, True)  # the world is −1, the last
    paths: Paths = [[] for _ in range(len(bodies))]
    begin: list[tuple[int, float, FloatArray]] = []
    first, second = joints.ends(bodies.position, bodies.angle)
    for k, (a, b) in enumerate(zip(joints.a.tolist(), joints.b.tolist(), strict=True)):
        if is_static[a] and not is_static[b]:
            begin.append((b, float(length[k] + arm_b[k]), first[k]))
        elif a != WORLD and is_static[b] and not is_static[a]:
            begin.append((a, float(length[k] + arm_a[k]), second[k]))
        elif not is_static[a] and not is_static[b]:
            path_length = float(length[k] + arm_a[k] + arm_b[k])
            paths[a].append((b, path_length))
            paths[b].append((a, path_length))
    fall = np.full(len(bodies), math.inf)
    for anchor, reach in _by_anchor(begin):
        lowest = float(anchor @ down) + _shortest_paths(reach, paths)
        fall = np.minimum(fall, lowest - bodies.position @ down)
    return fall


def _by_anchor(begin: list[tuple[int, float, FloatArray]]) -> list[tuple[FloatArray, list[tuple[float, int]]]]:
    """Group the tethered bodies by their anchor."""
    found: dict[tuple[float, float], list[tuple[float, int]]] = {}
    for number, distance, anchor in begin:
        found.setdefault((float(anchor[0]), float(anchor[1])), []).append((distance, number))
    kept = list(found.items())[:MAX_ANCHORS]
    return [(np.asarray(anchor), reach) for anchor, reach in kept]


MAX_ANCHORS = 100
"""Largest number of anchors: each costs a search over all joints. The bounds of the others are left out."""


def _shortest_paths(reach: list[tuple[float, int]], paths: Paths) -> FloatArray:
    """Return the shortest path to each body, (N,) m, from the bodies at an anchor (E. W. Dijkstra 1959)."""
    shortest = np.full(len(paths), math.inf)
    heap = list(reach)
    heapq.heapify(heap)
    while heap:
        distance, number = heapq.heappop(heap)
        if distance >= shortest[number]:
            continue
        shortest[number] = distance
        for other, step in paths[number]:
            if distance + step < shortest[other]:
                heapq.heappush(heap, (distance + step, other))
    return shortest


MAX_MASS_CLASSES = 200
"""Largest number of different masses in a chain of impacts; beyond it, neighbouring ones count as one."""


@dataclass(frozen=True)
class SpeedBounds:
    """Upper bounds of the speeds of the N bodies of a scene."""

    scene: Scene
    matrix: ContactMatrix

    @cached_property
    def unknown(self) -> tuple[str, ...]:
        """Causes that accelerate bodies by an amount that no formula bounds."""
        scene, found = self.scene, []
        if any(self._is_steep(each) for each in scene.attractions):
            found.append("attraction without softening")
        if scene.drives:
            found.append("drives")
        bodies = scene.bodies
        if self.start[bodies.kinematic].any():
            found.append("kinematic bodies")
        if self.matrix.moving_surfaces:
            found.append("moving surfaces")
        if len(scene.joint_arrays.of(*MOTORS)):
            found.append("motors")
        if scene.liquids:
            found.append("liquids")
        if scene.events:
            found.append("events")
        if any(thrust.key is not None for thrust in scene.thrusts):
            found.append("thrusts on keys")
        if any(tyre.keys and tyre.drive > 0.0 for tyre in scene.tyres):
            found.append("tyres on keys")
        if bodies.lift.any() and any(scene.world.wind):  # it keeps the speed through the air, which walls do not
            found.append("lift in wind")
        return tuple(found)

    @cached_property
    def bounded(self) -> bool:
        """Whether all causes of acceleration are included."""
        return not self.unknown

    @cached_property
    def start(self) -> FloatArray:
        """(N,) m/s, speed at the start; of a kinematic body that of its fastest point, on a path the largest one."""
        bodies = self.scene.bodies
        turning = np.where(bodies.kinematic, np.abs(bodies.angular_velocity) * bodies.radius, 0.0)
        speed = np.asarray(np.hypot(*bodies.velocity.T) + turning)
        for index, motion in bodies.paths.items():
            speed[index] = motion.max_speed + motion.max_spin * bodies.radius[index]
        return speed

    @cached_property
    def squared(self) -> FloatArray:
        """(N,) m²/s², square of the speed at the start, with the energy of springs and attraction."""
        scene, bodies = self.scene, self.scene.bodies
        squared = np.square(self.start)
        springs = scene.joint_arrays.of(JointKind.SPRING, JointKind.ROTARY_SPRING)
        if len(springs):
            present = np.ones((1, len(bodies)), np.bool_)
            stored = Potential(scene, bodies).of_springs(
                np.zeros(1), bodies.position[None], bodies.angle[None], present
            )
            has_spring = np.zeros(len(bodies), np.bool_)
            has_spring[springs.b] = True
            has_spring[springs.a[springs.a >= 0]] = True
            squared += np.where(has_spring, 2.0 * float(stored[0]) / bodies.mass, 0.0)
        for each in scene.attractions:
            if each.strength != 0.0 and not self._is_steep(each):
                squared += 2.0 * abs(each.strength) * self._path_integral(each)
        return np.asarray(squared)

    @cached_property
    def thrust(self) -> FloatArray:
        """(N,) m/s, speed that thrusts without a key can add."""
        scene, bodies = self.scene, self.scene.bodies
        added = np.zeros(len(bodies))
        for each in scene.thrusts:
            if each.key is None and each.body in bodies.number_of:
                number = bodies.number_of[each.body]
                end = scene.world.duration if each.end is None else min(each.end, scene.world.duration)
                added[number] += math.hypot(*each.force) * max(0.0, end - each.begin) / bodies.mass[number]
        return added

    @cached_property
    def gravity(self) -> float:
        """Gravity, m/s²."""
        return math.hypot(*self.scene.world.gravity)

    @cached_property
    def pull(self) -> FloatArray:
        """(N,) m/s², gravity on each body, upwards or downwards."""
        return np.asarray(self.gravity * np.abs(self.scene.bodies.gravity_scale))

    @cached_property
    def falls(self) -> BoolArray:
        """(N,) whether gravity does not make the body rise, so that what is below it limits its speed."""
        return np.asarray(self.scene.bodies.gravity_scale >= 0.0)

    @cached_property
    def down(self) -> FloatArray:
        """(2,) unit vector of gravity; only with gravity."""
        return np.asarray(self.scene.world.gravity) / self.gravity

    @cached_property
    def own(self) -> FloatArray:
        """(N,) m/s, bound by the start, fall and forces of each body.

        A kinematic body keeps its speed. Others fall from the start until a level floor below them or the end of the
        run; in scenes with joints or other bodies than balls, also until their tether is taut or they have passed all
        obstacles.
        """
        scene, bodies = self.scene, self.scene.bodies
        speed = np.sqrt(self.squared) + self.pull * scene.world.duration
        if self.gravity > 0:
            for plane in scene.planes:
                normal = np.asarray(plane.normal) / math.hypot(*plane.normal)
                # Level up to rounding: on other planes bodies slide down without a limit.
                if float(normal @ self.down) < -1.0 + 1e-12:
                    drop = np.maximum(height_above(plane, bodies.position) - bodies.core, 0.0)
                    stops = self.matrix.touches & self.falls
                    speed = np.where(stops, np.minimum(speed, self._speed_after(drop)), speed)
            if len(scene.joint_arrays) or not bodies.round.all():
                speed = self._limited_by(self._max_fall(), speed)
        return np.where(bodies.kinematic, self.start, self._with_thrust_and_wind(speed))

    def toward(self, thing: Plane | Wall | Post) -> FloatArray:
        """Return the bound by the start, fall and forces of each body at a contact with a static object, (N,) m/s."""
        bodies = self.scene.bodies
        if isinstance(thing, Plane):
            return self._toward_plane(thing)
        if self.gravity == 0.0:
            return self.own
        if isinstance(thing, Wall):
            depths, half = np.asarray(thing.points) @ self.down, 0.5 * thing.thickness
        else:
            depths, half = np.asarray([np.asarray(thing.position) @ self.down]), thing.radius
        depth, lowest = bodies.position @ self.down, float(depths.max()) + half
        level = float(np.ptp(depths)) == 0.0 and isinstance(thing, Wall)
        # A body that falls onto a level wall touches its upper side first; otherwise at its lowest point at the latest.
        on_top = level & (depth + bodies.core <= float(depths.max()) - half)
        drop = np.where(on_top, float(depths.max()) - half - bodies.core - depth, lowest + bodies.radius - depth)
        at_contact = self._with_thrust_and_wind(self._speed_after(drop))
        return np.where(self.falls, np.minimum(self.own, at_contact), self.own)

    def _toward_plane(self, plane: Plane) -> FloatArray:
        """Return the bound at a contact with a plane, (N,) m/s.

        If nothing else can deflect the body, only the component across the plane counts.
        """
        scene, bodies = self.scene, self.scene.bodies
        others = len(scene.joint_arrays) or self.matrix.mutual or scene.attractions or scene.thrusts or scene.drives
        if len(scene.fixed) > 1 or others or any(scene.world.wind) or bodies.lift.any():
            return self.own
        normal = np.asarray(plane.normal) / math.hypot(*plane.normal)
        pull = np.maximum(-bodies.gravity_scale * float(np.asarray(scene.world.gravity) @ normal), 0.0)
        height = np.maximum(height_above(plane, bodies.position) - bodies.core, 0.0)
        return np.minimum(
            self.own, self._with_thrust_and_wind(np.sqrt(np.square(bodies.velocity @ normal) + 2.0 * pull * height))
        )

    @cached_property
    def struck(self) -> FloatArray:
        """(N,) m/s, bound after any series of kicks and impacts by others; 0 if it is no larger.

        Impacts are limited by the energy of the others. A body that falls past all obstacles causes no further impacts.
        """
        bodies, matrix = self.scene.bodies, self.matrix
        movers = ~bodies.immovable & matrix.touches
        own = self.own
        if self.gravity > 0:
            after_fall = self._with_thrust_and_wind(self._speed_after(np.maximum(self._max_fall(), 0.0)))
            own = np.where(self.falls, np.minimum(own, after_fall), own)
        speed = np.where(movers, np.maximum(own, _kick_speed(matrix)), own)
        if matrix.mutual and movers.any():
            # From heavy to light: a resting body of mass m takes up to 2M/(M + m) of the speed of the one that hits it.
            masses, of_body = np.unique(bodies.mass[movers], return_inverse=True)
            of_body = of_body.reshape(-1)
            fastest = np.zeros(len(masses))
            np.maximum.at(fastest, of_body, speed[movers])
            energy = 0.5 * float((bodies.mass * np.square(speed))[movers].sum())
            for k in np.unique(np.linspace(0, len(masses) - 1, MAX_MASS_CLASSES).round().astype(int))[::-1].tolist():
                fastest = np.maximum(fastest, fastest[k] * 2.0 / (1.0 + masses / masses[k]))
            if not matrix.surfaces.kicks.any():
                fastest = np.minimum(fastest, np.sqrt(2.0 * energy / masses))
            speed[movers] = np.maximum(speed[movers], fastest[of_body])
        speed = np.minimum(speed, bodies.max_speed)
        return np.where(speed > own * (1.0 + ROUNDING), speed, 0.0)

    @cached_property
    def energy(self) -> float:
        """Largest kinetic energy of all moving bodies that collide, J, without kicks."""
        bodies = self.scene.bodies
        movers = ~bodies.immovable & self.matrix.touches
        return 0.5 * float((bodies.mass * np.square(self.own))[movers].sum())

    def core(self, attraction: Attraction) -> float:
        """Return the smallest distance of bodies from the centre of an attraction, m: to solid objects there."""
        scene, bodies = self.scene, self.scene.bodies
        if isinstance(attraction.toward, str):
            core = float(bodies.core[bodies.number_of[attraction.toward]])
            return core if self.matrix.mutual else 0.0
        posts = (
            post for post in scene.posts if post.solid and math.dist(post.position, attraction.toward) < post.radius
        )
        cores = [post.radius - math.dist(post.position, attraction.toward) for post in posts]
        fixed = bodies.fixed & (bodies.core > 0.0)
        away = np.hypot(*(bodies.position - np.asarray(attraction.toward)).T)
        cores += (bodies.core - away)[fixed].tolist() if self.matrix.mutual else []
        return max(0.0, *cores, 0.0)

    def _path_integral(self, attraction: Attraction) -> FloatArray:
        """Return the integral of 1/(r² + ε²) over each body's path to the centre, or far away from it, (N,) 1/m."""
        bodies, soft, near = self.scene.bodies, attraction.softening, self.core(attraction)
        toward = attraction.toward
        centre = bodies.position[bodies.number_of[toward]] if isinstance(toward, str) else np.asarray(toward)
        away = np.maximum(np.hypot(*(bodies.position - centre).T), near)
        is_attracted = attraction.strength > 0.0
        if soft == 0.0:
            with np.errstate(divide="ignore"):
                return np.asarray(1.0 / near - 1.0 / away if is_attracted else 1.0 / away)
        angle = np.arctan(away / soft)
        return np.asarray((angle - math.atan(near / soft) if is_attracted else 0.5 * math.pi - angle) / soft)

    def _is_steep(self, attraction: Attraction) -> bool:
        """Return whether an attraction can accelerate bodies beyond the speed limit, so that nothing bounds them."""
        smallest = max(attraction.softening, self.core(attraction))
        return abs(attraction.strength) >= smallest * MAX_SPEED**2 and attraction.strength != 0.0

    def _speed_after(self, drop: FloatArray) -> FloatArray:
        """Return the speeds after a drop, or 0 if a body cannot rise so high, (N,) m/s."""
        return np.asarray(np.sqrt(np.maximum(self.squared + 2.0 * self.pull * drop, 0.0)))

    def _limited_by(self, fall: FloatArray, speed: FloatArray) -> FloatArray:
        """Return speeds (N,), m/s, of which those of bodies that do not rise are limited by a fall, (N,) m."""
        after_fall = self._speed_after(np.maximum(fall, 0.0))
        return np.where(self.falls, np.minimum(speed, after_fall), speed)

    def _with_thrust_and_wind(self, speed: FloatArray) -> FloatArray:
        """Return speeds with the contributions of thrusts and wind, up to their limits; 0 for static bodies."""
        world, bodies = self.scene.world, self.scene.bodies
        is_slowed = world.has_drag or world.has_damping or bool(bodies.linear_damping.any())
        if is_slowed and not len(self.scene.joint_arrays) and not self.scene.attractions:
            speed = np.minimum(speed, np.maximum(self.start, self._terminal))
        if world.has_drag:
            speed = speed + math.hypot(*world.wind)
        speed = np.minimum(speed + self.thrust, bodies.max_speed)
        return np.where(bodies.fixed, 0.0, speed)

    @property
    def _terminal(self) -> FloatArray:
        """Speed through the air at which drag and damping balance gravity on each body, (N,) m/s."""
        world = self.scene.world
        linear = world.linear_drag + world.damping_rate + self.scene.bodies.linear_damping
        by_linear = np.divide(self.pull, linear, out=np.full(len(linear), math.inf), where=linear > 0.0)
        quadratic = world.quadratic_drag
        return np.asarray(np.minimum(by_linear, np.sqrt(self.pull / quadratic)) if quadratic > 0.0 else by_linear)

    def _max_fall(self) -> FloatArray:
        """Return how far each body can fall, (N,) m, until its tether is taut or no obstacle is below it."""
        scene, bodies, down = self.scene, self.scene.bodies, self.down
        reach = tether_reach(scene, down)
        if scene.planes:  # a plane that is not level has no lowest point
            return reach
        depth = bodies.position @ down
        reach_of_moving = np.where(bodies.fixed, 0.0, reach)
        lowest = float(np.max((depth + reach_of_moving + bodies.radius)[np.isfinite(reach_of_moving)], initial=-np.inf))
        for wall in scene.walls:
            lowest = max(lowest, float((np.asarray(wall.points) @ down).max()) + wall.thickness / 2.0)
        for post in scene.posts:
            lowest = max(lowest, float(np.asarray(post.position) @ down) + post.radius)
        return np.minimum(reach, lowest - depth + bodies.radius) if math.isfinite(lowest) else reach


def unknown_speeds(scene: Scene) -> tuple[str, ...]:
    """Return the causes that accelerate bodies of a scene by an amount that no formula bounds."""
    return SpeedBounds(scene, contact_matrix(scene)).unknown


def top_speeds(scene: Scene, matrix: ContactMatrix) -> FloatArray:
    """Return the approximate top speed of each body, (N,) m/s: an upper bound if `SpeedBounds.bounded`."""
    speeds = SpeedBounds(scene, matrix)
    return np.maximum(speeds.own, speeds.struck)


def _kick_speed(matrix: ContactMatrix) -> float:
    """Return the largest speed of a body that is kicked again and again, m/s; that of one kick if there is no limit."""
    surfaces, fastest = matrix.surfaces, 0.0
    for b in np.flatnonzero(surfaces.kicks).tolist():
        kick = surfaces.surfaces[b].kick
        assert kick is not None
        for a in np.flatnonzero(matrix.touching[b]).tolist():
            e, f = float(surfaces.restitution[a, b]), float(surfaces.falloff[a, b])
            # v = e v/(1 + f v) + k, that is f v² + (1 − e − k f) v − k = 0
            half = 0.5 * (1.0 - e - kick.speed * f)
            root = half + math.sqrt(half * half + f * kick.speed)
            # and, where k adds to the approach, v = e (v + k)/(1 + f (v + k)): the same equation for v + k
            met = kick.speed / root if root > 0.0 else (1.0 + (kick.adds_to == "approach")) * kick.speed
            fastest = max(fastest, met - kick.speed if kick.adds_to == "approach" else met)
    return fastest
