"""Collision callbacks: coefficients by pair, kicks, one-way walls and one-way bodies.

`PairCallbacks` sets the coefficients of individual contacts, for those pairs of surfaces that need it. A moving surface
needs it as well: Munk2D's own surface velocity is the same vector on all sides of a shape. Munk2D separates two bodies
at e times their speed of approach before the substep's forces. For another speed of separation, the equivalent
restitution is set in `pre_solve`, which is called after the forces. Resting bodies do not approach each other; they get
no kick and no other restitution.

`SpaceOneWayWalls` lets bodies that come from the right of a one-way wall pass, for as long as the two overlap. The
passing pairs are part of the state from which a run can continue: in the new space, a body that rests on a wall begins
a new contact at a speed that is rounding error, and could not be distinguished from a body that leaves the wall. A
one-way body stops others that were beyond its outermost point in its direction, but for the slop, a substep ago.

Munk2D keeps the decision of `begin` on a contact until the contact ends; `pre_solve` is called nevertheless.
`separate`, which would report the end, cannot be used: it is called for present contacts when a space is freed, and
pymunk has released its objects by then.

Internal edges: `correct_normal` corrects contacts of polygons at the joints of a wall, where its segments have no
edges. `Segment.set_neighbors` makes Munk2D reject contacts with an end of a segment if the normal points over it
towards the neighbour. For discs that is exact. For other shapes Munk2D compares the nearest point with the end bit by
bit, which fails by rounding once the two overlap: then the end of the next segment stops a sliding box. A normal that
leans over an end, towards the continuation of the wall, is turned to the nearest normal of the whole wall.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import pymunk
from pymunk._chipmunk_cffi import ffi, lib

from sandbox.arrays import BoolArray, FloatArray
from sandbox.engines.common.colliders import LEAN, WallSegment
from sandbox.engines.common.restitution import fraction_at, kick_gain, kicked, rebound
from sandbox.engines.pymunk_adapter.munk2d_memory import address_of
from sandbox.scene.compile.contacts import PairTable
from sandbox.scene.description.base import Point
from sandbox.scene.description.world import Kick
from sandbox.scene.geometry.vectors import is_left_of_bend


def closing_speed(arbiter: pymunk.Arbiter) -> float:
    """Return the speed of approach along the normal, m/s; of two contact points, the larger."""
    a, b = arbiter.shapes
    first, second, n = a.body, b.body, arbiter.normal
    assert first is not None and second is not None
    linear = (first.velocity - second.velocity).dot(n)
    if not (_turns(a) or _turns(b)):
        return float(linear)
    return float(
        max(
            linear + _turning(first, point.point_a, n) - _turning(second, point.point_b, n)
            for point in arbiter.contact_point_set.points
        )
    )


def _turns(shape: pymunk.Shape) -> bool:
    """Return whether a body's spin moves its surface along the normal: it does not for a disc about its centre."""
    body = shape.body
    assert body is not None
    return body.angular_velocity != 0.0 and not (
        isinstance(shape, pymunk.Circle) and shape.offset == body.center_of_gravity
    )


def _turning(body: pymunk.Body, point: pymunk.Vec2d, normal: pymunk.Vec2d) -> float:
    """Return the velocity along a normal of a point of a body due to its spin, m/s."""
    arm = point - body.local_to_world(body.center_of_gravity)  # the hinge, for a body on a hinge
    return float(body.angular_velocity * (arm.x * normal.y - arm.y * normal.x))


def correct_normal(arbiter: pymunk.Arbiter, joints: Mapping[pymunk.Shape, WallSegment]) -> None:
    """Correct the normal of a contact if it leans over a joint of a wall."""
    first, second = arbiter.shapes
    segment = joints.get(second) or joints.get(first)
    shape = first if second in joints else second
    if segment is None or isinstance(shape, pymunk.Circle):
        return
    normal = arbiter.normal if segment is joints.get(first) else -arbiter.normal  # from the wall to the body
    turned = _corrected_normal(normal, segment, shape)
    if turned is None:
        return
    points = lib.cpArbiterGetContactPointSet(arbiter._arbiter)
    sign = 1.0 if segment is joints.get(first) else -1.0
    points.normal = (sign * turned.x, sign * turned.y)  # pymunk's setter would merge its two points
    lib.cpArbiterSetContactPointSet(arbiter._arbiter, ffi.addressof(points))


