"""Buoyancy and drag by the liquids of zones.

The submerged part of a body has the area A, its centroid at c from the centre of mass, and the second moment J about
that centre. With the liquid's density ρ and gravity g, and the velocity w = v + ω × c − current of the body at c,

    buoyancy: F = −ρ A g                           at the centroid,
    drag:     f = −κ (v + ω × r − current), κ = k + c |w|, on each element of the submerged area at r.

The drag sums to F = −κ A w and the torque −κ (c × A (v − current) + J ω): exact for linear drag, and for quadratic drag
with the speed at the centroid. An engine that cannot evaluate the drag within a step takes it by the linearly implicit
Euler step, with κ held constant: it is stable at any step, and terminal velocities are exact.
"""

import math
from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.common.clipped_area import EDGE_SIZE, RELATIVE_GAP, clip, edge_capacity, moments, write_outline
from sandbox.engines.common.kernel import bare_kernel
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.fixed import mask_of
from sandbox.scene.geometry.shapes import pieces_of

Rates = tuple[FloatArray, FloatArray]
"""Velocity (N, 2), m/s, and spin (N,), rad/s"""
Loads = tuple[FloatArray, FloatArray]
"""Forces (N, 2), N, and torques (N,), N·m"""


class LiquidColumns(NamedTuple):
    """L liquids, in Q convex parts with sides along lines n·p = depth, inside where n·p is smaller."""

    liquid: IntArray
    """(Q,) index of the liquid of each part"""
    first: IntArray
    """(Q + 1,) row of the first side of each part"""
    side: FloatArray
    """(E, 3) unit normal (x, y), outwards, and depth, m"""
    layers: IntArray
    """(L,) collision layers in which each liquid acts, as bits"""


@bare_kernel
def submerge(
    liquids: LiquidColumns,
    body: IntArray,
    first: IntArray,
    corner: FloatArray,
    radius: FloatArray,
    middle: FloatArray,
    bounding_radius: FloatArray,
    pose: FloatArray,
    layer: IntArray,
    edges: FloatArray,
    clipped: FloatArray,
    out: FloatArray,
) -> None:
    """Write the area, m², first moments, m³, and second moment, m⁴, of N bodies in L liquids, about their centres.

    Args:
        liquids: the liquids.
        body: (S,) of `Shapes`, as the next five arguments.
        first: (S + 1,).
        corner: (V, 2) m.
        radius: (S,) m.
        middle: (S, 2) m.
        bounding_radius: (S,) m.
        pose: (N, 3) m and rad.
        layer: (N,) collision layer of each body; −1 for those on which no liquid acts.
        edges: (E, 9), scratch.
        clipped: likewise.
        out: (N, L, 4), written.
    """
    out[:] = 0.0
    for s in range(len(body)):
        i = body[s]
        if layer[i] < 0 or not math.isfinite(pose[i, 0] + pose[i, 1] + pose[i, 2]):
            continue
        cos, sin, reach = math.cos(pose[i, 2]), math.sin(pose[i, 2]), bounding_radius[s]
        mx, my = cos * middle[s, 0] - sin * middle[s, 1], sin * middle[s, 0] + cos * middle[s, 1]
        for q in range(len(liquids.liquid)):
            wet = liquids.liquid[q]
            if not (liquids.layers[wet] >> layer[i]) & 1:
                continue
            is_apart = False
            for e in range(liquids.first[q], liquids.first[q + 1]):
                nx, ny = liquids.side[e, 0], liquids.side[e, 1]
                is_apart = is_apart or nx * (pose[i, 0] + mx) + ny * (pose[i, 1] + my) - liquids.side[e, 2] >= reach
            if is_apart:
                continue
            count = write_outline(corner, first[s], first[s + 1], radius[s], cos, sin, edges)
            for e in range(liquids.first[q], liquids.first[q + 1]):
                nx, ny = liquids.side[e, 0], liquids.side[e, 1]
                depth = liquids.side[e, 2] - nx * pose[i, 0] - ny * pose[i, 1]
                if nx * mx + ny * my - depth <= -reach:
                    continue  # all of the piece is inside this side
                count = clip(edges, count, nx, ny, depth, RELATIVE_GAP * reach, clipped)
                edges, clipped = clipped, edges
            area, x, y, second = moments(edges, count)
            if area > 0.0:
                out[i, wet, 0] += area
                out[i, wet, 1] += x
                out[i, wet, 2] += y
                out[i, wet, 3] += second


