"""Billiards as a game with rules: judged shots, inputs, replay, headless players, recordings without inputs."""

import copy
import json
import math
from typing import Any

import pytest

import sandbox
from sandbox.action import Action, Move, Strike
from sandbox.games.billiards.bot import BilliardsPolicy
from sandbox.games.billiards.game import BilliardsRules, select_value, selected_index
from sandbox.games.billiards.rules.base import ShotCall
from sandbox.games.contract import Rules, StepInfo, UnsuitableSceneError
from sandbox.games.registry import has_rules, required_rules, rules_of
from sandbox.games.session import GameSession
from sandbox.measure.run.sessions import play_out, rerun
from sandbox.recording import Recording
from sandbox.scene.description.surface import Stroke
from sandbox.scene.files.load import load
from sandbox.trajectory import Contacts
from tests.games.billiards.tables_by_hand import match, table

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

UP = 0.5 * math.pi


class Table:
    """A game and its simulation, stepped together."""

    def __init__(self, name: str, **terms: Any) -> None:
        initial = match(name, **terms)
        self.rules = BilliardsRules(initial)
        self.game = GameSession(self.rules)
        self.simulation = sandbox.start(initial.scene, "exact")
        self.simulation.contacts()
        self.actions: list[Action] = []
        self.apply(self.game.on_step(0.0, self.simulation.frame(), Contacts.none()))

    def apply(self, actions: tuple[Action, ...]) -> None:
        for action in actions:
            self.simulation.apply(action)
        self.actions += actions

    def do(self, *actions: Action) -> None:
        self.apply(actions)
        self.game.note_actions(actions)

    def press(self, name: str, value: float = 1.0) -> None:
        self.do(*self.game.record_input(self.simulation.time, name, value))

    def step(self) -> None:
        self.simulation.step()
        simulation = self.simulation
        self.apply(self.game.on_step(simulation.time, simulation.frame(), simulation.contacts()))

    def finish_shot(self) -> None:
        self.step()
        while not (self.rules.waiting or self.rules.game_over):
            self.step()

    def strike(self, aim: float, speed: float) -> None:
        stroke = Stroke(aim=aim, speed=speed)
        self.do(self.rules.match.strike(stroke, self.simulation.time))
        self.finish_shot()


def test_strike_is_judged_once_every_ball_is_at_rest() -> None:
    table = Table("9-ball")
    assert table.rules.waiting
    table.do(table.rules.match.strike(Stroke(aim=UP, speed=8.0)))
    table.step()
    assert not table.rules.waiting
    assert table.rules.match.shots == 0
    table.finish_shot()
    assert table.rules.waiting
    assert table.rules.match.shots == 1
    assert table.rules.match.verdict is not None


def test_scratch_gives_the_opponent_ball_in_hand_and_returns_it_to_the_table() -> None:
    table = Table("9-ball")
    table.strike(-0.75 * math.pi, 6.0)  # away from the balls: a foul, whichever balls fall
    now = table.rules.match
    assert (now.turn, now.state.in_hand) == (1, "anywhere")
    table.step()
    assert table.simulation.frame().position.tolist() == [list(each) for each in now.position]


def test_controls_shoot_place_and_call() -> None:
    table = Table("8-ball")
    table.press("aim", 0.25)
    table.press("shoot", 0.8)
    (strike,) = table.actions
    assert isinstance(strike, Strike)
    assert (strike.ball, strike.speed) == ("cue", 8.0)
    assert strike.aim == pytest.approx(UP)
    table.press("shoot", 0.5)
    assert len(table.actions) == 1  # while balls roll no shot is possible
    table.finish_shot()
    table.strike(-UP, 0.3)  # a foul
    assert table.rules.match.state.in_hand == "anywhere"
    for name, value in table.rules.place_inputs((0.4, 0.6)):
        table.press(name, value)
    table.step()
    assert tuple(table.simulation.frame().position[0].tolist()) == pytest.approx((0.4, 0.6), abs=0.1)
    for name, value in table.rules.call_inputs(ShotCall(safety=True)):
        table.press(name, value)
    assert table.rules.call.safety
    table.press("call safety", 0.0)
    assert not table.rules.call.safety


@pytest.mark.parametrize("count", [1, 6, 15, 22])
def test_value_of_a_selection_selects_its_entry(count: int) -> None:
    assert [selected_index(select_value(k, count), count) for k in range(count)] == list(range(count))
    assert selected_index(0.0, count) is None
    assert selected_index(1.0, count) == count - 1


def test_copy_of_a_game_is_independent() -> None:
    table = Table("9-ball")
    twin = copy.deepcopy(table.rules)
    table.strike(UP, 8.0)
    table.press("draw", 1.0)
    assert (twin.match.shots, twin.log, twin.stroke.height) == (0, [], 0.0)
    assert table.rules.stroke.height < 0.0
    assert twin.match.layout is table.rules.match.layout


