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
        Actuate as Actuate,
        Drive as Drive,
        Explosion as Explosion,
        Force as Force,
        Impulse as Impulse,
        Join as Join,
        Launch as Launch,
        Move as Move,
        Pull as Pull,
        Remove as Remove,
        Reshape as Reshape,
        SetParameter as SetParameter,
        Spawn as Spawn,
        Steer as Steer,
        Strike as Strike,
        Switch as Switch,
        Throttle as Throttle,
        Toggle as Toggle,
        Unjoin as Unjoin,
    )
    from sandbox.batch.query import (
        QuantityStatistics as QuantityStatistics,
        RunGroup as RunGroup,
        StoredRuns as StoredRuns,
        open_store as open_store,
    )
    from sandbox.batch.store import (
        Store as Store,
    )
    from sandbox.batch.stored_run import (
        StoredRun as StoredRun,
    )
    from sandbox.engines.contract import (
        Divergence as Divergence,
        Engine as Engine,
        Exhaustion as Exhaustion,
        Refusal as Refusal,
        Simulation as Simulation,
        SnapshotError as SnapshotError,
        StateSnapshot as StateSnapshot,
    )
    from sandbox.engines.energy_ledger import (
        Cause as Cause,
    )
    from sandbox.engines.exact.tabletop.shot_result import (
        ShotEvent as ShotEvent,
        ShotResult as ShotResult,
    )
    from sandbox.engines.exact.tabletop.shots import (
        ShotBatch as ShotBatch,
        Table as Table,
    )
    from sandbox.engines.reference.integrate import (
        IntegrationResult as IntegrationResult,
        integrate as integrate,
    )
    from sandbox.engines.reference.integrators import (
        INTEGRATORS as INTEGRATORS,
        add_integrator as add_integrator,
    )
    from sandbox.engines.registry import (
        ENGINES as ENGINES,
        UnknownEngineError as UnknownEngineError,
    )
    from sandbox.engines.segment import (
        Checkpoint as Checkpoint,
    )
    from sandbox.engines.sensors import (
        OpenVisit as OpenVisit,
    )
    from sandbox.engines.switching import (
        SwitchableSimulation as SwitchableSimulation,
        start as start,
    )
    from sandbox.frame_table import (
        FrameTable as FrameTable,
    )
    from sandbox.games.contract import (
        Policy as Policy,
    )
    from sandbox.games.session import (
        HeadlessGame as HeadlessGame,
    )
    from sandbox.interactive.widget import (
        LiveWidget as LiveWidget,
    )
    from sandbox.measure.compare import (
        compare as compare,
    )
    from sandbox.measure.compare.attribution import (
        SettingEffect as SettingEffect,
    )
    from sandbox.measure.compare.contact_matching import (
        ContactMatch as ContactMatch,
    )
    from sandbox.measure.compare.ground_truth import (
        Truth as Truth,
    )
    from sandbox.measure.compare.metrics import (
        Metric as Metric,
        WorstError as WorstError,
    )
    from sandbox.measure.compare.result import (
        Comparison as Comparison,
        Row as Row,
        Score as Score,
    )
    from sandbox.measure.preflight.diagnostic import (
        Diagnostic as Diagnostic,
        Occurrence as Occurrence,
        TriedRemedy as TriedRemedy,
    )
    from sandbox.measure.proportion import (
        Proportion as Proportion,
    )
    from sandbox.measure.run.ensemble import (
        Ensemble as Ensemble,
        ensemble as ensemble,
    )
    from sandbox.measure.run.runner import (
        run as run,
    )
    from sandbox.measure.run.sessions import (
        PlayedGame as PlayedGame,
        play_out as play_out,
    )
    from sandbox.measure.shots import (
        horizon as horizon,
        odds as odds,
        sensitivity as sensitivity,
        windows as windows,
    )
    from sandbox.measure.shots.aim_windows import (
        Window as Window,
        Windows as Windows,
    )
    from sandbox.measure.shots.monte_carlo import (
        BallOdds as BallOdds,
        Odds as Odds,
        RestStatistics as RestStatistics,
    )
    from sandbox.measure.shots.predictability import (
        Horizon as Horizon,
        Separation as Separation,
    )
    from sandbox.measure.shots.sensitivity import (
        Slope as Slope,
    )
    from sandbox.measure.shots.shot import (
        ShotSetup as ShotSetup,
        Spread as Spread,
    )
    from sandbox.measure.tradeoff import (
        tradeoff as tradeoff,
    )
    from sandbox.measure.tradeoff.configuration import (
        Configuration as Configuration,
        Evaluation as Evaluation,
    )
    from sandbox.measure.tradeoff.error_budget import (
        ErrorBudget as ErrorBudget,
    )
    from sandbox.measure.starts import (
        Starts as Starts,
    )
    from sandbox.measure.tradeoff.convergence import (
        ConvergenceOrder as ConvergenceOrder,
    )
    from sandbox.measure.fresh_starts import (
        FreshStarts as FreshStarts,
    )
    from sandbox.measure.compare.end_statistics import (
        EndStatistic as EndStatistic,
        EndStatistics as EndStatistics,
    )
    from sandbox.measure.paired_samples import (
        PairedDifference as PairedDifference,
    )
    from sandbox.measure.tradeoff.result import (
        Conclusion as Conclusion,
        Recommendation as Recommendation,
        Tradeoff as Tradeoff,
    )
    from sandbox.measure.tradeoff.timing import (
        CostRatio as CostRatio,
    )
    from sandbox.measure.tradeoff.simplify import (
        Simplification as Simplification,
    )
    from sandbox.notebook import (
        live as live,
    )
    from sandbox.pymunk_capture.game_capture import (
        GameCapture as GameCapture,
        SpaceCapture as SpaceCapture,
        capture as capture,
    )
    from sandbox.pymunk_capture.space_capture import (
        CaptureError as CaptureError,
        CaptureWarning as CaptureWarning,
        from_pymunk as from_pymunk,
    )
    from sandbox.pymunk_capture.state_log import (
        StateLog as StateLog,
    )
    from sandbox.game_inputs import (
        GameInputs as GameInputs,
        InputEvent as InputEvent,
        InputReading as InputReading,
    )
    from sandbox.recording import (
        Press as Press,
        RecordedGame as RecordedGame,
        Recording as Recording,
        ReplayCheck as ReplayCheck,
    )
    from sandbox.scene.compile.bodies import (
        Bodies as Bodies,
    )
    from sandbox.scene.compile.demands import (
        Demand as Demand,
        demands as demands,
    )
    from sandbox.scene.compile.joint_arrays import (
        JointArrays as JointArrays,
    )
    from sandbox.scene.compile.paths import (
        PathMotion as PathMotion,
        PathPose as PathPose,
    )
    from sandbox.scene.compile.scene import (
        Scene as Scene,
    )
    from sandbox.scene.compile.setup import (
        Setup as Setup,
    )
    from sandbox.scene.description.base import (
        BodyPath as BodyPath,
        BodySource as BodySource,
        BodySpec as BodySpec,
    )
    from sandbox.scene.description.bodies import (
        BallPart as BallPart,
        Box as Box,
        BoxPart as BoxPart,
        Capsule as Capsule,
        CapsulePart as CapsulePart,
        Compound as Compound,
        Polygon as Polygon,
        PolygonPart as PolygonPart,
    )
    from sandbox.scene.description.discs import (
        Ball as Ball,
        Emitter as Emitter,
        Grid as Grid,
        Scatter as Scatter,
    )
    from sandbox.scene.description.fixed import (
        Liquid as Liquid,
        Plane as Plane,
        Post as Post,
        Sensor as Sensor,
        Wall as Wall,
        Zone as Zone,
    )
    from sandbox.scene.description.forces import (
        Attraction as Attraction,
        PlungerDrive as PlungerDrive,
        StrokeDrive as StrokeDrive,
        Thrust as Thrust,
        TorqueDrive as TorqueDrive,
        Tyre as Tyre,
    )
    from sandbox.scene.description.generators import (
        Cloth as Cloth,
        Ragdoll as Ragdoll,
        Rope as Rope,
        RopeAttachment as RopeAttachment,
        Stack as Stack,
    )
    from sandbox.scene.description.joints import (
        Gear as Gear,
        Groove as Groove,
        Motor as Motor,
        Pivot as Pivot,
        Prismatic as Prismatic,
        Pulley as Pulley,
        Ratchet as Ratchet,
        Rod as Rod,
        RotaryLimit as RotaryLimit,
        RotarySpring as RotarySpring,
        Slide as Slide,
        Spring as Spring,
        Weld as Weld,
        Wheel as Wheel,
    )
    from sandbox.scene.description.play import (
        Marking as Marking,
        Play as Play,
        PlayPart as PlayPart,
        Spot as Spot,
    )
    from sandbox.scene.description.surface import (
        ContactModels as ContactModels,
        Floor as Floor,
        Pocket as Pocket,
        Shot as Shot,
        Stroke as Stroke,
    )
    from sandbox.scene.description.world import (
        Kick as Kick,
        Material as Material,
        Pair as Pair,
        Settings as Settings,
        SettingsChanges as SettingsChanges,
        World as World,
    )
    from sandbox.scene.errors import (
        Fault as Fault,
        PartError as PartError,
        SceneError as SceneError,
        SettingsError as SettingsError,
    )
    from sandbox.scene.files.load import (
        dumps as dumps,
        load as load,
        loads as loads,
    )
    from sandbox.scene.geometry.shapes import (
        Shapes as Shapes,
    )
    from sandbox.queries import (
        NearestObject as NearestObject,
        RayHit as RayHit,
        RayHits as RayHits,
        SceneQueries as SceneQueries,
    )
    from sandbox.trajectory import (
        Contacts as Contacts,
        Frame as Frame,
        RunFailedError as RunFailedError,
        SensorVisit as SensorVisit,
        Trajectory as Trajectory,
    )

