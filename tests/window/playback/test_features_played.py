"""Breaking joints and zones in a session: shown and reproduced as at first, however a time is reached."""

from typing import Any

import numpy as np
import pytest

from sandbox.action import Force, Impulse, Switch
from sandbox.engines.registry import ENGINES
from sandbox.measure.run.runner import run
from sandbox.measure.run.sessions import rerun
from sandbox.recording import Recording
from sandbox.scene.description.fixed import HELD
from sandbox.scene.errors import SceneError
from sandbox.scene.files.load import from_document, load, loads
from sandbox.scene.files.shipped_scenes import find
from sandbox.trajectory import Trajectory
from sandbox.window.playback import live as module
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.recorded import RecordedRun, RecordedView
from sandbox.window.playback.session import Session
from sandbox.window.playback.snapshot import Snapshot
from tests.toml_text import toml

ALL = frozenset({"shapes", "joints"})
CLOTH = loads(
    toml(title="Rag")
    + toml("world", gravity=[0.0, -10.0], duration=1.0)
    + toml("solver", dt=0.01, substeps=2)
    + toml(
        "cloth",
        name="rag",
        corner=[0.0, 0.0],
        columns=4,
        rows=4,
        spacing=[0.1, 0.1],
        stiffness=100.0,
        damping=0.05,
        mass=0.1,
        strength=3.5,
    )
)
"""The uppermost threads carry 3 N at rest, and more while the cloth swings."""


def snapshot(view: LiveView | RecordedView) -> Snapshot:
    return view.snapshot(ALL)


