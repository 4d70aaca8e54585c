"""A whole run by formula: where the scene alone guarantees one for every body, from start to end."""

import math

import numpy as np

from sandbox.engines.expiry import SLACK
from sandbox.measure.closed_form import Bouncing, bouncing, driven, free_flight, why_not
from sandbox.measure.compare.runs import frames_as_run
from sandbox.measure.recorder import frame_count
from sandbox.scene.bodies import Bodies
from sandbox.scene.meetings import meetings
from sandbox.scene.model import Scene
from sandbox.scene.settings import Settings
from sandbox.trajectory import Contacts, FloatArray, Trajectory

CHUNK = 1_000_000
"""Frames × bodies evaluated at once."""


def frame_times(scene: Scene, settings: Settings) -> FloatArray:
    """Return when a run keeps frames, (T,) s: every n-th multiple of dt from 0, and the duration."""
    steps, part = frame_count(scene, settings)
    time: FloatArray = np.arange(0, steps + 1, settings.record_every, dtype=np.float64) * settings.dt
    if steps % settings.record_every or part:
        return np.append(time, scene.world.duration)
    time[-1] = scene.world.duration
    return time


def solved(scene: Scene, settings: Settings) -> Trajectory | None:
    """Return the run that formulas make of a scene, or None where they do not cover all of it.

    They do where each body that moves either can meet nothing, and flies under gravity and linear drag, or is a ball
    that can meet only the one plane there is, and bounces straight (`closed_form.bouncing`); no two bodies can meet,
    and nothing joins, attracts or thrusts them. Nothing turns a body then. One that leaves `world.bounds`, or whose
    life is over, is retired at the first frame of that. Contacts are the impacts, in the order of time; from the one
    on after which a flight would be shorter than dt, a single row that lasts to the end.
    """
    bodies, meet = scene.bodies, meetings(scene)
    if why_not(scene) is not None or meet.mutual or driven(scene, bodies).any():
        return None
    moving = np.flatnonzero(~bodies.fixed)
    bouncers: dict[int, Bouncing] = {}
    for number in moving[~meet.free[moving]].tolist():
        form = bouncing(scene, bodies, number) if len(scene.fixed) == 1 else None
        if form is None:
            return None
        bouncers[number] = form

    time = frame_times(scene, settings)
    position = np.repeat(bodies.position[None], len(time), axis=0)
    velocity = np.where(bodies.fixed[:, None], 0.0, np.repeat(bodies.velocity[None], len(time), axis=0))
    flying = moving[meet.free[moving]]
    for part in np.array_split(flying, max(1, len(flying) * len(time) // CHUNK)):
        start = bodies.position[part], bodies.velocity[part]
        position[:, part], velocity[:, part] = free_flight(time, *start, scene.world)
    for number, form in bouncers.items():
        position[:, number], velocity[:, number] = form.at(time)
    retired = _retire(scene, bodies, time, position, velocity, settings.dt)
    contacts = _impacts(bodies, bouncers, settings.dt, np.fmin(retired, scene.world.duration))
    spin = np.where(bodies.fixed, 0.0, bodies.angular_velocity)
    return frames_as_run(
        scene, settings, time, (position, velocity, bodies.angle + time[:, None] * spin, spin), contacts, retired
    )


def _retire(
    scene: Scene, bodies: Bodies, time: FloatArray, position: FloatArray, velocity: FloatArray, dt: float
) -> FloatArray:
    """Stop what leaves the bounds, or whose life is over, at the first frame of that, in place; return when, (N,) s.

    It is nan for never.
    """
    retired = np.full(len(bodies), np.nan)
    end = bodies.born + bodies.lifetime - scene.began
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


def _impacts(bodies: Bodies, bouncers: dict[int, Bouncing], dt: float, until: FloatArray) -> Contacts:
    """Return the contacts of balls with the only fixed thing, which is −1."""
    rows = [
        (time, number, impulse)
        for number, form in bouncers.items()
        for time, impulse in _impacts_of(form, float(bodies.mass[number]), dt, float(until[number]))
    ]
    if not rows:
        return Contacts.none()
    rows.sort()
    time, number, size = (np.asarray(column) for column in zip(*rows, strict=True))
    number = number.astype(np.int64)
    normal = np.asarray([bouncers[n].normal for n in number.tolist()])
    along = np.asarray([bouncers[n].along for n in number.tolist()])
    start = np.asarray([bouncers[n].start - bouncers[n].height * bouncers[n].normal for n in number.tolist()])
    point = start + time[:, None] * along - bodies.radius[number, None] * normal
    pair = np.column_stack((number, np.full(len(number), -1, dtype=np.int64)))
    return Contacts(time, pair, point, -normal, -size[:, None] * normal)


def _impacts_of(form: Bouncing, mass: float, dt: float, until: float) -> list[tuple[float, float]]:
    """Return time, s, and impulse, N·s, of each impact up to a time; flights shorter than dt are one last row."""
    g, e = form.gravity, form.restitution
    if g == 0.0:
        time = form.height / -form.speed if form.speed < 0 else math.inf
        return [(time, -mass * (1 + e) * form.speed)] if time <= until else []
    impact = math.sqrt(form.speed**2 + 2.0 * g * form.height)
    # The two forms of one root, each free of cancellation for its sign.
    up = form.speed > 0 or impact == 0
    time = (form.speed + impact) / g if up else 2.0 * form.height / (impact - form.speed)
    rows = []
    while time <= until:
        flight = 2.0 * e * impact / g
        if flight < dt:
            _, velocity = form.at(np.asarray([until]))
            gained = float(velocity[0] @ form.normal) + impact
            rows.append((time, mass * (gained + g * (until - time))))
            break
        rows.append((time, mass * (1 + e) * impact))
        time, impact = time + flight, e * impact
    return rows
