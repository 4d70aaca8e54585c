"""Restrictions of scenes with a surface, and the pockets at given positions."""

from collections.abc import Iterator

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.demands import SURFACES, Demand, air_demands, demands
from sandbox.scene.compile.demands import on_floor as has_floor
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup


def unsupported_on_surface(setup: Setup, bodies: Bodies | None = None) -> Iterator[str]:
    """Yield the features that no engine supports on a surface, with the scene's bodies or with given ones.

    Pucks have upright sides, so that pucks of different radii collide horizontally. Balls of different radii do not.
    """
    scene, bodies = setup.scene, setup.bodies if bodies is None else bodies
    if scene.world.gravity != (0.0, 0.0):
        yield "it does not model world.gravity in the plane of a floor"
    if unmodelled := demands(setup) & SURFACES:
        yield f"it does not model {', '.join(sorted(unmodelled))} on a floor"
    collides = np.asarray([element.collides == "all" for element in bodies.elements], np.bool_)[bodies.element]
    if scene.surface is not None and bodies.spheres and len(np.unique(bodies.radius[collides & bodies.round])) > 1:
        yield "it does not model collisions of balls with different radii on a floor"


def pockets_at(scene: Scene, position: FloatArray) -> IntArray:
    """Return the index of the pocket that contains each of N centres (N, 2), m, (N,); −1 for none.

    Where pockets overlap it is the first of them.
    """
    index = np.full(len(position), -1, dtype=np.int64)
    for k, pocket in enumerate(scene.pockets):
        offset = position - np.asarray(pocket.position)
        index[(index < 0) & (np.einsum("nk,nk->n", offset, offset) < pocket.radius**2)] = k
    return index


def on_floor(start: Scene | Setup) -> bool:
    """Return whether a scene needs the motion of balls on a surface; in other scenes they are plain discs."""
    scene = start.scene if isinstance(start, Setup) else start
    return (scene.surface is not None or bool(scene.pockets)) and has_floor(start)


def unsupported_by_steppers(setup: Setup, bodies: Bodies | None = None) -> Iterator[str]:
    """Yield the features that no time-step solver supports on a surface, with the scene's bodies or with given ones."""
    scene, bodies = setup.scene, setup.bodies if bodies is None else bodies
    yield from unsupported_on_surface(setup, bodies)
    of_bodies = (Demand.GRAVITY_SCALE, bodies.scales_gravity), (Demand.SPEED_LIMITS, bool(bodies.limited.any()))
    for demand in sorted({*air_demands(scene.world, bodies), *(demand for demand, on in of_bodies if on)}):
        yield f"it does not model {demand} on a floor"
    if len(setup.joints) or scene.attractions or scene.thrusts or scene.tyres or scene.drives:
        yield "it does not model joints, attraction, thrusts, tyres or drives on a floor"
    if not bodies.round.all():
        yield "it does not model bodies other than balls on a floor"
    if bodies.kinematic.any():
        yield "it does not model kinematic bodies on a floor"