def seek_to(view: LiveView, step: int) -> LiveView:
    view.seek(step)
    view.finish_seek()
    return view


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_joints_are_shown_until_they_break_and_again_after_seeking_back(engine: str) -> None:
    view = LiveView(Session(CLOTH, engine))
    assert len(snapshot(view).joints) == len(CLOTH.joint_arrays)
    joint_counts = [len(snapshot(seek_to(view, step)).joints) for step in range(0, 61, 5)]
    assert joint_counts[0] == len(CLOTH.joint_arrays) > joint_counts[-1]
    assert joint_counts == sorted(joint_counts, reverse=True)
    break_times = view.session.break_times[np.isfinite(view.session.break_times)]
    assert len(break_times) == joint_counts[0] - joint_counts[-1]
    for step in (10, 60, 0, 35):  # back and forth
        assert len(snapshot(seek_to(view, step)).joints) == joint_counts[step // 5]
    seek_to(view, 0).scrub(0.6)  # scrubbed only: the session is at a time before the breaks
    assert len(snapshot(view).joints) == joint_counts[-1]
    view.close()


def test_energy_of_a_live_view_excludes_broken_joints() -> None:
    view, trajectory = seek_to(LiveView(Session(CLOTH)), 60), run(CLOTH)
    stored = RecordedView(RecordedRun(trajectory))
    stored.scrub(0.6)
    assert view.energy() == pytest.approx(stored.energy(), rel=1e-12)  # the same frame, computed twice
    assert snapshot(view).joints.names == snapshot(stored).joints.names
    assert len(snapshot(stored).joints) < len(CLOTH.joint_arrays)
    view.close()


def test_action_in_the_past_discards_later_breaks() -> None:
    view = seek_to(LiveView(Session(CLOTH)), 60)
    assert np.isfinite(view.session.break_times).any()
    seek_to(view, 0)
    assert np.isfinite(view.session.break_times).any()  # seeking alone keeps the recorded future
    view.apply(Force(time=0.0, body="rag-16", force=(0.0, 0.5)))
    assert not np.isfinite(view.session.break_times).any()
    view.close()


def test_joints_keep_their_bodies_after_an_engine_switch_without_broken_ones() -> None:
    view = seek_to(LiveView(Session(CLOTH)), 60)
    links = snapshot(view).joints
    view.apply(Switch(time=0.0, engine="reference"))
    assert np.array_equal(snapshot(view).joints.b, links.b)
    assert len(snapshot(seek_to(view, 0)).joints) == len(CLOTH.joint_arrays)
    view.close()


def test_breaks_are_notified_at_once_and_then_once_a_second(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MIN_STEP_BUDGET", 1e9)  # s, so that the speed of the machine does not matter
    monkeypatch.setattr(module, "MAX_STEP_BUDGET", 1e9)
    view = LiveView(Session(CLOTH))
    for _ in range(60):
        view.update(0.01, paused=False)
    notifications = [text for _, text in view.notifications if text.endswith("broke")]
    assert len(notifications) == 1
    view.close()


def test_recorded_run_refuses_joints_that_differ_from_the_scene() -> None:
    trajectory = run(CLOTH)
    mismatched = Trajectory(**{**vars(trajectory), "broken_time": np.full(3, np.nan)})
    with pytest.raises(SceneError, match="broken_time: the run had 3 joints"):
        RecordedRun(mismatched)


HOLES: list[dict[str, Any]] = [
    {"name": "mouth", "points": [[0.3, -1], [0.3, 1]], "thickness": 0.1, "to_layer": "up"},
    {"name": "slope", "position": [0.8, 0], "radius": 0.3, "layers": ["up"], "gravity": [-0.5, 0.0]},
    {"name": "hole", "position": [1.5, 0], "radius": 0.1, "layers": ["up"], "holds": True},
]


COURSE = from_document(
    {"ball": [{"name": "ball", "position": [0, 0], "velocity": [1.5, 0], "radius": 0.1}], "zone": HOLES}
)


@pytest.mark.parametrize("name", ["holes", "overpass"])
def test_seeking_back_and_forth_reproduces_the_same_visits(name: str) -> None:
    """The run is long enough for checkpoints, also inside zones; each state is compared with the first pass."""
    session = Session(COURSE if name == "holes" else load(find(name)))
    while session.step_number < 320:
        session.advance()
        if session.step_number == 200:
            session.apply(Impulse(time=0.0, body=session.bodies.names[0], impulse=(0.3, 0.1)))
    known = {k: session.history.get(k) for k in range(321)}
    assert session.history.keyframe_steps
    assert {int(mark) for frame in known.values() if frame is not None for mark in np.unique(frame.visits)} >= {0, 1}
    assert name != "holes" or any(known[k].visits[0, 2] == HELD for k in range(200))
    for step in (150, 40, 210, 199, 320, 0, 320):
        for _ in session.seek(step):
            pass
        assert session.frame.state_hash() == known[step].state_hash()
        assert np.array_equal(session.frame.visits, known[step].visits)
        assert np.array_equal(session.frame.layer, known[step].layer)
    assert session.history.checkpoints_enabled  # no checkpoint replayed differently
    recording = Recording.from_json(session.recording().to_json())
    assert rerun(recording, audit=False).info["state_hash"] == recording.state_hash


@pytest.mark.parametrize("engine", ENGINES)
def test_sensors_detect_the_same_after_seeking_back(engine: str) -> None:
    """A ball falls through two sensors; the second pass starts from a checkpoint or snapshot within the first."""
    scene = loads(
        toml("world", gravity=[0.0, -10.0], duration=3.0)
        + toml("solver", dt=0.01)
        + toml("ball", name="a", position=[0.0, 20.0], radius=0.5)
        + toml("sensor", name="high", position=[0.0, 15.0], radius=3.0)
        + toml("sensor", name="low", position=[0.0, 8.0], radius=3.0)
    )
    session = Session(scene, engine)
    rows: dict[int, list[tuple[float, int]]] = {}
    for _ in range(2):
        while session.step_number < 150:
            session.advance()
            found = [(each.time, each.pair[1]) for each in session.contacts()]
            assert rows.setdefault(session.step_number, found) == found
        for _ in session.seek(70):
            pass
        session.contacts()
    assert {sensor for found in rows.values() for _, sensor in found} == {-1, -2}
    assert rows[75][0][0] < 0.7  # begun before the step to which it goes back
