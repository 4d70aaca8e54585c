"""Friction of tyres on the ground under them, seen from above: easy along the rolling direction, hard across it.

A tyre touches the ground at a point of its body. With the engine's force D and what opposes rolling, B (rolling drag
and brake), its force F = (X, Y), along the rolling direction and across it, is one of

    C = { (X, Y): D − B <= X <= D + B, X² + Y² <= grip² },

the friction circle, cut by what the axle can hold. D − B and D + B are limited to the grip first. Of these F is the one
that stops the point, or comes nearest to it: u + slip (F − D) is perpendicular to C at F, u being the velocity of the
point at the end of the step. So a rolling tyre (B = 0) has X = D and a force across of up to √(grip² − D²); a locked
one (B >= grip) slides against its velocity with the force `grip` in all directions; and F − D removes energy:

    (F − D)·u <= −slip |F − D|².

The impulse h F is limited by what stops the point within the step of h, so that a body comes to rest and stays there.
The tyres of a body are solved by projected Gauss–Seidel iterations: with K = 1/m + r²/I, the largest inverse effective
mass at the point, F ← project(F − (u + slip (F − D)) / (h K + slip)) never increases the energy that it minimizes.
"""

import math
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.geometry import rotate
from sandbox.engines.common.kernel import bare_kernel
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.scene import Scene
from sandbox.scene.geometry.shapes import geometry_of

MAX_ITERATIONS = 200
"""Iterations over the tyres in a step; a bicycle takes about 15, four tyres without slip about 50"""

CONVERGED = 1e-13
"""Change of a force in an iteration, as a fraction of its size, below which it has converged: rounding"""


class TyreColumns(NamedTuple):
    """Y tyres of T bodies."""

    row: IntArray
    """(Y,) row of the body of each tyre among the T bodies"""
    point: FloatArray
    """(Y, 2) m, where it touches the ground, in the body's frame about its centre of mass"""
    angle: FloatArray
    """(Y,) rad, rolling direction in the body's frame"""
    grip: FloatArray
    """(Y,) N, largest force"""
    slip: FloatArray
    """(Y,) m/(N·s), speed at which the point slides per force"""
    rolling_drag: FloatArray
    """(Y,) N"""
    drive: FloatArray
    """(Y,) N, at full level"""
    brake: FloatArray
    """(Y,) N, at full level"""
    steer: FloatArray
    """(Y,) rad, at full level"""


class TyreLoads(NamedTuple):
    """Loads of the tyres on T bodies: force (x, y), N, and torque, N·m."""

    drive: FloatArray
    """(T, 3) by engines"""
    friction: FloatArray
    """(T, 3) by friction, which only removes energy"""


