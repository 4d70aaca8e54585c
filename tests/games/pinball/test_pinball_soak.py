"""Shipped tables under long play: no ball is stuck, lost or not finite."""

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
from tests.games.pinball.passing_watch import TIP, PassageObserver

pytestmark = pytest.mark.full  # long runs and sweeps

TABLES = sorted((Path(__file__).parents[3] / "scenes" / "pinball").glob("*.toml"))

PLAYERS = {
    "skilled": lambda seed: PinballBot(seed, 0.8),
    "clumsy": lambda seed: PinballBot(seed, 0.2),
    "random": RandomInput,
}


PARTS = [*(("random", 1 + 200 * k) for k in range(3)), ("clumsy", 1), ("skilled", 1), ("skilled", 101)]
"""long play: player, and seed of the first game"""


def seeded(path: Path, seed: int) -> Scene:
    scene = load(path)
    return scene.model_copy(update={"world": scene.world.model_copy(update={"seed": seed})})


class Game(NamedTuple):
    """Result of a game."""

    rules: PinballRules
    messages: list[tuple[float, str]]
    """time, s, and text"""
    seconds: float
    missed: list[tuple[float, str, str]]
    """contacts that the engine missed: time, s, and the two bodies"""
    passages: list[tuple[float, str]]
    """balls that passed through a flipper, or a gate from its solid side: time, s, and element"""
    max_depth: float
    """m, overlap of a ball with a flipper"""


class BallChecker:
    """Checks that all balls are finite and on the table, and that none stays at rest out of reach."""

    def __init__(self, rules: PinballRules, dt: float) -> None:
        self.rules, self.dt, self.rest = rules, dt, dict.fromkeys(rules.board.balls, 0.0)
        self.low, self.high = np.add(rules.board.corners, [[MARGIN], [-MARGIN]])  # bounds of the static elements

    def check(self, frame: Frame) -> None:
        rules, balls = self.rules, list(self.rules.board.balls)
        positions = frame.position[balls]
        assert np.isfinite(frame.position).all()
        assert np.isfinite(frame.velocity).all()
        assert (positions >= self.low).all(), (frame.time, positions)
        assert (positions <= self.high).all(), (frame.time, positions)
        for ball in balls:
            in_lane = rules.board.in_lane(*frame.position[ball].tolist())
            waits = ball not in rules.trough.live or ball in rules.holes.held or in_lane
            rests = not waits and not rules.up and math.hypot(*frame.velocity[ball].tolist()) < 0.005
            self.rest[ball] = self.rest[ball] + self.dt if rests else 0.0
            # a ball search takes half of SEARCH_AFTER
            assert self.rest[ball] <= SEARCH_AFTER + SEARCH_AFTER / 2.0, (frame.time, frame.position[ball])


def play(scene: Scene, policy: Policy, seconds: float, audit: bool = False) -> Game:
    """Play one game, for at most `seconds`."""
    simulation = start(scene, "pymunk")
    simulation.contacts()
    auditor = TimedAudit(scene, simulation) if audit else None
    rules = PinballRules(scene, simulation.bodies)
    watch = PassageObserver(scene, simulation.bodies, rules.board.balls)
    if auditor is not None:
        simulation.watch(_Both(auditor, watch))
    referee, checker, messages = GameSession(rules), BallChecker(rules, scene.solver.dt), list[tuple[float, str]]()
    while rules.game_over is None and simulation.time < seconds:
        frame = simulation.frame()
        checker.check(frame)
        own = referee.on_step(simulation.time, frame, simulation.contacts())
        pressed = [
            action
            for control, value in policy.decide(referee.step_info, rules)
            for action in referee.press(simulation.time, control, value)
        ]
        if not messages or messages[-1][1] != rules.message[0]:
            messages.append((simulation.time, rules.message[0]))
        referee.note_actions(pressed)
        for action in (*own, *pressed):
            simulation.apply(action)
        simulation.step()
    missed = [] if auditor is None else [(t, *named(scene, pair)) for t, pair in zip(*auditor.missed, strict=True)]
    return Game(rules, messages, simulation.time, missed, watch.passages, watch.max_depth)


class _Both:
    """Two observers of one simulation."""

    def __init__(self, *observers: Observer) -> None:
        self.observers = observers

    def __call__(self, time: float, start: FloatArray, end: FloatArray, touching: IntArray) -> None:
        for each in self.observers:
            each(time, start, end, touching)


def named(scene: Scene, pair: IntArray) -> tuple[str, str]:
    first, second = pair.tolist()
    return scene.bodies.names[first], scene.bodies.names[second] if second >= 0 else scene.fixed_names[-1 - second]


@pytest.mark.slow
@pytest.mark.parametrize(("player", "first"), PARTS)
@pytest.mark.parametrize("path", TABLES, ids=lambda path: path.stem)
def test_no_ball_is_stuck_lost_or_passes_through_an_element_in_an_hour(path: Path, player: str, first: int) -> None:
    """An hour of random play on each table and half an hour of bots, in nine parts that run in parallel."""
    remaining, seed, games = 600.0, first, 0
    while remaining > 0.0:
        game = play(seeded(path, seed), PLAYERS[player](seed), remaining, audit=True)
        assert game.missed == [], seed
        assert game.passages == [], seed
        assert game.max_depth < TIP, seed
        words = [text for _, text in game.messages]
        for trouble in ("ball found", "ball returned", "ball gone"):
            assert trouble not in words, (seed, game.messages)
        games += game.rules.game_over is not None
        remaining, seed = remaining - game.seconds, seed + 1
    assert games >= 2  # a game lasts one to two minutes


@pytest.mark.parametrize("path", TABLES, ids=lambda path: path.stem)
def test_game_is_played_and_scored(path: Path) -> None:
    game = play(seeded(path, 1), PinballBot(1), 15.0)
    assert game.rules.score > 0
    assert "ball search" not in [text for _, text in game.messages]


def test_multiball_of_the_full_table_launches_all_balls() -> None:
    scene = seeded(next(path for path in TABLES if path.stem == "full"), 1)
    simulation = start(scene, "pymunk")
    simulation.contacts()
    rules = PinballRules(scene, simulation.bodies)
    referee, bot = GameSession(rules), PinballBot(1, 0.8)
    stored = simulation.frame().position[rules.board.balls[1]].copy()
    max_balls = 0
    while simulation.time < 12.0:
        frame = simulation.frame()
        own = referee.on_step(simulation.time, frame, simulation.contacts())
        pressed = []
        if simulation.time > 2.0:
            pressed = [a for c, v in bot.decide(referee.step_info, rules) for a in referee.press(simulation.time, c, v)]
        referee.note_actions(pressed)
        for action in (*own, *pressed):
            simulation.apply(action)
        if abs(simulation.time - 1.0) < 1e-9:  # the third ball enters the lock
            assert np.array_equal(frame.position[rules.board.balls[1]], stored)  # the other balls have not moved
            rules.sheet.locked, rules.sheet.lit = 2, True
            hole = next(each for each in rules.board.of_role("kicker") if each.group == "lock")
            simulation.apply(Move(time=1.0, body="ball", position=hole.position, velocity=(0.0, 0.0)))
        simulation.step()
        max_balls = max(max_balls, len(rules.trough.flown))
    assert rules.sheet.score >= 10_000
    assert max_balls == 3


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
