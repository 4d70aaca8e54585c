"""What pymunk requires of a scene: drag and damping, and the size of its space. Nothing here imports pymunk."""

from sandbox.resource_limits import SPACE_SIZE
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup


def air_faults(scene: Scene, half_kick: bool) -> list[str]:
    """Return why pymunk does not support the drag and damping of a scene, with or without the setting `half_kick`."""
    world, found = scene.world, []
    if half_kick and world.has_drag:
        found.append("half_kick does not support drag")
    if half_kick and world.has_damping:
        found.append("half_kick does not support damping")
    if world.has_damping and world.has_drag:
        found.append("it does not model drag and damping together")
    if world.has_damping and scene.drives:
        found.append("it does not model drives and damping together")
    return found


def size_faults(setup: Setup) -> list[str]:
    """Return why it would take too long to create a scene's space."""
    size = len(setup.bodies) + len(setup.links)
    if size <= SPACE_SIZE.value:  # most scenes: no need to count the bodies in free flight
        return []
    size -= int((contact_matrix(setup).free & ~setup.bodies.fixed).sum())
    refusal = SPACE_SIZE.refusal("the number of bodies and joints in its pymunk space is", size)
    return [] if refusal is None else [refusal]
