"""Runs made by hand: frames and contacts as a test wants them."""

from collections.abc import Sequence

import numpy as np

from sandbox.measure.compare.runs import frames_as_run
from sandbox.scene.file import loads
from sandbox.scene.model import Scene
from sandbox.trajectory import Contacts, FloatArray, Trajectory

ContactRow = tuple[float, tuple[int, int], float]
"""time, pair, impulse along y"""

BALLS = """
[world]
duration = 2.0
[solver]
dt = 0.1
[[plane]]
name = "ground"
point = [0.0, 0.0]
normal = [0.0, 1.0]
[[ball]]
name = "a"
position = [0.0, 5.0]
radius = 0.5
[[ball]]
name = "b"
position = [3.0, 5.0]
radius = 0.5
[[ball]]
name = "still"
position = [9.0, 5.0]
radius = 0.5
fixed = true
"""
"""Two balls that move and one that does not, high above the ground; 21 frames."""


def scene_of(text: str = BALLS) -> Scene:
    """Read a scene."""
    return loads(text)


def run_of(
    scene: Scene,
    position: FloatArray | None = None,
    velocity: FloatArray | None = None,
    contacts: Sequence[ContactRow] = (),
    time: FloatArray | None = None,
    retired: FloatArray | None = None,
) -> Trajectory:
    """Make a run in which nothing moves, but for what is given."""
    dt = scene.solver.dt
    steps = round(scene.world.duration / dt)
    when = np.arange(steps + 1) * dt if time is None else time
    start = np.repeat(scene.bodies.position[None], len(when), axis=0)
    at = start if position is None else position
    rows = Contacts(
        np.asarray([row[0] for row in contacts], dtype=np.float64),
        np.asarray([row[1] for row in contacts], dtype=np.int64).reshape(-1, 2),
        np.zeros((len(contacts), 2)),
        np.tile([0.0, -1.0], (len(contacts), 1)),
        np.asarray([[0.0, row[2]] for row in contacts]).reshape(-1, 2),
    )
    state = (at, np.zeros_like(at) if velocity is None else velocity, np.zeros(at.shape[:2]), np.zeros(at.shape[1]))
    gone = np.full(len(scene.bodies), np.nan) if retired is None else retired
    return frames_as_run(scene, scene.solver, when, state, rows, gone)
