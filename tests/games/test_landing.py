"""Landing: rules, reference cases, and the bot, which lands, worse with less skill."""

import math

import pytest

from sandbox.engines.registry import able
from sandbox.engines.switching import start
from sandbox.games.contract import HasRanking, Press, StepInfo, UnsuitableSceneError
from sandbox.games.landing.bot import LandingBot
from sandbox.games.landing.rules import (
    FUEL_POINTS,
    LANDED,
    LANDING_POINTS,
    MAX_CRASH_POINTS,
    MAX_DESCENT_SPEED,
    MAX_START_DRIFT,
    MAX_START_OFFSET,
    TANK_CAPACITY,
    Landing,
)
from sandbox.games.players import POLICIES, ScriptedInput
from sandbox.measure.run.sessions import PlayedGame, play_out
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import dumps, load, loads
from sandbox.scene.files.shipped_scenes import find
from tests.toml_text import toml

SCENE = load(find("landing"))
G, ENGINE = 1.62, 5.0  # m/s², the Moon's and the engine's on 1 kg


def flat_text(height: float = 5.0, angle: float = 0.0) -> str:
    return (
        toml(title="Flat")
        + toml("play", game="landing")
        # the seed's start has almost no horizontal speed: 2 mm/s
        + toml("world", gravity=[0.0, -1.62], duration=30.0, seed=246)
        + toml("solver", dt=0.01)
        + toml("plane", name="pad", point=[0.0, 0.0], normal=[0.0, 1.0], friction=1.0)
        + toml("box", name="ship", position=[0.0, height], size=[3.0, 2.0], angle=angle, mass=2.0, friction=1.0)
        + toml("thrust", name="engine", body="ship", force=[0.0, 10.0], key="up")
    )


def flat(height: float = 5.0, angle: float = 0.0) -> Scene:
    return loads(flat_text(height, angle))


def assert_free_fall_crash(game: PlayedGame, height: float) -> None:
    speed = math.sqrt(2.0 * G * height)
    assert game.over is not None
    reported = float(game.over.split()[1])
    assert reported == pytest.approx(speed, abs=0.1)  # m/s: rounded to a tenth, measured a step before the contact
    assert game.recording.duration == pytest.approx(speed / G, abs=0.03)  # s: contact within two steps


@pytest.mark.nightly
@pytest.mark.parametrize("engine", able(SCENE))
def test_bot_lands_on_every_engine(engine: str) -> None:
    game = play_out(SCENE, LandingBot(1, 1.0), engine)
    assert game.over == LANDED
    assert LANDING_POINTS < game.score < LANDING_POINTS + FUEL_POINTS
    assert game.trajectory.status == "ok"


@pytest.mark.fail_slow(60)  # takes over half a second
@pytest.mark.parametrize("seed", [2, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in (1, 3, 4))])
def test_bot_lands_from_the_start_of_any_seed(seed: int) -> None:
    scene = load(find("landing"), [("world.seed", seed)])
    game = play_out(scene, LandingBot(1, 1.0))
    assert game.over == LANDED
    assert game.score > 300  # of 100 for the landing and 900 for a full tank
    displacement = game.trajectory.position[1, 0] - SCENE.bodies.position[0]  # after the first step
    in_that_step = 0.01 * (5.0 + MAX_START_DRIFT)
    assert abs(displacement[0]) <= MAX_START_OFFSET + in_that_step


@pytest.mark.fail_slow(60)  # compiles kernels of `reference`
@pytest.mark.parametrize("engine", able(flat()))
def test_ship_without_thrust_falls_freely_and_crashes(engine: str) -> None:
    assert_free_fall_crash(play_out(flat(), "none", engine), height=4.0)  # the box is half of 2 m tall


