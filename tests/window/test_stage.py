"""The stage: scene files opened, walked through, reloaded and restarted; knobs turned; whatever fails is told."""

from pathlib import Path
from typing import Any

import pytest

from sandbox.action import SetParameter, Switch
from sandbox.engines.registry import ENGINES
from sandbox.measure.run.runner import run
from sandbox.scene.files.load import from_document, load
from sandbox.scene.files.shipped_scenes import find
from sandbox.window.app_state import AppState
from sandbox.window.playback import live as live_module
from sandbox.window.playback.live import LiveView
from sandbox.window.playback.parameters import SessionParameters, turned
from sandbox.window.playback.recorded import RecordedRun, RecordedView
from sandbox.window.playback.session import Session

pytestmark = pytest.mark.full  # a window or a film

GOOD = """
title = "{name}"
[world]
gravity = [0.0, -9.81]
[solver]
dt = 0.01
[[plane]]
point = [0.0, 0.0]
normal = [0.0, 1.0]
restitution = 1.0
[[ball]]
name = "a"
position = [0.0, 5.0]
radius = 0.5
restitution = 0.25
[[ball]]
name = "b"
position = [3.0, 5.0]
radius = 0.5
"""
BAD = 'title = "bad"\n\n[[ball]]\nposition = [0.0]\nradius = -1.0\n'
OVERLAPPING = """
[[ball]]
position = [0.0, 0.0]
radius = 1.0
[[ball]]
position = [0.5, 0.0]
radius = 1.0
"""


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """No test depends on how fast the machine is."""
    for name in ("MIN_STEP_BUDGET", "MAX_STEP_BUDGET"):
        monkeypatch.setattr(live_module, name, 1e9)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in "abc":
        (tmp_path / f"{name}.toml").write_text(GOOD.format(name=name))
    return tmp_path


def opened(path: Path, engine: str = "pymunk", **more: Any) -> AppState:
    stage = AppState(engine, **more)
    assert stage.open(path)
    return stage


def live(stage: AppState) -> LiveView:
    assert stage.live is not None
    return stage.live


def told(stage: AppState, level: str) -> str:
    return "\n".join(text for each, text in stage.messages.visible() if each == level)


def test_faulty_file_keeps_the_old_scene_and_tells_the_faults_with_their_lines(folder: Path) -> None:
    stage = opened(folder / "a.toml")
    stage.update(0.05)
    show, step = live(stage), live(stage).step_number
    (folder / "a.toml").write_text(BAD)
    stage.reload()
    assert stage.view is show
    assert live(stage).step_number == step
    assert len(stage.faults) == 2
    assert [fault.split("a.toml:")[1].split(":")[0] for fault in stage.faults] == ["4", "5"]
    stage.update(0.05)
    assert live(stage).step_number > step
    (folder / "a.toml").write_text(GOOD.format(name="mended"))
    stage.reload()
    assert stage.faults == ()
    assert live(stage).scene.title == "mended"
    assert live(stage).step_number == 0
    assert "a.toml reloaded" in told(stage, "info")


def test_file_that_is_gone_or_is_a_folder_is_a_fault(folder: Path) -> None:
    stage = opened(folder / "a.toml")
    (folder / "a.toml").unlink()
    stage.reload()
    assert len(stage.faults) == 1
    assert not stage.open(folder)
    assert not AppState().open(folder / "none.toml")
    assert live(stage).scene.title == "a"


def test_restart_keeps_engine_settings_and_what_was_turned(folder: Path) -> None:
    stage = opened(folder / "a.toml")
    stage.update(0.05)
    stage.switch_engine("reference")
    stage.set_parameter("gravity", -1.5)
    stage.set_parameter("dt", 0.002)
    stage.set_parameter("integrator", "leapfrog")
    stage.set_parameter("restitution", 0.5)
    stage.body_tools.picked = 1
    stage.set_parameter("restitution", 0.75)
    stage.body_tools.picked = None
    stage.paused = True
    stage.restart()
    show = live(stage)
    assert stage.paused
    assert (show.step_number, show.engine) == (0, "reference")
    assert show.scene.world.gravity == (0.0, -1.5)
    assert (show.settings.dt, show.settings.integrator) == (0.002, "leapfrog")
    assert [ball.restitution for ball in show.scene.balls] == [0.5, 0.75]
    stage.set_parameter("restitution", 0.125)  # of all, after that of one
    stage.restart()
    assert [ball.restitution for ball in live(stage).scene.balls] == [0.125, 0.125]
    stage.reload()
    assert live(stage).scene.world.gravity == (0.0, -9.81)
    assert [ball.restitution for ball in live(stage).scene.balls] == [0.25, None]
    assert live(stage).engine == "reference"


