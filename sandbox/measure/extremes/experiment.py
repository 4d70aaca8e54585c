"""Experiment: an axis to be varied, the scenario on which it acts, and the engine configurations."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Literal

import numpy as np

from sandbox.engines.registry import ENGINES
from sandbox.jsonable import JsonObject
from sandbox.measure.extremes.outcome import Sample
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from sandbox.scene.errors import Fault, SceneError
from sandbox.scene.files.load import from_document
from sandbox.trajectory import Trajectory

Parameters = Mapping[str, float]


def default_energy_scale(scene: Scene) -> float:
    """Return the energy that a scene can exchange, J: its kinetic energy, and what gravity can release or lift.

    A body can fall to the lowest level floor, or else to the lowest body, and by its own width at least.
    """
    bodies, moves = scene.bodies, ~scene.bodies.fixed
    gravity = np.asarray(scene.world.gravity)
    strength = float(np.hypot(*gravity))
    kinetic = 0.5 * float((bodies.mass * (bodies.velocity**2).sum(axis=1))[moves].sum())
    if strength == 0.0 or not moves.any():
        return kinetic
    depth = bodies.position @ (gravity / strength)
    lowest = max(
        [float(np.asarray(plane.point) @ gravity / strength) for plane in scene.planes], default=float(depth.max())
    )
    drop = np.maximum(lowest - depth, 2.0 * bodies.thin)
    return kinetic + float((bodies.mass * strength * drop)[moves].sum())


@dataclass(frozen=True)
class Scenario:
    """Parametrised scene, and the checks of its runs."""

    name: str
    about: str
    """description in one line"""
    defaults: Parameters
    """values of all parameters"""
    build: Callable[[Parameters], JsonObject]
    """makes the scene of all parameters; values beyond the bounds of the file format make one that is refused"""
    rules: frozenset[str]
    """rules of `checks.RULES` that apply, besides `bounded` and `repeat`, which always do"""
    error: Callable[[Scene, Trajectory], float] | None = None
    """error of a run against the known solution, as a fraction; None if the solution is not known, and nan from a start
    of which it is not"""
    error_of: str = ""
    """quantity that the error is a fraction of"""
    fail_above: float = np.inf
    """error above which a result is useless and breaks the rule `truth`"""
    energy_tolerance: float | Callable[[Scene, Settings, str], float] = 0.01
    """fraction of the energy scale by which the energy may exceed its initial value; or a function of scene, settings
    and engine"""
    energy_scale: Callable[[Scene], float] = default_energy_scale
    """J, energy that a gain is compared with"""
    through: Callable[[Scene, Trajectory], str | None] | None = None
    """describes the bodies that passed an obstacle, for the rule `through`"""

    def document(self, parameters: Parameters) -> JsonObject:
        """Return the document of the scene with some parameters changed.

        Raises:
            KeyError: it has no parameter of a name.
        """
        unknown = set(parameters) - set(self.defaults)
        if unknown:
            raise KeyError(f"{self.name} has no {', '.join(sorted(unknown))}")
        return self.build({**self.defaults, **parameters})


SettingValue = float | int | str | bool


@dataclass(frozen=True)
class EngineSetup:
    """Engine configuration: a row of the heat map."""

    name: str
    engine: str
    """name of the engine"""
    changes: Mapping[str, SettingValue] = field(default_factory=dict)
    """changes to the settings of the scene"""


COMMON_SETUPS = (
    EngineSetup("pymunk", "pymunk"),
    EngineSetup("pymunk, 4 substeps", "pymunk", {"substeps": 4}),
    EngineSetup("reference", "reference"),
    EngineSetup("reference, swept", "reference", {"integrator": "velocity_verlet", "detection": "swept"}),
    EngineSetup("exact", "exact"),
)
"""Engine configurations of most axes."""

JOINT_SETUPS = (
    *COMMON_SETUPS[:3],
    *(
        EngineSetup(f"reference, {joints}", "reference", {"joints": joints})
        for joints in ("relaxation", "xpbd", "rattle")
    ),
    COMMON_SETUPS[4],
)
"""Engine configurations for scenes with joints, which have no impacts to be swept."""

SPRING_SETUPS = (
    *COMMON_SETUPS[:3],
    *(
        EngineSetup(f"reference, {name}", "reference", {"integrator": name})
        for name in ("velocity_verlet", "rk4", "explicit_euler")
    ),
    EngineSetup("reference, xpbd", "reference", {"joints": "xpbd"}),
    COMMON_SETUPS[4],
)
"""Engine configurations for scenes with springs."""

DETECTION_SETUPS = (
    *COMMON_SETUPS[:4],
    *(
        EngineSetup(f"reference, {detection}", "reference", {"detection": detection})
        for detection in ("bisect", "shrink")
    ),
    COMMON_SETUPS[4],
)
"""Engine configurations for scenes in which the detection of impacts matters."""


SUBSTEPPED_SETUPS = {"box2d": EngineSetup("box2d, 4 substeps", "box2d", {"substeps": 4})}
"""Second configurations of engines without their own ones above, by engine."""


def setups_of_engines(setups: Sequence[EngineSetup], engines: Sequence[str] | None) -> tuple[EngineSetup, ...]:
    """Return the configurations of some engines, default all; an engine without one runs with default settings."""
    names = tuple(ENGINES) if engines is None else tuple(engines)
    found = [setup for setup in setups if setup.engine in names]
    for name in names:
        if all(setup.engine != name for setup in setups):
            found.append(EngineSetup(name, name))
            found += [SUBSTEPPED_SETUPS[name]] if name in SUBSTEPPED_SETUPS else []
    return tuple(found)


Scale = Literal["log", "linear", "whole"]
"""How the interval between two levels is halved; `whole` numbers also by their logarithm."""


@dataclass(frozen=True)
class Axis:
    """One parameter of a scenario, its levels, and the diagnostic that it tests."""

    name: str
    about: str
    """description in one line"""
    unit: str
    """unit of the levels; empty for numbers without a unit"""
    case: Scenario
    parameter: str
    """name of the parameter"""
    levels: tuple[float, ...]
    """levels from the easiest to the hardest"""
    quick: tuple[float, ...]
    """a few of the levels"""
    scale: Scale = "log"
    setups: tuple[EngineSetup, ...] = COMMON_SETUPS
    kind: str | None = None
    """kind of the diagnostic that the axis tests"""
    failure_rules: frozenset[str] = frozenset()
    """rules whose failure the diagnostic predicts"""
    occurred_if: Callable[[Sample], bool] | None = None
    """returns whether the problem occurred, if it is not the failure of a rule"""
    scales_with_dt: bool = False
    """whether levels are proportional to the time step, and limits at equal cost therefore comparable"""

    def document(self, level: float) -> JsonObject:
        """Return the document of the scene at a level."""
        return self.case.document({self.parameter: level})

    def occurred(self, sample: Sample) -> bool:
        """Return whether the problem that the diagnostic predicts occurred in a sample."""
        if self.occurred_if is not None:
            return self.occurred_if(sample)
        return sample.verdict == "failed" and sample.rule in self.failure_rules


@dataclass(frozen=True)
class PairSide:
    """One side of a pair: a parameter and its levels."""

    parameter: str
    levels: tuple[float, ...]


@dataclass(frozen=True)
class AxisPair:
    """Two parameters of one scenario: every level of one with every level of the other."""

    case: Scenario
    first: PairSide
    second: PairSide
    setups: tuple[EngineSetup, ...] = COMMON_SETUPS

    @property
    def name(self) -> str:
        """Name of the pair: scenario and parameters."""
        return f"{self.case.name}: {self.first.parameter} × {self.second.parameter}"

    @property
    def levels(self) -> tuple[tuple[float, float], ...]:
        """All combinations of the levels."""
        return tuple(product(self.first.levels, self.second.levels))


def check_overrides(overrides: Sequence[str], axes: Sequence[Axis]) -> None:
    """Check that every override is valid in the scenes of every axis, and does not set what the axis varies.

    Raises:
        SceneError: with all faults, each once.
    """
    faults: dict[str, Fault] = {}
    for override in overrides:
        for axis in axes:
            try:
                scenes = [from_document(axis.document(level), "--set", (override,)) for level in axis.quick[:2]]
            except SceneError as error:
                for fault in error.faults:
                    faults.setdefault(fault.message, Fault("--set", None, f"{override} ({axis.name})", fault.message))
                continue
            if len(scenes) == 2 and scenes[0] == scenes[1]:
                message = f"sets the value that the axis {axis.name!r} varies; remove it, or choose other --axes"
                faults.setdefault(message, Fault("--set", None, override, message))
    if faults:
        raise SceneError(tuple(faults.values()))
