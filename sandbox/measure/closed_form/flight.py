"""Flight: why it may have no closed form."""

from sandbox.scene.compile.ballistics import free_flight
from sandbox.scene.scene import Scene

__all__ = ["free_flight", "why_not"]


def why_not(scene: Scene) -> str | None:
    """Return why free flight in this scene has no closed form, or None where it has one."""
    if scene.world.quadratic_drag > 0:
        return "world.quadratic_drag couples x and y: the flight has no closed form"
    if scene.attractions:
        return "an attraction draws every body: the flight has no closed form here"
    return None
