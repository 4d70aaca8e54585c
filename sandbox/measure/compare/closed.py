"""A whole run by formula: the solution of a scene as the trajectory that an engine without error would leave."""

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.common.lifetimes import SLACK
from sandbox.measure.closed_form import Solution, solution
from sandbox.measure.compare.runs import frames_as_run
from sandbox.measure.recorder import frame_count
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.description.world import Settings
from sandbox.scene.scene import Scene
from sandbox.trajectory import Trajectory


def frame_times(scene: Scene, settings: Settings) -> FloatArray:
    """Return when a run keeps frames, (T,) s: every n-th multiple of dt from 0, and the duration."""
    steps, part = frame_count(scene, settings)
    time: FloatArray = np.arange(0, steps + 1, settings.record_every, dtype=np.float64) * settings.dt
    if steps % settings.record_every or part:
        return np.append(time, scene.world.duration)
    time[-1] = scene.world.duration
    return time


def solved(scene: Scene, settings: Settings) -> Trajectory | None:
    """Return the run that formulas make of a scene, or None where they do not cover all of it (`closed_form`)."""
    found = solution(scene)
    return None if found is None else as_run(found, settings)


def as_run(found: Solution, settings: Settings) -> Trajectory:
    """Return a solution at the frames of a run, with its contacts.

    A body that leaves `world.bounds`, or whose life is over, is retired at the first frame of that. Contacts are in the
    order of time; from the bounce on after which a flight would be shorter than dt, a single row that lasts to the end.
    """
    scene = found.scene
    bodies, time = scene.bodies, frame_times(scene, settings)
    position, velocity, angle, spin = found.at(time)
    retired = _retire(scene, bodies, time, position, velocity, settings.dt)
    contacts = found.contacts(np.fmin(retired, scene.world.duration), settings.dt)
    return frames_as_run(scene, settings, time, (position, velocity, angle, spin), contacts, retired)


def _retire(
    scene: Scene, bodies: Bodies, time: FloatArray, position: FloatArray, velocity: FloatArray, dt: float
) -> FloatArray:
    """Stop what leaves the bounds, or whose life is over, at the first frame of that, in place; return when, (N,) s.

    It is nan for never.
    """
    retired = np.full(len(bodies), np.nan)
    end = bodies.born + bodies.lifetime
    if scene.world.bounds is None and not np.isfinite(end).any():
        return retired
    gone = time[:, None] + SLACK * dt >= end
    if scene.world.bounds is not None:
        lower, upper = scene.world.bounds
        gone |= ((position < lower) | (position > upper)).any(axis=2)
    gone &= ~bodies.fixed
    gone[0] = False  # engines look after each step
    for number in np.flatnonzero(gone.any(axis=0)).tolist():
        first = int(gone[:, number].argmax())
        retired[number] = time[first]
        position[first:, number], velocity[first:, number] = position[first, number], 0.0
    return retired
