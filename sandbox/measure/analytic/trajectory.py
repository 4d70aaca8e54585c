"""Analytic solution of a scene as a trajectory: the run of an engine without error."""

from typing import Any

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.common.lifetimes import SLACK
from sandbox.measure.analytic import Solution, solution
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings
from sandbox.scene.files.document import to_document
from sandbox.schedule import frame_count
from sandbox.trajectory import Contacts, Trajectory


def frame_times(scene: Scene, settings: Settings) -> FloatArray:
    """Return the times of the recorded frames, (T,) s: every n-th multiple of dt from 0, and the duration."""
    steps, part = frame_count(scene, settings)
    time: FloatArray = np.arange(0, steps + 1, settings.record_every, dtype=np.float64) * settings.dt
    if steps % settings.record_every or part:
        return np.append(time, scene.world.duration)
    time[-1] = scene.world.duration
    return time


def solved_run(scene: Scene, settings: Settings) -> Trajectory | None:
    """Return the analytic run of a scene, or None if the formulas do not cover all of it (`solution`)."""
    found = solution(scene)
    return None if found is None else solution_run(found, settings)


def solution_run(found: Solution, settings: Settings) -> Trajectory:
    """Return a solution at the frames of a run, with its contacts.

    A body that leaves `world.bounds` or reaches the end of its lifetime is retired at the first such frame. Contacts
    are in the order of time; from the first flight on that would be shorter than dt, they are a single row that lasts
    to the end.
    """
    scene = found.scene
    bodies, time = scene.bodies, frame_times(scene, settings)
    position, velocity, angle, spin = found.at(time)
    retired = _retire_bodies(scene, bodies, time, position, velocity, settings.dt)
    contacts = found.contacts(np.fmin(retired, scene.world.duration), settings.dt)
    return run_without_engine(scene, settings, time, (position, velocity, angle, spin), contacts, retired)


def run_without_engine(
    scene: Scene,
    settings: Settings,
    time: FloatArray,
    state: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    contacts: Contacts,
    retired_time: FloatArray,
) -> Trajectory:
    """Return frames that no engine computed as a run.

    Args:
        scene: scene of the frames.
        settings: settings that the times of the frames belong to.
        time: (T,) s.
        state: position and velocity, (T, N, 2) m and m/s; angle and angular velocity, (T, N) rad and rad/s.
        contacts: the contacts.
        retired_time: (N,) s; nan for a body that was not retired.
    """
    position, velocity, angle, spin = state
    spin = np.broadcast_to(spin, angle.shape)
    frames = {"time": time, "position": position, "velocity": velocity, "angle": angle, "angular_velocity": spin}
    info: dict[str, Any] = {
        "scene": to_document(scene),
        "engine": None,
        "settings": settings.model_dump(mode="json"),
        "actions": [],
        "status": "ok",
        "reason": None,
        "seconds": 0.0,
        "audited": False,
    }
    return Trajectory.from_frames(frames, scene.bodies.names, contacts, retired_time, info)


def _retire_bodies(
    scene: Scene, bodies: Bodies, time: FloatArray, position: FloatArray, velocity: FloatArray, dt: float
) -> FloatArray:
    """Stop the bodies that leave the bounds or reach the end of their lifetime, in place.

    Returns the times, (N,) s; nan for bodies that are not retired.
    """
    retired = np.full(len(bodies), np.nan)
    end = bodies.born + bodies.lifetime
    if scene.world.bounds is None and not np.isfinite(end).any():
        return retired
    is_retired = time[:, None] + SLACK * dt >= end
    if scene.world.bounds is not None:
        lower, upper = scene.world.bounds
        is_retired |= ((position < lower) | (position > upper)).any(axis=2)
    is_retired &= ~bodies.fixed
    is_retired[0] = False  # engines test after each step
    for number in np.flatnonzero(is_retired.any(axis=0)).tolist():
        first = int(is_retired[:, number].argmax())
        retired[number] = time[first]
        position[first:, number], velocity[first:, number] = position[first, number], 0.0
    return retired
