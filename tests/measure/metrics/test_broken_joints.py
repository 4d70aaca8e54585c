"""Runs in which joints break: break times, counts, and energies and errors after the break."""

from pathlib import Path

import numpy as np
import pytest

from sandbox.batch.plan import Job
from sandbox.engines.common.energy_balance import energy_of
from sandbox.measure.metrics.energy import energies
from sandbox.measure.metrics.invariants import joint_error, joint_errors
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import loads
from sandbox.trajectory import Frame, Trajectory
from tests.batch.fetching import run_or_fetch

every_engine = pytest.mark.parametrize("engine", ["pymunk", "reference"])

BREAKING = """
world = { duration = 1.0 }
solver = { dt = 0.01, substeps = 3 }
ball = [
  { name = "a", position = [0.0, 0.0], velocity = [-1.0, 0.0], radius = 0.1, mass = 1.0 },
  { name = "b", position = [1.0, 0.0], velocity = [1.0, 0.0], radius = 0.1, mass = 1.0 },
  { name = "c", position = [1.0, 1.0], velocity = [1.0, 0.0], radius = 0.1, mass = 1.0 },
]
joint = [
  { kind = "rod", between = ["b", "c"] },
  { kind = "spring", between = ["a", "b"], stiffness = 20.0, strength = 5.0 },
  { kind = "rod", between = ["c"], anchors = [[0.0, 0.0], [1.0, 3.0]], strength = 0.01 },
]
"""
"""The spring breaks where it stores ½·F²/k = 0.625 J; the rod to the world breaks at once."""


def scene() -> Scene:
    return loads(BREAKING)


@every_engine
def test_run_records_when_each_joint_broke(engine: str) -> None:
    found = run(scene(), engine)
    assert np.isfinite(found.broken_time).tolist() == [False, True, True]
    assert found.info["broken"] == 2
    assert found.broken_time[2] < 0.05
    spring = float(found.broken_time[1])
    assert spring * 300 == pytest.approx(round(spring * 300), abs=1e-9)  # at the end of a substep
    assert found.breaks(3).tolist() == [np.inf, *found.broken_time[1:].tolist()]
    with pytest.raises(ValueError, match="3 joints"):
        found.breaks(2)


@every_engine
def test_broken_spring_stores_nothing(engine: str) -> None:
    found = run(scene(), engine)
    stored = energies(found, scene()).potential
    broken = found.time >= found.broken_time[1] - 1e-9
    assert 0 < np.count_nonzero(broken) < len(broken)
    assert not stored[broken].any()
    assert 0.5 < stored[~broken].max() <= 0.626  # J: at most its strength, in a frame before the break
    for k in (len(broken) // 2, -1):
        state = found.position[k], found.velocity[k], found.angle[k], found.angular_velocity[k]
        frame = Frame(float(found.time[k]), *(each.copy() for each in state), np.ones(3, np.bool_))
        energy = energy_of(frame, scene().bodies, (0.0, 0.0), scene(), found.breaks(3))
        assert energy[1] == pytest.approx(stored[k], rel=1e-12)


@every_engine
def test_joint_that_breaks_at_a_frame_time_is_broken_in_that_frame(engine: str) -> None:
    """Frame times are products, and break times of a later leg are sums: they differ by rounding."""
    found = run(scene(), engine)
    k = int(np.searchsorted(found.time, found.broken_time[1]))
    for offset in (-1e-15, 0.0, 1e-15):
        breaks = found.broken_time.copy()
        breaks[1] = found.time[k] + offset
        at_frame = Trajectory(**{**vars(found), "broken_time": breaks})
        assert energies(at_frame, scene()).potential[k] == 0.0
        assert energies(at_frame, scene()).potential[k - 1] > 0.0


@every_engine
def test_broken_rod_has_no_error(engine: str) -> None:
    found = run(scene(), engine)
    errors = joint_errors(found, scene())
    broken = found.time >= found.broken_time[2] - 1e-9
    assert np.isnan(errors[broken, 2]).all()
    assert not np.isnan(errors[~broken, 2]).any()
    whole = joint_error(found, scene())
    unbroken = joint_error(Trajectory(**{**vars(found), "broken_time": np.empty(0)}), scene())
    assert whole is not None
    assert unbroken is not None
    assert whole.relative < 0.01 < unbroken.relative  # of its length: the intact rod, and the broken one


@every_engine
def test_break_times_are_stored_and_older_files_load_as_unbroken(engine: str, tmp_path: Path) -> None:
    found = run(scene(), engine)
    path = found.save(tmp_path / "run.npz")
    assert np.array_equal(Trajectory.load(path).broken_time, found.broken_time, equal_nan=True)
    with np.load(path) as arrays:
        older = {name: arrays[name] for name in arrays.files if name != "broken_time"}
    np.savez(tmp_path / "older.npz", **older)
    assert Trajectory.load(tmp_path / "older.npz").breaks(3).tolist() == [np.inf] * 3


def test_row_counts_broken_joints() -> None:
    record = run_or_fetch(Job("apart", scene(), "pymunk"))
    assert record.row().broken_joints == 2
    refused = run_or_fetch(Job("apart", scene(), "exact"))
    assert refused.trajectory.status == "refused"
    assert refused.row().broken_joints == 0