class Liquids:
    """The liquids of a scene."""

    def __init__(self, scene: Scene) -> None:
        zones = scene.liquids
        liquids = [zone.liquid for zone in zones if zone.liquid is not None]
        parts = [(k, part.corners) for k, zone in enumerate(zones) for part in pieces_of(zone)]
        sides = []
        for _, corners in parts:
            for (ax, ay), (bx, by) in zip(corners, (*corners[1:], corners[0]), strict=True):
                length = math.hypot(bx - ax, by - ay)
                nx, ny = (by - ay) / length, (ax - bx) / length
                sides.append((nx, ny, nx * ax + ny * ay))
        self._columns = LiquidColumns(
            liquid=np.asarray([k for k, _ in parts], np.int64),
            first=np.concatenate(([0], np.cumsum([len(corners) for _, corners in parts]))).astype(np.int64),
            side=np.asarray(sides, np.float64).reshape(-1, 3),
            layers=np.asarray([mask_of(zone.layers, scene.layers) for zone in zones], np.int64),
        )
        self._sides = max((len(corners) for _, corners in parts), default=0)
        self._own_gravity = [zone.gravity for zone in zones]
        self._density: FloatArray = np.asarray([each.density for each in liquids], np.float64)
        self._linear: FloatArray = np.asarray([each.linear_drag for each in liquids], np.float64)
        self._quadratic: FloatArray = np.asarray([each.quadratic_drag for each in liquids], np.float64)
        self._current: FloatArray = np.asarray([each.current for each in liquids], np.float64).reshape(-1, 2)
        self._scratch: tuple[FloatArray, FloatArray] = np.empty((0, EDGE_SIZE)), np.empty((0, EDGE_SIZE))

    def __len__(self) -> int:
        return len(self._density)

    @property
    def has_drag(self) -> bool:
        """Whether a liquid resists motion."""
        return bool(self._linear.any() or self._quadratic.any())

    def submerged(self, bodies: Bodies, layer: IntArray, acts: BoolArray, pose: FloatArray) -> FloatArray:
        """Return area, m², first moments, m³, and second moment, m⁴, of N bodies in L liquids, (N, L, 4).

        Args:
            bodies: all.
            layer: (N,) collision layer of each.
            acts: (N,) bodies on which liquids act.
            pose: (N, 3) m and rad.
        """
        shapes = bodies.shapes
        capacity = edge_capacity(int(shapes.corners.max(initial=0)), self._sides)
        if len(self._scratch[0]) < capacity:
            self._scratch = np.empty((capacity, EDGE_SIZE)), np.empty((capacity, EDGE_SIZE))
        out: FloatArray = np.empty((len(pose), len(self), 4))
        layers = np.where(acts, layer, -1)
        columns = shapes.body, shapes.first, shapes.corner, shapes.radius, shapes.middle, shapes.bounding_radius
        submerge(self._columns, *columns, pose, layers, *self._scratch, out)
        return out

    def buoyancy(self, submerged: FloatArray, gravity: tuple[float, float]) -> Loads:
        """Return the buoyancy on N bodies, at submerged moments (N, L, 4), under the world's gravity, m/s²."""
        pull = np.asarray([gravity if own is None else own for own in self._own_gravity]).reshape(-1, 2)
        lift = -self._density[:, None] * pull  # of 1 m²
        force = np.einsum("nl,lk->nk", submerged[:, :, 0], lift)
        torque = (submerged[:, :, 1] * lift[:, 1] - submerged[:, :, 2] * lift[:, 0]).sum(axis=1)
        return force, torque

    @np.errstate(over="ignore", invalid="ignore")  # in a diverged state, which is detected next
    def resistance(self, submerged: FloatArray, rates: Rates) -> FloatArray:
        """Return κ of N bodies in L liquids, (N, L) N·s/m³, at some rates."""
        velocity, spin = rates
        size = np.where(submerged[:, :, 0] > 0.0, submerged[:, :, 0], 1.0)
        wx = velocity[:, 0, None] - self._current[:, 0] - spin[:, None] * submerged[:, :, 2] / size
        wy = velocity[:, 1, None] - self._current[:, 1] + spin[:, None] * submerged[:, :, 1] / size
        kappa: FloatArray = self._linear + self._quadratic * np.sqrt(wx * wx + wy * wy)
        return kappa

    @np.errstate(over="ignore", invalid="ignore")  # likewise
    def drag(self, submerged: FloatArray, rates: Rates, kappa: FloatArray) -> Loads:
        """Return the drag on N bodies at some rates, by the resistance κ (N, L)."""
        velocity, turn = rates[0], rates[1][:, None]
        area, sx, sy, second = np.moveaxis(kappa[:, :, None] * submerged, 2, 0)
        ux, uy = velocity[:, 0, None] - self._current[:, 0], velocity[:, 1, None] - self._current[:, 1]
        force = -np.column_stack(((area * ux - sy * turn).sum(axis=1), (area * uy + sx * turn).sum(axis=1)))
        return force, -(sx * uy - sy * ux + second * turn).sum(axis=1)

    @np.errstate(over="ignore", invalid="ignore")  # likewise
    def step_loads(
        self,
        submerged: FloatArray,
        rates: Rates,
        applied: Loads,
        inertia: Loads,
        gravity: tuple[float, float],
        h: float,
    ) -> Loads:
        """Return the mean forces and torques of the liquids on N bodies in a step of h, s.

        With the matrix D of the drag at the start, (1 + h D M⁻¹) L = −D r is solved for its mean load L, at the rates r
        that all other forces lead to: the drag at the end of the step.

        Args:
            submerged: (N, L, 4), see `submerged`.
            rates: at the start of the step.
            applied: other forces and torques, with the weight.
            inertia: inverse mass (N, 1), 1/kg, and inverse moment of inertia (N,), 1/(kg·m²).
            gravity: of the world, m/s².
            h: step, s.
        """
        force, torque = self.buoyancy(submerged, gravity)
        wet = np.flatnonzero(submerged[:, :, 0].any(axis=1))
        if not self.has_drag or not len(wet):
            return force, torque
        part, inverse_mass, inverse_moment = submerged[wet], inertia[0][wet], inertia[1][wet]
        kappa = self.resistance(part, (rates[0][wet], rates[1][wet]))
        velocity = rates[0][wet] + h * inverse_mass * (applied[0] + force)[wet]
        spin = rates[1][wet] + h * inverse_moment * (applied[1] + torque)[wet]
        pull, turn = self.drag(part, (velocity, spin), kappa)
        area, sx, sy, second = (kappa[:, :, None] * part).sum(axis=1).T
        zero = np.zeros(len(wet))
        matrix = np.stack((area, zero, -sy, zero, area, sx, -sy, sx, second), axis=1).reshape(-1, 3, 3)
        # (1 + h D M⁻¹) L = drag, for the mean load L; a body that cannot turn has an inverse moment of 0.
        inverse = np.column_stack((inverse_mass, inverse_mass, inverse_moment))
        mean = np.linalg.solve(np.eye(3) + h * matrix * inverse[:, None, :], np.column_stack((pull, turn))[:, :, None])
        force[wet] += mean[:, :2, 0]
        torque[wet] += mean[:, 2, 0]
        return force, torque
