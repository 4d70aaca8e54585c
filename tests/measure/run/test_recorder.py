"""Recorder: number of frames of a run, and their memory; runs that are stopped at a limit."""

import math
import re
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.engines.contract import Exhaustion
from sandbox.measure.run import recorder
from sandbox.measure.run.bounded_run import RunTimeoutError, bounded_run
from sandbox.measure.run.recorder import Recorder, TooLargeError, bytes_per_frame, recorded_frames
from sandbox.resource_limits import FREE_FRACTION
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.world import Settings, World
from sandbox.schedule import frame_count
from sandbox.trajectory import Frame
from tests.runs_by_hand import DROP, scene_of


def scene_lasting(duration: float) -> Scene:
    return Scene(world=World(duration=duration))


@given(st.floats(1e-300, 1e9), st.floats(1e-9, 10.0))
def test_steps_and_partial_step_add_up_to_any_duration(duration: float, dt: float) -> None:
    steps, part = frame_count(scene_lasting(duration), Settings(dt=dt))
    assert steps >= 0
    assert 0.0 <= part < 1.0
    assert steps + part > 0.0
    assert (steps + part) * dt == pytest.approx(duration, rel=2e-9)  # a step counts as whole within 1e-9


@given(st.integers(0, 300), st.sampled_from([0.0, 0.5]), st.integers(1, 400))
def test_recorded_frames_are_counted(steps: int, part: float, every: int) -> None:
    if steps == 0 and part == 0.0:
        part = 0.5
    recorded = {*range(0, steps + 1, every), steps + part}
    assert recorded_frames(steps, part, every) == len(recorded)


@given(st.integers(1, 10_000), st.integers(1, 50), st.sampled_from([0.0, 0.5]), st.integers(2, 300), st.integers(1, 20))
def test_error_for_too_many_frames_names_an_interval_that_fits(steps, bodies, part, capacity, every):
    scene, settings = scene_lasting((steps + part) * 0.01), Settings(dt=0.01, record_every=every)
    with pytest.MonkeyPatch.context() as patch:
        # Memory for `capacity` frames and a half.
        patch.setattr(
            recorder, "free_memory", lambda: (capacity + 0.5) * bytes_per_frame(scene, bodies) / FREE_FRACTION
        )
        needed = recorded_frames(steps, part, every)
        if needed <= capacity:
            assert recorder.require_memory(scene, settings, bodies) == needed
            return
        with pytest.raises(TooLargeError) as caught:
            recorder.require_memory(scene, settings, bodies)
        found = re.search(r"solver\.record_every = (\d+) would fit", str(caught.value))
        fits = int(found[1])
        assert fits > every
        assert recorder.require_memory(scene, settings.replace(record_every=fits), bodies) <= capacity


def test_error_if_two_frames_do_not_fit_asks_for_fewer_bodies(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recorder, "free_memory", lambda: 1000)
    with pytest.raises(TooLargeError, match=r"^101 frames of 1,000 bodies take .* use fewer bodies$"):
        Recorder(scene_lasting(1.0), Settings(), 1000)


def test_energy_account_counts_as_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recorder, "free_memory", lambda: int(200 * 56 / FREE_FRACTION))
    assert recorder.require_memory(scene_lasting(1.0), Settings(), 1) == 101
    with pytest.raises(TooLargeError, match="record_every"):
        recorder.require_memory(scene_lasting(1.0), Settings(), 1, causes=13)


def test_free_memory_is_within_the_limit_of_address_space() -> None:
    code = "import resource\nresource.setrlimit(resource.RLIMIT_AS, (2**30, 2**30))\n"
    code += "from sandbox.resource_limits import free_memory\nprint(free_memory())"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert 0 < int(result.stdout) < 2**30


def frame_at(time: float, bodies: int) -> Frame:
    vectors, numbers = np.full((bodies, 2), time), np.full(bodies, time)
    return Frame(time, vectors, vectors, numbers, numbers, np.ones(bodies, dtype=np.bool_))


def test_recorder_records_every_nth_and_the_last_frame() -> None:
    recording = Recorder(scene_lasting(0.05), Settings(record_every=2), 1)
    recording.record(frame_at(0.0, 1))
    for step in range(1, 6):
        recording.steps = step
        assert recording.is_due() == (step in (2, 4))
        if recording.is_due():
            recording.record(frame_at(step * 0.01, 1))
    recording.record_unless_recorded(frame_at(0.05, 1))
    arrays = recording.arrays(1)
    assert arrays["time"].tolist() == [0.0, 0.02, 0.04, 0.05]
    assert arrays["position"].shape == (4, 1, 2)


def test_frame_at_an_early_end_is_recorded_once() -> None:
    recording = Recorder(scene_lasting(0.05), Settings(), 1)
    recording.record(frame_at(0.0, 1))
    for time in (0.0, 0.01, 0.01):
        recording.record_unless_recorded(frame_at(time, 1))
    assert recording.arrays(1)["time"].tolist() == [0.0, 0.01]


def test_recorder_grows_for_added_bodies_until_memory_is_exhausted(monkeypatch: pytest.MonkeyPatch) -> None:
    recording = Recorder(scene_lasting(0.05), Settings(), 1)
    for k, count in enumerate((1, 1, 5, 6)):
        recording.record(frame_at(0.01 * k, count))
    arrays = recording.arrays(6)
    assert (~np.isnan(arrays["angle"])).sum(axis=1).tolist() == [1, 1, 5, 6]
    monkeypatch.setattr(recorder, "free_memory", lambda: 100)
    with pytest.raises(Exhaustion, match="frames of 60 bodies do not fit into memory"):
        recording.record(frame_at(0.04, 60))


@pytest.mark.parametrize("engine", ["pymunk", "reference", "exact"])
def test_run_beyond_the_work_limit_is_stopped_on_any_machine(engine: str) -> None:
    scene = scene_of(DROP)
    found, counted = bounded_run(scene, engine, scene.solver, math.inf)
    assert 0.0 < 2.0 * counted < bounded_run(scene, engine, scene.solver.replace(dt=0.005), math.inf)[1]
    again, _ = bounded_run(scene, engine, scene.solver, counted)
    assert again.info["state_hash"] == found.info["state_hash"]
    with pytest.raises(RunTimeoutError, match="counted work"):
        bounded_run(scene, engine, scene.solver, math.nextafter(counted, 0.0))


def test_run_beyond_a_deadline_is_stopped() -> None:
    scene = scene_of(DROP)
    with pytest.raises(RunTimeoutError, match="time limit"):
        bounded_run(scene, "pymunk", scene.solver, math.inf, -math.inf)
