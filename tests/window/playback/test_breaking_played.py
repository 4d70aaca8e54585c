"""Breaking joints in a live view: shown before their break and hidden after it, however a time is reached."""

from collections.abc import Iterator

import numpy as np
import pytest

from sandbox.action import Force, Switch
from sandbox.measure.run.runner import run
from sandbox.scene.compile.scene import Scene
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import loads
from sandbox.trajectory import Trajectory
from sandbox.window.playback import live as module
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.recorded import RecordedRun, RecordedView
from sandbox.window.playback.session import Session
from sandbox.window.playback.snapshot import Snapshot

ALL = frozenset({"shapes", "joints"})
CLOTH = """
title = "Rag"
[world]
gravity = [0.0, -10.0]
duration = 1.0
[solver]
dt = 0.01
substeps = 2
[[cloth]]
name = "rag"
corner = [0.0, 0.0]
columns = 4
rows = 4
spacing = [0.1, 0.1]
stiffness = 100.0
damping = 0.05
mass = 0.1
strength = 3.5
"""
"""The uppermost threads carry 3 N at rest, and more while the cloth swings."""


@pytest.fixture(autouse=True)
def no_step_budget(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Remove the time budget of steps, so that no test depends on the speed of the machine."""
    monkeypatch.setattr(module, "MIN_STEP_BUDGET", 1e9)
    monkeypatch.setattr(module, "MAX_STEP_BUDGET", 1e9)
    return iter(())


def cloth() -> Scene:
    return loads(CLOTH)


def snapshot(view: LiveView | RecordedView) -> Snapshot:
    return view.snapshot(ALL)


def seek_to(view: LiveView, step: int) -> LiveView:
    view.seek(step)
    view.finish_seek()
    return view


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_joints_are_shown_until_they_break_and_again_after_seeking_back(engine: str) -> None:
    view = LiveView(Session(cloth(), engine))
    assert len(snapshot(view).links) == len(cloth().links)
    joint_counts = [len(snapshot(seek_to(view, step)).links) for step in range(0, 61, 5)]
    assert joint_counts[0] == len(cloth().links) > joint_counts[-1]
    assert joint_counts == sorted(joint_counts, reverse=True)
    break_times = view.session.break_times[np.isfinite(view.session.break_times)]
    assert len(break_times) == joint_counts[0] - joint_counts[-1]
    for step in (10, 60, 0, 35):  # back and forth
        assert len(snapshot(seek_to(view, step)).links) == joint_counts[step // 5]
    seek_to(view, 0).scrub(0.6)  # scrubbed only: the session is at a time before the breaks
    assert len(snapshot(view).links) == joint_counts[-1]
    view.close()


def test_energy_of_a_live_view_excludes_broken_joints() -> None:
    view, trajectory = seek_to(LiveView(Session(cloth())), 60), run(cloth())
    stored = RecordedView(RecordedRun(trajectory))
    stored.scrub(0.6)
    assert view.energy() == pytest.approx(stored.energy(), rel=1e-12)  # the same frame, computed twice
    assert snapshot(view).links.names == snapshot(stored).links.names
    assert len(snapshot(stored).links) < len(cloth().links)
    view.close()


def test_action_in_the_past_discards_later_breaks() -> None:
    view = seek_to(LiveView(Session(cloth())), 60)
    assert np.isfinite(view.session.break_times).any()
    seek_to(view, 0)
    assert np.isfinite(view.session.break_times).any()  # seeking alone keeps the recorded future
    view.apply(Force(time=0.0, body="rag-16", force=(0.0, 0.5)))
    assert not np.isfinite(view.session.break_times).any()
    view.close()


def test_joints_keep_their_bodies_after_an_engine_switch_without_broken_ones() -> None:
    view = seek_to(LiveView(Session(cloth())), 60)
    links = snapshot(view).links
    view.apply(Switch(time=0.0, engine="reference"))
    assert np.array_equal(snapshot(view).links.b, links.b)
    assert len(snapshot(seek_to(view, 0)).links) == len(cloth().links)
    view.close()


def test_breaks_are_notified_at_once_and_then_once_a_second() -> None:
    view = LiveView(Session(cloth()))
    for _ in range(60):
        view.update(0.01, paused=False)
    notifications = [text for _, text in view.notifications if text.endswith("broke")]
    assert len(notifications) == 1
    view.close()


def test_recorded_run_refuses_joints_that_differ_from_the_scene() -> None:
    trajectory = run(cloth())
    mismatched = Trajectory(**{**vars(trajectory), "broken_time": np.full(3, np.nan)})
    with pytest.raises(SceneError, match="broken_time: the run had 3 joints"):
        RecordedRun(mismatched)