def test_walk_goes_through_the_folder_and_keeps_engine_and_pause(folder: Path) -> None:
    stage = opened(folder / "b.toml", "reference")
    told_of: list[bool] = []
    stage.on_scene_changed = told_of.append
    stage.paused = True
    titles = []
    for by in (1, 1, 1, -1, -1):
        stage.open_neighbour(by)
        titles.append(live(stage).scene.title)
    assert titles == ["c", "a", "b", "a", "c"]
    assert stage.paused
    assert stage.engine == "reference"
    assert told_of == [False] * 5
    stage.reload()
    stage.restart()
    assert told_of[5:] == [True, True]


def test_walk_tells_a_faulty_file_and_passes_it(folder: Path) -> None:
    (folder / "b.toml").write_text(BAD)
    stage = opened(folder / "a.toml")
    stage.open_neighbour(1)
    assert live(stage).scene.title == "a"
    assert stage.faults
    stage.open_neighbour(1)
    assert live(stage).scene.title == "c"
    assert stage.faults == ()
    stage.open_neighbour(-1)
    assert stage.faults
    stage.open_neighbour(-1)
    assert live(stage).scene.title == "a"
    assert stage.faults == ()


def test_walk_back_from_a_faulty_file_goes_on_with_what_is_on(folder: Path) -> None:
    (folder / "b.toml").write_text(BAD)
    stage = opened(folder / "a.toml")
    stage.open_neighbour(1)
    show = stage.view
    stage.open_neighbour(-1)
    assert stage.view is show
    assert stage.faults == ()
    stage.open_neighbour(-1)
    assert live(stage).scene.title == "c"


def test_engine_that_was_asked_for_comes_back_after_a_scene_that_it_refuses(folder: Path) -> None:
    (folder / "b.toml").write_text(OVERLAPPING)
    stage = opened(folder / "a.toml", "exact")
    stage.open_neighbour(1)
    assert stage.engine == "pymunk"
    stage.restart()
    assert stage.engine == "pymunk"
    stage.open_neighbour(1)
    assert stage.engine == "exact"
    stage.open_neighbour(-1)
    stage.switch_engine("reference")
    stage.open_neighbour(1)
    assert stage.engine == "reference"


def test_stored_run_pauses_at_its_end_and_starts_over_from_there() -> None:
    stage = AppState()
    show = RecordedView(RecordedRun(run(load(find("bounce")), "pymunk", dt=0.01)))
    stage.show(show, None, show.scene)
    for _ in range(200):
        stage.update(0.05)
    assert stage.paused
    assert show.at_end
    stage.paused = True  # again: that is no going on
    assert show.at_end
    stage.paused = False
    assert show.step_number == 0
    stage.update(0.05)
    assert show.step_number > 0
    stage.paused = True
    step = show.step_number
    stage.paused = False  # not at the end
    assert show.step_number == step


def test_scene_that_the_engine_refuses_is_played_by_one_that_does_not(folder: Path) -> None:
    (folder / "b.toml").write_text(OVERLAPPING)
    stage = opened(folder / "a.toml", "exact")
    stage.open_neighbour(1)
    assert live(stage).engine == "pymunk"
    assert "exact refuses" in told(stage, "warning")
    assert "opened with pymunk" in told(stage, "warning")


