"""State of the window: opening, reloading and restarting scenes, switching engines, parameters, and error messages."""

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
from sandbox.window.playback.parameters import SessionParameters, parameter_actions
from sandbox.window.playback.recorded import RecordedRun, RecordedView
from sandbox.window.playback.session import Session
from tests.toml_text import toml

pytestmark = pytest.mark.fail_slow(60)  # a window or a film

GOOD = (
    toml(title="{name}")
    + toml("world", gravity=[0.0, -9.81])
    + toml("solver", dt=0.01)
    + toml("plane", point=[0.0, 0.0], normal=[0.0, 1.0], restitution=1.0)
    + toml("ball", name="a", position=[0.0, 5.0], radius=0.5, restitution=0.25)
    + toml("ball", name="b", position=[3.0, 5.0], radius=0.5)
)
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
def no_step_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    """Remove the time budget of steps, so that no test depends on the speed of the machine."""
    for name in ("MIN_STEP_BUDGET", "MAX_STEP_BUDGET"):
        monkeypatch.setattr(live_module, name, 1e9)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in "abc":
        (tmp_path / f"{name}.toml").write_text(GOOD.format(name=name))
    return tmp_path


def open_state(path: Path, engine: str = "pymunk", **more: Any) -> AppState:
    state = AppState(engine, **more)
    assert state.open(path)
    return state


def live(state: AppState) -> LiveView:
    assert state.live is not None
    return state.live


def messages(state: AppState, level: str) -> str:
    return "\n".join(text for each, text in state.messages.visible() if each == level)


def test_faulty_file_keeps_the_old_scene_and_lists_faults_with_line_numbers(folder: Path) -> None:
    state = open_state(folder / "a.toml")
    state.update(0.05)
    view, step = live(state), live(state).step_number
    (folder / "a.toml").write_text(BAD)
    state.reload()
    assert state.view is view
    assert live(state).step_number == step
    assert len(state.faults) == 2
    assert [fault.split("a.toml:")[1].split(":")[0] for fault in state.faults] == ["4", "5"]
    state.update(0.05)
    assert live(state).step_number > step
    (folder / "a.toml").write_text(GOOD.format(name="mended"))
    state.reload()
    assert state.faults == ()
    assert live(state).scene.title == "mended"
    assert live(state).step_number == 0
    assert "a.toml reloaded" in messages(state, "info")


def test_missing_file_and_folder_are_faults(folder: Path) -> None:
    state = open_state(folder / "a.toml")
    (folder / "a.toml").unlink()
    state.reload()
    assert len(state.faults) == 1
    assert not state.open(folder)
    assert not AppState().open(folder / "none.toml")
    assert live(state).scene.title == "a"


def test_restart_keeps_engine_settings_and_parameters(folder: Path) -> None:
    state = open_state(folder / "a.toml")
    state.update(0.05)
    state.switch_engine("reference")
    state.set_parameter("gravity", -1.5)
    state.set_parameter("dt", 0.002)
    state.set_parameter("integrator", "leapfrog")
    state.set_parameter("restitution", 0.5)
    state.body_tools.picked = 1
    state.set_parameter("restitution", 0.75)
    state.body_tools.picked = None
    state.paused = True
    state.restart()
    view = live(state)
    assert state.paused
    assert (view.step_number, view.engine) == (0, "reference")
    assert view.scene.world.gravity == (0.0, -1.5)
    assert (view.settings.dt, view.settings.integrator) == (0.002, "leapfrog")
    assert [ball.restitution for ball in view.scene.balls] == [0.5, 0.75]
    state.set_parameter("restitution", 0.125)  # of all bodies, after that of one
    state.restart()
    assert [ball.restitution for ball in live(state).scene.balls] == [0.125, 0.125]
    state.reload()
    assert live(state).scene.world.gravity == (0.0, -9.81)
    assert [ball.restitution for ball in live(state).scene.balls] == [0.25, None]
    assert live(state).engine == "reference"