def test_balls_moved_by_hand_are_accepted_between_shots() -> None:
    table = Table("9-ball")
    table.do(Move(time=0.0, body="cue", position=(0.5, 0.5)))
    table.step()
    assert table.rules.match.position[table.rules.match.layout.number["cue"]] == (0.5, 0.5)


def test_strike_of_a_ball_other_than_the_cue_ball_is_not_judged() -> None:
    table = Table("9-ball")
    table.do(Strike(time=0.0, ball="1", aim=UP, speed=0.5))
    table.finish_shot()
    assert (table.rules.match.shots, table.rules.match.turn, table.rules.match.verdict) == (0, 0, None)
    assert table.rules.match.position == tuple((x, y) for x, y in table.simulation.frame().position.tolist())


def test_shot_of_the_scene_is_the_first_shot_of_the_game() -> None:
    scene = load("9-ball")
    rules = required_rules(scene)
    assert isinstance(rules, BilliardsRules)
    assert scene.shots
    assert not rules.waiting
    game = play_out(load("9-ball", [("world.duration", 20.0)]), NoShots(), "exact")
    assert "Strike" not in json.dumps(game.trajectory.info["actions"])
    assert dict(game.trajectory.info["game"]["lines"]).keys() >= {"player 1", "player 2", "turn"}


class NoShots:
    """A policy that does nothing."""

    def decide(self, info: StepInfo, rules: Rules) -> tuple[tuple[str, float], ...]:
        assert isinstance(rules, BilliardsRules)
        assert rules.match.shots == int(rules.waiting)
        return ()


def test_recording_without_inputs_reaches_the_same_match() -> None:
    """Old sessions of the window have actions only, from before billiards had rules."""
    bot = Table("9-ball")
    policy = BilliardsPolicy(3)
    for _ in range(4):
        info = StepInfo(bot.simulation.time, bot.simulation.frame(), Contacts.none(), ())
        for name, value in policy.decide(info, bot.rules):
            bot.press(name, value)
        bot.finish_shot()
    watching = BilliardsRules(match("9-ball"))
    game, simulation = GameSession(watching), sandbox.start(match("9-ball").scene, "exact")
    simulation.contacts()
    pending = list(bot.actions)
    while simulation.time < bot.simulation.time:
        own = game.on_step(simulation.time, simulation.frame(), simulation.contacts())
        due = [action for action in pending if action.time <= simulation.time]
        pending = pending[len(due) :]
        for action in due:
            simulation.apply(action)
        game.replay(simulation.time, own, due)
        simulation.step()
    game.on_step(simulation.time, simulation.frame(), simulation.contacts())
    assert simulation.state_hash() == bot.simulation.state_hash()
    assert watching.match.shots == bot.rules.match.shots
    assert watching.match.state == bot.rules.match.state


def test_rules_start_only_on_request() -> None:
    scene = table("9-ball")
    assert rules_of(scene) is None
    assert (has_rules(scene), has_rules(scene, on_request=True)) == (False, True)


def test_table_without_a_required_ball_is_refused() -> None:
    scene = load("9-ball")
    without = scene.model_copy(update={"balls": tuple(ball for ball in scene.balls if ball.name != "9")})
    with pytest.raises(UnsuitableSceneError, match="no ball 9"):
        required_rules(without)


def test_learning_environment_wraps_a_game_of_billiards() -> None:
    gym = pytest.importorskip("sandbox.gym")
    environment = gym.SandboxEnv("9-ball", "exact")
    _, info = environment.reset()
    assert "score of player 1" in environment.observed
    observation, _, over, _, info = environment.step([0.0] * len(environment.controls))
    assert environment.observation_space.contains(observation)
    assert (over, info["score"]) == (False, 0)
    environment.close()


@pytest.mark.parametrize(
    ("name", "player"),
    [
        ("9-ball", "skilled"),
        ("three-cushion", "skilled"),
        ("8-ball", "random"),
        *(pytest.param(name, "skilled", marks=pytest.mark.nightly) for name in ("8-ball", "snooker", "straight-rail")),
        *(pytest.param(name, "random", marks=pytest.mark.nightly) for name in ("9-ball", "snooker", "three-cushion")),
    ],
)
def test_game_is_played_without_a_window_and_its_recording_replays(name: str, player: str) -> None:
    game = play_out(load(name, [("world.duration", 20.0)]), player, "exact")
    assert game.trajectory.status == "ok"
    assert game.trajectory.info["game"]["lines"][0][0] == "player 1"
    again = rerun(Recording.from_json(game.recording.to_json()), audit=False)
    assert again.info["state_hash"] == game.recording.state_hash
    assert again.info["game"]["otherwise"] is None
    assert again.info["game"]["score"] == game.score
    for key in ("lines", "log"):
        assert again.info["game"][key] == game.trajectory.info["game"][key]
