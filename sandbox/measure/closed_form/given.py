"""Given: what a closed form asks of a scene, derived once for all of them, and the directions they reckon in."""

import math
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.contacts import ContactMatrix, contact_matrix
from sandbox.scene.compile.joint_arrays import WORLD, JointArrays, LinkKind
from sandbox.scene.description.fixed import Plane
from sandbox.scene.description.world import World
from sandbox.scene.scene import Scene

TOUCH = 1e-9
"""m: an overlap or a gap up to this still counts as touching."""
SQUARE = 1e-12
"""Directions whose sine is below this are taken as parallel, figures that differ by this share as equal: rounding."""


class Tie(NamedTuple):
    """The one joint of a body, to a place that never moves."""

    kind: LinkKind
    figures: FloatArray
    """(3,) by kind"""
    place: FloatArray
    """(2,) m, where the world holds it"""
    arm: FloatArray
    """(2,) m, where it holds the body, in the body's own frame from its centre of mass"""


@dataclass(frozen=True, eq=False)
class Given:
    """A scene, and what follows from it."""

    scene: Scene
    bodies: Bodies
    meet: ContactMatrix
    links: JointArrays
    thrust: BoolArray
    """(N,) carries a thrust, or has a drive"""

    @classmethod
    def of(cls, scene: Scene) -> Self:
        """Derive it."""
        bodies = scene.bodies
        return cls(scene, bodies, contact_matrix(scene), scene.links, thrust_on(scene, bodies))

    @property
    def world(self) -> World:
        """The surroundings."""
        return self.scene.world

    @property
    def gravity(self) -> FloatArray:
        """The world's, (2,) m/s²."""
        return np.asarray(self.world.gravity, dtype=np.float64)

    @property
    def airless(self) -> bool:
        """Whether there is no drag."""
        return self.world.linear_drag == 0.0 and self.world.quadratic_drag == 0.0

    def untouched(self, number: int) -> bool:
        """Tell whether a body moves, can meet nothing, and has no thrust."""
        return bool(not (self.bodies.fixed[number] or self.meet.touches[number] or self.thrust[number]))

    def only_plane(self) -> Plane | None:
        """Return the plane that is the one fixed thing there is; None where there are others, or none."""
        alone = len(self.scene.fixed) == len(self.scene.planes) == len(self.scene.layers) == 1
        return self.scene.planes[0] if alone else None

    def tie(self, number: int) -> Tie | None:
        """Return the one joint of a body, which never breaks and holds it to the world or a fixed body, or None."""
        found = np.flatnonzero((self.links.a == number) | (self.links.b == number))
        if len(found) != 1:
            return None
        k = int(found[0])
        if math.isfinite(self.links.strength[k]) or math.isfinite(self.links.most_force[k]):
            return None
        one = self.links.some(np.asarray([k]))
        (start,), (end,) = one.ends(self.bodies.position, self.bodies.angle)
        kind, figures = LinkKind(int(one.kind[0])), one.figures[0]
        if int(one.b[0]) == number:
            other, place, arm = int(one.a[0]), start, one.anchor_b[0]
        else:
            other, place, arm = int(one.b[0]), end, one.anchor_a[0]
        if other != WORLD and not self.bodies.fixed[other]:
            return None
        return Tie(kind, figures, place, arm)


def thrust_on(scene: Scene, bodies: Bodies) -> BoolArray:
    """Return which bodies carry a thrust or have a drive, (N,)."""
    movers = [each.body for each in (*scene.thrusts, *scene.drives)]
    return np.isin(bodies.names, movers) if movers else np.zeros(len(bodies), np.bool_)


def direction(vector: FloatArray) -> FloatArray:
    """Return a vector of length 1 along one that is not 0, (2,)."""
    # Scaled first: the square of a very long or short vector would leave the range of doubles.
    scaled = vector / np.abs(vector).max()
    return np.asarray(scaled / math.hypot(*scaled))


def normal_of(plane: Plane) -> FloatArray:
    """Return a plane's normal of length 1, (2,)."""
    return direction(np.asarray(plane.normal))


def across(unit: FloatArray) -> FloatArray:
    """Return a unit vector turned by a quarter clockwise, (2,): with a normal pointing up, to the right."""
    return np.asarray([unit[1], -unit[0]])


def cross(a: FloatArray, b: FloatArray) -> float:
    """Return the component of a × b out of the plane."""
    return float(a[0] * b[1] - a[1] * b[0])


def parallel(vector: FloatArray, unit: FloatArray) -> bool:
    """Tell whether a vector is along a direction, either way, or 0."""
    return bool(abs(cross(vector, unit)) <= SQUARE * math.hypot(*vector))