@bare_kernel
def solve_tyres(
    tyres: TyreColumns,
    level: FloatArray,
    pose: FloatArray,
    rate: FloatArray,
    inverse: FloatArray,
    h: float,
    force: FloatArray,
    drive: FloatArray,
    friction: FloatArray,
) -> None:
    """Find the mean loads of tyres in a step of h, s.

    Args:
        tyres: Y tyres of T bodies.
        level: (Y, 3) of throttle, brake and steering.
        pose: (T, 3) m and rad.
        rate: (T, 3) m/s and rad/s at the end of the step without tyres; replaced by the rates with them.
        inverse: (T, 2) inverse mass and moment of inertia; tyres of a body with mass 0 do not act.
        h: s.
        force: (Y, 2) N, along and across each tyre, written.
        drive: (T, 3) N and N·m, added to.
        friction: likewise.
    """
    force[:] = 0.0
    for iteration in range(MAX_ITERATIONS):
        is_solved = iteration > 0
        for k in range(len(tyres.row)):
            i = tyres.row[k]
            if inverse[i, 0] == 0.0 or not math.isfinite(pose[i, 2] + rate[i, 0] + rate[i, 1] + rate[i, 2]):
                continue
            cos, sin = math.cos(pose[i, 2]), math.sin(pose[i, 2])
            rx, ry = rotate(tyres.point[k, 0], tyres.point[k, 1], cos, sin)
            heading = pose[i, 2] + tyres.angle[k] + level[k, 2] * tyres.steer[k]
            cos, sin = math.cos(heading), math.sin(heading)
            grip, slip = tyres.grip[k], tyres.slip[k]
            engine, hold = level[k, 0] * tyres.drive[k], tyres.rolling_drag[k] + level[k, 1] * tyres.brake[k]
            low, high = max(min(engine - hold, grip), -grip), max(min(engine + hold, grip), -grip)
            engine = max(min(engine, grip), -grip)
            if iteration == 0:  # the engine's force is applied in full; what opposes it follows
                change_x, change_y = engine, 0.0
            else:
                vx, vy = rate[i, 0] - rate[i, 2] * ry, rate[i, 1] + rate[i, 2] * rx
                softness = h * (inverse[i, 0] + (rx * rx + ry * ry) * inverse[i, 1]) + slip
                x = force[k, 0] - (cos * vx + sin * vy + slip * (force[k, 0] - engine)) / softness
                y = force[k, 1] - (cos * vy - sin * vx + slip * force[k, 1]) / softness
                size = math.sqrt(x * x + y * y)
                part = grip / size if size > grip else 1.0
                if low <= part * x <= high:
                    x, y = part * x, part * y
                else:
                    x = low if part * x < low else high
                    across = math.sqrt(max(grip * grip - x * x, 0.0))
                    y = max(min(y, across), -across)
                change_x, change_y = x - force[k, 0], y - force[k, 1]
            force[k, 0] += change_x
            force[k, 1] += change_y
            fx, fy = rotate(change_x, change_y, cos, sin)
            torque = rx * fy - ry * fx
            rate[i, 0] += h * inverse[i, 0] * fx
            rate[i, 1] += h * inverse[i, 0] * fy
            rate[i, 2] += h * inverse[i, 1] * torque
            loads = drive if iteration == 0 else friction
            loads[i, 0] += fx
            loads[i, 1] += fy
            loads[i, 2] += torque
            size = max(abs(force[k, 0]), abs(force[k, 1]))
            is_solved = is_solved and max(abs(change_x), abs(change_y)) <= CONVERGED * size
        if is_solved:
            return


class Tyres:
    """The tyres of the bodies of a scene."""

    def __init__(self, scene: Scene, bodies: Bodies) -> None:
        which = [k for k, tyre in enumerate(scene.tyres) if tyre.body in bodies.number_of]  # others left before
        tyres = [scene.tyres[k] for k in which]
        index = np.asarray([bodies.number_of[tyre.body] for tyre in tyres], np.int64)
        self.indices: IntArray
        """(Y,) index of each tyre in the scene"""
        self.indices = np.asarray(which, np.int64)
        self.bodies: IntArray
        """(T,) indices of the bodies that have tyres"""
        self.bodies, row = np.unique(index, return_inverse=True)
        centres = [geometry_of(bodies.elements[bodies.element[n]]).centre for n in index.tolist()]
        points = [(tyre.point[0] - x, tyre.point[1] - y) for tyre, (x, y) in zip(tyres, centres, strict=True)]
        self._columns = TyreColumns(
            row.astype(np.int64),
            np.asarray(points, np.float64).reshape(-1, 2),
            *(
                np.asarray([getattr(tyre, key) for tyre in tyres], np.float64)
                for key in TyreColumns._fields[TyreColumns._fields.index("angle") :]
            ),
        )

    def loads(self, level: FloatArray, pose: FloatArray, rate: FloatArray, inverse: FloatArray, h: float) -> TyreLoads:
        """Return the mean loads on T bodies in a step of h, s.

        Args:
            level: (L, 3) of throttle, brake and steering of all tyres of the scene.
            pose: (T, 3) m and rad.
            rate: (T, 3) m/s and rad/s at the end of the step, without tyres.
            inverse: (T, 2) inverse mass, 1/kg, and inverse moment of inertia, 1/(kg·m²).
            h: s.
        """
        loads = TyreLoads(np.zeros((len(self.bodies), 3)), np.zeros((len(self.bodies), 3)))
        force = np.empty((len(self.indices), 2))
        solve_tyres(self._columns, level[self.indices], pose, rate.copy(), inverse, h, force, *loads)
        return loads
