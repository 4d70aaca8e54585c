"""Synthetic runs: scenes, and trajectories with given frames and contacts."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.measure.analytic.trajectory import run_without_engine
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import loads
from sandbox.trajectory import Contacts, Trajectory

BALLS = """
[world]
gravity = [0.0, -10.0]
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

DROP = """
[world]
gravity = [0.0, -10.0]
duration = 0.4
[solver]
dt = 0.02
[[plane]]
name = "ground"
point = [0.0, 0.0]
normal = [0.0, 1.0]
[[ball]]
name = "a"
position = [0.0, 1.0]
radius = 0.5
restitution = 0.5
"""
"""A ball half a metre above the ground, which it reaches after 0.316 s. The scene has a closed form."""

SWING = """
[world]
gravity = [0.0, -10.0]
duration = 0.4
[solver]
dt = 0.02
[[ball]]
name = "hook"
position = [0.0, 0.0]
radius = 0.1
fixed = true
[[ball]]
name = "bob"
position = [1.0, 0.0]
radius = 0.1
[[joint]]
kind = "rod"
between = ["hook", "bob"]
"""
"""A pendulum: a ball on a rod, level with its fixed hook."""

Row = tuple[float, tuple[int, int]] | tuple[float, tuple[int, int], float]
"""Time and pair of a contact, and its impulse along y, by default 0."""


def scene_of(text: str = BALLS) -> Scene:
    """Read a scene."""
    return loads(text)


def run_of(
    scene: Scene,
    position: FloatArray | None = None,
    *,
    time: FloatArray | None = None,
    velocity: FloatArray | None = None,
    contacts: Sequence[Row] = (),
    retired: Sequence[float] | None = None,
    **info: Any,
) -> Trajectory:
    """Make a run in which all bodies stay at their initial positions, except where arrays are given.

    Args:
        scene: scene of the run.
        position: (T, N, 2) m.
        time: (T,) s, by default every step.
        velocity: (T, N, 2) m/s.
        contacts: rows in the order of time.
        retired: (N,) s, times at which bodies were removed, nan for none.
        info: entries to replace in the run's `info`.
    """
    dt = scene.solver.dt
    times = np.arange(round(scene.world.duration / dt) + 1) * dt if time is None else time
    positions = np.repeat(scene.bodies.position[None], len(times), axis=0) if position is None else position
    rows = Contacts(
        np.asarray([row[0] for row in contacts], dtype=np.float64),
        np.asarray([row[1] for row in contacts], dtype=np.int64).reshape(-1, 2),
        np.zeros((len(contacts), 2)),
        np.tile([0.0, -1.0], (len(contacts), 1)),
        np.asarray([[0.0, row[2] if len(row) > 2 else 0.0] for row in contacts]).reshape(-1, 2),
    )
    state = (
        positions,
        np.zeros_like(positions) if velocity is None else velocity,
        np.zeros(positions.shape[:2]),
        np.zeros(positions.shape[1]),
    )
    retired_time = np.full(len(scene.bodies), np.nan) if retired is None else np.asarray(retired)
    run = run_without_engine(scene, scene.solver, times, state, rows, retired_time)
    run.info.update(info)  # type: ignore[attr-defined] # it is a dict
    return run
