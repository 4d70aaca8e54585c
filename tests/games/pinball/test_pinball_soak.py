"""Shipped tables under long play: nothing is stuck for good, lost, or not finite."""

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from sandbox.action import Move
from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.contract import Observer
from sandbox.engines.switching import start
from sandbox.games.contract import Policy
from sandbox.games.pinball.ball_control import SEARCH_AFTER
from sandbox.games.pinball.bot import PinballBot
from sandbox.games.pinball.playfield import MARGIN
from sandbox.games.pinball.rules import PinballRules
from sandbox.games.players import RandomInput
from sandbox.games.session import GameSession
from sandbox.measure.run.runner import TimedAudit
from sandbox.measure.run.sessions import play_out
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import load
from sandbox.trajectory import Frame
from tests.games.pinball.passing_watch import TIP, Watch

pytestmark = pytest.mark.full  # long runs and sweeps

TABLES = sorted((Path(__file__).parents[3] / "scenes" / "pinball").glob("*.toml"))

PLAYERS = {
    "skilled": lambda seed: PinballBot(seed, 0.8),
    "clumsy": lambda seed: PinballBot(seed, 0.2),
    "random": RandomInput,
}


PARTS = [*(("random", 1 + 100 * k) for k in range(6)), ("clumsy", 1), ("skilled", 1), ("skilled", 101)]
"""of the long play: who plays, and the seed of the first game"""


def seeded(path: Path, seed: int) -> Scene:
    scene = load(path)
    return scene.model_copy(update={"world": scene.world.model_copy(update={"seed": seed})})


class Game(NamedTuple):
    """What became of one."""

    rules: PinballRules
    said: list[tuple[float, str]]
    """and when, s"""
    seconds: float
    missed: list[tuple[float, str, str]]
    """contacts that the engine missed: when, s, and between whom"""
    through: list[tuple[float, str]]
    """balls that went through a bat, or a gate from its wrong side: when, s, and which of the two"""
    deepest: float
    """m, that a ball got into a bat"""


class Keeper:
    """Looks after balls: all are finite and on the table, and none lies where nobody can help it."""

    def __init__(self, rules: PinballRules, dt: float) -> None:
        self.rules, self.dt, self.rest = rules, dt, dict.fromkeys(rules.board.balls, 0.0)
        self.low, self.high = np.add(rules.board.corners, [[MARGIN], [-MARGIN]])  # of all that is fixed

    def look(self, frame: Frame) -> None:
        rules, balls = self.rules, list(self.rules.board.balls)
        places = frame.position[balls]
        assert np.isfinite(frame.position).all()
        assert np.isfinite(frame.velocity).all()
        assert (places >= self.low).all(), (frame.time, places)
        assert (places <= self.high).all(), (frame.time, places)
        for ball in balls:
            in_lane = rules.board.in_lane(*frame.position[ball].tolist())
            waits = ball not in rules.trough.live or ball in rules.holes.held or in_lane
            rests = not waits and not rules.up and math.hypot(*frame.velocity[ball].tolist()) < 0.005
            self.rest[ball] = self.rest[ball] + self.dt if rests else 0.0
            assert self.rest[ball] <= SEARCH_AFTER + SEARCH_AFTER / 2.0, (
                frame.time,
                frame.position[ball],
            )  # a round of search


def play(scene: Scene, policy: Policy, seconds: float, audit: bool = False) -> Game:
    """Play one game, for so long at most, s."""
    simulation = start(scene, "pymunk")
    simulation.contacts()
    auditor = TimedAudit(scene, simulation) if audit else None
    rules = PinballRules(scene, simulation.bodies)
    watch = Watch(scene, simulation.bodies, rules.board.balls)
    if auditor is not None:
        simulation.watch(_Both(auditor, watch))
    referee, keeper, said = GameSession(rules), Keeper(rules, scene.solver.dt), list[tuple[float, str]]()
    while rules.game_over is None and simulation.time < seconds:
        frame = simulation.frame()
        keeper.look(frame)
        own = referee.on_step(simulation.time, frame, simulation.contacts())
        pressed = [
            action
            for control, value in policy.decide(referee.step_info, rules)
            for action in referee.press(simulation.time, control, value)
        ]
        if not said or said[-1][1] != rules.said[0]:
            said.append((simulation.time, rules.said[0]))
        referee.note_actions(pressed)
        for action in (*own, *pressed):
            simulation.apply(action)
        simulation.step()
    missed = [] if auditor is None else [(t, *named(scene, pair)) for t, pair in zip(*auditor.missed, strict=True)]
    return Game(rules, said, simulation.time, missed, watch.through, watch.deepest)


