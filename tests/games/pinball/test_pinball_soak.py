"""Shipped tables under play, a game each at night: no ball is stuck, lost or not finite."""

import copy
import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.contract import Observer
from sandbox.engines.switching import start
from sandbox.games.contract import Policy
from sandbox.games.pinball.ball_control import SEARCH_AFTER
from sandbox.games.pinball.bot import PinballBot
from sandbox.games.pinball.playfield import TABLE_MARGIN
from sandbox.games.pinball.rules import PinballRules
from sandbox.games.players import RandomInput
from sandbox.games.session import GameSession
from sandbox.measure.run.runner import TimedAudit
from sandbox.measure.run.sessions import play_out
from sandbox.scene.compile.scene import Scene
from sandbox.scene.files.load import load
from sandbox.trajectory import Frame
from tests.games.pinball.passing_watch import TIP, PassageObserver

pytestmark = pytest.mark.fail_slow(60)  # long runs and sweeps

TABLES = sorted((Path(__file__).parents[3] / "scenes" / "pinball").glob("*.toml"))


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
        self.low, self.high = np.add(
            rules.board.corners, [[TABLE_MARGIN], [-TABLE_MARGIN]]
        )  # bounds of the static elements

    def check(self, frame: Frame) -> None:
        rules, balls = self.rules, list(self.rules.board.balls)
        positions = frame.position[balls]
        assert np.isfinite(frame.position).all()
        assert np.isfinite(frame.velocity).all()
        assert (positions >= self.low).all(), (frame.time, positions)
        assert (positions <= self.high).all(), (frame.time, positions)
        for ball in balls:
            in_lane = rules.board.in_lane(*frame.position[ball].tolist())
            waits = ball not in rules.trough.in_play or ball in rules.holes.held or in_lane
            rests = not waits and not rules.raised_sides and math.hypot(*frame.velocity[ball].tolist()) < 0.005
            self.rest[ball] = self.rest[ball] + self.dt if rests else 0.0
            # a ball search takes half of SEARCH_AFTER
            assert self.rest[ball] <= SEARCH_AFTER + SEARCH_AFTER / 2.0, (frame.time, frame.position[ball])


def play(scene: Scene, policy: Policy, seconds: float) -> Game:
    """Play one game, for at most `seconds`."""
    simulation = start(scene, "pymunk")
    simulation.contacts()
    auditor = TimedAudit(scene, simulation)
    rules = PinballRules(scene, simulation.bodies)
    watch = PassageObserver(scene, simulation.bodies, rules.board.balls)
    simulation.watch(_Both(auditor, watch))
    referee, checker, messages = GameSession(rules), BallChecker(rules, scene.solver.dt), list[tuple[float, str]]()
    while rules.game_over is None and simulation.time < seconds:
        frame = simulation.frame()
        checker.check(frame)
        own = referee.on_step(simulation.time, frame, simulation.contacts())
        pressed = [
            action
            for control, value in policy.decide(referee.step_info, rules)
            for action in referee.record_input(simulation.time, control, value)
        ]
        if not messages or messages[-1][1] != rules.message[0]:
            messages.append((simulation.time, rules.message[0]))
        referee.note_actions(pressed)
        for action in (*own, *pressed):
            simulation.apply(action)
        simulation.step()
    missed = [(t, *named(scene, pair)) for t, pair in zip(*auditor.missed, strict=True)]
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


@pytest.mark.parametrize(
    ("policy", "seconds"),
    [
        (PinballBot(1, 0.8), 12.0),
        pytest.param(PinballBot(1, 0.2), 300.0, marks=pytest.mark.nightly),  # s: a game lasts one to two minutes
        pytest.param(RandomInput(1), 300.0, marks=pytest.mark.nightly),
    ],
    ids=["skilled", "clumsy", "random"],
)
@pytest.mark.parametrize("path", TABLES, ids=lambda path: path.stem)
def test_no_ball_is_stuck_lost_or_passes_through_an_element(path: Path, policy: Policy, seconds: float) -> None:
    game = play(load(path), copy.deepcopy(policy), seconds)
    assert game.missed == []
    assert game.passages == []
    assert game.max_depth < TIP
    assert game.rules.score > 0
    words = [text for _, text in game.messages]
    for trouble in ("ball found", "ball returned", "ball gone", *(["ball search"] if seconds < 100.0 else [])):
        assert trouble not in words, game.messages
    assert seconds < 100.0 or game.rules.game_over is not None


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
