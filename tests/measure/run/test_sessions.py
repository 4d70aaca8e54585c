"""Games without a window: who may act between steps, what is kept of it, and that it leads to the same again."""

import copy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sandbox.action import Impulse
from sandbox.engines.registry import ENGINES, start
from sandbox.games import registry
from sandbox.games.contract import Press, StepInfo, UnsuitableSceneError
from sandbox.games.players import POLICIES, RandomInput, ScriptedInput
from sandbox.games.session import HeadlessGame
from sandbox.measure.run.runner import run
from sandbox.measure.run.sessions import play_out, rerun
from sandbox.recording import Recording
from sandbox.scene.files.load import loads
from sandbox.trajectory import Contacts
from tests.toy_game import TOY, Toy, toy_scene

pytestmark = pytest.mark.full  # long runs and sweeps


@pytest.fixture(autouse=True)
def toy_rules(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(registry.RULES, "landing", Toy)


@pytest.mark.parametrize("player", [name for name in POLICIES if name != "skilled"])  # which plays pinball alone
@pytest.mark.parametrize("engine", ENGINES)
def test_game_leads_to_the_same_from_its_recording(engine: str, player: str) -> None:
    game = play_out(toy_scene(), player, engine)
    recording = Recording.from_json(game.recording.to_json())
    again = rerun(recording, audit=False)
    assert again.info["state_hash"] == recording.state_hash == game.trajectory.info["state_hash"]
    assert again.info["game"]["score"] == recording.score == game.score
    assert again.info["game"]["otherwise"] is None
    assert again.info["actions"] == game.trajectory.info["actions"]
    for name in ("contact_time", "contact_pair", "contact_impulse", "position"):
        np.testing.assert_array_equal(getattr(again, name), getattr(game.trajectory, name))


def test_game_is_the_scenes_seed() -> None:
    assert play_out(toy_scene()).recording == play_out(toy_scene()).recording
    assert play_out(toy_scene(seed=8)).recording.presses != play_out(toy_scene()).recording.presses


def test_contacts_are_heard_as_without_a_game() -> None:
    """A row a contact, however often the rules were told of it: here of a ball that comes to rest."""
    scene = toy_scene(duration=4.0)
    still = loads(TOY.replace("restitution = 0.9", "restitution = 0.5"), overrides=[("world.duration", 4.0)])
    for each in (scene, still):
        game = play_out(each, "none")
        alone = run(each, actions=game.recording.actions, audit=False)
        np.testing.assert_array_equal(alone.contact_time, game.trajectory.contact_time)
        np.testing.assert_array_equal(alone.contact_pair, game.trajectory.contact_pair)
        # Sums of thousands of impulses, in another order.
        np.testing.assert_allclose(alone.contact_impulse, game.trajectory.contact_impulse, rtol=1e-12, atol=1e-12)
        assert alone.info["state_hash"] == game.trajectory.info["state_hash"]


def test_frames_hold_bodies_that_nobody_had_foreseen() -> None:
    game = play_out(toy_scene(duration=6.0), "none")
    run_of = game.trajectory
    spawned = [action for action in game.recording.actions if action.kind == "spawn"]
    assert len(spawned) >= 2
    assert run_of.position.shape[1] == 1 + len(spawned)
    for k, action in enumerate(spawned, start=1):
        there = np.isfinite(run_of.position[:, k, 0])
        assert (run_of.time[there] > action.time).all()
        assert (run_of.time[~there] <= action.time).all()


class Short(Toy):
    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self.ends_at = 1.0


@pytest.mark.parametrize("every", [1, 7])
def test_run_ends_with_the_game(monkeypatch: pytest.MonkeyPatch, every: int) -> None:
    monkeypatch.setitem(registry.RULES, "landing", Short)
    scene = loads(TOY, overrides=[("solver.record_every", every)])
    game = play_out(scene, "none")
    assert game.over == "enough"
    first = float(game.trajectory.contact_time[0])
    assert first <= game.recording.duration <= first + 0.011  # s: seen after the step of the touch
    assert game.trajectory.time[-1] == game.recording.duration
    last = game.recording.actions[-1]
    assert last.time == game.recording.duration  # what the rules did as it ended is part of it
    again = rerun(game.recording, audit=False)
    assert again.info["state_hash"] == game.recording.state_hash
    assert again.info["game"]["over"] == "enough"


def test_game_whose_duration_is_no_multiple_of_a_step() -> None:
    game = play_out(toy_scene(duration=0.505), ScriptedInput([Press(0.1, "kick", 1.0)]))
    assert game.trajectory.time[-1] == 0.505
    assert rerun(game.recording, audit=False).info["state_hash"] == game.recording.state_hash


def test_actions_that_are_given_are_the_players() -> None:
    scene = toy_scene()
    rules = Toy(scene, scene.bodies)
    given = Impulse(time=0.05, body="a", impulse=(0.0, 1.0))
    bout = HeadlessGame(rules, POLICIES["none"](scene), "none")
    told = run(scene, actions=[given], bout=bout, audit=False)
    bounces = int(dict(rules.display_lines())["bounces"])
    assert bout.score == bounces + 0.5
    assert given.model_dump(mode="json") in told.info["actions"]


def test_rules_that_ask_for_the_impossible_end_the_run() -> None:
    game = play_out(
        loads(TOY.replace('name = "a"', 'name = "a"\nfixed = true')), ScriptedInput([Press(0.1, "kick", 1.0)])
    )
    assert game.trajectory.status == "failed"
    assert "'a'" in (game.trajectory.reason or "")


def test_script_presses_before_the_step_of_its_time() -> None:
    game = play_out(toy_scene(), ScriptedInput([Press(0.105, "kick", 1.0), Press(0.0, "aim", 1.0)]))
    aim, kick = game.recording.presses
    assert (aim.time, kick.control) == (0.0, "kick")
    assert kick.time == pytest.approx(0.11, abs=1e-12)  # rounding
    impulse = next(action for action in game.recording.actions if action.time == kick.time)
    assert impulse == Impulse(time=kick.time, body="a", impulse=(0.0, 3.0))


def test_random_player_presses_at_its_rates() -> None:
    """Each control goes down and up in turn, with values of its kind; over seeds as often as the rates say."""
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
    # Rates of 0.2 to 2 a second for 20 s, even by factors, less the time that a control is held: 4 to 40 presses,
    # mean below that of 20·(2 − 0.2)/ln 10 = 15.6.
    assert 8.0 < np.mean(counts) < 16.0


def test_copied_policies_go_on_alike() -> None:
    scene = toy_scene()
    frame = start(scene, "pymunk").frame()
    rules, policy = Toy(scene, scene.bodies), RandomInput(1)

    def decide(which: RandomInput, begin: int) -> list[Any]:
        seen = (StepInfo(0.01 * step, frame, Contacts.none(), ()) for step in range(begin, begin + 500))
        return [which.decide(each, rules) for each in seen]

    decide(policy, 0)
    other = copy.deepcopy(policy)
    assert decide(policy, 500) == decide(other, 500)


def test_scene_without_a_game_is_not_played() -> None:
    scene = loads(TOY.replace('game = "landing"', ""))
    with pytest.raises(UnsuitableSceneError, match="has no game with rules"):
        play_out(scene)
    assert "game" not in run(scene, audit=False).info


def test_script_is_read_from_a_file(tmp_path: Path) -> None:
    file = tmp_path / "script.txt"
    file.write_text("# who kicks\n0.2, kick, 1   # now\n\n0.1,kick,0\n")
    game = play_out(toy_scene(), str(file))
    assert [(press.control, press.value) for press in game.recording.presses] == [("kick", 0.0), ("kick", 1.0)]
