"""The field of a running scene: attractions, thrusts, liquids and tyres, for engines that evaluate forces."""

import math

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.body_store import BodyStore
from sandbox.engines.common.geometry import length_and_direction, rotate
from sandbox.engines.common.kernel import bare_kernel
from sandbox.engines.forces.attraction import pull
from sandbox.engines.forces.liquid import Liquids, Loads
from sandbox.engines.forces.thrust import ThrustColumns, load
from sandbox.engines.forces.tyre import TyreLoads, Tyres
from sandbox.scene.compile.joint_arrays import WORLD
from sandbox.scene.geometry.shapes import geometry_of

_pull, _load = bare_kernel(pull), bare_kernel(load)


@bare_kernel
def add_attraction(
    pose: FloatArray,
    target: IntArray,
    position: FloatArray,
    strength: FloatArray,
    softening: FloatArray,
    inverse_mass: FloatArray,
    out: FloatArray,
) -> None:
    """Add the accelerations of N bodies by A attractions, and of the attracting bodies by the reactions. Costs A·N.

    The mass of the attracting body affects only its own acceleration, by the reaction. A body at the position of its
    target gets no acceleration.

    Args:
        pose: (N, 2 or 3) m.
        target: (A,) index of the attracting body, or −1 for a fixed position.
        position: (A, 2) m, fixed positions; not read where there is a target body.
        strength: (A,) m³/s².
        softening: (A,) m.
        inverse_mass: (N,) 1/kg; bodies with 0 are not accelerated.
        out: (N, 2 or 3) m/s², added to.
    """
    for k in range(len(target)):
        own = target[k]
        x, y = (pose[own, 0], pose[own, 1]) if own >= 0 else (position[k, 0], position[k, 1])
        for i in range(len(pose)):
            if i == own or inverse_mass[i] == 0.0:
                continue
            distance, nx, ny = length_and_direction(x - pose[i, 0], y - pose[i, 1])
            if distance == 0.0:
                continue
            acceleration = _pull(strength[k], softening[k], distance)
            out[i, 0] += acceleration * nx
            out[i, 1] += acceleration * ny
            if own >= 0:
                reaction = acceleration * (inverse_mass[own] / inverse_mass[i])
                out[own, 0] -= reaction * nx
                out[own, 1] -= reaction * ny


@bare_kernel
def thrust_on_body(
    thrusts: ThrustColumns, k: int, level: float, time: float, angle: float
) -> tuple[float, float, float]:
    """Return the force (x, y), N, and torque, N·m, of the k-th thrust at a time of the scene, s.

    Args:
        thrusts: all.
        k: index of the thrust.
        level: fraction of the force that acts.
        time: s.
        angle: of the body, rad.
    """
    now = level if thrusts.begin[k] <= time < thrusts.end[k] else 0.0
    x, y, torque = _load(now, thrusts.force[k, 0], thrusts.force[k, 1], thrusts.point[k, 0], thrusts.point[k, 1])
    world_x, world_y = rotate(x, y, math.cos(angle), math.sin(angle))
    return world_x, world_y, torque


@bare_kernel
def add_thrusts(
    thrusts: ThrustColumns,
    level: FloatArray,
    time: float,
    pose: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
    out: FloatArray,
) -> None:
    """Add the accelerations of N bodies by thrusts.

    Args:
        thrusts: T thrusts.
        level: (T,) fraction of each force that acts.
        time: of the scene, s.
        pose: (N, 3) m and rad.
        inverse_mass: (N,) 1/kg.
        inverse_moment: (N,) 1/(kg·m²).
        out: (N, 3) m/s² and rad/s², added to.
    """
    for k in range(len(thrusts.body)):
        i = thrusts.body[k]
        x, y, torque = thrust_on_body(thrusts, k, level[k], time, pose[i, 2])
        out[i, 0] += inverse_mass[i] * x
        out[i, 1] += inverse_mass[i] * y
        out[i, 2] += inverse_moment[i] * torque


