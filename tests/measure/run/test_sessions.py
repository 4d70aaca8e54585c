"""Headless games: policies and rules act between steps, and recordings replay to the same state."""

import copy
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from sandbox.action import Action, Impulse
from sandbox.engines.registry import ENGINES, start
from sandbox.games.contract import Press, StepInfo, UnsuitableSceneError, sensed_objects
from sandbox.games.players import POLICIES, RandomInput, ScriptedInput
from sandbox.games.session import HeadlessGame
from sandbox.measure.run.runner import run
from sandbox.measure.run.sessions import play_out, rerun
from sandbox.recording import Recording
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import loads
from sandbox.trajectory import Contacts
from tests.toy_game import TOY, Toy, toy_scene

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps


@pytest.fixture(autouse=True)
def toy_rules(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sandbox.games.landing.rules.Landing", Toy)


@pytest.mark.parametrize("player", [name for name in POLICIES if name != "skilled"])  # which plays pinball only
@pytest.mark.parametrize("engine", ENGINES)
def test_game_replays_to_the_same_result_from_its_recording(engine: str, player: str) -> None:
    game = play_out(toy_scene(), player, engine)
    recording = Recording.from_json(game.recording.to_json())
    again = rerun(recording, audit=False)
    assert again.info["state_hash"] == recording.state_hash == game.trajectory.info["state_hash"]
    assert again.info["game"]["score"] == recording.score == game.score
    assert again.info["game"]["otherwise"] is None
    assert again.info["actions"] == game.trajectory.info["actions"]
    for name in ("contact_time", "contact_pair", "contact_impulse", "position"):
        np.testing.assert_array_equal(getattr(again, name), getattr(game.trajectory, name))


def test_game_depends_on_the_seed_of_the_scene() -> None:
    assert play_out(toy_scene()).recording == play_out(toy_scene()).recording
    assert play_out(toy_scene(seed=8)).recording.presses != play_out(toy_scene()).recording.presses


def test_contacts_are_recorded_as_without_a_game() -> None:
    """A contact has one row although the rules receive it repeatedly, here of a ball that comes to rest."""
    scene = toy_scene(duration=4.0)
    settling = loads(TOY.replace("restitution = 0.9", "restitution = 0.5"), overrides=[("world.duration", 4.0)])
    for each in (scene, settling):
        game = play_out(each, "none")
        alone = run(each, actions=game.recording.actions, audit=False)
        np.testing.assert_array_equal(alone.contact_time, game.trajectory.contact_time)
        np.testing.assert_array_equal(alone.contact_pair, game.trajectory.contact_pair)
        # Sums of thousands of impulses, in a different order.
        np.testing.assert_allclose(alone.contact_impulse, game.trajectory.contact_impulse, rtol=1e-12, atol=1e-12)
        assert alone.info["state_hash"] == game.trajectory.info["state_hash"]


class Short(Toy):
    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self.ends_at = 1.0


@pytest.mark.parametrize("every", [1, 7])
def test_run_ends_with_the_game(monkeypatch: pytest.MonkeyPatch, every: int) -> None:
    monkeypatch.setattr("sandbox.games.landing.rules.Landing", Short)
    scene = loads(TOY, overrides=[("solver.record_every", every)])
    game = play_out(scene, "none")
    assert game.over == "enough"
    first = float(game.trajectory.contact_time[0])
    assert first <= game.recording.duration <= first + 0.011  # s: detected after the step of the contact
    assert game.trajectory.time[-1] == game.recording.duration
    last = game.recording.actions[-1]
    assert last.time == game.recording.duration  # includes the actions of the rules at the end
    again = rerun(game.recording, audit=False)
    assert again.info["state_hash"] == game.recording.state_hash
    assert again.info["game"]["over"] == "enough"


def test_game_duration_need_not_be_a_multiple_of_the_step() -> None:
    game = play_out(toy_scene(duration=0.505), ScriptedInput([Press(0.1, "kick", 1.0)]))
    assert game.trajectory.time[-1] == pytest.approx(0.51, rel=1e-15)  # 51 steps on pymunk, one rounding
    assert rerun(game.recording, audit=False).info["state_hash"] == game.recording.state_hash


def test_given_actions_reach_the_rules_like_those_of_a_player() -> None:
    scene = toy_scene()
    rules = Toy(scene, scene.bodies)
    given = Impulse(time=0.05, body="a", impulse=(0.0, 1.0))
    game = HeadlessGame(rules, POLICIES["none"](scene), "none")
    result = run(scene, actions=[given], bout=game, audit=False)
    bounces = int(dict(rules.display_lines())["bounces"])
    assert game.score == bounces + 0.5
    assert given.model_dump(mode="json") in result.info["actions"]


def test_impossible_action_of_the_rules_fails_the_run() -> None:
    game = play_out(
        loads(TOY.replace('name = "a"', 'name = "a"\nfixed = true')), ScriptedInput([Press(0.1, "kick", 1.0)])
    )
    assert game.trajectory.status == "failed"
    assert "'a'" in (game.trajectory.reason or "")


def test_scripted_press_acts_before_the_step_at_its_time() -> None:
    game = play_out(toy_scene(), ScriptedInput([Press(0.105, "kick", 1.0), Press(0.0, "aim", 1.0)]))
    aim, kick = game.recording.presses
    assert (aim.time, kick.control) == (0.0, "kick")
    assert kick.time == pytest.approx(0.11, abs=1e-12)  # rounding
    impulse = next(action for action in game.recording.actions if action.time == kick.time)
    assert impulse == Impulse(time=kick.time, body="a", impulse=(0.0, 3.0))


def test_random_player_presses_at_its_rates() -> None:
    """Each control is pressed and released in turn, with valid values; over many seeds at the given rates."""
    scene, counts = toy_scene(), []
    frame = start(scene, "pymunk").frame()
    for seed in range(60):
        rules, policy = Toy(scene, scene.bodies), RandomInput(seed)
        pressed: dict[str, list[float]] = {"kick": [], "aim": []}
        for step in range(2000):
            for name, value in policy.decide(StepInfo(0.01 * step, frame, Contacts.none(), ()), rules):
                pressed[name].append(value)
        for values in pressed.values():
            assert all(value == 0.0 for value in values[1::2])
            assert all(0.0 < value <= 1.0 for value in values[::2])
        assert set(pressed["kick"]) <= {0.0, 1.0}
        counts.append(len(pressed["kick"][::2]))
    # Rates of 0.2 to 2 per second, log-uniform, for 20 s, less the time that a control is held: 4 to 40 presses,
    # mean below that of 20·(2 − 0.2)/ln 10 = 15.6.
    assert 8.0 < np.mean(counts) < 16.0


def test_copied_policy_makes_the_same_decisions() -> None:
    scene = toy_scene()
    frame = start(scene, "pymunk").frame()
    rules, policy = Toy(scene, scene.bodies), RandomInput(1)

    def decide(which: RandomInput, begin: int) -> list[Any]:
        steps = (StepInfo(0.01 * step, frame, Contacts.none(), ()) for step in range(begin, begin + 500))
        return [which.decide(each, rules) for each in steps]

    decide(policy, 0)
    other = copy.deepcopy(policy)
    assert decide(policy, 500) == decide(other, 500)


def test_scene_without_a_game_cannot_be_played() -> None:
    scene = loads(TOY.replace('game = "landing"', ""))
    with pytest.raises(UnsuitableSceneError, match="has no game with rules"):
        play_out(scene)
    assert "game" not in run(scene, audit=False).info


class SensingToy(Toy):
    """Counts the steps after which the sensor detects the ball, and its visits by the times of their rows."""

    def __init__(self, scene: Scene, bodies: Bodies) -> None:
        super().__init__(scene, bodies)
        self._scene, self.sensed_steps, self.begins = scene, 0, set[float]()

    def on_step(self, info: StepInfo) -> Sequence[Action]:
        self.sensed_steps += 0 in sensed_objects(info, self._scene)["near"]
        self.begins |= {each.time for each in info.contacts if each.pair == (0, -2)}
        return super().on_step(info)


@pytest.mark.parametrize("engine", ENGINES)
def test_rules_receive_what_sensors_detect_after_each_step(engine: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sandbox.games.landing.rules.Landing", SensingToy)
    scene = loads(TOY + '[[sensor]]\nname = "near"\npoints = [[-9, 0], [9, 0], [9, 0.3], [-9, 0.3]]\n')
    rules = SensingToy(scene, scene.bodies)
    game = HeadlessGame(rules, None, "none")
    trajectory = run(scene, engine, audit=False, bout=game)
    visits = trajectory.sensor_visits
    assert len(visits) > 1
    assert rules.begins == {each.begin for each in visits}
    # An action of the rules acts between the end of a step, when sensors detect, and the recorded frame; none moves it.
    inside = trajectory.position[:, 0, 1] - 0.2 < 0.3
    assert rules.sensed_steps == int(inside.sum())
