"""Expanding: what of a scene stands for other parts of it, written out: `[billiards]`, `[terrain]`, `[artillery]`."""

from collections.abc import Iterator

from sandbox.scene.artillery import expanding as artillery
from sandbox.scene.billiards import expanding as billiards
from sandbox.scene.faults import Location
from sandbox.scene.model import Scene


def faults_of(scene: Scene) -> Iterator[tuple[Location, str]]:
    """Yield why presets of a scene stand for nothing."""
    for preset in (billiards, artillery):
        yield from preset.faults_of(scene)


def expanded(scene: Scene) -> Scene:
    """Return the scene of primitives that one with sound presets stands for; another as it is."""
    return artillery.expanded(billiards.expanded(scene))
