"""Views driven by real time: live sessions, and stored runs, which cannot be changed."""

from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import sandbox
from sandbox.action import Action, ActionError, Impulse, Move, Pull, Remove, Reshape, Spawn, Toggle
from sandbox.engines.registry import ENGINES
from sandbox.engines.switching import SwitchableSimulation
from sandbox.measure.run.runner import run
from sandbox.measure.run.sessions import rerun
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document, load
from sandbox.scene.files.shipped_scenes import find
from sandbox.window.playback import live as module
from sandbox.window.playback.follower import Follower
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.recorded import RecordedRun, RecordedView
from sandbox.window.playback.session import Session

pytestmark = pytest.mark.fail_slow(60)  # property tests with many examples

SCALED = {"bounce": load(find("bounce")), "pile": load(find("pile"), [("grid.ball.rows", 2), ("grid.ball.columns", 4)])}
ALL = frozenset({"shapes", "trails", "contacts"})


@pytest.fixture(autouse=True)
def no_step_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    """Remove the time budget of steps, so that no test depends on the speed of the machine."""
    monkeypatch.setattr(module, "MIN_STEP_BUDGET", 1e9)
    monkeypatch.setattr(module, "MAX_STEP_BUDGET", 1e9)
    monkeypatch.setattr(module, "FOLLOW_BUDGET", 1e9)
    monkeypatch.setattr(module, "IDLE_FOLLOW_BUDGET", 1e9)


def bounce() -> Scene:
    return load(find("bounce"))


def live(name: str = "bounce", engine: str = "pymunk") -> LiveView:
    return LiveView(Session(load(find(name)), engine))


def wait_for_seek(view: LiveView) -> None:
    while view.busy is not None:
        view.update(1 / 60, paused=True)


def seek(view: LiveView, step: int) -> None:
    view.seek(step)
    wait_for_seek(view)


@pytest.mark.parametrize(("slower", "speed"), [(0, 1.0), (10, 0.1)])
def test_steps_follow_real_time_times_the_speed(slower: int, speed: float) -> None:
    view = live()
    for _ in range(slower):
        view.clock.slower()
    for k in range(1, 61):
        view.update(1 / 60, paused=False)
        assert view.session.time == pytest.approx(speed * k / 60, abs=0.001)  # up to a step
    frame = view.snapshot(ALL).frame
    assert view.session.previous.time <= frame.time <= view.session.time
    assert frame.time == pytest.approx(view.session.time - 0.001 + 0.001 * view.alpha, abs=1e-12)  # rounding


def test_pause_makes_no_steps_and_single_steps_make_one() -> None:
    view = live()
    view.update(0.05, paused=False)
    step = view.step_number
    view.update(9.0, paused=True)
    assert view.step_number == step
    view.step()
    assert view.step_number == step + 1
    view.step_back()
    wait_for_seek(view)
    assert view.step_number == step
    view.update(9.0, paused=False)
    assert view.step_number <= step + 100  # at most 0.1 s per update
    assert view.step_number >= step + 99


def test_steps_beyond_the_time_budget_are_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MIN_STEP_BUDGET", -1.0)  # no step is within the budget
    monkeypatch.setattr(module, "MAX_STEP_BUDGET", -1.0)
    view = live()
    for _ in range(20):
        before = view.step_number
        view.update(0.05, paused=False)
        assert view.step_number == before + 1
    assert view.clock.real_speed < 0.1


def test_end_of_a_recording_requests_a_pause_once() -> None:
    first = Session(bounce())
    first.advance(100)
    first.apply(Impulse(time=0.0, body="ball", impulse=(1.0, 0.0)))
    first.advance(50)
    recording = first.recording()
    view = LiveView(Session(bounce(), actions=recording.actions), until=recording.duration)
    for _ in range(9):
        view.update(0.03, paused=False)
        if view.wants_pause:
            break
    assert view.wants_pause
    assert view.session.simulation.state_hash() == recording.state_hash
    view.wants_pause = False
    view.update(0.03, paused=False)
    assert not view.wants_pause
    assert view.step_number > 150
    assert len(view.notifications) == 1


