"""Joints that break while they are watched: whole before, gone after, on every way to a moment."""

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
"""The uppermost threads bear 3 N in the end, and more as the cloth swings."""


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """No test depends on how fast the machine is."""
    monkeypatch.setattr(module, "MIN_STEP_BUDGET", 1e9)
    monkeypatch.setattr(module, "MAX_STEP_BUDGET", 1e9)
    return iter(())


def cloth() -> Scene:
    return loads(CLOTH)


def shown(show: LiveView | RecordedView) -> Snapshot:
    return show.snapshot(ALL)


def at(show: LiveView, step: int) -> LiveView:
    show.seek(step)
    show.finish_seek()
    return show


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_joints_are_seen_until_they_break_and_again_on_the_way_back(engine: str) -> None:
    show = LiveView(Session(cloth(), engine))
    assert len(shown(show).links) == len(cloth().links)
    whole = [len(shown(at(show, step)).links) for step in range(0, 61, 5)]
    assert whole[0] == len(cloth().links) > whole[-1]
    assert whole == sorted(whole, reverse=True)
    broke = show.session.break_times[np.isfinite(show.session.break_times)]
    assert len(broke) == whole[0] - whole[-1]
    for step in (10, 60, 0, 35):  # back and forth
        assert len(shown(at(show, step)).links) == whole[step // 5]
    at(show, 0).scrub(0.6)  # only looked at, from before it broke
    assert len(shown(show).links) == whole[-1]
    show.close()


def test_energy_of_what_is_watched_leaves_out_what_broke() -> None:
    show, found = at(LiveView(Session(cloth())), 60), run(cloth())
    stored = RecordedView(RecordedRun(found))
    stored.scrub(0.6)
    assert show.energy() == pytest.approx(stored.energy(), rel=1e-12)  # the same frame, told twice
    assert shown(show).links.names == shown(stored).links.names
    assert len(shown(stored).links) < len(cloth().links)
    show.close()


def test_doing_something_else_forgets_what_broke_later() -> None:
    show = at(LiveView(Session(cloth())), 60)
    assert np.isfinite(show.session.break_times).any()
    at(show, 0)
    assert np.isfinite(show.session.break_times).any()  # it would go the same way
    show.apply(Force(time=0.0, body="rag-16", force=(0.0, 0.5)))
    assert not np.isfinite(show.session.break_times).any()
    show.close()


def test_joints_hold_the_same_bodies_after_a_switch_that_left_some_behind() -> None:
    show = at(LiveView(Session(cloth())), 60)
    links = shown(show).links
    show.apply(Switch(time=0.0, engine="reference"))
    assert np.array_equal(shown(show).links.b, links.b)
    assert len(shown(at(show, 0)).links) == len(cloth().links)
    show.close()


def test_breaks_are_told_at_once_and_then_once_a_second() -> None:
    show = LiveView(Session(cloth()))
    for _ in range(60):
        show.update(0.01, paused=False)
    told = [text for _, text in show.notifications if text.endswith("broke")]
    assert len(told) == 1
    show.close()


def test_film_refuses_a_run_with_other_joints_than_its_scene() -> None:
    found = run(cloth())
    odd = Trajectory(**{**vars(found), "broken_time": np.full(3, np.nan)})
    with pytest.raises(SceneError, match="broken_time: the run had 3 joints"):
        RecordedRun(odd)
