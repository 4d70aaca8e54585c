"""Configuration: an engine with its settings, the space of configurations to search, and the evaluation of one."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from itertools import chain
from typing import Any, get_args

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.registry import ENGINES
from sandbox.jsonable import finite, in_json
from sandbox.measure.compare.end_statistics import EndStatistics
from sandbox.measure.compare.metrics import METRICS, EvaluationContext, WorstError, measure_all, worst_error
from sandbox.measure.compare.self_convergence import preferred_settings
from sandbox.measure.fresh_starts import FreshStarts
from sandbox.measure.run.bounded_run import RunTimeoutError, bounded_run, counted_cost
from sandbox.measure.run.recorder import TooLargeError
from sandbox.measure.tradeoff.objections import ErrorLimits, find_objections
from sandbox.measure.tradeoff.timing import Timing
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.base import MAX_STEPS
from sandbox.scene.description.world import DetectionName, IntegratorName, Joints, Response, Settings
from sandbox.scene.errors import SettingsError
from sandbox.trajectory import Trajectory

MAX_SUBSTEPS, MAX_ITERATIONS = 512, 1000
MIN_STEPS = 4
"""Fewest steps of a run with a longer dt than the scene's own: the error of a shorter run is not meaningful."""
MAX_FRAMES_PER_STEP = 2.0
"""Longest dt in frames of a game, unless the scene's own is longer."""
MAX_REFINEMENT, MIN_REFINEMENT = Fraction(256), Fraction(1, 16)
"""Bounds of the number of steps in one step of the scene."""

OPTIONS: dict[str, tuple[Any, ...]] = {
    "integrator": get_args(IntegratorName),
    "detection": get_args(DetectionName),
    "joints": get_args(Joints),
    "response": get_args(Response),
    "half_kick": (False, True),
    "continuous": (True, False),
}
"""Settings that choose a method, with their values. Broad phases are left out: all give the same result."""


@dataclass(frozen=True)
class Configuration:
    """Engine and settings, as differences from the settings of a scene."""

    engine: str
    """name of the engine"""
    refinement: Fraction = Fraction(1)
    """steps in one step of the scene"""
    substeps: int = 1
    """substeps of a step"""
    iterations: int = 10
    """solver iterations of a substep"""
    options: tuple[tuple[str, Any], ...] = ()
    """chosen methods, sorted by key"""

    @classmethod
    def of(cls, engine: str, settings: Settings) -> "Configuration":
        """Return an engine with unchanged settings."""
        return cls(engine, Fraction(1), settings.substeps, settings.iterations)

    @property
    def work(self) -> float:
        """Estimated cost relative to other configurations with the same options."""
        # An iteration costs about 1/20 of the rest of a substep.
        return float(self.refinement) * self.substeps * (1.0 + self.iterations / 20.0)

    def settings(self, base: Settings) -> Settings:
        """Return the full settings. All frames lie at times at which the base records frames too.

        Args:
            base: settings that the configuration differs from.

        Raises:
            SettingsError: dt is out of bounds.
        """
        every = Fraction(base.record_every) * self.refinement
        return base.replace(
            dt=float(Fraction(base.dt) / self.refinement),
            record_every=every.numerator,
            substeps=self.substeps,
            iterations=self.iterations,
            **dict(self.options),
        )

    def with_option(self, key: str, value: Any) -> "Configuration":
        """Return the configuration with one option set."""
        return replace(self, options=tuple(sorted([*self.without_option(key).options, (key, value)])))

    def with_options(self, options: Mapping[str, Any]) -> "Configuration":
        """Return the configuration with several options set."""
        configuration = self
        for key, value in options.items():
            configuration = configuration.with_option(key, value)
        return configuration

    def without_option(self, key: str) -> "Configuration":
        """Return the configuration with one option left to the scene or the engine."""
        return replace(self, options=tuple((k, v) for k, v in self.options if k != key))