class _Both:
    """Two observers of one simulation."""

    def __init__(self, *those: Observer) -> None:
        self.those = those

    def __call__(self, time: float, start: FloatArray, end: FloatArray, touching: IntArray) -> None:
        for each in self.those:
            each(time, start, end, touching)


def named(scene: Scene, pair: IntArray) -> tuple[str, str]:
    first, second = pair.tolist()
    return scene.bodies.names[first], scene.bodies.names[second] if second >= 0 else scene.fixed_names[-1 - second]


@pytest.mark.slow
@pytest.mark.parametrize(("player", "first"), PARTS)
@pytest.mark.parametrize("path", TABLES, ids=lambda path: path.stem)
def test_no_ball_is_stuck_lost_or_through_anything_in_an_hour_of_play(path: Path, player: str, first: int) -> None:
    """An hour of random play on each table, half an hour of others, in nine parts that workers can share."""
    left, seed, games = 600.0, first, 0
    while left > 0.0:
        game = play(seeded(path, seed), PLAYERS[player](seed), left, audit=True)
        assert game.missed == [], seed
        assert game.through == [], seed
        assert game.deepest < TIP, seed
        words = [text for _, text in game.said]
        for trouble in ("ball found", "ball returned", "ball gone"):
            assert trouble not in words, (seed, game.said)
        games += game.rules.game_over is not None
        left, seed = left - game.seconds, seed + 1
    assert games >= 2  # of one to two minutes


@pytest.mark.parametrize("path", TABLES, ids=lambda path: path.stem)
def test_game_is_played_and_scored(path: Path) -> None:
    game = play(seeded(path, 1), PinballBot(1), 15.0)
    assert game.rules.score > 0
    assert "ball search" not in [text for _, text in game.said]


def test_multiball_of_the_full_table_puts_all_balls_into_play() -> None:
    scene = seeded(next(path for path in TABLES if path.stem == "full"), 1)
    simulation = start(scene, "pymunk")
    simulation.contacts()
    rules = PinballRules(scene, simulation.bodies)
    referee, hand = GameSession(rules), PinballBot(1, 0.8)
    store = simulation.frame().position[rules.board.balls[1]].copy()
    most = 0
    while simulation.time < 12.0:
        frame = simulation.frame()
        own = referee.on_step(simulation.time, frame, simulation.contacts())
        pressed = []
        if simulation.time > 2.0:
            pressed = [
                a for c, v in hand.decide(referee.step_info, rules) for a in referee.press(simulation.time, c, v)
            ]
        referee.note_actions(pressed)
        for action in (*own, *pressed):
            simulation.apply(action)
        if abs(simulation.time - 1.0) < 1e-9:  # the third ball comes into the lock
            assert np.array_equal(frame.position[rules.board.balls[1]], store)  # the others have not stirred
            rules.sheet.locked, rules.sheet.lit = 2, True
            hole = next(each for each in rules.board.of_role("kicker") if each.group == "lock")
            simulation.apply(Move(time=1.0, body="ball", position=hole.where, velocity=(0.0, 0.0)))
        simulation.step()
        most = max(most, len(rules.trough.flown))
    assert rules.sheet.score >= 10_000
    assert most == 3


SCRIPT = """\
0.5, plunger, 1  # all the way, which takes a while
1.7, plunger, 0
5.0, left flipper, 1
5.2, left flipper, 0
5.5, right flipper, 1
5.7, right flipper, 0
"""


@pytest.mark.parametrize("path", TABLES, ids=lambda path: path.stem)
def test_script_of_one_shot_scores(path: Path, tmp_path: Path) -> None:
    (tmp_path / "shot.txt").write_text(SCRIPT)
    scene = load(path, ("world.duration=10.0",))
    assert play_out(scene, str(tmp_path / "shot.txt")).score > 0
    assert play_out(scene, "none").score == 0
