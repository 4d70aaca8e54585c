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

# For type checkers: the names of `_NAMES`, each exported by its `as`
if TYPE_CHECKING:
    from sandbox.action import (
        ActionError as ActionError,
        Drive as Drive,
        Force as Force,
        Impulse as Impulse,
        Launch as Launch,
        Move as Move,
        Pull as Pull,
        Remove as Remove,
        Reshape as Reshape,
        SetParameter as SetParameter,
        Spawn as Spawn,
        Strike as Strike,
        Switch as Switch,
        Throttle as Throttle,
        Toggle as Toggle,
    )
    from sandbox.batch.query import StoredRuns as StoredRuns, open_store as open_store
    from sandbox.batch.store import Store as Store
    from sandbox.engines.contract import Divergence as Divergence, Refusal as Refusal
    from sandbox.engines.exact.tabletop.shots import Table as Table
    from sandbox.engines.reference.integrate import IntegrationResult as IntegrationResult, integrate as integrate
    from sandbox.engines.reference.integrators import INTEGRATORS as INTEGRATORS
    from sandbox.engines.registry import ENGINES as ENGINES, UnknownEngineError as UnknownEngineError
    from sandbox.engines.switching import start as start
    from sandbox.frame_table import FrameTable as FrameTable
    from sandbox.measure.shots import (
        horizon as horizon,
        odds as odds,
        sensitivity as sensitivity,
        windows as windows,
    )
    from sandbox.measure.shots.shot import Spread as Spread
    from sandbox.measure.compare import compare as compare
    from sandbox.measure.run.ensemble import Ensemble as Ensemble, ensemble as ensemble
    from sandbox.measure.run.runner import run as run
    from sandbox.measure.run.sessions import play_out as play_out
    from sandbox.measure.tradeoff import tradeoff as tradeoff
    from sandbox.notebook import live as live
    from sandbox.pymunk_capture.game_capture import GameCapture as GameCapture, capture as capture
    from sandbox.pymunk_capture.space_capture import (
        CaptureError as CaptureError,
        CaptureWarning as CaptureWarning,
        from_pymunk as from_pymunk,
    )
    from sandbox.recording import Recording as Recording
    from sandbox.scene.compile.demands import demands as demands
    from sandbox.scene.compile.scene import Scene as Scene
    from sandbox.scene.compile.setup import Setup as Setup
    from sandbox.scene.description.bodies import (
        Box as Box,
        Capsule as Capsule,
        Compound as Compound,
        Polygon as Polygon,
    )
    from sandbox.scene.description.discs import Ball as Ball
    from sandbox.scene.description.surface import Stroke as Stroke
    from sandbox.scene.description.world import Settings as Settings, World as World
    from sandbox.scene.errors import Fault as Fault, SceneError as SceneError, SettingsError as SettingsError
    from sandbox.scene.files.load import dumps as dumps, load as load, loads as loads
    from sandbox.trajectory import (
        Contacts as Contacts,
        Frame as Frame,
        RunFailedError as RunFailedError,
        Trajectory as Trajectory,
    )

_NAMES = {
    "sandbox.action": (
        "ActionError Drive Force Impulse Launch Move Pull Remove Reshape SetParameter Spawn Strike Switch "
        "Throttle Toggle"
    ),
    "sandbox.batch.query": "StoredRuns open_store",
    "sandbox.batch.store": "Store",
    "sandbox.engines.contract": "Divergence Refusal",
    "sandbox.engines.exact.tabletop.shots": "Table",
    "sandbox.engines.reference.integrate": "IntegrationResult integrate",
    "sandbox.engines.reference.integrators": "INTEGRATORS",
    "sandbox.engines.registry": "ENGINES UnknownEngineError",
    "sandbox.engines.switching": "start",
    "sandbox.frame_table": "FrameTable",
    "sandbox.measure.shots": "horizon odds sensitivity windows",
    "sandbox.measure.shots.shot": "Spread",
    "sandbox.measure.compare": "compare",
    "sandbox.measure.run.ensemble": "Ensemble ensemble",
    "sandbox.measure.run.runner": "run",
    "sandbox.measure.run.sessions": "play_out",
    "sandbox.measure.tradeoff": "tradeoff",
    "sandbox.notebook": "live",
    "sandbox.pymunk_capture.game_capture": "GameCapture capture",
    "sandbox.pymunk_capture.space_capture": "CaptureError CaptureWarning from_pymunk",
    "sandbox.recording": "Recording",
    "sandbox.scene.compile.demands": "demands",
    "sandbox.scene.compile.scene": "Scene",
    "sandbox.scene.compile.setup": "Setup",
    "sandbox.scene.description.bodies": "Box Capsule Compound Polygon",
    "sandbox.scene.description.discs": "Ball",
    "sandbox.scene.description.surface": "Stroke",
    "sandbox.scene.description.world": "Settings World",
    "sandbox.scene.errors": "Fault SceneError SettingsError",
    "sandbox.scene.files.load": "dumps load loads",
    "sandbox.trajectory": "Contacts Frame RunFailedError Trajectory",
}
"""Public names by the module that has them."""
_HOMES = {name: module for module, names in _NAMES.items() for name in names.split()}
__all__ = sorted(_HOMES, key=lambda name: (not name.isupper(), name))

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
