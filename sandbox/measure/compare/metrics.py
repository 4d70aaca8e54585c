"""Metrics of the error of a run, and the context in which they are evaluated.

A new metric is a function and a row of `METRICS`; with a `head` it is also a column of comparisons.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.measure.compare.ground_truth import Truth
from sandbox.measure.metrics.clearance import clearance, posed_pieces
from sandbox.measure.metrics.contacts import are_collisions, collisions, share_layer
from sandbox.measure.metrics.invariants import ANGLE_KINDS, energy_drift, joint_error, joint_errors
from sandbox.measure.metrics.trajectory_error import Errors, common_frames, errors
from sandbox.scene.compile.scene import Scene
from sandbox.trajectory import Trajectory

SCREEN_SIZE = 1280.0, 720.0
"""px, window in which a scene is assumed to be drawn."""
SCREEN_FILL = 0.9
"""Fraction of the window that the motion fills."""
DEFAULT_ZOOM = 100.0
"""px/m, where the extent of the motion gives none."""
REST_FRACTION = 0.01
"""Fraction of its half width by which a body may move in the second half of a run and still count as at rest."""


@dataclass(frozen=True, eq=False)
class EvaluationContext:
    """Reference of the scores of runs: scene, truth and scale."""

    scene: Scene
    """the scene, with the seed of this context"""
    truth: Truth | None
    """truth of the scene; None if there is none"""
    zoom: float = DEFAULT_ZOOM
    """px/m, scale of errors in pixels"""
    doubt: str | None = None
    """reason why there is no truth, if known"""
    _last_errors: list[tuple[Trajectory, Errors]] = field(default_factory=list, init=False, repr=False)

    @property
    def until(self) -> float:
        """Time up to which positions are compared with the truth, s."""
        return self.scene.world.duration if self.truth is None else self.truth.trusted_until

    @cached_property
    def moving(self) -> BoolArray:
        """Mask of the bodies that can move, (N,)."""
        return ~self.scene.bodies.fixed

    @cached_property
    def down(self) -> FloatArray | None:
        """Unit vector of gravity, (2,); None without gravity."""
        strength = math.hypot(*self.scene.world.gravity)
        return np.asarray(self.scene.world.gravity) / strength if strength > 0.0 else None

    @cached_property
    def rest_speed(self) -> FloatArray:
        """Speed below which each body counts as at rest, (N,) m/s.

        With gravity, it is the speed after a fall of 1 % of the half width; without, 1/1000 of the largest initial
        speed.
        """
        bodies, gravity = self.scene.bodies, math.hypot(*self.scene.world.gravity)
        if gravity > 0.0:
            return np.sqrt(2.0 * gravity * REST_FRACTION * bodies.thin)
        return np.full(len(bodies), 1e-3 * float(np.hypot(*bodies.velocity.T).max(initial=0.0)))

    @cached_property
    def left_at(self) -> FloatArray:
        """Time at which the truth has each body below everything that could stop it, (N,) s; inf if it never is.

        From then on it does not count: how far it has fallen says nothing about the level that it has left.
        """
        if self.truth is None or self.down is None:
            return np.full(len(self.scene.bodies), np.inf)
        times = times_of_leaving(self.scene, self.truth.trajectory, self.down)
        return np.where(self.scene.bodies.gravity_scale > 0.0, times, np.inf)  # others may come back

    def errors(self, run: Trajectory) -> Errors:
        """Return the errors of a run against the truth. Those of the last run are kept: several metrics need them."""
        assert self.truth is not None
        for known, found in self._last_errors:
            if known is run:
                return found
        self._last_errors[:] = [(run, errors(run, self.truth.trajectory, self.moving, self.left_at))]
        return self._last_errors[0][1]

    @cached_property
    def at_rest(self) -> BoolArray:
        """Mask of the moving bodies that the truth has at rest in its second half, (N,); all False without a truth."""
        if self.truth is None or not len(self.truth.trajectory.time):
            return np.zeros(len(self.scene.bodies), dtype=np.bool_)
        distance = displacement(self.truth.trajectory)
        return np.asarray(self.moving & (distance <= REST_FRACTION * self.scene.bodies.thin))

    @cached_property
    def always_at_rest(self) -> BoolArray:
        """Mask of the bodies at rest that never leave their initial position in the truth, (N,)."""
        if not self.at_rest.any():
            return self.at_rest
        assert self.truth is not None
        distance = displacement(self.truth.trajectory, since=0.0)
        return np.asarray(self.at_rest & (distance <= REST_FRACTION * self.scene.bodies.thin))


def times_of_leaving(scene: Scene, run: Trajectory, down: FloatArray) -> FloatArray:
    """Return the time from which on each body is below all walls, posts, fixed and driven bodies, (N,) s; else inf.

    Bodies that joints or attraction hold do not leave, nor those of a scene with a plane, a liquid or tyres, or without
    any such obstacle.
    """
    bodies = scene.bodies
    left = np.full(len(bodies), np.inf)
    has_obstacles = scene.walls or scene.posts or bodies.immovable.any()
    if scene.planes or scene.attractions or scene.liquids or scene.tyres or not has_obstacles:
        return left
    depths = [float((np.asarray(each.points) @ down).max()) + each.thickness / 2.0 for each in scene.walls]
    depths += [float(np.asarray(each.position) @ down) + each.radius for each in scene.posts]
    # A static body may be a whole level, far smaller than the disc about it.
    for number in np.flatnonzero(bodies.fixed).tolist():
        pieces = posed_pieces(bodies, number, bodies.position[number][None], bodies.angle[number][None])
        depths += [float((corners[0] @ down).max()) + radius for corners, radius in pieces]
    driven = bodies.immovable & ~bodies.fixed
    with np.errstate(over="ignore", invalid="ignore"):
        depth = run.position @ down
        carrying = np.where(np.isfinite(depth), depth, -np.inf)[:, driven] + bodies.radius[driven]
        lowest = max([*depths, float(carrying.max(initial=-np.inf))])
        is_below = depth - bodies.radius > lowest
    able = ~bodies.immovable
    able[np.concatenate((scene.joint_arrays.a[scene.joint_arrays.a >= 0], scene.joint_arrays.b))] = False
    # The last frame above decides: a body may be thrown up again from below, as by a thrust.
    above = len(run.time) - (~is_below)[::-1].argmax(axis=0)
    above = np.where(is_below.all(axis=0), 0, above)
    for k in np.flatnonzero(able & (above < len(run.time))).tolist():
        left[k] = run.time[above[k]]
    return left


def displacement(run: Trajectory, since: float = 0.5) -> FloatArray:
    """Return the largest distance of each body, in the last part of a run, from its position at the start of that part.

    Args:
        run: the run.
        since: start of the part as a fraction of the duration; default: the second half.

    Returns:
        (N,) m.
    """
    part = run.position[run.time >= since * run.time[-1]]
    # A diverged state is infinitely far away.
    with np.errstate(over="ignore", invalid="ignore"):
        distance = np.hypot(*np.moveaxis(part - part[0], 2, 0)).max(axis=0)
    return np.where(np.isnan(distance), np.inf, distance)


def default_zoom(scene: Scene, truth: Truth | None) -> float:
    """Return the zoom at which all positions of the motion fill a window of 1280 × 720, px/m."""
    bodies = scene.bodies
    positions = bodies.position[None] if truth is None else truth.trajectory.position
    reach = bodies.radius[:, None]
    with np.errstate(invalid="ignore"):
        low = np.nanmin(positions - reach, axis=(0, 1), initial=np.inf)
        high = np.nanmax(positions + reach, axis=(0, 1), initial=-np.inf)
    size = high - low
    if not (np.isfinite(size).all() and (size > 0.0).all()):
        return DEFAULT_ZOOM
    return float(min(SCREEN_FILL * SCREEN_SIZE[0] / size[0], SCREEN_FILL * SCREEN_SIZE[1] / size[1]))


class WorstError(NamedTuple):
    """Largest distance of a body from the truth."""

    body: str
    """name of the body"""
    time: float
    """s"""
    position: tuple[float, float]
    """m, where the run has it"""
    error: float
    """m"""


def worst_error(run: Trajectory, context: EvaluationContext) -> WorstError | None:
    """Return body, time and place of the largest error; None without a truth or a body that counts."""
    if context.truth is None:
        return None
    found = context.errors(run)
    kept = np.flatnonzero((found.time <= context.until) & (found.count > 0.0))
    if not len(kept):
        return None
    k = kept[int(found.position[kept].argmax())]
    body, time = int(found.body[k]), float(found.time[k])
    x, y = run.position[int(np.searchsorted(run.time, time)), body].tolist()
    return WorstError(str(run.names[body]), time, (x, y), float(found.position[k]))


Measure = Callable[[Trajectory, EvaluationContext], float | None]


class Metric(NamedTuple):
    """Metric of the error."""

    name: str
    unit: str
    """unit; empty for counts and fractions"""
    about: str
    """description"""
    measure: Measure
    head: str | None = None
    """head of its column in a comparison; None if it has none"""
    is_difference: bool = False
    """whether it is a difference from the truth, and so 0 of the truth itself"""


def largest(quantity: str) -> Measure:
    """Return the metric of the largest deviation of any body from the truth, while the truth is trusted."""

    def measure(run: Trajectory, context: EvaluationContext) -> float | None:
        return None if context.truth is None else context.errors(run).largest(quantity, context.until)

    return measure


def root_mean_square(quantity: str) -> Measure:
    """Return the metric of the root mean square deviation from the truth, over bodies and frames, likewise."""

    def measure(run: Trajectory, context: EvaluationContext) -> float | None:
        return None if context.truth is None else context.errors(run).root_mean_square(quantity, context.until)

    return measure


def final_position(run: Trajectory, context: EvaluationContext) -> float | None:
    """Return the largest distance from the truth, m, in the last trusted frame that has a body."""
    if context.truth is None:
        return None
    found = context.errors(run)
    kept = np.flatnonzero((found.time <= context.until) & (found.count > 0.0))
    return float(found.position[kept[-1]]) if len(kept) else None


def bounce_height(run: Trajectory, context: EvaluationContext) -> float | None:
    """Return the largest error of a body's highest position after its first contact, m.

    The first contact is that of the truth, so that a body that tunnelled counts with the height that it lacks. Both
    heights are of the frames that run and truth share. None without gravity or without contacts.
    """
    if context.truth is None or context.down is None:
        return None
    truth = context.truth.trajectory
    frames, truth_frames = common_frames(run, truth)
    time = truth.time[truth_frames]
    both = run.present(frames) & truth.present(truth_frames) & (time <= context.until)[:, None]
    worst, hits = None, are_collisions(truth)
    for body in np.flatnonzero(context.moving).tolist():
        contacts = truth.contact_time[(truth.contact_pair == body).any(axis=1) & hits]
        kept = both[:, body] & (time >= np.min(contacts, initial=np.inf))
        if kept.any():
            positions, true_positions = run.position[frames[kept], body], truth.position[truth_frames[kept], body]
            error = abs(_highest(positions, context.down) - _highest(true_positions, context.down))
            worst = error if worst is None else max(worst, error)
    return worst


def _highest(positions: FloatArray, down: FloatArray) -> float:
    return -float((positions @ down).min()) if np.isfinite(positions).all() else math.inf


def energy(run: Trajectory, context: EvaluationContext) -> float | None:
    """Return the energy drift as a fraction of the kinetic energy (`metrics.invariants.energy_drift`)."""
    truth = None if context.truth is None else context.truth.trajectory
    fraction = energy_drift(run, context.scene, truth, context.until == context.scene.world.duration).fraction
    return None if fraction is None else abs(fraction)


def joints(run: Trajectory, context: EvaluationContext) -> float | None:
    """Return the largest constraint violation of any joint as a fraction (`metrics.invariants.joint_error`)."""
    found = joint_error(run, context.scene)
    return None if found is None else found.relative


def joint_distance(run: Trajectory, context: EvaluationContext) -> float | None:
    """Return the largest constraint violation of any joint that is a length, m; None without such joints."""
    errors = joint_errors(run, context.scene)[:, ~np.isin(context.scene.joint_arrays.kind, ANGLE_KINDS)]
    known = errors[~np.isnan(errors)]
    return float(known.max()) if len(known) else None


def penetration(run: Trajectory, context: EvaluationContext) -> float | None:
    """Return the deepest overlap of any pair in contact, in any frame, m; None without contacts.

    An overlap in the first frame is a property of the scene, not of the engine. Of such a pair, only an increase of the
    depth after the overlap has decreased counts.
    """
    pairs = np.unique(run.contact_pair[are_collisions(run)], axis=0)
    if not len(pairs):
        return None
    scene = context.scene
    with np.errstate(over="ignore", invalid="ignore"):
        gaps = [clearance(scene, scene.bodies, run.position, run.angle, (a, b)) for a, b in pairs.tolist()]
        gaps = [np.where(share_layer(run, scene, (a, b)), gap, np.inf) for gap, (a, b) in zip(gaps, pairs, strict=True)]
        depths = [np.maximum(0.0, -gap) for gap in gaps]
        return max(float(np.nanmax(each - np.fmin.accumulate(each), initial=0.0)) for each in depths)


def drift(run: Trajectory, context: EvaluationContext) -> float | None:
    """Return the largest displacement of a body that the truth has at rest, m; None if there is no such body.

    A body that is at rest in the truth from the start, such as a box in a stack, counts from the start; a body that
    comes to rest counts in the second half of the run.
    """
    if not context.at_rest.any():
        return None
    always = displacement(run, since=0.0)[context.always_at_rest].max(initial=0.0)
    return float(max(always, displacement(run)[context.at_rest].max()))


def missed_contacts(run: Trajectory, _: EvaluationContext) -> float | None:
    """Return the number of contacts that the engine missed, as the audit counts them."""
    count = run.missed_contacts
    return None if count is None else float(count)


def passes(run: Trajectory, _: EvaluationContext) -> float | None:
    """Return the fraction of all contacts that were missed: 0.1 is 1 bullet in 10. None without contacts."""
    missed = run.missed_contacts
    if missed is None or not missed + collisions(run):
        return None
    return missed / (missed + collisions(run))


def settle_time(run: Trajectory, context: EvaluationContext) -> float | None:
    """Return the error of the time at which all bodies are at rest, s; infinite if the run never comes to rest.

    None if the truth does not come to rest or is not trusted to its end.
    """
    if context.truth is None or context.until < context.scene.world.duration:
        return None
    settled, true_settled = _settled(run, context), _settled(context.truth.trajectory, context)
    return None if math.isinf(true_settled) else abs(settled - true_settled)


def _settled(run: Trajectory, context: EvaluationContext) -> float:
    """Return the time of the first frame from which on every body is at rest, s; inf if there is none."""
    with np.errstate(over="ignore", invalid="ignore"):
        speed = np.hypot(*np.moveaxis(run.velocity, 2, 0))
        moves = np.flatnonzero((~(speed <= context.rest_speed))[:, context.moving].any(axis=1))
    if not len(moves):
        return 0.0
    return float(run.time[moves[-1] + 1]) if moves[-1] + 1 < len(run.time) else math.inf


def pixels(run: Trajectory, context: EvaluationContext) -> float | None:
    """Return the largest distance from the truth on the screen, px."""
    distance = largest("position")(run, context)
    return None if distance is None else distance * context.zoom


METRICS: Mapping[str, Metric] = {
    metric.name: metric
    for metric in (
        Metric(
            "max_position", "m", "largest distance from the truth", largest("position"), "max error", is_difference=True
        ),
        Metric("final_position", "m", "distance from the truth at the end", final_position, is_difference=True),
        Metric(
            "rms_position",
            "m",
            "root of the mean square distance from the truth",
            root_mean_square("position"),
            "rms error",
            is_difference=True,
        ),
        Metric(
            "max_velocity", "m/s", "largest error of a velocity", largest("velocity"), "max error", is_difference=True
        ),
        Metric(
            "rms_velocity",
            "m/s",
            "root of the mean square error of velocities",
            root_mean_square("velocity"),
            is_difference=True,
        ),
        Metric("max_angle", "rad", "largest error of an angle", largest("angle"), "max error", is_difference=True),
        Metric("pixels", "px", "largest distance from the truth on the screen", pixels, is_difference=True),
        Metric("bounce_height", "m", "error of the bounce height", bounce_height, is_difference=True),
        Metric("energy", "", "drift of the energy as a fraction of the kinetic energy", energy),
        Metric("joint_error", "", "largest error of a joint as a fraction of its length", joints),
        Metric("joint_distance", "m", "largest error of a joint", joint_distance),
        Metric("penetration", "m", "deepest overlap, apart from that at the start", penetration),
        Metric("drift", "m", "motion of bodies that should stay at rest", drift),
        Metric("missed_contacts", "", "contacts that the engine missed", missed_contacts),
        Metric("passes", "", "fraction of the contacts that were missed", passes),
        Metric("settle_time", "s", "error of the time when all bodies are at rest", settle_time, is_difference=True),
    )
}


def measure_all(run: Trajectory, context: EvaluationContext) -> dict[str, float | None]:
    """Return every metric of a run by name; all are None if the run has no frames."""
    if not len(run.time):
        return dict.fromkeys(METRICS)
    return {name: metric.measure(run, context) for name, metric in METRICS.items()}
