"""What Box2D and its binding require of a scene: joints, sizes and shapes. Nothing here imports the binding."""

import math
from collections.abc import Iterator
from functools import cache
from importlib.util import find_spec

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.engines.box2d_adapter.limits import (
    FARTHEST_LENGTHS,
    FASTEST_LENGTHS,
    MAX_CORNERS,
    MAX_TURN,
    SLOP_LENGTHS,
    scale_for,
)
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.demands import Demand
from sandbox.scene.compile.joint_arrays import JointArrays, JointKind
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.fixed import Post, Wall
from sandbox.scene.description.world import Settings
from sandbox.scene.geometry.shapes import UNTURNABLE

MERGED = {JointKind.MOTOR: "motor", JointKind.ROTARY_LIMIT: "rotary limit"}
"""Joints that Box2D has as part of a pivot only"""


@cache
def is_installed() -> bool:
    """Return whether the binding is installed."""
    return find_spec("pyb2d3") is not None


def joint_faults(joints: JointArrays) -> Iterator[str]:
    """Yield why joints are not supported."""
    joints = joints.some(~joints.is_compound)
    pairs = list(zip(joints.a.tolist(), joints.b.tolist(), joints.kind.tolist(), strict=True))
    for k, name in enumerate(joints.names):
        kind, pair = JointKind(int(joints.kind[k])), (int(joints.a[k]), int(joints.b[k]))
        if kind in MERGED:
            pivot = *pair, JointKind.PIVOT
            if pairs.count(pivot) != 1 or pairs.count((*pair, kind)) != 1:
                yield f"{name}: Box2D has a {MERGED[kind]} as part of a pivot only, one of each between two bodies"
            elif math.isfinite(joints.strength[pairs.index(pivot)]) or math.isfinite(joints.strength[k]):
                yield f"{name}: a {MERGED[kind]} that breaks, or whose pivot breaks, is not supported"
        if kind == JointKind.ROTARY_LIMIT and not joints.figures[k, 1] - joints.figures[k, 0] < 2.0 * math.pi:
            yield f"{name}: a range of a whole turn or more is not supported, as Box2D knows angles modulo 2π"


def rolling_faults(setup: Setup) -> Iterator[str]:
    """Yield the contacts with rolling resistance at which Box2D takes another radius than that of a ball.

    It multiplies the coefficient by the larger radius of the two shapes, those of posts, walls and round corners too.
    """
    matrix, bodies, scene = contact_matrix(setup), setup.bodies, setup.scene
    if not matrix.rolling:
        return
    surfaces = matrix.surfaces
    resists: BoolArray = np.asarray(((surfaces.rolling > 0.0) & matrix.touching).any(axis=1))
    balls = bodies.round & matrix.touches & ~bodies.immovable
    smallest = float(np.min(bodies.radius[balls], initial=math.inf))
    for name, collider, surface in zip(scene.fixed_names, scene.fixed, surfaces.of_fixed.tolist(), strict=False):
        radius = collider.radius if isinstance(collider, Post) else 0.0
        radius = 0.5 * collider.thickness if isinstance(collider, Wall) else radius
        if radius > smallest and resists[surface]:
            yield (
                f"{name!r} has a radius of {radius:g} m, with which Box2D computes the {Demand.ROLLING} of smaller "
                f"balls, such as one of {smallest:g} m"
            )
    if bodies.all_round:
        return
    shapes = bodies.shapes
    is_rounded = (shapes.radius > 0.0) & ~bodies.round[shapes.body] & resists[surfaces.of_shape]
    for piece in np.flatnonzero(is_rounded)[:1].tolist():
        name = bodies.names[int(shapes.body[piece])]
        yield f"{name!r} has round corners or ends, to which Box2D applies {Demand.ROLLING}, as if they were balls"


def size_faults(setup: Setup, settings: Settings) -> Iterator[str]:
    """Yield what is too large or too small for Box2D's 32-bit numbers and tuned lengths."""
    assert settings.slop is not None
    if not 1e-12 < settings.slop < 1e12:
        yield f"slop {settings.slop:g} m: lengths cannot be scaled to it in 32-bit numbers; use 1e-12 to 1e12 m"
        return
    bodies, scale = setup.bodies, scale_for(settings)
    if not len(bodies):
        return
    farthest, fastest = (float(np.abs(array).max()) for array in (bodies.position, bodies.velocity))
    if not farthest * scale <= FARTHEST_LENGTHS:
        yield (
            f"a body {farthest:g} m from the origin: beyond {FARTHEST_LENGTHS / scale:g} m the spacing of 32-bit "
            f"numbers exceeds the slop, {settings.slop:g} m"
        )
    if not fastest * scale <= FASTEST_LENGTHS:
        yield f"a body at {fastest:g} m/s: the limit is {FASTEST_LENGTHS / scale:g} m/s"
    spin = float(np.abs(bodies.angular_velocity).max())
    if not spin * settings.h < MAX_TURN:
        yield f"a spin of {spin:g} rad/s: Box2D turns bodies by less than 45° in a substep; use more substeps"
    turnable = bodies.moment[bodies.moment < UNTURNABLE]  # Box2D fixes the rotation of the others
    extreme = [value for value in (*bodies.mass.tolist(), *(turnable * scale**2).tolist()) if math.isfinite(value)]
    if extreme and not 1e-25 < min(extreme) <= max(extreme) < 1e25:
        yield "masses or moments of inertia are too extreme for 32-bit numbers"
    yield from shape_faults(bodies, scale)


def shape_faults(bodies: Bodies, scale: float, of: int | None = None) -> Iterator[str]:
    """Yield which shapes of bodies, or of one body, Box2D cannot represent."""
    if bodies.round.all():
        return
    shapes = bodies.shapes
    pieces: IntArray = np.arange(len(shapes.radius)) if of is None else np.flatnonzero(shapes.body == of)
    for piece in pieces.tolist():
        corners = shapes.corner[shapes.first[piece] : shapes.first[piece + 1]]
        name = bodies.names[int(shapes.body[piece])]
        if len(corners) > MAX_CORNERS:
            yield f"{name!r} has a convex part of {len(corners)} corners; Box2D supports at most {MAX_CORNERS}"
        elif len(corners) > 2 and not _is_robust(corners * scale):
            yield f"{name!r} has corners closer than {4.0 * SLOP_LENGTHS / scale:g} m, or in line; use a smaller slop"


def _is_robust(corners: FloatArray) -> bool:
    """Return whether Box2D keeps all corners (K, 2), in its lengths, of a convex polygon.

    It merges corners that are close together, and removes those that are nearly in line with their neighbours.
    """
    before, after = np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0)
    edge = np.hypot(*(after - corners).T)
    x, y = (after - before).T
    height = np.abs(x * (corners - before)[:, 1] - y * (corners - before)[:, 0]) / np.hypot(x, y)
    return bool((edge > 4.0 * SLOP_LENGTHS).all() and (height > 2.0 * SLOP_LENGTHS).all())
