"""Interface of analytic solutions, and the facts about a scene that all of them need."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol, Self

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.scene.compile.ballistics import free_flight
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.contacts import ContactMatrix, contact_matrix
from sandbox.scene.compile.demands import AIR, Demand, demands
from sandbox.scene.compile.joint_arrays import WORLD, JointArrays, JointKind
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.fixed import Plane
from sandbox.scene.description.world import World
from sandbox.trajectory import ContactEvent

__all__ = ["free_flight", "unsupported_reason"]


TOUCH_TOLERANCE = 1e-9
"""m: a clearance or overlap up to this counts as contact."""
PARALLEL_SINE = 1e-12
"""Directions whose sine is below this count as parallel, and numbers whose relative difference is below it as equal:
rounding.
"""


class Anchor(NamedTuple):
    """Only joint of a body, which connects it to a fixed point."""

    kind: JointKind
    figures: FloatArray
    """(3,) parameters by kind"""
    place: FloatArray
    """(2,) m, anchor in the world"""
    arm: FloatArray
    """(2,) m, anchor in the frame of the body, from its centre of mass"""


@dataclass(frozen=True, eq=False)
class SceneFacts:
    """Scene, and facts derived from it."""

    scene: Scene
    bodies: Bodies
    matrix: ContactMatrix
    joints: JointArrays
    thrust: BoolArray
    """(N,) whether a thrust, a tyre or a drive acts on the body, or it is kinematic"""

    @classmethod
    def of(cls, scene: Scene) -> Self:
        """Derive the facts of a scene."""
        bodies = scene.bodies
        return cls(scene, bodies, contact_matrix(scene), scene.joint_arrays, thrust_on(scene, bodies))

    @property
    def world(self) -> World:
        """World of the scene."""
        return self.scene.world

    @property
    def gravity(self) -> FloatArray:
        """Gravity, (2,) m/s²."""
        return np.asarray(self.world.gravity, dtype=np.float64)

    @property
    def has_no_air(self) -> bool:
        """Whether no force depends on velocity: neither drag nor lift nor damping."""
        return not demands(self.scene) & AIR

    def moves_freely(self, number: int) -> bool:
        """Return whether a body can move, cannot collide, and has no thrust."""
        return bool(not (self.bodies.fixed[number] or self.matrix.touches[number] or self.thrust[number]))

    def only_plane(self) -> Plane | None:
        """Return the plane if it is the only static object, otherwise None."""
        alone = len(self.scene.fixed) == len(self.scene.planes) == len(self.scene.layers) == 1
        return self.scene.planes[0] if alone else None

    def anchor(self, number: int) -> Anchor | None:
        """Return the only joint of a body, or None.

        It counts if it neither breaks, gives way nor slackens, and connects the body to the world or a static body.
        """
        found = np.flatnonzero((self.joints.a == number) | (self.joints.b == number))
        if len(found) != 1:
            return None
        k = int(found[0])
        if math.isfinite(self.joints.strength[k]) or self.joints.is_limited[k] or self.joints.pulls_only[k]:
            return None
        joint = self.joints.some(np.asarray([k]))
        (start,), (end,) = joint.ends(self.bodies.position, self.bodies.angle)
        kind, figures = JointKind(int(joint.kind[0])), joint.figures[0]
        if int(joint.b[0]) == number:
            other, position, arm = int(joint.a[0]), start, joint.anchor_b[0]
        else:
            other, position, arm = int(joint.b[0]), end, joint.anchor_a[0]
        if other != WORLD and not self.bodies.fixed[other]:
            return None
        return Anchor(kind, figures, position, arm)


def thrust_on(scene: Scene, bodies: Bodies) -> BoolArray:
    """Return on which bodies a thrust, a tyre or a drive acts, or which are kinematic, (N,)."""
    movers = [each.body for each in (*scene.thrusts, *scene.tyres, *scene.drives)]
    return bodies.kinematic | np.isin(bodies.names, movers) if movers else bodies.kinematic


def direction(vector: FloatArray) -> FloatArray:
    """Return the unit vector of a vector other than 0, (2,)."""
    # Scaled first: the square of a very long or short vector would leave the range of doubles.
    scaled = vector / np.abs(vector).max()
    return np.asarray(scaled / math.hypot(*scaled))


def normal_of(plane: Plane) -> FloatArray:
    """Return the unit normal of a plane, (2,)."""
    return direction(np.asarray(plane.normal))


def perpendicular(unit: FloatArray) -> FloatArray:
    """Return a unit vector rotated by −90°, (2,): for a normal that points up, it points to the right."""
    return np.asarray([unit[1], -unit[0]])


def cross(a: FloatArray, b: FloatArray) -> float:
    """Return the z component of a × b."""
    return float(a[0] * b[1] - a[1] * b[0])


def parallel(vector: FloatArray, unit: FloatArray) -> bool:
    """Return whether a vector is parallel or antiparallel to a direction, or 0."""
    return bool(abs(cross(vector, unit)) <= PARALLEL_SINE * math.hypot(*vector))


class BodyMotion(NamedTuple):
    """Motion of one body at T times, or of N bodies."""

    position: FloatArray
    """(T, 2) or (T, N, 2) m"""
    velocity: FloatArray
    """of the same shape, m/s; after the impact at the time of an impact"""
    angle: FloatArray
    """(T,) or (T, N) rad"""
    spin: FloatArray
    """of the same shape, rad/s"""


class BodySolution(Protocol):
    """Motion of one body that neither collides with a moving body nor is joined to one."""

    @property
    def name(self) -> str:
        """Name of the motion."""

    def at(self, time: FloatArray) -> BodyMotion:
        """Return the motion at T times."""

    def contacts(self, until: float, shortest: float, /) -> list[ContactEvent]:
        """Return the contacts up to a time, s.

        Args:
            until: end of the sums of impulses, s.
            shortest: s; from the first flight on that would be shorter, contacts are one row that lasts.
        """


class CoupledSolution(Protocol):
    """Motion of all bodies that collide with each other."""

    @property
    def name(self) -> str:
        """Name of the motion."""

    def at(self, time: FloatArray) -> BodyMotion:
        """Return the motion of all N bodies at T times."""

    def contacts(self, until: float, /) -> list[ContactEvent]:
        """Return the contacts up to a time, s, which is the end of the sums of impulses."""


Recogniser = Callable[[SceneFacts, int], BodySolution | None]
"""Returns the solution of a body if the scene alone guarantees it from start to end, otherwise None."""
Assembler = Callable[[SceneFacts], CoupledSolution | None]
"""Returns the solution of all bodies if the scene alone guarantees it from the start, otherwise None."""


def unsupported_reason(scene: Scene) -> str | None:
    """Return the reason why free flight in a scene has no closed form, or None if it has one."""
    if scene.world.quadratic_drag > 0:
        return "world.quadratic_drag couples x and y: the flight has no closed form"
    if scene.world.has_damping and Demand.LIFT in demands(scene):
        return "world.damping slows the spins on which lift depends: the flight has no closed form"
    if scene.attractions:
        return "an attraction acts on every body: the flight has no closed form here"
    return None
