"""Live scenes by sequences of messages, compared with plain runs."""

import json
from typing import Any

import pytest

from sandbox.engines.contract import Refusal
from sandbox.engines.switching import start
from sandbox.interactive import live_scene as module
from sandbox.interactive.live_scene import LiveScene
from sandbox.measure.run.runner import run
from sandbox.scene.files.load import load, loads
from sandbox.scene.files.overrides import AddressError
from tests.interactive.conversation import SCENE, Conversation


@pytest.mark.parametrize("engine", ["pymunk", "reference"])
def test_scene_without_input_has_the_states_of_a_plain_run(engine: str) -> None:
    talk = Conversation(engine=engine)
    talk.ask(type="step", count=7)
    talk.play(0.5, frame=0.013)
    steps = round(talk.live.frame.time / 0.01)
    assert steps > 40
    plain = run(loads(SCENE), engine=engine)
    assert talk.live.frame.position.tolist() == plain.position[steps].tolist()
    assert talk.live.frame.velocity.tolist() == plain.velocity[steps].tolist()
    assert talk.live.frame.angle.tolist() == plain.angle[steps].tolist()


def test_pause_holds_the_state_and_play_continues() -> None:
    talk = Conversation()
    talk.play(0.2)
    talk.ask(type="play", on=False)
    held = talk.state_hash
    assert talk.ask(type="advance", elapsed=1.0)["time"] == talk.live.frame.time
    assert talk.state_hash == held
    talk.play(0.1)
    assert talk.live.frame.time == pytest.approx(0.3, abs=0.02)  # a step more or less at each start


def test_frames_are_drawn_between_steps_relative_to_the_origin() -> None:
    talk = Conversation(sliders=["solver.dt"])
    talk.ask(type="set", key="solver.dt", value=0.1)
    talk.ask(type="play", on=True)
    for _ in range(3):
        reply = talk.ask(type="advance", elapsed=0.05)
    _, y = talk.live.picture.origin
    assert reply["time"] == pytest.approx(0.05)
    assert reply["pose"][1] + y == pytest.approx(0.5 * (2.0 + talk.live.frame.position[0, 1]), abs=1e-5)  # rounded
    assert talk.live.frame.time == pytest.approx(0.1)


def test_drag_pulls_a_body_while_playing_and_moves_it_while_paused() -> None:
    talk = Conversation()
    x, y = talk.live.picture.origin
    talk.ask_all(
        {"type": "play", "on": True},
        {"type": "grab", "body": 0, "grip": [0.2, 0.0], "target": [2.0 - x, 3.0 - y]},
    )
    for _ in range(90):
        talk.ask(type="advance", elapsed=1 / 60)
    assert talk.live.frame.position[0].tolist() == pytest.approx([2.0, 3.0], abs=0.3)  # hangs on its grip
    talk.ask(type="release")
    assert not talk.live.simulation.pulls
    talk.ask(type="play", on=False)
    talk.ask_all(
        {"type": "grab", "body": 1, "grip": [0.0, 0.0], "target": [0.0, 0.0]},
        {"type": "drag", "target": [-3.0 - x, 1.5 - y]},
    )
    assert talk.live.frame.position[1].tolist() == pytest.approx([-3.0, 1.5])


def test_closed_viewer_releases_its_body() -> None:
    talk = Conversation()
    talk.ask_all({"type": "play", "on": True}, {"type": "grab", "body": 0, "grip": [0, 0], "target": [0, 0]})
    assert list(talk.live.simulation.pulls) == ["a"]
    talk.viewer.close()
    assert not talk.live.simulation.pulls


def test_refused_drag_is_reported_and_ends() -> None:
    scene = SCENE + '[[box]]\nname = "lift"\nposition = [9.0, 2.0]\nsize = [1.0, 1.0]\nkinematic = true\n'
    talk = Conversation(scene)
    talk.ask(type="play", on=True)
    reply = talk.ask(type="grab", body=2, grip=[0, 0], target=[0, 0])
    assert "lift" in reply["messages"][0]
    assert "messages" not in talk.ask(type="drag", target=[1, 1])
    assert "grip is not on a" in talk.ask(type="grab", body=0, grip=[5, 0], target=[0, 0])["messages"][0]
    assert "no body 9" in talk.ask(type="push", body=9, direction=[1, 0])["messages"][0]


