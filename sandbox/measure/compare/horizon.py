"""Horizon: until when a truth is one, told by moving a single ball by 1e-12 m."""

import math

import numpy as np

from sandbox.measure.compare.errors import errors
from sandbox.scene.bodies import Bodies
from sandbox.scene.document import read_model, to_document
from sandbox.scene.meetings import meetings
from sandbox.scene.model import Ball, Scene
from sandbox.trajectory import Trajectory

NUDGE = 1e-12
"""m"""
ULPS = 4.0
"""Where a coordinate is so large that 1e-12 m vanishes beside it, it is moved by so many of its last digits."""


def nudged(scene: Scene) -> Scene | None:
    """Return the scene with its first ball that moves and can meet something moved by `NUDGE`, along x and y alike.

    None where there is no such ball: nothing can grow then. Generators are written out as the balls they make.
    """
    bodies = scene.bodies
    able = np.flatnonzero(~bodies.fixed & ~meetings(scene).free)
    if not len(able):
        return None
    number = int(able[0])
    moved = [_nudge(x) for x in bodies.position[number].tolist()]
    document = to_document(scene)
    if number < len(scene.balls):
        document["ball"][number] = {**document["ball"][number], "position": moved}
    else:
        document = {key: value for key, value in document.items() if key not in ("grid", "scatter", "emitter")}
        document["ball"] = [_written_out(bodies, n) for n in range(len(bodies))]
        document["ball"][number]["position"] = moved
    return read_model(document)


def _nudge(x: float) -> float:
    return x + max(NUDGE * math.sqrt(0.5), ULPS * math.ulp(x))


def _written_out(bodies: Bodies, number: int) -> dict[str, object]:
    """Return one body as a `[[ball]]`, of the same surface, that starts in the same state bit for bit."""
    element = bodies.elements[bodies.element[number]]
    shared = element.model_dump(mode="json", by_alias=True, exclude_defaults=True)
    own = {key: value for key, value in shared.items() if key in Ball.model_fields and key != "density"}
    return {
        **own,
        "name": bodies.names[number],
        "position": bodies.position[number].tolist(),
        "velocity": bodies.velocity[number].tolist(),
        "mass": float(bodies.mass[number]),
    }


def agree_until(a: Trajectory, b: Trajectory, scene: Scene, tolerance: float) -> float:
    """Return the last time up to which two runs of a scene agree in every position; its duration, if throughout.

    Where a run ended early, they agree no longer than to its last frame.
    """
    found = errors(a, b, ~scene.bodies.fixed)
    apart = np.flatnonzero(found.position > tolerance)
    if len(apart):
        return float(found.time[apart[0] - 1]) if apart[0] else 0.0
    if a.status == b.status == "ok":
        return scene.world.duration
    return float(found.time[-1]) if len(found.time) else 0.0
