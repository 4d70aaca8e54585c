"""Laws: what pymunk is told contact by contact, of those pairs of surfaces alone that need it.

Munk2D parts two by e times their approach before the substep's forces. So one that is to part at another speed is given
the restitution that comes to it, in `pre_solve`, which is called between the two. What rests does not approach, and is
neither kicked nor told anything new.
"""

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import pymunk

from sandbox.engines.native.approach import closing_speed
from sandbox.engines.native.chains import smooth
from sandbox.engines.native.gates import Gates
from sandbox.engines.native.record import address_of
from sandbox.engines.rebound import kick_gain, kicked, rebound, share_at
from sandbox.scene.kick import Kick
from sandbox.scene.surfaces import Surfaces
from sandbox.trajectory import FloatArray

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
    gates: Gates
    stretches: Stretches = field(default_factory=dict)
    told: dict[int, Given] | None = None
    """what kicked in the last substep, by the addresses of arbiters; where a dict is put here"""
    _known: dict[tuple[int, int], list[Law]] = field(default_factory=dict)

    def renew(self, surfaces: Surfaces, wrong: set[tuple[int, int]], jointed: set[tuple[int, int]]) -> None:
        """State the coefficients of those pairs (a ≤ b) at each contact, and of no others any more.

        Args:
            surfaces: all.
            wrong: pairs that factors cannot serve.
            jointed: pairs of polygons and walls of several segments, whose contacts are mended.
        """
        for known in self._known.values():
            known.clear()
        for a, b in sorted(wrong | jointed):
            kick = surfaces.surfaces[a].kick or surfaces.surfaces[b].kick
            restitution, friction = float(surfaces.restitution[a, b]), float(surfaces.friction[a, b])
            known = self._known.setdefault((a, b), [])
            known.append(Law(restitution, friction, float(surfaces.falloff[a, b]), kick))
            self.space.on_collision(a + 1, b + 1, pre_solve=self._tell, data=known)
            if (a, b) in jointed and not (surfaces.one_way[a] or surfaces.one_way[b]):  # whose `begin` is the gates'
                self.space.on_collision(a + 1, b + 1, begin=self._smooth)

    def _smooth(self, arbiter: pymunk.Arbiter, _: pymunk.Space, __: Any) -> None:
        smooth(arbiter, self.gates.joints)  # before what a contact begins with is read, along its normal

    def _tell(self, arbiter: pymunk.Arbiter, _: pymunk.Space, known: list[Law]) -> None:
        if not known:
            return
        if self.gates.walls:
            self.gates.note(arbiter)
            if not arbiter.process_collision:
                return
        if self.gates.joints:
            smooth(arbiter, self.gates.joints)
        law = known[0]
        arbiter.restitution, arbiter.friction = law.restitution, law.friction
        if law.steady:
            return
        closing = closing_speed(arbiter)
        if closing <= 0.0:
            return
        alone = rebound(law.restitution, law.falloff, closing)
        more = 0.0
        if law.kick is not None:
            kick, to_approach = self._kick(law.kick, arbiter, closing), law.kick.adds_to == "approach"
            more = kick_gain(law.restitution, law.falloff, kick, to_approach, closing)
        arbiter.restitution = (alone + more) / closing
        if more and self.told is not None:
            self.told[address_of(arbiter._arbiter)] = Given(closing, alone, more)

    def _kick(self, kick: Kick, arbiter: pymunk.Arbiter, closing: float) -> float:
        """Return the speed with which a contact is kicked, m/s."""
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


def worths(told: dict[int, Given], where: list[int], counts: list[int]) -> FloatArray:
    """Return for each contact point what a kick brought for each N·s along its normal, J; of others 0."""
    each = [told[place].worth if place in told else 0.0 for place in where]
    return np.repeat(np.asarray(each, dtype=np.float64), counts)
