"""Invariants of a run: drift of energy and momentum, and constraint violation of joints."""

import math
from typing import NamedTuple

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.measure.metrics.clearance import rotate_points
from sandbox.measure.metrics.energy import energies
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.contacts import contact_matrix
from sandbox.scene.compile.demands import AIR, Demand, demands
from sandbox.scene.compile.joint_arrays import MOTORS, JointArrays, JointKind
from sandbox.scene.compile.potential import both_present, is_broken_at, turned_by
from sandbox.scene.compile.scene import Scene
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.world import Settings
from sandbox.scene.geometry.shapes import UNTURNABLE
from sandbox.trajectory import Trajectory

AT_REST_FRACTION = 1e-4
"""A scene with other bodies than balls that can turn counts as at rest if its kinetic energy is below this fraction of
the energy that lifts all bodies by their own width. Its motion is then an artefact of the solver, and a relative drift
means nothing.
"""


class EnergyDrift(NamedTuple):
    """Energy drift as a fraction of the kinetic energy, and its reference."""

    fraction: float | None
    against: str
    """`truth` or `start`"""


def energy_drift(run: Trajectory, scene: Scene, truth: Trajectory | None, trusted: bool) -> EnergyDrift:
    """Return the change of the total energy over a run as a fraction of the largest kinetic energy of any frame.

    If the truth is trusted to the end, its energy change is subtracted first, so that impacts and drag do not count;
    otherwise the change is relative to the start. The kinetic energy is the truth's if there is one. Unlike the total
    energy, it does not depend on the zero of the potential energy. None if the run did not reach its end, or if its
    energy changed while nothing moved; a stack of boxes at rest (`AT_REST_FRACTION`) does not count as moving.

    Args:
        run: the run.
        scene: scene of the run.
        truth: truth of the scene.
        trusted: whether the truth is trusted to the end.
    """
    against = "truth" if trusted and truth is not None else "start"
    if not len(run.time) or run.status != "ok":
        return EnergyDrift(None, against)
    run_energy = energies(run, scene)
    change, scale = float(run_energy.total[-1] - run_energy.total[0]), float(run_energy.kinetic.max())
    if truth is not None:
        truth_energy = energies(truth, scene)
        scale = float(truth_energy.kinetic.max())
        if trusted:
            change -= float(truth_energy.total[-1] - truth_energy.total[0])
    bodies = scene.bodies
    can_rest = not bodies.round.all() or (bodies.moment >= UNTURNABLE).any()  # a ball on a slope rolls
    if can_rest and scale < AT_REST_FRACTION * _lift_energy(scene):
        return EnergyDrift(0.0 if change == 0.0 else None, against)
    return EnergyDrift(_ratio(change, scale), against)


def conserves_energy(scene: Scene) -> bool:
    """Return whether a scene conserves energy.

    It has no drag, lift, damping, limit of speed, friction, damper, thrust, tyre, drive, liquid, event, motor or
    kinematic body, no joint that gives way or that jerks a body when it becomes taut, and elastic contacts.
    """
    acts = scene.thrusts or scene.drives or scene.events
    if demands(scene) & (AIR | {Demand.SPEED_LIMITS, Demand.BUOYANCY, Demand.TYRES}) or acts:
        return False
    if scene.bodies.kinematic.any():
        return False
    springs, motors = (
        scene.joint_arrays.of(JointKind.SPRING, JointKind.ROTARY_SPRING),
        scene.joint_arrays.of(*MOTORS),
    )
    slides = scene.joint_arrays.of(JointKind.SLIDE)
    if springs.figures[:, 2].any() or len(motors) or len(slides) or scene.joint_arrays.is_limited.any():
        return False
    matrix = contact_matrix(scene)
    elastic = (matrix.surfaces.restitution == 1.0) & matrix.surfaces.fixed_coefficients
    return bool(elastic[matrix.touching].all() and matrix.friction == 0.0)


