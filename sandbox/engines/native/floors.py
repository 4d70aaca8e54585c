"""Floors: which scenes are played on one, and what pymunk cannot model there. Imports no pymunk."""

from collections.abc import Iterator

from sandbox.engines.floor.level import unlevel
from sandbox.scene import demands
from sandbox.scene.bodies import Bodies
from sandbox.scene.model import Scene


def on_floor(scene: Scene) -> bool:
    """Tell whether a scene has what only balls on a floor have; of one that asks for nothing of it, they are discs."""
    return (scene.surface is not None or bool(scene.pockets)) and demands.on_floor(scene)


def of_floors(scene: Scene, bodies: Bodies | None = None) -> Iterator[str]:
    """Say what a scene on a floor has, with its own bodies or with those it has come to have, that is not modelled."""
    bodies = scene.bodies if bodies is None else bodies
    world = scene.world
    yield from unlevel(scene, bodies)
    if world.linear_drag or world.quadratic_drag:
        yield "it does not model drag on a floor"
    if len(scene.links) or scene.attractions or scene.thrusts or scene.drives:
        yield "it does not model joints, attraction, thrusts or drives on a floor"
    if not bodies.round.all():
        yield "it does not model bodies other than balls on a floor"