def test_next_engine_goes_round_and_skips_who_refuses_and_says_why(folder: Path) -> None:
    stage, seen = opened(folder / "a.toml"), []
    stage.update(0.05)
    before = live(stage).frame
    for _ in range(len(ENGINES)):
        stage.switch_to_next_engine()
        seen.append(live(stage).engine)
        assert live(stage).frame.state_hash() == before.state_hash()
    assert seen == [*list(ENGINES)[1:], next(iter(ENGINES))]
    (folder / "b.toml").write_text(OVERLAPPING)
    stage.open_neighbour(1)
    assert live(stage).engine == "pymunk"
    stage.switch_to_next_engine()
    assert live(stage).engine == "reference"
    assert "exact refuses" in told(stage, "warning")


def test_refused_switch_leaves_all_as_it_was(folder: Path) -> None:
    (folder / "b.toml").write_text(OVERLAPPING)
    stage = opened(folder / "b.toml")
    stage.update(0.03)
    before = live(stage).frame.state_hash()
    for engine in ("exact", "zzz", "pymunk"):
        assert not stage.switch_engine(engine)
    assert (live(stage).engine, live(stage).frame.state_hash()) == ("pymunk", before)
    assert live(stage).session.actions == ()
    assert "zzz" in told(stage, "warning")


def test_overrides_hold_in_every_scene_that_is_opened(folder: Path) -> None:
    stage = opened(folder / "a.toml", overrides=["solver.dt=0.005"])
    stage.open_neighbour(1)
    stage.reload()
    assert live(stage).settings.dt == 0.005


def test_ghost_and_trust_stay_wanted_in_the_next_scene(folder: Path) -> None:
    stage = opened(folder / "a.toml")
    assert live(stage).diagnostics.divergence is not None
    stage.toggle_ghost()
    stage.toggle_trust()
    stage.open_neighbour(1)
    assert live(stage).diagnostics.ghost_engine == "exact"
    assert live(stage).diagnostics.divergence is None
    stage.restart()
    assert live(stage).diagnostics.has_ghost
    stage.toggle_ghost()
    assert not live(stage).diagnostics.has_ghost


def test_many_bodies_have_no_twin_unless_asked_for() -> None:
    stage = opened(find("gas"))
    assert live(stage).diagnostics.divergence is None
    stage.toggle_trust()
    assert live(stage).diagnostics.divergence is not None


def test_what_cannot_be_done_is_a_message(folder: Path) -> None:
    stage = opened(folder / "a.toml")
    assert stage.body_tools.pick(live(stage), (0.0, 5.0), 0.0)
    stage.use_tool(stage.body_tools.remove)
    assert not live(stage).frame.present[0]
    assert not stage.body_tools.pick(live(stage), (0.0, 5.0), 0.0)
    assert not stage.use_tool(lambda live: live.relaunch("zzz"))
    assert "zzz" in told(stage, "warning")


def test_stored_run_refuses_every_change_with_a_message() -> None:
    scene = load(find("bounce"))
    stage = AppState()
    show = RecordedView(RecordedRun(run(scene, "pymunk", dt=0.01)))
    stage.show(show, None, scene)
    before = show.frame
    assert stage.body_tools.pick(show, (0.0, 5.5), 0.0)  # one may look
    assert stage.body_tools.picked == 0
    for deed in (
        lambda: stage.use_tool(stage.body_tools.nudge),
        lambda: stage.use_tool(stage.body_tools.remove),
        lambda: stage.use_tool(lambda live: stage.body_tools.add(live, (0.0, 0.0), 1.0)),
        lambda: stage.use_tool(lambda live: stage.body_tools.drag(live, (0.0, 0.0))),
        stage.switch_to_next_engine,
        stage.toggle_ghost,
        stage.toggle_trust,
        stage.reload,
    ):
        stage.messages = type(stage.messages)()
        deed()
        assert told(stage, "warning")
    stage.set_parameter("gravity", 1.0)
    assert not stage.switch_engine("exact")
    assert show.frame.state_hash() == before.state_hash()
    stage.step()
    assert stage.paused
    assert show.step_number == 1
    stage.step_back()
    stage.faster()
    stage.slower()
    stage.restart()
    assert show.step_number == 0
    stage.open_neighbour(1)  # the shipped scenes
    assert stage.live is not None
    stage.close()


def test_empty_stage_does_nothing_and_says_so() -> None:
    stage = AppState("exact")
    stage.update(1.0)
    for deed in (
        stage.step,
        stage.step_back,
        stage.slower,
        stage.faster,
        stage.restart,
        stage.switch_to_next_engine,
        stage.close,
    ):
        deed()
    stage.set_parameter("gravity", 1.0)
    stage.reload()
    assert stage.engine == "exact"


