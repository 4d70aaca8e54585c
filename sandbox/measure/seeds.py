"""Seeds: the same scene with another seed of its random numbers."""

from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.document import to_document
from sandbox.scene.files.load import from_document

RANDOM_ARRAYS = ("position", "velocity", "lifetime")
"""Arrays of the bodies that can depend on the seed."""


def with_seed(scene: Scene, seed: int) -> Scene:
    """Return a scene with another seed.

    Raises:
        SceneError: the seed is out of range, or the scene is invalid with it.
    """
    return from_document(to_document(scene), "<scene>", [("world.seed", seed)])


def same_random_state(a: Scene, b: Scene) -> bool:
    """Return whether two scenes that differ in their seed start with the same bodies, bit for bit."""
    return all(getattr(a.bodies, key).tobytes() == getattr(b.bodies, key).tobytes() for key in RANDOM_ARRAYS)


def is_random(scene: Scene) -> bool:
    """Return whether the bodies of a scene depend on its seed."""
    return not same_random_state(scene, with_seed(scene, scene.world.seed ^ 1))
