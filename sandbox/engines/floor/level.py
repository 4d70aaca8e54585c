"""Level: what no engine here models on a floor."""

from collections.abc import Iterator

import numpy as np

from sandbox.scene.bodies import Bodies
from sandbox.scene.demands import SURFACES, demands
from sandbox.scene.model import Scene


def unlevel(scene: Scene, bodies: Bodies) -> Iterator[str]:
    """Say what a scene on a floor, with bodies that may have come to it since, has that goes or meets askew."""
    if scene.world.gravity != (0.0, 0.0):
        yield "it does not model world.gravity in the plane of a floor: what slides then goes no parabola"
    if does := demands(scene) & SURFACES:
        yield f"it does not model {', '.join(sorted(does))} on a floor"
    meets = np.asarray([element.collides == "all" for element in bodies.elements], np.bool_)[bodies.element]
    if scene.surface is not None and len(np.unique(bodies.radius[meets & bodies.round])) > 1:
        yield "it does not model balls of different radii that meet on a floor: where they touch is not level"