def test_scrub_shows_a_frame_and_commit_moves_the_session_there() -> None:
    view = live()
    for _ in range(150):
        view.step()
    current = view.session.frame
    view.scrub(0.0504)
    assert view.step_number == 50
    assert view.frame.time == pytest.approx(0.05, rel=1e-12)  # rounding
    assert view.session.frame is current
    assert view.snapshot(ALL).frame is view.frame
    view.scrub(-9.0)
    assert view.step_number == 0
    view.scrub(99.0)
    assert view.step_number == 150
    view.commit_scrub()
    assert view.busy is None
    view.scrub(0.07)
    scrubbed = view.frame.state_hash()
    view.commit_scrub()
    wait_for_seek(view)
    assert (view.session.step_number, view.session.frame.state_hash()) == (70, scrubbed)
    view.commit_scrub()
    assert view.end_time == pytest.approx(0.15, rel=1e-12)  # rounding


def test_scrub_shows_walls_of_that_time() -> None:
    """The session may be before or after that time; equal times share one scene object, so that it is cached."""
    shelf = {"name": "shelf", "points": [[-1, 0], [1, 0]]}
    ball = {"name": "ball", "position": [0, 5.0], "radius": 0.1}
    view = LiveView(Session(from_document({"ball": [ball], "wall": [shelf]}), "pymunk"))
    outlines = [((-1.0, 0.0), (1.0, 0.0))]
    for k in (1.0, 2.0):
        view.step()
        outlines.append(((-1.0, k), (1.0, k)))
        view.apply(Reshape(time=0.0, thing="shelf", points=outlines[-1]))
        view.apply(Toggle(time=0.0, thing="shelf", solid=k == 2.0))
    view.step()
    dt = view.settings.dt
    for session_step in (3, 0, 2):
        seek(view, session_step)
        scenes = []
        for step in (0, 1, 2, 3, 0):
            view.scrub(step * dt)
            scenes.append(view.snapshot(ALL).scene)
            assert (scenes[-1].walls[0].points, scenes[-1].walls[0].solid) == (outlines[min(step, 2)], step != 1)
        assert scenes[0] is scenes[-1]
        assert view.snapshot(ALL).scene is scenes[0]
    view.commit_scrub()
    wait_for_seek(view)
    assert view.snapshot(ALL).scene is view.scene


def test_scrub_shows_bodies_spawned_later_than_the_session_time() -> None:
    """The session has been set back to before they were added; later frames are still in the history."""
    view = live()
    for k in range(3):
        view.step()
        view.apply(Spawn(time=0.0, ball=Ball(position=(3.0 * k + 3.0, 5.0), radius=0.25, mass=2.0)))
    view.step()
    seek(view, 1)
    assert (len(view.bodies), view.bodies.names) == (2, ("ball", "spawned-2"))
    for time, count in ((1.0, 4), (0.002, 3), (0.0, 1), (1.0, 4)):
        view.scrub(time)
        snapshot = view.snapshot(ALL)
        assert len(snapshot.frame.position) == count
        assert len(snapshot.bodies) >= count
        assert snapshot.bodies.radius[1:].tolist() == [0.25] * (len(snapshot.bodies) - 1)
        assert all(np.isfinite(view.energy()))
    view.commit_scrub()
    wait_for_seek(view)
    assert len(view.session.bodies) == 4