def test_slow_contact_is_a_landing_and_remaining_fuel_scores() -> None:
    """Dropped from a height that gives less than `MAX_DESCENT_SPEED` it lands without thrust, with a full tank."""
    height = 0.9 * MAX_DESCENT_SPEED**2 / (2.0 * G)
    game = play_out(flat(1.0 + height), "none")
    assert (game.over, game.score) == (LANDED, LANDING_POINTS + FUEL_POINTS)
    burn_time = 0.5  # s of throttle 0.1, which hardly slows the fall: it burns 5 m/s² · 0.1 · 0.5 s
    burning = play_out(flat(1.0 + height), ScriptedInput([Press(0.0, "engine", 0.1), Press(burn_time, "engine", 0.0)]))
    assert burning.over == LANDED
    # One step of tolerance: the rules read a throttle at the end of the first step in which it acts.
    assert burning.score == pytest.approx(
        LANDING_POINTS + FUEL_POINTS * (1.0 - 5.0 * 0.1 * burn_time / TANK_CAPACITY), abs=1.0
    )


def test_tilted_contact_is_a_crash() -> None:
    game = play_out(flat(1.7, angle=0.4), "none")
    assert game.over == "crashed: tilted by 23° (limit 15°)"
    assert 0 < game.score <= MAX_CRASH_POINTS


@pytest.mark.fail_slow(60)  # takes over half a second
def test_empty_tank_stops_the_engine() -> None:
    game = play_out(flat(200.0), ScriptedInput([Press(0.0, "engine", 1.0)]))
    stop = game.recording.actions[-1]
    assert stop.kind == "throttle"
    assert stop.level == 0.0
    assert stop.time == pytest.approx(TANK_CAPACITY / 5.0, abs=0.011)  # s, at 5 m/s²: within a step
    # From then on gravity alone acts.
    run = game.trajectory
    late = run.time > stop.time + 0.02
    fall = (run.velocity[late, 0, 1][-2] - run.velocity[late, 0, 1][0]) / (run.time[late][-2] - run.time[late][0])
    assert fall == pytest.approx(-G, rel=1e-6)


def test_ship_that_flies_away_is_lost() -> None:
    game = play_out(SCENE, ScriptedInput([Press(0.0, "engine", 1.0)]))
    assert game.over == "lost in space"
    assert game.score <= MAX_CRASH_POINTS


def test_contact_beside_the_pad_is_a_crash() -> None:
    game = play_out(SCENE, "none")
    assert game.over == "crashed outside the pad"
    contact = list(game.trajectory.contact_pair[-1])
    assert contact != [0, -2]  # -2 is the pad


@pytest.mark.parametrize("missing", ['name = "pad"', 'name = "ship"', 'key = "up"'])
def test_scene_without_pad_ship_or_engine_is_refused(missing: str) -> None:
    text = flat_text().replace(missing, "").replace('body = "ship"', 'body = "box-1"')
    if missing != 'name = "ship"':
        text = text.replace('body = "box-1"', 'body = "ship"')
    scene = loads(text)
    with pytest.raises(UnsuitableSceneError, match="landing needs a body 'ship', a fixed element 'pad', and a thrust"):
        Landing(scene, scene.bodies)


def test_panel_marks_values_that_would_be_a_crash() -> None:
    rules = Landing(SCENE, SCENE.bodies)
    from sandbox.engines.switching import start

    relay = start(SCENE)
    rules.on_step(StepInfo(0.0, relay.frame(), relay.contacts(), ()))
    lines = dict(rules.display_lines())
    assert lines["fuel"] == "100 %"
    assert lines["sideways"] == "+5.0 m/s !"
    assert lines["tilt"] == "0°"
    relay.close()


def play(seed: int, skill: float) -> PlayedGame:
    return play_out(load(find("landing"), [("world.seed", seed)]), LandingBot(seed, skill))


@pytest.mark.fail_slow(60)  # twenty games, 35 s on a busy computer
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


@pytest.mark.parametrize(("height", "angle", "is_ranked"), [(1.1, 0.0, True), (1.7, 0.4, False), (50.0, 0.0, False)])
def test_only_a_landing_is_ranked_as_a_high_score(height: float, angle: float, is_ranked: bool) -> None:
    scene = flat(height, angle)
    rules, simulation = Landing(scene, scene.bodies), start(scene, "pymunk")
    assert isinstance(rules, HasRanking)
    assert not rules.is_ranked
    while rules.game_over is None:
        rules.on_step(StepInfo(simulation.time, simulation.frame(), simulation.contacts(), ()))
        simulation.step()
    assert rules.is_ranked is (rules.game_over == LANDED) is is_ranked
