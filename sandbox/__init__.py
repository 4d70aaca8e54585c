"""A 2D game physics sandbox: a scene is a file, the engine is a choice, and the price of every choice is measured.

    import sandbox

    scene = sandbox.load("scenes/tutorial/bounce.toml")
    run = sandbox.run(scene, engine="pymunk", dt=0.001)
    print(run.status, run.position[-1], run.missed_contacts)

Importing the package costs nothing: each name is imported when it is first used.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sandbox.engines.exact.rolling.table import Table
    from sandbox.engines.registry import ENGINES
    from sandbox.engines.relay import start
    from sandbox.measure.compare import compare
    from sandbox.measure.play_out import play_out
    from sandbox.measure.run import run
    from sandbox.measure.shots import horizon, odds, sensitivity, windows
    from sandbox.measure.shots.spread import Spread
    from sandbox.measure.tradeoff import tradeoff
    from sandbox.recording import Recording
    from sandbox.scene.cue import Stroke
    from sandbox.scene.demands import demands
    from sandbox.scene.faults import Fault, SceneError
    from sandbox.scene.file import dumps, load, loads
    from sandbox.scene.model import Scene
    from sandbox.scene.settings import Settings
    from sandbox.trajectory import Contacts, Frame, Trajectory

__all__ = [
    "ENGINES",
    "Contacts",
    "Fault",
    "Frame",
    "Recording",
    "Scene",
    "SceneError",
    "Settings",
    "Spread",
    "Stroke",
    "Table",
    "Trajectory",
    "compare",
    "demands",
    "dumps",
    "horizon",
    "load",
    "loads",
    "odds",
    "play_out",
    "run",
    "sensitivity",
    "start",
    "tradeoff",
    "windows",
]

_HOMES = {
    "ENGINES": "sandbox.engines.registry",
    "Contacts": "sandbox.trajectory",
    "Fault": "sandbox.scene.faults",
    "Frame": "sandbox.trajectory",
    "Recording": "sandbox.recording",
    "Scene": "sandbox.scene.model",
    "SceneError": "sandbox.scene.faults",
    "Settings": "sandbox.scene.settings",
    "Spread": "sandbox.measure.shots.spread",
    "Stroke": "sandbox.scene.cue",
    "Table": "sandbox.engines.exact.rolling.table",
    "Trajectory": "sandbox.trajectory",
    "compare": "sandbox.measure.compare",
    "demands": "sandbox.scene.demands",
    "dumps": "sandbox.scene.file",
    "horizon": "sandbox.measure.shots",
    "load": "sandbox.scene.file",
    "loads": "sandbox.scene.file",
    "odds": "sandbox.measure.shots",
    "play_out": "sandbox.measure.play_out",
    "run": "sandbox.measure.run",
    "sensitivity": "sandbox.measure.shots",
    "start": "sandbox.engines.relay",
    "tradeoff": "sandbox.measure.tradeoff",
    "windows": "sandbox.measure.shots",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(importlib.import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