_NAMES = {
    "sandbox.action": (
        "ActionError Actuate Drive Explosion Force Impulse Join Launch Move Pull Remove Reshape SetParameter Spawn "
        "Steer Strike Switch Throttle Toggle Unjoin"
    ),
    "sandbox.batch.query": "QuantityStatistics RunGroup StoredRuns open_store",
    "sandbox.batch.store": "Store",
    "sandbox.batch.stored_run": "StoredRun",
    "sandbox.engines.contract": "Divergence Engine Exhaustion Refusal Simulation SnapshotError StateSnapshot",
    "sandbox.engines.energy_ledger": "Cause",
    "sandbox.engines.exact.tabletop.shot_result": "ShotEvent ShotResult",
    "sandbox.engines.exact.tabletop.shots": "ShotBatch Table",
    "sandbox.engines.reference.integrate": "IntegrationResult integrate",
    "sandbox.engines.reference.integrators": "INTEGRATORS add_integrator",
    "sandbox.engines.registry": "ENGINES UnknownEngineError",
    "sandbox.engines.segment": "Checkpoint",
    "sandbox.engines.sensors": "OpenVisit",
    "sandbox.engines.switching": "SwitchableSimulation start",
    "sandbox.frame_table": "FrameTable",
    "sandbox.games.contract": "Policy",
    "sandbox.games.session": "HeadlessGame",
    "sandbox.interactive.widget": "LiveWidget",
    "sandbox.measure.compare": "compare",
    "sandbox.measure.compare.attribution": "SettingEffect",
    "sandbox.measure.compare.contact_matching": "ContactMatch",
    "sandbox.measure.compare.ground_truth": "Truth",
    "sandbox.measure.compare.metrics": "Metric WorstError",
    "sandbox.measure.compare.result": "Comparison Row Score",
    "sandbox.measure.preflight.diagnostic": "Diagnostic Occurrence TriedRemedy",
    "sandbox.measure.proportion": "Proportion",
    "sandbox.measure.run.ensemble": "Ensemble ensemble",
    "sandbox.measure.run.runner": "run",
    "sandbox.measure.run.sessions": "PlayedGame play_out",
    "sandbox.measure.shots": "horizon odds sensitivity windows",
    "sandbox.measure.shots.aim_windows": "Window Windows",
    "sandbox.measure.shots.monte_carlo": "BallOdds Odds RestStatistics",
    "sandbox.measure.shots.predictability": "Horizon Separation",
    "sandbox.measure.shots.sensitivity": "Slope",
    "sandbox.measure.shots.shot": "ShotSetup Spread",
    "sandbox.measure.tradeoff": "tradeoff",
    "sandbox.measure.tradeoff.configuration": "Configuration Evaluation",
    "sandbox.measure.tradeoff.error_budget": "ErrorBudget",
    "sandbox.measure.starts": "Starts",
    "sandbox.measure.tradeoff.convergence": "ConvergenceOrder",
    "sandbox.measure.fresh_starts": "FreshStarts",
    "sandbox.measure.compare.end_statistics": "EndStatistic EndStatistics",
    "sandbox.measure.paired_samples": "PairedDifference",
    "sandbox.measure.tradeoff.timing": "CostRatio",
    "sandbox.measure.tradeoff.result": "Conclusion Recommendation Tradeoff",
    "sandbox.measure.tradeoff.simplify": "Simplification",
    "sandbox.notebook": "live",
    "sandbox.pymunk_capture.game_capture": "GameCapture SpaceCapture capture",
    "sandbox.pymunk_capture.space_capture": "CaptureError CaptureWarning from_pymunk",
    "sandbox.pymunk_capture.state_log": "StateLog",
    "sandbox.game_inputs": "GameInputs InputEvent InputReading",
    "sandbox.recording": "Press RecordedGame Recording ReplayCheck",
    "sandbox.scene.compile.bodies": "Bodies",
    "sandbox.scene.compile.demands": "Demand demands",
    "sandbox.scene.compile.joint_arrays": "JointArrays",
    "sandbox.scene.compile.paths": "PathMotion PathPose",
    "sandbox.scene.compile.scene": "Scene",
    "sandbox.scene.compile.setup": "Setup",
    "sandbox.scene.description.base": "BodyPath BodySource BodySpec",
    "sandbox.scene.description.bodies": "BallPart Box BoxPart Capsule CapsulePart Compound Polygon PolygonPart",
    "sandbox.scene.description.discs": "Ball Emitter Grid Scatter",
    "sandbox.scene.description.fixed": "Liquid Plane Post Sensor Wall Zone",
    "sandbox.scene.description.forces": "Attraction PlungerDrive StrokeDrive Thrust TorqueDrive Tyre",
    "sandbox.scene.description.generators": "Cloth Ragdoll Rope RopeAttachment Stack",
    "sandbox.scene.description.joints": (
        "Gear Groove Motor Pivot Prismatic Pulley Ratchet Rod RotaryLimit RotarySpring Slide Spring Weld Wheel"
    ),
    "sandbox.scene.description.play": "Marking Play PlayPart Spot",
    "sandbox.scene.description.surface": "ContactModels Floor Pocket Shot Stroke",
    "sandbox.scene.description.world": "Kick Material Pair Settings SettingsChanges World",
    "sandbox.scene.errors": "Fault PartError SceneError SettingsError",
    "sandbox.scene.files.load": "dumps load loads",
    "sandbox.scene.geometry.shapes": "Shapes",
    "sandbox.queries": "NearestObject RayHit RayHits SceneQueries",
    "sandbox.trajectory": "Contacts Frame RunFailedError SensorVisit Trajectory",
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