def test_actions_during_a_seek_apply_at_its_target(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "SEEK_BUDGET", -1.0)  # the seek makes no progress within a picture
    monkeypatch.setattr(module, "SEEK_DELAY", 0.0)
    view = live("gas")
    for _ in range(100):
        view.step()
    view.seek(50)
    view.update(1.0, paused=True)
    assert view.busy == "replaying 0%"
    view.apply(Remove(time=0.0, body="atom-1"))
    assert (view.busy, view.session.step_number, view.session.log.has_future) == (None, 50, False)
    for _ in range(50):
        view.step()
    view.seek(20)  # a second seek before the first is finished
    view.seek(99)
    monkeypatch.setattr(module, "SEEK_BUDGET", 1e9)
    view.update(1.0, paused=False)
    assert view.busy is None
    assert view.step_number == 99
    view.apply(Remove(time=0.0, body="atom-2"))


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("name", ["bounce", "pile"])
def test_each_step_back_shows_at_once_the_state_of_that_step(name: str, engine: str) -> None:
    """Pictures show every 16th step or so; a step back shows the one before all the same."""
    scene = SCALED[name]
    expected, simulation = {}, sandbox.start(scene, engine)
    view = LiveView(Session(scene, engine))
    while view.step_number < 500:
        view.update(1.0 / 60.0, paused=False)
    view.update(0.0, paused=True)
    last = view.step_number
    for step in range(last):
        expected[step] = simulation.frame().state_hash()
        simulation.step()
    for step in range(last - 1, last - 200, -1):
        view.step_back()
        assert view.step_number == step
        assert view.frame.state_hash() == expected[step]
        if step % 41 == 0:  # the player hesitates, and the session arrives
            view.update(1.0, paused=True)
            view.finish_seek()
            assert view.session.frame.state_hash() == expected[step]


class Work(NamedTuple):
    """Steps that all simulations of the engines have made."""

    steps: list[int]

    @property
    def count(self) -> int:
        return sum(self.steps)


