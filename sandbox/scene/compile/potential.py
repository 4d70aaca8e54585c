"""Potential energy of springs and of attraction."""

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.joint_arrays import JointArrays, JointKind
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.forces import Attraction

ROUNDING = 1e-12
"""Tolerance of a time, as a fraction of it."""


class Potential:
    """Potential energy of springs and attraction, frame by frame.

    A spring stores ½ k (l − l₀)², a rotary spring ½ k (φ − φ₀)²; beyond the stretch F/k of its largest force F it
    stores F per unit of stretch. One that only pulls stores nothing while it is slack. An attraction a = s/(r² + ε²)
    has −m s/r where ε = 0, else −(m s/ε)·atan(ε/r), which is 0 at infinity; a pair of bodies counts once. Energy
    between two moving bodies is divided equally; that between a body and the world or a fixed body belongs to the body.
    """

    def __init__(
        self, start: Scene | Setup, bodies: Bodies, body: int | None = None, breaks: FloatArray | None = None
    ) -> None:
        """Select the springs and attractions of a scene.

        Args:
            start: scene or setup; its springs refer to the indices of its own bodies.
            bodies: bodies of `start` and those added since, which are attracted too.
            body: index of the only body whose energy counts; default: all.
            breaks: (J,) s, time at which each joint broke, inf if it did not; default: none broke.
        """
        setup = Setup.of(start)
        scene, joints = setup.scene, setup.joints
        breaks = np.full(len(joints), np.inf) if breaks is None else breaks
        kinds = (JointKind.SPRING, _stretch), (JointKind.ROTARY_SPRING, _turn)
        self._springs = [(joints.of(kind), breaks[joints.kind == kind], strain) for kind, strain in kinds]
        number = {name: k for k, name in enumerate(bodies.names)} if scene.attractions else {}
        self._attractions = [
            (each, number.get(each.toward) if isinstance(each.toward, str) else None)
            for each in scene.attractions
            if not isinstance(each.toward, str) or each.toward in number
        ]
        self._mass = np.where(bodies.fixed, 0.0, bodies.mass)
        self._fixed = bodies.fixed
        self._body = body

    @property
    def springs(self) -> bool:
        """Whether there are springs."""
        return any(len(joints) for joints, _, _ in self._springs)

    @property
    def attracts(self) -> bool:
        """Whether there is attraction."""
        return bool(self._attractions)

    def __bool__(self) -> bool:
        """Return whether there is any potential."""
        return self.attracts or self.springs

    def at(self, time: FloatArray, position: FloatArray, angle: FloatArray, present: BoolArray) -> FloatArray:
        """Return the energy in each of T frames, (T,) J.

        Args:
            time: (T,) s; broken springs store nothing.
            position: (T, N, 2) m.
            angle: (T, N) rad.
            present: (T, N) whether each body is present; removed bodies neither attract others nor load springs.
        """
        return self.of_springs(time, position, angle, present) + self.of_attraction(position, present)

    def of_springs(self, time: FloatArray, position: FloatArray, angle: FloatArray, present: BoolArray) -> FloatArray:
        """Return the energy of springs in each of T frames, (T,) J; arguments as in `at`."""
        stored = np.zeros(len(position))
        for joints, breaks, strain in self._springs:
            if len(joints):
                stiffness, stretch = joints.figures[:, 1], strain(joints, position, angle) - joints.figures[:, 0]
                stretch = np.where(joints.pulls_only, np.maximum(stretch, 0.0), np.abs(stretch))
                energy = 0.5 * stiffness * np.square(stretch)
                excess = np.maximum(stretch - joints.max_force / stiffness, 0.0)
                energy -= 0.5 * stiffness * np.square(excess)
                holds = both_present(joints, present) & ~is_broken_at(breaks, time)
                stored += np.where(holds, energy, 0.0) @ self._fraction(joints.a, joints.b)
        return stored

    def of_attraction(self, position: FloatArray, present: BoolArray) -> FloatArray:
        """Return the energy of attraction in each of T frames, (T,) J; arguments as in `at`."""
        stored = np.zeros(len(position))
        with np.errstate(invalid="ignore"):  # coincident bodies: an infinite potential; nan if both signs occur
            for attraction, toward in self._attractions:
                if attraction.strength:
                    stored += self._attracted(attraction, toward, position, present)
        return stored

    def _attracted(
        self, attraction: Attraction, toward: int | None, position: FloatArray, present: BoolArray
    ) -> FloatArray:
        attracted = np.flatnonzero(self._mass)
        if toward is None:
            centre = np.asarray(attraction.toward, dtype=np.float64)
            fraction = np.ones(len(attracted)) if self._body is None else (attracted == self._body).astype(np.float64)
            counts = present[:, attracted]
        else:
            attracted = attracted[attracted != toward]
            centre = position[:, toward, None]
            fraction = self._fraction(np.full(len(attracted), toward), attracted)
            counts = present[:, attracted] & present[:, toward, None]
        counts = counts & (fraction > 0.0)
        away = position[:, attracted] - centre
        distance, epsilon = np.hypot(away[..., 0], away[..., 1]), attraction.softening
        with np.errstate(divide="ignore"):
            depth = np.arctan2(epsilon, distance) / epsilon if epsilon > 0.0 else 1.0 / distance
        return np.asarray(np.where(counts, -attraction.strength * depth, 0.0) @ (self._mass[attracted] * fraction))

    def _fraction(self, a: IntArray, b: IntArray) -> FloatArray:
        """Return the fraction of the energy of each pair that counts, (K,)."""
        if self._body is None:
            return np.ones(len(b))
        first, second = (a >= 0) & ~self._fixed[a], ~self._fixed[b]
        counted = ((a == self._body) & first).astype(np.float64) + ((b == self._body) & second)
        return np.asarray(counted / np.maximum(first.astype(np.float64) + second, 1.0))


def both_present(joints: JointArrays, present: BoolArray) -> BoolArray:
    """Return which joints still have both bodies, (T, J), from the presence of bodies, (T, N)."""
    return np.asarray(present[:, joints.b] & (present[:, joints.a] | (joints.a < 0)))


def is_broken_at(breaks: FloatArray, time: FloatArray) -> BoolArray:
    """Return which joints have broken by each of some times, (T, J).

    Args:
        breaks: (J,) s, inf for joints that do not break.
        time: (T,) s. Times of frames are rounded sums: a break within rounding error of a time has happened by then.
    """
    return np.asarray(breaks * (1.0 - ROUNDING) <= time[:, None])


def turned_by(joints: JointArrays, angle: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the angles of the first and second bodies of joints, (T, J) rad each; the world's is 0."""
    return np.where(joints.a >= 0, angle[:, joints.a], 0.0), angle[:, joints.b]


def _stretch(joints: JointArrays, position: FloatArray, angle: FloatArray) -> FloatArray:
    first, second = joints.ends(position, angle)
    return np.asarray(np.hypot(*np.moveaxis(second - first, 2, 0)))


def _turn(joints: JointArrays, _: FloatArray, angle: FloatArray) -> FloatArray:
    first, second = turned_by(joints, angle)
    return np.asarray(second - first)
