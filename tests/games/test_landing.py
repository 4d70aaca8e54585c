"""Landing: what is a crash, what is none, and what fuel costs, on every engine that can."""

import math
from collections.abc import Sequence

import pytest

from sandbox.engines.registry import able
from sandbox.games.contract import Press, Rules, StepInfo, UnsuitableSceneError
from sandbox.games.landing.rules import (
    DOWN,
    ELSEWHERE,
    FASTER,
    FOR_A_CRASH,
    FOR_FUEL,
    FOR_LANDING,
    LANDED,
    TANK,
    Landing,
)
from sandbox.games.players import ScriptedInput
from sandbox.measure.run.sessions import PlayedGame, play_out
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import load, loads
from sandbox.scene.files.shipped_scenes import find

SCENE = load(find("landing"))
G, ENGINE = 1.62, 5.0  # m/s², the Moon's and the engine's on 1 kg

FLAT = """
title = "Flat"
[play]
game = "landing"
[world]
gravity = [0.0, -1.62]
duration = 30.0
seed = 246   # of a game that begins at hardly any speed aside: 2 mm/s
[solver]
dt = 0.01
[[plane]]
name = "pad"
point = [0.0, 0.0]
normal = [0.0, 1.0]
friction = 1.0
[[box]]
name = "ship"
position = [0.0, {height}]
size = [3.0, 2.0]
angle = {angle}
mass = 2.0
friction = 1.0
[[thrust]]
name = "engine"
body = "ship"
force = [0.0, 10.0]
key = "up"
"""


class Autopilot:
    """Comes down on the pad by what the score panel's figures tell: it knows the rules, and no engine."""

    def decide(self, info: StepInfo, rules: Rules) -> Sequence[tuple[str, float]]:
        assert isinstance(rules, Landing)
        ship, frame = rules._ship, info.frame
        x, _ = frame.position[ship].tolist()
        vx, vy = frame.velocity[ship].tolist()
        angle, rate = math.remainder(float(frame.angle[ship]), math.tau), float(frame.angular_velocity[ship])
        to_go, height = rules._place[0] - x, rules._height(frame)
        near = abs(to_go) < 3.0 and abs(vx) < 0.8
        wanted = max(min(0.25 * to_go, 5.0), -5.0)
        lean = max(min(0.35 * (wanted - vx), 0.5), -0.5)  # rad to the right, which pushes there
        turn = 4.0 * (-lean - angle) - 4.0 * rate
        sink = -0.8 - 0.12 * height if near else (0.8 * (10.0 - height) if height < 10.0 else -2.0)
        push = (G + 2.0 * (sink - vy)) / (ENGINE * max(math.cos(angle), 0.5))
        levels = {"engine": push, "turn left": turn, "turn right": -turn}
        return [(name, round(min(max(level, 0.0), 1.0), 2)) for name, level in levels.items()]


def flat(height: float = 5.0, angle: float = 0.0) -> Scene:
    return loads(FLAT.format(height=height, angle=angle))


def assert_freely_fallen(game: PlayedGame, height: float) -> None:
    speed = math.sqrt(2.0 * G * height)
    assert game.over is not None
    told = float(game.over.split()[1])
    assert told == pytest.approx(speed, abs=0.1)  # m/s: told to a tenth, seen a step before the touch
    assert game.recording.duration == pytest.approx(speed / G, abs=0.03)  # s: touched within two steps


@pytest.mark.slow
@pytest.mark.parametrize("engine", able(SCENE))
def test_autopilot_lands_on_every_engine(engine: str) -> None:
    game = play_out(SCENE, Autopilot(), engine)
    assert game.over == LANDED
    assert FOR_LANDING < game.score < FOR_LANDING + FOR_FUEL
    assert game.trajectory.status == "ok"


@pytest.mark.parametrize("seed", range(2, 5))
def test_autopilot_lands_wherever_a_seed_begins(seed: int) -> None:
    scene = load(find("landing"), [("world.seed", seed)])
    game = play_out(scene, Autopilot())
    assert game.over == LANDED
    begin = game.trajectory.position[1, 0] - SCENE.bodies.position[0]  # after the first step
    assert abs(begin[0]) <= ELSEWHERE + 0.01 * (5.0 + FASTER)  # and so far it flies in that step


