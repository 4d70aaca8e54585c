"""Laws: what pymunk is told contact by contact, of those pairs of surfaces alone that need it.

Munk2D parts two by e times their approach before the substep's forces. So one that is to part at another speed is given
the restitution that comes to it, in `pre_solve`, which is called between the two. What rests does not approach, and is
neither kicked nor told anything new. Two that a one-way wall keeps apart, or lets pass, are told in `begin`.
"""

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import pymunk

from sandbox.engines.native.record import address_of
from sandbox.engines.rebound import kicked, rebound, share_at
from sandbox.scene.kick import Kick
from sandbox.scene.surfaces import Surfaces
from sandbox.trajectory import BoolArray, FloatArray

Stretches = dict[pymunk.Shape, tuple[float, float]]
"""At which shares of its whole wall each segment of one that kicks begins and ends."""


@dataclass
class Law:
    """What holds for a pair of surfaces that factors cannot serve."""

    restitution: float
    friction: float
    falloff: float = 0.0
    kick: Kick | None = None

    @property
    def steady(self) -> bool:
        """Whether restitution is one figure."""
        return self.falloff == 0.0 and self.kick is None


class Given(NamedTuple):
    """How a contact was made to part."""

    closing: float
    """m/s"""
    alone: float
    """m/s, at which the two part by themselves"""
    kick: float
    """m/s on top"""

    @property
    def worth(self) -> float:
        """J that the kick brings for each N·s of the contact's impulse along the normal."""
        whole = self.alone + self.kick
        return self.kick / (self.closing + whole) * 0.5 * (self.alone + whole)


@dataclass
class Laws:
    """The laws of a space, by pairs of surfaces, and what they were found to be at the last contacts."""

    space: pymunk.Space
    stretches: Stretches = field(default_factory=dict)
    told: dict[int, Given] | None = None
    """what kicked in the last substep, by the addresses of arbiters; where a dict is put here"""
    _known: dict[tuple[int, int], list[Law]] = field(default_factory=dict)

    def renew(self, surfaces: Surfaces, wrong: set[tuple[int, int]]) -> None:
        """Let those pairs (a ≤ b) be told their coefficients, and no others any more."""
        for known in self._known.values():
            known.clear()
        for a, b in sorted(wrong):
            kick = surfaces.surfaces[a].kick or surfaces.surfaces[b].kick
            restitution, friction = float(surfaces.restitution[a, b]), float(surfaces.friction[a, b])
            known = self._known.setdefault((a, b), [])
            known.append(Law(restitution, friction, float(surfaces.falloff[a, b]), kick))
            self.space.on_collision(a + 1, b + 1, pre_solve=self._tell, data=known)

    def _tell(self, arbiter: pymunk.Arbiter, _: pymunk.Space, known: list[Law]) -> None:
        if not known or not arbiter.process_collision:
            return
        law = known[0]
        arbiter.restitution, arbiter.friction = law.restitution, law.friction
        if law.steady:
            return
        closing = closing_speed(arbiter)
        if closing <= 0.0:
            return
        alone = rebound(law.restitution, law.falloff, closing)
        more = 0.0 if law.kick is None else self._kick(law.kick, arbiter, closing)
        arbiter.restitution = (alone + more) / closing
        if more and self.told is not None:
            self.told[address_of(arbiter._arbiter)] = Given(closing, alone, more)

    def _kick(self, kick: Kick, arbiter: pymunk.Arbiter, closing: float) -> float:
        """Return what a contact is kicked by, m/s."""
        if closing <= kick.threshold:
            return 0.0
        share, middle = 0.5, kick.profile == "middle"
        if middle:
            segment = next(shape for shape in arbiter.shapes if shape in self.stretches)
            assert isinstance(segment, pymunk.Segment)
            points = arbiter.contact_point_set.points
            x = sum(point.point_a.x + point.point_b.x for point in points) / (2 * len(points))
            y = sum(point.point_a.y + point.point_b.y for point in points) / (2 * len(points))
            share = share_at(segment.a, segment.b, self.stretches[segment], (x, y))
        return kicked(kick.speed, kick.threshold, middle, share, closing)


