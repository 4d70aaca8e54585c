"""Orientation of whole scenes: starts that are rotated with gravity and everything else, and runs rotated back.

Motion does not depend on the orientation of a scene. Engines do: the order in which a solver treats the contacts of a
stack follows from bounding boxes along the axes, and rounding is symmetric only along them.
"""

import math
from dataclasses import replace

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.measure.starts import GOLDEN_RATIO
from sandbox.scene.compile.scene import Scene
from sandbox.scene.geometry.vectors import rotate
from sandbox.trajectory import Trajectory

ROTATED_TABLES = frozenset(
    {"planes", "walls", "boxes", "capsules", "polygons", "compounds", "stacks", "balls", "grids"}
)
"""Tables whose elements `rotated` rotates."""
OTHER_FIELDS = frozenset({"title", "about", "world", "solver", "play", "contact_models", "materials", "pairs"})
"""Fields of a scene that do not depend on its orientation, except for those of the world."""


def orientation(scene: Scene, number: int) -> float:
    """Return the angle by which a start is rotated as a whole, rad.

    Even starts are, by angles that divide the circle evenly; odd ones are not, as levels of games are upright. Scenes
    of balls only are not, because the limits of engines do not depend on it there (docs/results/limits.md).

    Args:
        scene: the scene.
        number: number of the start; 0 is that of the scene.
    """
    if number % 2 or number == 0 or scene.bodies.round.all() or not _is_rotatable(scene):
        return 0.0
    return 2.0 * math.pi * (number * GOLDEN_RATIO % 1.0)


def _is_rotatable(scene: Scene) -> bool:
    """Return whether `rotated` covers everything that a scene has."""
    world, known = scene.world, ROTATED_TABLES | OTHER_FIELDS
    is_open = world.bounds is None and world.wind == (0.0, 0.0)
    return is_open and not any(getattr(scene, name) for name in type(scene).model_fields if name not in known)


def rotated(scene: Scene, angle: float) -> Scene:
    """Return a scene rotated about the origin: bodies with their velocities, planes, walls, and gravity.

    Args:
        scene: scene with the elements of `ROTATED_TABLES` only.
        angle: rad, counter-clockwise.
    """
    bodies = scene.bodies

    def turned(vector: tuple[float, float]) -> tuple[float, float]:
        x, y = _turned(np.array(vector), angle).tolist()
        return x, y

    planes = [
        each.model_copy(update={"point": turned(each.point), "normal": turned(each.normal)}) for each in scene.planes
    ]
    walls = [each.model_copy(update={"points": tuple(map(turned, each.points))}) for each in scene.walls]
    world = scene.world.model_copy(update={"gravity": turned(scene.world.gravity)})
    found = scene.model_copy(update={"world": world, "planes": tuple(planes), "walls": tuple(walls)})
    return found.started_from(
        replace(
            bodies,
            position=_turned(bodies.position, angle),
            velocity=_turned(bodies.velocity, angle),
            angle=bodies.angle + np.where(bodies.round, 0.0, angle),
        )
    )


def rotated_run(run: Trajectory, scene: Scene, angle: float) -> Trajectory:
    """Return a run rotated about the origin.

    Args:
        run: run of the scene.
        scene: the scene, in any orientation.
        angle: rad, counter-clockwise.
    """
    return replace(
        run,
        position=_turned(run.position, angle),
        velocity=_turned(run.velocity, angle),
        angle=run.angle + np.where(scene.bodies.round, 0.0, angle),
        contact_point=_turned(run.contact_point, angle),
        contact_normal=_turned(run.contact_normal, angle),
        contact_impulse=_turned(run.contact_impulse, angle),
    )


def _turned(vectors: FloatArray, angle: float) -> FloatArray:
    """Return vectors, (…, 2), rotated by an angle, rad."""
    x, y = rotate(vectors[..., 0], vectors[..., 1], np.array(math.cos(angle)), np.array(math.sin(angle)))
    return np.stack((x, y), axis=-1)