def test_target_at_the_end_of_the_range_is_an_answer() -> None:
    reply = Conversation().ask(type="grab", body=0, grip=[0, 0], target=[1e16, 1e16])
    assert reply["messages"] == ["the point is out of range"]


def test_push_adds_speed() -> None:
    talk = Conversation()
    talk.ask(type="push", body=0, direction=[1, 0])
    assert talk.live.simulation.frame().velocity[0].tolist() == pytest.approx([1.0, 0.0])


def test_reset_restores_the_start_with_the_values_of_sliders() -> None:
    talk = Conversation(sliders=["ball.a.restitution", "solver.dt"])
    first = talk.state_hash
    talk.play(0.3)
    talk.ask(type="push", body=0, direction=[1, 1])
    assert talk.ask(type="reset")["time"] == 0.0
    assert talk.state_hash == first
    talk.ask_all({"type": "set", "key": "ball.a.restitution", "value": 0.9})
    talk.ask(type="set", key="solver.dt", value=0.005)
    talk.ask(type="reset")
    talk.ask(type="step", count=200)
    plain = run(loads(SCENE, overrides=["ball.a.restitution=0.9", "solver.dt=0.005"]))
    assert talk.live.frame.position.tolist() == plain.position[200].tolist()


def test_component_of_an_array_that_the_file_leaves_out() -> None:
    scene = '[[ball]]\nname = "a"\nposition = [0.0, 0.0]\nradius = 1.0\n'
    talk = Conversation(scene, sliders=["world.gravity[0]", "world.gravity[1]", "ball.a.velocity[1]"])
    for key, value in (("world.gravity[0]", 2.0), ("world.gravity[1]", -3.0), ("ball.a.velocity[1]", 4.0)):
        assert "messages" not in talk.ask(type="set", key=key, value=value)
    talk.ask(type="reset")
    shown = talk.live.simulation.scene
    assert (shown.world.gravity, shown.balls[0].velocity) == ((2.0, -3.0), (0.0, 4.0))


@pytest.mark.parametrize(
    ("key", "value", "restarts"),
    [("solver.dt", 0.002, False), ("world.gravity[1]", 3.0, False), ("ball.*.restitution", 0.25, False),
     ("solver.iterations", 20, False), ("ball.a.radius", 0.25, True), ("box.b.size[0]", 1.5, True)],
)  # fmt: skip
def test_slider_changes_the_running_scene_or_starts_it_again(key: str, value: float, restarts: bool) -> None:
    talk = Conversation(sliders=[key])
    talk.ask(type="step", count=5)
    reply = talk.ask(type="set", key=key, value=value)
    assert "messages" not in reply
    assert [each["value"] for each in reply["state"]["sliders"]] == [value]
    assert reply["time"] == (0.0 if restarts else 0.05)
    assert ("picture" in reply) is restarts
    dumped = loads(SCENE, overrides=[(key, value)])
    shown = talk.live.simulation.scene
    assert (shown.balls, shown.boxes, shown.world) == (dumped.balls, dumped.boxes, dumped.world)
    assert talk.live.simulation.settings.dt == dumped.solver.dt


def test_invalid_slider_values_change_nothing() -> None:
    talk = Conversation(sliders=["solver.dt=0.001:0.1", "ball.a.radius=0.1:3", "box.b.position[0]=-3:3"])
    before = talk.state_hash
    for key, value, words in (
        ("solver.dt", 1.0, "out of range"),
        ("nonsense", 1.0, "no slider"),
        ("ball.a.mass", 1.0, "no slider"),
    ):
        reply = talk.ask(type="set", key=key, value=value)
        assert words in reply["messages"][0]
        assert "state" not in reply
    assert talk.state_hash == before


@pytest.mark.parametrize(
    "slider",
    ["solver.nonsense", "ball.zzz.radius", "title", "solver.dt=5", "solver.dt=2:1", "solver.dt=0:1:log", "ball.a",
     "ball.a.mass", "solver.dt=1:nan", "", "solver.dt=1:2:lin", "ball.a.position[7]"],
)  # fmt: skip
def test_invalid_slider_addresses_are_refused(slider: str) -> None:
    with pytest.raises(AddressError):
        LiveScene(loads(SCENE), sliders=[slider])


