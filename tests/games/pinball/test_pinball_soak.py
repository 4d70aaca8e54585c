"""Shipped tables under long play: nothing is stuck for good, lost, or not finite."""

from pathlib import Path

import numpy as np
import pytest

from sandbox.action import Move
from sandbox.engines.relay import start
from sandbox.games.pinball.hand import Hand
from sandbox.games.pinball.pinball import Pinball
from sandbox.games.policies import Chance
from sandbox.games.referee import Referee
from sandbox.games.rules import Policy
from sandbox.scene.file import load
from sandbox.scene.model import Scene

TABLES = sorted((Path(__file__).parents[3] / "scenes" / "pinball").glob("*.toml"))

PLAYERS = {"skilled": lambda seed: Hand(seed, 0.8), "clumsy": lambda seed: Hand(seed, 0.2), "random": Chance}


def seeded(path: Path, seed: int) -> Scene:
    scene = load(path)
    return scene.model_copy(update={"world": scene.world.model_copy(update={"seed": seed})})


def play(scene: Scene, policy: Policy, seconds: float) -> tuple[Pinball, list[tuple[float, str]], float]:
    """Play one game, for so long at most; return the rules, what was said and when, and how long it took, s."""
    simulation = start(scene, "pymunk")
    simulation.contacts()
    rules = Pinball(scene, simulation.bodies)
    referee, said = Referee(rules), list[tuple[float, str]]()
    while rules.over is None and simulation.time < seconds:
        frame = simulation.frame()
        assert np.isfinite(frame.position).all()
        own = referee.look(simulation.time, frame, simulation.contacts())
        pressed = [
            action
            for control, value in policy.decide(referee.seen, rules)
            for action in referee.press(simulation.time, control, value)
        ]
        if not said or said[-1][1] != rules.said[0]:
            said.append((simulation.time, rules.said[0]))
        referee.saw(pressed)
        for action in (*own, *pressed):
            simulation.apply(action)
        simulation.step()
    return rules, said, simulation.time


@pytest.mark.slow
@pytest.mark.parametrize("player", PLAYERS)
@pytest.mark.parametrize("path", TABLES, ids=lambda path: path.stem)
def test_no_ball_is_stuck_lost_or_gone_in_long_play(path: Path, player: str) -> None:
    left, seed, games = 400.0, 1, 0
    while left > 0.0:
        rules, said, took = play(seeded(path, seed), PLAYERS[player](seed), left)
        words = [text for _, text in said]
        for trouble in ("ball found", "ball lost: back to the plunger", "a ball is gone"):
            assert trouble not in words, (seed, said)
        games += rules.over is not None
        left, seed = left - took, seed + 1
    assert games >= 1 or player == "random"  # who seldom pulls the plunger far enough


@pytest.mark.parametrize("path", TABLES, ids=lambda path: path.stem)
def test_game_is_played_and_scored(path: Path) -> None:
    rules, said, _ = play(seeded(path, 1), Hand(1), 15.0)
    assert rules.score > 0
    assert "ball search" not in [text for _, text in said]


def test_multiball_of_the_full_table_puts_all_balls_into_play() -> None:
    scene = seeded(next(path for path in TABLES if path.stem == "full"), 1)
    simulation = start(scene, "pymunk")
    simulation.contacts()
    rules = Pinball(scene, simulation.bodies)
    referee, hand = Referee(rules), Hand(1, 0.8)
    store = simulation.frame().position[rules.board.balls[1]].copy()
    most = 0
    while simulation.time < 12.0:
        frame = simulation.frame()
        own = referee.look(simulation.time, frame, simulation.contacts())
        pressed = []
        if simulation.time > 2.0:
            pressed = [a for c, v in hand.decide(referee.seen, rules) for a in referee.press(simulation.time, c, v)]
        referee.saw(pressed)
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
