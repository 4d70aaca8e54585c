"""Energies against hand-computed joules."""

from dataclasses import replace

import numpy as np
import pytest

from sandbox.measure.metrics import energy
from sandbox.measure.metrics.energy import energies
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import loads
from sandbox.trajectory import Trajectory
from tests.runs_by_hand import run_of

BALLS = """
world = { gravity = [0.5, -2.0] }
ball = [
  { name = "a", position = [1.0, 3.0], velocity = [3.0, 4.0], angular_velocity = 2.0, radius = 2.0, mass = 5.0 },
  { name = "b", position = [0.0, 1.0], radius = 1.0 },
  { name = "wall", position = [9.0, 9.0], radius = 1.0, mass = 100.0, fixed = true },
]
"""


def resting_run(scene: Scene, frames: int = 4, **changes: object) -> Trajectory:
    """Return a run in which every body keeps its initial state, except for the given changes."""
    bodies = scene.bodies
    velocity = np.tile(bodies.velocity, (frames, 1, 1))
    turned = {name: np.tile(getattr(bodies, name), (frames, 1)) for name in ("angle", "angular_velocity")}
    return replace(run_of(scene, time=np.arange(frames, dtype=float), velocity=velocity), **(turned | changes))


def test_energies_are_summed_over_moving_bodies() -> None:
    scene = loads(BALLS)
    found = energies(resting_run(scene), scene)
    # a: ½·5·25 + ½·(½·5·4)·4 = 82.5 and −5·(0.5 − 6) = 27.5; b: 0 and 2; the fixed ball does not count.
    assert found.kinetic.tolist() == [82.5] * 4
    assert found.potential.tolist() == [29.5] * 4
    assert found.total.tolist() == [112.0] * 4


def test_energies_of_one_body_sum_to_those_of_all() -> None:
    scene = loads(BALLS)
    run = resting_run(scene)
    parts = [energies(run, scene, body=n) for n in range(3)]
    assert parts[0].total.tolist() == [110.0] * 4
    assert parts[1].total.tolist() == [2.0] * 4
    assert parts[2].total.tolist() == [0.0] * 4
    with pytest.raises(IndexError, match="no body 3"):
        energies(run, scene, body=3)


def test_a_body_counts_until_it_is_retired() -> None:
    scene = loads(BALLS)
    found = energies(resting_run(scene, retired_time=np.array([2.0, np.nan, np.nan])), scene)
    assert found.total.tolist() == [112.0, 112.0, 2.0, 2.0]


def test_a_body_counts_from_its_first_frame() -> None:
    scene = loads(BALLS)
    bodies = scene.bodies.joined_by(Ball(name="new", position=(0.0, 1.0), radius=1.0, mass=3.0), "new")
    run = resting_run(scene)
    position = np.concatenate((run.position, np.full((4, 1, 2), np.nan)), axis=1)
    velocity, spin = position * np.nan, np.full((4, 4), np.nan)
    velocity[:, :3], spin[:, :3] = run.velocity, run.angular_velocity
    position[2:, 3], velocity[2:, 3], spin[2:, 3] = (0.0, 1.0), (2.0, 0.0), 0.0
    run = resting_run(
        scene, position=position, velocity=velocity, angular_velocity=spin, retired_time=np.full(4, np.nan)
    )
    assert energies(run, scene, bodies=bodies).total.tolist() == [112.0, 112.0, 124.0, 124.0]
    with pytest.raises(ValueError, match="4 bodies"):
        energies(run, scene)


def test_a_diverged_state_shows_in_the_energy() -> None:
    scene = loads(BALLS)
    run = resting_run(scene)
    run.velocity[2, 0], run.position[3, 0] = (1e200, 0.0), np.nan
    found = energies(run, scene)
    assert found.kinetic[2] == np.inf
    assert np.isnan(found.potential[3])
    assert found.total[:2].tolist() == [112.0, 112.0]


def test_chunk_size_does_not_change_energies(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = loads(BALLS)
    random = np.random.default_rng(5)
    position = random.normal(size=(50, 3, 2))
    position[:17, 1] = np.nan  # not added yet
    position[40:, 0] = np.nan  # diverged
    velocity, spin = random.normal(size=(50, 3, 2)), random.normal(size=(50, 3))
    run = resting_run(scene, 50, position=position, velocity=velocity, angular_velocity=spin)
    whole = energies(run, scene)
    monkeypatch.setattr(energy, "CHUNK", 21)
    for a, b in zip(whole, energies(run, scene), strict=True):
        assert a == pytest.approx(b, rel=1e-15, nan_ok=True)  # products may be summed in a different order


def test_no_bodies_and_no_frames_have_no_energy() -> None:
    empty = loads("[world]\nduration = 1.0\n")
    assert energies(resting_run(empty), empty).total.tolist() == [0.0] * 4
    scene = loads(BALLS)
    assert energies(resting_run(scene, 0), scene).total.shape == (0,)
