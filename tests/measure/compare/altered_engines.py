"""pymunk under another name, with an altered world or without some features, in the place of other engines."""

from dataclasses import dataclass, replace
from typing import Any

import pytest

from sandbox.engines import registry
from sandbox.engines.contract import Engine, Refusal, Simulation
from sandbox.engines.pymunk_adapter.engine import PymunkEngine
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.world import Settings


@dataclass(frozen=True)
class AlteredPymunk:
    """pymunk with an altered world: it converges, but to a different result."""

    name: str = "another"
    gravity: float = 1.0
    """a factor"""
    restitution: float = 1.0
    """likewise"""
    lacks: tuple[str, ...] = ()
    """features that it does not model"""

    def __getattr__(self, name: str) -> Any:
        return getattr(PymunkEngine(), name)

    def missing(self, scene: Scene, settings: Settings) -> tuple[str, ...]:
        return self.lacks or PymunkEngine().missing(scene, settings)

    def start(self, start: Scene | Setup, settings: Settings | None = None) -> Simulation:
        if self.lacks:
            raise Refusal(self.name, self.lacks, ())
        if self.gravity == self.restitution == 1.0:
            return PymunkEngine().start(start, settings)
        setup = Setup.of(start)
        scene = setup.scene
        world = scene.world.model_copy(update={"gravity": tuple(self.gravity * g for g in scene.world.gravity)})
        balls = tuple(
            b.model_copy(update={"restitution": self.restitution * (b.restitution or 0.0)}) for b in scene.balls
        )
        changed = replace(setup, scene=scene.model_copy(update={"world": world}))
        return PymunkEngine().start(replace(changed, bodies=replace(setup.bodies, elements=balls)), settings)


def install(monkeypatch: pytest.MonkeyPatch, **engines: Engine) -> None:
    """Leave only these engines in the registry."""
    for name in [*reversed(registry.ENGINES)]:  # restored in reverse order: that of the registry
        monkeypatch.delitem(registry.ENGINES, name)
    for name, engine in engines.items():
        monkeypatch.setitem(registry.ENGINES, name, engine)
