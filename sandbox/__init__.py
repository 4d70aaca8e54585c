"""A 2D game physics sandbox: a scene is a file, the engine is a choice, and the price of every choice is measured.

    import sandbox

    scene = sandbox.load("bounce")  # or a file
    run = sandbox.run(scene, engine="pymunk", dt=0.001)
    print(run.status, run.position[-1], run.missed_contacts)

    kicked = sandbox.run(scene, actions=[sandbox.Impulse(time=1.0, body="ball", impulse=(2.0, 0.0))])

Importing the package costs nothing: each name is imported when it is first used.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sandbox.action import (
        ActionError,
        Drive,
        Force,
        Impulse,
        Launch,
        Move,
        Pull,
        Remove,
        Reshape,
        SetParameter,
        Spawn,
        Strike,
        Switch,
        Throttle,
        Toggle,
    )
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
    from sandbox.scene.model import Ball, Box, Capsule, Compound, Polygon, Scene
    from sandbox.scene.settings import Settings
    from sandbox.trajectory import Contacts, Frame, Trajectory

__all__ = [
    "ENGINES",
    "ActionError",
    "Ball",
    "Box",
    "Capsule",
    "Compound",
    "Contacts",
    "Drive",
    "Fault",
    "Force",
    "Frame",
    "Impulse",
    "Launch",
    "Move",
    "Polygon",
    "Pull",
    "Recording",
    "Remove",
    "Reshape",
    "Scene",
    "SceneError",
    "SetParameter",
    "Settings",
    "Spawn",
    "Spread",
    "Strike",
    "Stroke",
    "Switch",
    "Table",
    "Throttle",
    "Toggle",
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
    "ActionError": "sandbox.action",
    "Ball": "sandbox.scene.model",
    "Box": "sandbox.scene.model",
    "Capsule": "sandbox.scene.model",
    "Compound": "sandbox.scene.model",
    "Contacts": "sandbox.trajectory",
    "Drive": "sandbox.action",
    "Fault": "sandbox.scene.faults",
    "Force": "sandbox.action",
    "Frame": "sandbox.trajectory",
    "Impulse": "sandbox.action",
    "Launch": "sandbox.action",
    "Move": "sandbox.action",
    "Polygon": "sandbox.scene.model",
    "Pull": "sandbox.action",
    "Recording": "sandbox.recording",
    "Remove": "sandbox.action",
    "Reshape": "sandbox.action",
    "Scene": "sandbox.scene.model",
    "SceneError": "sandbox.scene.faults",
    "SetParameter": "sandbox.action",
    "Settings": "sandbox.scene.settings",
    "Spawn": "sandbox.action",
    "Spread": "sandbox.measure.shots.spread",
    "Strike": "sandbox.action",
    "Stroke": "sandbox.scene.cue",
    "Switch": "sandbox.action",
    "Table": "sandbox.engines.exact.rolling.table",
    "Throttle": "sandbox.action",
    "Toggle": "sandbox.action",
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


_PACKAGE = "sandbox2d"
"""What this is installed as."""


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        value: Any = version(_PACKAGE)
    elif name in _HOMES:
        value = getattr(importlib.import_module(_HOMES[name]), name)
        if name != "Scene" and hasattr(value, "model_rebuild"):
            value.model_rebuild()  # parts are built on first use; until then their signature is `**data`
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