def energy_gain(run: Trajectory, scene: Scene) -> float:
    """Return the largest excess of the energy over its initial value, as a fraction of the exchanged energy.

    It is 0 if work is done on the scene, or if the initial energy is not finite. The exchanged energy is the initial
    kinetic energy and the energy that gravity, springs and attraction gave or took; at least the energy that lifts each
    body by its own width. Energy that explicit Euler adds in free flight, m·g²·h·t/2, does not count.
    """
    joints = scene.joint_arrays
    if scene.thrusts or scene.drives or scene.events or any(scene.world.wind) or len(joints.of(*MOTORS)):
        return 0.0
    if scene.bodies.kinematic.any() or any(tyre.drive > 0.0 for tyre in scene.tyres):
        return 0.0
    matrix = contact_matrix(scene)
    if matrix.surfaces.kicks.any() or matrix.moving_surfaces:
        return 0.0
    energy = energies(run, scene)
    total = energy.total
    if not math.isfinite(total[0]):  # attracting bodies start at one point: their potential is infinite
        return 0.0
    with np.errstate(over="ignore", invalid="ignore"):
        gain = float(np.nanmax(total - total[0] - _flight_gain(run, scene)))
        exchanged = float(energy.kinetic[0]) + float(np.nanmax(np.abs(energy.potential - energy.potential[0])))
        exchanged = max(exchanged, _lift_energy(scene))
    if not math.isfinite(gain):
        return math.inf
    return gain / exchanged if exchanged > 0.0 else 0.0


def _flight_gain(run: Trajectory, scene: Scene) -> FloatArray:
    """Return the energy that explicit Euler adds in one flight up to each frame, (T,) J; 0 for other integrators."""
    settings, gravity = Settings.model_validate(run.info["settings"]), math.hypot(*scene.world.gravity)
    if gravity == 0.0 or settings.half_kick or settings.integrator != "explicit_euler":
        return np.zeros(len(run.time))
    bodies, gain = scene.bodies, np.zeros(len(run.time))
    twice_fastest = 2.0 * float(np.nanmax(np.hypot(*np.moveaxis(run.velocity, 2, 0)), initial=0.0))
    for scale in np.unique(np.abs(bodies.gravity_scale)).tolist():
        if scale > 0.0:
            mass = bodies.mass[~bodies.fixed & (np.abs(bodies.gravity_scale) == scale)].sum()
            pull = scale * gravity
            gain += 0.5 * mass * pull**2 * settings.h * np.minimum(run.time, twice_fastest / pull)
    return gain


def _lift_energy(scene: Scene) -> float:
    """Return the energy that lifts every body by its own width, J."""
    bodies = scene.bodies
    weight = np.where(bodies.fixed, 0.0, bodies.mass * np.abs(bodies.gravity_scale)) * math.hypot(*scene.world.gravity)
    return float(weight @ (2.0 * bodies.thin))


def momentum_drift(run: Trajectory, scene: Scene) -> float | None:
    """Return the unexplained momentum at the end as a fraction of the largest Σ|m v| of any frame.

    Gravity explains momentum, and so do the recorded impulses between moving and static bodies; joints and attraction
    between moving bodies conserve momentum. None with drag, lift, damping, speed limits, thrusts, tyres, drives,
    events, joints or attraction between moving and static bodies, or zones that stop or lift bodies, whose impulses are
    not recorded; if a body was retired with its momentum; with kinematic bodies; or if the run did not reach its end.
    """
    bodies, world = scene.bodies, scene.world
    if run.status != "ok" or np.isfinite(run.retired_time).any():
        return None
    if demands(scene) & (AIR | {Demand.SPEED_LIMITS, Demand.EVENTS, Demand.TYRES}):
        return None
    if scene.thrusts or scene.drives or _acts_on_static(scene):
        return None
    if any(zone.moves_bodies for zone in scene.zones) or bodies.kinematic.any():
        return None
    mass = np.where(bodies.fixed, 0.0, bodies.mass)
    explained = (mass @ bodies.gravity_scale) * np.asarray(world.gravity) * run.time[-1]
    is_static = np.append(bodies.fixed, np.ones(len(scene.fixed_names), dtype=np.bool_))  # −1 − k counts from the end
    first, second = (is_static[run.contact_pair[:, side]] for side in (0, 1))
    explained = explained - run.contact_impulse[~first & second].sum(axis=0)
    explained = explained + run.contact_impulse[first & ~second].sum(axis=0)
    momentum = np.einsum("n,tnk->tk", mass, run.velocity[[0, -1]])
    scale = max(float(np.hypot(*np.moveaxis(frame, 1, 0)) @ mass) for frame in run.velocity)
    return _ratio(float(np.hypot(*(momentum[1] - momentum[0] - explained))), scale)