def closing_speed(arbiter: pymunk.Arbiter) -> float:
    """Return how fast two approach along their normal, m/s; of two points that of the faster one."""
    a, b = arbiter.shapes
    first, second, n = a.body, b.body, arbiter.normal
    assert first is not None and second is not None
    along = (first.velocity - second.velocity).dot(n)
    if not (_turns(a) or _turns(b)):
        return float(along)
    return float(
        max(
            along + _turning(first, point.point_a, n) - _turning(second, point.point_b, n)
            for point in arbiter.contact_point_set.points
        )
    )


def _turns(shape: pymunk.Shape) -> bool:
    """Tell whether the spin of a body moves its surface along a normal there: not that of a disc about its centre."""
    body = shape.body
    assert body is not None
    return body.angular_velocity != 0.0 and not (isinstance(shape, pymunk.Circle) and shape.offset == (0.0, 0.0))


def _turning(body: pymunk.Body, point: pymunk.Vec2d, normal: pymunk.Vec2d) -> float:
    """Return how fast a body's spin moves a point of it along a normal, m/s."""
    arm = point - body.position
    return float(body.angular_velocity * (arm.x * normal.y - arm.y * normal.x))


class Gates:
    """One-way walls: whoever comes from the right of one is let through, for as long as the two overlap."""

    def __init__(self, space: pymunk.Space, h: float) -> None:
        self._space, self._h = space, h
        self.walls: set[pymunk.Shape] = set()
        """the segments of those that let pass"""
        self._handled: set[tuple[int, int]] = set()
        self._passing: dict[tuple[int, int], set[tuple[pymunk.Shape, pymunk.Shape]]] = {}

    def renew(self, surfaces: Surfaces, touching: BoolArray) -> None:
        """Watch the pairs (S, S) of surfaces of which one may be such a wall's."""
        for a, b in np.argwhere(np.triu(touching & (surfaces.one_way | surfaces.one_way[:, None]))).tolist():
            if (a, b) not in self._handled:
                self._handled.add((a, b))
                self._space.on_collision(a + 1, b + 1, begin=self._begin, separate=self._separate)

    def _begin(self, arbiter: pymunk.Arbiter, _: pymunk.Space, __: Any) -> None:
        wall, shape = self._told_apart(arbiter)
        if wall is None:  # surfaces are numbered anew as bodies come
            return
        # Another segment of the same wall may be letting it through, and where two join it touches both.
        passing = self._passing.setdefault(_who(shape, wall), set())
        keeps = not passing and self._keeps(arbiter, wall, shape)
        arbiter.process_collision = keeps
        if not keeps:
            passing.add((shape, wall))

    def _separate(self, arbiter: pymunk.Arbiter, _: pymunk.Space, __: Any) -> None:
        wall, shape = self._told_apart(arbiter)
        if wall is not None and (passing := self._passing.get(_who(shape, wall))) is not None:
            passing.discard((shape, wall))

    def _told_apart(self, arbiter: pymunk.Arbiter) -> tuple[pymunk.Shape | None, pymunk.Shape]:
        """Return the wall that lets pass, if one of the two is such, and the other."""
        a, b = arbiter.shapes
        if a in self.walls:
            return a, b
        return (b if b in self.walls else None), a

    def _keeps(self, arbiter: pymunk.Arbiter, wall: pymunk.Shape, shape: pymunk.Shape) -> bool:
        """Tell whether what has just come to touch a wall came from its left, and does not leave it already.

        Positions have moved on by the velocity that a body still has, so where it was a substep ago is known.
        """
        assert isinstance(wall, pymunk.Segment) and shape.body is not None
        along = wall.b - wall.a
        side = shape.bb.center() - shape.body.velocity * self._h - wall.a
        return bool(along.cross(side) >= 0.0 and closing_speed(arbiter) >= 0.0)


def _who(shape: pymunk.Shape, wall: pymunk.Shape) -> tuple[int, int]:
    """Return the ids of a body and a wall."""
    assert shape.body is not None and wall.body is not None
    return shape.body.id, wall.body.id


def worths(told: dict[int, Given], where: list[int], counts: list[int]) -> FloatArray:
    """Return for each contact point what a kick brought for each N·s along its normal, J; of others 0."""
    each = [told[place].worth if place in told else 0.0 for place in where]
    return np.repeat(np.asarray(each, dtype=np.float64), counts)
