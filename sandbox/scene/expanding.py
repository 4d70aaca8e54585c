"""Expanding: what of a scene stands for other parts of it, written out: tables, a ground, those who play on it."""

from collections.abc import Iterator

from sandbox.scene.artillery import expanding as artillery
from sandbox.scene.billiards import expanding as billiards
from sandbox.scene.faults import Location
from sandbox.scene.model import Scene
from sandbox.scene.pinball import expanding as pinball
from sandbox.scene.pinball import faulting


def faults_of(scene: Scene) -> Iterator[tuple[Location, str]]:
    """Yield why presets of a scene stand for nothing."""
    if scene.billiards is not None and scene.pinball is not None:
        yield ("pinball",), "stands beside [billiards]; a scene is one table or the other"
    for preset in (billiards, faulting, artillery):
        yield from preset.faults_of(scene)


def expanded(scene: Scene) -> Scene:
    """Return the scene of primitives that one with sound presets stands for; another as it is."""
    return artillery.expanded(pinball.expanded(billiards.expanded(scene)))
