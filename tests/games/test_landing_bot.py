"""Bot of landing: it lands, worse with less skill, and reads the thrusts of the scene."""

import math

import pytest

from sandbox.engines.switching import start
from sandbox.games.contract import StepInfo, UnsuitableSceneError
from sandbox.games.landing.bot import LandingBot
from sandbox.games.landing.rules import LANDED, Landing
from sandbox.games.players import POLICIES
from sandbox.measure.run.sessions import PlayedGame, play_out
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import dumps, load, loads
from sandbox.scene.files.shipped_scenes import find

SCENE = load(find("landing"))


def play(seed: int, skill: float) -> PlayedGame:
    return play_out(load(find("landing"), [("world.seed", seed)]), LandingBot(seed, skill))


@pytest.mark.full
@pytest.mark.parametrize("seed", range(1, 5))
def test_bot_lands_with_fuel_left(seed: int) -> None:
    game = play(seed, 1.0)
    assert game.over == LANDED
    assert game.score > 300  # of 100 for the landing and 900 for a full tank


@pytest.mark.full
def test_skill_pays() -> None:
    """Each skill is played with the same seeds; the least skilled bot crashes in some of them."""
    games = [[play(seed, skill) for seed in range(1, 11)] for skill in (0.0, 1.0)]
    worst, best = (sum(game.score for game in each) for each in games)
    assert worst < best
    assert any(game.over != LANDED for game in games[0])


def first_throttles(scene: Scene) -> dict[str, float]:
    simulation, rules = start(scene), Landing(scene, scene.bodies)
    info = StepInfo(0.0, simulation.frame(), simulation.contacts(), ())
    return dict(LandingBot(1, 1.0).decide(info, rules))


def test_throttles_follow_the_forces_of_the_scene() -> None:
    """A thrust of twice the force needs half the throttle for the same acceleration."""
    text = dumps(SCENE)
    strong, stronger = (
        first_throttles(loads(text.replace("force = [0.5, 0.0]", f"force = [{force}, 0.0]"))) for force in (4.0, 8.0)
    )
    assert 0.1 < strong["turn right"] < 1.0
    assert stronger["turn right"] == pytest.approx(strong["turn right"] / 2.0, abs=0.011)  # levels are hundredths
    assert stronger["engine"] == strong["engine"]


def test_bot_is_the_skilled_player_of_landing_alone() -> None:
    assert isinstance(POLICIES["skilled"](SCENE), LandingBot)
    duel = load(find("duel"))
    with pytest.raises(UnsuitableSceneError, match="landing"):
        play_out(duel, LandingBot(1))


@pytest.mark.parametrize("skill", [-0.1, 1.1, math.nan])
def test_skill_out_of_range_is_refused(skill: float) -> None:
    with pytest.raises(ValueError, match="0 to 1"):
        LandingBot(1, skill)


def test_rules_state_the_ship_and_the_pad() -> None:
    rules = Landing(SCENE, SCENE.bodies)
    assert rules.gravity == 1.62
    assert rules.pad == (20.0, pytest.approx(2.9 + 0.3))  # middle of the wall, at its upper side
    assert SCENE.bodies.names[rules.ship] == "ship"