def test_open_neighbour_cycles_through_the_folder_and_keeps_engine_and_pause(folder: Path) -> None:
    state = open_state(folder / "b.toml", "reference")
    scene_changes: list[bool] = []
    state.on_scene_changed = scene_changes.append
    state.paused = True
    titles = []
    for step in (1, 1, 1, -1, -1):
        state.open_neighbour(step)
        titles.append(live(state).scene.title)
    assert titles == ["c", "a", "b", "a", "c"]
    assert state.paused
    assert state.engine == "reference"
    assert scene_changes == [False] * 5
    state.reload()
    state.restart()
    assert scene_changes[5:] == [True, True]


def test_open_neighbour_reports_a_faulty_file_and_continues_past_it(folder: Path) -> None:
    (folder / "b.toml").write_text(BAD)
    state = open_state(folder / "a.toml")
    state.open_neighbour(1)
    assert live(state).scene.title == "a"
    assert state.faults
    state.open_neighbour(1)
    assert live(state).scene.title == "c"
    assert state.faults == ()
    state.open_neighbour(-1)
    assert state.faults
    state.open_neighbour(-1)
    assert live(state).scene.title == "a"
    assert state.faults == ()


def test_open_neighbour_back_from_a_faulty_file_keeps_the_current_scene(folder: Path) -> None:
    (folder / "b.toml").write_text(BAD)
    state = open_state(folder / "a.toml")
    state.open_neighbour(1)
    view = state.view
    state.open_neighbour(-1)
    assert state.view is view
    assert state.faults == ()
    state.open_neighbour(-1)
    assert live(state).scene.title == "c"


def test_requested_engine_is_restored_after_a_scene_that_it_refuses(folder: Path) -> None:
    (folder / "b.toml").write_text(OVERLAPPING)
    state = open_state(folder / "a.toml", "exact")
    state.open_neighbour(1)
    assert state.engine == "pymunk"
    assert "exact refuses" in messages(state, "warning")
    assert "opened with pymunk" in messages(state, "warning")
    state.restart()
    assert state.engine == "pymunk"
    state.open_neighbour(1)
    assert state.engine == "exact"
    state.open_neighbour(-1)
    state.switch_engine("reference")
    state.open_neighbour(1)
    assert state.engine == "reference"


def test_stored_run_pauses_at_its_end_and_restarts_when_resumed() -> None:
    state = AppState()
    view = RecordedView(RecordedRun(run(load(find("bounce")), "pymunk", dt=0.01)))
    state.show(view, None, view.scene)
    for _ in range(200):
        state.update(0.05)
    assert state.paused
    assert view.at_end
    state.paused = True  # a repeated pause does not restart it
    assert view.at_end
    state.paused = False
    assert view.step_number == 0
    state.update(0.05)
    assert view.step_number > 0
    state.paused = True
    step = view.step_number
    state.paused = False  # not at the end
    assert view.step_number == step


def test_next_engine_cycles_and_skips_engines_that_refuse_with_a_warning(folder: Path) -> None:
    state, engines = open_state(folder / "a.toml"), []
    state.update(0.05)
    before = live(state).frame
    for _ in range(len(ENGINES)):
        state.switch_to_next_engine()
        engines.append(live(state).engine)
        assert live(state).frame.state_hash() == before.state_hash()
    assert engines == [*list(ENGINES)[1:], next(iter(ENGINES))]
    (folder / "b.toml").write_text(OVERLAPPING)
    state.open_neighbour(1)
    assert live(state).engine == "pymunk"
    state.switch_to_next_engine()
    assert live(state).engine == "box2d"
    state.switch_to_next_engine()
    assert live(state).engine == "reference"
    assert "exact refuses" in messages(state, "warning")