@pytest.fixture
def work(monkeypatch: pytest.MonkeyPatch) -> Work:
    """Counts the steps of all simulations."""
    work = Work([])
    step, advance = SwitchableSimulation.step, SwitchableSimulation.advance

    def counted_step(self: SwitchableSimulation) -> None:
        work.steps.append(1)
        step(self)

    def counted_advance(self: SwitchableSimulation, steps: int, *args: Any, **more: Any) -> None:
        work.steps.append(steps)
        advance(self, steps, *args, **more)

    monkeypatch.setattr(SwitchableSimulation, "step", counted_step)
    monkeypatch.setattr(SwitchableSimulation, "advance", counted_advance)
    return work


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("acts", [False, True])
def test_steps_back_repeat_few_steps_however_long_the_run(
    engine: str, acts: bool, work: Work, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The balls of the pile touch all the time, which no checkpoint of pymunk or Box2D contains."""
    monkeypatch.setattr(Follower, "lag", 100)
    view = LiveView(Session(SCALED["pile"], engine))
    for k in range(300):
        view.update(1.0 / 60.0, paused=False)
        if acts and k % 40 == 0:
            view.apply(Impulse(time=0.0, body="ball-1", impulse=(0.3 * (-1) ** k, 0.2)))
    final, hashes = view.step_number, []
    assert final >= 600
    for _ in range(3):
        for _ in range(100):
            view.update(1.0 / 60.0, paused=True)  # the follower catches up
        before, shown = work.count, view.step_number
        for _ in range(5):
            view.step_back()
        view.finish_seek()
        assert view.session.step_number == shown - 5
        assert 0 < work.count - before <= 250
        hashes.append(view.frame.state_hash())
    recording = view.session.recording()
    assert rerun(recording, audit=False).info["state_hash"] == recording.state_hash
    view.seek(final - 15)
    view.finish_seek()
    assert view.frame.state_hash() == hashes[-1]
    view.apply(Impulse(time=0.0, body="ball-1", impulse=(0.0, 0.3)))
    for _ in range(30):
        view.update(1.0 / 60.0, paused=False)
    recording = view.session.recording()
    assert rerun(recording, audit=False).info["state_hash"] == recording.state_hash


def test_end_of_a_session_is_notified_once_and_again_after_seeking_back() -> None:
    ball = {"name": "a", "position": [9.9e15, 0], "radius": 1, "velocity": [1e12, 0]}
    view = LiveView(Session(from_document({"ball": [ball], "solver": {"dt": 10.0}}), "reference"))
    view.session.advance(9010)
    for _ in range(3):
        view.step()
    assert [level for level, _ in view.notifications] == ["error"]
    view.update(1.0, paused=False)
    assert view.step_number == 9011
    view.notifications.clear()
    view.step_back()
    wait_for_seek(view)
    assert view.step_number == 9010
    view.step()
    assert [level for level, _ in view.notifications] == ["error"]


def test_replay_from_a_checkpoint_shows_the_recorded_frames() -> None:
    """A checkpoint of `exact` rounds differently; the recorded frames are shown nevertheless."""
    view = live("newtons_cradle", "exact")
    for _ in range(200):
        view.step()
    frames = {k: view.session.history.get(k) for k in range(201)}
    for step in view.session.history.keyframe_steps or (60,):
        seek(view, step)
        while view.step_number < min(step + 20, 200):
            view.step()
            wait_for_seek(view)
            known = frames[view.step_number]
            assert known is not None
            assert view.frame.state_hash() == known.state_hash()


def test_relaunch_differs_each_time_and_replays() -> None:
    view, velocities = live("fireworks"), []
    begin = view.frame.velocity.copy()
    for _ in range(3):
        for _ in range(5):
            view.step()
        view.relaunch("spark")
        velocities.append(view.frame.velocity.copy())
        assert not np.array_equal(velocities[-1], begin)
    assert not np.array_equal(velocities[0], velocities[1])
    recording = view.session.recording()
    assert rerun(recording).info["state_hash"] == recording.state_hash
    with pytest.raises(ActionError, match="no generator"):
        view.relaunch("zzz")


def test_engine_switch_keeps_an_active_pull() -> None:
    view = LiveView(Session(from_document({"ball": [{"name": "a", "position": [0, 0], "radius": 1}]})))
    view.apply(Pull(time=0.0, body="a", target=(2.0, 0.0)))
    for engine in ("exact", "reference", "pymunk"):
        view.step()
        assert view.switch_engine(engine) is None
        assert view.engine == engine
    for _ in range(150):
        view.step()
    assert view.frame.position[0] == pytest.approx([2.0, 0.0], abs=1e-9)  # (1 + ωt)·e^{−ωt}


def test_overlaps_are_computed_only_for_scenes_that_request_them() -> None:
    view = live("circle_half_plane")
    assert view.snapshot(ALL).overlapping is not None
    view.apply(Move(time=0.0, body="circle", position=(0.0, 0.5)))
    overlapping = view.snapshot(ALL).overlapping
    assert overlapping is not None
    assert overlapping.tolist() == [True]
    assert live().snapshot(ALL).overlapping is None


EDGE_CASES: list[dict[str, Any]] = [
    {"title": "empty"},
    {"plane": [{"point": [0, 0], "normal": [0, 1]}]},
    {"ball": [{"name": "a", "position": [0, 0], "radius": 1, "fixed": True}]},
    {
        "ball": [{"name": "a", "position": [0, 0], "radius": 0.1, "velocity": [90, 0]}],
        "world": {"bounds": [[-1, -1], [1, 1]]},
    },
    {"ball": [{"name": "a", "position": [0, 0], "radius": 1}], "solver": {"dt": 10.0}, "world": {"duration": 0.1}},
]

operations = st.one_of(
    st.tuples(st.just("go"), st.floats(0.0, 0.2)),
    st.tuples(
        st.sampled_from(["step", "step_back", "commit_scrub", "slower", "faster", "ghost", "trust"]), st.just(0.0)
    ),
    st.tuples(st.sampled_from(["scrub", "seek"]), st.floats(-1.0, 3.0)),
    st.tuples(st.just("act"), st.floats(0.0, 4.9)),
    st.tuples(st.just("switch"), st.floats(0.0, 2.9)),
)
ACTIONS: list[Action] = [
    Impulse(time=0.0, body="a", impulse=(0.1, 0.4)),
    Pull(time=0.0, body="a", target=(0.5, 0.5)),
    Pull(time=0.0, body="a"),
    Spawn(time=0.0, ball=Ball(position=(0.0, 0.5), radius=0.2)),
    Remove(time=0.0, body="a"),
]


@pytest.mark.parametrize("index", range(len(EDGE_CASES)))
@given(plan=st.lists(operations, max_size=15), engine=st.sampled_from(["pymunk", "reference", "exact"]))
def test_edge_case_scenes_support_any_order_of_operations(
    index: int, plan: list[tuple[str, float]], engine: str
) -> None:
    view = LiveView(Session(from_document(EDGE_CASES[index]), engine))
    for kind, number in plan:
        try:
            match kind:
                case "go":
                    view.update(number, paused=False)
                case "step" | "step_back" | "commit_scrub":
                    getattr(view, kind)()
                case "slower" | "faster":
                    getattr(view.clock, kind)()
                case "ghost":
                    view.diagnostics.show_ghost(not view.diagnostics.has_ghost)
                case "trust":
                    view.diagnostics.watch_divergence(view.diagnostics.divergence is None)
                case "scrub":
                    view.scrub(number)
                case "seek":
                    view.seek(int(number * 20))
                case "switch":
                    view.switch_engine(("pymunk", "reference", "exact")[int(number)])
                case _:
                    view.apply(ACTIONS[int(number)])
        except ActionError as error:
            assert str(error)
        snapshot = view.snapshot(ALL)
        assert len(snapshot.frame.position) <= len(view.bodies) or view.session.frame is not view.frame
        assert np.isfinite(snapshot.frame.position).all()
        assert all(np.isfinite(view.energy()))
    wait_for_seek(view)
    recording = view.session.recording()
    assert rerun(recording, audit=False).info["state_hash"] == recording.state_hash
    view.close()


# Stored runs


def recorded_view() -> RecordedView:
    return RecordedView(RecordedRun(run(bounce(), "pymunk", dt=0.01)))


def test_stored_run_is_stepped_and_scrubbed_by_frames() -> None:
    view = recorded_view()
    assert (view.start_time, view.end_time, view.step_number) == (0.0, 6.0, 0)
    view.step_back()
    assert view.step_number == 0
    for k in range(1, 5):
        view.step()
        assert view.step_number == k
        assert view.frame.position[0].tolist() == view.run.trajectory.position[k, 0].tolist()
    view.step_back()
    assert view.step_number == 3
    view.scrub(0.034)
    assert view.step_number == 3
    view.step_back()  # to the frame before the current time
    assert view.frame.time == view.run.trajectory.time[3]
    view.scrub(-5.0)
    assert view.frame.time == 0.0
    view.scrub(99.0)
    view.commit_scrub()
    assert (view.frame.time, view.step_number) == (6.0, 600)
    view.step()
    view.update(1.0, paused=False)
    assert view.frame.time == 6.0


def test_stored_run_plays_in_real_time_times_its_speed() -> None:
    view = recorded_view()
    view.update(0.05, paused=False)
    assert view.frame.time == pytest.approx(0.05, rel=1e-12)  # rounding
    view.update(0.05, paused=True)
    view.clock.faster()
    view.update(0.05, paused=False)
    assert view.frame.time == pytest.approx(0.05 * (1.0 + 10**0.1), rel=1e-12)  # rounding
    assert view.engine == "pymunk"
    assert view.missed_contacts == 0
    assert view.keyframe_times == ()
    assert sum(view.energy()[:2]) == pytest.approx(view.energy()[2], rel=1e-12)  # rounding
    view.close()


def test_stored_run_of_one_frame_stays_at_its_start() -> None:
    view = RecordedView(RecordedRun(run(bounce(), "pymunk", audit=False).at([0])))
    view.step()
    view.step_back()
    view.update(1.0, paused=False)
    assert view.step_number == 0
    assert view.start_time == view.end_time == 0.0
    assert view.snapshot(ALL).frame.position.tolist() == [[0.0, 5.5]]
