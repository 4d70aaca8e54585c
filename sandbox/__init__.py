"""2D game physics sandbox: one scene file, several engines, and a measured error and cost for every setting.

    import sandbox

    scene = sandbox.load("bounce")  # or the path of a file
    run = sandbox.run(scene, engine="pymunk", dt=0.001)
    print(run.status, run.position[-1], run.missed_contacts)

    kicked = sandbox.run(scene, actions=[sandbox.Impulse(time=1.0, body="ball", impulse=(2.0, 0.0))])

Each public name is imported when it is first used, so `import sandbox` takes a few milliseconds.
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
    from sandbox.batch.query import StoredRuns, open_store
    from sandbox.batch.store import Store
    from sandbox.engines.contract import Divergence, Refusal
    from sandbox.engines.exact.tabletop.shots import Table
    from sandbox.engines.pymunk_adapter.capture import CaptureError, CaptureWarning, from_pymunk
    from sandbox.engines.pymunk_adapter.game_capture import GameCapture, capture
    from sandbox.engines.reference.integrate import IntegrationResult, integrate
    from sandbox.engines.reference.integrators import INTEGRATORS
    from sandbox.engines.registry import ENGINES, UnknownEngineError
    from sandbox.engines.switching import start
    from sandbox.frame_table import FrameTable
    from sandbox.games.billiards.shots import horizon, odds, sensitivity, windows
    from sandbox.games.billiards.shots.shot import Spread
    from sandbox.measure.compare import compare
    from sandbox.measure.run.ensemble import Ensemble, ensemble
    from sandbox.measure.run.runner import run
    from sandbox.measure.run.sessions import play_out
    from sandbox.measure.tradeoff import tradeoff
    from sandbox.recording import Recording
    from sandbox.scene.compile.demands import demands
    from sandbox.scene.compile.scene import Scene
    from sandbox.scene.compile.setup import Setup
    from sandbox.scene.description.bodies import Box, Capsule, Compound, Polygon
    from sandbox.scene.description.discs import Ball
    from sandbox.scene.description.surface import Stroke
    from sandbox.scene.description.world import Settings, World
    from sandbox.scene.errors import Fault, SceneError
    from sandbox.scene.files.load import dumps, load, loads
    from sandbox.trajectory import Contacts, Frame, RunFailedError, Trajectory

__all__ = [
    "ENGINES",
    "INTEGRATORS",
    "ActionError",
    "Ball",
    "Box",
    "Capsule",
    "CaptureError",
    "CaptureWarning",
    "Compound",
    "Contacts",
    "Divergence",
    "Drive",
    "Ensemble",
    "Fault",
    "Force",
    "Frame",
    "FrameTable",
    "GameCapture",
    "Impulse",
    "IntegrationResult",
    "Launch",
    "Move",
    "Polygon",
    "Pull",
    "Recording",
    "Refusal",
    "Remove",
    "Reshape",
    "RunFailedError",
    "Scene",
    "SceneError",
    "SetParameter",
    "Settings",
    "Setup",
    "Spawn",
    "Spread",
    "Store",
    "StoredRuns",
    "Strike",
    "Stroke",
    "Switch",
    "Table",
    "Throttle",
    "Toggle",
    "Trajectory",
    "UnknownEngineError",
    "World",
    "capture",
    "compare",
    "demands",
    "dumps",
    "ensemble",
    "from_pymunk",
    "horizon",
    "integrate",
    "load",
    "loads",
    "odds",
    "open_store",
    "play_out",
    "run",
    "sensitivity",
    "start",
    "tradeoff",
    "windows",
]

_HOMES = {
    "ENGINES": "sandbox.engines.registry",
    "INTEGRATORS": "sandbox.engines.reference.integrators",
    "ActionError": "sandbox.action",
    "Ball": "sandbox.scene.description.discs",
    "Box": "sandbox.scene.description.bodies",
    "Capsule": "sandbox.scene.description.bodies",
    "CaptureError": "sandbox.engines.pymunk_adapter.capture",
    "CaptureWarning": "sandbox.engines.pymunk_adapter.capture",
    "Compound": "sandbox.scene.description.bodies",
    "Contacts": "sandbox.trajectory",
    "Divergence": "sandbox.engines.contract",
    "Drive": "sandbox.action",
    "Ensemble": "sandbox.measure.run.ensemble",
    "Fault": "sandbox.scene.errors",
    "Force": "sandbox.action",
    "Frame": "sandbox.trajectory",
    "FrameTable": "sandbox.frame_table",
    "GameCapture": "sandbox.engines.pymunk_adapter.game_capture",
    "Impulse": "sandbox.action",
    "IntegrationResult": "sandbox.engines.reference.integrate",
    "Launch": "sandbox.action",
    "Move": "sandbox.action",
    "Polygon": "sandbox.scene.description.bodies",
    "Pull": "sandbox.action",
    "Recording": "sandbox.recording",
    "Refusal": "sandbox.engines.contract",
    "Remove": "sandbox.action",
    "Reshape": "sandbox.action",
    "RunFailedError": "sandbox.trajectory",
    "Scene": "sandbox.scene.compile.scene",
    "SceneError": "sandbox.scene.errors",
    "SetParameter": "sandbox.action",
    "Settings": "sandbox.scene.description.world",
    "Setup": "sandbox.scene.compile.setup",
    "Spawn": "sandbox.action",
    "Spread": "sandbox.games.billiards.shots.shot",
    "Strike": "sandbox.action",
    "Store": "sandbox.batch.store",
    "Stroke": "sandbox.scene.description.surface",
    "Switch": "sandbox.action",
    "Table": "sandbox.engines.exact.tabletop.shots",
    "Throttle": "sandbox.action",
    "Toggle": "sandbox.action",
    "Trajectory": "sandbox.trajectory",
    "UnknownEngineError": "sandbox.engines.registry",
    "World": "sandbox.scene.description.world",
    "capture": "sandbox.engines.pymunk_adapter.game_capture",
    "compare": "sandbox.measure.compare",
    "demands": "sandbox.scene.compile.demands",
    "dumps": "sandbox.scene.files.load",
    "ensemble": "sandbox.measure.run.ensemble",
    "from_pymunk": "sandbox.engines.pymunk_adapter.capture",
    "horizon": "sandbox.games.billiards.shots",
    "integrate": "sandbox.engines.reference.integrate",
    "load": "sandbox.scene.files.load",
    "loads": "sandbox.scene.files.load",
    "open_store": "sandbox.batch.query",
    "StoredRuns": "sandbox.batch.query",
    "odds": "sandbox.games.billiards.shots",
    "play_out": "sandbox.measure.run.sessions",
    "run": "sandbox.measure.run.runner",
    "sensitivity": "sandbox.games.billiards.shots",
    "start": "sandbox.engines.switching",
    "tradeoff": "sandbox.measure.tradeoff",
    "windows": "sandbox.games.billiards.shots",
}


_PACKAGE = "sandbox2d"
"""Name of the distribution package."""


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