def _corrected_normal(normal: pymunk.Vec2d, segment: WallSegment, shape: pymunk.Shape) -> pymunk.Vec2d | None:
    """Return the normal of the wall nearest to one that leans over a joint; None if it does not lean."""
    a, b = pymunk.Vec2d(*segment.a), pymunk.Vec2d(*segment.b)
    along = (b - a).normalized()
    lean = normal.dot(along)
    if abs(lean) <= LEAN:
        return None
    neighbour_end, sign = (segment.after, 1.0) if lean > 0.0 else (segment.before, -1.0)
    if neighbour_end is None:
        return None
    joint = b if lean > 0.0 else a
    next_direction = (pymunk.Vec2d(*neighbour_end) - joint).normalized()
    if normal.dot(next_direction) <= LEAN:
        return None
    left = along.perpendicular()
    first, second = (along, next_direction) if lean > 0.0 else (-next_direction, along)
    # The normal does not show on which side of the wall the body is: it may be that of one of the body's faces.
    side = 1.0 if is_left_of_bend(*(shape.bb.center() - joint), *first, *second) else -1.0
    own_normal, next_normal = side * left, side * sign * next_direction.perpendicular()
    return own_normal if normal.dot(own_normal) >= normal.dot(next_normal) else next_normal


BodyWallPair: TypeAlias = tuple[int, int]
"""The ids of a body and a wall."""


class SpaceOneWayWalls:
    """One-way walls and one-way bodies of a space, and the bodies that are passing them."""

    def __init__(self, space: pymunk.Space, h: float) -> None:
        self._space, self._h = space, h
        self.walls: set[pymunk.Shape] = set()
        """segments of one-way walls"""
        self.platforms: dict[pymunk.Shape, Point] = {}
        """shapes of one-way bodies, and the direction in the body's frame from which each is solid"""
        self.joints: dict[pymunk.Shape, WallSegment] = {}
        """segments of all walls that continue at one of their ends"""
        self.tick = 0
        """number of substeps"""
        self._pairs_with_callback: set[tuple[int, int]] = set()
        self._passing: dict[BodyWallPair, dict[tuple[pymunk.Shape, pymunk.Shape] | None, int]] = {}
        self._last = -1  # the last substep in which a body was passing
        self._stopped: dict[BodyWallPair, int] = {}  # the substep in which a wall last stopped a body
        self._is_resumed = False

    @property
    def any_left(self) -> bool:
        """Whether there are one-way walls or bodies."""
        return bool(self.walls or self.platforms)

    def rebuild(self, surfaces: PairTable, touching: BoolArray) -> None:
        """Add callbacks for the pairs (S, S) of surfaces of which one may be a one-way wall's or body's."""
        for a, b in np.argwhere(np.triu(touching & (surfaces.one_way | surfaces.one_way[:, None]))).tolist():
            if (a, b) not in self._pairs_with_callback:
                self._pairs_with_callback.add((a, b))
                self._space.on_collision(a + 1, b + 1, begin=self._begin)

    def resume(self, passing: Iterable[BodyWallPair]) -> None:
        """Continue from a state in which some bodies were passing walls, given by ids."""
        self._is_resumed = True
        for pair in passing:
            self._passing[pair], self._last = {None: self.tick}, self.tick

    def passing(self) -> list[BodyWallPair]:
        """Return the pairs that are passing now, by ids."""
        if self._last != self.tick:
            return []
        return [pair for pair, pairs in self._passing.items() if self.tick in pairs.values()]

    def _begin(self, arbiter: pymunk.Arbiter, _: pymunk.Space, __: Any) -> None:
        if self.joints:
            correct_normal(arbiter, self.joints)
        wall, shape = self._wall_and_other(arbiter)
        if wall is None:  # indices of surfaces change when bodies join
            return
        # At a joint of two segments of a wall both are in contact: the second follows the decision of the first.
        passing = self._passing.setdefault(_body_wall_pair(shape, wall), {})
        is_passing = any(last >= self.tick - 1 and pair != (shape, wall) for pair, last in passing.items())
        was_stopped = self._stopped.get(_body_wall_pair(shape, wall), -2) >= self.tick - 1
        arbiter.process_collision = was_stopped or (not is_passing and self._blocks(arbiter, wall, shape))

    def record_decision(self, arbiter: pymunk.Arbiter) -> None:
        """Record whether a contact is ignored, as decided when it began."""
        wall, shape = self._wall_and_other(arbiter)
        if wall is None:
            return
        if arbiter.process_collision:
            self._stopped[_body_wall_pair(shape, wall)] = self.tick
        else:
            self._passing.setdefault(_body_wall_pair(shape, wall), {})[shape, wall] = self._last = self.tick

    def _wall_and_other(self, arbiter: pymunk.Arbiter) -> tuple[pymunk.Shape | None, pymunk.Shape]:
        """Return the shape of a one-way wall or body, if one of the two is such, and the other shape."""
        a, b = arbiter.shapes
        if a in self.walls or a in self.platforms:
            return a, b
        return (b if b in self.walls or b in self.platforms else None), a

    def _blocks(self, arbiter: pymunk.Arbiter, wall: pymunk.Shape, shape: pymunk.Shape) -> bool:
        """Return whether a wall blocks a body that has just touched it: it came from the left and is not leaving.

        Positions have moved by the velocity that the body still has, so its position a substep ago is known.
        """
        if wall in self.platforms:
            return (self._is_resumed and self.tick == 1) or self._came_from_solid_side(wall, shape)
        assert isinstance(wall, pymunk.Segment) and shape.body is not None
        side = shape.bb.center() - shape.body.velocity * self._h - wall.a
        if (wall.b - wall.a).cross(side) < 0.0:
            return False
        was_touching = self._is_resumed and self.tick == 1  # in contact before the space was created, and not passing
        return was_touching or closing_speed(arbiter) >= 0.0

    def _came_from_solid_side(self, platform: pymunk.Shape, shape: pymunk.Shape) -> bool:
        """Return whether a body was beyond a one-way body in its direction a substep ago, but for the slop."""
        assert platform.body is not None and shape.body is not None
        angle = platform.body.angle - platform.body.angular_velocity * self._h
        out = pymunk.Vec2d(*self.platforms[platform]).rotated(angle)
        top, bottom = self._farthest(platform.body, out), -self._farthest(shape.body, -out)
        return bottom >= top - self._space.collision_slop

    def _farthest(self, body: pymunk.Body, direction: pymunk.Vec2d) -> float:
        """Return the largest coordinate of a body along a direction a substep ago, m."""
        angle, centre = body.angle - body.angular_velocity * self._h, body.center_of_gravity
        place = body.local_to_world(centre) - body.velocity * self._h
        local = direction.rotated(-angle)
        reaches = []
        for shape in body.shapes:
            match shape:
                case pymunk.Circle():
                    points = [shape.offset]
                case pymunk.Segment():
                    points = [shape.a, shape.b]
                case pymunk.Poly():
                    points = shape.get_vertices()
            reaches += [local.dot(point - centre) + shape.radius for point in points]
        return float(place.dot(direction) + max(reaches))