class ForceField:
    """Attractions, thrusts, liquids and tyres of a running scene. A call evaluates the attractions and thrusts."""

    def __init__(self, store: BodyStore) -> None:
        self._store, self._began = store, store.setup.time
        scene, bodies = store.scene, store.bodies
        number = {name: k for k, name in enumerate(bodies.names)}
        # Bodies that left the scene before an engine switch neither attract nor have thrusts.
        attractions = [a for a in scene.attractions if not isinstance(a.toward, str) or a.toward in number]
        which = [k for k, thrust in enumerate(scene.thrusts) if thrust.body in number]
        thrusts = [scene.thrusts[k] for k in which]
        toward = [a.toward for a in attractions]
        self._target: IntArray = np.asarray([number[t] if isinstance(t, str) else WORLD for t in toward], np.int64)
        positions = [(0.0, 0.0) if isinstance(t, str) else t for t in toward]
        self._position: FloatArray = np.asarray(positions, np.float64).reshape(-1, 2)
        self._strength: FloatArray = np.asarray([a.strength for a in attractions], np.float64)
        self._softening: FloatArray = np.asarray([a.softening for a in attractions], np.float64)
        self.thrust_indices: IntArray = np.asarray(which, np.int64)
        """(T,) index of each thrust in the scene"""
        body = np.asarray([number[t.body] for t in thrusts], np.int64)
        centres = [geometry_of(bodies.elements[bodies.element[n]]).centre for n in body.tolist()]
        points = [(t.point[0] - c[0], t.point[1] - c[1]) for t, c in zip(thrusts, centres, strict=True)]
        self.thrusts = ThrustColumns(
            body=body,
            point=np.asarray(points, np.float64).reshape(-1, 2),
            force=np.asarray([t.force for t in thrusts], np.float64).reshape(-1, 2),
            begin=np.asarray([t.begin for t in thrusts], np.float64),
            end=np.asarray([math.inf if t.end is None else t.end for t in thrusts], np.float64),
        )

        self.liquids = Liquids(scene) if scene.liquids else None
        """liquids of zones; None without any"""
        self.tyres = Tyres(scene, bodies) if scene.tyres else None
        """tyres; None without any"""

    @property
    def empty(self) -> bool:
        """Whether there are no attractions and no thrusts."""
        return not (len(self._target) or len(self.thrusts.body))

    def __call__(self, time: float, x: FloatArray) -> FloatArray:
        """Return the accelerations (N, D) at a time, s, in a state (2, N, D), m/s² and rad/s²."""
        store = self._store
        out: FloatArray = np.zeros_like(x[1])
        if len(self._target):
            is_present = np.append(store.present, True)[self._target]  # the world, −1, finds the last
            some = (
                self._target[is_present],
                self._position[is_present],
                self._strength[is_present],
                self._softening[is_present],
            )
            add_attraction(x[0], *some, store.inverse_mass, out[: len(store.inverse_mass)])
        self._add_thrusts(time, x, out)
        return out

    @property
    def attracting(self) -> bool:
        """Whether there are attractions."""
        return len(self._target) > 0

    @property
    def thrusting(self) -> bool:
        """Whether there are thrusts."""
        return len(self.thrusts.body) > 0

    def by_liquids(self, time: float, x: FloatArray) -> FloatArray:
        """Return the accelerations (N, D) by liquids in a state (2, N, D), m/s² and rad/s²."""
        del time
        store, liquids = self._store, self.liquids
        assert liquids is not None
        turns = x.shape[2] == 3
        pose = x[0] if turns else np.column_stack((x[0], store.angle))
        submerged = self._submerged(pose)
        force, torque = liquids.buoyancy(submerged, store.scene.world.gravity)
        if liquids.has_drag:
            rates = x[1, :, :2], x[1, :, 2] if turns else np.zeros(len(pose))
            pull, turn = liquids.drag(submerged, rates, liquids.resistance(submerged, rates))
            force, torque = force + pull, torque + turn
        linear = force * store.inverse_mass[:, None]
        return np.column_stack((linear, torque * store.inverse_moment)) if turns else linear

    def liquid_loads(self, applied: Loads, h: float) -> Loads:
        """Return the mean forces, N, and torques, N·m, of liquids on all bodies in a step of h, s, from the present.

        Args:
            applied: other forces, with the weight, and torques.
            h: step, s.
        """
        store, liquids = self._store, self.liquids
        assert liquids is not None
        submerged = self._submerged(np.column_stack((store.position, store.angle)))
        rates, inertia = (store.velocity, store.angular_velocity), (store.inverse_mass[:, None], store.inverse_moment)
        return liquids.step_loads(submerged, rates, applied, inertia, store.scene.world.gravity, h)

    def tyre_loads(self, pose: FloatArray, rate: FloatArray, h: float) -> TyreLoads:
        """Return the mean loads of the tyres in a step of h, s, on their bodies.

        Args:
            pose: (N, 3) m and rad, of all bodies.
            rate: (N, 3) m/s and rad/s at the end of the step, without tyres.
            h: s.
        """
        store, tyres = self._store, self.tyres
        assert tyres is not None
        inverse = np.column_stack((store.inverse_mass, store.inverse_moment))[tyres.bodies]
        return tyres.loads(store.tyre_levels, pose[tyres.bodies], rate[tyres.bodies], inverse, h)

    def _submerged(self, pose: FloatArray) -> FloatArray:
        """Return the submerged moments (N, L, 4) of bodies at poses (N, 3); liquids act on those that forces move."""
        assert self.liquids is not None
        store = self._store
        return self.liquids.submerged(store.bodies, store.layer, store.inverse_mass > 0.0, pose)

    def by_thrusts(self, time: float, x: FloatArray) -> FloatArray:
        """Return the accelerations (N, D) by thrusts alone, m/s² and rad/s²."""
        out: FloatArray = np.zeros_like(x[1])
        self._add_thrusts(time, x, out)
        return out

    def _add_thrusts(self, time: float, x: FloatArray, out: FloatArray) -> None:
        """Add the accelerations by thrusts."""
        if self.thrusting:
            store = self._store
            level, inverse = store.throttles[self.thrust_indices], (store.inverse_mass, store.inverse_moment)
            add_thrusts(self.thrusts, level, self._began + time, x[0], *inverse, out)