def test_default_sliders_and_their_ranges() -> None:
    state = Conversation().reply["state"]
    assert [each["key"] for each in state["sliders"]] == ["world.gravity[1]", "solver.dt", "ball.*.restitution"]
    assert [(each["low"], each["high"], each["is_log"]) for each in state["sliders"]][1] == (1e-4, 0.1, True)
    whole = Conversation(sliders=["solver.substeps"]).reply["state"]["sliders"][0]
    assert (whole["is_whole"], whole["value"], whole["high"]) == (True, 1, 32)


def test_engine_is_switched_in_mid_flight() -> None:
    talk = Conversation()
    talk.ask(type="step", count=10)
    reply = talk.ask(type="engine", name="reference")
    assert (reply["state"]["engine"], reply["time"]) == ("reference", 0.1)
    refused = talk.ask(type="engine", name="exact")  # models no boxes
    assert "exact refuses" in refused["messages"][0]
    assert talk.live.simulation.engine == "reference"
    assert "unknown engine" in talk.ask(type="engine", name="zzz")["messages"][0]
    exact = next(each for each in reply["state"]["engines"] if each["name"] == "exact")
    assert exact["is_able"] is False


def test_ghost_follows_on_another_engine_and_with_another_dt() -> None:
    talk = Conversation()
    talk.ask(type="ghost", engine="pymunk", dt_fraction=0.1)
    assert talk.reply["state"]["ghost"] == {"engine": "pymunk", "dt_fraction": 0.1, "dt": 0.001, "ended": None}
    talk.ask(type="step", count=50)
    fine = start(loads(SCENE, overrides=["solver.dt=0.001"]))
    for _ in range(500):
        fine.step()
    _, y = talk.live.picture.origin
    assert talk.reply["ghost"]["pose"][1] + y == pytest.approx(fine.frame().position[0, 1], abs=1e-5)  # rounded
    assert 0.0 < talk.reply["ghost"]["distance"] < 0.1
    talk.ask(type="reset")
    assert talk.reply["ghost"]["distance"] == 0.0
    talk.ask(type="ghost", engine=None)
    assert talk.reply["state"]["ghost"] is None
    assert "ghost" not in talk.reply
    assert "exact refuses" in talk.ask(type="ghost", engine="exact")["messages"][0]


def test_ghost_gets_the_same_actions() -> None:
    talk = Conversation()
    talk.ask_all({"type": "ghost", "engine": "reference"}, {"type": "push", "body": 0, "direction": [1, 0]})
    talk.ask(type="step", count=20)
    x, _ = talk.live.picture.origin
    assert talk.reply["ghost"]["pose"][0] + x == pytest.approx(0.2, abs=1e-5)


def test_energy_is_conserved_in_free_fall() -> None:
    talk = Conversation()
    before = talk.reply["energy"]
    after = talk.ask(type="step", count=20)["energy"]
    assert after[0] > before[0] == 0.0
    assert sum(after) == pytest.approx(sum(before), rel=0.01)  # first order in dt


def test_slow_scene_falls_behind_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sandbox.interactive.live_scene.MAX_WORK", 0.0)  # one step a request
    talk = Conversation()
    talk.play(0.5, frame=0.05)
    assert talk.live.frame.time == pytest.approx(0.1)
    assert talk.reply["real_speed"] == pytest.approx(0.2)


def test_speed_scales_time() -> None:
    talk = Conversation()
    talk.ask(type="speed", speed=0.5)
    assert talk.reply["state"]["speed"] == pytest.approx(0.5)
    talk.play(0.4)
    assert talk.live.frame.time == pytest.approx(0.2, abs=0.011)


@pytest.mark.parametrize(("duration", "speed"), [(0.02, 0.005), (2.0, 0.5), (100.0, 1.0)])
def test_short_scene_begins_slowly_as_in_the_window(duration: float, speed: float) -> None:
    text = SCENE.replace("duration = 2.0", f"duration = {duration}").replace("speed = 1.0", "")
    state = Conversation(text).reply["state"]
    assert state["speed"] == speed
    assert speed in state["speeds"]


def test_stated_speed_is_the_initial_one() -> None:
    assert Conversation(SCENE.replace("speed = 1.0", "speed = 0.3")).reply["state"]["speed"] == 0.3