@pytest.mark.parametrize("engine", able(flat()))
def test_who_does_nothing_falls(engine: str) -> None:
    assert_freely_fallen(play_out(flat(), "none", engine), height=4.0)  # the box is half of 2 m tall


def test_slow_touch_is_a_landing_and_fuel_counts() -> None:
    """From a height that is fallen at less than `DOWN` it lands by itself, with a full tank."""
    height = 0.9 * DOWN**2 / (2.0 * G)
    game = play_out(flat(1.0 + height), "none")
    assert (game.over, game.score) == (LANDED, FOR_LANDING + FOR_FUEL)
    burnt = 0.5  # s of an engine at a tenth, which hardly slows it: 5 m/s² · 0.1 · 0.5 s of TANK m/s
    spent = play_out(flat(1.0 + height), ScriptedInput([Press(0.0, "engine", 0.1), Press(burnt, "engine", 0.0)]))
    assert spent.over == LANDED
    # A step more or less: the rules see a throttle at the end of the first step that it acts in.
    assert spent.score == pytest.approx(FOR_LANDING + FOR_FUEL * (1.0 - 5.0 * 0.1 * burnt / TANK), abs=1.0)


def test_tilted_touch_is_a_crash() -> None:
    game = play_out(flat(1.7, angle=0.4), "none")
    assert game.over == "crashed: tilted by 23° (limit 15°)"
    assert 0 < game.score <= FOR_A_CRASH


def test_empty_tank_stops_the_engine() -> None:
    game = play_out(flat(200.0), ScriptedInput([Press(0.0, "engine", 1.0)]))
    stop = game.recording.actions[-1]
    assert stop.kind == "throttle"
    assert stop.level == 0.0
    assert stop.time == pytest.approx(TANK / 5.0, abs=0.011)  # s, at 5 m/s²: within a step
    # From there on it is thrown up, and gravity alone acts.
    run = game.trajectory
    late = run.time > stop.time + 0.02
    fall = (run.velocity[late, 0, 1][-2] - run.velocity[late, 0, 1][0]) / (run.time[late][-2] - run.time[late][0])
    assert fall == pytest.approx(-G, rel=1e-6)


def test_who_flies_away_is_lost() -> None:
    game = play_out(SCENE, ScriptedInput([Press(0.0, "engine", 1.0)]))
    assert game.over == "lost in space"
    assert game.score <= FOR_A_CRASH


def test_crash_beside_the_pad_is_none_of_a_landing() -> None:
    game = play_out(SCENE, "none")
    assert game.over == "crashed outside the pad"
    contact = list(game.trajectory.contact_pair[-1])
    assert contact != [0, -2]  # which is the pad


@pytest.mark.parametrize("lacks", ['name = "pad"', 'name = "ship"', 'key = "up"'])
def test_scene_that_lacks_something_is_refused(lacks: str) -> None:
    text = FLAT.format(height=5.0, angle=0.0).replace(lacks, "").replace('body = "ship"', 'body = "box-1"')
    if lacks != 'name = "ship"':
        text = text.replace('body = "box-1"', 'body = "ship"')
    scene = loads(text)
    with pytest.raises(UnsuitableSceneError, match="landing needs a body 'ship', a fixed element 'pad', and a thrust"):
        Landing(scene, scene.bodies)


def test_panel_tells_what_would_be_a_crash() -> None:
    rules = Landing(SCENE, SCENE.bodies)
    from sandbox.engines.switching import start

    relay = start(SCENE)
    rules.on_step(StepInfo(0.0, relay.frame(), relay.contacts(), ()))
    lines = dict(rules.display_lines())
    assert lines["fuel"] == "100 %"
    assert lines["sideways"] == "+5.0 m/s !"
    assert lines["tilt"] == "0°"
    relay.close()