def _body_wall_pair(shape: pymunk.Shape, wall: pymunk.Shape) -> BodyWallPair:
    """Return the ids of a body and a wall."""
    assert shape.body is not None and wall.body is not None
    return shape.body.id, wall.body.id


SegmentFractions = dict[pymunk.Shape, tuple[float, float]]
"""Fractions of the wall's length at which each segment of a kicking wall begins and ends."""


@dataclass
class PairCoefficients:
    """Coefficients of a pair of surfaces that factors cannot represent."""

    restitution: float
    friction: float
    falloff: float = 0.0
    kick: Kick | None = None
    slip_target: float = 0.0
    """m/s, as in `PairTable`"""

    @property
    def is_constant(self) -> bool:
        """Whether restitution is a constant."""
        return self.falloff == 0.0 and self.kick is None


class KickedContact(NamedTuple):
    """Speeds of a contact with a kick."""

    closing: float
    """m/s, speed of approach"""
    without_kick: float
    """m/s, speed of separation without the kick"""
    kick: float
    """m/s, increase by the kick"""

    @property
    def work_per_impulse(self) -> float:
        """Work of the kick, J, for each N·s of the contact's normal impulse."""
        with_kick = self.without_kick + self.kick
        return self.kick / (self.closing + with_kick) * 0.5 * (self.without_kick + with_kick)