def test_diverged_scene_ends_and_can_be_reset() -> None:
    talk = Conversation(sliders=["world.gravity[1]=-1e9:0"])
    talk.ask_all({"type": "set", "key": "world.gravity[1]", "value": -1e9}, {"type": "play", "on": True})
    for _ in range(1000):
        if talk.ask(type="advance", elapsed=0.1).get("state", {}).get("ended"):
            break
    else:
        pytest.fail("the scene stays in bounds")
    assert talk.ask(type="play", on=True)["time"] == talk.reply["time"]
    assert talk.ask(type="reset")["state"]["ended"] is None


def test_viewers_of_one_scene_see_changes_of_each_other_and_share_its_time() -> None:
    now = [0.0]
    talk = Conversation(wall_clock=lambda: now[0])
    other = Conversation()
    other.live.close()
    other.live = talk.live
    other.viewer = type(talk.viewer)(talk.live)
    assert {"picture", "state"} <= set(other.ask(type="open"))
    talk.ask(type="play", on=True)
    assert other.ask(type="advance", elapsed=0.0)["state"]["playing"] is True
    assert "state" not in other.ask(type="advance", elapsed=0.0)
    talk.ask(type="play", on=False)
    now[0] += 100.0  # a pause
    talk.ask(type="play", on=True)
    for _ in range(10):
        now[0] += 0.02
        talk.ask(type="advance", elapsed=0.02)
        other.ask(type="advance", elapsed=0.02)
    assert talk.live.frame.time == pytest.approx(0.2, abs=0.011)


HOSTILE = [
    *("", "{", "null", "7", '"x"', "{}", "[null]", "[[]]", '[{"type":"zzz"}]', '[{"type":"advance"}]'),
    *("[" * 60_000, "x" * 100_000, "[" + '{"type":"reset"},' * 32 + '{"type":"reset"}]'),
    '[{"type":"advance","elapsed":NaN}]',
    '[{"type":"advance","elapsed":1e999}]',
    '[{"type":"advance","elapsed":-1}]',
    '[{"type":"advance","elapsed":"1"}]',
    '[{"type":"step","count":1e9}]',
    f'[{{"type":"step","count":{"9" * 5000}}}]',
    '[{"type":"grab","body":-1,"grip":[0,0],"target":[0,0]}]',
    '[{"type":"drag","target":[1e300,0]}]',
    '[{"type":"drag","target":[0]}]',
    '[{"type":"speed","speed":0}]',
    '[{"type":"push","body":0,"direction":[9,0]}]',
    '[{"type":"set","key":"solver.dt","value":null}]',
    '[{"type":"set","key":"\\ud800","value":1}]',
    '[{"type":"engine","name":"a\\u0000"}]',
    '[{"type":"ghost","engine":"pymunk","dt_fraction":0}]',
    '[{"type":"play","on":true,"more":1}]',
]


@pytest.mark.parametrize("request_text", HOSTILE, ids=range(len(HOSTILE)))
def test_invalid_request_is_answered_and_changes_nothing(request_text: str) -> None:
    talk = Conversation()
    before: tuple[Any, ...] = talk.state_hash, talk.live.revision
    reply = talk.viewer.handle(request_text)
    (message,) = reply["messages"]
    assert 0 < len(message) <= 1000
    assert "\n" not in message
    assert (talk.state_hash, talk.live.revision) == before
    json.dumps(reply, allow_nan=False).encode()


def test_scene_that_an_engine_refuses_is_not_started() -> None:
    with pytest.raises(Refusal):
        LiveScene(loads(SCENE), engine="exact")


def test_ghost_that_takes_too_long_ends_and_the_scene_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "STEP_TIMEOUT", 0.0)
    talk = Conversation()
    talk.ask(type="ghost", engine="pymunk", dt_fraction=0.01)
    talk.ask(type="step", count=1)
    assert "longer than 0 s" in talk.reply["state"]["ghost"]["ended"]
    assert talk.reply["state"]["ended"] is None


def test_penalty_contacts_start_with_their_settings() -> None:
    scene = load("rest_depth", ["solver.response=penalty", "solver.damping=1"])
    live = LiveScene(scene, "reference", ["solver.stiffness"])
    live.step(3)
    assert live.frame.position.tolist() == run(scene, engine="reference", audit=False).position[3].tolist()
    live.close()
