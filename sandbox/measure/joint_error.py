"""Joint error: how far joints are from what they should hold, frame by frame."""

import math

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.joint_arrays import JointArrays, LinkKind
from sandbox.scene.compile.potential import both_present, ends_over_time, is_broken_at, turned_by
from sandbox.scene.compile.setup import Setup
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory

CHUNK = 2_000_000
"""Frames × joints worked on at once."""

HOLDING = (
    LinkKind.ROD,
    LinkKind.PIVOT,
    LinkKind.SLIDE,
    LinkKind.GROOVE,
    LinkKind.ROTARY_LIMIT,
    LinkKind.GEAR,
)
"""Kinds that hold something in place; springs and motors do not."""


def joint_errors(trajectory: Trajectory, start: Scene | Setup) -> FloatArray:
    """Return how far each joint is off in each frame, (T, J); nan once it broke or lost a body, of springs, of motors.

    Of a rod |l − length|, of a pivot the distance of its two points, of a slide how far the distance is beyond its
    bounds, of a groove how far the point is from the groove, in m. Of a rotary limit how far the angle is beyond its
    bounds, of a gear |angle_b·ratio − angle_a − phase|, in rad. A state that has diverged is infinitely far off.

    Args:
        trajectory: the run; its first bodies are those of `start`.
        start: scene or setup whose joints.
    """
    links = Setup.of(start).links
    found = np.full((len(trajectory.time), len(links)), np.nan)
    gone = np.where(np.isnan(trajectory.retired_time), np.inf, trajectory.retired_time)
    breaks = trajectory.breaks(len(links))
    step = max(1, CHUNK // max(1, len(links)))
    for begin in range(0, len(found), step):
        rows = slice(begin, begin + step)
        there = both_present(links, trajectory.time[rows, None] < gone) & ~is_broken_at(breaks, trajectory.time[rows])
        found[rows] = _errors(links, trajectory.position[rows], trajectory.angle[rows], there)
    return found


def starting_errors(scene: Scene) -> FloatArray:
    """Return how far each joint is off as a scene starts, (J,), as `joint_errors` does."""
    bodies, links = scene.bodies, scene.links
    there = np.ones((1, len(links)), np.bool_)
    return np.asarray(_errors(links, bodies.position[None], bodies.angle[None], there)[0])


def joint_error(trajectory: Trajectory, start: Scene | Setup) -> float | None:
    """Return the largest error of any joint in any frame, as a share; None where the scene has no joint that holds.

    Of lengths it is the share of the rod's length or of the slide's bound; where that is 0, and of pivots and
    grooves, of the diameter of the smaller body. Of angles it is the error in rad. It is of the frames that were
    kept, so that with `record_every` a larger one may have passed unseen. Infinite where a state has diverged.
    """
    setup = Setup.of(start)
    links = setup.links
    if not np.isin(links.kind, HOLDING).any() or not len(trajectory.time):
        return None
    errors = joint_errors(trajectory, setup) / sizes(links, setup.bodies)
    there = errors[~np.isnan(errors)]
    return float(there.max()) if len(there) else None


def sizes(links: JointArrays, bodies: Bodies) -> FloatArray:
    """Return what the error of each link is a share of, (J,): a length in m, or 1 rad."""
    own = 2.0 * np.minimum(bodies.radius[links.b], np.where(links.a >= 0, bodies.radius[links.a], np.inf))
    length = np.where(links.kind == LinkKind.ROD, links.figures[:, 0], 0.0)
    length = np.where(links.kind == LinkKind.SLIDE, links.figures[:, 1], length)
    turning = np.isin(links.kind, (LinkKind.ROTARY_LIMIT, LinkKind.GEAR))
    return np.asarray(np.where(turning, 1.0, np.where(length > 0.0, length, own)))


def _errors(links: JointArrays, position: FloatArray, angle: FloatArray, there: BoolArray) -> FloatArray:
    x, y, _ = links.figures.T
    # A diverged state has no finite distance: that is its error, not a fault.
    with np.errstate(over="ignore", invalid="ignore"):
        first, second = ends_over_time(links, position, angle)
        apart = np.hypot(*np.moveaxis(second - first, 2, 0))
        angle_a, angle_b = turned_by(links, angle)
        by_kind = {
            LinkKind.ROD: np.abs(apart - x),
            LinkKind.PIVOT: apart,
            LinkKind.SLIDE: np.maximum(x - apart, apart - y),
            LinkKind.GROOVE: _from_groove(links, position, angle, second),
            LinkKind.ROTARY_LIMIT: np.maximum(x - (angle_b - angle_a), angle_b - angle_a - y),
            LinkKind.GEAR: np.abs(angle_b * y - angle_a - x),
        }
    found = np.full(there.shape, np.nan)
    for kind, error in by_kind.items():
        found = np.where(links.kind == kind, np.maximum(np.where(np.isnan(error), math.inf, error), 0.0), found)
    return np.where(there, found, np.nan)


def _from_groove(links: JointArrays, position: FloatArray, angle: FloatArray, point: FloatArray) -> FloatArray:
    """Return the distance of points (T, J, 2) from the grooves of their links, (T, J) m."""
    near, _ = ends_over_time(links, position, angle)
    turn, along = np.where(links.a >= 0, angle[:, links.a], 0.0), links.figures[:, :2] - links.anchor_a
    cos, sin = np.cos(turn), np.sin(turn)
    way = np.stack((cos * along[:, 0] - sin * along[:, 1], sin * along[:, 0] + cos * along[:, 1]), axis=2)
    squared = (along * along).sum(axis=1)
    offset = point - near
    share = (offset * way).sum(axis=2) / np.where(squared > 0.0, squared, 1.0)
    away = offset - share.clip(0.0, 1.0)[..., None] * way
    return np.asarray(np.hypot(away[..., 0], away[..., 1]))