@dataclass(frozen=True, eq=False)
class SearchSpace:
    """All configurations that a scene can run with."""

    scene: Scene
    base: Settings
    """settings of the scene, with the changes that the caller asked for"""
    engines: tuple[str, ...]
    """names of the engines"""
    frame: float = 1.0 / 60.0
    """s, duration of a frame of a game: the longest dt of `exact`; the other engines may take twice that"""
    has_fixed_dt: bool = False
    """whether every configuration has the dt of the base, as in the loop of a game that steps once a frame"""
    _valid: dict[Configuration, bool] = field(default_factory=dict, init=False, repr=False)
    _resolved: dict[Configuration, Settings] = field(default_factory=dict, init=False, repr=False)

    def starts(self) -> list[Configuration]:
        """Return each engine with the scene's settings, without those that the engine does not have."""
        return [Configuration.of(name, self.own_settings(name)) for name in self.engines]

    def presets(self) -> list[Configuration]:
        """Return combinations of options that suit the scene, which changing one at a time would not find."""
        combinations = (
            start.with_options(options) for start in self.starts() for options in preferred_settings(self.scene)
        )
        found = dict.fromkeys(self.canonical(each) for each in combinations if self.is_valid(each))
        return [each for each in found if each.options]

    def own_settings(self, engine: str) -> Settings:
        """Return the settings that an engine's configurations differ from.

        They are the scene's settings; if the engine lacks one of them, only those that all engines have.
        """
        return self._own_settings[engine]

    @cached_property
    def _own_settings(self) -> dict[str, Settings]:
        has_all = {name: not ENGINES[name].missing(self.scene, self.base) for name in self.engines}
        return {name: self.base if complete else self.base.common() for name, complete in has_all.items()}

    def settings(self, configuration: Configuration) -> Settings:
        """Return the full settings of a configuration; choices left to the engine are None."""
        return configuration.settings(self.own_settings(configuration.engine))

    def is_valid(self, configuration: Configuration) -> bool:
        """Return whether a configuration is within bounds and its engine can run it."""
        if configuration not in self._valid:
            self._valid[configuration] = self._can_run(configuration)
        return self._valid[configuration]

    def _can_run(self, configuration: Configuration) -> bool:
        refinement, substeps = configuration.refinement, configuration.substeps
        if self.has_fixed_dt and refinement != 1:
            return False
        if not (MIN_REFINEMENT <= refinement <= MAX_REFINEMENT and 1 <= substeps <= MAX_SUBSTEPS):
            return False
        if not 1 <= configuration.iterations <= MAX_ITERATIONS:
            return False
        try:
            settings = self.settings(configuration)
        except SettingsError:
            return False
        max_dt = self.frame if configuration.engine == "exact" else MAX_FRAMES_PER_STEP * self.frame
        if refinement < 1 and settings.dt > max_dt:
            return False
        steps = self.scene.world.duration / settings.dt
        if (refinement < 1 and steps < MIN_STEPS) or steps > MAX_STEPS / substeps:
            return False
        return not ENGINES[configuration.engine].missing(self.scene, settings)

    def resolved(self, configuration: Configuration) -> Settings:
        """Return the full settings of a configuration as the engine resolves them."""
        if configuration not in self._resolved:
            engine = ENGINES[configuration.engine]
            self._resolved[configuration] = engine.resolve(self.scene, self.settings(configuration))
        return self._resolved[configuration]

    def canonical(self, configuration: Configuration) -> Configuration:
        """Return a configuration without the options that are the engine's default, so that equal ones are equal."""
        resolved = self.resolved(configuration)
        for key, _ in configuration.options:
            shorter = configuration.without_option(key)
            if self.resolved(shorter) == resolved:
                configuration = shorter
        return configuration

    def neighbours(self, configuration: Configuration) -> list[Configuration]:
        """Return the valid configurations that differ in one choice, a step up or down."""
        if configuration.engine == "exact":  # its dt is only the time between two frames
            others: Iterator[Configuration] = iter([replace(configuration, refinement=configuration.refinement / 2)])
        else:
            others = chain(self._step_neighbours(configuration), self._option_neighbours(configuration))
        found = dict.fromkeys(self.canonical(other) for other in others if self.is_valid(other))
        return [other for other in found if other != configuration]

    def _step_neighbours(self, configuration: Configuration) -> Iterator[Configuration]:
        scene_settings = self.own_settings(configuration.engine)
        refinement, substeps, iterations = configuration.refinement, configuration.substeps, configuration.iterations
        if substeps == scene_settings.substeps:  # otherwise more substeps have the same effect at a lower cost
            yield replace(configuration, refinement=refinement / 2)
            if refinement < 4:
                yield replace(configuration, refinement=refinement * 2)
        if refinement <= 1:
            yield replace(configuration, substeps=substeps * 2)
            if substeps % 2 == 0:
                yield replace(configuration, substeps=substeps // 2)
        if refinement <= 1:  # the same substep with half the frames, and back
            yield replace(configuration, refinement=refinement / 2, substeps=substeps * 2)
        if refinement < 1 and substeps % 2 == 0:
            yield replace(configuration, refinement=refinement * 2, substeps=substeps // 2)
        if self.uses_iterations(configuration.engine):
            yield replace(configuration, iterations=iterations * 2)
            if iterations > 1:
                yield replace(configuration, iterations=iterations // 2)

    def _option_neighbours(self, configuration: Configuration) -> Iterator[Configuration]:
        resolved = self.resolved(configuration)
        for key, values in OPTIONS.items():
            if key == "joints" and not len(self.scene.joint_arrays):
                continue
            if key in ("detection", "response", "continuous") and not self.has_contacts:
                continue
            if key == "half_kick" and self.scene.world.gravity == (0.0, 0.0):
                continue
            for value in values:
                if value != getattr(resolved, key):
                    yield configuration.with_option(key, value)

    @cached_property
    def has_contacts(self) -> bool:
        """Whether any two objects can collide."""
        return bool(contact_matrix(self.scene).touches.any())

    def uses_iterations(self, engine: str) -> bool:
        """Return whether solver iterations can change the results of an engine; Box2D makes one in each substep."""
        return self.has_coupling and engine != "box2d"

    @cached_property
    def has_coupling(self) -> bool:
        """Whether solver iterations can matter: contacts or joints can depend on each other."""
        matrix = contact_matrix(self.scene)
        return bool(len(self.scene.joint_arrays)) or (
            self.has_contacts and (matrix.mutual or len(self.scene.fixed) > 1 or matrix.solids)
        )


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Error and cost of one configuration. Unknown values are None."""

    configuration: Configuration = field(metadata=in_json(omit=True))
    """engine and settings"""
    engine: str
    """name of the engine"""
    asked: Settings = field(metadata=in_json(omit=True))
    """settings given to the engine; those that are None are chosen by it"""
    settings: Settings
    """settings as the engine resolved them"""
    changes: Mapping[str, Any]
    """differences from the `[solver]` of the scene"""
    error: float | None
    """value of the chosen metric; None if the run has none"""
    cost: float | None = field(metadata=in_json(key="cost_ms_per_second"))
    """ms per simulated second: the minimum of separate repeats without recording"""
    cost_median: float | None = field(metadata=in_json(key="cost_median_ms_per_second"))
    """ms per simulated second: the median of the same repeats"""
    repeats: int
    """number of separate repeats; 0 if another point of the engine is as accurate and much cheaper. The cost is then
    estimated (`with_estimated_costs`); if no point of its engine was timed, it is that of the run that gave the error,
    including recording and audit"""
    counted: float | None = field(metadata=in_json(key="counted_cost_ms_per_second"))
    """ms per simulated second computed from the work counters (`counted_cost`); equal on every machine"""
    is_own: bool = field(metadata=in_json(key="scene_setting"))
    """whether it is the setting of the scene"""
    status: str
    """`ok`, `diverged`, `failed`, `refused`, or `stopped` if it took too long"""
    reason: str | None
    """reason for a status other than `ok`"""
    metrics: Mapping[str, float | None]
    """every metric by name, in its unit; the worst over the starts"""
    work: Mapping[str, int]
    """deterministic counters: substeps, pair tests, contact iterations, events"""
    objections: tuple[str, ...] = ()
    """reasons not to recommend the setting although its error may be within the tolerance, as clauses"""
    worst: WorstError | None = None
    """body, time and place of the largest distance from the truth; None without a truth"""
    is_truth: bool = False
    """whether the error is 0 because the run is the truth itself, from all starts"""
    fresh_starts: FreshStarts | None = None
    """errors from perturbed starts, of the points of a front that are shown; None if they are not known"""
    end_statistics: EndStatistics | None = None
    """statistics of the end over fresh starts, of recommended settings and those of the scene, if the truth is not
    trusted to the end; None if they are not known"""
    counted_seconds: float = field(default=0.0, metadata=in_json(omit=True))
    """s, counted cost of one run, the largest over the starts; of a stopped run, the limit"""
    spent_seconds: float = field(default=0.0, metadata=in_json(omit=True))
    """s, counted cost of the runs of all starts that were made for this evaluation"""
    seconds: float = field(default=0.0, metadata=in_json(omit=True))
    """s, measured time of the recorded run on this machine"""
    turns: tuple[float, ...] = field(default=(), metadata=in_json(omit=True))
    """s, time of each separate repeat, paired with those of the other points that were timed in the same turns"""

    def __repr__(self) -> str:
        """Return engine, changes and status, error and cost."""
        changes = ", ".join(f"{key} {value}" for key, value in self.changes.items()) or "as the scene has it"
        error = "unknown" if self.error is None else f"{self.error:.3g}"
        cost = "unknown" if self.cost is None else f"{self.cost:.3g} ms per simulated second"
        return f"<Evaluation {self.engine}, {changes}: {self.status}, error {error}, cost {cost}>"

    @property
    def ranking_error(self) -> float:
        """Error for comparisons: infinite if the run failed or has no error."""
        unknown = self.status != "ok" or self.error is None or math.isnan(self.error)
        return math.inf if unknown or self.error is None else self.error

    @property
    def is_usable(self) -> bool:
        """Whether the status is `ok`, and error and cost are finite."""
        return self.status == "ok" and finite(self.error) is not None and finite(self.cost) is not None

    def meets(self, tolerance: float) -> bool:
        """Return whether the error is within a tolerance and there is no objection."""
        return self.ranking_error <= tolerance and not self.objections

    def frame_time(self, fps: float) -> float:
        """Return the computing time of the most expensive frame of a game, ms, for a usable evaluation.

        If dt is longer than a frame, that is the time of one step.

        Args:
            fps: frames per second.
        """
        assert self.cost_median is not None
        return self.cost_median * max(1.0 / fps, self.settings.dt)

    def with_timing(self, timing: Timing | None) -> "Evaluation":
        """Return the evaluation with measured costs."""
        if timing is None:
            return self
        turns = timing.turns if timing.repeats else ()
        return replace(self, cost=timing.least, cost_median=timing.median, repeats=timing.repeats, turns=turns)


@dataclass(frozen=True)
class _Result:
    """Outcome of the runs of a configuration from all starts."""

    status: str
    reason: str | None = None
    metrics: Mapping[str, float | None] = field(default_factory=lambda: dict.fromkeys(METRICS))
    counted_seconds: float = 0.0
    spent_seconds: float = 0.0
    seconds: float = 0.0
    work: Mapping[str, int] = field(default_factory=dict)
    fastest: FloatArray | None = None
    """(N,) m/s, largest speed of each body over the starts; None unless the status is `ok`"""
    worst: WorstError | None = None


def evaluate(
    configuration: Configuration,
    space: SearchSpace,
    contexts: Sequence[EvaluationContext],
    metric: str,
    tolerance: float,
    limit: float,
    deadline: float = math.inf,
    known: Trajectory | None = None,
) -> Evaluation:
    """Run a configuration once in each context, each from another start, and keep the worst value of every metric.

    Args:
        configuration: engine and settings.
        space: search space of the configuration.
        contexts: contexts of the same scene from different starts.
        metric: name of the metric of the error.
        tolerance: largest accepted error, in the unit of the metric.
        limit: counted cost that one run may have, s.
        deadline: time of `clock_without_compilation` after which a run is stopped, s.
        known: this run in the first context, if already made.
    """
    requested = space.settings(configuration)
    resolved = ENGINES[configuration.engine].resolve(space.scene, requested)
    result = _run_contexts(configuration.engine, requested, resolved, contexts, limit, deadline, known)
    objections: tuple[str, ...] = ()
    if result.fastest is not None:
        limits = ErrorLimits(METRICS[metric], tolerance, contexts[0].zoom)
        objections = find_objections(
            space.scene, configuration.engine, requested, result.metrics, result.fastest, limits
        )
    return Evaluation(
        configuration=configuration,
        engine=configuration.engine,
        asked=requested,
        settings=resolved,
        changes=changes(space.base, requested),
        error=result.metrics.get(metric) if result.status == "ok" else None,
        cost=None,
        cost_median=None,
        repeats=0,
        counted=1e3 * result.counted_seconds / space.scene.world.duration,
        is_own=configuration == Configuration.of(configuration.engine, space.own_settings(configuration.engine)),
        status=result.status,
        reason=result.reason,
        metrics=result.metrics,
        work=result.work,
        objections=objections,
        worst=result.worst,
        is_truth=result.status == "ok"
        and METRICS[metric].is_difference
        and all(each.truth is not None and each.truth.is_run_of(configuration.engine, resolved) for each in contexts),
        counted_seconds=result.counted_seconds,
        spent_seconds=result.spent_seconds,
        seconds=result.seconds,
    )


def with_estimated_costs(evaluations: Sequence[Evaluation]) -> list[Evaluation]:
    """Return evaluations in which those that were not timed have costs that can be compared with those that were.

    The counted cost of a setting is multiplied by measured cost / counted cost of the timed setting of its engine that
    is nearest to it in counted cost. Of 62 such settings of `break_shot`, `pendulum_90` and `newtons_cradle` that were
    timed for comparison, the estimates of half were within a factor of 1.5, of nine in ten within 2.8, of all within
    10; times of the recorded run within 2.9, 27 and 97, as engines record steps in batches, and games read each frame.
    """
    timed = [each for each in evaluations if each.repeats and each.counted_seconds > 0.0]

    def estimated(each: Evaluation) -> Evaluation:
        peers = [other for other in timed if other.engine == each.engine]
        if each.repeats or not (each.is_usable and each.counted_seconds > 0.0 and peers):
            return each
        nearest = min(peers, key=lambda other: abs(math.log(other.counted_seconds / each.counted_seconds)))
        assert nearest.cost is not None
        assert nearest.cost_median is not None
        scale = each.counted_seconds / nearest.counted_seconds
        return replace(each, cost=scale * nearest.cost, cost_median=scale * nearest.cost_median)

    return [estimated(each) for each in evaluations]


def refused_evaluation(engine: str, base: Settings, reason: str) -> Evaluation:
    """Return the evaluation of an engine that cannot run a scene at all."""
    return Evaluation(
        configuration=Configuration.of(engine, base),
        engine=engine,
        asked=base,
        settings=base,
        changes={},
        error=None,
        cost=None,
        cost_median=None,
        repeats=0,
        counted=None,
        is_own=True,
        status="refused",
        reason=reason,
        metrics={},
        work={},
    )


def changes(base: Settings, chosen: Settings) -> dict[str, Any]:
    """Return the settings that differ from the base, without `record_every`; None for choices left to the engine."""
    before, after = base.model_dump(), chosen.model_dump()
    return {key: value for key, value in after.items() if value != before[key] and key != "record_every"}


def _run_contexts(
    engine: str,
    requested: Settings,
    resolved: Settings,
    contexts: Sequence[EvaluationContext],
    limit: float,
    deadline: float,
    known: Trajectory | None,
) -> _Result:
    """Run all contexts until one fails, and return the worst metrics and the costs."""
    unknown: dict[str, float | None] = dict.fromkeys(METRICS)
    worst, cost, spent, seconds, work = unknown, 0.0, 0.0, 0.0, {}
    fastest: FloatArray = np.zeros(len(contexts[0].scene.bodies))
    farthest: WorstError | None = None
    for k, context in enumerate(contexts):
        try:
            if k == 0 and known is not None:
                run = known
                counted = counted_cost(context.scene, engine, resolved, run.info["steps"], run.info["work"])
            else:
                run, counted = bounded_run(context.scene, engine, requested, limit, deadline)
        except RunTimeoutError as error:
            return _Result("stopped", str(error), unknown, limit, spent + limit, seconds)
        except TooLargeError as error:
            return _Result("failed", str(error), unknown, 0.0, spent, seconds)
        seconds, cost = max(seconds, float(run.info["seconds"])), max(cost, counted)
        spent += 0.0 if run is known else counted
        work = dict(run.info["work"])
        if run.status != "ok":
            return _Result(run.status, run.reason, unknown, cost, spent, seconds, work)
        worst = {name: _worst(worst[name], value) for name, value in measure_all(run, context).items()}
        fastest = np.fmax(fastest, np.fmax.reduce(np.hypot(run.velocity[..., 0], run.velocity[..., 1]), axis=0))
        farthest = max(filter(None, (farthest, worst_error(run, context))), key=lambda each: each.error, default=None)
    return _Result("ok", None, worst, cost, spent, seconds, work, fastest, farthest)


def _worst(a: float | None, b: float | None) -> float | None:
    if a is None or b is None:
        return a if b is None else b
    return math.nan if math.isnan(a) or math.isnan(b) else max(a, b)