def test_step_and_back_pause(folder: Path) -> None:
    stage = opened(folder / "a.toml")
    stage.update(0.05)
    stage.step()
    assert stage.paused
    step = live(stage).step_number
    stage.paused = False
    stage.step_back()
    assert stage.paused
    while live(stage).busy is not None:
        stage.update(0.01)
    assert live(stage).step_number == step - 1


# Knobs.


def knob(live: LiveView, key: str, picked: int | None = None) -> Any:
    (found,) = [each for each in SessionParameters().of(live, live.scene, picked) if each.key == key]
    return found


@pytest.mark.parametrize("engine", ENGINES)
def test_knobs_show_what_is(engine: str, folder: Path) -> None:
    show = LiveView(Session(load(folder / "a.toml"), engine))
    assert knob(show, "gravity").value == -9.81
    assert knob(show, "dt").value == 0.01
    assert knob(show, "engine").value == engine
    assert knob(show, "restitution").value == knob(show, "restitution", 0).value == 0.25
    assert knob(show, "restitution", 1).value == 0.0
    assert knob(show, "substeps").enabled == (engine != "exact")
    for key in ("integrator", "detection"):
        found = knob(show, key)
        if found.enabled:
            assert found.value in found.choices
            for word in found.choices:
                show.apply(Switch(time=0.0, settings={key: word}))
                assert knob(show, key).value == word
        else:
            assert found.why


@pytest.mark.parametrize("names", [["0", "1"], ["1", "0"], ["a.b", "*"], ['say "hi"', "it's"], ["x.\"y'", "'q"]])
def test_knob_of_one_ball_turns_that_ball_whatever_it_is_called(names: list[str]) -> None:
    balls = [{"name": name, "position": [3.0 * k, 0.0], "radius": 1} for k, name in enumerate(names)]
    scene = from_document({"ball": [*balls, {"position": [9.0, 0.0], "radius": 1}]})
    for picked in range(3):
        show = LiveView(Session(scene))
        for action in turned(show, "friction", 0.5, picked):
            assert isinstance(action, SetParameter)
            show.apply(action)
        assert [each.friction for each in show.scene.balls] == [0.5 if k == picked else None for k in range(3)]
        assert knob(show, "friction", picked).value == 0.5
    show = LiveView(Session(scene))
    for action in turned(show, "restitution", 0.5, None):
        show.apply(action)
    assert [each.restitution for each in show.scene.balls] == [0.5] * 3


def test_knob_of_a_generators_ball_turns_all_of_that_generator() -> None:
    scene = from_document(
        {
            "ball": [{"position": [0, 0], "radius": 1}],
            "grid": [{"origin": [5 * k, 9], "columns": 2, "spacing": [2.5, 2.5], "radius": 1} for k in range(2)],
        }
    )
    show = LiveView(Session(scene))
    for action in turned(show, "restitution", 0.5, 4):
        show.apply(action)
    assert [each.restitution for each in show.scene.body_sources] == [None, None, 0.5]


def test_knobs_of_a_scene_without_balls_or_of_a_ball_that_has_not_come_are_harmless() -> None:
    show = LiveView(Session(from_document({"title": "t"})))
    assert not knob(show, "restitution").enabled
    assert turned(show, "restitution", 0.5, None) == []
    assert not knob(show, "friction", 7).enabled
    show = LiveView(Session(from_document({"ball": [{"position": [0, 0], "radius": 1}]})))
    assert knob(show, "friction", 7).label == "friction"


def test_default_is_the_files(folder: Path) -> None:
    stage = opened(folder / "a.toml")
    stage.set_parameter("restitution", 0.75)
    stage.set_parameter("gravity", 3.0)
    assert stage.file is not None
    knobs = {each.key: each for each in SessionParameters().of(live(stage), stage.file, None)}
    assert (knobs["restitution"].value, knobs["restitution"].default) == (0.75, 0.25)
    assert (knobs["gravity"].value, knobs["gravity"].default) == (3.0, -9.81)