def _acts_on_static(scene: Scene) -> bool:
    """Return whether a joint, the wheel of a pulley, or an attraction acts between a moving and a static body."""
    bodies, joints = scene.bodies, scene.joint_arrays
    static = {name for name, fixed in zip(bodies.names, bodies.fixed.tolist(), strict=True) if fixed}
    is_attracted = any(not isinstance(each.toward, str) or each.toward in static for each in scene.attractions)
    is_held = (joints.a < 0) | (joints.kind == JointKind.PULLEY) | bodies.fixed[joints.a] | bodies.fixed[joints.b]
    return is_attracted or bool(is_held.any())


def _ratio(change: float, scale: float) -> float | None:
    if change == 0.0:
        return 0.0
    return change / scale if math.isfinite(change) and math.isfinite(scale) and scale > 0.0 else None


CHUNK = 2_000_000
"""Frames × joints that are processed at once."""

CONSTRAINT_KINDS = (
    JointKind.ROD,
    JointKind.PIVOT,
    JointKind.SLIDE,
    JointKind.GROOVE,
    JointKind.ROTARY_LIMIT,
    JointKind.GEAR,
    JointKind.PULLEY,
)
"""Kinds of joints that are constraints with an error; springs, motors and ratchets are not."""


ANGLE_KINDS = (JointKind.ROTARY_LIMIT, JointKind.GEAR)
"""Kinds of joints whose error is an angle"""


def has_constraints(joints: JointArrays) -> bool:
    """Return whether a joint has an error: one of `CONSTRAINT_KINDS` that does not give way."""
    return bool((np.isin(joints.kind, CONSTRAINT_KINDS) & ~joints.is_limited).any())


