"""Live: a session driven by real time; and stored runs, which are driven alike but cannot be changed."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sandbox.action import Action, ActionError, Impulse, Move, Pull, Remove, Reshape, Spawn, Toggle
from sandbox.measure.run.runner import run
from sandbox.measure.run.sessions import rerun
from sandbox.scene.compile.scene import Scene
from sandbox.scene.description.discs import Ball
from sandbox.scene.files.load import from_document, load
from sandbox.scene.files.shipped_scenes import find
from sandbox.trajectory import Trajectory
from sandbox.window.playback import live as journey
from sandbox.window.playback import live as module
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.recorded import RecordedRun, RecordedView
from sandbox.window.playback.session import Session

pytestmark = pytest.mark.full  # property tests with many examples

ALL = frozenset({"shapes", "trails", "contacts"})


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """No test depends on how fast the machine is."""
    monkeypatch.setattr(module, "MIN_STEP_BUDGET", 1e9)
    monkeypatch.setattr(module, "MAX_STEP_BUDGET", 1e9)


def bounce() -> Scene:
    return load(find("bounce"))


def live(name: str = "bounce", engine: str = "pymunk") -> LiveView:
    return LiveView(Session(load(find(name)), engine))


def arrived(show: LiveView) -> LiveView:
    while show.busy is not None:
        show.update(1 / 60, paused=True)
    return show


def test_real_time_makes_steps() -> None:
    show = live()
    for k in range(1, 61):
        show.update(1 / 60, paused=False)
        assert show.session.time == pytest.approx(k / 60, abs=0.001)  # up to a step
    frame = show.snapshot(ALL).frame
    assert show.session.previous.time <= frame.time <= show.session.time
    assert frame.time == pytest.approx(show.session.time - 0.001 + 0.001 * show.alpha, abs=1e-12)  # rounding


def test_pause_stands_still_and_a_step_is_one_step() -> None:
    show = live()
    show.update(0.05, paused=False)
    step = show.step_number
    show.update(9.0, paused=True)
    assert show.step_number == step
    show.step()
    assert show.step_number == step + 1
    show.step_back()
    arrived(show)
    assert show.step_number == step
    show.update(9.0, paused=False)
    assert show.step_number <= step + 100  # 0.1 s at most after a pause of the machine
    assert show.step_number >= step + 99


def test_slow_motion_makes_fewer_steps() -> None:
    show = live()
    for _ in range(10):
        show.clock.slower()
    for _ in range(60):
        show.update(1 / 60, paused=False)
    assert show.session.time == pytest.approx(0.1, abs=0.001)  # up to a step


def test_machine_that_is_too_slow_drops_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MIN_STEP_BUDGET", -1.0)  # one step is made, then it is late already
    monkeypatch.setattr(module, "MAX_STEP_BUDGET", -1.0)
    show = live()
    for _ in range(20):
        before = show.step_number
        show.update(0.05, paused=False)
        assert 1 <= show.step_number - before <= 2
    assert show.clock.real_speed < 0.1


def test_recorded_part_ends_in_a_pause_once() -> None:
    first = Session(bounce())
    first.advance(100)
    first.apply(Impulse(time=0.0, body="ball", impulse=(1.0, 0.0)))
    first.advance(50)
    recording = first.recording()
    show = LiveView(Session(bounce(), actions=recording.actions), until=recording.duration)
    for _ in range(9):
        show.update(0.03, paused=False)
        if show.wants_pause:
            break
    assert show.wants_pause
    assert show.session.simulation.state_hash() == recording.state_hash
    show.wants_pause = False
    show.update(0.03, paused=False)
    assert not show.wants_pause
    assert show.step_number > 150
    assert len(show.notifications) == 1


def test_scrub_looks_and_settle_goes_there() -> None:
    show = live()
    for _ in range(150):
        show.step()
    here = show.session.frame
    show.scrub(0.0504)
    assert show.step_number == 50
    assert show.frame.time == pytest.approx(0.05, rel=1e-12)  # rounding
    assert show.session.frame is here
    assert show.snapshot(ALL).frame is show.frame
    show.scrub(-9.0)
    assert show.step_number == 0
    show.scrub(99.0)
    assert show.step_number == 150
    show.commit_scrub()
    assert show.busy is None
    show.scrub(0.07)
    seen = show.frame.state_hash()
    show.commit_scrub()
    arrived(show)
    assert (show.session.step_number, show.session.frame.state_hash()) == (70, seen)
    show.commit_scrub()
    assert show.end_time == pytest.approx(0.15, rel=1e-12)  # rounding


def test_scrub_shows_walls_as_they_were_then() -> None:
    """Also while the session stands before or behind that time; and each time is one scene, which is drawn once."""
    shelf = {"name": "shelf", "points": [[-1, 0], [1, 0]]}
    ball = {"name": "ball", "position": [0, 5.0], "radius": 0.1}
    show = LiveView(Session(from_document({"ball": [ball], "wall": [shelf]}), "pymunk"))
    courses = [((-1.0, 0.0), (1.0, 0.0))]
    for k in (1.0, 2.0):
        show.step()
        courses.append(((-1.0, k), (1.0, k)))
        show.apply(Reshape(time=0.0, thing="shelf", points=courses[-1]))
        show.apply(Toggle(time=0.0, thing="shelf", solid=k == 2.0))
    show.step()
    dt = show.settings.dt
    for stand in (3, 0, 2):
        show.seek(stand)
        arrived(show)
        seen = []
        for step in (0, 1, 2, 3, 0):
            show.scrub(step * dt)
            seen.append(show.snapshot(ALL).scene)
            assert (seen[-1].walls[0].points, seen[-1].walls[0].solid) == (courses[min(step, 2)], step != 1)
        assert seen[0] is seen[-1]
        assert show.snapshot(ALL).scene is seen[0]
    show.commit_scrub()
    arrived(show)
    assert show.snapshot(ALL).scene is show.scene


def test_scrub_shows_bodies_that_have_not_come_yet() -> None:
    """The session has gone back to before they were added; what came later was seen all the same."""
    show = live()
    for k in range(3):
        show.step()
        show.apply(Spawn(time=0.0, ball=Ball(position=(3.0 * k + 3.0, 5.0), radius=0.25, mass=2.0)))
    show.step()
    show.seek(1)
    arrived(show)
    assert (len(show.bodies), show.bodies.names) == (2, ("ball", "spawned-2"))
    for time, count in ((1.0, 4), (0.002, 3), (0.0, 1), (1.0, 4)):
        show.scrub(time)
        sight = show.snapshot(ALL)
        assert len(sight.frame.position) == count
        assert len(sight.bodies) >= count
        assert sight.bodies.radius[1:].tolist() == [0.25] * (len(sight.bodies) - 1)
        assert all(np.isfinite(show.energy()))
    show.commit_scrub()
    arrived(show)
    assert len(show.session.bodies) == 4


def test_on_the_way_nothing_can_be_done(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(journey, "SEEK_BUDGET", -1.0)  # no part of the way at once
    show = live("gas")
    for _ in range(100):
        show.step()
    show.seek(50)
    assert show.busy == "replaying 0%"
    for _ in range(2):
        with pytest.raises(ActionError, match="wait"):
            show.apply(Remove(time=0.0, body="atom-1"))
        with pytest.raises(ActionError, match="wait"):
            show.switch_engine("exact")
        show.step_back()  # is not heard
    show.seek(20)  # another one before the first is done
    show.seek(99)
    monkeypatch.setattr(journey, "SEEK_BUDGET", 1e9)
    show.update(1.0, paused=False)
    assert show.busy is None
    assert show.step_number == 99
    show.apply(Remove(time=0.0, body="atom-1"))


def test_session_that_ended_says_so_once_and_again_after_going_back() -> None:
    ball = {"name": "a", "position": [9.9e15, 0], "radius": 1, "velocity": [1e12, 0]}
    show = LiveView(Session(from_document({"ball": [ball], "solver": {"dt": 10.0}}), "reference"))
    show.session.advance(9010)
    for _ in range(3):
        show.step()
    assert [level for level, _ in show.notifications] == ["error"]
    show.update(1.0, paused=False)
    assert show.step_number == 9011
    show.notifications.clear()
    show.step_back()
    arrived(show)
    assert show.step_number == 9010
    show.step()
    assert [level for level, _ in show.notifications] == ["error"]
    show.seek(9999)
    arrived(show)
    assert show.step_number == 9011
    show.seek(0)
    arrived(show)
    assert show.session.ended is None


def test_way_that_leads_elsewhere_is_left_while_playing() -> None:
    """A checkpoint of `exact` rounds otherwise: what is seen then is what was seen before all the same."""
    show = live("newtons_cradle", "exact")
    for _ in range(200):
        show.step()
    seen = {k: show.session.history.get(k) for k in range(201)}
    for step in show.session.history.keyframe_steps or (60,):
        show.seek(step)
        arrived(show)
        while show.step_number < min(step + 20, 200):
            show.step()
            arrived(show)
            known = seen[show.step_number]
            assert known is not None
            assert show.frame.state_hash() == known.state_hash()


def test_relaunch_is_another_firework_each_time_and_can_be_replayed() -> None:
    show, places = live("fireworks"), []
    begin = show.frame.velocity.copy()
    for _ in range(3):
        for _ in range(5):
            show.step()
        show.relaunch("spark")
        places.append(show.frame.velocity.copy())
        assert not np.array_equal(places[-1], begin)
    assert not np.array_equal(places[0], places[1])
    recording = show.session.recording()
    assert rerun(recording).info["state_hash"] == recording.state_hash
    with pytest.raises(ActionError, match="no generator"):
        show.relaunch("zzz")


def test_switch_while_pulling_goes_on_pulling() -> None:
    show = LiveView(Session(from_document({"ball": [{"name": "a", "position": [0, 0], "radius": 1}]})))
    show.apply(Pull(time=0.0, body="a", target=(2.0, 0.0)))
    for engine in ("exact", "reference", "pymunk"):
        show.step()
        assert show.switch_engine(engine) is None
        assert show.engine == engine
    for _ in range(150):
        show.step()
    assert show.frame.position[0] == pytest.approx([2.0, 0.0], abs=1e-9)  # (1 + ωt)·e^{−ωt}


def test_overlap_colours_are_those_of_the_scene_that_asks_for_them() -> None:
    show = live("circle_half_plane")
    assert show.snapshot(ALL).overlapping is not None
    show.apply(Move(time=0.0, body="circle", position=(0.0, 0.5)))
    over = show.snapshot(ALL).overlapping
    assert over is not None
    assert over.tolist() == [True]
    assert live().snapshot(ALL).overlapping is None


ODD: list[dict[str, Any]] = [
    {"title": "empty"},
    {"plane": [{"point": [0, 0], "normal": [0, 1]}]},
    {"ball": [{"name": "a", "position": [0, 0], "radius": 1, "fixed": True}]},
    {
        "ball": [{"name": "a", "position": [0, 0], "radius": 0.1, "velocity": [90, 0]}],
        "world": {"bounds": [[-1, -1], [1, 1]]},
    },
    {"ball": [{"name": "a", "position": [0, 0], "radius": 1}], "solver": {"dt": 10.0}, "world": {"duration": 0.1}},
]

moves = st.one_of(
    st.tuples(st.just("go"), st.floats(0.0, 0.2)),
    st.tuples(
        st.sampled_from(["step", "step_back", "commit_scrub", "slower", "faster", "ghost", "trust"]), st.just(0.0)
    ),
    st.tuples(st.sampled_from(["scrub", "seek"]), st.floats(-1.0, 3.0)),
    st.tuples(st.just("act"), st.floats(0.0, 4.9)),
    st.tuples(st.just("switch"), st.floats(0.0, 2.9)),
)
DEEDS: list[Action] = [
    Impulse(time=0.0, body="a", impulse=(0.1, 0.4)),
    Pull(time=0.0, body="a", target=(0.5, 0.5)),
    Pull(time=0.0, body="a"),
    Spawn(time=0.0, ball=Ball(position=(0.0, 0.5), radius=0.2)),
    Remove(time=0.0, body="a"),
]


@pytest.mark.parametrize("which", range(len(ODD)))
@given(plan=st.lists(moves, max_size=15), engine=st.sampled_from(["pymunk", "reference", "exact"]))
@settings(max_examples=30)
def test_odd_scenes_can_be_played_in_any_order(which: int, plan: list[tuple[str, float]], engine: str) -> None:
    show = LiveView(Session(from_document(ODD[which]), engine))
    for kind, number in plan:
        try:
            match kind:
                case "go":
                    show.update(number, paused=False)
                case "step" | "step_back" | "commit_scrub":
                    getattr(show, kind)()
                case "slower" | "faster":
                    getattr(show.clock, kind)()
                case "ghost":
                    show.diagnostics.show_ghost(not show.diagnostics.has_ghost)
                case "trust":
                    show.diagnostics.watch_divergence(show.diagnostics.divergence is None)
                case "scrub":
                    show.scrub(number)
                case "seek":
                    show.seek(int(number * 20))
                case "switch":
                    show.switch_engine(("pymunk", "reference", "exact")[int(number)])
                case _:
                    show.apply(DEEDS[int(number)])
        except ActionError as error:
            assert str(error)
        sight = show.snapshot(ALL)
        assert len(sight.frame.position) <= len(show.bodies) or show.session.frame is not show.frame
        assert np.isfinite(sight.frame.position).all()
        assert all(np.isfinite(show.energy()))
    arrived(show)
    recording = show.session.recording()
    assert rerun(recording, audit=False).info["state_hash"] == recording.state_hash
    show.close()


# Stored runs.


def stored(**more: Any) -> RecordedView:
    return RecordedView(
        RecordedRun(run(bounce().model_copy(update={"world": bounce().world}), "pymunk", dt=0.01, **more))
    )


def test_stored_run_is_gone_through_by_frames() -> None:
    show = stored()
    assert (show.start_time, show.end_time, show.step_number) == (0.0, 6.0, 0)
    show.step_back()
    assert show.step_number == 0
    for k in range(1, 5):
        show.step()
        assert show.step_number == k
        assert show.frame.position[0].tolist() == show.run.trajectory.position[k, 0].tolist()
    show.step_back()
    assert show.step_number == 3
    show.scrub(0.034)
    assert show.step_number == 3
    show.step_back()  # to the frame that was just passed
    assert show.frame.time == show.run.trajectory.time[3]
    show.scrub(-5.0)
    assert show.frame.time == 0.0
    show.scrub(99.0)
    show.commit_scrub()
    assert (show.frame.time, show.step_number) == (6.0, 600)
    show.step()
    show.update(1.0, paused=False)
    assert show.frame.time == 6.0


def test_stored_run_goes_on_by_real_time_and_its_speed() -> None:
    show = stored()
    show.update(0.05, paused=False)
    assert show.frame.time == pytest.approx(0.05, rel=1e-12)  # rounding
    show.update(0.05, paused=True)
    show.clock.faster()
    show.update(0.05, paused=False)
    assert show.frame.time == pytest.approx(0.05 * (1.0 + 10**0.1), rel=1e-12)  # rounding
    assert show.engine == "pymunk"
    assert show.missed_contacts == 0
    assert show.keyframe_times == ()
    assert sum(show.energy()[:2]) == pytest.approx(show.energy()[2], rel=1e-12)  # rounding
    show.close()


def test_stored_run_of_one_frame_stands_still() -> None:
    session = Session(bounce())
    show = RecordedView(RecordedRun(first_frame(session)))
    show.step()
    show.step_back()
    show.update(1.0, paused=False)
    assert show.step_number == 0
    assert show.start_time == show.end_time == 0.0
    assert show.snapshot(ALL).frame.position.tolist() == [[0.0, 5.5]]


def first_frame(session: Session) -> Trajectory:
    return run(session.scene, "pymunk", audit=False).at([0])


def test_way_back_knows_what_was_solid_then() -> None:
    shelf = {"name": "shelf", "points": [[-1, 0], [1, 0]]}
    ball = {"name": "ball", "position": [0, 0.1], "radius": 0.1}
    scene = from_document({"world": {"gravity": [0, -9.81], "duration": 5}, "ball": [ball], "wall": [shelf]})
    show = LiveView(Session(scene, "pymunk"))
    for _ in range(60):
        show.update(1 / 60, paused=False)
    show.apply(Toggle(time=0.0, thing="shelf", solid=False))
    for _ in range(60):
        show.update(1 / 60, paused=False)
    fell, then = show.session.frame, show.session.step_number
    assert fell.position[0, 1] < -3.0
    show.seek(then // 4)
    arrived(show)
    assert show.scene.walls[0].solid
    assert show.session.frame.position[0, 1] == pytest.approx(0.1, abs=0.01)  # slop
    show.seek(then)
    arrived(show)
    assert not show.scene.walls[0].solid
    assert np.array_equal(show.session.frame.position, fell.position)