def test_refused_engine_switch_leaves_the_state_unchanged(folder: Path) -> None:
    (folder / "b.toml").write_text(OVERLAPPING)
    state = open_state(folder / "b.toml")
    state.update(0.03)
    before = live(state).frame.state_hash()
    for engine in ("exact", "zzz", "pymunk"):
        assert not state.switch_engine(engine)
    assert (live(state).engine, live(state).frame.state_hash()) == ("pymunk", before)
    assert live(state).session.actions == ()
    assert "zzz" in messages(state, "warning")


def test_overrides_apply_to_every_opened_scene(folder: Path) -> None:
    state = open_state(folder / "a.toml", overrides=["solver.dt=0.005"])
    state.open_neighbour(1)
    state.reload()
    assert live(state).settings.dt == 0.005


def test_ghost_and_trust_settings_carry_over_to_the_next_scene(folder: Path) -> None:
    state = open_state(folder / "a.toml")
    assert live(state).diagnostics.divergence is not None
    state.toggle_ghost()
    state.toggle_trust()
    state.open_neighbour(1)
    assert live(state).diagnostics.ghost_engine == "exact"
    assert live(state).diagnostics.divergence is None
    state.restart()
    assert live(state).diagnostics.has_ghost
    state.toggle_ghost()
    assert not live(state).diagnostics.has_ghost


def test_divergence_is_off_by_default_for_many_bodies() -> None:
    state = open_state(find("gas"))
    assert live(state).diagnostics.divergence is None
    state.toggle_trust()
    assert live(state).diagnostics.divergence is not None


def test_failed_tools_show_a_warning(folder: Path) -> None:
    state = open_state(folder / "a.toml")
    assert state.body_tools.pick(live(state), (0.0, 5.0), 0.0)
    state.use_tool(state.body_tools.remove)
    assert not live(state).frame.present[0]
    assert not state.body_tools.pick(live(state), (0.0, 5.0), 0.0)
    assert not state.use_tool(lambda live: live.relaunch("zzz"))
    assert "zzz" in messages(state, "warning")


def test_stored_run_refuses_every_change_with_a_message() -> None:
    scene = load(find("bounce"))
    state = AppState()
    view = RecordedView(RecordedRun(run(scene, "pymunk", dt=0.01)))
    state.show(view, None, scene)
    before = view.frame
    assert state.body_tools.pick(view, (0.0, 5.5), 0.0)  # picking is allowed
    assert state.body_tools.picked == 0
    for change in (
        lambda: state.use_tool(state.body_tools.nudge),
        lambda: state.use_tool(state.body_tools.remove),
        lambda: state.use_tool(lambda live: state.body_tools.add(live, (0.0, 0.0), 1.0)),
        lambda: state.use_tool(lambda live: state.body_tools.drag(live, (0.0, 0.0))),
        state.switch_to_next_engine,
        state.toggle_ghost,
        state.toggle_trust,
        state.reload,
    ):
        state.messages = type(state.messages)()
        change()
        assert messages(state, "warning")
    state.set_parameter("gravity", 1.0)
    assert not state.switch_engine("exact")
    assert view.frame.state_hash() == before.state_hash()
    state.step()
    assert state.paused
    assert view.step_number == 1
    state.step_back()
    state.faster()
    state.slower()
    state.restart()
    assert view.step_number == 0
    state.open_neighbour(1)  # the shipped scenes
    assert state.live is not None
    state.close()


def test_commands_without_a_scene_have_no_effect() -> None:
    state = AppState("exact")
    state.update(1.0)
    for change in (
        state.step,
        state.step_back,
        state.slower,
        state.faster,
        state.restart,
        state.switch_to_next_engine,
        state.close,
    ):
        change()
    state.set_parameter("gravity", 1.0)
    state.reload()
    assert state.engine == "exact"


def test_step_and_back_pause(folder: Path) -> None:
    state = open_state(folder / "a.toml")
    state.update(0.05)
    state.step()
    assert state.paused
    step = live(state).step_number
    state.paused = False
    state.step_back()
    assert state.paused
    while live(state).busy is not None:
        state.update(0.01)
    assert live(state).step_number == step - 1