def joint_errors(trajectory: Trajectory, start: Scene | Setup) -> FloatArray:
    """Return the error of each joint in each frame, (T, J).

    It is nan for springs, motors, ratchets, joints that may give way (`JointArrays.is_limited`), and joints that broke
    or lost a body. In m: of a rod |l − length|, of a pivot the distance of its two points, of a slide the excess of the
    distance over its bounds, of a groove the distance of the point from the groove, of a pulley the stretch of its
    rope. In rad: of a rotary limit the excess of the angle over its bounds, of a gear |angle_b·ratio − angle_a −
    phase|. The error of a diverged state is infinite.

    Args:
        trajectory: the run; its first bodies are those of `start`.
        start: scene or setup with the joints.
    """
    joints = Setup.of(start).joints
    found = np.full((len(trajectory.time), len(joints)), np.nan)
    breaks = trajectory.breaks(len(joints))
    step = max(1, CHUNK // max(1, len(joints)))
    for begin in range(0, len(found), step):
        rows = slice(begin, begin + step)
        there = both_present(joints, trajectory.present(rows)) & ~is_broken_at(breaks, trajectory.time[rows])
        found[rows] = _errors(joints, trajectory.position[rows], trajectory.angle[rows], there)
    return found


def starting_errors(scene: Scene) -> FloatArray:
    """Return the error of each joint at the start of a scene, (J,), as in `joint_errors`."""
    bodies, joints = scene.bodies, scene.joint_arrays
    present = np.ones((1, len(joints)), np.bool_)
    return np.asarray(_errors(joints, bodies.position[None], bodies.angle[None], present)[0])


class JointError(NamedTuple):
    """Largest relative error of any joint in a run."""

    relative: float
    """fraction of a length (`joint_scales`), or rad"""
    name: str
    """of the joint"""
    error: float
    """m or rad"""
    unit: str
    """m or rad"""


def joint_error(trajectory: Trajectory, start: Scene | Setup) -> JointError | None:
    """Return the largest relative error of any joint in any frame; None if the scene has no constraint.

    Lengths are relative to the length of the rod or rope, or the bound of the slide; if that is negligible, and for
    pivots and grooves, to the size of the smaller moving body (`joint_scales`). Angles are in rad. Only recorded frames
    count, so that with `record_every` larger errors can occur between them. The error of a diverged state is infinite.
    """
    setup = Setup.of(start)
    joints = setup.joints
    if not has_constraints(joints) or not len(trajectory.time):
        return None
    errors = joint_errors(trajectory, setup)
    largest: FloatArray = np.where(np.isnan(errors), -1.0, errors).max(axis=0)
    if not (largest >= 0.0).any():
        return None
    relative = largest / joint_scales(joints, setup.bodies)
    worst = int(relative.argmax())
    unit = "rad" if joints.kind[worst] in ANGLE_KINDS else "m"
    return JointError(float(relative[worst]), joints.names[worst], float(largest[worst]), unit)


def joint_scales(joints: JointArrays, bodies: Bodies) -> FloatArray:
    """Return the scale of the error of each joint, (J,): a length in m, or 1 rad.

    It is the first of these lengths that is not `NEGLIGIBLE` against the largest of them: the length of the rod or
    rope, or the bound of the slide; the diameter of the smaller body, and of the larger one; the longer arm of the
    anchors. A body that cannot move does not count beside one that can: a static body may be a point.
    """
    length = np.where(np.isin(joints.kind, (JointKind.ROD, JointKind.PULLEY)), joints.figures[:, 0], 0.0)
    length = np.where(joints.kind == JointKind.SLIDE, joints.figures[:, 1], length)
    ends = np.column_stack((joints.a, joints.b))
    arms = np.hypot(*np.stack((joints.anchor_a, joints.anchor_b)).transpose(2, 1, 0))
    counts = (ends >= 0) & ~bodies.immovable[ends]
    counts |= (ends >= 0) & ~counts.any(axis=1, keepdims=True)
    diameter = 2.0 * bodies.radius[ends]
    small = np.where(counts, diameter, np.inf).min(axis=1)
    large, arm = (np.where(counts, each, 0.0).max(axis=1) for each in (diameter, arms))
    candidates = np.column_stack((length, small, large, arm))
    first = (candidates > NEGLIGIBLE * candidates.max(axis=1, keepdims=True)).argmax(axis=1)
    turning = np.isin(joints.kind, ANGLE_KINDS)
    return np.asarray(np.where(turning, 1.0, candidates[np.arange(len(first)), first]))


NEGLIGIBLE = 1e-3
"""Fraction of the largest length of a joint and its bodies below which a length is no scale of an error."""


def _errors(joints: JointArrays, position: FloatArray, angle: FloatArray, present: BoolArray) -> FloatArray:
    x, y, _ = joints.figures.T
    # The distances of a diverged state are infinite.
    with np.errstate(over="ignore", invalid="ignore"):
        first, second = joints.ends(position, angle)
        apart = np.hypot(*np.moveaxis(second - first, 2, 0))
        to_first = np.hypot(*np.moveaxis(first - joints.wheels[:, :2], 2, 0))
        to_second = np.hypot(*np.moveaxis(second - joints.wheels[:, 2:], 2, 0))
        angle_a, angle_b = turned_by(joints, angle)
        by_kind = {
            JointKind.ROD: np.abs(apart - x),
            JointKind.PIVOT: apart,
            JointKind.SLIDE: np.maximum(x - apart, apart - y),
            JointKind.GROOVE: _from_groove(joints, position, angle, second),
            JointKind.ROTARY_LIMIT: np.maximum(x - (angle_b - angle_a), angle_b - angle_a - y),
            JointKind.GEAR: np.abs(angle_b * y - angle_a - x),
            JointKind.PULLEY: to_first + y * to_second - x,
        }
    found = np.full(present.shape, np.nan)
    for kind, error in by_kind.items():
        found = np.where(joints.kind == kind, np.maximum(np.where(np.isnan(error), math.inf, error), 0.0), found)
    return np.where(present & ~joints.is_limited, found, np.nan)


def _from_groove(joints: JointArrays, position: FloatArray, angle: FloatArray, point: FloatArray) -> FloatArray:
    """Return the distance of points (T, J, 2) from the grooves of their joints, (T, J) m."""
    start, _ = joints.ends(position, angle)
    rotation, along = np.where(joints.a >= 0, angle[:, joints.a], 0.0), joints.figures[:, :2] - joints.anchor_a
    line = rotate_points(along, rotation)
    squared = (along * along).sum(axis=1)
    offset = point - start
    fraction = (offset * line).sum(axis=2) / np.where(squared > 0.0, squared, 1.0)
    away = offset - fraction.clip(0.0, 1.0)[..., None] * line
    return np.asarray(np.hypot(away[..., 0], away[..., 1]))
