"""Metrics of the error. Each is a function of a run and its judge; None if it does not apply."""

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.measure.collisions import are_collisions, collisions, together
from sandbox.measure.compare.drift import energy_drift
from sandbox.measure.compare.gaps import gap
from sandbox.measure.compare.runs import common_frames, there
from sandbox.measure.joint_error import joint_error
from sandbox.measure.tradeoff.judge import Judge, strayed
from sandbox.trajectory import Trajectory

Measure = Callable[[Trajectory, Judge], float | None]


class Metric(NamedTuple):
    """Metric of the error."""

    name: str
    unit: str
    """unit; empty for counts and fractions"""
    about: str
    """description"""
    measure: Measure


def max_position(run: Trajectory, judge: Judge) -> float | None:
    """Return the largest distance of any body from the truth, m, in any frame that the truth is trusted in."""
    if judge.truth is None:
        return None
    return judge.errors(run).until(judge.until).max_position


def rms_position(run: Trajectory, judge: Judge) -> float | None:
    """Return the root of the mean square distance from the truth, m."""
    if judge.truth is None:
        return None
    return judge.errors(run).until(judge.until).rms_position


def final_position(run: Trajectory, judge: Judge) -> float | None:
    """Return the largest distance from the truth in the last frame that it is trusted in and any body is left, m."""
    if judge.truth is None:
        return None
    found = judge.errors(run)
    kept = np.flatnonzero((found.time <= judge.until) & (found.count > 0.0))
    return float(found.position[kept[-1]]) if len(kept) else None


def bounce_height(run: Trajectory, judge: Judge) -> float | None:
    """Return by how much any body's highest place after its first contact differs from the truth's, m.

    From the truth's first contact on, so that a body that fell through is told by the height it lacks. Both are looked
    at in the same frames, those that they share. None without gravity, or where nothing is touched.
    """
    if judge.truth is None or judge.down is None:
        return None
    truth = judge.truth.trajectory
    mine, its = common_frames(run, truth)
    both = there(run, mine) & there(truth, its) & (truth.time[its] <= judge.until)[:, None]
    worst, hits = None, are_collisions(truth)
    for number in np.flatnonzero(judge.moving).tolist():
        touched = truth.contact_time[(truth.contact_pair == number).any(axis=1) & hits]
        kept = both[:, number] & (truth.time[its] >= np.min(touched, initial=np.inf))
        if kept.any():
            own, right = run.position[mine[kept], number], truth.position[its[kept], number]
            off = abs(_highest(own, judge.down) - _highest(right, judge.down))
            worst = off if worst is None else max(worst, off)
    return worst


def _highest(places: FloatArray, down: FloatArray) -> float:
    return -float((places @ down).min()) if np.isfinite(places).all() else math.inf


def energy(run: Trajectory, judge: Judge) -> float | None:
    """Return what energy drifted by, as a share of the energy in motion (`compare.drift`)."""
    truth = None if judge.truth is None else judge.truth.trajectory
    share = energy_drift(run, judge.scene, truth, judge.until == judge.scene.world.duration).share
    return None if share is None else abs(share)


def joints(run: Trajectory, judge: Judge) -> float | None:
    """Return the largest error of any joint, as a share (`measure.joint_error`)."""
    return joint_error(run, judge.scene)


def penetration(run: Trajectory, judge: Judge) -> float | None:
    """Return the deepest overlap of any two that touched, in any frame, m. None where nothing touches.

    An overlap that is there in the first frame is the scene's, not the engine's: of such a pair only that counts by
    which the two get deeper again than they have been since.
    """
    pairs = np.unique(run.contact_pair[are_collisions(run)], axis=0)
    if not len(pairs):
        return None
    scene = judge.scene
    with np.errstate(over="ignore", invalid="ignore"):
        gaps = [gap(scene, scene.bodies, run.position, run.angle, (a, b)) for a, b in pairs.tolist()]
        gaps = [np.where(together(run, scene, (a, b)), each, np.inf) for each, (a, b) in zip(gaps, pairs, strict=True)]
        depths = [np.maximum(0.0, -each) for each in gaps]
        return max(float(np.nanmax(each - np.fmin.accumulate(each), initial=0.0)) for each in depths)


def drift(run: Trajectory, judge: Judge) -> float | None:
    """Return how far any body gets that lies still in the truth, m. None where none does.

    A body that stands still in the truth from the start on, as in a stack, is followed from the start on; one that
    comes to rest there, through the second half of the run.
    """
    if not judge.still.any():
        return None
    standing = strayed(run, since=0.0)[judge.standing].max(initial=0.0)
    return float(max(standing, strayed(run)[judge.still].max()))


def missed_contacts(run: Trajectory, _: Judge) -> float | None:
    """Return how many contacts the engine never saw, by sweeping its own steps."""
    count = run.missed_contacts
    return None if count is None else float(count)


def passes(run: Trajectory, _: Judge) -> float | None:
    """Return the share of all meetings that were passed through unseen: 0.1 is 1 bullet in 10. None without any."""
    missed = run.missed_contacts
    if missed is None or not missed + collisions(run):
        return None
    return missed / (missed + collisions(run))


def settle_time(run: Trajectory, judge: Judge) -> float | None:
    """Return by how much the time at which all has settled differs from the truth's, s; infinite if it never does.

    None where the truth does not settle, or is not trusted to its end.
    """
    if judge.truth is None or judge.until < judge.scene.world.duration:
        return None
    own, right = _settled(run, judge), _settled(judge.truth.trajectory, judge)
    return None if math.isinf(right) else abs(own - right)


def _settled(run: Trajectory, judge: Judge) -> float:
    """Return the time of the first frame from which on every body is slow, s; inf for never."""
    with np.errstate(over="ignore", invalid="ignore"):
        speed = np.hypot(*np.moveaxis(run.velocity, 2, 0))
        loud = np.flatnonzero((~(speed <= judge.quiet))[:, judge.moving].any(axis=1))
    if not len(loud):
        return 0.0
    return float(run.time[loud[-1] + 1]) if loud[-1] + 1 < len(run.time) else math.inf


def pixels(run: Trajectory, judge: Judge) -> float | None:
    """Return the largest distance from the truth on the screen, px."""
    away = max_position(run, judge)
    return None if away is None else away * judge.zoom


METRICS: Mapping[str, Metric] = {
    metric.name: metric
    for metric in (
        Metric("max_position", "m", "largest distance from the truth", max_position),
        Metric("final_position", "m", "distance from the truth at the end", final_position),
        Metric("rms_position", "m", "root of the mean square distance from the truth", rms_position),
        Metric("pixels", "px", "largest distance from the truth on the screen", pixels),
        Metric("bounce_height", "m", "error of the bounce height", bounce_height),
        Metric("energy", "", "drift of the energy as a fraction of the kinetic energy", energy),
        Metric("joint_error", "", "largest error of a joint as a fraction of its length", joints),
        Metric("penetration", "m", "deepest overlap, apart from that at the start", penetration),
        Metric("drift", "m", "motion of bodies that should stay at rest", drift),
        Metric("missed_contacts", "", "contacts that the engine missed", missed_contacts),
        Metric("passes", "", "fraction of the contacts that were missed", passes),
        Metric("settle_time", "s", "error of the time when all bodies are at rest", settle_time),
    )
}


def measured(run: Trajectory, judge: Judge) -> dict[str, float | None]:
    """Return every metric of a run by name; all None where it has no frames."""
    if not len(run.time):
        return dict.fromkeys(METRICS)
    return {name: metric.measure(run, judge) for name, metric in METRICS.items()}