# Parameters


def parameter(live: LiveView, key: str, picked: int | None = None) -> Any:
    (found,) = [each for each in SessionParameters().of(live, live.scene, picked) if each.key == key]
    return found


@pytest.mark.parametrize("engine", ENGINES)
def test_parameters_show_the_current_values(engine: str, folder: Path) -> None:
    view = LiveView(Session(load(folder / "a.toml"), engine))
    assert parameter(view, "gravity").value == -9.81
    assert parameter(view, "dt").value == 0.01
    assert parameter(view, "engine").value == engine
    assert parameter(view, "restitution").value == parameter(view, "restitution", 0).value == 0.25
    assert parameter(view, "restitution", 1).value == 1.0  # that of the ground, as the body states none
    assert parameter(view, "substeps").enabled == (engine != "exact")
    for key in ("integrator", "detection"):
        found = parameter(view, key)
        if found.enabled:
            assert found.value in found.choices
            for word in found.choices:
                view.apply(Switch(time=0.0, settings={key: word}))
                assert parameter(view, key).value == word
        else:
            assert found.why


@pytest.mark.parametrize("names", [["0", "1"], ["1", "0"], ["a.b", "*"], ['say "hi"', "it's"], ["x.\"y'", "'q"]])
def test_parameter_of_one_ball_changes_only_that_ball_for_any_name(names: list[str]) -> None:
    balls = [{"name": name, "position": [3.0 * k, 0.0], "radius": 1} for k, name in enumerate(names)]
    scene = from_document({"ball": [*balls, {"position": [9.0, 0.0], "radius": 1}]})
    for picked in range(3):
        view = LiveView(Session(scene))
        for action in parameter_actions(view, "friction", 0.5, picked):
            assert isinstance(action, SetParameter)
            view.apply(action)
        assert [each.friction for each in view.scene.balls] == [0.5 if k == picked else None for k in range(3)]
        assert parameter(view, "friction", picked).value == 0.5
    view = LiveView(Session(scene))
    for action in parameter_actions(view, "restitution", 0.5, None):
        view.apply(action)
    assert [each.restitution for each in view.scene.balls] == [0.5] * 3


def test_parameter_of_a_generated_ball_changes_its_whole_generator() -> None:
    scene = from_document(
        {
            "ball": [{"position": [0, 0], "radius": 1}],
            "grid": [{"origin": [5 * k, 9], "columns": 2, "spacing": [2.5, 2.5], "radius": 1} for k in range(2)],
        }
    )
    view = LiveView(Session(scene))
    for action in parameter_actions(view, "restitution", 0.5, 4):
        view.apply(action)
    assert [each.restitution for each in view.scene.body_sources] == [None, None, 0.5]


def test_parameters_without_balls_or_of_an_unspawned_ball_are_safe() -> None:
    view = LiveView(Session(from_document({"title": "t"})))
    assert not parameter(view, "restitution").enabled
    assert parameter_actions(view, "restitution", 0.5, None) == []
    assert not parameter(view, "friction", 7).enabled
    view = LiveView(Session(from_document({"ball": [{"position": [0, 0], "radius": 1}]})))
    assert parameter(view, "friction", 7).label == "friction"


def test_default_of_a_parameter_is_the_value_of_the_file(folder: Path) -> None:
    state = open_state(folder / "a.toml")
    state.set_parameter("restitution", 0.75)
    state.set_parameter("gravity", 3.0)
    assert state.file is not None
    parameters = {each.key: each for each in SessionParameters().of(live(state), state.file, None)}
    assert (parameters["restitution"].value, parameters["restitution"].default) == (0.75, 0.25)
    assert (parameters["gravity"].value, parameters["gravity"].default) == (3.0, -9.81)
