"""Seeds: the same scene with other chances."""

from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import from_document
from sandbox.scene.scene import Scene

CHANCES = ("position", "velocity", "lifetime")
"""What of a body may come from the seed."""


def seeded(scene: Scene, seed: int) -> Scene:
    """Return a scene with another seed.

    Raises:
        SceneError: the seed is out of range, or what it lays out is no sound scene.
    """
    return from_document(to_document(scene), "<scene>", [("world.seed", seed)])


def same_chances(a: Scene, b: Scene) -> bool:
    """Tell whether two scenes that differ in their seed start alike, bit for bit."""
    return all(getattr(a.bodies, key).tobytes() == getattr(b.bodies, key).tobytes() for key in CHANCES)


def is_random(scene: Scene) -> bool:
    """Tell whether anything in a scene depends on its seed."""
    return not same_chances(scene, seeded(scene, scene.world.seed ^ 1))
