"""Request of an advice, and the score of its settings: the metric, its tolerance, and the truth behind the errors."""

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

from sandbox.measure.compare.ground_truth import Truth, find_truth
from sandbox.measure.compare.metrics import METRICS, EvaluationContext, Metric
from sandbox.measure.metrics.trajectory_error import default_tolerance
from sandbox.measure.tradeoff.objective import choose_metric, default_metric_tolerance, less_margin
from sandbox.progress import ProgressCallback
from sandbox.recording import Recording
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from sandbox.scene.errors import SettingsError

MIN_TRUSTED_FRAMES = 10
"""Frames that a truth must be trusted for at least, so that errors are those of a motion."""
SAME_STEP = 1e-9
"""Relative: a dt that differs from a frame by less is that of a frame."""
MAX_DENOMINATOR = 1_000_000
"""Of a dt as a fraction of a second."""
MAX_SHARED_FACTOR = 64
"""Frames of a truth in a frame of the game, so that its frames are also those of the present dt."""
MAX_SHARED_FRAMES = 1_000_000
"""Frames × bodies of such a truth."""


@dataclass(frozen=True)
class AdviceRequest:
    """Arguments of `advise` after their check."""

    scene: Scene
    engine: str
    recording: Recording | None
    fps: float
    length: float
    """m, largest accepted error of a position"""
    margin: float
    """fraction of the tolerance that a recommended setting leaves unused"""
    budget: float | None
    zoom: float
    starts: int
    spread: float
    effort: float
    deadline: float
    repeats: int
    on_progress: ProgressCallback

    @property
    def frame(self) -> float:
        """Duration of a frame, s."""
        return 1.0 / self.fps

    @property
    def present(self) -> Settings:
        """The present setting; it is recorded about once a frame."""
        own = self.scene.solver
        every = max(1, math.floor(self.frame / own.dt * (1.0 + SAME_STEP)))
        return own.replace(record_every=every)

    @property
    def is_in_loop(self) -> bool:
        """Whether the present dt is that of a frame."""
        return abs(self.scene.solver.dt * self.fps - 1.0) <= SAME_STEP

    @property
    def loop(self) -> Settings:
        """The present setting with the dt of a frame; without substeps, unless it has that dt already."""
        substeps = self.scene.solver.substeps if self.is_in_loop else 1
        return self.scene.solver.replace(dt=self.frame, substeps=substeps, record_every=1)


class AdviceScore(NamedTuple):
    """Metric and tolerance of the errors, and the context that they are measured in."""

    metric: str
    tolerance: float
    """in the unit of the metric"""
    reason: str | None
    """reason why errors are no positions; None if they are"""
    invariant: str | None
    """metric that also holds beyond the predictability horizon; None if it is not needed"""
    invariant_tolerance: float | None
    """in its unit"""
    context: EvaluationContext
    """context at the frames of the game"""
    present: EvaluationContext
    """context at the frames of the present dt"""
    truth: Truth | str
    """truth at the frames of the game, or the reason why there is none"""
    margin: float
    """fraction of the tolerance that a recommended setting leaves unused"""

    @property
    def max_error(self) -> float:
        """Largest error of a recommended setting, in the unit of the metric: the tolerance less the margin."""
        return less_margin(self.tolerance, self.margin)


def find_score(request: AdviceRequest) -> AdviceScore:
    """Find the truth and choose the metric: positions, or an invariant if no truth is trusted for some frames."""
    scene, present, loop = request.scene, request.present, request.loop
    tolerance = min(default_tolerance(scene), less_margin(request.length, request.margin))
    shared = _shared_settings(request)
    truth = find_truth(scene, shared or loop, tolerance)
    own = truth if shared is not None else find_truth(scene, present, tolerance)
    context, present_context = (_context(scene, each, request.zoom) for each in (truth, own))
    trusted = truth.trusted_until if isinstance(truth, Truth) else 0.0
    metric, reason = choose_metric(context)
    if trusted >= min(MIN_TRUSTED_FRAMES * request.frame, scene.world.duration) and context.moving.any():
        invariant = metric.name if trusted < scene.world.duration and metric.name != "max_position" else None
        limit = None if invariant is None else _limit(metric, request)
        position = "max_position", request.length, None, invariant, limit
        return AdviceScore(*position, context, present_context, truth, request.margin)
    if metric.name == "max_position":  # until a time at which hardly anything has moved
        metric = METRICS["energy"]
    chosen = metric.name, _limit(metric, request), reason, None, None
    return AdviceScore(*chosen, context, present_context, truth, request.margin)


def _limit(metric: Metric, request: AdviceRequest) -> float:
    """Return the tolerance of a metric: that of positions for a length, otherwise the default."""
    return default_metric_tolerance(metric, request.length)


def _context(scene: Scene, truth: Truth | str, zoom: float) -> EvaluationContext:
    known, doubt = (truth, None) if isinstance(truth, Truth) else (None, truth)
    return EvaluationContext(scene, known, zoom, doubt)


def _shared_settings(request: AdviceRequest) -> Settings | None:
    """Return settings whose frames contain those of the game and of the present setting.

    None if these would be too many frames: each then has a truth of its own.
    """
    if request.is_in_loop:
        return request.loop
    steps = [Fraction(each).limit_denominator(MAX_DENOMINATOR) for each in (request.frame, request.scene.solver.dt)]
    if any(
        abs(float(each) * rate - 1.0) > SAME_STEP
        for each, rate in zip(steps, (request.fps, 1.0 / request.scene.solver.dt), strict=True)
    ):
        return None
    a, b = steps
    shared = Fraction(math.gcd(a.numerator * b.denominator, b.numerator * a.denominator), a.denominator * b.denominator)
    frames = request.scene.world.duration / float(shared) * len(request.scene.bodies)
    if a / shared > MAX_SHARED_FACTOR or frames > MAX_SHARED_FRAMES:
        return None
    try:
        return request.loop.replace(dt=float(shared))
    except SettingsError:  # shorter than a dt may be
        return None