@dataclass
class PairCallbacks:
    """Coefficients by pairs of surfaces of a space, and the kicks of the last substep."""

    space: pymunk.Space
    one_way_walls: SpaceOneWayWalls
    segment_fractions: SegmentFractions = field(default_factory=dict)
    recorded_kicks: dict[int, KickedContact] | None = None
    """contacts that were kicked in the last substep, by the address of the arbiter; filled if it is a dict"""
    _known: dict[tuple[int, int], list[PairCoefficients]] = field(default_factory=dict)

    def rebuild(self, surfaces: PairTable, unfactored: set[tuple[int, int]], jointed: set[tuple[int, int]]) -> None:
        """Set the pairs (a ≤ b) whose coefficients are set at each contact, in place of the previous ones.

        Args:
            surfaces: all.
            unfactored: pairs whose coefficients are no products of factors.
            jointed: pairs of polygons and walls of several segments, whose normals are corrected.
        """
        for known in self._known.values():
            known.clear()
        for a, b in sorted(unfactored | jointed):
            kick = surfaces.surfaces[a].kick or surfaces.surfaces[b].kick
            restitution, friction = float(surfaces.restitution[a, b]), float(surfaces.friction[a, b])
            known = self._known.setdefault((a, b), [])
            falloff, slip_target = float(surfaces.falloff[a, b]), float(surfaces.slip_target[a, b])
            known.append(PairCoefficients(restitution, friction, falloff, kick, slip_target))
            self.space.on_collision(a + 1, b + 1, pre_solve=self._set_coefficients, data=known)
            if (a, b) in jointed and not (surfaces.one_way[a] or surfaces.one_way[b]):  # these have a `begin`
                self.space.on_collision(a + 1, b + 1, begin=self._correct_normal)

    def _correct_normal(self, arbiter: pymunk.Arbiter, _: pymunk.Space, __: Any) -> None:
        correct_normal(arbiter, self.one_way_walls.joints)  # before the warm-start impulse is read, along its normal

    def _set_coefficients(self, arbiter: pymunk.Arbiter, _: pymunk.Space, known: list[PairCoefficients]) -> None:
        if not known:
            return
        if self.one_way_walls.any_left:
            self.one_way_walls.record_decision(arbiter)
            if not arbiter.process_collision:
                return
        if self.one_way_walls.joints:
            correct_normal(arbiter, self.one_way_walls.joints)
        coefficients = known[0]
        arbiter.restitution, arbiter.friction = coefficients.restitution, coefficients.friction
        if coefficients.slip_target:
            n, velocity = arbiter.normal, arbiter.surface_velocity  # that of the shapes, computed anew in each step
            slip = coefficients.slip_target
            arbiter.surface_velocity = velocity.x + slip * n.y, velocity.y - slip * n.x
        if coefficients.is_constant:
            return
        closing = closing_speed(arbiter)
        if closing <= 0.0:
            return
        without_kick = rebound(coefficients.restitution, coefficients.falloff, closing)
        increase = 0.0
        if coefficients.kick is not None:
            kick, to_approach = self._kick(coefficients.kick, arbiter, closing), coefficients.kick.adds_to == "approach"
            increase = kick_gain(coefficients.restitution, coefficients.falloff, kick, to_approach, closing)
        arbiter.restitution = (without_kick + increase) / closing
        if increase and self.recorded_kicks is not None:
            self.recorded_kicks[address_of(arbiter._arbiter)] = KickedContact(closing, without_kick, increase)

    def _kick(self, kick: Kick, arbiter: pymunk.Arbiter, closing: float) -> float:
        """Return the speed of the kick on a contact, m/s."""
        if closing <= kick.threshold:
            return 0.0
        fraction, is_middle = 0.5, kick.profile == "middle"
        if is_middle:
            segment = next(shape for shape in arbiter.shapes if shape in self.segment_fractions)
            assert isinstance(segment, pymunk.Segment)
            points = arbiter.contact_point_set.points
            x = sum(point.point_a.x + point.point_b.x for point in points) / (2 * len(points))
            y = sum(point.point_a.y + point.point_b.y for point in points) / (2 * len(points))
            fraction = fraction_at(segment.a, segment.b, self.segment_fractions[segment], (x, y))
        return kicked(kick.speed, kick.threshold, is_middle, fraction, closing)


def kick_works(kicks: dict[int, KickedContact], addresses: list[int], counts: list[int]) -> FloatArray:
    """Return the work of a kick, J, for each N·s along the normal of each contact point; 0 without a kick."""
    works = [kicks[address].work_per_impulse if address in kicks else 0.0 for address in addresses]
    return np.repeat(np.asarray(works, dtype=np.float64), counts)
