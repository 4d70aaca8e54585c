"""Gates: one-way walls. Who comes from the right of one is let through, for as long as the two overlap.

Who is passing is part of a state: where a space goes on from one, what lies on a wall touches it anew, at no speed but
rounding, and could not be told from what leaves it.

Munk2D keeps to what `begin` decides of a contact until it ends; until then `pre_solve` is called all the same.
`separate`, which would tell the end, is of no use: it is called for what still touches when a space goes, and pymunk
has let go of its own objects by then.
"""

from collections.abc import Iterable
from typing import Any, TypeAlias

import numpy as np
import pymunk

from sandbox.engines.fixtures import WallSegment
from sandbox.engines.native.approach import closing_speed
from sandbox.engines.native.chains import smooth
from sandbox.scene.surfaces import Surfaces
from sandbox.trajectory import BoolArray

Who: TypeAlias = tuple[int, int]
"""The ids of a body and a wall."""


class Gates:
    """The one-way walls of a space, and who is passing them."""

    def __init__(self, space: pymunk.Space, h: float) -> None:
        self._space, self._h = space, h
        self.walls: set[pymunk.Shape] = set()
        """the segments of those that let pass"""
        self.joints: dict[pymunk.Shape, WallSegment] = {}
        """the segments of all walls that run on beyond an end of theirs"""
        self.tick = 0
        """counts substeps"""
        self._handled: set[tuple[int, int]] = set()
        self._passing: dict[Who, dict[tuple[pymunk.Shape, pymunk.Shape] | None, int]] = {}
        self._last = -1  # the substep in which somebody was passing
        self._stopped: dict[Who, int] = {}  # the substep in which a wall last stopped a body
        self._goes_on = False

    def renew(self, surfaces: Surfaces, touching: BoolArray) -> None:
        """Watch the pairs (S, S) of surfaces of which one may be such a wall's."""
        for a, b in np.argwhere(np.triu(touching & (surfaces.one_way | surfaces.one_way[:, None]))).tolist():
            if (a, b) not in self._handled:
                self._handled.add((a, b))
                self._space.on_collision(a + 1, b + 1, begin=self._begin)

    def go_on(self, passing: Iterable[Who]) -> None:
        """Go on from a state in which some were passing, told by their ids and those of the walls."""
        self._goes_on = True
        for who in passing:
            self._passing[who], self._last = {None: self.tick}, self.tick

    def passing(self) -> list[Who]:
        """Return who is passing what now, by their ids."""
        if self._last != self.tick:
            return []
        return [who for who, pairs in self._passing.items() if self.tick in pairs.values()]

    def _begin(self, arbiter: pymunk.Arbiter, _: pymunk.Space, __: Any) -> None:
        if self.joints:
            smooth(arbiter, self.joints)
        wall, shape = self._told_apart(arbiter)
        if wall is None:  # surfaces are numbered anew as bodies come
            return
        # Where two segments of a wall join, both are touched: the one goes by what the other has decided.
        passing = self._passing.setdefault(_who(shape, wall), {})
        through = any(last >= self.tick - 1 and pair != (shape, wall) for pair, last in passing.items())
        held = self._stopped.get(_who(shape, wall), -2) >= self.tick - 1
        arbiter.process_collision = held or (not through and self._keeps(arbiter, wall, shape))

    def note(self, arbiter: pymunk.Arbiter) -> None:
        """Take note whether a contact is being ignored, as it was decided when it began."""
        wall, shape = self._told_apart(arbiter)
        if wall is None:
            return
        if arbiter.process_collision:
            self._stopped[_who(shape, wall)] = self.tick
        else:
            self._passing.setdefault(_who(shape, wall), {})[shape, wall] = self._last = self.tick

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
        side = shape.bb.center() - shape.body.velocity * self._h - wall.a
        if (wall.b - wall.a).cross(side) < 0.0:
            return False
        touched = self._goes_on and self.tick == 1  # before the space was made, and was not passing
        return touched or closing_speed(arbiter) >= 0.0


def _who(shape: pymunk.Shape, wall: pymunk.Shape) -> Who:
    """Return the ids of a body and a wall."""
    assert shape.body is not None and wall.body is not None
    return shape.body.id, wall.body.id
